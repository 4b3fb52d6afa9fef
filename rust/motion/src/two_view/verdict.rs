//! What the matches of two frames cannot tell: no parallax, a plane, and the spread of a motion.

use super::essential_of;
use super::refine::{sampson_equations, sampson_squared};
use geometry::{Mat3, Transform, Vec2, Vec3};
use nalgebra::{SMatrix, SVector};

/// The values whose flag is set.
pub(super) fn select(values: &[Vec2], flags: &[bool]) -> Vec<Vec2> {
    values.iter().zip(flags).filter(|(_, flag)| **flag).map(|(value, _)| *value).collect()
}

/// How many matches the best mere rotation of the camera explains to within `threshold`.
pub(super) fn explained_by_rotation(a: &[Vec2], b: &[Vec2], threshold: f64) -> usize {
    let rays = |points: &[Vec2]| -> Vec<Vec3> { points.iter().map(|p| p.push(1.0).normalize()).collect() };
    let (rays_a, rays_b) = (rays(a), rays(b));
    let mut rotation = Transform::identity();
    let residual = |rotation: &Transform, i: usize| (rays_b[i] - rotation.rotation * rays_a[i]).norm();
    for round in 0..5 {
        // Weights that fall with distance let the majority decide; the first round takes all.
        let weight =
            |i: usize| if round == 0 { 1.0 } else { 1.0 / (1.0 + (residual(&rotation, i) / threshold).powi(2)) };
        let correlation: Mat3 = (0..a.len()).map(|i| rays_b[i] * rays_a[i].transpose() * weight(i)).sum();
        rotation = Transform::from_matrix(&correlation, Vec3::zeros());
    }
    (0..a.len()).filter(|&i| residual(&rotation, i) < threshold).count()
}

/// Whether a homography explains nine of ten matches about as well as their motion does.
pub(super) fn is_planar(a: &[Vec2], b: &[Vec2], sigma: f64) -> bool {
    if a.len() < super::FEWEST {
        return true;
    }
    let mut weights = vec![1.0; a.len()];
    // A distance in the plane has two parts where an epipolar distance has one, and errs in both frames.
    let limit = (4.0 * sigma).max(1e-9);
    for _ in 0..5 {
        let Some(homography) = fit_homography(a, b, &weights) else { return true };
        for (i, weight) in weights.iter_mut().enumerate() {
            *weight = 1.0 / (1.0 + (transfer_distance(&homography, &a[i], &b[i]) / limit).powi(2));
        }
    }
    let within = weights.iter().filter(|w| **w >= 0.5).count();
    10 * within >= 9 * a.len()
}

fn transfer_distance(homography: &Mat3, a: &Vec2, b: &Vec2) -> f64 {
    let moved = homography * a.push(1.0);
    (moved.xy() / moved.z - b).norm()
}

fn fit_homography(a: &[Vec2], b: &[Vec2], weights: &[f64]) -> Option<Mat3> {
    let mut moments = SMatrix::<f64, 9, 9>::zeros();
    for ((a, b), weight) in a.iter().zip(b).zip(weights) {
        let a = a.push(1.0);
        for axis in 0..2 {
            let mut row = SVector::<f64, 9>::zeros();
            row.fixed_rows_mut::<3>(3 * axis).copy_from(&a);
            row.fixed_rows_mut::<3>(6).copy_from(&(-a * b[axis]));
            moments.ger(*weight, &row, &row, 1.0);
        }
    }
    let eigen = moments.try_symmetric_eigen(f64::EPSILON, 200)?;
    let h = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    Some(Mat3::from_fn(|i, j| h[3 * i + j]))
}

/// Noise and uncertainty of a motion.
pub(super) struct Spread {
    pub(super) sigma: f64,
    pub(super) rotation_rad: f64,
    pub(super) direction_rad: f64,
}

/// The standard deviations of a motion fitted to matches, from their residuals and the curvature of the cost.
pub(super) fn spread(a: &[Vec2], b: &[Vec2], pose: &Transform) -> Spread {
    let essential = essential_of(pose);
    let sum: f64 = a.iter().zip(b).map(|(a, b)| sampson_squared(&essential, a, b)).sum();
    let variance = sum / (a.len() as f64 - 5.0).max(1.0);
    let hessian = sampson_equations(a, b, pose, &|squared| (squared, 1.0)).hessian;
    let covariance = hessian.try_inverse().map(|inverse| inverse * variance);
    let part = |from: usize, to: usize| {
        covariance.map_or(f64::INFINITY, |c| (from..to).map(|k| c[(k, k)].max(0.0)).sum::<f64>().sqrt())
    };
    Spread { sigma: variance.sqrt(), rotation_rad: part(0, 3), direction_rad: part(3, 5) }
}

/// The median angle between the two rays of a match.
pub(super) fn median_parallax(a: &[Vec2], b: &[Vec2], b_from_a: &Transform) -> f64 {
    let angle = |(a, b): (&Vec2, &Vec2)| (b_from_a.rotation * a.push(1.0)).angle(&b.push(1.0));
    let mut angles: Vec<f64> = a.iter().zip(b).map(angle).collect();
    angles.sort_by(f64::total_cmp);
    angles.get(angles.len() / 2).copied().unwrap_or(0.0)
}
