//! Whether a long video shows a face at all, before its frames are kept.

use super::clip::{FARTHEST_LOOKS, FIRST_LOOKS, THOROUGH};
use crate::frames::{Wanted, stream};
use crate::{FacewrightError, FrameSet};
use geometry::Progress;
use image::RgbImage;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use vision::landmarks::FaceLandmarker;

/// A face is sought in every so many frames of a long clip …
const STEP: usize = FARTHEST_LOOKS.div_ceil(2);
/// … which has so many frames at least: of fewer, looking takes closer ones, and decoding a moment.
const LONG: usize = FIRST_LOOKS * (FARTHEST_LOOKS - 1) + 1;
/// Pictures that wait to be looked at together, at most: each of a large film takes 25 MB.
const MOST_WAITING: usize = 8;

/// Refuses a long video without a face: by the frames that [`super::Clip::look`] would glance at, as they are decoded, and no further than
/// to the first face. `numbers` are those of the frames, where not all are used.
///
/// # Errors
/// [`FacewrightError::NoFace`]; those of decoding; [`FacewrightError::Cancelled`].
pub(crate) fn check_long_video(
    video: &Path,
    numbers: Option<&[usize]>,
    landmarker: &FaceLandmarker,
    progress: &Progress,
) -> Result<(), FacewrightError> {
    if numbers.is_some_and(|numbers| numbers.len() < LONG) {
        return Ok(());
    }
    progress.stage("faces")?;
    let some: Option<Vec<usize>> = numbers.map(|numbers| numbers.iter().copied().step_by(STEP).collect());
    let wanted = some.as_deref().map_or(Wanted::Every(STEP), Wanted::Numbers);
    let mut seeking = Seeking { landmarker, waiting: Vec::new(), seen: 0, is_any: false };
    let decoded = stream(video, wanted, progress, |picture| seeking.see(picture))?;
    seeking.look()?;
    let frames = numbers.map_or(decoded, <[usize]>::len);
    if seeking.is_any || frames < LONG { Ok(()) } else { Err(FacewrightError::NoFace { frames }) }
}

/// Refuses pictures none of which shows a face: some of a clip that has so many frames.
///
/// # Errors
/// [`FacewrightError::NoFace`]; those of reading the pictures; [`FacewrightError::Cancelled`].
pub fn check_face(
    pictures: &[PathBuf],
    frames: usize,
    landmarker: &FaceLandmarker,
    progress: &Progress,
) -> Result<(), FacewrightError> {
    progress.stage("faces")?;
    let mut seeking = Seeking { landmarker, waiting: Vec::new(), seen: 0, is_any: false };
    let set = FrameSet::open(pictures, progress)?;
    for frame in 0..set.len() {
        progress.step(frame, set.len())?;
        if seeking.see(set.load(frame)?)?.is_break() {
            return Ok(());
        }
    }
    seeking.look()?;
    if seeking.is_any { Ok(()) } else { Err(FacewrightError::NoFace { frames }) }
}

/// Seeks a face in pictures that come one after the other.
struct Seeking<'a> {
    landmarker: &'a FaceLandmarker,
    waiting: Vec<(usize, RgbImage)>,
    seen: usize,
    is_any: bool,
}

impl Seeking<'_> {
    /// Takes the next picture; the first ones, which mostly show the face, do not wait long for others to be looked at with.
    fn see(&mut self, picture: RgbImage) -> Result<ControlFlow<()>, FacewrightError> {
        self.waiting.push((self.seen, picture));
        self.seen += 1;
        if self.waiting.len() >= MOST_WAITING.min(self.seen.div_ceil(2)) {
            self.look()?;
        }
        Ok(if self.is_any { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    /// Looks at those that wait.
    fn look(&mut self) -> Result<(), FacewrightError> {
        let is_face = |(k, picture): &(usize, RgbImage)| -> Result<bool, FacewrightError> {
            let landmarker = self.landmarker;
            Ok(landmarker.glance(picture)? || (k % THOROUGH == 0 && landmarker.find(picture)?.is_some()))
        };
        let found: Result<Vec<bool>, FacewrightError> = self.waiting.par_iter().map(is_face).collect();
        self.is_any |= found?.contains(&true);
        self.waiting.clear();
        Ok(())
    }
}
