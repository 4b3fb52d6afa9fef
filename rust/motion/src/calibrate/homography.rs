//! Homographies from a plane to a picture by the normalised direct linear transform (Hartley 1997).

use geometry::{Mat3, Vec2};
use nalgebra::{SMatrix, SVector, Vector3};

/// Of the normal equations, brought to unit diagonal: a pivot below this belongs to points that do not determine it.
const MIN_PIVOT: f64 = 1e-10;
/// Of a homography of norm 1 between normalised points; pictures of a plane nearly from the side stay above it.
const MIN_DETERMINANT: f64 = 1e-6;

/// The homography `pixel ~ H (x, y, 1)` of at least four points, of norm 1, or `None` if they do not determine one.
///
/// The middle of the points is seen, so that `H₃₃` of the normalised transform is not zero and may be set to 1.
pub(super) fn fit(plane: &[Vec2], pixels: &[Vec2]) -> Option<Mat3> {
    let (from, to) = (normalisation(plane)?, normalisation(pixels)?);
    let (mut normal, mut right) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
    for (p, q) in plane.iter().zip(pixels) {
        let (p, q) = (from * p.push(1.0), to * q.push(1.0));
        for (row, value) in [
            ([p.x, p.y, 1.0, 0.0, 0.0, 0.0, -q.x * p.x, -q.x * p.y], q.x),
            ([0.0, 0.0, 0.0, p.x, p.y, 1.0, -q.y * p.x, -q.y * p.y], q.y),
        ] {
            let row = SVector::<f64, 8>::from(row);
            normal.ger(1.0, &row, &row, 1.0);
            right += row * value;
        }
    }
    let scale = normal.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = SMatrix::<f64, 8, 8>::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
    let factor = scaled.cholesky()?;
    if factor.l_dirty().diagonal().min().powi(2) < MIN_PIVOT {
        return None;
    }
    let h = factor.solve(&right.component_mul(&scale)).component_mul(&scale);
    let normalised = Mat3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
    let normalised = normalised / normalised.norm();
    if normalised.determinant().abs() < MIN_DETERMINANT {
        return None;
    }
    let homography = to.try_inverse()? * normalised * from;
    let scale = homography.norm();
    (scale.is_finite() && scale > 0.0).then(|| homography / scale)
}

/// Moves points to mean 0 and mean distance √2.
fn normalisation(points: &[Vec2]) -> Option<Mat3> {
    if points.len() < 4 {
        return None;
    }
    let mean = points.iter().sum::<Vec2>() / points.len() as f64;
    let distance = points.iter().map(|p| (p - mean).norm()).sum::<f64>() / points.len() as f64;
    let scale = std::f64::consts::SQRT_2 / distance;
    let translation = Vector3::new(-mean.x * scale, -mean.y * scale, 1.0);
    scale.is_finite().then(|| Mat3::from_columns(&[Vector3::x() * scale, Vector3::y() * scale, translation]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_through_its_points() {
        let truth = Mat3::new(500.0, 30.0, 320.0, -20.0, 480.0, 200.0, 0.4, -0.3, 1.0);
        let plane: Vec<Vec2> = (0..12).map(|k| Vec2::new(f64::from(k % 4), f64::from(k / 4)) * 0.03).collect();
        let place = |h: &Mat3, p: &Vec2| {
            let q = h * p.push(1.0);
            q.xy() / q.z
        };
        let pixels: Vec<Vec2> = plane.iter().map(|p| place(&truth, p)).collect();
        let found = fit(&plane, &pixels).unwrap();
        assert!(plane.iter().zip(&pixels).all(|(p, q)| (place(&found, p) - q).norm() < 1e-8));
    }

    #[test]
    fn points_on_a_line_give_none() {
        let line: Vec<Vec2> = (0..6).map(|k| Vec2::new(f64::from(k), 2.0 * f64::from(k))).collect();
        assert!(fit(&line, &line).is_none());
    }

    #[test]
    fn a_point_beside_a_line_is_not_enough() {
        let mut points: Vec<Vec2> = (0..6).map(|k| Vec2::new(f64::from(k), 2.0 * f64::from(k))).collect();
        points.push(Vec2::new(3.0, 1.0));
        assert!(fit(&points, &points).is_none());
    }
}
