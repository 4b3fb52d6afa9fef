//! Reading and writing.

use anyhow::Context;
use image::GrayImage;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Writes a value as JSON.
pub fn write_json(path: &Path, value: &impl Serialize) -> anyhow::Result<()> {
    std::fs::write(path, serde_json::to_vec(value)?).with_context(|| format!("cannot write {}", path.display()))
}

/// Reads a value from JSON.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_slice(&bytes).with_context(|| format!("{} is not what it should be", path.display()))
}

/// Reads a picture as grey levels.
pub fn read_grey(path: &Path) -> anyhow::Result<GrayImage> {
    let picture = image::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(picture.to_luma8())
}

/// Writes a picture; without loss, so that every side reads the same grey levels whatever its decoder.
pub fn write_grey(path: &Path, picture: &GrayImage) -> anyhow::Result<()> {
    picture.save(path).with_context(|| format!("cannot write {}", path.display()))
}
