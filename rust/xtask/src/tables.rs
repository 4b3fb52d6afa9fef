//! `cargo x tables`: the paper's Tables 1 and 2, ours and OpenCV's on the same corners of the same pairs of frames.

use crate::compile;
use crate::environment::{OPENCV_4, OPENCV_5};
use crate::run::{root, run, say, target};
use std::path::Path;
use std::process::Command;

/// Prints the tables, and writes them as JSON if asked for.
pub fn tables(json: Option<&Path>) -> anyhow::Result<()> {
    let folder = target("bench/tables");
    compile::programs(&["bench"])?;
    let bench = |step: &str| -> Command {
        let mut command = compile::program("bench");
        command.args([step, "tables"]).arg(&folder);
        command
    };
    say("tables: pairs and corners");
    run(&mut bench("inputs"))?;
    let results = ["ours", "opencv-4", "opencv-5"].map(|side| folder.join(side).with_extension("json"));
    say("tables: matches");
    run(bench("measure").arg(&results[0]))?;
    for (peer, result) in [&OPENCV_4, &OPENCV_5].into_iter().zip(&results[1..]) {
        run(peer.python()?.arg(root().join("rust/bench/peers/tables.py")).arg(&folder).arg(result))?;
    }
    run(bench("table").args(&results))?;
    if let Some(json) = json {
        std::fs::copy(folder.join("tables.json"), json)?;
    }
    Ok(())
}
