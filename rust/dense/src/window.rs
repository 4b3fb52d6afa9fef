//! A place's distance from the surface along the normal, by windows of all views that show it (Gauss and Newton's way).
//!
//! A window is a small piece of the surface, bent as it is bent. What a view shows in it, less what a linear change of light adds, is a
//! picture of the skin; if the place lies off the surface the views' pictures slide against each other, each by what its obliqueness makes
//! of the distance. The distance is that which explains the slides of all views against their mean at once.

use crate::sheet::Sheet;
use crate::view::Seen;
use geometry::Vec2;
use nalgebra::{Matrix2, Vector2};

/// Samples along a side of a window.
const SIDE: usize = 9;
const COUNT: usize = SIDE * SIDE;
/// The samples' weights fall off with this standard deviation, in half widths.
const FALL: f64 = 0.6;
/// Steps at most.
const STEPS: usize = 5;
/// Steps smaller than this are the last, metres.
const SMALL: f64 = 5e-6;
/// A step is not longer than this, metres: farther off textures look alike.
const LONG: f64 = 0.0006;
/// A view whose picture differs from the mean by more than this many times the usual counts little.
const UNLIKE: f64 = 2.0;
/// Slope of the mean picture, in its variance, over what the views' noise would make of it: below it there is no texture.
const TEXTURE: f64 = 4.0;

/// Samples of a window, unit half width.
pub(crate) struct Grid {
    x: [f32; COUNT],
    y: [f32; COUNT],
    /// Roots of the weights.
    root: [f32; COUNT],
    /// Orthonormal functions that light is made of: constant and linear, times the roots.
    light: [[f32; COUNT]; 3],
    /// Effective number of samples that are left without them.
    free: f64,
}

/// What was measured at a place.
#[derive(Clone, Debug)]
pub(crate) struct Measurement {
    /// The surface is so far out along the normal, metres.
    pub(crate) offset: f64,
    /// Its standard deviation by the pictures' differences, metres.
    pub(crate) sigma: f64,
    /// Root mean square difference of the views' pictures from their mean, in logarithms of grey levels.
    pub(crate) residual: f64,
    /// How far the views are apart: root mean square difference of their slides from the mean slide.
    pub(crate) baseline: f64,
    /// The mean picture's slope, in its variance, over what the views' noise makes of it.
    texture: f64,
    /// Views that took part.
    pub(crate) views: usize,
}

impl Grid {
    pub(crate) fn new() -> Self {
        let at = |k: usize| 2.0 * k as f64 / (SIDE - 1) as f64 - 1.0;
        let place = |i: usize| (at(i % SIDE), at(i / SIDE));
        let root = |i: usize| (-(place(i).0.powi(2) + place(i).1.powi(2)) / (4.0 * FALL * FALL)).exp();
        let columns = [
            (0..COUNT).map(root).collect::<Vec<f64>>(),
            (0..COUNT).map(|i| root(i) * place(i).0).collect(),
            (0..COUNT).map(|i| root(i) * place(i).1).collect(),
        ];
        // By symmetry they are at right angles already.
        let light = columns.map(|column| {
            let norm = column.iter().map(|x| x * x).sum::<f64>().sqrt();
            std::array::from_fn(|i| (column[i] / norm) as f32)
        });
        let free = (0..COUNT).map(|i| root(i).powi(2)).sum::<f64>() - 1.5;
        Self {
            x: std::array::from_fn(|i| place(i).0 as f32),
            y: std::array::from_fn(|i| place(i).1 as f32),
            root: std::array::from_fn(|i| root(i) as f32),
            light,
            free,
        }
    }
}

/// A window at a place: its half width, metres, and how the surface bends in it.
pub(crate) struct Window<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) half: f64,
    pub(crate) bend: Matrix2<f64>,
    pub(crate) sheets: &'a [&'a Sheet],
}

/// The views that a place is measured in, and the place: for a call with the processor's own vectors.
pub(crate) struct Measure<'a> {
    pub(crate) window: Window<'a>,
    pub(crate) seen: &'a [Seen],
}

type Samples = [f32; COUNT];

impl pulp::NullaryFnOnce for Measure<'_> {
    type Output = Option<Measurement>;

    #[inline(always)]
    fn call(self) -> Option<Measurement> {
        let Self { window, seen } = self;
        let (half, grid) = (window.half as f32, window.grid);
        let height: Samples = std::array::from_fn(|i| {
            let at = Vec2::new(f64::from(grid.x[i]), f64::from(grid.y[i])) * window.half;
            crate::fine::height(&window.bend, &at) as f32
        });
        let mut pictures = vec![[0.0_f32; COUNT]; seen.len()];
        let mut weights: Vec<f64> = seen.iter().map(|s| s.weight).collect();
        let mut offset = 0.0;
        let mut last = None;
        for step in 0..STEPS {
            for (picture, seen) in pictures.iter_mut().zip(seen) {
                sample(window.sheets[seen.view], seen, grid, (half, offset as f32, &height), picture);
            }
            let state = State::of(&pictures, &mut weights, seen, &window)?;
            let by = state.step.clamp(-LONG, LONG);
            offset -= by;
            let is_last = by.abs() < SMALL || step + 1 == STEPS;
            last = Some((state, by));
            if is_last {
                break;
            }
        }
        let (state, by) = last?;
        // A distance that is still changing is none.
        (by.abs() < LONG / 6.0).then(|| state.measurement((offset, window.half), seen, &weights))
    }
}

/// What a view shows in a window that is moved along the normal.
#[inline(always)]
fn sample(sheet: &Sheet, seen: &Seen, grid: &Grid, (half, offset, height): (f32, f32, &Samples), out: &mut Samples) {
    let [across, down, along] = seen.axes;
    let (mut column, mut row) = ([0.0_f32; COUNT], [0.0_f32; COUNT]);
    let (right, bottom) = ((sheet.width - 2) as f32, (sheet.height - 2) as f32);
    for i in 0..COUNT {
        let (x, y, z) = (grid.x[i] * half, grid.y[i] * half, offset + height[i]);
        column[i] = (seen.pixel[0] + across[0] * x + down[0] * y + along[0] * z).clamp(0.0, right);
        row[i] = (seen.pixel[1] + across[1] * x + down[1] * y + along[1] * z).clamp(0.0, bottom);
    }
    let values = &sheet.values[..];
    for i in 0..COUNT {
        let (x, y) = (column[i] as usize, row[i] as usize);
        let (fx, fy) = (column[i] - x as f32, row[i] - y as f32);
        let at = y * sheet.width + x;
        let (top, below) = (&values[at..at + 2], &values[at + sheet.width..at + sheet.width + 2]);
        let [upper, lower] = [top, below].map(|p| p[0] + (p[1] - p[0]) * fx);
        out[i] = upper + (lower - upper) * fy;
    }
}

/// A window in all views, at one distance.
struct State {
    /// By how much the place is too far out, metres.
    step: f64,
    information: Matrix2<f64>,
    /// Variance of the pictures about their mean.
    variance: f64,
    mean_slide: Vec2,
}

impl State {
    #[inline(always)]
    fn of(pictures: &[Samples], weights: &mut [f64], seen: &[Seen], window: &Window) -> Option<Self> {
        let grid = window.grid;
        let mean = mean(pictures, weights);
        let slopes = slopes(&mean, grid, window.half as f32);
        let (mut energies, mut products) = (vec![0.0; seen.len()], vec![Vector2::zeros(); seen.len()]);
        for ((energy, product), picture) in energies.iter_mut().zip(&mut products).zip(pictures) {
            let difference: Samples = std::array::from_fn(|i| grid.root[i] * (picture[i] - mean[i]));
            let lit: f32 = grid.light.iter().map(|light| dot(light, &difference).powi(2)).sum();
            *energy = f64::from((dot(&difference, &difference) - lit).max(0.0));
            *product = Vector2::new(f64::from(dot(&slopes[0], &difference)), f64::from(dot(&slopes[1], &difference)));
        }
        let usual = geometry::median(energies.iter().copied())?.max(1e-12);
        for ((weight, seen), energy) in weights.iter_mut().zip(seen).zip(&energies) {
            *weight = seen.weight / (1.0 + (energy / (UNLIKE * usual)).powi(2));
        }
        let total: f64 = weights.iter().sum();
        let [xx, xy, yy] = [(0, 0), (0, 1), (1, 1)].map(|(a, b)| f64::from(dot(&slopes[a], &slopes[b])));
        let information = Matrix2::new(xx, xy, xy, yy);
        let mean_slide = seen.iter().zip(&*weights).map(|(s, w)| s.slide * *w).sum::<Vec2>() / total;
        let (mut gradient, mut curvature) = (0.0, 1e-30);
        for ((seen, weight), product) in seen.iter().zip(&*weights).zip(&products) {
            let slide = seen.slide - mean_slide;
            gradient += weight * slide.dot(product);
            curvature += weight * slide.dot(&(information * slide));
        }
        let freedom = total * grid.free * (1.0 - 1.0 / seen.len() as f64);
        let variance = energies.iter().zip(&*weights).map(|(e, w)| e * w).sum::<f64>() / freedom.max(1e-9);
        Some(Self { step: gradient / curvature, information, variance, mean_slide })
    }

    fn measurement(self, (offset, half): (f64, f64), seen: &[Seen], weights: &[f64]) -> Measurement {
        let total: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|w| w * w).sum();
        let (mut curvature, mut scatter, mut apart) = (1e-30, 0.0, 0.0);
        for (seen, weight) in seen.iter().zip(weights) {
            let slide = seen.slide - self.mean_slide;
            let information = slide.dot(&(self.information * slide));
            curvature += weight * information;
            scatter += weight * weight * information;
            apart += weight * slide.norm_squared();
        }
        // The two slopes of a picture of noise, of unit variance, averaged over the views.
        let step = 2.0 * half / (SIDE - 1) as f64;
        let of_noise = COUNT as f64 / (4.0 * step * step) * squares / (total * total);
        Measurement {
            offset,
            sigma: (self.variance * scatter).sqrt() / curvature,
            residual: self.variance.sqrt(),
            baseline: (apart / total).sqrt(),
            texture: self.information.trace() / (self.variance.max(1e-12) * of_noise),
            views: seen.len(),
        }
    }
}

#[inline(always)]
fn mean(pictures: &[Samples], weights: &[f64]) -> Samples {
    let total: f64 = weights.iter().sum();
    let mut mean = [0.0; COUNT];
    for (picture, weight) in pictures.iter().zip(weights) {
        let share = (weight / total) as f32;
        for i in 0..COUNT {
            mean[i] += share * picture[i];
        }
    }
    mean
}

/// Slopes of a picture per metre across and down the window, times the weights' roots, without what light adds.
#[inline(always)]
fn slopes(picture: &Samples, grid: &Grid, half: f32) -> [Samples; 2] {
    let step = 2.0 * half / (SIDE - 1) as f32;
    let along = |stride: usize, position: fn(usize) -> usize| -> Samples {
        let mut slope: Samples = std::array::from_fn(|i| {
            let (before, after) =
                (if position(i) > 0 { i - stride } else { i }, if position(i) + 1 < SIDE { i + stride } else { i });
            grid.root[i] * (picture[after] - picture[before]) / (step * ((after - before) / stride) as f32)
        });
        for light in &grid.light {
            let part = dot(light, &slope);
            for i in 0..COUNT {
                slope[i] -= part * light[i];
            }
        }
        slope
    };
    [along(1, |i| i % SIDE), along(SIDE, |i| i / SIDE)]
}

/// A sum in a fixed order that the processor's vectors can take.
#[inline(always)]
fn dot(a: &Samples, b: &Samples) -> f32 {
    let mut lanes = [0.0_f32; 8];
    for (a, b) in a[..COUNT - 1].chunks_exact(8).zip(b[..COUNT - 1].chunks_exact(8)) {
        for k in 0..8 {
            lanes[k] += a[k] * b[k];
        }
    }
    lanes.iter().sum::<f32>() + a[COUNT - 1] * b[COUNT - 1]
}

impl Measurement {
    /// Whether there is more texture than noise would leave.
    pub(crate) fn has_texture(&self) -> bool {
        self.texture > TEXTURE
    }
}
