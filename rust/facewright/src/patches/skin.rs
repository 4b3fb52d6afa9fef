//! The skin of a frame that points are chosen on.

use image::GrayImage;
use std::sync::Arc;
use vision::landmarks::{Face, MaskOptions, face_mask};
use vision::noise::noise;
use vision::pyramid::Pyramid;

/// The face's outline is drawn in by this part before skin is tracked: it is where the skin turns away, and hair begins.
const OUTLINE: f64 = 0.04;
/// Least noise that is believed, grey levels.
const LEAST_NOISE: f64 = 0.7;

/// What points are tracked in, and chosen on where a face was seen.
#[derive(Clone, Debug)]
pub struct TrackedSkin {
    /// The picture's grey levels, halved again and again.
    pub pyramid: Arc<Pyramid>,
    /// 255 on skin that points may be chosen on.
    pub mask: GrayImage,
    /// Standard deviation of the skin's noise, grey levels.
    pub noise: f64,
}

impl TrackedSkin {
    /// Of a picture in which the nets saw a face.
    pub fn of(pyramid: Arc<Pyramid>, face: &Face) -> Self {
        let grey = pyramid.picture();
        let options = MaskOptions { shrink: OUTLINE, ..MaskOptions::default() };
        let mask = face_mask(face, grey.width(), grey.height(), &options);
        // Compression leaves skin without any noise; what it leaves of texture is no finer than this.
        let noise = noise(grey, Some(&mask)).unwrap_or(LEAST_NOISE).max(LEAST_NOISE);
        Self { pyramid, mask, noise }
    }

    /// Of a picture in which points are sought but not chosen, as noisy as others of the clip.
    pub fn sought(pyramid: Arc<Pyramid>, noise: f64) -> Self {
        Self { pyramid, mask: GrayImage::new(0, 0), noise }
    }
}
