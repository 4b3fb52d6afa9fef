//! Blocked Cholesky factorisation: a few hundred unknowns at the speed of matrix products.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Columns factorised at a time.
const BLOCK: usize = 48;

/// The lower factor `L` of a symmetric positive definite matrix `L Lᵀ`.
pub(super) struct Cholesky(DMatrix<f64>);

impl Cholesky {
    /// Reads the lower triangle only. `None` when the matrix is not positive definite.
    pub(super) fn new(mut matrix: DMatrix<f64>) -> Option<Self> {
        let n = matrix.nrows();
        for start in (0..n).step_by(BLOCK) {
            let width = BLOCK.min(n - start);
            let corner = matrix.view((start, start), (width, width)).clone_owned();
            let factor = corner.cholesky()?.unpack();
            matrix.view_mut((start, start), (width, width)).copy_from(&factor);
            let below = n - start - width;
            if below == 0 {
                break;
            }
            // L21 = A21 L11⁻ᵀ; the inverse of a small triangle turns substitution into a product.
            let inverse = factor.solve_lower_triangular(&DMatrix::identity(width, width))?;
            let panel = matrix.view((start + width, start), (below, width)) * inverse.transpose();
            matrix.view_mut((start + width, start), (below, width)).copy_from(&panel);
            subtract_square(&mut matrix, start + width, &panel);
        }
        Some(Self(matrix))
    }

    /// `x` with `L Lᵀ x = b`.
    pub(super) fn solve(&self, b: &DVector<f64>) -> Option<DVector<f64>> {
        let mut x = b.clone();
        (self.0.solve_lower_triangular_mut(&mut x) && self.0.tr_solve_lower_triangular_mut(&mut x)).then_some(x)
    }

    /// The lower right `k × k` part of the inverse of `L Lᵀ`.
    pub(super) fn inverse_corner(&self, k: usize) -> Option<DMatrix<f64>> {
        let n = self.0.nrows();
        let corner = self.0.view((n - k, n - k), (k, k)).lower_triangle();
        (&corner * corner.transpose()).try_inverse()
    }
}

/// Subtracts `panel panelᵀ` from the lower triangle that begins at `(first, first)`, block columns in parallel.
fn subtract_square(matrix: &mut DMatrix<f64>, first: usize, panel: &DMatrix<f64>) {
    let n = matrix.nrows();
    matrix.as_mut_slice()[first * n..].par_chunks_mut(BLOCK * n).enumerate().for_each(|(block, columns)| {
        let (top, width) = (block * BLOCK, columns.len() / n);
        let right = panel.rows(top, width).transpose();
        let product = panel.rows(top, panel.nrows() - top) * right;
        for (column, subtrahend) in columns.chunks_exact_mut(n).zip(product.column_iter()) {
            for (value, s) in column[first + top..].iter_mut().zip(subtrahend.iter()) {
                *value -= s;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(n: usize) -> DMatrix<f64> {
        let m = DMatrix::from_fn(n, n, |i, j| ((i * 37 + j * 91) as f64).sin());
        &m * m.transpose() + DMatrix::identity(n, n)
    }

    #[test]
    fn solves_across_block_borders() {
        for n in [1, 47, 48, 49, 150] {
            let (matrix, x) = (sample(n), DVector::from_fn(n, |i, _| (i as f64).cos()));
            let solved = Cholesky::new(matrix.clone()).unwrap().solve(&(&matrix * &x)).unwrap();
            assert!((solved - x).amax() < 1e-8, "size {n}");
        }
    }

    #[test]
    fn the_corner_of_the_inverse_is_that_of_the_inverse() {
        let matrix = sample(100);
        let corner = Cholesky::new(matrix.clone()).unwrap().inverse_corner(3).unwrap();
        let inverse = matrix.try_inverse().unwrap();
        assert!((corner - inverse.view((97, 97), (3, 3))).amax() < 1e-8);
    }

    #[test]
    fn indefinite_matrices_are_refused() {
        let mut matrix = sample(60);
        matrix[(55, 55)] = -1.0;
        assert!(Cholesky::new(matrix).is_none());
    }
}
