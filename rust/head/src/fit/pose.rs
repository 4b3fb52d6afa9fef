//! The pose of a known head in one picture: scaled orthography with iterations (POSIT, DeMenthon and Davis 1995), then
//! robust Levenberg–Marquardt on the pixels.

use geometry::least_squares::{Loss, MinimiseOptions, NormalEquations, Problem, minimise};
use geometry::{Camera, Mat3, Transform, Vec2, Vec3, skew};
use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix4, Matrix6, Vector4, Vector6};

/// A point of the head, its pixel and that pixel's standard deviation.
pub(crate) struct Sighting {
    pub point: Vec3,
    pub pixel: Vec2,
    pub sigma_px: f64,
}

/// `cam_from_head`; `None` with fewer than six sightings or when they do not span space.
pub(crate) fn estimate(camera: &Camera, sightings: &[Sighting], start: Option<Transform>) -> Option<Transform> {
    let start = start.or_else(|| posit(camera, sightings))?;
    refine(camera, sightings, start)
}

/// Scaled orthography, its depths corrected from the pose found so far until nothing changes.
fn posit(camera: &Camera, sightings: &[Sighting]) -> Option<Transform> {
    if sightings.len() < 6 {
        return None;
    }
    let origin = sightings.iter().map(|s| s.point).sum::<Vec3>() / sightings.len() as f64;
    let rows: Vec<(Vector4<f64>, Vec2, f64)> = sightings
        .iter()
        .map(|s| ((s.point - origin).push(1.0), camera.normalise(&s.pixel), s.sigma_px.powi(-2)))
        .collect();
    let normal: Matrix4<f64> = rows.iter().map(|(x, _, w)| x * x.transpose() * *w).sum();
    let inverse = normal.try_inverse()?;
    let mut depth_over_distance = vec![0.0; rows.len()];
    let mut pose = None;
    for _ in 0..20 {
        let (mut right_x, mut right_y) = (Vector4::zeros(), Vector4::zeros());
        for ((x, m, w), e) in rows.iter().zip(&depth_over_distance) {
            right_x += x * (w * m.x * (1.0 + e));
            right_y += x * (w * m.y * (1.0 + e));
        }
        let (i, j) = (inverse * right_x, inverse * right_y);
        let (first, second) = (i.xyz(), j.xyz());
        let scale = (first.norm() * second.norm()).sqrt();
        if !(scale.is_finite() && scale > 1e-9) {
            return None;
        }
        let third = first.cross(&second).normalize();
        let rough =
            Mat3::from_rows(&[first.normalize().transpose(), second.normalize().transpose(), third.transpose()]);
        let found = Transform::from_matrix(&rough, Vec3::new(i.w, j.w, 1.0) / scale);
        let axis = found.rotation.matrix().row(2).transpose();
        for ((x, _, _), e) in rows.iter().zip(&mut depth_over_distance) {
            *e = axis.dot(&x.xyz()) * scale;
        }
        pose = Some(Transform::new(found.rotation, found.translation - found.rotation * origin));
    }
    pose
}

struct Resection<'a> {
    camera: &'a Camera,
    sightings: &'a [Sighting],
}

impl Problem for Resection<'_> {
    type State = Transform;

    fn linearise(&self, pose: &Transform) -> NormalEquations {
        let (mut cost, mut hessian, mut gradient) = (0.0, Matrix6::zeros(), Vector6::zeros());
        for s in self.sightings {
            let turned = pose.rotation * s.point;
            let Some((pixel, by)) = self.camera.project_with_jacobian(&(turned + pose.translation)) else {
                cost = f64::INFINITY;
                continue;
            };
            let residual = (pixel - s.pixel) / s.sigma_px;
            let (loss, weight) = Loss::Cauchy(2.0).evaluate(residual.norm_squared());
            let by_point: Matrix2x3<f64> = by.point / s.sigma_px;
            let mut jacobian = nalgebra::Matrix2x6::zeros();
            jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&(-by_point * skew(&turned)));
            jacobian.fixed_view_mut::<2, 3>(0, 3).copy_from(&by_point);
            cost += loss;
            hessian += jacobian.transpose() * jacobian * weight;
            gradient += jacobian.transpose() * residual * weight;
        }
        NormalEquations {
            cost,
            hessian: DMatrix::from_column_slice(6, 6, hessian.as_slice()),
            gradient: DVector::from_column_slice(gradient.as_slice()),
        }
    }

    fn retract(&self, pose: &Transform, step: &DVector<f64>) -> Transform {
        pose.retract(&Vector6::from_fn(|i, _| step[i]))
    }
}

fn refine(camera: &Camera, sightings: &[Sighting], start: Transform) -> Option<Transform> {
    if sightings.len() < 6 {
        return None;
    }
    let options = MinimiseOptions { max_iterations: 30, relative_cost: 1e-8, ..MinimiseOptions::default() };
    let found = minimise(&Resection { camera, sightings }, start, &options);
    found.cost.is_finite().then_some(found.state)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn sightings(camera: &Camera, pose: &Transform, noise: f64) -> Vec<Sighting> {
        (0..60)
            .map(|i| {
                let a = f64::from(i);
                let point = Vec3::new(0.06 * (2.3 * a).sin(), 0.08 * (1.1 * a).cos(), 0.05 * (0.7 * a).sin() + 0.02);
                let jitter = Vec2::new((5.1 * a).sin(), (7.7 * a).cos()) * noise;
                Sighting { point, pixel: camera.project(&pose.apply(&point)).unwrap() + jitter, sigma_px: 1.0 }
            })
            .collect()
    }

    fn pose() -> Transform {
        let upright = Rotation3::new(Vec3::new(std::f64::consts::PI, 0.0, 0.0));
        Transform::new(Rotation3::new(Vec3::new(0.2, 0.9, -0.3)) * upright, Vec3::new(0.05, -0.03, 0.45))
    }

    #[test]
    fn finds_a_near_head_turned_far_aside_without_a_start() {
        let camera = Camera { k1: -0.18, k2: 0.09, ..Camera::centred(352, 288, 400.0) };
        let found = estimate(&camera, &sightings(&camera, &pose(), 0.0), None).unwrap();
        assert!(found.angle_to(&pose()) < 1e-7 && (found.translation - pose().translation).norm() < 1e-7);
    }

    #[test]
    fn noise_and_outliers_move_the_pose_little() {
        let camera = Camera::centred(352, 288, 400.0);
        let mut seen = sightings(&camera, &pose(), 0.5);
        for s in seen.iter_mut().step_by(9) {
            s.pixel += Vec2::new(25.0, -10.0);
        }
        let found = estimate(&camera, &seen, None).unwrap();
        assert!(found.angle_to(&pose()).to_degrees() < 0.5, "{}", found.angle_to(&pose()).to_degrees());
    }

    #[test]
    fn five_points_or_a_plane_are_not_enough() {
        let camera = Camera::centred(352, 288, 400.0);
        let mut seen = sightings(&camera, &pose(), 0.0);
        assert!(estimate(&camera, &seen[..5], None).is_none());
        for s in &mut seen {
            s.point.z = 0.0;
        }
        assert!(posit(&camera, &seen).is_none());
    }
}
