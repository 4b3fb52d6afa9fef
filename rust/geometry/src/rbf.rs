//! Affine plus radial basis function warps of space.
//!
//! `f(p) = p + Σ c_i Φ(‖p − p_i‖) + M p + t` with `Σ c_i = 0` and `Σ c_i p_iᵀ = 0` (paper, eq. 8–10; Pighin et al. 1998).
//! Displacements, not positions, are interpolated: far from every centre the warp is the affine part alone.

use crate::Vec3;
use nalgebra::{DMatrix, Matrix3xX};
use rayon::prelude::*;

/// The radial function Φ, lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// `exp(−r / length)`: the paper's, with its length of 64 read as millimetres.
    Exponential {
        /// Decay length, metres.
        length: f64,
    },
    /// `r`: the biharmonic spline in space.
    Linear,
}

impl Kernel {
    fn evaluate(self, r: f64) -> f64 {
        match self {
            Self::Exponential { length } => (-r / length).exp(),
            // Negated so that the interpolation matrix is positive definite under the side conditions,
            // as it is for the exponential, and smoothing has the same sign for both.
            Self::Linear => -r,
        }
    }
}

/// How to fit a warp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RbfOptions {
    /// The radial function.
    pub kernel: Kernel,
    /// 0 interpolates; larger values trade exactness at the centres for smoothness. In units of the kernel's value
    /// and scaled by each centre's variance.
    pub smoothing: f64,
}

impl Default for RbfOptions {
    fn default() -> Self {
        Self { kernel: Kernel::Exponential { length: 0.064 }, smoothing: 0.0 }
    }
}

/// Why a warp cannot be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RbfError {
    /// Centres, displacements and variances differ in number.
    #[error("{centres} feature points but {displacements} displacements")]
    LengthMismatch {
        /// Number of centres.
        centres: usize,
        /// Number of displacements (or variances).
        displacements: usize,
    },
    /// Fewer than four centres, all in a plane, or two at one place.
    #[error("the {centres} feature points do not span space (too few, in one plane, or two at one place)")]
    Degenerate {
        /// Number of centres.
        centres: usize,
    },
}

/// A fitted warp.
#[derive(Clone, Debug)]
pub struct RbfWarp {
    kernel: Kernel,
    centres: Vec<Vec3>,
    weights: Matrix3xX<f64>,
    /// `[M | t]`.
    affine: nalgebra::Matrix3x4<f64>,
}

impl RbfWarp {
    /// Fits the warp that moves each centre by its displacement. `variances` (one per centre, relative, used with
    /// `options.smoothing`) say which centres may be missed; `None` means all alike.
    pub fn fit(
        centres: &[Vec3],
        displacements: &[Vec3],
        variances: Option<&[f64]>,
        options: &RbfOptions,
    ) -> Result<Self, RbfError> {
        let n = centres.len();
        for len in [displacements.len(), variances.map_or(n, <[f64]>::len)] {
            if len != n {
                return Err(RbfError::LengthMismatch { centres: n, displacements: len });
            }
        }
        if n < 4 {
            return Err(RbfError::Degenerate { centres: n });
        }
        // The affine columns are centred and scaled so that the one system is well conditioned in any unit.
        let origin = centres.iter().sum::<Vec3>() / n as f64;
        let spread = centres.iter().map(|p| (p - origin).norm()).fold(f64::MIN_POSITIVE, f64::max);
        let scaled = |i: usize, k: usize| if k == 3 { 1.0 } else { (centres[i][k] - origin[k]) / spread };
        let matrix = DMatrix::from_fn(n + 4, n + 4, |i, j| match (i < n, j < n) {
            (true, true) if i == j => {
                options.kernel.evaluate(0.0) + options.smoothing * variances.map_or(1.0, |v| v[i])
            }
            (true, true) => options.kernel.evaluate((centres[i] - centres[j]).norm()),
            (true, false) => scaled(i, j - n),
            (false, true) => scaled(j, i - n),
            (false, false) => 0.0,
        });
        let right = DMatrix::from_fn(n + 4, 3, |i, k| if i < n { displacements[i][k] } else { 0.0 });
        let solution = matrix.clone().lu().solve(&right).filter(|x| (&matrix * x - &right).amax() < 1e-7 * spread);
        let solution = solution.ok_or(RbfError::Degenerate { centres: n })?;
        let weights = Matrix3xX::from_fn(n, |k, i| solution[(i, k)]);
        let linear = nalgebra::Matrix3::from_fn(|k, j| solution[(n + j, k)] / spread);
        let offset = Vec3::from_fn(|k, _| solution[(n + 3, k)]) - linear * origin;
        let mut affine = nalgebra::Matrix3x4::zeros();
        affine.fixed_view_mut::<3, 3>(0, 0).copy_from(&linear);
        affine.set_column(3, &offset);
        Ok(Self { kernel: options.kernel, centres: centres.to_vec(), weights, affine })
    }

    /// The displacement of a point.
    pub fn displacement(&self, point: &Vec3) -> Vec3 {
        let mut sum = self.affine * point.push(1.0);
        for (i, centre) in self.centres.iter().enumerate() {
            sum += self.weights.column(i) * self.kernel.evaluate((point - centre).norm());
        }
        sum
    }

    /// The warped points.
    pub fn apply(&self, points: &[Vec3]) -> Vec<Vec3> {
        points.par_iter().map(|p| p + self.displacement(p)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(n: usize) -> Vec<Vec3> {
        (0..n)
            .map(|i| i as f64)
            .map(|i| Vec3::new((2.3 * i).sin(), (1.1 * i).cos(), (0.7 * i + 1.0).sin()) * 0.08)
            .collect()
    }

    fn bend(p: &Vec3) -> Vec3 {
        Vec3::new(0.01 * (20.0 * p.y).sin(), 0.3 * p.x * p.x, -0.005)
    }

    #[test]
    fn passes_through_every_centre() {
        let centres = cloud(40);
        let moves: Vec<Vec3> = centres.iter().map(bend).collect();
        for kernel in [Kernel::Exponential { length: 0.064 }, Kernel::Linear] {
            let warp = RbfWarp::fit(&centres, &moves, None, &RbfOptions { kernel, smoothing: 0.0 }).unwrap();
            for (c, u) in centres.iter().zip(&moves) {
                assert!((warp.displacement(c) - u).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn affine_motion_is_reproduced_everywhere() {
        let centres = cloud(12);
        let affine = |p: &Vec3| Vec3::new(0.1 * p.x - 0.2 * p.z + 0.01, 0.3 * p.y, 0.05 * p.x);
        let moves: Vec<Vec3> = centres.iter().map(affine).collect();
        let warp = RbfWarp::fit(&centres, &moves, None, &RbfOptions::default()).unwrap();
        let far = Vec3::new(3.0, -2.0, 5.0);
        assert!((warp.displacement(&far) - affine(&far)).norm() < 1e-9);
    }

    #[test]
    fn smoothing_averages_noise_instead_of_following_it() {
        let centres = cloud(200);
        let noisy: Vec<Vec3> =
            (0..200).map(|i| bend(&centres[i]) + Vec3::z() * 0.002 * (37.0 * i as f64).sin()).collect();
        let error = |smoothing: f64| {
            let options = RbfOptions { smoothing, ..RbfOptions::default() };
            let warp = RbfWarp::fit(&centres, &noisy, None, &options).unwrap();
            centres.iter().map(|c| (warp.displacement(c) - bend(c)).norm_squared()).sum::<f64>()
        };
        assert!(error(1.0) < 0.5 * error(0.0));
    }

    #[test]
    fn flat_coinciding_or_few_centres_are_refused() {
        let flat: Vec<Vec3> = cloud(10).iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect();
        let moves = vec![Vec3::x(); 10];
        let fit = |centres: &[Vec3]| RbfWarp::fit(centres, &moves[..centres.len()], None, &RbfOptions::default());
        assert!(matches!(fit(&flat), Err(RbfError::Degenerate { .. })));
        assert!(matches!(fit(&cloud(3)), Err(RbfError::Degenerate { .. })));
        let mut twice = cloud(10);
        twice[1] = twice[0];
        assert!(matches!(fit(&twice), Err(RbfError::Degenerate { .. })));
    }
}
