//! Saddle points of the grey values: what the crossing of four squares looks like at any size, blur and tilt.
//!
//! Where a black and white board crosses, the determinant of the Hessian has a negative peak and the gradient vanishes;
//! straight edges and ends of lines have neither. The Hessian's null directions are the two edges.

use super::level::{Level, Plane};
use geometry::Vec2;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Variance, square pixels, of the blur in front of the Hessian with that of a usual lens.
const BLUR_VARIANCE: f64 = 2.0;
/// Rejects saddles whose bright and dark sectors differ more than this ratio of curvatures (15° against 75°).
const MIN_CURVATURE_RATIO: f64 = 0.07;
/// Grey values are compared this far, pixels, from a saddle, in the middle of its sectors.
const SECTOR_RADIUS: f64 = 3.0;
/// The darker bright sector exceeds the brighter dark one by this part of the mean difference.
const MIN_SECTOR_GAP: f64 = 0.3;
/// Peaks are the strongest within this many pixels.
const PEAK_RADIUS: usize = 2;
/// Width of the border in which no saddle is looked for: room for [`SECTOR_RADIUS`] and a Newton step.
pub(super) const MARGIN: usize = 6;
/// Pixels of a row that are tested together.
const PIECE: usize = 32;
/// A saddle's gradient vanishes within this many pixels of the peak.
const MAX_STEP: f64 = 2.0;

/// A saddle point of one picture level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Saddle {
    /// Sub-pixel position in the level.
    pub(super) position: Vec2,
    /// Square root of the negative Hessian determinant, grey levels per square pixel.
    pub(super) strength: f64,
    /// Directions, radians, of the two edges. Turning from the first to the second (x towards y) sweeps a bright
    /// sector, from the second to the opposite of the first a dark one.
    pub(super) edges: [f64; 2],
}

/// The strongest saddles of a level, strongest first, at most `limit`; `min_contrast` between black and white in grey
/// levels.
pub(super) fn find(level: &Level, min_contrast: f64, limit: usize) -> Vec<Saddle> {
    if level.width <= 2 * MARGIN || level.height <= 2 * MARGIN {
        return Vec::new();
    }
    let smooth = level.smoothed();
    let threshold = (min_contrast / (PI * BLUR_VARIANCE)).powi(2) as f32;
    let response = responses(&smooth);
    let mut saddles: Vec<Saddle> = (MARGIN..level.height - MARGIN)
        .into_par_iter()
        .with_min_len(16)
        .flat_map_iter(|y| {
            let (smooth, response) = (&smooth, &response);
            strong(response.row(y), threshold)
                .filter(move |&x| is_peak(response, x, y))
                .filter_map(move |x| measure(smooth, x, y))
        })
        .collect();
    saddles.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    saddles.truncate(limit);
    saddles
}

/// Negative determinant of the Hessian; zero on the border.
fn responses(smooth: &Plane) -> Plane {
    let (width, height) = (smooth.width, smooth.height);
    let mut values = vec![0.0; width * height];
    values.par_chunks_mut(width).enumerate().skip(1).take(height - 2).with_min_len(32).for_each(|(y, out)| {
        let rows = [smooth.row(y - 1), smooth.row(y), smooth.row(y + 1)];
        pulp::Arch::new().dispatch(ResponseRow { rows, out });
    });
    Plane { width, height, values }
}

/// One row of responses from the three smoothed ones around it.
struct ResponseRow<'a> {
    rows: [&'a [f32]; 3],
    out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for ResponseRow<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { rows: [above, here, below], out } = self;
        let windows = above.windows(3).zip(here.windows(3)).zip(below.windows(3));
        for (value, ((a, h), b)) in out[1..].iter_mut().zip(windows) {
            let xx = h[0] - 2.0 * h[1] + h[2];
            let yy = a[1] - 2.0 * h[1] + b[1];
            let xy = 0.25 * (a[0] - a[2] - b[0] + b[2]);
            *value = xy * xy - xx * yy;
        }
    }
}

/// Columns of a row, within the margins, where the response exceeds a threshold.
fn strong(row: &[f32], threshold: f32) -> impl Iterator<Item = usize> {
    // Whole pieces without any are passed over at once.
    let pieces = row[MARGIN..row.len() - MARGIN].chunks(PIECE).enumerate();
    let some = pieces.filter(move |(_, piece)| piece.iter().filter(|&&v| v > threshold).count() > 0);
    some.flat_map(move |(k, piece)| {
        let columns = piece.iter().enumerate().filter(move |&(_, &v)| v > threshold);
        columns.map(move |(x, _)| MARGIN + k * PIECE + x)
    })
}

fn is_peak(response: &Plane, x: usize, y: usize) -> bool {
    let centre = response.row(y)[x];
    (y - PEAK_RADIUS..=y + PEAK_RADIUS).all(|v| {
        let row = &response.row(v)[x - PEAK_RADIUS..=x + PEAK_RADIUS];
        // Of equal neighbours the last in reading order is the peak.
        row.iter().enumerate().all(|(k, &value)| {
            let later = (v, k + x - PEAK_RADIUS) > (y, x);
            if later { value < centre } else { value <= centre }
        })
    })
}

/// The saddle at a response peak: a Newton step to the point without gradient, and the edges. `None` where the
/// gradient does not vanish nearby or a sector is too narrow.
fn measure(smooth: &Plane, x: usize, y: usize) -> Option<Saddle> {
    let at = |dx: usize, dy: usize| f64::from(smooth.row(y + dy - 1)[x + dx - 1]);
    let (gx, gy) = ((at(2, 1) - at(0, 1)) / 2.0, (at(1, 2) - at(1, 0)) / 2.0);
    let xx = at(0, 1) - 2.0 * at(1, 1) + at(2, 1);
    let yy = at(1, 0) - 2.0 * at(1, 1) + at(1, 2);
    let xy = (at(0, 0) - at(2, 0) - at(0, 2) + at(2, 2)) / 4.0;
    let determinant = xx * yy - xy * xy;
    let step = Vec2::new(gy * xy - gx * yy, gx * xy - gy * xx) / determinant;
    // Eigenvalues of the Hessian and the direction of the upward curve, the middle of the bright sector.
    let (mean, half) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
    let (up, down) = (mean + half, mean - half);
    let bright = xy.atan2((xx - yy) / 2.0) / 2.0;
    let ratio = up / -down;
    if step.amax() > MAX_STEP || !(MIN_CURVATURE_RATIO..1.0 / MIN_CURVATURE_RATIO).contains(&ratio) {
        return None;
    }
    let opening = ratio.sqrt().atan();
    let position = Vec2::new(x as f64, y as f64) + step;
    has_four_sectors(smooth, &position, bright).then(|| Saddle {
        position,
        strength: (-determinant).sqrt(),
        edges: [bright - opening, bright + opening],
    })
}

/// Whether both bright sectors, `bright` the direction of their middle, are brighter than both dark ones: the corner of
/// a single square is a saddle too, but has three bright quarters.
fn has_four_sectors(smooth: &Plane, position: &Vec2, bright: f64) -> bool {
    let along = Vec2::new(bright.cos(), bright.sin()) * SECTOR_RADIUS;
    let pair = |d: Vec2| (smooth.interpolate(&(position + d)), smooth.interpolate(&(position - d)));
    let (light, dark) = (pair(along), pair(Vec2::new(-along.y, along.x)));
    let mean = (light.0 + light.1 - dark.0 - dark.1) / 2.0;
    light.0.min(light.1) - dark.0.max(dark.1) > MIN_SECTOR_GAP * mean && mean > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A crossing of two ramps at `angles`, bright in the sector from the first to the second.
    fn crossing(centre: Vec2, angles: [f64; 2]) -> Level<'static> {
        let side = |d: Vec2, angle: f64| (d.y * angle.cos() - d.x * angle.sin()).clamp(-0.8, 0.8) / 0.8;
        let (width, height) = (40, 30);
        let value = |i: usize| {
            let d = Vec2::new((i % width) as f64, (i / width) as f64) - centre;
            (128.0 - 80.0 * side(d, angles[0]) * side(d, angles[1])) as f32
        };
        Level::from_values(width, height, (0..width * height).map(value).collect())
    }

    #[test]
    fn a_crossing_gives_one_saddle_with_its_edges() {
        for angles in [[0.0, 1.57], [0.3, 1.6], [-0.5, 0.6], [1.0, 3.0]] {
            let centre = Vec2::new(20.3, 14.6);
            let found = find(&crossing(centre, angles), 20.0, 10);
            assert_eq!(found.len(), 1, "{angles:?} {found:?}");
            assert!((found[0].position - centre).norm() < 0.1, "{found:?}");
            for (edge, angle) in found[0].edges.iter().zip(angles) {
                let off = (edge - angle).rem_euclid(PI);
                assert!(off.min(PI - off) < 0.25, "{angles:?} {found:?}");
            }
        }
    }

    #[test]
    fn edges_and_corners_of_one_square_give_none() {
        let (width, height) = (40, 30);
        let square = |i: usize| if i % width > 17 && i / width > 12 { 200.0 } else { 40.0 };
        let plane = Level::from_values(width, height, (0..width * height).map(square).collect());
        assert!(find(&plane, 20.0, 10).is_empty());
    }
}
