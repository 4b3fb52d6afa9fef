//! Corners worth tracking: the paper's "useful pixels" (section 2.3, eq. 2).
//!
//! # Entry points
//! [`detect`] with [`CornerOptions`] gives [`Corner`]s.
//!
//! # Conventions
//! A corner's score is the smaller eigenvalue of the gradient matrix `G = Σ [Ix² IxIy; IxIy Iy²]` divided by the
//! number of pixels of the window: squared grey levels per pixel, whatever the window. Gradients are Sobel's, in whole
//! numbers, so that sums over sliding windows are exact and the same however the picture is cut for the threads.
//!
//! # Source
//! Shi and Tomasi, "Good features to track", 1994.

use crate::pyramid::{Level, Pyramid};
use geometry::Vec2;
use image::GrayImage;
use rayon::prelude::*;

/// Sobel's weights sum to 8 grey levels per pixel of slope, and the matrix holds squares.
const SOBEL_SQUARED: f32 = 64.0;
/// Rows of one parallel piece of work.
const BAND_ROWS: usize = 48;

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
    let level = pyramid.finest();
    let (width, height) = (level.width(), level.height());
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
    let scores = scores(level, &area, options.window / 2);
    let allowed = |x: usize, y: usize| mask.is_none_or(|mask| mask.as_raw()[y * width + x] != 0);
    let candidates = candidates(&scores, &area, allowed, options);
    Ok(match options.spread {
        Spread::Strongest => select(candidates.into_iter(), &area, options),
        Spread::Even => {
            let cell = (area.allowed as f64 / options.max_count.max(1) as f64).sqrt().max(1.0);
            select(by_rounds(candidates, cell), &area, options)
        }
    })
}

/// The part of the picture where corners may lie.
struct Area {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    /// Pixels of the mask within.
    allowed: usize,
}

impl Area {
    /// The bounding box of the mask within the border; `None` if that is empty.
    fn of(mask: Option<&GrayImage>, width: usize, height: usize, border: usize) -> Option<Self> {
        if width <= 2 * border || height <= 2 * border {
            return None;
        }
        let (mut left, mut right, mut top, mut bottom) = (width, 0, height, 0);
        let mut allowed = 0;
        for y in border..height - border {
            let row = mask.map(|mask| &mask.as_raw()[y * width..][..width]);
            for x in border..width - border {
                if row.is_none_or(|row| row[x] != 0) {
                    (left, right) = (left.min(x), right.max(x));
                    (top, bottom) = (top.min(y), bottom.max(y));
                    allowed += 1;
                }
            }
        }
        (allowed > 0).then(|| Self { left, top, width: right + 1 - left, height: bottom + 1 - top, allowed })
    }
}

/// Scores of the area's pixels, row by row; bands of rows in parallel.
fn scores(level: &Level, area: &Area, half: usize) -> Vec<f32> {
    let mut scores = vec![0.0; area.width * area.height];
    scores
        .par_chunks_mut(area.width * BAND_ROWS)
        .enumerate()
        .for_each(|(band, out)| band_scores(level, area, half, area.top + band * BAND_ROWS, out));
    scores
}

/// Scores of the rows from `first` on: products of gradients enter and leave sums over columns as the window slides
/// down, and those enter and leave the sums of the window as it slides right.
fn band_scores(level: &Level, area: &Area, half: usize, first: usize, out: &mut [f32]) {
    let (side, span) = (2 * half + 1, area.width + 2 * half);
    let mut ring = vec![[0_i32; 3]; side * span];
    let mut columns = vec![[0_i32; 3]; span];
    let per_score = 1.0 / (2.0 * SOBEL_SQUARED * (side * side) as f32);
    let rows = out.len() / area.width;
    for (n, y) in (first - half..first + rows + half).enumerate() {
        let oldest = &mut ring[n % side * span..][..span];
        slide_columns(level, y, area.left - half, oldest, &mut columns);
        if n + 1 >= side {
            slide_window(&columns, side, per_score, &mut out[(n + 1 - side) * area.width..][..area.width]);
        }
    }
}

/// Replaces the products of the row that leaves by those of row `y`, in the ring and in the sums over columns.
fn slide_columns(level: &Level, y: usize, left: usize, oldest: &mut [[i32; 3]], columns: &mut [[i32; 3]]) {
    let span = columns.len() + 2;
    let [above, here, below] = [y - 1, y, y + 1].map(|y| &level.row(y)[left - 1..][..span]);
    for (x, (old, sum)) in oldest.iter_mut().zip(columns).enumerate() {
        // Level 0 holds whole grey levels in its upper byte.
        let [a, b, c] = [above, here, below].map(|row| [0, 1, 2].map(|i| i32::from(row[x + i] >> 8)));
        let gx = a[2] - a[0] + 2 * (b[2] - b[0]) + c[2] - c[0];
        let gy = c[0] - a[0] + 2 * (c[1] - a[1]) + c[2] - a[2];
        let new = [gx * gx, gx * gy, gy * gy];
        for k in 0..3 {
            sum[k] += new[k] - old[k];
        }
        *old = new;
    }
}

/// Scores of one row from the sums over columns.
fn slide_window(columns: &[[i32; 3]], side: usize, per_score: f32, out: &mut [f32]) {
    let mut sum = [0_i32; 3];
    for column in &columns[..side - 1] {
        sum = [sum[0] + column[0], sum[1] + column[1], sum[2] + column[2]];
    }
    for ((out, enters), leaves) in out.iter_mut().zip(&columns[side - 1..]).zip(columns) {
        sum = [sum[0] + enters[0], sum[1] + enters[1], sum[2] + enters[2]];
        let [xx, xy, yy] = sum.map(|s| s as f32);
        let difference = xx - yy;
        *out = (xx + yy - (difference * difference + 4.0 * xy * xy).sqrt()) * per_score;
        sum = [sum[0] - leaves[0], sum[1] - leaves[1], sum[2] - leaves[2]];
    }
}

/// Peaks of the score above the limits, best first; among equals the upper, then the left one first.
fn candidates(
    scores: &[f32],
    area: &Area,
    allowed: impl Fn(usize, usize) -> bool,
    options: &CornerOptions,
) -> Vec<Corner> {
    let width = area.width;
    let mut peaks = Vec::new();
    for y in 1..area.height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let at = y * width + x;
            let score = scores[at];
            if f64::from(score) < options.min_score {
                continue;
            }
            let before = [at - width - 1, at - width, at - width + 1, at - 1];
            let after = [at + 1, at + width - 1, at + width, at + width + 1];
            let peak = before.iter().all(|&i| scores[i] < score) && after.iter().all(|&i| scores[i] <= score);
            if peak && allowed(area.left + x, area.top + y) {
                let offset = Vec2::new(
                    parabola_peak(scores[at - 1], score, scores[at + 1]),
                    parabola_peak(scores[at - width], score, scores[at + width]),
                );
                let pixel = Vec2::new((area.left + x) as f64, (area.top + y) as f64);
                peaks.push(Corner { position: pixel + offset, score: f64::from(score) });
            }
        }
    }
    let strongest = peaks.iter().map(|corner| corner.score).fold(0.0, f64::max);
    peaks.retain(|corner| corner.score >= options.quality * strongest);
    // The sort is stable and the peaks are in reading order.
    peaks.sort_by(|a, b| b.score.total_cmp(&a.score));
    peaks
}

/// Where the parabola through three values at −1, 0 and 1 peaks, given that the middle one is not the smallest.
fn parabola_peak(before: f32, here: f32, after: f32) -> f64 {
    let curvature = before - 2.0 * here + after;
    if curvature >= 0.0 { 0.0 } else { f64::from(0.5 * (before - after) / curvature).clamp(-0.5, 0.5) }
}

/// Reorders corners, best first, into rounds: the best of each cell, the second best of each cell, and so on.
fn by_rounds(candidates: Vec<Corner>, cell: f64) -> impl Iterator<Item = Corner> {
    let cell_of = |corner: &Corner| ((corner.position.y / cell) as usize, (corner.position.x / cell) as usize);
    let mut taken = std::collections::BTreeMap::new();
    let mut ranked: Vec<(usize, Corner)> = candidates
        .into_iter()
        .map(|corner| {
            let count = taken.entry(cell_of(&corner)).or_insert(0);
            *count += 1;
            (*count, corner)
        })
        .collect();
    ranked.sort_by_key(|(round, _)| *round);
    ranked.into_iter().map(|(_, corner)| corner)
}

/// Takes corners in order, leaving out those too close to one taken before.
fn select(candidates: impl Iterator<Item = Corner>, area: &Area, options: &CornerOptions) -> Vec<Corner> {
    let bucket = options.min_distance.max(1.0);
    let columns = (area.width as f64 / bucket) as usize + 3;
    let rows = (area.height as f64 / bucket) as usize + 3;
    let mut buckets: Vec<Vec<Vec2>> = vec![Vec::new(); columns * rows];
    let mut chosen = Vec::new();
    for corner in candidates {
        if chosen.len() >= options.max_count {
            break;
        }
        let x = ((corner.position.x - area.left as f64).max(0.0) / bucket) as usize + 1;
        let y = ((corner.position.y - area.top as f64).max(0.0) / bucket) as usize + 1;
        let mut around = (y - 1..=y + 1).flat_map(|y| &buckets[y * columns + x - 1..=y * columns + x + 1]).flatten();
        if around.all(|other| (other - corner.position).norm() >= options.min_distance) {
            buckets[y * columns + x].push(corner.position);
            chosen.push(corner);
        }
    }
    chosen
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
