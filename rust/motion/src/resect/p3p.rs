//! Poses from three points: Grunert's equations (1841; Haralick et al. 1994), the quartic by polynomial arithmetic.

use crate::polynomial::{add_product, real_roots};
use geometry::{Similarity, Transform, Vec2, Vec3};

/// The poses `cam_from_x` that put three points on their rays; at most four, none when the points lie on a line.
pub(super) fn p3p(points: &[Vec3; 3], normalised: &[Vec2; 3]) -> Vec<Transform> {
    let rays = normalised.map(|n| n.push(1.0).normalize());
    let [a2, b2, c2] = [(1, 2), (0, 2), (0, 1)].map(|(i, j)| (points[i] - points[j]).norm_squared());
    let [cos_a, cos_b, cos_c] = [(1, 2), (0, 2), (0, 1)].map(|(i, j): (usize, usize)| rays[i].dot(&rays[j]));
    if !(b2 > 0.0 && a2.is_finite() && c2.is_finite()) {
        return Vec::new();
    }
    // Distances s, u s, v s; b² = s² (1 + v² - 2 v cos b). The difference of the other two laws of cosines is linear in u:
    // u = above(v) / below(v). Put into the last one, times below², it is a quartic in v.
    let (q, k) = ((a2 - c2) / b2, c2 / b2);
    let above = [-1.0 - q, 2.0 * q * cos_b, 1.0 - q];
    let below = [-2.0 * cos_c, 2.0 * cos_a];
    let mut below2 = [0.0; 3];
    add_product(&mut below2, &below, &below, 1.0);
    let mut quartic = [0.0; 5];
    add_product(&mut quartic, &above, &above, 1.0);
    add_product(&mut quartic, &above, &below, -2.0 * cos_c);
    add_product(&mut quartic, &below2, &[1.0 - k, 2.0 * k * cos_b, -k], 1.0);
    let pose_at = |v: f64| {
        let u = (above[0] + v * (above[1] + v * above[2])) / (below[0] + v * below[1]);
        let s = (b2 / (1.0 + v * (v - 2.0 * cos_b))).sqrt();
        let distances = polished(Vec3::new(s, u * s, v * s), [a2, b2, c2], [cos_a, cos_b, cos_c]);
        let in_front = distances.iter().all(|d| d.is_finite() && *d > 0.0);
        let in_cam: [Vec3; 3] = std::array::from_fn(|i| rays[i] * distances[i]);
        in_front.then(|| Similarity::fit(points, &in_cam, None, false)).flatten().map(|fit| fit.rigid)
    };
    real_roots(&quartic).into_iter().filter(|v| *v > 0.0).filter_map(pose_at).collect()
}

/// Two Newton steps on the three laws of cosines: the quartic loses digits where its roots crowd.
fn polished(mut s: Vec3, [a2, b2, c2]: [f64; 3], [cos_a, cos_b, cos_c]: [f64; 3]) -> Vec3 {
    for _ in 0..2 {
        let law = |p: f64, q: f64, cosine: f64, side2: f64| p * p + q * q - 2.0 * p * q * cosine - side2;
        let residual = Vec3::new(law(s.y, s.z, cos_a, a2), law(s.x, s.z, cos_b, b2), law(s.x, s.y, cos_c, c2));
        let slope = |p: f64, q: f64, cosine: f64| 2.0 * (p - q * cosine);
        #[rustfmt::skip]
        let jacobian = geometry::Mat3::new(
            0.0, slope(s.y, s.z, cos_a), slope(s.z, s.y, cos_a),
            slope(s.x, s.z, cos_b), 0.0, slope(s.z, s.x, cos_b),
            slope(s.x, s.y, cos_c), slope(s.y, s.x, cos_c), 0.0,
        );
        match jacobian.try_inverse() {
            Some(inverse) => s -= inverse * residual,
            None => break,
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use synthetic::{Scene, SceneOptions};

    #[test]
    fn the_true_pose_is_among_the_answers() {
        let options = SceneOptions { noise_px: 0.0, frames: 40, min_facing: -1.0, ..SceneOptions::default() };
        let scene = Scene::turning_head(&options);
        let mut found = 0;
        for frame in 0..40 {
            let pose = scene.cam_from_head[frame];
            let points = [frame % 66, (frame + 17) % 66, (frame + 41) % 66].map(|i| scene.points[i]);
            let seen = points.map(|p| pose.apply(&p)).map(|p| p.xy() / p.z);
            let answers = p3p(&points, &seen);
            for answer in &answers {
                let error = |i: usize| (answer.apply(&points[i]).xy() / answer.apply(&points[i]).z - seen[i]).norm();
                assert!((0..3).all(|i| error(i) < 1e-6));
            }
            let close = |p: &Transform| p.angle_to(&pose) < 1e-5 && (p.translation - pose.translation).norm() < 1e-6;
            found += usize::from(answers.iter().any(close));
        }
        assert!(found >= 39, "{found} of 40");
    }

    #[test]
    fn points_on_a_line_or_in_one_place_have_no_answer() {
        let seen = [Vec2::new(0.0, 0.0), Vec2::new(0.1, 0.0), Vec2::new(0.0, 0.1)];
        assert!(p3p(&[Vec3::zeros(); 3], &seen).is_empty());
        assert!(p3p(&[Vec3::zeros(), Vec3::x(), Vec3::x() * 2.0], &seen).is_empty());
    }
}
