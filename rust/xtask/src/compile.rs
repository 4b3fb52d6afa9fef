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

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Crates with their features, when these packages are compiled.
    fn features(packages: &[&str]) -> BTreeSet<String> {
        let mut tree =
            cargo(&["tree", "--locked", "--edges", "normal,build", "--prefix", "none", "--format", "{p}|{f}"]);
        tree.args(packages.iter().flat_map(|package| ["--package", package]));
        let lines = String::from_utf8(tree.output().unwrap().stdout).unwrap();
        lines.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
    }

    #[test]
    fn no_program_asks_for_a_feature_that_the_native_module_has_not() {
        let module = features(&[ALL_FEATURES]);
        assert!(module.len() > 100, "{module:?}");
        let all = features(&[ALL_FEATURES, "assets", "bench", "facewright"]);
        assert_eq!(module.difference(&all).collect::<Vec<_>>(), Vec::<&String>::new());
    }
}
