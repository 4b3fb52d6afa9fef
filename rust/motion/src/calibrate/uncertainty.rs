//! How well the shared unknowns are known: by the corners' noise, and by how much single pictures move them.
//!
//! The curvature at the minimum gives the covariance if corners err independently. Corners of one picture often err together
//! (a bent board, motion blur, a rolling shutter); then the answer without each picture in turn, the jackknife (Efron
//! and Stein 1981), scatters more than that covariance says. Both are had from the normal equations by a Newton step.

use super::BoardBend;
use super::gram::Gram;
use super::solve::{Normal, Problem, Reduced, State, Step};
use geometry::Vec2;
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3, Vector6};

/// Least pivot of a matrix of unit diagonal that counts as determined.
const MIN_PIVOT: f64 = 1e-10;
/// Fewer moments say nothing about their scatter: leaving one out leaves hardly anything determined.
const MIN_SCATTER: usize = 6;

/// Of the shared unknowns, in their order.
pub(super) struct Uncertainty {
    /// Covariance if corners err independently by their standard deviation.
    covariance: DMatrix<f64>,
    /// Variances by the jackknife over moments; `None` for few moments.
    jackknife: Option<DVector<f64>>,
    /// The normal equations of each moment, and the step of the shared unknowns that leaving it out brings.
    moments: Vec<(Normal, Reduced, Option<DVector<f64>>)>,
    /// What a Newton step would still change.
    step: DVector<f64>,
}

impl Uncertainty {
    /// From the normal equations of each picture; `None` where the unknowns are not determined.
    pub(super) fn of(problem: &Problem, state: &State, grams: &[Gram]) -> Option<Self> {
        let part = |m: usize| {
            let normal = problem.normal(state, grams, m..m + 1);
            let reduced = normal.reduce(0.0)?;
            Some((normal, reduced))
        };
        let parts: Vec<(Normal, Reduced)> = (0..state.boards.len()).map(part).collect::<Option<_>>()?;
        let n = problem.layout().unknowns();
        let (mut hessian, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (_, reduced) in &parts {
            hessian += &reduced.hessian;
            gradient += &reduced.gradient;
        }
        let covariance = inverse(&hessian)?;
        let without = |own: &Reduced| Some(-inverse(&(&hessian - &own.hessian))? * (&gradient - &own.gradient));
        let moments: Vec<_> = parts
            .into_iter()
            .map(|(normal, reduced)| {
                let step = without(&reduced);
                (normal, reduced, step)
            })
            .collect();
        let steps: Option<Vec<&DVector<f64>>> = moments.iter().map(|(_, _, step)| step.as_ref()).collect();
        let jackknife = steps.and_then(|steps| jackknife(&steps));
        Some(Self { step: -&covariance * gradient, covariance, jackknife, moments })
    }

    /// The state without one moment, its board placed by the others' cameras, to first order; `None` where they do not
    /// determine one.
    pub(super) fn without(&self, problem: &Problem, state: &State, moment: usize) -> Option<State> {
        let (normal, reduced, shared) = &self.moments[moment];
        let shared = shared.clone()?;
        let mut boards = vec![Vector6::zeros(); state.boards.len()];
        boards[moment] = reduced.boards(normal, &shared)[0];
        Some(problem.moved(state, &Step { shared, boards, promised: 0.0 }))
    }

    /// Standard deviation of an unknown: the larger of both.
    pub(super) fn deviation(&self, unknown: usize) -> f64 {
        self.inflation(unknown) * self.covariance[(unknown, unknown)].max(0.0).sqrt()
    }

    /// By how many times single moments move an unknown further than the corners' noise does; at least 1.
    fn inflation(&self, unknown: usize) -> f64 {
        let scatter = self.jackknife.as_ref().map_or(0.0, |all| all[unknown]);
        (scatter / self.covariance[(unknown, unknown)].max(f64::MIN_POSITIVE)).max(1.0).sqrt()
    }

    /// The root mean square over the unknowns of the ratio of both deviations; `None` for few moments.
    pub(super) fn scatter(&self) -> Option<f64> {
        let ratios = self.jackknife.as_ref()?.component_div(&self.covariance.diagonal());
        Some(ratios.mean().sqrt())
    }

    /// Covariance of some unknowns, each raised to its larger deviation.
    pub(super) fn raised<const N: usize>(&self, first: usize) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| {
            let (i, j) = (first + i, first + j);
            self.covariance[(i, j)] * self.inflation(i) * self.inflation(j)
        })
    }
}

fn jackknife(steps: &[&DVector<f64>]) -> Option<DVector<f64>> {
    let count = steps.len();
    if count < MIN_SCATTER {
        return None;
    }
    let zero = DVector::zeros(steps[0].len());
    let mean = steps.iter().fold(zero.clone(), |sum, s| sum + *s) / count as f64;
    let squares = steps.iter().fold(zero, |sum, s| sum + (*s - &mean).map(|d| d * d));
    Some(squares * ((count as f64 - 1.0) / count as f64))
}

/// The inverse of a matrix that is positive definite by a clear margin once its diagonal is scaled to 1.
fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    if scaled.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let factor = scaled.cholesky()?;
    if factor.l_dirty().diagonal().min().powi(2) < MIN_PIVOT {
        return None;
    }
    let inverse = factor.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

/// How far the board is from flat, by what a Newton step with a free bend says; `None` where that is not determined.
///
/// `flexible` is the problem with a free bend, `grams` its pictures' normal equations, and `bend_was_free` whether the state
/// is at its minimum already.
pub(super) fn bend(flexible: &Problem, state: &State, grams: &[Gram], bend_was_free: bool) -> Option<BoardBend> {
    let uncertainty = Uncertainty::of(flexible, state, grams)?;
    let first = flexible.layout().bend_at();
    let found = Vector3::from_fn(|k, _| state.shape.bend[k] + uncertainty.step[first + k]);
    let by_noise: Matrix3<f64> = uncertainty.covariance.fixed_view::<3, 3>(first, first).into_owned();
    let cost: f64 = grams.iter().map(|g| g.cost).sum();
    // By so much the cost falls from the flat board to this one.
    let fall = found.dot(&(by_noise.try_inverse()? * found));
    let flat_cost = if bend_was_free { cost + fall } else { cost };
    let highest = bulge(flexible, state, &found)?;
    let variance = highest.dot(&(uncertainty.raised::<3>(first) * highest));
    Some(BoardBend {
        coefficients: found.into(),
        bulge_mm: 1e3 * highest.dot(&found),
        deviation_mm: 1e3 * variance.max(0.0).sqrt(),
        explained: (fall / flat_cost).clamp(0.0, 1.0),
    })
}

/// What `a, b, c` are multiplied with to give the difference of the highest and the lowest corner from their plane.
fn bulge(problem: &Problem, state: &State, bend: &Vector3<f64>) -> Option<Vector3<f64>> {
    let points: Vec<&Vec2> = problem.sights.iter().flat_map(|s| &s.view.points).collect();
    let squares = |p: &Vec2| Vector3::from(state.shape.squares(p));
    let plane = |p: &Vec2| (p - state.shape.middle).push(1.0);
    let (mut normal, mut mixed) = (Matrix3::zeros(), Matrix3::zeros());
    for point in &points {
        normal += plane(point) * plane(point).transpose();
        mixed += plane(point) * squares(point).transpose();
    }
    let fitted = normal.try_inverse()? * mixed;
    let from_plane = |p: &&Vec2| squares(p) - fitted.tr_mul(&plane(p));
    let height = |v: &Vector3<f64>| v.dot(bend);
    let all = || points.iter().map(from_plane);
    let highest = all().max_by(|a, b| height(a).total_cmp(&height(b)))?;
    let lowest = all().min_by(|a, b| height(a).total_cmp(&height(b)))?;
    Some(highest - lowest)
}
