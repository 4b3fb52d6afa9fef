//! One template against one level: inverse compositional Gauss–Newton (Baker and Matthews, "Lucas–Kanade 20 years on",
//! 2004). For a shift without gain this is the paper's iteration (eq. 2 and 3), whose `G` is the template's too.

use super::sampler::{Region, Window, dot};
use super::template::{AFFINE, SHIFT, Template};
use crate::pyramid::{Interpolation, Level};
use geometry::Vec2;
use nalgebra::{Cholesky, Const, Matrix2, SVector};

/// Contrast of the found patch relative to the template beyond which it is another thing.
const CONTRAST: std::ops::RangeInclusive<f64> = 0.25..=4.0;
/// Variance of Scharr's slope per variance of the pixels, for independent noise: 2 (3² + 10² + 3²) / 32².
pub(super) const SLOPE_NOISE: f64 = 0.23;

/// A patch whose texture in one direction is less than this part of the other's has none.
const SINGULAR: f64 = 1e-4;
/// Texture that a coarse level needs along a direction to move along it, squared grey levels per pixel.
const COARSE_TEXTURE: f64 = 0.5;
/// A direction with less texture than this part of the other's is left alone at coarse levels.
const WEAK_DIRECTION: f64 = 0.01;

/// Where a patch is: `x` of the template's window is at `position + warp · x`, pixels of the level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub position: Vec2,
    pub warp: Matrix2<f64>,
}

/// How well a template fits where it is.
pub(super) struct Fit {
    /// Contrast of the picture over the template's.
    pub gain: f64,
    /// Mean squared difference after gain and bias, squared grey levels of the picture.
    pub variance: f64,
}

/// What one iteration changes.
pub(super) struct Step {
    /// In the template's frame, pixels.
    pub shift: Vec2,
    /// How far a pixel of the window moves, pixels.
    pub length: f64,
}

/// Solved steps of the shift alone, or of shift and warp with the warp held near the predicted one.
///
/// It lives on the stack for one level of one point: a box would cost more than the space.
#[allow(clippy::large_enum_variant)]
pub(super) enum Solver {
    Shift { inverse: Matrix2<f64> },
    Affine { hessian: Cholesky<f64, Const<AFFINE>>, stiffness: f64, predicted: Matrix2<f64> },
}

impl Solver {
    /// `None` if the template has less texture in some direction than `least`, squared grey levels per pixel.
    pub fn shift(template: &Template, window: Window, least: f64) -> Option<Self> {
        let block = template.shift_hessian();
        let (weak, strong) = eigenvalues(&block);
        let textured = weak > (least * window.count() as f64).max(SINGULAR * strong);
        textured.then(|| block.try_inverse()).flatten().map(|inverse| Self::Shift { inverse })
    }

    /// Moves only along directions with texture: a coarse level that sees a mere edge must not slide along it.
    pub fn textured_shift(template: &Template, window: Window) -> Option<Self> {
        let block = template.shift_hessian();
        let (weak, strong) = eigenvalues(&block);
        let least = COARSE_TEXTURE * window.count() as f64;
        if weak > least.max(WEAK_DIRECTION * strong) {
            return block.try_inverse().map(|inverse| Self::Shift { inverse });
        }
        // The projection onto the strong direction over its eigenvalue.
        let inverse = (block - Matrix2::identity() * weak) / ((strong - weak) * strong);
        (strong > least && strong > weak).then_some(Self::Shift { inverse })
    }

    /// The warp's entries are expected within `sigma` of `predicted`; the texture outvotes that where it can, given
    /// the noise of the fit.
    pub fn affine(template: &Template, window: Window, fit: &Fit, sigma: f64, predicted: Matrix2<f64>) -> Option<Self> {
        let noise = (fit.variance / (fit.gain * fit.gain)).max(1e-4);
        let stiffness = noise / (sigma * window.half as f64).powi(2);
        let mut hessian = template.hessian;
        for k in SHIFT..AFFINE {
            hessian[(k, k)] += stiffness;
        }
        Some(Self::Affine { hessian: hessian.cholesky()?, stiffness, predicted })
    }

    fn unknowns(&self) -> usize {
        match self {
            Self::Shift { .. } => SHIFT,
            Self::Affine { .. } => AFFINE,
        }
    }

    /// Information the fit holds on the shift, whatever the warp: pixels of slope squared, per squared grey level.
    fn shift_information(&self) -> Option<Matrix2<f64>> {
        match self {
            Self::Shift { inverse } => inverse.try_inverse(),
            Self::Affine { hessian, .. } => {
                let covariance: Matrix2<f64> = hessian.inverse().fixed_view::<SHIFT, SHIFT>(0, 0).into();
                covariance.try_inverse()
            }
        }
    }

    /// Shift and warp (in the template's frame) that explain the products of the steepest-descent images and the
    /// difference.
    fn solve(
        &self,
        mut products: SVector<f64, AFFINE>,
        warp: &Matrix2<f64>,
        window: Window,
    ) -> Option<(Vec2, Matrix2<f64>)> {
        match self {
            Self::Shift { inverse } => Some((inverse * products.fixed_rows::<SHIFT>(0), Matrix2::zeros())),
            Self::Affine { hessian, stiffness, predicted } => {
                let half = window.half as f64;
                let away = (predicted.try_inverse()? * warp - Matrix2::identity()) * (half * stiffness);
                for (k, away) in [away.m11, away.m12, away.m21, away.m22].into_iter().enumerate() {
                    products[SHIFT + k] += away;
                }
                let s = hessian.solve(&products);
                Some((Vec2::new(s[0], s[1]), Matrix2::new(s[2], s[3], s[4], s[5]) / half))
            }
        }
    }
}

/// Buffers that a thread uses for one point after another.
#[derive(Default)]
pub(super) struct Scratch {
    pub template: Template,
    pub region: Region,
    samples: Vec<f32>,
}

impl Scratch {
    fn read(&mut self, level: &Level, pose: &Pose, window: Window, interpolation: Interpolation) {
        let offset = self.template.mean;
        self.region.read(level, &pose.position, &pose.warp, window, interpolation, offset, &mut self.samples);
    }

    /// Contrast of the samples relative to the template.
    fn gain(&self, gain_bias: bool) -> f64 {
        if gain_bias && self.template.energy > 0.0 {
            dot(&self.template.values, &self.samples) / self.template.energy
        } else {
            1.0
        }
    }

    /// One step, `rate` of the way; the whole of it is returned, or `None` if it cannot be made.
    pub fn step(
        &mut self,
        level: &Level,
        pose: &mut Pose,
        window: Window,
        interpolation: Interpolation,
        solver: &Solver,
        gain_bias: bool,
        rate: f64,
    ) -> Option<Step> {
        self.read(level, pose, window, interpolation);
        let gain = self.gain(gain_bias).clamp(*CONTRAST.start(), *CONTRAST.end());
        let mut products = SVector::<f64, AFFINE>::zeros();
        for k in 0..solver.unknowns() {
            products[k] = dot(&self.template.descent[k], &self.samples) / gain - self.template.constant[k];
        }
        let (shift, stretch) = solver.solve(products, &pose.warp, window)?;
        let length = shift.norm() + 0.5 * window.half as f64 * stretch.norm();
        pose.position -= pose.warp * shift * rate;
        pose.warp *= (Matrix2::identity() + stretch * rate).try_inverse()?;
        (length.is_finite() && plausible(&pose.warp)).then_some(Step { shift, length })
    }

    /// Measures the fit; `None` if the contrast is another thing's.
    pub fn fit(
        &mut self,
        level: &Level,
        pose: &Pose,
        window: Window,
        interpolation: Interpolation,
        gain_bias: bool,
    ) -> Option<Fit> {
        self.read(level, pose, window, interpolation);
        let gain = self.gain(gain_bias);
        let count = window.count() as f64;
        let (mut sum, mut squares) = (0.0, 0.0);
        let lines = self.samples.chunks_exact(window.pitch).zip(self.template.values.chunks_exact(window.pitch));
        for (samples, values) in lines {
            for (sample, value) in samples[..window.side].iter().zip(values) {
                let difference = f64::from(*sample) - gain * f64::from(*value);
                sum += difference;
                squares += difference * difference;
            }
        }
        let bias = if gain_bias { sum * sum / count } else { 0.0 };
        CONTRAST.contains(&gain).then_some(Fit { gain, variance: ((squares - bias) / count).max(0.0) })
    }
}

/// Whether a warp neither mirrors, nor stretches or squeezes a patch beyond what can still be compared.
pub(super) fn plausible(warp: &Matrix2<f64>) -> bool {
    let determinant = warp.determinant();
    warp.norm() < 4.0 && determinant > 0.06 && determinant < 16.0
}

/// The smaller and the larger eigenvalue of a symmetric matrix.
fn eigenvalues(m: &Matrix2<f64>) -> (f64, f64) {
    let (mean, root) = (m.trace() / 2.0, ((m.m11 - m.m22) / 2.0).hypot(m.m12));
    (mean - root, mean + root)
}

/// Standard deviation per axis of a found position, pixels: what the fit leaves unexplained over the texture, without
/// the slopes that noise of the given standard deviation makes itself. `None` if no texture is left in some direction.
pub(super) fn deviation(solver: &Solver, fit: &Fit, pose: &Pose, window: Window, noise: f64) -> Option<f64> {
    let count = window.count() as f64;
    let free = (count - solver.unknowns() as f64 - 2.0).max(1.0);
    let variance = fit.variance * count / free / (fit.gain * fit.gain);
    let own = count * SLOPE_NOISE * (variance / 2.0).min(noise * noise);
    let information = solver.shift_information()? - Matrix2::identity() * own;
    let (weak, _) = eigenvalues(&information);
    let covariance = pose.warp * information.try_inverse()? * pose.warp.transpose() * variance;
    (weak > 0.0).then(|| (covariance.trace() / 2.0).sqrt())
}
