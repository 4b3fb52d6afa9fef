//! How well the shared unknowns are known: by the corners' noise, and by how much single moments move them.
//!
//! The curvature at the minimum gives the covariance if corners err independently. Corners of one picture often err together
//! (motion blur, a rolling shutter, a board bent anew each time); then the moments' gradients scatter more than that
//! covariance says, and the answer with them. Whether they do is told by the bias-reduced sandwich over moments (Bell and
//! McCaffrey 2002), which is right on average for independent errors; where they do, the jackknife (Efron and Stein 1981),
//! which rather errs on the large side, takes its place. All of it is had from the moments' normal equations.

use super::BoardBend;
use super::gram::Gram;
use super::solve::{Normal, Problem, Reduced, State, Step};
use geometry::Vec2;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, SMatrix, Vector3, Vector6};

/// Least pivot of a matrix of unit diagonal that counts as determined.
const MIN_PIVOT: f64 = 1e-10;
/// Fewer moments say nothing about their scatter.
const MIN_SCATTER: usize = 6;
/// Scatter of moments, relative to what independent errors give, beyond which they are not independent: it is reached by
/// chance about once in a hundred times.
const DEPENDENT: f64 = 1.25;

/// Of the shared unknowns, in their order.
pub(super) struct Uncertainty {
    /// Covariance if corners err independently by their standard deviation.
    covariance: DMatrix<f64>,
    /// Variances by the scatter of moments; `None` for few moments.
    between: Option<DVector<f64>>,
    /// The root of their mean ratio to those of the covariance.
    scatter: Option<f64>,
    moments: Vec<Moment>,
    /// What a Newton step would still change.
    step: DVector<f64>,
    /// What a cause that the model leaves out shifts.
    shift: DVector<f64>,
}

/// One moment's part.
struct Moment {
    normal: Normal,
    reduced: Reduced,
    /// Steps of the shared unknowns; `None` where the other moments do not determine them.
    moves: Option<Moves>,
}

/// By how much one moment moves the shared unknowns.
struct Moves {
    /// What leaving it out brings.
    without: DVector<f64>,
    /// The same but for what a Newton step with it brings.
    jackknife: DVector<f64>,
    /// Its part of the sandwich.
    sandwich: DVector<f64>,
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
        let whole = Whole::of(hessian, &gradient)?;
        let moments: Vec<Moment> = parts
            .into_iter()
            .map(|(normal, reduced)| Moment { moves: whole.moves(&reduced), normal, reduced })
            .collect();
        let (between, scatter) = between(&moments, &whole.covariance).unzip();
        let shift = DVector::zeros(n);
        Some(Self { between, scatter, covariance: whole.covariance, moments, step: whole.step, shift })
    }

    /// The state without one moment, its board placed by the others' cameras, to first order; `None` where they do not
    /// determine one.
    pub(super) fn without(&self, problem: &Problem, state: &State, moment: usize) -> Option<State> {
        let Moment { normal, reduced, moves } = &self.moments[moment];
        let shared = moves.as_ref()?.without.clone();
        let mut boards = vec![Vector6::zeros(); state.boards.len()];
        boards[moment] = reduced.boards(normal, &shared)[0];
        Some(problem.moved(state, &Step { shared, boards, promised: 0.0 }))
    }

    /// Standard deviation of an unknown: the larger of both, and the shift.
    pub(super) fn deviation(&self, unknown: usize) -> f64 {
        let scatter = self.inflation(unknown) * self.covariance[(unknown, unknown)].max(0.0).sqrt();
        scatter.hypot(self.shift[unknown])
    }

    /// By how many times single moments move an unknown further than the corners' noise does; at least 1.
    fn inflation(&self, unknown: usize) -> f64 {
        let scatter = self.between.as_ref().map_or(0.0, |all| all[unknown]);
        (scatter / self.covariance[(unknown, unknown)].max(f64::MIN_POSITIVE)).max(1.0).sqrt()
    }

    /// By how many times moments scatter more than independent errors let them; `None` for few moments.
    pub(super) fn scatter(&self) -> Option<f64> {
        self.scatter
    }

    /// Covariance of some unknowns that goes with [`Self::deviation`].
    pub(super) fn raised<const N: usize>(&self, first: usize) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| {
            let (i, j) = (first + i, first + j);
            self.covariance[(i, j)] * self.inflation(i) * self.inflation(j) + self.shift[i] * self.shift[j]
        })
    }
}

/// The equations of all moments: `D (L Lᵀ) D`, where `D` brings the diagonal to 1.
struct Whole {
    scale: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    covariance: DMatrix<f64>,
    /// Newton's.
    step: DVector<f64>,
}

impl Whole {
    /// `None` where the matrix is not positive definite by a clear margin.
    fn of(hessian: DMatrix<f64>, gradient: &DVector<f64>) -> Option<Self> {
        let scale = hessian.diagonal().map(|d| 1.0 / d.sqrt());
        let unit = scaled(&hessian, &scale);
        if unit.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let factor = unit.cholesky()?;
        if factor.l_dirty().diagonal().iter().any(|d| d * d < MIN_PIVOT) {
            return None;
        }
        let covariance = scaled(&factor.inverse(), &scale);
        Some(Self { step: -&covariance * gradient, scale, factor, covariance })
    }

    /// With the moment's share `C = L⁻¹ H L⁻ᵀ` of the whole, whose eigenvalues are between 0 and 1.
    fn moves(&self, own: &Reduced) -> Option<Moves> {
        let l = self.factor.l_dirty();
        let half = l.solve_lower_triangular(&scaled(&own.hessian, &self.scale))?;
        let eigen = l.solve_lower_triangular(&half.transpose())?.symmetric_eigen();
        let others = eigen.eigenvalues.map(|share| 1.0 - share);
        if others.min() < MIN_PIVOT {
            return None;
        }
        // The gradient where all moments together want no step any more.
        let gradient = (&own.gradient + &own.hessian * &self.step).component_mul(&self.scale);
        let turned = eigen.eigenvectors.tr_mul(&l.solve_lower_triangular(&gradient)?);
        let back =
            |v: DVector<f64>| Some(l.tr_solve_lower_triangular(&(&eigen.eigenvectors * v))?.component_mul(&self.scale));
        let jackknife = back(turned.component_div(&others))?;
        let sandwich = back(turned.component_div(&others.map(f64::sqrt)))?;
        Some(Moves { without: &self.step + &jackknife, jackknife, sandwich })
    }
}

fn scaled(matrix: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j])
}

/// Variances by the scatter of moments, and the root of their mean ratio to those of `covariance`.
fn between(moments: &[Moment], covariance: &DMatrix<f64>) -> Option<(DVector<f64>, f64)> {
    let moves: Vec<&Moves> = moments.iter().map(|m| m.moves.as_ref()).collect::<Option<_>>()?;
    let squares = |of: fn(&Moves) -> &DVector<f64>| -> DVector<f64> {
        let zero = DVector::zeros(covariance.nrows());
        moves.iter().fold(zero, |sum, moves| sum + of(moves).map(|d| d * d))
    };
    if moves.len() < MIN_SCATTER {
        return None;
    }
    let sandwich = squares(|m| &m.sandwich);
    let scatter = sandwich.component_div(&covariance.diagonal()).mean().sqrt();
    let count = moves.len() as f64;
    let jackknife = || squares(|m| &m.jackknife) * ((count - 1.0) / count);
    Some((if scatter > DEPENDENT { jackknife() } else { sandwich }, scatter))
}

/// The uncertainty, and how far the board is from flat; a clear bend that was not allowed for makes standard deviations larger. `None`
/// where the unknowns are not determined.
pub(super) fn with_bend(problem: &Problem, state: &State) -> Option<(Uncertainty, Option<BoardBend>)> {
    let flexible = problem.with_bend();
    let grams = flexible.grams(state)?;
    let mut uncertainty = Uncertainty::of(problem, state, &grams)?;
    let bend = bend(&flexible, state, &grams, problem.model.bend);
    if let Some((bend, shift)) = &bend
        && !problem.model.bend
        && bend.is_clear()
    {
        uncertainty.shift.copy_from(shift);
    }
    Some((uncertainty, bend.map(|(bend, _)| bend)))
}

/// How far the board is from flat, and by how much the other shared unknowns change if that is allowed for, by what a Newton
/// step with a free bend says; `None` where that is not determined.
///
/// `flexible` is the problem with a free bend, `grams` its pictures' normal equations, and `bend_was_free` whether the state
/// is at its minimum already.
pub(super) fn bend(
    flexible: &Problem,
    state: &State,
    grams: &[Gram],
    bend_was_free: bool,
) -> Option<(BoardBend, DVector<f64>)> {
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
    let bend = BoardBend {
        coefficients: found.into(),
        bulge_mm: 1e3 * highest.dot(&found),
        deviation_mm: 1e3 * variance.max(0.0).sqrt(),
        explained: (fall / flat_cost).clamp(0.0, 1.0),
    };
    Some((bend, uncertainty.step.rows(0, first).into_owned()))
}

/// What `a, b, c` are multiplied with to give the difference of the highest and the lowest corner from their plane, in the
/// picture where that is largest.
fn bulge(problem: &Problem, state: &State, bend: &Vector3<f64>) -> Option<Vector3<f64>> {
    let of_view = |points: &[Vec2]| {
        let squares = |p: &Vec2| Vector3::from(state.shape.squares(p));
        let plane = |p: &Vec2| (p - state.shape.middle).push(1.0);
        let (mut normal, mut mixed) = (Matrix3::zeros(), Matrix3::zeros());
        for point in points {
            normal += plane(point) * plane(point).transpose();
            mixed += plane(point) * squares(point).transpose();
        }
        let fitted = normal.try_inverse()? * mixed;
        let from_plane = |p: &Vec2| squares(p) - fitted.tr_mul(&plane(p));
        let height = |v: &Vector3<f64>| v.dot(bend);
        let highest = points.iter().map(from_plane).max_by(|a, b| height(a).total_cmp(&height(b)))?;
        let lowest = points.iter().map(from_plane).min_by(|a, b| height(a).total_cmp(&height(b)))?;
        Some(highest - lowest)
    };
    let all = problem.sights.iter().filter_map(|s| of_view(&s.view.points));
    all.max_by(|a, b| a.dot(bend).total_cmp(&b.dot(bend)))
}
