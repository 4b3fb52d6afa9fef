//! The Khronos validator's opinion on the `head.glb` of a result.

use crate::compile;
use crate::fetch::{THREE, VALIDATOR, npm_package};
use crate::run::{run, say, target};
use std::path::Path;
use std::process::Command;

/// Reconstructs the synthetic person into `target/gltf` and validates the head; fetches what tests of exported heads need besides.
pub fn gltf(assets: &Path) -> anyhow::Result<()> {
    say("glTF");
    if Command::new("node").arg("--version").output().is_err() {
        say("skipped: the glTF validator needs `node` on PATH");
        return Ok(());
    }
    npm_package(&THREE)?;
    let out = target("gltf");
    let mut facewright = compile::program("facewright");
    facewright.args(["reconstruct", "tests/data/clip/frames", "--texture-size", "512", "-o"]).arg(&out);
    run(facewright.env("FACEWRIGHT_ASSETS", assets))?;
    let mut node = Command::new("node");
    node.arg("rust/xtask/node/validate.mjs").arg(npm_package(&VALIDATOR)?).arg(out.join("head.glb"));
    run(&mut node)
}
