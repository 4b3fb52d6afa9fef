//! The board in every picture.

use crate::{FacewrightError, FrameSet};
use geometry::{Board, Progress};
use image::imageops;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use vision::board::{BoardCorners, BoardError, BoardOptions, detect};

/// What was found in one picture.
pub(super) type Detection = Result<BoardCorners, BoardError>;

/// Looks for the boards in all pictures.
pub(super) fn detect_all(
    pictures: &FrameSet,
    boards: &[Board],
    progress: &Progress,
) -> Result<Vec<Detection>, FacewrightError> {
    progress.stage("boards")?;
    let done = AtomicUsize::new(0);
    let look = |i: usize| -> Result<Detection, FacewrightError> {
        progress.step(done.fetch_add(1, Ordering::Relaxed), pictures.len())?;
        Ok(detect(&imageops::grayscale(&pictures.load(i)?), boards, &BoardOptions::default()))
    };
    (0..pictures.len()).into_par_iter().map(look).collect()
}
