//! `cargo x cross`: the library type-checked for systems that this machine is not.

use crate::run::{cargo, run, say, target};
use std::process::Command;

/// The systems that the workflow makes wheels for; the standard library of each is fetched by rustup.
const TARGETS: [&str; 5] = [
    "x86_64-unknown-linux-gnu",
    "aarch64-unknown-linux-gnu",
    "x86_64-pc-windows-msvc",
    "aarch64-apple-darwin",
    "x86_64-apple-darwin",
];

/// Checks what goes into wheels, and the program. Nothing is linked, so no other system's linker is needed.
pub fn cross() -> anyhow::Result<()> {
    for system in TARGETS {
        say(system);
        run(Command::new("rustup").args(["target", "add", system]))?;
        let mut check = cargo(&["check", "--locked", "--release", "--quiet", "--package", "facewright"]);
        check.args(["--package", "facewright-python", "--target", system]);
        run(check.arg("--target-dir").arg(target("cross")))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::root;

    #[test]
    fn what_is_checked_is_what_the_workflow_makes_wheels_for() {
        let workflow = std::fs::read_to_string(root().join(".github/workflows/ci.yml")).unwrap();
        let made: Vec<&str> = workflow.lines().filter_map(|line| line.trim().strip_prefix("target: ")).collect();
        assert_eq!(made, TARGETS);
    }
}
