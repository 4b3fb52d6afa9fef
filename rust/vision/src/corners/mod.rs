//! Corners worth tracking: the paper's "useful pixels" (section 2.3, eq. 2).
//!
//! # Entry points
//! [`detect`] with [`CornerOptions`] gives [`Corner`]s.
//!
//! # Conventions
//! A corner's score is the smaller eigenvalue of the gradient matrix `G = Σ [Ix² IxIy; IxIy Iy²]` divided by the
//! number of pixels of the window: squared grey levels per pixel, whatever the window. Gradients are Sobel's, in whole
//! numbers, so that sums over sliding windows are exact and the same however the picture is cut for the threads. Only
//! the tiles of the picture that hold some of the mask are searched.
//!
//! # Source
//! Shi and Tomasi, "Good features to track", 1994.

mod peaks;
mod score;
mod tiles;

use crate::pyramid::Pyramid;
use geometry::Vec2;
use image::GrayImage;
use peaks::{Peak, Threshold, by_rounds, by_score, spaced};
use rayon::prelude::*;
use score::{FindPeaks, Scratch};
use tiles::{Area, Tile};

/// Why no corners could be looked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CornerError {
    /// The mask belongs to another picture.
    #[error("the mask is {}×{} but the picture is {}×{}: make the mask from this very frame", mask.0, mask.1, picture.0, picture.1)]
    MaskSize {
        /// Width and height of the mask.
        mask: (usize, usize),
        /// Width and height of the picture.
        picture: (usize, usize),
    },
    /// The window is even, or outside 3 … 31.
    #[error("the corner window is {0} pixels: choose an odd number from 3 to 31")]
    Window(usize),
}

/// How corners are chosen among those good enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spread {
    /// One per cell of a grid of about `max_count` cells, then a second per cell …: weakly textured cheeks get their
    /// share.
    #[default]
    Even,
    /// The strongest of the whole picture.
    Strongest,
}

/// What to look for.
#[derive(Clone, Debug)]
pub struct CornerOptions {
    /// At most so many corners.
    pub max_count: usize,
    /// Side of the window of `G`, pixels; odd, 3 … 31.
    pub window: usize,
    /// Least score relative to the strongest corner within the mask.
    pub quality: f64,
    /// Least score, squared grey levels per pixel; sensor noise of σ grey levels alone gives about 0.15 σ².
    pub min_score: f64,
    /// Least distance between two corners, pixels.
    pub min_distance: f64,
    /// No corner is closer to the edge of the frame, pixels.
    pub border: usize,
    /// How corners are chosen among those good enough.
    pub spread: Spread,
}

impl Default for CornerOptions {
    fn default() -> Self {
        Self {
            max_count: 300,
            window: 7,
            quality: 0.001,
            min_score: 1.0,
            min_distance: 4.0,
            border: 8,
            spread: Spread::Even,
        }
    }
}

/// A pixel whose surroundings can be found again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Peak of the score, to a fraction of a pixel.
    pub position: Vec2,
    /// Smaller eigenvalue of `G` per pixel of the window, squared grey levels per pixel.
    pub score: f64,
}

/// Finds corners in the picture itself (level 0), where `mask` is not zero; best of each round of the spread first.
/// The order depends on nothing but the input.
pub fn detect(
    pyramid: &Pyramid,
    mask: Option<&GrayImage>,
    options: &CornerOptions,
) -> Result<Vec<Corner>, CornerError> {
    let picture = pyramid.picture();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    if !(3..=31).contains(&options.window) || options.window.is_multiple_of(2) {
        return Err(CornerError::Window(options.window));
    }
    if let Some(mask) = mask
        && (mask.width() as usize, mask.height() as usize) != (width, height)
    {
        let mask = (mask.width() as usize, mask.height() as usize);
        return Err(CornerError::MaskSize { mask, picture: (width, height) });
    }
    let Some(area) = Area::of(mask, width, height, options.border.max(options.window / 2 + 2)) else {
        return Ok(Vec::new());
    };
    let peaks = peaks(picture, mask, &area.tiles(mask), options);
    let (bounds, count, distance) = (area.bounds, options.max_count, options.min_distance);
    let chosen = match options.spread {
        Spread::Strongest => spaced(by_score(peaks), bounds, width, count, distance),
        Spread::Even => {
            let cell = (area.allowed(mask) as f64 / count.max(1) as f64).sqrt().max(1.0);
            spaced(by_rounds(peaks, bounds, width, cell), bounds, width, count, distance)
        }
    };
    Ok(chosen.into_iter().map(|(position, score)| Corner { position, score }).collect())
}

/// Peaks of the score above the limits, tile by tile.
fn peaks(picture: &GrayImage, mask: Option<&GrayImage>, tiles: &[Tile], options: &CornerOptions) -> Vec<Peak> {
    let half = options.window / 2;
    let find = |scratch: &mut Scratch, &tile: &Tile| {
        let threshold = Threshold::new(options.min_score, options.quality);
        pulp::Arch::new().dispatch(FindPeaks { picture, mask, tile, half, threshold, scratch })
    };
    let found: Vec<Vec<Peak>> = tiles.par_iter().map_init(Scratch::default, find).collect();
    let mut threshold = Threshold::new(options.min_score, options.quality);
    found.iter().flatten().for_each(|peak| {
        threshold.admits(peak.score);
    });
    found.into_iter().flatten().filter(|peak| threshold.admits(peak.score)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    /// A smooth blob of the given height at each place, on grey 60.
    fn blobs(places: &[(f64, f64, f64)]) -> Pyramid {
        let grey = |x: u32, y: u32| {
            let bump = |&(cx, cy, height): &(f64, f64, f64)| {
                let (dx, dy) = (f64::from(x) - cx, f64::from(y) - cy);
                height * (-(dx * dx + dy * dy) / 8.0).exp()
            };
            60.0 + places.iter().map(bump).sum::<f64>()
        };
        Pyramid::new(&GrayImage::from_fn(160, 120, |x, y| Luma([grey(x, y).round() as u8])), 1)
    }

    #[test]
    fn finds_blobs_to_a_fraction_of_a_pixel() {
        let places = [(40.3, 30.6, 120.0), (90.0, 70.5, 80.0), (120.75, 40.2, 60.0)];
        let corners = detect(&blobs(&places), None, &CornerOptions { quality: 0.05, ..Default::default() }).unwrap();
        assert_eq!(corners.len(), 3);
        for (corner, (x, y, _)) in corners.iter().zip(places) {
            assert!((corner.position - Vec2::new(x, y)).norm() < 0.1, "{:?} is not {x} {y}", corner.position);
        }
    }

    #[test]
    fn an_even_spread_reaches_weak_texture() {
        let mut places: Vec<_> =
            (0..20).map(|i| (20.0 + f64::from(i % 5) * 12.0, 20.0 + f64::from(i / 5) * 22.0, 120.0)).collect();
        places.extend((0..4).map(|i| (110.0 + f64::from(i % 2) * 25.0, 35.0 + f64::from(i / 2) * 45.0, 14.0)));
        let count = |spread| {
            let options = CornerOptions { max_count: 16, spread, min_score: 0.2, ..Default::default() };
            let corners = detect(&blobs(&places), None, &options).unwrap();
            assert_eq!(corners.len(), 16);
            corners.iter().filter(|corner| corner.position.x > 95.0).count()
        };
        assert_eq!(count(Spread::Strongest), 0);
        assert_eq!(count(Spread::Even), 4);
    }

    #[test]
    fn corners_stay_within_the_mask_and_apart() {
        let noise = GrayImage::from_fn(200, 150, |x, y| {
            Luma([(x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503 * (x + 7))).to_le_bytes()[1]])
        });
        let mask = GrayImage::from_fn(200, 150, |x, _| Luma([u8::from(x < 90)]));
        let options = CornerOptions { min_distance: 6.0, ..Default::default() };
        let corners = detect(&Pyramid::new(&noise, 1), Some(&mask), &options).unwrap();
        assert!(corners.len() > 50);
        for (i, corner) in corners.iter().enumerate() {
            assert!(corner.position.x < 90.0);
            assert!(corners[..i].iter().all(|other| (other.position - corner.position).norm() >= 6.0));
        }
    }

    #[test]
    fn an_edge_a_flat_picture_and_a_tiny_one_have_no_corners() {
        let straight = GrayImage::from_fn(80, 80, |x, _| Luma([if x < 40 { 30 } else { 200 }]));
        for picture in [straight, GrayImage::from_pixel(80, 80, Luma([90])), GrayImage::new(9, 7), GrayImage::new(0, 0)]
        {
            assert!(detect(&Pyramid::new(&picture, 1), None, &CornerOptions::default()).unwrap().is_empty());
        }
    }

    #[test]
    fn a_mask_of_another_picture_and_an_even_window_are_refused() {
        let picture = blobs(&[]);
        let mask = GrayImage::new(10, 10);
        assert!(matches!(detect(&picture, Some(&mask), &CornerOptions::default()), Err(CornerError::MaskSize { .. })));
        let even = CornerOptions { window: 4, ..Default::default() };
        assert_eq!(detect(&picture, None, &even), Err(CornerError::Window(4)));
    }
}
