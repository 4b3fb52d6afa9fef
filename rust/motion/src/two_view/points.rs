//! The point of a match in closed form: the match is moved onto its epipolar lines by the least amount, where its rays meet.
//!
//! Source: Lindstrom 2010, *Triangulation made easy*, `niter2`; two rounds reach the optimum to the last digits.

use super::essential_of;
use crate::triangulate::MIN_PARALLAX_RAD;
use geometry::{Mat3, Transform, Vec2, Vec3};
use nalgebra::Matrix2;

/// The point in frame `a`; `None` where its rays are parallel or it lies behind a camera.
pub(super) fn point(b_from_a: &Transform, a: &Vec2, b: &Vec2) -> Option<Vec3> {
    let (a, b) = onto_epipolar_lines(&essential_of(b_from_a), a, b)?;
    let (ray_a, ray_b) = (b_from_a.rotation * a.push(1.0), b.push(1.0));
    let t = &b_from_a.translation;
    // depth_b b = depth_a R a + t, solved by crossing with either ray.
    let normal = ray_b.cross(&ray_a);
    let squared = normal.norm_squared();
    if squared < MIN_PARALLAX_RAD.powi(2) * ray_a.norm_squared() * ray_b.norm_squared() {
        return None;
    }
    let (depth_a, depth_b) = (-ray_b.cross(t).dot(&normal), -ray_a.cross(t).dot(&normal));
    (depth_a > 0.0 && depth_b > 0.0).then(|| a.push(1.0) * (depth_a / squared))
}

/// The nearest exact match, `bᵀ E a = 0`.
fn onto_epipolar_lines(essential: &Mat3, a: &Vec2, b: &Vec2) -> Option<(Vec2, Vec2)> {
    let core: Matrix2<f64> = essential.fixed_view::<2, 2>(0, 0).into();
    let line_b = (essential * a.push(1.0)).xy();
    let line_a = essential.tr_mul(&b.push(1.0)).xy();
    let n = b.push(1.0).dot(&(essential * a.push(1.0)));
    let quadratic = line_b.dot(&(core * line_a));
    let half = 0.5 * (line_b.norm_squared() + line_a.norm_squared());
    let root = (half * half - quadratic * n).max(0.0).sqrt();
    let first = n / (half + root);
    let (towards_b, towards_a) = (line_b - core * line_a * first, line_a - core.tr_mul(&line_b) * first);
    let second = first * 2.0 * root / (towards_b.norm_squared() + towards_a.norm_squared());
    let (a, b) = (a - towards_a * second, b - towards_b * second);
    (a.iter().chain(&b).all(|v| v.is_finite())).then_some((a, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::triangulate::triangulate;
    use nalgebra::Rotation3;
    use synthetic::Random;

    #[test]
    fn points_are_those_of_the_iteration_in_the_pictures() {
        let mut random = Random::new(2);
        for _ in 0..200 {
            let turn = Rotation3::new(Vec3::new(0.05, random.between(0.1, 0.4), -0.02));
            let truth = Vec3::new(random.between(-0.1, 0.1), random.between(-0.1, 0.1), random.between(0.6, 0.8));
            let motion = Transform::new(turn, Vec3::new(-0.2, 0.01, 0.04));
            let see = |p: Vec3| p.xy() / p.z;
            let (a, b) = (see(truth) + random.normal2(5e-4), see(motion.apply(&truth)) + random.normal2(5e-4));
            let best = triangulate(&[(Transform::identity(), a), (motion, b)]).unwrap().point;
            assert!((point(&motion, &a, &b).unwrap() - best).norm() < 1e-5 * best.norm());
        }
    }

    #[test]
    fn rays_that_run_side_by_side_or_part_have_no_point() {
        let beside = Transform::new(Rotation3::identity(), Vec3::new(-1.0, 0.0, 0.0));
        let at = |x: f64| Vec2::new(x, 0.1);
        assert!(point(&beside, &at(0.0), &at(-0.001)).is_none());
        assert!(point(&beside, &at(0.0), &at(0.5)).is_none());
        assert!(point(&beside, &at(0.0), &at(-0.5)).is_some());
        assert!(point(&beside, &at(f64::NAN), &at(-0.5)).is_none());
    }
}
