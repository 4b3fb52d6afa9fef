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

/// Writes files into a folder, all or none. They are staged inside it: what is above it may belong to somebody else, or be another volume.
pub(crate) fn write_together(folder: &Path, files: &[(impl AsRef<Path>, Vec<u8>)]) -> Result<(), FacewrightError> {
    let stage = Stage::inside(folder)?;
    files.iter().try_for_each(|(name, bytes)| stage.write(name.as_ref(), bytes))?;
    stage.put(files.iter().map(|(name, _)| name.as_ref()))
}

/// Files that are to appear in a folder together, and until then are none of it; dropped, they leave nothing.
pub(crate) struct Stage<'f> {
    folder: &'f Path,
    // Emptied before what was made for it goes.
    stage: tempfile::TempDir,
    made: Made<'f>,
}

impl<'f> Stage<'f> {
    /// Begins in a folder, which is made if it is missing.
    pub(crate) fn inside(folder: &'f Path) -> Result<Self, FacewrightError> {
        let made = Made::folder(folder)?;
        let stage = tempfile::Builder::new().prefix(".facewright-").tempdir_in(folder);
        Ok(Self { folder, stage: stage.map_err(|e| unwritable(folder, &e))?, made })
    }

    /// Writes one of the files.
    pub(crate) fn write(&self, name: &Path, bytes: &[u8]) -> Result<(), FacewrightError> {
        std::fs::write(self.stage.path().join(name), bytes).map_err(|e| unwritable(&self.folder.join(name), &e))
    }

    /// Puts the files, all of which were written, into the folder.
    pub(crate) fn put<'n>(self, mut names: impl Iterator<Item = &'n Path>) -> Result<(), FacewrightError> {
        names.try_for_each(|name| {
            let path = self.folder.join(name);
            std::fs::rename(self.stage.path().join(name), &path).map_err(|e| unwritable(&path, &e))
        })?;
        self.made.keep();
        Ok(())
    }
}

/// Folders that were made for files which are not there yet; they go again unless they are kept.
struct Made<'f>(Vec<&'f Path>);

impl<'f> Made<'f> {
    /// Makes a folder with all that are missing above it.
    fn folder(folder: &'f Path) -> Result<Self, FacewrightError> {
        let is_missing = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let missing: Vec<&Path> = folder.ancestors().take_while(is_missing).collect();
        std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
        Ok(Self(missing))
    }

    fn keep(mut self) {
        self.0.clear();
    }
}

impl Drop for Made<'_> {
    fn drop(&mut self) {
        // Innermost first; one that holds something stays.
        self.0.iter().for_each(|folder| drop(std::fs::remove_dir(folder)));
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_written_together_and_nothing_else_is_left() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        write_together(&folder, &[("one", vec![1]), ("two", vec![2])]).unwrap();
        let names = |folder: &Path| {
            let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
            let mut names: Vec<_> = entries.map(|name| name.into_string().unwrap()).collect();
            names.sort();
            names
        };
        assert_eq!((names(&folder), names(root.path())), (vec!["one".into(), "two".into()], vec!["a".to_owned()]));
    }

    #[test]
    fn a_failure_leaves_no_folder_and_no_file() {
        let root = tempfile::tempdir().unwrap();
        // The second has no folder to be staged in.
        let files = [("one", vec![1]), ("none/two", vec![2])];
        assert!(write_together(&root.path().join("a/b"), &files).is_err());
        assert!(write_together(root.path(), &files).is_err());
        assert_eq!(std::fs::read_dir(root.path()).unwrap().count(), 0);
    }
}
