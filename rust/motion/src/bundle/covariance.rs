//! How certain poses, points and camera are.
//!
//! The inverse of the whole Hessian without forming it: the cameras' part is `S⁻¹ = (L_S L_Sᵀ)⁻¹`, a point's part
//! `L⁻ᵀ (I + Yᵀ Y) L⁻¹` with `Y = L_S⁻¹ W L⁻ᵀ`. Source: Triggs et al. 2000, section 9.

use super::layout::Layout;
use super::panel::Panel;
use super::schur::Reduced;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, MatRef, Par};
use geometry::Mat3;
use nalgebra::{Matrix5, Matrix6, SMatrix};
use rayon::prelude::*;

/// Covariances in the gauge of the adjustment: a fixed or held pose is exact, and so is the coordinate that holds the scale
/// ([`super::Held`]). All else is free: a point's covariance contains what its cameras' adds. Scaled by the noise that was
/// met where it exceeds the one that was announced. Robust losses count an observation by its weight at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariances {
    /// Of each pose by a [`geometry::Transform::retract`] step: rotation vector (rad), then translation (m), both in the
    /// camera frame. Zero for a frame whose pose is kept.
    pub poses: Vec<Matrix6<f64>>,
    /// Of each point in the head frame, m²; `None` for a point that does not count.
    pub points: Vec<Option<Mat3>>,
    /// Of `fx` (px), `k1`, `k2`, `cx` and `cy` (px); zero for what is kept.
    pub camera: Matrix5<f64>,
}

impl Layout<'_> {
    /// The covariances after [`super::cholesky::Symmetric::factorise`] of undamped equations.
    pub(super) fn covariances(&self, reduced: &Reduced, excess: f64, focal_px: f64) -> Covariances {
        let n = reduced.matrix.n;
        let mut inverse = Mat::zeros(n, n);
        invert_lower_triangular(inverse.as_mut(), reduced.matrix.view(), Par::Seq);
        let pose =
            |column: &Option<usize>| column.map_or_else(Matrix6::zeros, |c| self.pose(inverse.as_ref(), c) * excess);
        let of_chunks: Vec<Vec<Mat3>> = reduced.panels.par_iter().map(|panel| self.of_points(reduced, panel)).collect();
        let mut points = vec![None; self.place_of_point.len()];
        for (point, covariance) in self.points.iter().zip(of_chunks.iter().flatten()) {
            points[*point] = Some(covariance * excess);
        }
        Covariances {
            poses: self.column_of_frame.par_iter().map(pose).collect(),
            points,
            camera: self.camera_covariance(reduced, focal_px) * excess,
        }
    }

    /// The covariance of `fx`, `k1`, `k2`, `cx`, `cy` in units of the observations' variance: the inverse of the last corner.
    pub(super) fn camera_covariance(&self, reduced: &Reduced, focal_px: f64) -> Matrix5<f64> {
        let (factor, first, count) = (reduced.matrix.view(), self.frame_columns, self.camera.len());
        let mut inverse = Mat::<f64>::identity(count, count);
        solve_lower_triangular_in_place(factor.submatrix(first, first, count, count), inverse.as_mut(), Par::Seq);
        let product = inverse.transpose() * &inverse;
        let unit = |k: usize| if k == 0 { focal_px } else { 1.0 };
        let mut covariance = Matrix5::zeros();
        for (i, &k) in self.camera.iter().enumerate() {
            for (j, &l) in self.camera.iter().enumerate() {
                covariance[(k, l)] = product[(i, j)] * unit(k) * unit(l);
            }
        }
        covariance
    }

    /// The block of `L⁻ᵀ L⁻¹` at a frame's columns; the held coordinate has none.
    fn pose(&self, inverse: MatRef<'_, f64>, column: usize) -> Matrix6<f64> {
        let columns = inverse.submatrix(column, column, inverse.nrows() - column, 6);
        let product = columns.transpose() * columns;
        let held = self.held_column();
        Matrix6::from_fn(|i, j| match held {
            Some(held) if held == column + i || held == column + j => 0.0,
            _ => product[(i, j)],
        })
    }

    fn of_points(&self, reduced: &Reduced, panel: &Panel) -> Vec<Mat3> {
        let (n, first) = (reduced.matrix.n, panel.first);
        // Rows above the panel's first stay zero.
        let mut solved = Mat::zeros(n - first, 3 * panel.inverses.len());
        solved.submatrix_mut(0, 0, panel.rows, solved.ncols()).copy_from(panel.view());
        let camera = self.frame_columns - first;
        solved.submatrix_mut(camera, 0, n - self.frame_columns, solved.ncols()).copy_from(&panel.camera);
        let factor = reduced.matrix.view().submatrix(first, first, n - first, n - first);
        solve_lower_triangular_in_place(factor, solved.as_mut(), Par::Seq);
        let of_point = |(i, inverse): (usize, &Mat3)| {
            let own = solved.subcols(3 * i, 3);
            let product = own.transpose() * own;
            let inner = Mat3::identity() + SMatrix::from_fn(|r, c| product[(r, c)]);
            inverse * inner * inverse.transpose()
        };
        panel.inverses.iter().enumerate().map(of_point).collect()
    }
}
