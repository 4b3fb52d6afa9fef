//! One look at a picture: the products of a patch's steepest-descent images with a window, in one pass over it.

use super::lanes::{LANES, Lanes, Vectors};
use super::patch::{AFFINE, Patch, Stats};
use super::region::{Reader, Task};
use super::window::Window;

/// Weighted sums over a window whose grey levels are `s`, less the patch's mean.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Σ of each steepest-descent image times `s`.
    pub images: [f64; AFFINE],
    /// Σ `s`.
    pub sum: f64,
    /// Σ `s`².
    pub squares: f64,
    /// Σ of the patch's values times `s`.
    pub values: f64,
}

impl Sums {
    /// Contrast of the window relative to the patch.
    #[inline(always)]
    pub fn gain(&self, stats: &Stats, gain_bias: bool) -> f64 {
        if gain_bias && stats.energy > 0.0 { self.values / stats.energy } else { 1.0 }
    }

    /// Σ (s − mean of s)².
    #[inline(always)]
    fn energy(&self, total: f64) -> f64 {
        (self.squares - self.sum * self.sum / total).max(0.0)
    }

    /// Mean squared difference after gain and bias, squared grey levels of the window.
    #[inline(always)]
    pub fn variance(&self, stats: &Stats, total: f64, gain_bias: bool) -> f64 {
        let squares = if gain_bias {
            let explained = if stats.energy > 0.0 { self.values * self.values / stats.energy } else { 0.0 };
            self.energy(total) - explained
        } else {
            self.squares - 2.0 * self.values + stats.energy
        };
        (squares / total).max(0.0)
    }

    /// Normalised correlation of the window with the patch, −1 … 1; zero if either is flat.
    #[inline(always)]
    pub fn correlation(&self, stats: &Stats, total: f64) -> f64 {
        let scale = (stats.energy * self.energy(total)).sqrt();
        if scale > 0.0 { (self.values / scale).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// Products of the first `unknowns` steepest-descent images and the difference, brought to the patch's contrast.
    #[inline(always)]
    pub fn products(&self, stats: &Stats, total: f64, gain_bias: bool, gain: f64, unknowns: usize) -> [f64; AFFINE] {
        let mut products = self.images;
        if !gain_bias {
            for (product, cross) in products.iter_mut().zip(&stats.cross).take(unknowns) {
                *product -= cross;
            }
            return products;
        }
        let along = if stats.energy > 0.0 { self.values / stats.energy } else { 0.0 };
        let (mean, scale) = (self.sum / total, 1.0 / gain);
        let sums = stats.sums.iter().zip(&stats.cross);
        for (product, (sum, cross)) in products.iter_mut().zip(sums).take(unknowns) {
            *product = (*product - sum * mean - cross * along) * scale;
        }
        products
    }
}

/// Measures a window: with `WARP` for all steepest-descent images, else for those of the shift; without `FULL` the
/// products alone.
pub(super) struct Measure<'p, V, const STRIPS: usize, const WARP: bool, const FULL: bool> {
    pub vectors: V,
    pub patch: &'p Patch<STRIPS>,
    pub window: Window,
}

impl<V: Vectors, const STRIPS: usize, const WARP: bool, const FULL: bool> Task<V>
    for Measure<'_, V, STRIPS, WARP, FULL>
{
    type Output = Sums;

    #[inline(always)]
    fn run(self, reader: &mut impl Reader<V>) -> Sums {
        let (v, patch, side, half) = (self.vectors, self.patch, self.window.side, self.window.half as f64);
        let mean = Lanes::all(v, patch.stats.mean);
        let mut sums = Sums::default();
        for (s, strip) in patch.lines.iter().enumerate() {
            reader.strip(s * LANES);
            let (mut slopes, mut lower) = ([Lanes::zero(v); 2], [Lanes::zero(v); 2]);
            let (mut sum, mut squares, mut values) = (Lanes::zero(v), Lanes::zero(v), Lanes::zero(v));
            for line in strip.iter().take(side) {
                let grey = reader.row() - mean;
                for k in 0..2 {
                    slopes[k] += Lanes::new(v, line.slope[k]) * grey;
                    if WARP {
                        // A sum of the sums so far counts the first row `side` times and the last one once.
                        lower[k] += slopes[k];
                    }
                }
                if FULL {
                    let weighted = Lanes::new(v, line.weight) * grey;
                    sum += weighted;
                    squares += weighted * grey;
                    values += Lanes::new(v, line.value) * grey;
                }
            }
            let x = Lanes::count(v, (s * LANES) as f32) - Lanes::all(v, half as f32);
            for k in 0..2 {
                let whole = slopes[k].sum();
                sums.images[k] += whole;
                if WARP {
                    sums.images[2 + 2 * k] += (slopes[k] * x).sum() / half;
                    sums.images[3 + 2 * k] += ((half + 1.0) * whole - lower[k].sum()) / half;
                }
            }
            if FULL {
                sums.sum += sum.sum();
                sums.squares += squares.sum();
                sums.values += values.sum();
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::{Interpolation, Pyramid};
    use crate::track::lanes::{Kernel, Plain};
    use crate::track::patch::Taking;
    use crate::track::region::{Region, Sight};
    use crate::track::window::Weights;
    use geometry::Vec2;
    use image::{GrayImage, Luma};
    use nalgebra::Matrix2;

    fn compare<const STRIPS: usize>(side: usize, sigma: Option<f64>) {
        let picture = GrayImage::from_fn(91, 71, |x, y| Luma([((x * x + 3 * y * x + 7 * y) % 251) as u8]));
        let (pyramid, window) = (Pyramid::new(&picture, 1), Window::new(side));
        let (level, half) = (pyramid.finest(), window.half as f64);
        let weights = Weights::<STRIPS>::new(window, sigma);
        let (mut region, mut patch) = (Region::default(), Patch::<STRIPS>::default());
        let centre = Vec2::new(42.3, 33.6);
        Taking {
            level,
            centre,
            grid: Matrix2::identity(),
            interpolation: Interpolation::Bilinear,
            window,
            weights: &weights,
            affine: true,
            gain_bias: false,
            region: &mut region,
            patch: &mut patch,
        }
        .call(Plain);
        let there = centre + Vec2::new(1.7, -2.4);
        let sight = Sight {
            centre: there,
            warp: Matrix2::identity(),
            origin: window.half,
            columns: side,
            rows: side,
            span: STRIPS * LANES,
        };
        region.clear();
        region.cover(level, &sight, Interpolation::Bilinear, true);
        let sums = region.read(
            Plain,
            &sight,
            Interpolation::Bilinear,
            Measure::<Plain, STRIPS, true, true> { vectors: Plain, patch: &patch, window },
        );
        let grey = |at: Vec2| level.sample(&at, Interpolation::Bilinear).unwrap();
        let slope = |at: Vec2| {
            let g = |x: f64, y: f64| grey(at + Vec2::new(x, y));
            let gx =
                3.0 * (g(1.0, -1.0) - g(-1.0, -1.0) + g(1.0, 1.0) - g(-1.0, 1.0)) + 10.0 * (g(1.0, 0.0) - g(-1.0, 0.0));
            let gy =
                3.0 * (g(-1.0, 1.0) - g(-1.0, -1.0) + g(1.0, 1.0) - g(1.0, -1.0)) + 10.0 * (g(0.0, 1.0) - g(0.0, -1.0));
            [gx / 32.0, gy / 32.0]
        };
        let (mut images, mut hessian) = ([0.0; AFFINE], nalgebra::SMatrix::<f64, AFFINE, AFFINE>::zeros());
        let (mut scale, mut squares) = (0.0, 0.0);
        for j in 0..side {
            for i in 0..side {
                let at = Vec2::new(i as f64 - half, j as f64 - half);
                let (w, s) =
                    (f64::from(weights.lines[i / LANES][j][i % LANES]), grey(there + at) - f64::from(patch.stats.mean));
                let ([gx, gy], [x, y]) = (slope(centre + at), [at.x / half, at.y / half]);
                let descent = [gx, gy, gx * x, gx * y, gy * x, gy * y];
                for k in 0..AFFINE {
                    images[k] += w * descent[k] * s;
                    for l in 0..AFFINE {
                        hessian[(k, l)] += w * descent[k] * descent[l];
                    }
                }
                scale += w * (gx * gx + gy * gy).sqrt() * s.abs();
                squares += w * s * s;
            }
        }
        for (k, image) in images.iter().enumerate() {
            assert!((sums.images[k] - image).abs() < 1e-3 * scale, "{side}, {k}: {} is not {}", sums.images[k], image);
        }
        assert!((sums.squares / squares - 1.0).abs() < 1e-4);
        assert!((patch.stats.hessian - hessian).norm() < 1e-3 * hessian.norm(), "{side}");
    }

    #[test]
    fn vectors_sum_what_single_pixels_do() {
        for sigma in [None, Some(0.5)] {
            compare::<1>(3, sigma);
            compare::<1>(7, sigma);
            compare::<2>(9, sigma);
            compare::<3>(21, sigma);
            compare::<4>(31, sigma);
        }
    }
}
