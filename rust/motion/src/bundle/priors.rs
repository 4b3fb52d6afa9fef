//! What is known beside the observations, as residuals in standard deviations.

use geometry::{Mat3, Transform, Vec3, skew};
use nalgebra::{Matrix6, UnitQuaternion, Vector6};

/// The focal length is known to some extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalPrior {
    /// Expected `fx`, pixels.
    pub focal_px: f64,
    /// Its standard deviation, pixels.
    pub sigma_px: f64,
}

/// A point is known to lie near a place, or near a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPrior {
    /// Index of the point.
    pub point: usize,
    /// Expected place in the head frame, metres.
    pub position: Vec3,
    /// Inverse of its covariance, 1/m², symmetric.
    pub information: Mat3,
}

impl PointPrior {
    /// The same standard deviation in all directions, metres.
    pub fn near(point: usize, position: Vec3, sigma: f64) -> Self {
        Self { point, position, information: Mat3::identity() / (sigma * sigma) }
    }

    /// Cost and gradient of the squared residual at a point (half of the cost's derivative).
    pub(super) fn evaluate(&self, point: &Vec3) -> (f64, Vec3) {
        let offset = point - self.position;
        let gradient = self.information * offset;
        (offset.dot(&gradient), gradient)
    }
}

/// A pose is known to some extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePrior {
    /// Index of the frame.
    pub frame: usize,
    /// Expected pose.
    pub cam_from_head: Transform,
    /// Standard deviation of the rotation about each axis, radians.
    pub sigma_rad: f64,
    /// Standard deviation of each coordinate of the translation, metres.
    pub sigma_m: f64,
}

impl PosePrior {
    /// The residual at a pose and its derivative by a [`Transform::retract`] step.
    pub(super) fn evaluate(&self, pose: &Transform) -> (Vector6<f64>, Matrix6<f64>) {
        // By way of the quaternion: the trace of a matrix loses small angles.
        let turn = UnitQuaternion::from_rotation_matrix(&(pose.rotation * self.cam_from_head.rotation.inverse()))
            .scaled_axis();
        let shift = pose.translation - self.cam_from_head.translation;
        let mut residual = Vector6::zeros();
        residual.fixed_rows_mut::<3>(0).copy_from(&(turn / self.sigma_rad));
        residual.fixed_rows_mut::<3>(3).copy_from(&(shift / self.sigma_m));
        let mut jacobian = Matrix6::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&(inverse_left_jacobian(&turn) / self.sigma_rad));
        jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Mat3::identity() / self.sigma_m));
        (residual, jacobian)
    }
}

/// The derivative of `log(exp(δ) exp(turn))` by `δ` at zero.
fn inverse_left_jacobian(turn: &Vec3) -> Mat3 {
    let (angle, cross) = (turn.norm(), skew(turn));
    let half = 0.5 * angle;
    let second = if angle < 1e-4 { 1.0 / 12.0 } else { (1.0 - half / half.tan()) / (angle * angle) };
    Mat3::identity() - cross * 0.5 + cross * cross * second
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn the_pose_prior_has_the_derivative_it_claims() {
        let expected = Transform::new(Rotation3::new(Vec3::new(0.2, -0.4, 0.1)), Vec3::new(0.0, 0.1, 0.6));
        let prior = PosePrior { frame: 0, cam_from_head: expected, sigma_rad: 0.1, sigma_m: 0.02 };
        for turn in [Vec3::new(0.6, 0.9, -0.3), Vec3::new(1e-6, 0.0, 0.0)] {
            let pose = Transform::new(Rotation3::new(turn) * expected.rotation, Vec3::new(0.03, 0.1, 0.5));
            let (jacobian, h) = (prior.evaluate(&pose).1, 1e-6);
            for k in 0..6 {
                let step = Vector6::ith(k, h);
                let difference = prior.evaluate(&pose.retract(&step)).0 - prior.evaluate(&pose.retract(&-step)).0;
                assert!((difference / (2.0 * h) - jacobian.column(k)).norm() < 1e-5);
            }
        }
    }
}
