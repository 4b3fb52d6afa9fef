//! A point from its rays in two or more frames (paper, section 2.5).
//!
//! The point nearest to all rays in closed form, then Gauss–Newton on distances in the picture (Hartley and Sturm 1997).

use geometry::{Mat3, Transform, Vec2, Vec3};
use nalgebra::Matrix2x3;

/// Below this angle between its rays a point's distance is noise, radians (0.1°).
pub const MIN_PARALLAX_RAD: f64 = 0.001_745;

/// A point and how well its rays meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangulated {
    /// The point in frame `x`.
    pub point: Vec3,
    /// Angle between two of the most different rays, radians.
    pub angle_rad: f64,
    /// Root mean square distance from the observations, normalised units.
    pub rms: f64,
}

/// The point `x` seen along `rays`: `(cam_from_x, normalised coordinates)` of each frame.
///
/// `None` with fewer than two rays, rays less than [`MIN_PARALLAX_RAD`] apart, or a point behind one of the cameras.
pub fn triangulate(rays: &[(Transform, Vec2)]) -> Option<Triangulated> {
    let lines: Vec<(Vec3, Vec3)> = rays
        .iter()
        .map(|(pose, at)| {
            let back = pose.rotation.inverse();
            (-(back * pose.translation), back * at.push(1.0).normalize())
        })
        .collect();
    let angle_rad = widest_angle(&lines)?;
    if angle_rad < MIN_PARALLAX_RAD {
        return None;
    }
    let point = refine(rays, nearest_to_lines(&lines)?);
    let mut sum = 0.0;
    for (pose, at) in rays {
        sum += distance(&pose.apply(&point), at).powi(2);
    }
    let rms = (sum / rays.len() as f64).sqrt();
    rms.is_finite().then_some(Triangulated { point, angle_rad, rms })
}

/// As [`triangulate`] where some rays are wrong: the point that most rays pass within `threshold` (normalised units), and
/// which rays those are.
///
/// `None` when fewer than two, or not more than half, of the rays agree on a point.
pub fn triangulate_robust(rays: &[(Transform, Vec2)], threshold: f64) -> Option<(Triangulated, Vec<bool>)> {
    let near = |point: &Vec3| -> Vec<bool> {
        rays.iter().map(|(pose, at)| distance(&pose.apply(point), at) < threshold).collect()
    };
    let count = |flags: &[bool]| flags.iter().filter(|f| **f).count();
    let refit = |flags: &[bool]| {
        let chosen: Vec<_> = rays.iter().zip(flags).filter(|(_, f)| **f).map(|(ray, _)| *ray).collect();
        triangulate(&chosen)
    };
    let mut best = triangulate(rays).map(|found| near(&found.point)).unwrap_or_default();
    if 5 * count(&best) < 4 * rays.len() {
        for (i, j) in spread_pairs(rays.len()) {
            if let Some(found) = triangulate(&[rays[i], rays[j]]) {
                let flags = near(&found.point);
                if count(&flags) > count(&best) {
                    best = flags;
                }
            }
        }
    }
    let found = refit(&best)?;
    let flags = near(&found.point);
    let enough = count(&flags) >= 2 && 2 * count(&flags) > rays.len();
    enough.then(|| refit(&flags)).flatten().map(|found| (found, flags))
}

/// Pairs of rays far apart in the sequence: every pair of up to eight evenly spaced ones, the farthest first.
fn spread_pairs(n: usize) -> Vec<(usize, usize)> {
    let k = n.min(8);
    let at = |i: usize| i * (n - 1) / (k - 1).max(1);
    let mut pairs: Vec<_> = (0..k).flat_map(|i| (i + 1..k).map(move |j| (i, j))).collect();
    pairs.sort_by_key(|(i, j)| std::cmp::Reverse(j - i));
    pairs.into_iter().map(|(i, j)| (at(i), at(j))).collect()
}

/// Distance between a point in the camera frame and an observation, normalised units; infinite behind the camera.
fn distance(in_cam: &Vec3, at: &Vec2) -> f64 {
    if in_cam.z > 0.0 { (in_cam.xy() / in_cam.z - at).norm() } else { f64::INFINITY }
}

/// The angle between the ray farthest from the first and the ray farthest from that: at least half of the widest.
fn widest_angle(lines: &[(Vec3, Vec3)]) -> Option<f64> {
    let farthest = |from: &Vec3| {
        lines
            .iter()
            .skip(1)
            .map(|line| line.1)
            .chain(lines.first().map(|line| line.1))
            .min_by(|p, q| from.dot(p).total_cmp(&from.dot(q)))
    };
    let one = farthest(&lines.first()?.1)?;
    let other = farthest(&one)?;
    Some(one.cross(&other).norm().atan2(one.dot(&other)))
}

/// The point with the least sum of squared distances to lines `(origin, unit direction)`.
fn nearest_to_lines(lines: &[(Vec3, Vec3)]) -> Option<Vec3> {
    let (mut matrix, mut right) = (Mat3::zeros(), Vec3::zeros());
    for (origin, direction) in lines {
        let across = Mat3::identity() - direction * direction.transpose();
        matrix += across;
        right += across * origin;
    }
    matrix.cholesky().map(|c| c.solve(&right)).filter(|p| p.iter().all(|v| v.is_finite()))
}

/// Gauss–Newton; a step that does not lower the error is not taken.
fn refine(rays: &[(Transform, Vec2)], start: Vec3) -> Vec3 {
    let (mut point, mut equations) = (start, linearise(rays, &start));
    for _ in 0..8 {
        let Some(factor) = equations.hessian.cholesky() else { break };
        let candidate = point - factor.solve(&equations.gradient);
        let next = linearise(rays, &candidate);
        if next.cost.is_nan() || next.cost >= equations.cost {
            break;
        }
        let converged = equations.cost - next.cost < 1e-9 * equations.cost;
        (point, equations) = (candidate, next);
        if converged {
            break;
        }
    }
    point
}

struct Equations {
    cost: f64,
    hessian: Mat3,
    gradient: Vec3,
}

fn linearise(rays: &[(Transform, Vec2)], point: &Vec3) -> Equations {
    let mut sum = Equations { cost: 0.0, hessian: Mat3::zeros(), gradient: Vec3::zeros() };
    for (pose, at) in rays {
        let p = pose.apply(point);
        if p.z.is_nan() || p.z <= 0.0 {
            sum.cost = f64::INFINITY;
            return sum;
        }
        let seen = p.xy() / p.z;
        let residual = seen - at;
        let by_cam = Matrix2x3::new(1.0, 0.0, -seen.x, 0.0, 1.0, -seen.y) / p.z;
        let jacobian = by_cam * pose.rotation.matrix();
        sum.cost += residual.norm_squared();
        sum.hessian += jacobian.transpose() * jacobian;
        sum.gradient += jacobian.transpose() * residual;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use synthetic::{Random, Scene, SceneOptions};

    fn rays(scene: &Scene, point: usize) -> Vec<(Transform, Vec2)> {
        let of_point = scene.observations.iter().filter(|o| o.point == point);
        of_point.map(|o| (scene.cam_from_head[o.frame], scene.camera.normalise(&o.pixel))).collect()
    }

    #[test]
    fn exact_rays_meet_in_the_point() {
        let scene = Scene::turning_head(&SceneOptions { noise_px: 0.0, frames: 7, ..SceneOptions::default() });
        for point in 0..66 {
            let rays = rays(&scene, point);
            if rays.len() > 1 {
                let found = triangulate(&rays).unwrap();
                assert!((found.point - scene.points[point]).norm() < 1e-9 && found.rms < 1e-9);
            }
        }
    }

    #[test]
    fn error_of_many_views_is_that_of_the_noise() {
        let scene = Scene::turning_head(&SceneOptions { points: 200, ..SceneOptions::default() });
        let error = |point: usize| (triangulate(&rays(&scene, point)).unwrap().point - scene.points[point]).norm();
        let mut errors: Vec<f64> = (0..200).map(error).collect();
        errors.sort_by(f64::total_cmp);
        // 0.3 px at 615 px and 0.65 m is 0.32 mm; some 60 views over 60 degrees divide it by about five.
        assert!(errors[100] < 0.12e-3, "{} m", errors[100]);
    }

    #[test]
    fn wrong_rays_are_outvoted() {
        let options = SceneOptions { outliers: 0.3, frames: 30, ..SceneOptions::default() };
        let scene = Scene::turning_head(&options);
        let (mut found, mut tried) = (0, 0);
        for point in 0..66 {
            let rays = rays(&scene, point);
            let wrong = scene.observations.iter().filter(|o| o.point == point && o.outlier).count();
            if rays.len() >= 8 && 5 * wrong < 2 * rays.len() {
                tried += 1;
                let answer = triangulate_robust(&rays, 1.5 / 615.0);
                found += usize::from(answer.is_some_and(|(t, _)| (t.point - scene.points[point]).norm() < 1.5e-3));
            }
        }
        assert!(tried > 30 && found >= tried - 1, "{found} of {tried}");
    }

    #[test]
    fn nearly_parallel_rays_and_points_behind_have_no_answer() {
        let beside = |x: f64| Transform::new(nalgebra::Rotation3::identity(), Vec3::new(x, 0.0, 0.0));
        let at = |x: f64| Vec2::new(x, 0.1);
        assert!(triangulate(&[(beside(0.0), at(0.0)), (beside(-1.0), at(0.001))]).is_none());
        assert!(triangulate(&[(beside(0.0), at(0.0)), (beside(-1.0), at(0.5))]).is_none());
        assert!(triangulate(&[(beside(0.0), at(0.0)), (beside(-1.0), at(-0.5))]).is_some());
        assert!(triangulate(&[(beside(0.0), at(0.0))]).is_none());
        assert!(triangulate(&[]).is_none());
    }

    #[test]
    fn gauss_newton_beats_the_nearest_point_of_the_lines() {
        let (mut random, mut closed, mut refined) = (Random::new(4), 0.0, 0.0);
        for _ in 0..200 {
            let truth = Vec3::new(random.between(-0.1, 0.1), random.between(-0.1, 0.1), random.between(0.5, 4.0));
            let near = Transform::identity();
            let far = Transform::new(nalgebra::Rotation3::identity(), Vec3::new(-0.3, 0.0, 2.0));
            let rays = [near, far].map(|pose| {
                let p = pose.apply(&truth);
                (pose, p.xy() / p.z + random.normal2(1e-3))
            });
            let line = |pose: &Transform, at: &Vec2| (-pose.translation, at.push(1.0).normalize());
            let lines = [line(&rays[0].0, &rays[0].1), line(&rays[1].0, &rays[1].1)];
            let cost = |p: &Vec3| linearise(&rays, p).cost;
            closed += cost(&nearest_to_lines(&lines).unwrap());
            refined += cost(&triangulate(&rays).unwrap().point);
        }
        assert!(refined < closed);
    }
}
