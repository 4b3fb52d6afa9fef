//! The eight-point algorithm with Hartley's normalisation (paper, section 2.5; Hartley 1997).

use geometry::{Mat3, Vec2, Vec3};
use nalgebra::{SMatrix, SVector};

/// The essential matrix of at least eight matches in normalised coordinates, `bᵀ E a = 0`.
///
/// The nearest matrix with singular values `1, 1, 0` is returned. `None` with fewer than eight matches or with matches
/// that leave more than one answer (fewer than eight different ones, points on a plane or a line).
pub fn eight_point(a: &[Vec2], b: &[Vec2]) -> Option<Mat3> {
    if a.len() < 8 || a.len() != b.len() {
        return None;
    }
    let (to_a, to_b) = (normalisation(a)?, normalisation(b)?);
    let mut moments = SMatrix::<f64, 9, 9>::zeros();
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (to_a * a.push(1.0), to_b * b.push(1.0));
        let row = SVector::<f64, 9>::from_fn(|i, _| b[i / 3] * a[i % 3]);
        moments.ger(1.0, &row, &row, 1.0);
    }
    let eigen = moments.symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    if eigen.eigenvalues[order[1]] <= 1e-12 * eigen.eigenvalues[order[8]] {
        return None;
    }
    let e = eigen.eigenvectors.column(order[0]);
    nearest_essential(&(to_b.transpose() * Mat3::from_fn(|i, j| e[3 * i + j]) * to_a))
}

/// Moves points to their centroid and scales them to a mean distance of √2.
fn normalisation(points: &[Vec2]) -> Option<Mat3> {
    let centre = points.iter().sum::<Vec2>() / points.len() as f64;
    let spread = points.iter().map(|p| (p - centre).norm()).sum::<f64>() / points.len() as f64;
    let s = std::f64::consts::SQRT_2 / spread;
    (spread > 1e-12 && s.is_finite()).then(|| Mat3::new(s, 0.0, -s * centre.x, 0.0, s, -s * centre.y, 0.0, 0.0, 1.0))
}

/// The matrix with singular values `1, 1, 0` nearest to a matrix, up to scale.
fn nearest_essential(matrix: &Mat3) -> Option<Mat3> {
    let svd = (matrix / matrix.norm()).try_svd(true, true, f64::EPSILON, 100)?;
    let essential = svd.u? * Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 0.0)) * svd.v_t?;
    essential.iter().all(|v| v.is_finite()).then_some(essential)
}
