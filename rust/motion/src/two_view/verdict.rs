//! What the matches of two frames cannot tell: no parallax, mere magnification, a plane, and the spread of a motion.

use super::kernel::Matches;
use crate::MotionError;
use geometry::{Mat3, Transform, Vec2, Vec3};
use nalgebra::{Matrix4, Rotation3, Vector4};

/// The values whose flag is set.
pub(super) fn select(values: &[Vec2], flags: &[bool]) -> Vec<Vec2> {
    values.iter().zip(flags).filter(|(_, flag)| **flag).map(|(value, _)| *value).collect()
}

/// Refuses matches that a turn of the camera alone, or a turn and a magnification, explain to within `threshold`.
///
/// `a`, `b`: the inliers of `total` matches.
pub(super) fn check_parallax(a: &[Vec2], b: &[Vec2], threshold: f64, total: usize) -> Result<(), MotionError> {
    let nearly_all = |count: usize| 10 * count >= 9 * a.len();
    let turned = Magnified::fit(a, b, threshold, false).explained(a, b, threshold);
    if nearly_all(turned) {
        return Err(MotionError::NoParallax { agree: turned, total });
    }
    let magnified = Magnified::fit(a, b, threshold, true);
    let agree = magnified.explained(a, b, threshold);
    if nearly_all(agree) {
        return Err(MotionError::OnlyMagnified { factor: magnified.factor, agree, total });
    }
    Ok(())
}

/// What a camera sees that turns and zooms but does not move.
struct Magnified {
    rotation: Rotation3<f64>,
    factor: f64,
}

impl Magnified {
    /// The turn, and with `zoom` the factor, nearest to most matches: Gauss–Newton with weights that fall with distance,
    /// begun with all matches alike.
    fn fit(a: &[Vec2], b: &[Vec2], threshold: f64, zoom: bool) -> Self {
        let mut model = Self { rotation: Rotation3::identity(), factor: 1.0 };
        for round in 0..6 {
            let (mut hessian, mut gradient) = (Matrix4::<f64>::zeros(), Vector4::<f64>::zeros());
            for (a, b) in a.iter().zip(b) {
                let p = model.rotation * a.push(1.0);
                let seen = p.xy() / p.z * model.factor;
                let miss = seen - b;
                let weight = if round == 0 { 1.0 } else { 1.0 / (1.0 + miss.norm_squared() / (threshold * threshold)) };
                let (x, y, f) = (p.x / p.z, p.y / p.z, model.factor);
                let by_x = Vector4::new(-f * x * y, f * (1.0 + x * x), -f * y, seen.x);
                let by_y = Vector4::new(-f * (1.0 + y * y), f * x * y, f * x, seen.y);
                hessian += (by_x * by_x.transpose() + by_y * by_y.transpose()) * weight;
                gradient += (by_x * miss.x + by_y * miss.y) * weight;
            }
            if !zoom {
                hessian.fill_row(3, 0.0);
                hessian.fill_column(3, 0.0);
                (hessian[(3, 3)], gradient[3]) = (1.0, 0.0);
            }
            let Some(factor) = hessian.cholesky() else { break };
            let step = -factor.solve(&gradient);
            model.rotation = Rotation3::new(step.xyz()) * model.rotation;
            model.factor *= step.w.exp();
        }
        model
    }

    /// How many matches are explained to within `threshold`.
    fn explained(&self, a: &[Vec2], b: &[Vec2], threshold: f64) -> usize {
        let near = |(a, b): &(&Vec2, &Vec2)| {
            let p = self.rotation * a.push(1.0);
            p.z > 0.0 && (p.xy() / p.z * self.factor - *b).norm() < threshold
        };
        a.iter().zip(b).filter(near).count()
    }
}

/// Whether a plane explains nine of ten matches about as well as their motion does.
///
/// A plane `ν · x = 1` in frame `a` sees `a` at `R a + t (ν · a)` in `b`: fitted with weights that fall with distance.
pub(super) fn is_planar(a: &[Vec2], b: &[Vec2], pose: &Transform, sigma: f64) -> bool {
    if a.len() < super::FEWEST {
        return true;
    }
    let mut weights = vec![1.0; a.len()];
    // A distance in the plane has two parts where an epipolar distance has one, and errs in both frames.
    let limit = (4.0 * sigma).max(1e-9);
    for _ in 0..5 {
        let (mut matrix, mut right) = (Mat3::zeros(), Vec3::zeros());
        for ((a, b), weight) in a.iter().zip(b).zip(&weights) {
            let (a, b) = (a.push(1.0), b.push(1.0));
            let p = pose.rotation * a;
            // Crossed with b the point in the plane vanishes: p × b + (t × b) (ν · a) = 0.
            let (fixed, moving) = (p.cross(&b).xy() / p.z, pose.translation.cross(&b).xy() / p.z);
            matrix += a * a.transpose() * (weight * moving.norm_squared());
            right -= a * (weight * moving.dot(&fixed));
        }
        let Some(factor) = matrix.cholesky() else { return true };
        let plane = factor.solve(&right);
        for ((a, b), weight) in a.iter().zip(b).zip(&mut weights) {
            *weight = 1.0 / (1.0 + (transfer_distance(pose, &plane, a, b) / limit).powi(2));
        }
    }
    let within = weights.iter().filter(|w| **w >= 0.5).count();
    10 * within >= 9 * a.len()
}

fn transfer_distance(pose: &Transform, plane: &Vec3, a: &Vec2, b: &Vec2) -> f64 {
    let a = a.push(1.0);
    let moved = pose.rotation * a + pose.translation * plane.dot(&a);
    (moved.xy() / moved.z - b).norm()
}

/// Noise and uncertainty of a motion.
pub(super) struct Spread {
    pub(super) sigma: f64,
    pub(super) rotation_rad: f64,
    pub(super) direction_rad: f64,
}

/// The standard deviations of a motion fitted to matches, from their residuals and the curvature of the cost.
pub(super) fn spread(a: &[Vec2], b: &[Vec2], pose: &Transform) -> Spread {
    let equations = Matches::new(a, b).equations(pose, &vec![1.0; a.len()]);
    let variance = equations.cost / (a.len() as f64 - 5.0).max(1.0);
    let covariance = equations.hessian.try_inverse().map(|inverse| inverse * variance);
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
