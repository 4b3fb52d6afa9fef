//! What is known beside the observations, as residuals in standard deviations.

use geometry::{Camera, Mat3, Transform, Vec2, Vec3, skew};
use nalgebra::{Matrix6, UnitQuaternion, Vector6};

/// The focal length is known to some extent: a factor, since twice as long is as likely as half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalPrior {
    /// Expected `fx`, pixels.
    pub focal_px: f64,
    /// Standard deviation of its logarithm.
    pub log_sigma: f64,
}

impl FocalPrior {
    /// The residual and its derivative by the logarithm of the focal length.
    pub(super) fn evaluate(&self, camera: &Camera) -> (f64, f64) {
        ((camera.fx / self.focal_px).ln() / self.log_sigma, 1.0 / self.log_sigma)
    }
}

/// Principal point and `k1` are known to some extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensPrior {
    /// Expected principal point, pixels.
    pub principal_px: Vec2,
    /// Standard deviation of each of its coordinates, pixels.
    pub principal_sigma_px: f64,
    /// Expected `k1`.
    pub k1: f64,
    /// Its standard deviation.
    pub k1_sigma: f64,
}

impl LensPrior {
    /// Whether a camera has the principal point expected.
    pub(crate) fn is_centred(&self, camera: &Camera) -> bool {
        (Vec2::new(camera.cx, camera.cy) - self.principal_px).norm() < 1e-6
    }

    /// Which of the camera's unknowns, the residual, and its derivative by the unknown.
    pub(super) fn evaluate(&self, camera: &Camera) -> [(usize, f64, f64); 3] {
        let one = |k, value: f64, expected: f64, sigma: f64| (k, (value - expected) / sigma, 1.0 / sigma);
        [
            one(1, camera.k1, self.k1, self.k1_sigma),
            one(3, camera.cx, self.principal_px.x, self.principal_sigma_px),
            one(4, camera.cy, self.principal_px.y, self.principal_sigma_px),
        ]
    }
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
