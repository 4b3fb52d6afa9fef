//! `W L⁻ᵀ` of a chunk of points.

use super::block::SIZE;
use super::layout::{Chunk, Layout, Sight};
use super::linearise::{ChunkBlocks, PointBlock};
use super::squares::cross;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use geometry::{Mat3, Vec3};
use pulp::NullaryFnOnce;

/// `W L⁻ᵀ` of a chunk: a row for each unknown of the frames from the first to the last that sees one of its points, and
/// three columns for each point. Frames between that do not see a point have zeros there.
pub(super) struct Panel {
    /// Column of the reduced equations of the first row.
    pub(super) first: usize,
    pub(super) rows: usize,
    values: Vec<f64>,
    /// The rows of the camera's unknowns.
    pub(super) camera: Mat<f64>,
    /// `L⁻¹ g`.
    gradient: Vec<f64>,
    /// `L⁻ᵀ` of each point.
    pub(super) inverses: Vec<Mat3>,
    /// The row that is held still.
    held: Option<usize>,
}

impl Panel {
    pub(super) fn new(layout: &Layout, chunk: &Chunk) -> Self {
        let (rows, columns) = (chunk.columns.len(), 3 * chunk.points.len());
        Self {
            first: chunk.columns.start,
            rows,
            values: vec![0.0; rows * columns],
            camera: Mat::zeros(layout.camera.len(), columns),
            gradient: vec![0.0; columns],
            inverses: vec![Mat3::zeros(); chunk.points.len()],
            held: layout.held_column().filter(|c| chunk.columns.contains(c)).map(|c| c - chunk.columns.start),
        }
    }

    /// Fills the panel at a damping. `None` when a point's block is not positive definite.
    pub(super) fn fill(&mut self, layout: &Layout, chunk: &Chunk, blocks: &ChunkBlocks, damping: f64) -> Option<()> {
        for (i, block) in blocks.points.iter().enumerate() {
            let inverse = inverse_factor(block, damping)?;
            let whitened = inverse.transpose() * Vec3::from(block.gradient());
            self.gradient[3 * i..3 * i + 3].copy_from_slice(whitened.as_slice());
            for (row, &k) in layout.camera.iter().enumerate() {
                let by_camera = inverse.transpose() * Vec3::from_row_slice(&block.by_camera[3 * k..3 * k + 3]);
                (0..3).for_each(|j| self.camera[(row, 3 * i + j)] = by_camera[j]);
            }
            self.inverses[i] = inverse;
        }
        if self.rows > 0 {
            pulp::Arch::new().dispatch(Whiten { panel: self, layout, chunk, blocks });
        }
        Some(())
    }

    pub(super) fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.values, self.rows, self.gradient.len())
    }

    /// Subtracts what the points give from the reduced gradient.
    pub(super) fn subtract_gradient(&self, gradient: &mut [f64], frame_columns: usize) {
        let whitened = MatRef::from_column_major_slice(&self.gradient, self.gradient.len(), 1);
        let by_frames = self.view() * whitened;
        let by_camera = &self.camera * whitened;
        (0..self.rows).for_each(|i| gradient[self.first + i] -= by_frames[(i, 0)]);
        (0..self.camera.nrows()).for_each(|i| gradient[frame_columns + i] -= by_camera[(i, 0)]);
    }

    /// The panel times the camera's rows transposed, and these rows times themselves transposed.
    pub(super) fn camera_products(&self) -> (Mat<f64>, Mat<f64>) {
        let mut by_frames = Mat::zeros(self.rows, self.camera.nrows());
        matmul(by_frames.as_mut(), Accum::Replace, self.view(), self.camera.transpose(), 1.0, Par::Seq);
        (by_frames, &self.camera * self.camera.transpose())
    }

    /// `-L⁻ᵀ (L⁻¹ g + (W L⁻ᵀ)ᵀ s)` of each point at a step of the cameras.
    pub(super) fn point_steps(&self, cameras: &[f64], frame_columns: usize) -> Vec<Vec3> {
        let (own, of_camera) = (&cameras[self.first..self.first + self.rows], &cameras[frame_columns..]);
        let by_frames = self.view().transpose() * MatRef::from_column_major_slice(own, self.rows, 1);
        let by_camera = self.camera.transpose() * MatRef::from_column_major_slice(of_camera, of_camera.len(), 1);
        let step = |(i, inverse): (usize, &Mat3)| {
            let whitened =
                Vec3::from_fn(|k, _| self.gradient[3 * i + k] + by_frames[(3 * i + k, 0)] + by_camera[(3 * i + k, 0)]);
            -(inverse * whitened)
        };
        self.inverses.iter().enumerate().map(step).collect()
    }
}

/// The panel's blocks, for the widest vectors of the machine.
struct Whiten<'a> {
    panel: &'a mut Panel,
    layout: &'a Layout<'a>,
    chunk: &'a Chunk,
    blocks: &'a ChunkBlocks,
}

impl NullaryFnOnce for Whiten<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { panel, layout, chunk, blocks } = self;
        let Panel { first, rows, values, inverses, held, .. } = panel;
        let sights: &[Sight] = &layout.sights[chunk.sights.clone()];
        let mut before = None;
        for (i, sight) in sights.iter().enumerate() {
            let block = &blocks.sights[i / SIZE];
            let number = |k: usize| block[k][i % SIZE];
            // A frame may see a point more than once.
            let again = before.replace((sight.frame, sight.place)) == Some((sight.frame, sight.place));
            let Some(column) = layout.column_of_frame[sight.frame] else { continue };
            let place = sight.place - chunk.points.start;
            let (factor, row) = (&inverses[place], column - *first);
            let y = [number(9), number(10), number(11)];
            for j in 0..3 {
                // The factor is upper triangular.
                let mut shift = [0.0; 3];
                for k in 0..=j {
                    let f = factor[(k, j)];
                    (0..3).for_each(|i| shift[i] += number(3 * k + i) * f);
                }
                let target = &mut values[(3 * place + j) * *rows + row..][..6];
                let turn = cross(y, shift);
                let whitened = [turn[0], turn[1], turn[2], shift[0], shift[1], shift[2]];
                if again {
                    target.iter_mut().zip(whitened).for_each(|(sum, value)| *sum += value);
                } else {
                    target.copy_from_slice(&whitened);
                }
            }
        }
        if let Some(held) = *held {
            values.iter_mut().skip(held).step_by(*rows).for_each(|value| *value = 0.0);
        }
    }
}

/// `L⁻ᵀ`, upper triangular, of a point's damped block `L Lᵀ`.
fn inverse_factor(block: &PointBlock, damping: f64) -> Option<Mat3> {
    let mut hessian = block.hessian();
    let floor = damping.min(1e-14) * hessian.diagonal().max();
    (0..3).for_each(|k| hessian[(k, k)] += damping * hessian[(k, k)] + floor);
    // In closed form: L is [a 0 0; b c 0; d e f].
    let a = hessian[(0, 0)].sqrt();
    let (b, d) = (hessian[(1, 0)] / a, hessian[(2, 0)] / a);
    let c = (hessian[(1, 1)] - b * b).sqrt();
    let e = (hessian[(2, 1)] - b * d) / c;
    let f = (hessian[(2, 2)] - d * d - e * e).sqrt();
    let (ia, ic, inverse_f) = (1.0 / a, 1.0 / c, 1.0 / f);
    let (ib, ie) = (-b * ia * ic, -e * ic * inverse_f);
    let id = -(d * ia + e * ib) * inverse_f;
    let inverse = Mat3::new(ia, ib, id, 0.0, ic, ie, 0.0, 0.0, inverse_f);
    inverse.iter().all(|v| v.is_finite()).then_some(inverse)
}
