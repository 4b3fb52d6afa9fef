//! `cargo x check`: formatting, lints, documentation, types, layers, licences. `cargo x deny`: licences and more.

use crate::environment::{BLENDER_5_0, LINTERS};
use crate::run::{cargo, run, say};
use std::process::Command;

/// Folders with Python.
const PYTHON: [&str; 8] = [
    "addon",
    "tests",
    "blend_fixtures",
    "rust/assets/tests",
    "rust/bench/peers",
    "rust/python/examples",
    "rust/python/python",
    "rust/xtask/python",
];

/// Runs every check.
pub fn check() -> anyhow::Result<()> {
    say("formatting");
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    say("lints");
    run(&mut cargo(&["clippy", "--release", "--workspace", "--all-targets", "--quiet", "--", "--deny", "warnings"]))?;
    say("documentation");
    run(cargo(&["doc", "--release", "--workspace", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "--deny warnings"))?;
    say("Python");
    let ruff = LINTERS.program("ruff")?;
    run(Command::new(&ruff).arg("check").args(PYTHON))?;
    run(Command::new(&ruff).args(["format", "--check"]).args(PYTHON))?;
    say("types");
    let mut pyright = Command::new(LINTERS.program("pyright")?);
    pyright.args(["--warnings", "--project", ".pyright.json", "--pythonpath"]);
    run(pyright.arg(BLENDER_5_0.program("python")?))?;
    layers()?;
    say("licences and sources");
    // The advisories are fetched from their repository, and change from day to day: a check of this code is neither.
    run(&mut deny(&["check", "bans", "licenses", "sources"])?)
}

/// Licences, sources and doubles of the crates that are compiled, and what is known against them.
pub fn advisories() -> anyhow::Result<()> {
    run(&mut deny(&["check"])?)
}

/// `cargo deny`, by the rules of `.deny.toml`.
fn deny(arguments: &[&str]) -> anyhow::Result<Command> {
    let mut deny = Command::new(LINTERS.program("cargo-deny")?);
    deny.arg("--locked").args(arguments);
    Ok(deny)
}

/// The Python import arrows of DESIGN: panel → operators → actions → {scene, engine}.
pub fn layers() -> anyhow::Result<()> {
    say("layers");
    run(BLENDER_5_0.python()?.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/python/test_layers.py"]))
}
