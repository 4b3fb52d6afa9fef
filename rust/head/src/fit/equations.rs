//! Normal equations of the fits: coefficients and slips shared by all frames, and blocks of single frames eliminated from
//! them by the Schur complement.
//!
//! The shared unknowns are, in this order, `K` shape coefficients, `E` extras (a focal length, a similarity) and two
//! slips for each of `L` landmarks.

use super::model::{LandmarkModel, dot};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::Solve;
use faer::{Accum, Mat, MatRef, Par, Side};
use geometry::{Mat3, Vec3};
use rayon::prelude::*;

/// Normal equations of the shared unknowns; only the lower half of the Hessian is used.
pub(crate) struct SharedSystem {
    pub cost: f64,
    pub hessian: Mat<f64>,
    pub gradient: Mat<f64>,
}

/// Normal equations of one frame's own unknowns and their coupling with the shared ones.
pub(crate) struct FrameSystem {
    pub hessian: Mat<f64>,
    pub gradient: Mat<f64>,
    pub coupling: Mat<f64>,
}

impl FrameSystem {
    /// The step of the frame's own unknowns while the shared ones are held.
    pub fn step_alone(&self) -> Option<Mat<f64>> {
        Some(-self.hessian.llt(Side::Lower).ok()?.solve(&self.gradient))
    }
}

/// Sums over all sightings of each landmark, as functions of its place in the head frame and of the extras.
#[derive(Clone)]
pub(crate) struct LandmarkSums {
    pub cost: f64,
    /// Hessian by each landmark's place.
    pub place_hessian: Vec<Mat3>,
    /// Gradient by each landmark's place.
    pub place_gradient: Vec<Vec3>,
    /// `E × 3L`: mixed part of the Hessian.
    pub extra_by_place: Mat<f64>,
    /// `E × E`.
    pub extra_hessian: Mat<f64>,
    /// `E × 1`.
    pub extra_gradient: Mat<f64>,
}

impl LandmarkSums {
    pub fn zeros(landmarks: usize, extras: usize) -> Self {
        Self {
            cost: 0.0,
            place_hessian: vec![Mat3::zeros(); landmarks],
            place_gradient: vec![Vec3::zeros(); landmarks],
            extra_by_place: Mat::zeros(extras, 3 * landmarks),
            extra_hessian: Mat::zeros(extras, extras),
            extra_gradient: Mat::zeros(extras, 1),
        }
    }

    pub fn add(&mut self, other: &Self) {
        self.cost += other.cost;
        self.place_hessian.iter_mut().zip(&other.place_hessian).for_each(|(a, b)| *a += b);
        self.place_gradient.iter_mut().zip(&other.place_gradient).for_each(|(a, b)| *a += b);
        self.extra_by_place += &other.extra_by_place;
        self.extra_hessian += &other.extra_hessian;
        self.extra_gradient += &other.extra_gradient;
    }
}

/// Single rows `√w [∂r/∂x | ∂r/∂extra]` and residuals `√w r`, for what is no landmark.
#[derive(Clone, Default)]
pub(crate) struct DenseRows {
    pub cost: f64,
    values: Vec<f64>,
    residuals: Vec<f64>,
}

impl DenseRows {
    pub fn push(&mut self, by_coefficients: &[f64], by_extras: &[f64], residual: f64, weight: f64, loss: f64) {
        let root = weight.sqrt();
        self.values.extend(by_coefficients.iter().chain(by_extras).map(|v| v * root));
        self.residuals.push(residual * root);
        self.cost += loss;
    }

    pub fn append(&mut self, mut other: Self) {
        self.cost += other.cost;
        self.values.append(&mut other.values);
        self.residuals.append(&mut other.residuals);
    }

    fn matrix(&self, width: usize) -> MatRef<'_, f64> {
        MatRef::from_row_major_slice(&self.values, self.residuals.len(), width)
    }
}

/// The data's part of the shared equations.
pub(crate) fn assemble(landmarks: &LandmarkModel, sums: &LandmarkSums, rows: &DenseRows) -> SharedSystem {
    let (count, size, extras) = (landmarks.points.len(), landmarks.basis.ncols(), sums.extra_gradient.nrows());
    let (slips, total) = (size + extras, size + extras + 2 * count);
    let basis = &landmarks.basis;
    let mut weighted = Mat::<f64>::zeros(3 * count, size);
    for (l, h) in sums.place_hessian.iter().enumerate() {
        for (row, k) in (0..3).flat_map(|row| (0..size).map(move |k| (row, k))) {
            weighted[(3 * l + row, k)] = (0..3).map(|axis| h[(row, axis)] * basis[(3 * l + axis, k)]).sum();
        }
    }
    let mut hessian = Mat::<f64>::zeros(total, total);
    let mut gradient = Mat::<f64>::zeros(total, 1);
    hessian.submatrix_mut(0, 0, size, size).copy_from(basis.transpose() * &weighted);
    hessian.submatrix_mut(size, 0, extras, size).copy_from(&sums.extra_by_place * basis);
    hessian.submatrix_mut(size, size, extras, extras).copy_from(&sums.extra_hessian);
    let flat = Mat::from_fn(3 * count, 1, |row, _| sums.place_gradient[row / 3][row % 3]);
    gradient.submatrix_mut(0, 0, size, 1).copy_from(basis.transpose() * &flat);
    gradient.submatrix_mut(size, 0, extras, 1).copy_from(&sums.extra_gradient);
    for (l, landmark) in landmarks.points.iter().enumerate() {
        for (i, tangent) in landmark.tangents.iter().enumerate() {
            let row = slips + 2 * l + i;
            for k in 0..size {
                hessian[(row, k)] = (0..3).map(|axis| tangent[axis] * weighted[(3 * l + axis, k)]).sum();
            }
            for e in 0..extras {
                hessian[(row, size + e)] =
                    (0..3).map(|axis| tangent[axis] * sums.extra_by_place[(e, 3 * l + axis)]).sum();
            }
            for (j, other) in landmark.tangents.iter().enumerate() {
                hessian[(row, slips + 2 * l + j)] = tangent.dot(&(sums.place_hessian[l] * other));
            }
            gradient[(row, 0)] = tangent.dot(&sums.place_gradient[l]);
        }
    }
    let dense = rows.matrix(slips);
    let residuals = MatRef::from_column_major_slice(&rows.residuals, rows.residuals.len(), 1);
    matmul(hessian.submatrix_mut(0, 0, slips, slips), Accum::Add, dense.transpose(), dense, 1.0, Par::Seq);
    matmul(gradient.submatrix_mut(0, 0, slips, 1), Accum::Add, dense.transpose(), residuals, 1.0, Par::Seq);
    SharedSystem { cost: sums.cost + rows.cost, hessian, gradient }
}

impl SharedSystem {
    /// Adds Gaussian priors of mean zero: `sigmas` of the coefficients, `precision` of the slips.
    pub fn add_priors(&mut self, coefficients: &[f64], sigmas: &[f64], slips: &[f64], precision: &Mat<f64>) {
        for (k, (x, sigma)) in coefficients.iter().zip(sigmas).enumerate() {
            let information = sigma.powi(-2);
            self.hessian[(k, k)] += information;
            self.gradient[(k, 0)] += information * x;
        }
        let first = self.gradient.nrows() - slips.len();
        let pull = precision * MatRef::from_column_major_slice(slips, slips.len(), 1);
        let mut block = self.hessian.submatrix_mut(first, first, slips.len(), slips.len());
        block += precision;
        for i in 0..slips.len() {
            self.gradient[(first + i, 0)] += pull[(i, 0)];
        }
        self.cost += prior_cost(coefficients, sigmas, slips, precision);
    }
}

/// What [`SharedSystem::add_priors`] adds to the cost.
pub(crate) fn prior_cost(coefficients: &[f64], sigmas: &[f64], slips: &[f64], precision: &Mat<f64>) -> f64 {
    let pull = precision * MatRef::from_column_major_slice(slips, slips.len(), 1);
    let slip_cost = dot(slips, &(0..slips.len()).map(|i| pull[(i, 0)]).collect::<Vec<_>>());
    slip_cost + coefficients.iter().zip(sigmas).map(|(x, s)| (x / s).powi(2)).sum::<f64>()
}

/// The step of all unknowns with Marquardt's damping; `None` when the equations are not positive definite.
pub(crate) fn step(shared: &SharedSystem, frames: &[FrameSystem], damping: f64) -> Option<(Mat<f64>, Vec<Mat<f64>>)> {
    let total = shared.gradient.nrows();
    let eliminated: Option<Vec<(Mat<f64>, Mat<f64>)>> =
        frames.par_iter().map(|frame| eliminate(frame, total, damping)).collect();
    let eliminated = eliminated?;
    let mut reduced = damped(&shared.hessian, damping);
    let mut right = -&shared.gradient;
    if !eliminated.is_empty() {
        let height: usize = eliminated.iter().map(|(_, v)| v.nrows()).sum();
        let mut stacked = Mat::<f64>::zeros(height, total + 1);
        let mut top = 0;
        for (_, v) in &eliminated {
            stacked.submatrix_mut(top, 0, v.nrows(), total + 1).copy_from(v);
            top += v.nrows();
        }
        subtract_square(&mut reduced, stacked.submatrix(0, 0, height, total));
        right += stacked.submatrix(0, 0, height, total).transpose() * stacked.submatrix(0, total, height, 1);
    }
    let solution = reduced.llt(Side::Lower).ok()?.solve(&right);
    let back = |(lower, v): &(Mat<f64>, Mat<f64>)| {
        let mut x = -(v.submatrix(0, 0, v.nrows(), total) * &solution + v.submatrix(0, total, v.nrows(), 1));
        solve_upper_triangular_in_place(lower.transpose(), x.as_mut(), Par::Seq);
        x
    };
    let steps: Vec<Mat<f64>> = eliminated.iter().map(back).collect();
    let finite = (0..total).all(|i| solution[(i, 0)].is_finite());
    finite.then_some((solution, steps))
}

/// The Cholesky factor `L` of a frame's block, and `L⁻¹ [coupling | gradient]`.
fn eliminate(frame: &FrameSystem, total: usize, damping: f64) -> Option<(Mat<f64>, Mat<f64>)> {
    let own = frame.hessian.nrows();
    let lower = damped(&frame.hessian, damping).llt(Side::Lower).ok()?.L().to_owned();
    let mut v = Mat::<f64>::zeros(own, total + 1);
    v.submatrix_mut(0, 0, own, total).copy_from(&frame.coupling);
    v.submatrix_mut(0, total, own, 1).copy_from(&frame.gradient);
    solve_lower_triangular_in_place(lower.as_ref(), v.as_mut(), Par::Seq);
    Some((lower, v))
}

fn damped(hessian: &Mat<f64>, damping: f64) -> Mat<f64> {
    let mut result = hessian.clone();
    for i in 0..result.nrows() {
        result[(i, i)] *= 1.0 + damping;
    }
    result
}

/// Subtracts `vᵀ v` from the lower half, columns in parallel.
fn subtract_square(target: &mut Mat<f64>, v: MatRef<'_, f64>) {
    const BLOCK: usize = 128;
    let total = target.ncols();
    let starts: Vec<usize> = (0..total).step_by(BLOCK).collect();
    let product = |&start: &usize| {
        let width = BLOCK.min(total - start);
        let tail = v.subcols(start, total - start);
        tail.transpose() * v.subcols(start, width)
    };
    let blocks: Vec<Mat<f64>> = starts.par_iter().map(product).collect();
    for (start, block) in starts.into_iter().zip(blocks) {
        let mut part = target.submatrix_mut(start, start, block.nrows(), block.ncols());
        part -= block;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(rows: usize, columns: usize, phase: f64) -> Mat<f64> {
        Mat::from_fn(rows, columns, |i, j| (1.3 * ((i + 2) * (j + 3)) as f64 + 0.7 * (j * j) as f64 + phase).sin())
    }

    #[test]
    fn elimination_gives_the_step_of_the_whole_system() {
        let (shared_size, own) = (9, 4);
        let jacobians: Vec<Mat<f64>> = (0..3).map(|f| wave(25, shared_size + own, f64::from(f))).collect();
        let residual = |f: usize| wave(25, 1, f as f64 * 0.3 + 5.0);
        let mut whole = Mat::<f64>::zeros(shared_size + 3 * own, shared_size + 3 * own);
        let mut right = Mat::<f64>::zeros(shared_size + 3 * own, 1);
        let mut shared = SharedSystem {
            cost: 0.0,
            hessian: Mat::zeros(shared_size, shared_size),
            gradient: Mat::zeros(shared_size, 1),
        };
        let mut frames = Vec::new();
        for (f, j) in jacobians.iter().enumerate() {
            let (h, g) = (j.transpose() * j, j.transpose() * residual(f));
            let place = |i: usize| if i < shared_size { i } else { i + f * own };
            for i in 0..shared_size + own {
                right[(place(i), 0)] -= g[(i, 0)];
                for k in 0..shared_size + own {
                    whole[(place(i), place(k))] += h[(i, k)];
                }
            }
            shared.hessian += h.submatrix(0, 0, shared_size, shared_size);
            shared.gradient += g.submatrix(0, 0, shared_size, 1);
            frames.push(FrameSystem {
                hessian: h.submatrix(shared_size, shared_size, own, own).to_owned(),
                gradient: g.submatrix(shared_size, 0, own, 1).to_owned(),
                coupling: h.submatrix(shared_size, 0, own, shared_size).to_owned(),
            });
        }
        let expected = whole.llt(Side::Lower).unwrap().solve(&right);
        let (solution, steps) = step(&shared, &frames, 0.0).unwrap();
        assert!((0..shared_size).all(|i| (solution[(i, 0)] - expected[(i, 0)]).abs() < 1e-9));
        let own_error = |f: usize, i: usize| (steps[f][(i, 0)] - expected[(shared_size + f * own + i, 0)]).abs();
        assert!((0..3).all(|f| (0..own).all(|i| own_error(f, i) < 1e-9)));
    }
}
