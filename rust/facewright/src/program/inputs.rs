//! Files that commands read, and places that they write to.

use crate::{FacewrightError, FrameSet, HeadMotion, SourcedCamera, check_folder};
use geometry::Progress;
use std::path::{Path, PathBuf};

/// Times of the steps of a command, in parts: its pictures are opened, then it works on them.
const PARTS: [f64; 2] = [0.03, 0.97];

/// Opens the pictures of a command; also what is left of its progress for the work on them.
pub fn open(inputs: &[PathBuf], progress: &Progress) -> Result<(FrameSet, Progress), FacewrightError> {
    let [opening, working] = progress.split(&PARTS);
    Ok((FrameSet::open(inputs, &opening)?, working))
}

/// A calibrated camera, where one is given.
pub(super) fn camera(file: Option<&Path>) -> Result<Option<SourcedCamera>, FacewrightError> {
    file.map(SourcedCamera::read).transpose()
}

/// Reads a `motion.json`.
pub fn motion(file: &Path) -> Result<HeadMotion, FacewrightError> {
    HeadMotion::read(file)
}

/// Refuses a file that cannot be written before the work, not after it.
pub fn check_output(file: &Path) -> Result<(), FacewrightError> {
    check_folder(file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}
