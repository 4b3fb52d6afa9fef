//! End-to-end tests live in `tests/`; here is where they find things.

pub mod truth;

use std::path::{Path, PathBuf};

/// The synthetic person's film with its truth, `tests/data/clip`.
pub fn clip() -> PathBuf {
    root().join("tests/data/clip")
}

/// The folder of the generic head and the nets: `FACEWRIGHT_ASSETS`, or `target/assets`.
///
/// # Errors
/// A sentence that says how to build them when they are missing.
pub fn assets() -> Result<PathBuf, String> {
    let folder = std::env::var_os("FACEWRIGHT_ASSETS").map_or_else(|| root().join("target/assets"), PathBuf::from);
    let there = folder.join("generic_head.safetensors.gz").is_file();
    there
        .then_some(folder.clone())
        .ok_or_else(|| format!("{} holds no generic head: run `cargo x head`", folder.display()))
}

/// The built `facewright` program, beside the folder of the test executables.
///
/// # Errors
/// A sentence that says how to build it when it is missing.
pub fn program() -> Result<PathBuf, String> {
    let test = std::env::current_exe().map_err(|e| e.to_string())?;
    let folder = test.parent().and_then(Path::parent).unwrap_or(Path::new("."));
    let path = folder.join(format!("facewright{}", std::env::consts::EXE_SUFFIX));
    let there = path.is_file();
    there.then_some(path.clone()).ok_or_else(|| format!("{} is missing: run `cargo x test`", path.display()))
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
