//! Rigid motion with scale, and its least-squares fit.

use crate::{Mat3, Transform, Vec3};
use nalgebra::{Rotation3, SMatrix};
use serde::{Deserialize, Serialize};

/// A similarity `b_from_a`: `x_in_b = scale * rotation * x_in_a + translation`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Similarity {
    /// Units of `b` per unit of `a`.
    pub scale: f64,
    /// Rotation and translation.
    pub rigid: Transform,
}

impl Similarity {
    /// The similarity that moves nothing.
    pub fn identity() -> Self {
        Self { scale: 1.0, rigid: Transform::identity() }
    }

    /// The point `x_in_b` of a point `x_in_a`.
    pub fn apply(&self, point: &Vec3) -> Vec3 {
        self.rigid.rotation * point * self.scale + self.rigid.translation
    }

    /// `a_from_b`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rigid.rotation.inverse();
        let translation = -(rotation * self.rigid.translation) / self.scale;
        Self { scale: 1.0 / self.scale, rigid: Transform::new(rotation, translation) }
    }

    /// A camera pose `cam_from_a` expressed for frame `b`, in `b`'s unit: the pictures stay the same.
    pub fn move_pose(&self, cam_from_a: &Transform) -> Transform {
        let rotation = cam_from_a.rotation * self.rigid.rotation.inverse();
        Transform::new(rotation, cam_from_a.translation * self.scale - rotation * self.rigid.translation)
    }

    /// The similarity that takes `from` to `to` with the least weighted sum of squares (Umeyama 1991).
    ///
    /// `None` with fewer than three points, no weight, or points on a line. With `with_scale` false the scale is 1.
    pub fn fit(from: &[Vec3], to: &[Vec3], weights: Option<&[f64]>, with_scale: bool) -> Option<Self> {
        if from.len() < 3 || from.len() != to.len() || weights.is_some_and(|w| w.len() != from.len()) {
            return None;
        }
        let weight = |i: usize| weights.map_or(1.0, |w| w[i]);
        let total: f64 = (0..from.len()).map(weight).sum();
        if total <= 0.0 {
            return None;
        }
        let mean =
            |points: &[Vec3]| points.iter().enumerate().fold(Vec3::zeros(), |sum, (i, p)| sum + p * weight(i)) / total;
        let (mean_a, mean_b) = (mean(from), mean(to));
        let (mut cross, mut spread) = (Mat3::zeros(), 0.0);
        for (i, (a, b)) in from.iter().zip(to).enumerate() {
            let (a, b) = (a - mean_a, b - mean_b);
            cross += b * a.transpose() * weight(i);
            spread += a.norm_squared() * weight(i);
        }
        let svd = cross.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        if svd.singular_values[1] <= 1e-12 * svd.singular_values[0] || spread <= 0.0 {
            return None;
        }
        let signs = Vec3::new(1.0, 1.0, (u * v_t).determinant().signum());
        let rotation = Rotation3::from_matrix_unchecked(u * Mat3::from_diagonal(&signs) * v_t);
        let scale = if with_scale { svd.singular_values.dot(&signs) / spread } else { 1.0 };
        let translation = mean_b - rotation * mean_a * scale;
        Some(Self { scale, rigid: Transform::new(rotation, translation) })
    }

    /// `b_from_a` for cameras known in both frames, as pairs `(cam_from_a, cam_from_b)`; a similarity when they are seen from
    /// different places, `None` for no cameras.
    pub fn of_poses(pairs: &[(Transform, Transform)]) -> Option<Self> {
        let sum: Mat3 = pairs.iter().map(|(a, b)| b.rotation.matrix().transpose() * a.rotation.matrix()).sum();
        let rotation = Transform::from_matrix(&sum, Vec3::zeros()).rotation;
        // scale · t_a − R_b t = t_b, least squares in scale and t.
        let (mut hessian, mut right) = (SMatrix::<f64, 4, 4>::zeros(), SMatrix::<f64, 4, 1>::zeros());
        for (a, b) in pairs {
            let mut jacobian = SMatrix::<f64, 3, 4>::zeros();
            jacobian.set_column(0, &a.translation);
            jacobian.fixed_view_mut::<3, 3>(0, 1).copy_from(&-b.rotation.matrix());
            hessian += jacobian.transpose() * jacobian;
            right += jacobian.transpose() * b.translation;
        }
        // A single place of the camera leaves the depth open; the weakest of priors keeps the head's size then.
        let weak = 1e-9 * hessian[(0, 0)];
        hessian[(0, 0)] += weak;
        right[0] += weak;
        let solution = hessian.cholesky()?.solve(&right);
        let scale = solution[0];
        (scale > 0.0 && scale.is_finite())
            .then(|| Self { scale, rigid: Transform::new(rotation, solution.fixed_rows::<3>(1).into()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud() -> Vec<Vec3> {
        (0..20).map(f64::from).map(|i| Vec3::new(i.sin(), (1.7 * i).cos(), (0.3 * i).sin())).collect()
    }

    fn truth() -> Similarity {
        let rigid = Transform::new(Rotation3::new(Vec3::new(-0.4, 1.9, 0.3)), Vec3::new(3.0, -1.0, 0.5));
        Similarity { scale: 1.7, rigid }
    }

    #[test]
    fn recovers_a_similarity_exactly() {
        let moved: Vec<Vec3> = cloud().iter().map(|p| truth().apply(p)).collect();
        let found = Similarity::fit(&cloud(), &moved, None, true).unwrap();
        assert!((found.scale - 1.7).abs() < 1e-12);
        assert!(found.rigid.angle_to(&truth().rigid) < 1e-12);
        assert!((found.inverse().apply(&moved[3]) - cloud()[3]).norm() < 1e-12);
    }

    #[test]
    fn moved_pose_sees_the_same_picture() {
        let cam_from_a = Transform::new(Rotation3::new(Vec3::new(0.1, 0.2, 0.3)), Vec3::new(0.0, 0.1, 5.0));
        let cam_from_b = truth().move_pose(&cam_from_a);
        for p in cloud() {
            let (a, b) = (cam_from_a.apply(&p), cam_from_b.apply(&truth().apply(&p)));
            assert!((a / a.z - b / b.z).norm() < 1e-12);
        }
    }

    #[test]
    fn points_on_a_line_have_no_answer() {
        let line: Vec<Vec3> = (0..5).map(|i| Vec3::new(f64::from(i), 0.0, 0.0)).collect();
        assert!(Similarity::fit(&line, &line, None, true).is_none());
        assert!(Similarity::fit(&line[..2], &line[..2], None, true).is_none());
    }

    #[test]
    fn cameras_give_the_similarity_between_two_frames() {
        let pose = |k: i32| {
            let turn = Rotation3::new(Vec3::new(0.1, 0.1 * f64::from(k), 0.0));
            Transform::new(turn, Vec3::new(0.01 * f64::from(k), 0.0, 0.7))
        };
        let pairs: Vec<(Transform, Transform)> = (-4..5).map(|k| (pose(k), truth().move_pose(&pose(k)))).collect();
        let found = Similarity::of_poses(&pairs).unwrap();
        assert!((found.scale / truth().scale - 1.0).abs() < 1e-6 && found.rigid.angle_to(&truth().rigid) < 1e-9);
        assert!((found.rigid.translation - truth().rigid.translation).norm() < 1e-6);
        assert!(Similarity::of_poses(&[]).is_none());
    }
}
