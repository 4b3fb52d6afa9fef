//! What a feature word must bring, and the three steps that are the same for all words.

use crate::results::{Results, Run, merged};
use crate::{files, table};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// One feature, measured.
pub trait Feature {
    /// Read by both sides.
    type Inputs: Serialize + DeserializeOwned;
    /// Read by the judge only.
    type Truth: Serialize + DeserializeOwned;
    /// What a side found out.
    type Answer: Serialize + DeserializeOwned + Send;

    /// Makes inputs and truth; pictures are written into the folder.
    fn inputs(folder: &Path) -> anyhow::Result<(Self::Inputs, Self::Truth)>;

    /// Our times and answers.
    fn measure(inputs: &Self::Inputs, folder: &Path) -> anyhow::Result<Vec<Run<Self::Answer>>>;

    /// Judges a run of any side; a figure of the same name stands beside it for each side that has one.
    fn figures(run: &Run<Self::Answer>, inputs: &Self::Inputs, truth: &Self::Truth) -> anyhow::Result<Vec<Figure>>;
}

/// A number that tells how good a run is.
#[derive(Clone, Debug)]
pub struct Figure {
    /// What it is, with its unit.
    pub what: String,
    /// Its value; not a number where there was no answer.
    pub value: f64,
    /// Whether a larger value is better.
    pub more_is_better: bool,
}

impl Figure {
    /// A time, an error: less is better.
    pub fn cost(what: &str, value: f64) -> Self {
        Self { what: what.to_owned(), value, more_is_better: false }
    }

    /// A share or a count of successes: more is better.
    pub fn gain(what: &str, value: f64) -> Self {
        Self { what: what.to_owned(), value, more_is_better: true }
    }
}

/// Writes `inputs.json`, `truth.json` and pictures.
pub fn write_inputs<F: Feature>(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)?;
    let (inputs, truth) = F::inputs(folder)?;
    files::write_json(&folder.join("inputs.json"), &inputs)?;
    files::write_json(&folder.join("truth.json"), &truth)
}

/// Writes our results, made on one thread.
pub fn measure<F: Feature>(folder: &Path, result: &Path) -> anyhow::Result<()> {
    let inputs: F::Inputs = files::read_json(&folder.join("inputs.json"))?;
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let runs = F::measure(&inputs, folder)?;
    files::write_json(result, &Results { program: format!("Facewright {}", env!("CARGO_PKG_VERSION")), runs })
}

/// Prints ours beside each peer's.
pub fn print_table<F: Feature>(folder: &Path, results: &[PathBuf]) -> anyhow::Result<()> {
    let inputs: F::Inputs = files::read_json(&folder.join("inputs.json"))?;
    let truth: F::Truth = files::read_json(&folder.join("truth.json"))?;
    let results = results.iter().map(|path| files::read_json(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let judge = |(program, run): (String, Run<F::Answer>)| -> anyhow::Result<table::Judged> {
        let figures = F::figures(&run, &inputs, &truth)?;
        Ok(table::Judged { program, case: run.case, task: run.task, setting: run.setting, figures })
    };
    table::print(&merged(results).into_iter().map(judge).collect::<anyhow::Result<Vec<_>>>()?)
}
