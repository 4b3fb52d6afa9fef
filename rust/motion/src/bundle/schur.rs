//! The step of all unknowns by the Schur complement of the points.
//!
//! With `V = L Lᵀ` a point's block and `W` the frames' blocks against it, `S = U - Σ (W L⁻ᵀ)(W L⁻ᵀ)ᵀ`: the sum over points
//! is a product of a tall matrix with its transpose, done in panels of points that the same frames see.

use super::Step;
use super::cholesky::Cholesky;
use super::linearise::{Layout, Linearised};
use geometry::{Mat3, Vec3};
use nalgebra::{DMatrix, DVector, SMatrix};
use rayon::prelude::*;

/// Points in a panel.
const PANEL_POINTS: usize = 64;
/// Columns of the reduced matrix that one task fills.
const TASK_COLUMNS: usize = 96;

/// `W L⁻ᵀ` of some points: a row for each unknown of the cameras that see them, three columns for each point.
struct Panel {
    /// Column of the reduced system of each row, ascending.
    unknowns: Vec<usize>,
    /// The blocks.
    matrix: DMatrix<f64>,
    /// `L⁻¹ g` of the points.
    gradient: DVector<f64>,
}

/// The system of the cameras alone, lower triangle.
struct Reduced {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    panels: Vec<Panel>,
}

impl Layout<'_> {
    /// The step that solves the equations with their diagonal raised by the part `damping`.
    pub(super) fn solve(&self, linearised: &Linearised, damping: f64) -> Option<Step> {
        let inverses = inverse_factors(linearised, damping)?;
        let reduced = self.reduce(linearised, &inverses, damping);
        let cameras = match self.camera_unknowns() {
            0 => DVector::zeros(0),
            _ => -Cholesky::new(reduced.matrix)?.solve(&reduced.gradient)?,
        };
        let mut points = vec![Vec3::zeros(); linearised.points.len()];
        let steps: Vec<_> = reduced.panels.par_iter().map(|panel| panel.point_steps(&cameras)).collect();
        let chunks = self.point_order.chunks(PANEL_POINTS).zip(&steps);
        for (point, whitened) in chunks.flat_map(|(chunk, steps)| chunk.iter().zip(steps)) {
            points[*point] = inverses[*point] * whitened;
        }
        Some(Step { cameras, points })
    }

    /// How much a damped step lowers the linear model's cost: `-gᵀ s + λ sᵀ D s`.
    pub(super) fn predicted_decrease(&self, linearised: &Linearised, step: &Step, damping: f64) -> f64 {
        let term = |s: f64, gradient: f64, diagonal: f64| s * (damping * diagonal * s - gradient);
        let mut sum = 0.0;
        for (s, (hessian, gradient)) in step.points.iter().zip(&linearised.points) {
            sum += (0..3).map(|k| term(s[k], gradient[k], hessian[(k, k)])).sum::<f64>();
        }
        for (column, block) in self.column_of_frame.iter().zip(&linearised.frames) {
            if let Some(c) = column {
                sum += (0..6).map(|k| term(step.cameras[c + k], block.gradient[k], block.hessian[(k, k)])).sum::<f64>();
            }
        }
        let (hessian, gradient) = &linearised.intrinsics;
        let of_camera = |k: usize| term(step.cameras[self.frame_columns + k], gradient[k], hessian[(k, k)]);
        sum + (0..self.intrinsics).map(of_camera).sum::<f64>()
    }

    /// The covariance of the camera's unknowns in units of the observations' variance, all else free.
    pub(super) fn intrinsic_covariance(&self, linearised: &Linearised) -> Option<DMatrix<f64>> {
        if self.intrinsics == 0 {
            return None;
        }
        // A trace of damping fixes what the observations leave free; the camera does not depend on it.
        let inverses = inverse_factors(linearised, 1e-9)?;
        Cholesky::new(self.reduce(linearised, &inverses, 1e-9).matrix)?.inverse_corner(self.intrinsics)
    }

    fn camera_unknowns(&self) -> usize {
        self.frame_columns + self.intrinsics
    }

    fn reduce(&self, linearised: &Linearised, inverses: &[Mat3], damping: f64) -> Reduced {
        let chunks: Vec<&[usize]> = self.point_order.chunks(PANEL_POINTS).collect();
        let panels: Vec<Panel> = chunks.par_iter().map(|chunk| self.panel(linearised, inverses, chunk)).collect();
        let (mut matrix, mut gradient) = self.camera_blocks(linearised, damping);
        let n = gradient.len();
        for panel in &panels {
            let product = &panel.matrix * &panel.gradient;
            for (unknown, value) in panel.unknowns.iter().zip(product.iter()) {
                gradient[*unknown] -= value;
            }
        }
        if n > 0 {
            matrix.as_mut_slice().par_chunks_mut(TASK_COLUMNS * n).enumerate().for_each(|(task, columns)| {
                for panel in &panels {
                    panel.subtract_square(columns, task * TASK_COLUMNS, n);
                }
            });
        }
        Reduced { matrix, gradient, panels }
    }

    /// The cameras' own blocks, damped, and their gradient.
    fn camera_blocks(&self, linearised: &Linearised, damping: f64) -> (DMatrix<f64>, DVector<f64>) {
        let (n, first) = (self.camera_unknowns(), self.frame_columns);
        let (mut matrix, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (column, block) in self.column_of_frame.iter().zip(&linearised.frames) {
            let Some(c) = *column else { continue };
            matrix.fixed_view_mut::<6, 6>(c, c).copy_from(&block.hessian);
            gradient.fixed_rows_mut::<6>(c).copy_from(&block.gradient);
            for k in 0..self.intrinsics {
                matrix.view_mut((first + k, c), (1, 6)).copy_from(&block.by_intrinsics.column(k).transpose());
            }
        }
        let k = self.intrinsics;
        matrix.view_mut((first, first), (k, k)).copy_from(&linearised.intrinsics.0.view((0, 0), (k, k)));
        gradient.rows_mut(first, k).copy_from(&linearised.intrinsics.1.rows(0, k));
        for i in 0..n {
            matrix[(i, i)] += damping * matrix[(i, i)];
        }
        (matrix, gradient)
    }

    fn panel(&self, linearised: &Linearised, inverses: &[Mat3], points: &[usize]) -> Panel {
        let mut seen_by = vec![false; self.of_frame.len()];
        for sight in points.iter().flat_map(|&p| &self.sights[self.of_point[p].clone()]) {
            seen_by[sight.frame] = true;
        }
        let (mut unknowns, mut row_of_frame) = (Vec::new(), vec![None; seen_by.len()]);
        for (frame, column) in self.column_of_frame.iter().enumerate() {
            if let Some(c) = column.filter(|_| seen_by[frame]) {
                row_of_frame[frame] = Some(unknowns.len());
                unknowns.extend(c..c + 6);
            }
        }
        let camera_row = unknowns.len();
        unknowns.extend(self.frame_columns..self.camera_unknowns());
        let mut matrix = DMatrix::zeros(unknowns.len(), 3 * points.len());
        let mut gradient = DVector::zeros(3 * points.len());
        for (i, &point) in points.iter().enumerate() {
            let mut by_camera = Mat3::zeros();
            for sight in self.of_point[point].clone() {
                let row = &linearised.rows[sight];
                let whitened = row.by_point * inverses[point];
                if let Some(first) = row_of_frame[self.sights[sight].frame] {
                    let block: SMatrix<f64, 6, 3> = row.by_pose.transpose() * whitened;
                    matrix.fixed_view_mut::<6, 3>(first, 3 * i).copy_from(&block);
                }
                by_camera += row.by_intrinsics.transpose() * whitened;
            }
            let k = self.intrinsics;
            matrix.view_mut((camera_row, 3 * i), (k, 3)).copy_from(&by_camera.view((0, 0), (k, 3)));
            gradient.fixed_rows_mut::<3>(3 * i).copy_from(&(inverses[point].transpose() * linearised.points[point].1));
        }
        Panel { unknowns, matrix, gradient }
    }
}

impl Panel {
    /// Subtracts the panel times its transpose from some columns of the reduced matrix, lower triangle.
    fn subtract_square(&self, columns: &mut [f64], first: usize, n: usize) {
        let last = first + columns.len() / n;
        let top = self.unknowns.partition_point(|&u| u < first);
        let width = self.unknowns.partition_point(|&u| u < last) - top;
        if width == 0 {
            return;
        }
        let right = self.matrix.rows(top, width).transpose();
        let product = self.matrix.rows(top, self.unknowns.len() - top) * right;
        for (j, values) in product.column_iter().enumerate() {
            let start = (self.unknowns[top + j] - first) * n;
            let column = &mut columns[start..start + n];
            for (unknown, value) in self.unknowns[top..].iter().zip(values.iter()).skip(j) {
                column[*unknown] -= value;
            }
        }
    }

    /// `-(L⁻¹ g + (W L⁻ᵀ)ᵀ s)` of each point.
    fn point_steps(&self, cameras: &DVector<f64>) -> Vec<Vec3> {
        let own = DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|&u| cameras[u]));
        let whitened = &self.gradient + self.matrix.tr_mul(&own);
        whitened.as_slice().chunks_exact(3).map(|s| -Vec3::from_row_slice(s)).collect()
    }
}

/// `L⁻ᵀ` of each point's damped block; zero for a point that nothing sees.
fn inverse_factors(linearised: &Linearised, damping: f64) -> Option<Vec<Mat3>> {
    let factor = |(hessian, _): &(Mat3, Vec3)| {
        let largest = hessian.diagonal().max();
        if largest == 0.0 {
            return Some(Mat3::zeros());
        }
        let mut damped = *hessian;
        for k in 0..3 {
            damped[(k, k)] += damping * damped[(k, k)] + 1e-14 * largest;
        }
        damped.cholesky()?.l().try_inverse().map(|inverse| inverse.transpose())
    };
    linearised.points.iter().map(factor).collect()
}
