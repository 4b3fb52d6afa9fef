//! Rotation and translation from an essential matrix (Horn 1990: closed form, no decomposition).

use geometry::{Mat3, Transform, Vec2, Vec3, skew};
use nalgebra::Rotation3;

/// The four motions `b_from_a` of an essential matrix `E = [t]× R` of any scale, with unit translations.
///
/// `None` when `E` is not close to an essential matrix of a proper motion (zero, or not finite).
pub fn decompose(essential: &Mat3) -> Option<[Transform; 4]> {
    let e = essential * (std::f64::consts::SQRT_2 / essential.norm());
    if !e.iter().all(|v| v.is_finite()) {
        return None;
    }
    let [c0, c1, c2]: [Vec3; 3] = [0, 1, 2].map(|k| e.column(k).into());
    // Every column of [t]× R is orthogonal to t: the longest product of two columns gives it best.
    let products = [c0.cross(&c1), c1.cross(&c2), c2.cross(&c0)];
    let longest = products.iter().max_by(|p, q| p.norm_squared().total_cmp(&q.norm_squared()))?;
    let t = longest.try_normalize(1e-9)?;
    let [r0, r1, r2]: [Vec3; 3] = [0, 1, 2].map(|k| e.row(k).transpose());
    // cof([t]× R) = t tᵀ R and [t]× E = (t tᵀ - I) R; the other rotation belongs to -t.
    let cofactors = Mat3::from_rows(&[r1.cross(&r2), r2.cross(&r0), r0.cross(&r1)].map(|r| r.transpose()));
    let turned = skew(&t) * e;
    let rotation = |matrix: Mat3| {
        let mut rotation = Rotation3::from_matrix_unchecked(matrix);
        rotation.renormalize();
        rotation
    };
    let (first, second) = (rotation(cofactors - turned), rotation(cofactors + turned));
    Some([(first, t), (first, -t), (second, t), (second, -t)].map(|(r, t)| Transform::new(r, t)))
}

/// The motion `b_from_a`, with unit translation, that puts most matches before both cameras.
///
/// `None` when `E` is no essential matrix or when no motion has more than half of the matches before both cameras.
pub fn pose_from_essential(essential: &Mat3, a: &[Vec2], b: &[Vec2]) -> Option<Transform> {
    most_in_front(essential, a, b).filter(|(count, _)| 2 * count > a.len()).map(|(_, pose)| pose)
}

/// The best of the four motions with its number of matches before both cameras, be they ever so few.
pub(super) fn most_in_front(essential: &Mat3, a: &[Vec2], b: &[Vec2]) -> Option<(usize, Transform)> {
    let in_front = |pose: &Transform| a.iter().zip(b).filter(|(a, b)| is_in_front(pose, a, b)).count();
    decompose(essential)?.map(|pose| (in_front(&pose), pose)).into_iter().max_by_key(|(count, _)| *count)
}

/// Whether the rays of a match meet before both cameras.
fn is_in_front(b_from_a: &Transform, a: &Vec2, b: &Vec2) -> bool {
    let (ray_a, ray_b) = (b_from_a.rotation * a.push(1.0), b.push(1.0));
    let t = &b_from_a.translation;
    // depth_b b = depth_a R a + t, solved by crossing with either ray.
    let normal = ray_b.cross(&ray_a);
    let (depth_a, depth_b) = (-ray_b.cross(t).dot(&normal), -ray_a.cross(t).dot(&normal));
    depth_a > 0.0 && depth_b > 0.0
}

/// The essential matrix `[t]× R` of a motion.
pub fn essential_of(b_from_a: &Transform) -> Mat3 {
    skew(&b_from_a.translation) * b_from_a.rotation.matrix()
}
