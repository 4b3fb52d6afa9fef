//! Compiling what the tasks run.
//!
//! Cargo unites the features of the packages that one command names, and features are part of what a crate is compiled for:
//! two commands that name different packages compile most crates twice. So all tasks compile by [`programs`] and start what
//! it leaves in `target/release`; none uses `cargo run`.

use crate::run::{cargo, run, target};
use std::path::PathBuf;
use std::process::Command;

/// The package that has every feature of all others, which is named in each command for that.
const ALL_FEATURES: &str = "facewright-python";

/// Compiles packages of the workspace, and the native module with them.
pub fn programs(packages: &[&str]) -> anyhow::Result<()> {
    let mut build = cargo(&["build", "--release", "--package", ALL_FEATURES]);
    run(build.args(packages.iter().flat_map(|package| ["--package", package])))
}

/// A program that [`programs`] has compiled.
pub fn program(name: &str) -> Command {
    Command::new(release(&format!("{name}{}", std::env::consts::EXE_SUFFIX)))
}

/// The native module that [`programs`] has compiled.
pub fn native_module() -> PathBuf {
    release(&format!("{}_native{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX))
}

fn release(file: &str) -> PathBuf {
    target("release").join(file)
}
