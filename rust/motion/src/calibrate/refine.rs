//! Camera and poses together by Levenberg–Marquardt, the poses eliminated picture by picture (Schur complement).

use geometry::least_squares::Loss;
use geometry::{Camera, Transform, Vec2, Vec3, skew};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix2x6, Matrix6, Vector6};
use rayon::prelude::*;

/// Which intrinsic numbers are free, and how they hang together.
///
/// Columns are unknowns, rows `fx, fy, cx, cy, k1, k2`.
#[derive(Clone, Debug)]
pub(super) struct Freedom(DMatrix<f64>);

impl Freedom {
    pub(super) fn new(square_pixels: bool, distortion_terms: usize) -> Self {
        let focal: &[&[usize]] = if square_pixels { &[&[0, 1]] } else { &[&[0], &[1]] };
        let others: &[&[usize]] = &[&[2], &[3], &[4], &[5]];
        let groups: Vec<&[usize]> = focal.iter().chain(&others[..2 + distortion_terms]).copied().collect();
        let mut basis = DMatrix::zeros(6, groups.len());
        for (column, rows) in groups.iter().enumerate() {
            rows.iter().for_each(|&row| basis[(row, column)] = 1.0);
        }
        Self(basis)
    }

    pub(super) fn count(&self) -> usize {
        self.0.ncols()
    }

    fn step(&self, camera: &Camera, step: &DVector<f64>) -> Camera {
        let d = &self.0 * step;
        let Camera { fx, fy, cx, cy, k1, k2, .. } = *camera;
        Camera { fx: fx + d[0], fy: fy + d[1], cx: cx + d[2], cy: cy + d[3], k1: k1 + d[4], k2: k2 + d[5], ..*camera }
    }
}

/// The data and what is to be found.
pub(super) struct Problem<'a> {
    /// Corner pixels of each picture.
    pub(super) views: &'a [Vec<Vec2>],
    /// The corners on the board, metres, z = 0.
    pub(super) board: &'a [Vec3],
    pub(super) freedom: Freedom,
    /// On distances divided by `sigma`.
    pub(super) loss: Loss,
    /// Standard deviation of a corner along one axis, pixels.
    pub(super) sigma: f64,
}

/// A camera and the pose of each picture's board.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) camera: Camera,
    pub(super) poses: Vec<Transform>,
}

/// What [`Problem::minimise`] found.
pub(super) struct Solution {
    pub(super) state: State,
    pub(super) converged: bool,
    /// Covariance of `fx, fy, cx, cy, k1, k2` for the problem's `sigma`; `None` where they are not determined.
    pub(super) covariance: Option<Matrix6<f64>>,
    /// The camera that the other pictures would give without each one, to first order.
    pub(super) without: Vec<Option<Camera>>,
}

/// Normal equations of one picture: intrinsics (`u`), pose (`v`), both (`w`).
struct Block {
    cost: f64,
    u: Matrix6<f64>,
    v: Matrix6<f64>,
    w: Matrix6<f64>,
    intrinsics: Vector6<f64>,
    pose: Vector6<f64>,
}

/// One picture's part of the reduced system, and what brings its pose back.
struct Reduced {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    factor: Cholesky<f64, nalgebra::Const<6>>,
}

const MAX_ITERATIONS: usize = 60;

impl Problem<'_> {
    /// Levenberg–Marquardt with Nielsen's damping from `start`; `None` where a point of it has no pixel.
    pub(super) fn minimise(&self, start: State) -> Option<Solution> {
        let (mut state, mut blocks) = (start.clone(), self.blocks(&start)?);
        let (mut damping, mut growth, mut converged) = (1e-4, 2.0, false);
        for _ in 0..MAX_ITERATIONS {
            let cost = total(&blocks);
            let Some((next, predicted)) = self.step(&state, &blocks, damping) else { break };
            let candidate = self.blocks(&next).filter(|b| total(b) <= cost);
            if predicted <= 1e-12 * cost {
                converged = true;
            }
            let Some(better) = candidate else {
                if converged || damping > 1e12 {
                    break;
                }
                damping *= growth;
                growth *= 2.0;
                continue;
            };
            let gained = cost - total(&better);
            let ratio = gained / predicted.max(f64::MIN_POSITIVE);
            (state, blocks) = (next, better);
            converged |= gained <= 1e-12 * cost;
            if converged {
                break;
            }
            damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-14);
            growth = 2.0;
        }
        let (covariance, without) = self.uncertainty(&state, &blocks);
        Some(Solution { state, converged, covariance, without })
    }

    fn blocks(&self, state: &State) -> Option<Vec<Block>> {
        self.views.par_iter().zip(&state.poses).map(|(view, pose)| self.block(view, &state.camera, pose)).collect()
    }

    /// Sums one picture; `None` where a corner has no pixel.
    fn block(&self, view: &[Vec2], camera: &Camera, pose: &Transform) -> Option<Block> {
        let mut block = Block {
            cost: 0.0,
            u: Matrix6::zeros(),
            v: Matrix6::zeros(),
            w: Matrix6::zeros(),
            intrinsics: Vector6::zeros(),
            pose: Vector6::zeros(),
        };
        for (pixel, point) in view.iter().zip(self.board) {
            let turned = pose.rotation * point;
            let (projected, jacobian) = camera.project_with_jacobian(&(turned + pose.translation))?;
            let residual = (projected - pixel) / self.sigma;
            let (loss, weight) = self.loss.evaluate(residual.norm_squared());
            let by_intrinsics = jacobian.intrinsics / self.sigma;
            let mut by_pose = Matrix2x6::zeros();
            by_pose.fixed_view_mut::<2, 3>(0, 0).copy_from(&(-jacobian.point * skew(&turned) / self.sigma));
            by_pose.fixed_view_mut::<2, 3>(0, 3).copy_from(&(jacobian.point / self.sigma));
            block.cost += loss;
            block.u += by_intrinsics.tr_mul(&by_intrinsics) * weight;
            block.v += by_pose.tr_mul(&by_pose) * weight;
            block.w += by_intrinsics.tr_mul(&by_pose) * weight;
            block.intrinsics += by_intrinsics.tr_mul(&residual) * weight;
            block.pose += by_pose.tr_mul(&residual) * weight;
        }
        Some(block)
    }

    /// Eliminates a picture's pose.
    fn reduce(&self, block: &Block, damping: f64) -> Option<Reduced> {
        let factor = damped(block.v, damping).cholesky()?;
        let basis = &self.freedom.0;
        let hessian = block.u - block.w * factor.solve(&block.w.transpose());
        let gradient = block.intrinsics - block.w * factor.solve(&block.pose);
        Some(Reduced { hessian: basis.transpose() * hessian * basis, gradient: basis.transpose() * gradient, factor })
    }

    /// The state after one damped step, and by how much the quadratic model falls.
    fn step(&self, state: &State, blocks: &[Block], damping: f64) -> Option<(State, f64)> {
        let reduced: Vec<Reduced> = blocks.iter().map(|b| self.reduce(b, damping)).collect::<Option<_>>()?;
        let (mut hessian, gradient) = self.sum(&reduced);
        let basis = &self.freedom.0;
        let diagonal = blocks.iter().fold(Matrix6::zeros(), |sum, b| sum + b.u);
        for (k, damp) in (basis.transpose() * diagonal * basis).diagonal().iter().enumerate() {
            hessian[(k, k)] += damping * damp;
        }
        let shared = -hessian.cholesky()?.solve(&gradient);
        let full = Vector6::from_iterator((basis * &shared).iter().copied());
        let mut predicted = 0.0;
        let mut poses = Vec::with_capacity(state.poses.len());
        for ((block, part), pose) in blocks.iter().zip(&reduced).zip(&state.poses) {
            let own = -part.factor.solve(&(block.pose + block.w.tr_mul(&full)));
            predicted -= 2.0 * (block.intrinsics.dot(&full) + block.pose.dot(&own));
            predicted -= full.dot(&(block.u * full + block.w * own * 2.0)) + own.dot(&(block.v * own));
            poses.push(pose.retract(&own));
        }
        Some((State { camera: self.freedom.step(&state.camera, &shared), poses }, predicted))
    }

    fn sum(&self, parts: &[Reduced]) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.freedom.count();
        let zero = (DMatrix::zeros(n, n), DVector::zeros(n));
        parts.iter().fold(zero, |(h, g), part| (h + &part.hessian, g + &part.gradient))
    }

    /// Covariance of the intrinsics, and the camera without each picture by one Newton step from the common minimum.
    fn uncertainty(&self, state: &State, blocks: &[Block]) -> (Option<Matrix6<f64>>, Vec<Option<Camera>>) {
        let nothing = || (None, vec![None; blocks.len()]);
        let parts: Option<Vec<Reduced>> = blocks.iter().map(|b| self.reduce(b, 0.0)).collect();
        let Some(parts) = parts else { return nothing() };
        let (hessian, gradient) = self.sum(&parts);
        let basis = &self.freedom.0;
        let Some(factor) = well_conditioned(&hessian) else { return nothing() };
        let full = basis * factor * basis.transpose();
        let without = parts.iter().map(|part| {
            let step = -(well_conditioned(&(&hessian - &part.hessian))? * (&gradient - &part.gradient));
            Some(self.freedom.step(&state.camera, &step))
        });
        (Some(Matrix6::from_iterator(full.iter().copied())), without.collect())
    }

    /// The pose of one picture's board for a given camera, from `start`, and the root mean square distance, pixels.
    pub(super) fn resect(&self, view: &[Vec2], camera: &Camera, start: &Transform) -> Option<f64> {
        let mut pose = *start;
        for _ in 0..5 {
            let block = self.block(view, camera, &pose)?;
            pose = pose.retract(&-block.v.cholesky()?.solve(&block.pose));
        }
        self.rms(view, camera, &pose)
    }

    /// Root mean square distance of a picture's corners, pixels.
    pub(super) fn rms(&self, view: &[Vec2], camera: &Camera, pose: &Transform) -> Option<f64> {
        let squares = distances(view, self.board, camera, pose).map(|d| d.map(|d| d * d));
        squares.sum::<Option<f64>>().map(|sum| (sum / view.len() as f64).sqrt())
    }
}

/// Distances between corners and where the camera puts them, pixels.
pub(super) fn distances<'a>(
    view: &'a [Vec2],
    board: &'a [Vec3],
    camera: &'a Camera,
    pose: &'a Transform,
) -> impl Iterator<Item = Option<f64>> + 'a {
    view.iter().zip(board).map(|(pixel, point)| Some((camera.project(&pose.apply(point))? - pixel).norm()))
}

fn total(blocks: &[Block]) -> f64 {
    blocks.iter().map(|b| b.cost).sum()
}

fn damped(mut matrix: Matrix6<f64>, damping: f64) -> Matrix6<f64> {
    for k in 0..6 {
        matrix[(k, k)] *= 1.0 + damping;
    }
    matrix
}

/// The inverse of a matrix that is positive definite by a clear margin once its diagonal is scaled to 1.
fn well_conditioned(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    if scaled.iter().any(|v| !v.is_finite()) || scaled.clone().symmetric_eigenvalues().min() < 1e-12 {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
