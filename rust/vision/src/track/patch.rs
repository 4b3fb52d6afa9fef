//! The reference patch at one level: its pixels, its slopes and the sums over it that steps need, all computed once.
//!
//! With gain and bias compensated, the steepest-descent images are made orthogonal to the patch and to the constant
//! ("project out", Hager and Belhumeur 1998), so that a step solved with them is the step of the joint problem. They
//! are never formed: their products with a window follow from those of the slopes by the sums kept here.

use super::lanes::{Eight, Kernel, LANES, Lanes, Vectors, nearest};
use super::region::{Reader, Region, Sight, Task};
use super::window::{ROWS, Weights, Window};
use crate::pyramid::{Interpolation, Level};
use geometry::Vec2;
use nalgebra::{Matrix2, SMatrix};

/// Unknowns: a shift and, for the affine model, the four entries of a small warp.
pub(super) const AFFINE: usize = 6;
/// Unknowns of a shift.
pub(super) const SHIFT: usize = 2;

/// Values and slopes are rounded to this part of a grey level (2⁻⁶), so that they can be kept in 16 bits.
const BITS: i32 = 6;
/// Columns of the patch with one more pixel all round, padded.
const FRAME: usize = 40;

/// Eight pixels of a patch.
#[derive(Clone, Copy, Default)]
pub(super) struct Line {
    /// Scharr's derivatives, grey levels per pixel, times the weight.
    pub slope: [Eight; 2],
    /// Grey levels minus the mean, times the weight.
    pub value: Eight,
    /// Zero beside the window.
    pub weight: Eight,
}

/// What steps need to know of a patch. The steepest-descent images are the slopes along x and y, then (affine) each of
/// them times dx / half and dy / half; all sums are weighted.
#[derive(Clone, Debug, Default)]
pub(super) struct Stats {
    pub mean: f32,
    /// Σ values².
    pub energy: f64,
    /// Σ of each steepest-descent image.
    pub sums: [f64; AFFINE],
    /// Σ of products of each with the values.
    pub cross: [f64; AFFINE],
    /// Σ of products of each with each, with gain and bias taken out if they are compensated.
    pub hessian: SMatrix<f64, AFFINE, AFFINE>,
}

impl Stats {
    /// The paper's `G`, with gain and bias taken out if asked for.
    pub fn shift_hessian(&self) -> Matrix2<f64> {
        self.hessian.fixed_view::<SHIFT, SHIFT>(0, 0).into()
    }
}

/// A reference patch, ready to be looked for, in strips of eight columns.
pub(super) struct Patch<const STRIPS: usize> {
    pub lines: [[Line; ROWS]; STRIPS],
    pub stats: Stats,
    framed: [[f32; FRAME]; ROWS + 1],
}

impl<const STRIPS: usize> Default for Patch<STRIPS> {
    fn default() -> Self {
        let lines = [[Line::default(); ROWS]; STRIPS];
        Self { lines, stats: Stats::default(), framed: [[0.0; FRAME]; ROWS + 1] }
    }
}

/// Where and how a patch is taken.
pub(super) struct Taking<'t, const STRIPS: usize> {
    pub level: &'t Level,
    pub centre: Vec2,
    /// From the window's frame to the level's.
    pub grid: Matrix2<f64>,
    pub interpolation: Interpolation,
    pub window: Window,
    pub weights: &'t Weights<STRIPS>,
    pub affine: bool,
    pub gain_bias: bool,
    pub region: &'t mut Region,
    pub patch: &'t mut Patch<STRIPS>,
}

impl<const STRIPS: usize> Kernel for Taking<'_, STRIPS> {
    type Output = ();

    #[inline(always)]
    fn call<V: Vectors>(self, v: V) {
        let Self { level, centre, grid, interpolation, window, weights, affine, gain_bias, region, patch } = self;
        let columns = window.side + 2;
        let sight =
            Sight { centre, warp: grid, origin: window.half + 1, columns, rows: columns, span: columns.max(LANES) };
        region.clear();
        region.cover(level, &sight, interpolation, false);
        region.read(v, &sight, interpolation, Framing { columns, framed: &mut patch.framed });
        patch.differentiate(v, window, weights);
        let mut sums = PatchSums::default();
        if affine {
            patch.sum::<V, true>(v, window, weights, &mut sums);
        } else {
            patch.sum::<V, false>(v, window, weights, &mut sums);
        }
        sums.finish(weights.total, gain_bias, affine, &mut patch.stats);
    }
}

struct Framing<'f> {
    columns: usize,
    framed: &'f mut [[f32; FRAME]; ROWS + 1],
}

impl<V: Vectors> Task<V> for Framing<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, reader: &mut impl Reader<V>) {
        let mut next = 0;
        loop {
            // The last strip ends with the frame, so that no pixel beyond it is needed.
            let column = next.min(self.columns.saturating_sub(LANES));
            reader.strip(column);
            for line in &mut self.framed[..self.columns] {
                line[column..column + LANES].copy_from_slice(&reader.row().numbers());
            }
            next += LANES;
            if next >= self.columns {
                break;
            }
        }
    }
}

impl<const STRIPS: usize> Patch<STRIPS> {
    /// Values and slopes, rounded and not yet weighted.
    #[inline(always)]
    fn differentiate<V: Vectors>(&mut self, v: V, window: Window, weights: &Weights<STRIPS>) {
        const SIDE: f32 = 3.0 / 32.0;
        const MIDDLE: f32 = 10.0 / 32.0;
        let (side, middle, magic) = (Lanes::all(v, SIDE), Lanes::all(v, MIDDLE), nearest(BITS));
        let mut sum = Lanes::zero(v);
        for (s, strip) in weights.lines.iter().enumerate() {
            for (line, weight) in self.framed[1..].iter().zip(strip).take(window.side) {
                sum += Lanes::load(v, &line[s * LANES + 1..]) * Lanes::new(v, *weight);
            }
        }
        let mean = (sum.sum() / weights.total) as f32;
        self.stats.mean = mean;
        for (s, (strip, mask)) in self.lines.iter_mut().zip(&weights.mask).enumerate() {
            let (first, mask) = (s * LANES, Lanes::new(v, *mask));
            for (line, rows) in strip.iter_mut().zip(self.framed.windows(3)).take(window.side) {
                let [above, here, below] = [&rows[0], &rows[1], &rows[2]];
                let corners = [
                    Lanes::load(v, &above[first..]),
                    Lanes::load(v, &above[first + 2..]),
                    Lanes::load(v, &below[first..]),
                    Lanes::load(v, &below[first + 2..]),
                ];
                let falling = corners[3] - corners[0];
                let rising = corners[1] - corners[2];
                let gx = side * (falling + rising)
                    + middle * (Lanes::load(v, &here[first + 2..]) - Lanes::load(v, &here[first..]));
                let gy = side * (falling - rising)
                    + middle * (Lanes::load(v, &below[first + 1..]) - Lanes::load(v, &above[first + 1..]));
                line.slope = [(gx.rounded(magic) * mask).numbers(), (gy.rounded(magic) * mask).numbers()];
                line.value =
                    ((Lanes::load(v, &here[first + 1..]) - Lanes::all(v, mean)).rounded(magic) * mask).numbers();
            }
        }
    }

    /// Sums over the patch; weighs the lines while at it.
    #[inline(always)]
    fn sum<V: Vectors, const WARP: bool>(
        &mut self,
        v: V,
        window: Window,
        weights: &Weights<STRIPS>,
        sums: &mut PatchSums,
    ) {
        let half = window.half as f32;
        for (s, (strip, weights)) in self.lines.iter_mut().zip(&weights.lines).enumerate() {
            let mut planes = [Moments::zero(v); PatchSums::PLANES];
            let mut energy = Lanes::zero(v);
            for (j, (line, weight)) in strip.iter_mut().zip(weights).take(window.side).enumerate() {
                let y = Lanes::all(v, (j as f32 - half) / half);
                let (gx, gy) = (Lanes::new(v, line.slope[0]), Lanes::new(v, line.slope[1]));
                let (value, lanes) = (Lanes::new(v, line.value), Lanes::new(v, *weight));
                let (wx, wy, weighted) = (gx * lanes, gy * lanes, value * lanes);
                line.slope = [wx.numbers(), wy.numbers()];
                line.value = weighted.numbers();
                line.weight = *weight;
                energy += weighted * value;
                let products = [wx * gx, wx * gy, wy * gy, wx, wy, wx * value, wy * value];
                for k in 0..PatchSums::PLANES {
                    planes[k].add::<WARP>(products[k], y, k < 3);
                }
            }
            let x = Lanes::count(v, (s * LANES) as f32) * Lanes::all(v, 1.0 / half) - Lanes::all(v, 1.0);
            for (sums, plane) in sums.planes.iter_mut().zip(&planes) {
                plane.gather::<WARP>(x, sums);
            }
            sums.energy += energy.sum();
        }
    }

    /// Writes values and slopes in sixteen bits, as long as they are not weighted.
    pub fn pack(&self, window: Window, out: &mut [i16]) {
        const UNITS: f32 = (1 << BITS) as f32;
        let lines = self.lines.iter().flat_map(|strip| &strip[..window.side]);
        for (line, out) in lines.zip(out.as_chunks_mut::<{ 3 * LANES }>().0) {
            let weight = line.weight.map(|w| if w > 0.0 { UNITS / w } else { 0.0 });
            for (plane, out) in [line.slope[0], line.slope[1], line.value].iter().zip(out.chunks_exact_mut(LANES)) {
                for k in 0..LANES {
                    out[k] = (plane[k] * weight[k]).round() as i16;
                }
            }
        }
    }
}

/// A kept patch on its way back.
pub(super) struct Unpacking<'t, const STRIPS: usize> {
    pub packed: &'t [i16],
    pub window: Window,
    pub weights: &'t Weights<STRIPS>,
    pub patch: &'t mut Patch<STRIPS>,
}

impl<const STRIPS: usize> Kernel for Unpacking<'_, STRIPS> {
    type Output = ();

    #[inline(always)]
    fn call<V: Vectors>(self, _: V) {
        const GREY: f32 = 1.0 / (1 << BITS) as f32;
        let (chunks, side) = (self.packed.as_chunks::<{ 3 * LANES }>().0, self.window.side);
        let strips = self.patch.lines.iter_mut().zip(&self.weights.lines).zip(chunks.chunks_exact(side));
        for ((strip, weights), chunks) in strips {
            for ((line, weight), packed) in strip.iter_mut().zip(weights).zip(chunks) {
                let mut planes = [[0.0; LANES]; 3];
                for (plane, packed) in planes.iter_mut().zip(packed.as_chunks::<LANES>().0) {
                    for k in 0..LANES {
                        plane[k] = f32::from(packed[k]) * GREY * weight[k];
                    }
                }
                line.slope = [planes[0], planes[1]];
                line.value = planes[2];
                line.weight = *weight;
            }
        }
    }
}

/// Moments of a plane within a strip: Σ t, Σ y t and Σ y² t, column by column.
#[derive(Clone, Copy)]
struct Moments<V: Vectors> {
    whole: Lanes<V>,
    y: Lanes<V>,
    yy: Lanes<V>,
}

impl<V: Vectors> Moments<V> {
    #[inline(always)]
    fn zero(v: V) -> Self {
        let zero = Lanes::zero(v);
        Self { whole: zero, y: zero, yy: zero }
    }

    #[inline(always)]
    fn add<const WARP: bool>(&mut self, t: Lanes<V>, y: Lanes<V>, second: bool) {
        self.whole += t;
        if WARP {
            let yt = y * t;
            self.y += yt;
            if second {
                self.yy += y * yt;
            }
        }
    }

    /// Adds 1, x, y, x², xy and y² times the plane.
    #[inline(always)]
    fn gather<const WARP: bool>(&self, x: Lanes<V>, sums: &mut [f64; 6]) {
        sums[0] += self.whole.sum();
        if WARP {
            let along_x = x * self.whole;
            sums[1] += along_x.sum();
            sums[2] += self.y.sum();
            sums[3] += (x * along_x).sum();
            sums[4] += (x * self.y).sum();
            sums[5] += self.yy.sum();
        }
    }
}

/// Sums over a patch: for each plane its product with 1, x, y, x², xy and y².
#[derive(Default)]
struct PatchSums {
    /// gx², gx·gy, gy², gx, gy, gx·value, gy·value.
    planes: [[f64; 6]; Self::PLANES],
    energy: f64,
}

impl PatchSums {
    const PLANES: usize = 7;

    fn finish(&self, total: f64, gain_bias: bool, affine: bool, stats: &mut Stats) {
        // Which slope each steepest-descent image is made of, and which of 1, x and y it is multiplied by.
        const IMAGES: [(usize, usize); AFFINE] = [(0, 0), (1, 0), (0, 1), (0, 2), (1, 1), (1, 2)];
        const POWERS: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
        let count = if affine { AFFINE } else { SHIFT };
        stats.energy = self.energy;
        stats.hessian = SMatrix::zeros();
        for (k, &(slope, power)) in IMAGES.iter().take(count).enumerate() {
            stats.sums[k] = self.planes[3 + slope][power];
            stats.cross[k] = self.planes[5 + slope][power];
        }
        let energy = if self.energy > 0.0 { self.energy } else { f64::INFINITY };
        for (i, &(si, pi)) in IMAGES.iter().enumerate().take(count) {
            for (j, &(sj, pj)) in IMAGES.iter().enumerate().take(i + 1) {
                let mut sum = self.planes[si + sj][POWERS[pi][pj]];
                if gain_bias {
                    sum -= stats.sums[i] * stats.sums[j] / total + stats.cross[i] * stats.cross[j] / energy;
                }
                stats.hessian[(i, j)] = sum;
                stats.hessian[(j, i)] = sum;
            }
        }
    }
}
