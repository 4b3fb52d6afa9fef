//! Blocked Cholesky factorisation: a few hundred unknowns at the speed of matrix products, and the same bits whatever the
//! number of threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

/// Columns factorised at a time, and columns that one task updates.
pub(super) const BLOCK: usize = 96;

/// A symmetric matrix of which the lower triangle is kept, column by column, and its factor after [`Symmetric::factorise`].
#[derive(Clone)]
pub(super) struct Symmetric {
    pub(super) n: usize,
    pub(super) values: Vec<f64>,
}

impl Symmetric {
    pub(super) fn zeros(n: usize) -> Self {
        Self { n, values: vec![0.0; n * n] }
    }

    /// Overwrites the lower triangle by `L` with `L Lᵀ` the matrix; what stands above it has no meaning. `None` when the
    /// matrix is not positive definite.
    pub(super) fn factorise(&mut self) -> Option<()> {
        let n = self.n;
        let mut buffer = MemBuffer::new(cholesky_in_place_scratch::<f64>(BLOCK, Par::Seq, Default::default()));
        for start in (0..n).step_by(BLOCK) {
            let end = (start + BLOCK).min(n);
            let (left, right) = self.values.split_at_mut(end * n);
            let columns = MatMut::from_column_major_slice_mut(&mut left[start * n..], n, end - start);
            let (mut corner, mut below) = columns.subrows_mut(start, n - start).split_at_row_mut(end - start);
            let stack = MemStack::new(&mut buffer);
            cholesky_in_place(corner.rb_mut(), Default::default(), Par::Seq, stack, Default::default()).ok()?;
            solve_lower_triangular_in_place(corner.rb(), below.rb_mut().transpose_mut(), Par::Seq);
            let below = below.rb();
            right.par_chunks_mut(BLOCK * n).enumerate().for_each(|(task, columns)| {
                let (top, width) = (task * BLOCK, columns.len() / n);
                let target =
                    MatMut::from_column_major_slice_mut(columns, n, width).subrows_mut(end + top, n - end - top);
                let (lower, across) = (below.subrows(top, n - end - top), below.subrows(top, width));
                matmul(target, Accum::Add, lower, across.transpose(), -1.0, Par::Seq);
            });
        }
        Some(())
    }

    pub(super) fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.values, self.n, self.n)
    }

    /// Replaces `b` by `x` with `L Lᵀ x = b`, after [`Symmetric::factorise`].
    pub(super) fn solve(&self, b: &mut [f64]) {
        let mut x = MatMut::from_column_major_slice_mut(b, self.n, 1);
        solve_lower_triangular_in_place(self.view(), x.rb_mut(), Par::Seq);
        solve_upper_triangular_in_place(self.view().transpose(), x, Par::Seq);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn sample(n: usize) -> DMatrix<f64> {
        let m = DMatrix::from_fn(n, n, |i, j| ((i * 37 + j * 91) as f64).sin());
        &m * m.transpose() + DMatrix::identity(n, n)
    }

    fn symmetric(matrix: &DMatrix<f64>) -> Symmetric {
        Symmetric { n: matrix.nrows(), values: matrix.as_slice().to_vec() }
    }

    #[test]
    fn solves_across_block_borders() {
        for n in [1, BLOCK - 1, BLOCK, BLOCK + 1, 250] {
            let (matrix, x) = (sample(n), DVector::from_fn(n, |i, _| (i as f64).cos()));
            let (mut factor, mut solved) = (symmetric(&matrix), &matrix * &x);
            factor.factorise().unwrap();
            factor.solve(solved.as_mut_slice());
            assert!((solved - x).amax() < 1e-8, "size {n}");
        }
    }

    #[test]
    fn indefinite_matrices_are_refused() {
        let mut matrix = sample(160);
        matrix[(155, 155)] = -1.0;
        assert!(symmetric(&matrix).factorise().is_none());
    }
}
