//! The converted nets answer as Google's own interpreter does: `litert.py` asked it and wrote `litert.json`.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use rten::Model;
use rten_tensor::{NdTensor, Tensor, prelude::*};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Largest difference, relative to the largest number of an output.
const AGREEMENT: f64 = 1e-3;

fn here() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

/// The built net, if `cargo x head` has run.
fn net(name: &str) -> Option<Model> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../target/assets/nets/{name}.onnx"));
    if !path.is_file() {
        eprintln!("skipped: {} has not been built", path.display());
        return None;
    }
    Some(Model::load_file(path).unwrap())
}

fn number(value: &Value, name: &str) -> usize {
    value[name].as_u64().unwrap() as usize
}

/// The crop of `litert.png` that a net looked at: three planes, 0…1.
fn crop(asked: &Value) -> NdTensor<f32, 4> {
    let picture = image::open(here().join("litert.png")).unwrap().into_rgb8();
    let (left, top, side) = (number(asked, "left"), number(asked, "top"), number(asked, "side"));
    NdTensor::from_fn([1, 3, side, side], |[_, c, y, x]| {
        f32::from(picture.get_pixel((left + x) as u32, (top + y) as u32).0[c]) / 255.0
    })
}

/// Largest difference of an output from the interpreter's, relative to its largest number.
fn difference(answer: &[f32], wanted: &Value) -> f64 {
    assert_eq!(answer.len(), number(wanted, "length"));
    let values = wanted["values"].as_array().unwrap();
    let pairs = answer.iter().step_by(number(wanted, "step")).zip(values);
    let largest = pairs.map(|(a, b)| (f64::from(*a) - b.as_f64().unwrap()).abs()).fold(0.0, f64::max);
    largest / wanted["largest"].as_f64().unwrap()
}

#[test]
fn every_net_agrees_with_the_interpreter_it_was_made_for() {
    let asked: Value = serde_json::from_slice(&std::fs::read(here().join("litert.json")).unwrap()).unwrap();
    for (name, asked) in asked.as_object().unwrap() {
        let Some(model) = net(name) else { return };
        let input = crop(asked);
        let answers = model.run(vec![(model.input_ids()[0], input.view().into())], model.output_ids(), None).unwrap();
        let wanted = asked["outputs"].as_array().unwrap();
        assert_eq!(answers.len(), wanted.len());
        for answer in answers {
            let answer = Tensor::<f32>::try_from(answer).unwrap().to_vec();
            let wanted = wanted.iter().find(|w| number(w, "length") == answer.len()).unwrap();
            let found = difference(&answer, wanted);
            assert!(found < AGREEMENT, "{name}: {found:.1e}");
        }
    }
}
