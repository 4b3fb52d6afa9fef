//! The pictures that were looked at, small.

use crate::{FacewrightError, FrameSet};
use geometry::Progress;
use image::{RgbImage, imageops};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The longer side, pixels.
pub(super) const SIDE: u32 = 96;

/// Of all frames.
pub(super) fn of_all(frames: &FrameSet, progress: &Progress) -> Result<Vec<RgbImage>, FacewrightError> {
    let done = AtomicUsize::new(0);
    let of = |frame: usize| {
        progress.step(done.fetch_add(1, Ordering::Relaxed), frames.len())?;
        Ok(small(&*frames.picture(frame)?))
    };
    (0..frames.len()).into_par_iter().map(of).collect()
}

/// The whole picture in its own shape.
fn small(picture: &RgbImage) -> RgbImage {
    let (width, height) = picture.dimensions();
    let side = |length: u32| (f64::from(length * SIDE) / f64::from(width.max(height))).round().max(1.0) as u32;
    imageops::thumbnail(picture, side(width), side(height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thumbnail_has_the_shape_of_its_picture() {
        assert_eq!(small(&RgbImage::new(400, 300)).dimensions(), (96, 72));
        assert_eq!(small(&RgbImage::new(1080, 1920)).dimensions(), (54, 96));
        assert_eq!(small(&RgbImage::new(3000, 2)).dimensions(), (96, 1));
    }
}
