//! Steps from measurements: the normal equations of the shift and of the affine warp, and the deviation they leave.

use super::measure::Sums;
use super::patch::{AFFINE, SHIFT, Stats};
use super::window::Window;
use geometry::Vec2;
use nalgebra::{Cholesky, Const, Matrix2, SVector};

/// Contrast of the found patch relative to the template beyond which it is another thing.
pub(super) const CONTRAST: std::ops::RangeInclusive<f64> = 0.25..=4.0;
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
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Contrast of the picture over the template's.
    pub gain: f64,
    /// Mean squared difference after gain and bias, squared grey levels of the picture.
    pub variance: f64,
    /// Normalised correlation.
    pub ncc: f64,
}

impl Fit {
    #[inline(always)]
    pub fn new(sums: &Sums, stats: &Stats, total: f64, gain_bias: bool) -> Self {
        Self {
            gain: sums.gain(stats, gain_bias),
            variance: sums.variance(stats, total, gain_bias),
            ncc: sums.correlation(stats, total),
        }
    }
}

/// Solved steps of the shift alone, or of shift and warp with the warp held near the predicted one.
///
/// It lives on the stack for one level of one point: a box would cost more than the space.
#[allow(clippy::large_enum_variant)]
pub(super) enum Solver {
    Shift { inverse: Matrix2<f64> },
    Affine { hessian: Cholesky<f64, Const<AFFINE>>, stiffness: f64, back: Matrix2<f64> },
}

impl Solver {
    /// `None` if the template has less texture in some direction than `least`, squared grey levels per pixel.
    pub fn shift(stats: &Stats, total: f64, least: f64) -> Option<Self> {
        let block = stats.shift_hessian();
        let (weak, strong) = eigenvalues(&block);
        let textured = weak > (least * total).max(SINGULAR * strong);
        textured.then(|| block.try_inverse()).flatten().map(|inverse| Self::Shift { inverse })
    }

    /// Moves only along directions with texture: a coarse level that sees a mere edge must not slide along it.
    pub fn textured_shift(stats: &Stats, total: f64) -> Option<Self> {
        let block = stats.shift_hessian();
        let (weak, strong) = eigenvalues(&block);
        let least = COARSE_TEXTURE * total;
        if weak > least.max(WEAK_DIRECTION * strong) {
            return block.try_inverse().map(|inverse| Self::Shift { inverse });
        }
        // The projection onto the strong direction over its eigenvalue.
        let inverse = (block - Matrix2::identity() * weak) / ((strong - weak) * strong);
        (strong > least && strong > weak).then_some(Self::Shift { inverse })
    }

    /// The warp's entries are expected within `sigma` of `predicted`; the texture outvotes that where it can, given
    /// the noise of the fit.
    pub fn affine(stats: &Stats, window: Window, fit: &Fit, sigma: f64, predicted: Matrix2<f64>) -> Option<Self> {
        let noise = (fit.variance / (fit.gain * fit.gain)).max(1e-4);
        let stiffness = noise / (sigma * window.half as f64).powi(2);
        let mut hessian = stats.hessian;
        for k in SHIFT..AFFINE {
            hessian[(k, k)] += stiffness;
        }
        Some(Self::Affine { hessian: hessian.cholesky()?, stiffness, back: predicted.try_inverse()? })
    }

    pub fn unknowns(&self) -> usize {
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
    #[inline(always)]
    pub fn solve(&self, products: &[f64; AFFINE], warp: &Matrix2<f64>, half: f64) -> (Vec2, Matrix2<f64>) {
        match self {
            Self::Shift { inverse: m } => {
                let [x, y, ..] = *products;
                (Vec2::new(m.m11 * x + m.m12 * y, m.m21 * x + m.m22 * y), Matrix2::zeros())
            }
            Self::Affine { hessian, stiffness, back } => {
                let mut products = SVector::<f64, AFFINE>::from(*products);
                let away = (back * warp - Matrix2::identity()) * (half * stiffness);
                for (k, away) in [away.m11, away.m12, away.m21, away.m22].into_iter().enumerate() {
                    products[SHIFT + k] += away;
                }
                let s = hessian.solve(&products);
                (Vec2::new(s[0], s[1]), Matrix2::new(s[2], s[3], s[4], s[5]) / half)
            }
        }
    }
}

/// Whether a warp neither mirrors, nor stretches or squeezes a patch beyond what can still be compared.
#[inline(always)]
pub(super) fn plausible(warp: &Matrix2<f64>) -> bool {
    let determinant = warp.determinant();
    warp.norm_squared() < 16.0 && determinant > 0.06 && determinant < 16.0
}

/// The smaller and the larger eigenvalue of a symmetric matrix.
fn eigenvalues(m: &Matrix2<f64>) -> (f64, f64) {
    let (mean, half) = (m.trace() / 2.0, (m.m11 - m.m22) / 2.0);
    let root = (half * half + m.m12 * m.m12).sqrt();
    (mean - root, mean + root)
}

/// Standard deviation per axis of a found position, pixels: what the fit leaves unexplained over the texture, without
/// the slopes that noise of the given standard deviation makes itself. `None` if no texture is left in some direction.
///
/// `total` is the sum of the pixels' weights and `effective` the number of equal ones that say as much.
pub(super) fn deviation(
    solver: &Solver,
    fit: &Fit,
    pose: &Pose,
    total: f64,
    effective: f64,
    noise: f64,
) -> Option<f64> {
    let free = (effective - solver.unknowns() as f64 - 2.0).max(1.0);
    let variance = fit.variance * effective / free / (fit.gain * fit.gain);
    let own = total * SLOPE_NOISE * (variance / 2.0).min(noise * noise);
    let information = solver.shift_information()? - Matrix2::identity() * own;
    let (weak, _) = eigenvalues(&information);
    // Weighted sums hold `total` of information while the noise in them is that of `total² / effective` pixels.
    let covariance = pose.warp * information.try_inverse()? * pose.warp.transpose() * (variance * total / effective);
    (weak > 0.0).then(|| (covariance.trace() / 2.0).sqrt())
}
