//! Files, written whole or not at all.

use crate::FacewrightError;
use drawing::{Drawing, Format};
use image::{ImageEncoder, RgbaImage};
use serde::Serialize;
use std::path::Path;

/// Whether a result folder can be written, found out before the work that fills it; nothing is left behind.
pub fn check_folder(folder: &Path) -> Result<(), FacewrightError> {
    let there = folder.ancestors().find(|p| p.exists()).unwrap_or(Path::new("."));
    if !there.is_dir() {
        return Err(unwritable(folder, &format_args!("{} is a file", there.display())));
    }
    tempfile::Builder::new().prefix(".facewright-").tempdir_in(there).map(drop).map_err(|e| unwritable(folder, &e))
}

/// Writes files into a folder, all or none.
pub(crate) fn write_together(folder: &Path, files: &[(impl AsRef<Path>, Vec<u8>)]) -> Result<(), FacewrightError> {
    let parent = folder.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(|e| unwritable(folder, &e))?;
    let stage =
        tempfile::Builder::new().prefix(".facewright-").tempdir_in(parent).map_err(|e| unwritable(folder, &e))?;
    for (name, bytes) in files {
        let path = stage.path().join(name);
        std::fs::write(&path, bytes).map_err(|e| unwritable(&folder.join(name), &e))?;
    }
    std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
    for (name, _) in files {
        std::fs::rename(stage.path().join(name), folder.join(name)).map_err(|e| unwritable(&folder.join(name), &e))?;
    }
    Ok(())
}

/// Writes a text file, whole or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<(), FacewrightError> {
    write_bytes(path, text.as_bytes().to_vec())
}

/// Writes a file, whole or not at all.
pub(crate) fn write_bytes(path: &Path, bytes: Vec<u8>) -> Result<(), FacewrightError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().ok_or_else(|| unwritable(path, &"it is not a file name"))?;
    write_together(folder, &[(name, bytes)])
}

/// Writes a value as indented JSON.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), FacewrightError> {
    write_text(path, &json_text(value))
}

pub(crate) fn json_text(value: &impl Serialize) -> String {
    // Our own types have string keys and finite numbers: serialisation cannot fail.
    serde_json::to_string_pretty(value).unwrap_or_default() + "\n"
}

pub(crate) fn unwritable(path: &Path, reason: &dyn std::fmt::Display) -> FacewrightError {
    FacewrightError::Write { path: path.to_owned(), reason: reason.to_string() }
}

pub(crate) fn png(picture: &RgbaImage) -> Result<Vec<u8>, FacewrightError> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(picture, picture.width(), picture.height(), image::ExtendedColorType::Rgba8)
        .map_err(|e| unwritable(Path::new("texture.png"), &e))?;
    Ok(bytes)
}

/// Writes a drawing as the kind of file its name says; `dpi` is the resolution of a PNG.
pub fn write_drawing(path: &Path, drawing: &Drawing, dpi: f64) -> Result<(), FacewrightError> {
    write_bytes(path, drawing.encode(Format::of(path)?, dpi)?)
}
