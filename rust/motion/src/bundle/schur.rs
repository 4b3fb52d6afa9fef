//! The step of all unknowns by the Schur complement of the points.
//!
//! With `V = L Lᵀ` a point's block and `W` the cameras' blocks against it, `S = U - Σ (W L⁻ᵀ)(W L⁻ᵀ)ᵀ`: the sum over points
//! is a product of a tall matrix with its transpose, done in panels of points that the same frames see. Each task fills
//! some columns of `S` from all panels in their order, so that the sums do not depend on the number of threads.

use super::Step;
use super::cholesky::{BLOCK, Symmetric};
use super::layout::Layout;
use super::linearise::Linearised;
use super::panel::Panel;
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, Par};
use geometry::Vec3;
use rayon::prelude::*;

/// The equations of the cameras alone, and the room for what they are made of.
pub(super) struct Reduced {
    pub(super) matrix: Symmetric,
    gradient: Vec<f64>,
    pub(super) panels: Vec<Panel>,
}

impl Reduced {
    /// Room for a layout's equations.
    pub(super) fn new(layout: &Layout) -> Self {
        let n = layout.reduced_unknowns();
        let panels = layout.chunks.iter().map(|chunk| Panel::new(layout, chunk)).collect();
        Self { matrix: Symmetric::zeros(n), gradient: vec![0.0; n], panels }
    }
}

impl Layout<'_> {
    /// The step that solves the equations with their diagonal raised by the part `damping`.
    pub(super) fn solve(
        &self,
        linearised: &Linearised,
        damping: f64,
        reduced: &mut Reduced,
        step: &mut Step,
    ) -> Option<()> {
        self.reduce(linearised, damping, reduced)?;
        reduced.matrix.factorise()?;
        step.cameras.clear();
        step.cameras.extend(reduced.gradient.iter().map(|g| -g));
        if !step.cameras.is_empty() {
            reduced.matrix.solve(&mut step.cameras);
        }
        let steps: Vec<Vec<Vec3>> =
            reduced.panels.par_iter().map(|panel| panel.point_steps(&step.cameras, self.frame_columns)).collect();
        for (point, change) in self.points.iter().zip(steps.iter().flatten()) {
            step.points[*point] = *change;
        }
        Some(())
    }

    /// How much a damped step lowers the linear model's cost: `-gᵀ s + λ sᵀ D s`.
    pub(super) fn predicted_decrease(&self, linearised: &Linearised, step: &Step, damping: f64) -> f64 {
        let term = |s: f64, gradient: f64, diagonal: f64| s * (damping * diagonal * s - gradient);
        let mut sum = 0.0;
        let blocks = linearised.chunks.iter().flat_map(|chunk| &chunk.points);
        for (point, block) in self.points.iter().zip(blocks) {
            let (s, hessian, gradient) = (&step.points[*point], block.hessian(), block.gradient());
            sum += (0..3).map(|k| term(s[k], gradient[k], hessian[(k, k)])).sum::<f64>();
        }
        for (column, block) in self.column_of_frame.iter().zip(&linearised.frames) {
            if let Some(c) = column {
                let (hessian, gradient) = (block.hessian(), block.gradient());
                sum += (0..6).map(|k| term(step.cameras[c + k], gradient[k], hessian[(k, k)])).sum::<f64>();
            }
        }
        for (i, &k) in self.camera.iter().enumerate() {
            let s = step.cameras[self.frame_columns + i];
            sum += term(s, linearised.camera.gradient[k], linearised.camera.hessian[(k, k)]);
        }
        sum
    }

    /// The equations of the cameras, not yet factorised. `None` when a point's block is not positive definite.
    pub(super) fn reduce(&self, linearised: &Linearised, damping: f64, reduced: &mut Reduced) -> Option<()> {
        let Reduced { matrix, gradient, panels } = reduced;
        let chunks = self.chunks.par_iter().zip(&linearised.chunks);
        let whole: Vec<bool> = panels
            .par_iter_mut()
            .zip(chunks)
            .map(|(panel, (chunk, blocks))| panel.fill(self, chunk, blocks, damping).is_some())
            .collect();
        whole.iter().all(|whole| *whole).then_some(())?;
        let n = matrix.n;
        let columns = |(task, columns): (usize, &mut [f64])| {
            let first = task * BLOCK;
            columns.fill(0.0);
            self.own_blocks(linearised, damping, columns, first);
            panels.iter().for_each(|panel| subtract_square(panel, columns, first, n));
        };
        if n > 0 {
            matrix.values.par_chunks_mut(BLOCK * n).enumerate().for_each(columns);
        }
        self.subtract_camera(panels, matrix);
        self.own_gradient(linearised, gradient);
        for panel in panels.iter() {
            panel.subtract_gradient(gradient, self.frame_columns);
        }
        if let Some(held) = self.held_column() {
            (0..held).for_each(|column| matrix.values[column * n + held] = 0.0);
            matrix.values[held * n + held..(held + 1) * n].fill(0.0);
            matrix.values[held * n + held] = 1.0;
            gradient[held] = 0.0;
        }
        Some(())
    }

    /// The blocks of frames and camera themselves in the columns of a task; its columns hold whole frames.
    fn own_blocks(&self, linearised: &Linearised, damping: f64, columns: &mut [f64], first: usize) {
        let n = self.reduced_unknowns();
        let last = first + columns.len() / n;
        for (column, block) in self.column_of_frame.iter().zip(&linearised.frames) {
            let Some(c) = column.filter(|c| (first..last).contains(c)) else { continue };
            let hessian = block.hessian();
            for j in 0..6 {
                let target = &mut columns[(c + j - first) * n..][..n];
                target[c + j] = hessian[(j, j)] * (1.0 + damping);
                (j + 1..6).for_each(|i| target[c + i] = hessian[(i, j)]);
            }
            for (i, &k) in self.camera.iter().enumerate() {
                for (j, value) in block.by_camera(k).into_iter().enumerate() {
                    columns[(c + j - first) * n + self.frame_columns + i] = value;
                }
            }
        }
        for (j, &l) in self.camera.iter().enumerate() {
            let c = self.frame_columns + j;
            if (first..last).contains(&c) {
                let target = &mut columns[(c - first) * n..][..n];
                for (i, &k) in self.camera.iter().enumerate().skip(j) {
                    let raised = if i == j { 1.0 + damping } else { 1.0 };
                    target[self.frame_columns + i] = linearised.camera.hessian[(k, l)] * raised;
                }
            }
        }
    }

    fn own_gradient(&self, linearised: &Linearised, gradient: &mut [f64]) {
        for (column, block) in self.column_of_frame.iter().zip(&linearised.frames) {
            if let Some(c) = *column {
                gradient[c..c + 6].copy_from_slice(block.gradient());
            }
        }
        for (i, &k) in self.camera.iter().enumerate() {
            gradient[self.frame_columns + i] = linearised.camera.gradient[k];
        }
    }

    /// Subtracts what the points give in the camera's rows.
    fn subtract_camera(&self, panels: &[Panel], matrix: &mut Symmetric) {
        if self.camera.is_empty() {
            return;
        }
        let products: Vec<_> = panels.par_iter().map(Panel::camera_products).collect();
        let n = matrix.n;
        for (panel, (by_frames, own)) in panels.iter().zip(&products) {
            for i in 0..self.camera.len() {
                let row = self.frame_columns + i;
                for (offset, value) in by_frames.col(i).iter().enumerate() {
                    matrix.values[(panel.first + offset) * n + row] -= value;
                }
                (0..=i).for_each(|j| matrix.values[(self.frame_columns + j) * n + row] -= own[(i, j)]);
            }
        }
    }
}

/// Subtracts the panel times its transpose from some columns of the lower triangle.
fn subtract_square(panel: &Panel, columns: &mut [f64], first: usize, n: usize) {
    let last = first + columns.len() / n;
    let (top, right) = (panel.first.max(first), (panel.first + panel.rows).min(last));
    if top >= right {
        return;
    }
    let (height, width) = (panel.first + panel.rows - top, right - top);
    let target = MatMut::from_column_major_slice_mut(columns, n, last - first);
    let target = target.submatrix_mut(top, top - first, height, width);
    let lower = panel.view().subrows(top - panel.first, height);
    matmul(target, Accum::Add, lower, lower.subrows(0, width).transpose(), -1.0, Par::Seq);
}
