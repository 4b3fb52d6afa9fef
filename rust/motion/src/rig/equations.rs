//! The normal equations of poses, places and points, the points eliminated.

use super::adjust::{Layout, Seen, State};
use geometry::least_squares::Loss;
use geometry::{Camera, Mat3, Vec3, skew};
use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix6, SMatrix, Vector6};

/// The loss of an observation, in its standard deviations.
pub(super) const LOSS: Loss = Loss::Cauchy(3.0);
/// Squared residual, in its standard deviations, of a point behind a camera.
const BEHIND: f64 = 1e8;

/// An observation's residual over its standard deviation, and its derivatives by the camera's pose, the head's pose and the point.
struct Row {
    residual: nalgebra::Vector2<f64>,
    by_place: SMatrix<f64, 2, 6>,
    by_pose: SMatrix<f64, 2, 6>,
    by_point: Matrix2x3<f64>,
}

fn row(state: &State, seen: &Seen, camera: &Camera) -> Option<Row> {
    let (place, pose) = (&state.places[seen.camera], &state.poses[seen.moment]);
    let turned = pose.rotation * state.points[seen.point];
    let arm = place.rotation * (turned + pose.translation);
    let (pixel, jacobian) = camera.project_with_jacobian(&(arm + place.translation))?;
    let by_camera: Matrix2x3<f64> = jacobian.point / seen.sigma_px;
    let by_rig = by_camera * place.rotation.matrix();
    let step = |by: &Matrix2x3<f64>, arm: &Vec3| {
        let mut both = SMatrix::<f64, 2, 6>::zeros();
        both.fixed_columns_mut::<3>(0).copy_from(&(-by * skew(arm)));
        both.fixed_columns_mut::<3>(3).copy_from(by);
        both
    };
    Some(Row {
        residual: (pixel - seen.pixel) / seen.sigma_px,
        by_place: step(&by_camera, &arm),
        by_pose: step(&by_rig, &turned),
        by_point: by_rig * pose.rotation.matrix(),
    })
}

/// What the observations of a point give.
pub(super) struct PointBlock {
    pub(super) hessian: Mat3,
    gradient: Vec3,
    /// Against poses and places, by their first columns.
    by: Vec<(usize, SMatrix<f64, 6, 3>)>,
}

/// All equations; of the symmetric matrix both triangles.
pub(super) struct Equations {
    pub(super) cost: f64,
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    pub(super) points: Vec<PointBlock>,
}

impl Equations {
    /// At a state.
    pub(super) fn new(layout: &Layout, state: &State, camera: &Camera) -> Self {
        let n = layout.unknowns;
        let empty = || PointBlock { hessian: Mat3::zeros(), gradient: Vec3::zeros(), by: Vec::new() };
        let mut equations = Self {
            cost: 0.0,
            matrix: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            points: state.points.iter().map(|_| empty()).collect(),
        };
        for seen in layout.seen {
            match row(state, seen, camera) {
                Some(row) => equations.add(layout, seen, &row),
                None => equations.cost += LOSS.evaluate(BEHIND).0,
            }
        }
        for (column, residual, information) in layout.priors(state) {
            equations.cost += residual.dot(&(information * residual));
            let mut own = equations.matrix.fixed_view_mut::<6, 6>(column, column);
            own += information;
            let mut gradient = equations.gradient.fixed_rows_mut::<6>(column);
            gradient += information * residual;
        }
        equations
    }

    fn add(&mut self, layout: &Layout, seen: &Seen, row: &Row) {
        let (loss, weight) = LOSS.evaluate(row.residual.norm_squared());
        self.cost += loss;
        let columns = [(layout.poses[seen.moment], &row.by_pose), (layout.places[seen.camera], &row.by_place)];
        let free: Vec<(usize, &SMatrix<f64, 2, 6>)> =
            columns.into_iter().filter_map(|(column, by)| Some((column?, by))).collect();
        let point = &mut self.points[seen.point];
        point.hessian += row.by_point.transpose() * row.by_point * weight;
        point.gradient += row.by_point.transpose() * row.residual * weight;
        for &(column, by) in &free {
            let mixed = by.transpose() * row.by_point * weight;
            match point.by.iter_mut().find(|(other, _)| *other == column) {
                Some((_, sum)) => *sum += mixed,
                None => point.by.push((column, mixed)),
            }
            let mut gradient = self.gradient.fixed_rows_mut::<6>(column);
            gradient += by.transpose() * row.residual * weight;
            for &(other, by_other) in &free {
                let mut block = self.matrix.fixed_view_mut::<6, 6>(column, other);
                block += by.transpose() * by_other * weight;
            }
        }
    }

    /// The equations of poses and places alone, their diagonals raised by the part `damping`, and the inverses of the points' blocks.
    pub(super) fn reduced(&self, damping: f64) -> Option<(DMatrix<f64>, DVector<f64>, Vec<Mat3>)> {
        let (mut matrix, mut gradient) = (self.matrix.clone(), self.gradient.clone());
        (0..matrix.nrows()).for_each(|k| matrix[(k, k)] *= 1.0 + damping);
        let mut inverses = Vec::with_capacity(self.points.len());
        for point in &self.points {
            if point.by.is_empty() && point.hessian == Mat3::zeros() {
                inverses.push(Mat3::zeros());
                continue;
            }
            let mut raised = point.hessian;
            (0..3).for_each(|k| raised[(k, k)] *= 1.0 + damping);
            let inverse = raised.try_inverse()?;
            for (a, by_a) in &point.by {
                let left = by_a * inverse;
                let mut own = gradient.fixed_rows_mut::<6>(*a);
                own -= left * point.gradient;
                for (b, by_b) in point.by.iter().filter(|(b, _)| b <= a) {
                    let mut block = matrix.fixed_view_mut::<6, 6>(*a, *b);
                    block -= left * by_b.transpose();
                }
            }
            inverses.push(inverse);
        }
        Some((matrix, gradient, inverses))
    }

    /// A damped step of poses and places, and of the points.
    pub(super) fn step(&self, damping: f64) -> Option<(DVector<f64>, Vec<Vec3>)> {
        let (matrix, gradient, inverses) = self.reduced(damping)?;
        let step = if gradient.is_empty() { gradient } else { -matrix.cholesky()?.solve(&gradient) };
        let of_point = |(point, inverse): (&PointBlock, &Mat3)| {
            let back: Vec3 = point.by.iter().map(|(column, by)| by.transpose() * step.fixed_rows::<6>(*column)).sum();
            -(inverse * (point.gradient + back))
        };
        let points = self.points.iter().zip(&inverses).map(of_point).collect();
        Some((step, points))
    }
}

/// The cost alone.
pub(super) fn cost(layout: &Layout, state: &State, camera: &Camera) -> f64 {
    let of_seen = |seen: &Seen| {
        let in_rig = state.poses[seen.moment].apply(&state.points[seen.point]);
        let at = camera.project(&state.places[seen.camera].apply(&in_rig));
        LOSS.evaluate(at.map_or(BEHIND, |at| (at - seen.pixel).norm_squared() / (seen.sigma_px * seen.sigma_px))).0
    };
    let priors = layout.priors(state);
    layout.seen.iter().map(of_seen).sum::<f64>()
        + priors
            .iter()
            .map(|(_, r, information): &(usize, Vector6<f64>, Matrix6<f64>)| r.dot(&(information * r)))
            .sum::<f64>()
}
