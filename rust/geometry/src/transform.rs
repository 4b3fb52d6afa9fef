//! Rigid motions.

use crate::{Mat3, Vec3};
use nalgebra::{Rotation3, Vector6};
use serde::{Deserialize, Serialize};
use std::ops::Mul;

/// A rigid motion `b_from_a`: `x_in_b = rotation * x_in_a + translation`.
///
/// Serialised as the four rows of its 4×4 matrix; read from such rows if they are rigid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "[[f64; 4]; 4]", try_from = "Rows")]
pub struct Transform {
    /// Rotation part of `b_from_a`.
    pub rotation: Rotation3<f64>,
    /// Origin of `a` seen in `b`, metres.
    pub translation: Vec3,
}

impl Transform {
    /// From its two parts.
    pub fn new(rotation: Rotation3<f64>, translation: Vec3) -> Self {
        Self { rotation, translation }
    }

    /// The motion that moves nothing.
    pub fn identity() -> Self {
        Self::new(Rotation3::identity(), Vec3::zeros())
    }

    /// From any 3×3 matrix close to a rotation (the nearest rotation is taken) and a translation.
    pub fn from_matrix(rotation: &Mat3, translation: Vec3) -> Self {
        let svd = rotation.svd(true, true);
        let (u, v_t) = (svd.u.unwrap_or_else(Mat3::identity), svd.v_t.unwrap_or_else(Mat3::identity));
        let sign = (u * v_t).determinant().signum();
        let nearest = u * Mat3::from_diagonal(&Vec3::new(1.0, 1.0, sign)) * v_t;
        Self::new(Rotation3::from_matrix_unchecked(nearest), translation)
    }

    /// `a_from_b`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self::new(rotation, -(rotation * self.translation))
    }

    /// The point `x_in_b` of a point `x_in_a`.
    pub fn apply(&self, point: &Vec3) -> Vec3 {
        self.rotation * point + self.translation
    }

    /// A small motion applied after this one: `[rotation vector; translation]`, radians and metres, in frame `b`.
    ///
    /// `x_in_b` becomes `exp(ω) (rotation x) + translation + v`; its derivative at zero is
    /// `[-[rotation x]×  I]`.
    pub fn retract(&self, step: &Vector6<f64>) -> Self {
        let turn = Rotation3::new(Vec3::new(step[0], step[1], step[2]));
        let mut rotation = turn * self.rotation;
        rotation.renormalize();
        Self::new(rotation, self.translation + Vec3::new(step[3], step[4], step[5]))
    }

    /// Angle between the rotations of two motions, radians.
    pub fn angle_to(&self, other: &Self) -> f64 {
        // The arccosine of the trace loses half the digits near zero; the sine keeps them.
        let relative = (self.rotation.inverse() * other.rotation).into_inner();
        let sine = Vec3::new(
            relative[(2, 1)] - relative[(1, 2)],
            relative[(0, 2)] - relative[(2, 0)],
            relative[(1, 0)] - relative[(0, 1)],
        )
        .norm();
        sine.atan2(relative.trace() - 1.0)
    }

    /// The four rows of the 4×4 matrix.
    pub fn rows(&self) -> [[f64; 4]; 4] {
        let (r, t) = (self.rotation.matrix(), &self.translation);
        let row = |i: usize| [r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }
}

impl Mul for Transform {
    type Output = Self;
    /// `c_from_b * b_from_a = c_from_a`.
    fn mul(self, right: Self) -> Self {
        Self::new(self.rotation * right.rotation, self.apply(&right.translation))
    }
}

impl From<Transform> for [[f64; 4]; 4] {
    fn from(transform: Transform) -> Self {
        transform.rows()
    }
}

/// By how much the product of a rotation and its transpose may differ from one in a file.
const RIGID: f64 = 1e-4;
/// By how much rounding makes it differ.
const ROUNDING: f64 = 1e-12;

impl Transform {
    /// From the four rows of a 4×4 matrix; `None` where they are no rotation with a translation.
    pub fn from_rows(rows: &[[f64; 4]; 4]) -> Option<Self> {
        let rotation = Mat3::from_fn(|i, j| rows[i][j]);
        let translation = Vec3::new(rows[0][3], rows[1][3], rows[2][3]);
        let skew = (rotation * rotation.transpose() - Mat3::identity()).amax();
        // Comparisons that are false of what is no number.
        let rigid = skew <= RIGID && rotation.determinant() > 0.0 && rows[3] == [0.0, 0.0, 0.0, 1.0];
        let finite = translation.iter().all(|x| x.is_finite());
        (rigid && finite).then(|| match skew {
            // What was written here comes back bit by bit.
            ..ROUNDING => Self::new(Rotation3::from_matrix_unchecked(rotation), translation),
            _ => Self::from_matrix(&rotation, translation),
        })
    }
}

/// The rows of a matrix in a file.
#[derive(Deserialize)]
struct Rows([[f64; 4]; 4]);

impl TryFrom<Rows> for Transform {
    type Error = &'static str;

    fn try_from(rows: Rows) -> Result<Self, Self::Error> {
        Self::from_rows(&rows.0).ok_or("is not a rotation with a translation")
    }
}

/// The matrix `[v]×` with `[v]× x = v × x`.
pub fn skew(v: &Vec3) -> Mat3 {
    Mat3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Transform {
        Transform::new(Rotation3::new(Vec3::new(0.3, -0.2, 0.9)), Vec3::new(0.1, -2.0, 0.7))
    }

    #[test]
    fn inverse_undoes_the_motion() {
        let (t, x) = (sample(), Vec3::new(0.4, 0.5, -1.2));
        assert!((t.inverse().apply(&t.apply(&x)) - x).norm() < 1e-14);
        assert!((t * t.inverse()).translation.norm() < 1e-14);
    }

    #[test]
    fn rows_survive_a_round_trip() {
        let t = sample();
        let back = Transform::from_rows(&t.rows()).unwrap();
        assert!(back.angle_to(&t) < 1e-12 && (back.translation - t.translation).norm() < 1e-12);
    }

    #[test]
    fn rows_that_are_not_rigid_are_refused() {
        let t = sample();
        let broken = |row: usize, column: usize, factor: f64| {
            let mut rows = t.rows();
            rows[row][column] *= factor;
            Transform::from_rows(&rows)
        };
        assert!(broken(0, 0, 2.0).is_none() && broken(3, 3, 2.0).is_none() && broken(1, 3, f64::NAN).is_none());
        let mirrored = t.rows().map(|[x, y, z, w]| [-x, -y, -z, w]);
        assert!(Transform::from_rows(&mirrored).is_none());
        let error = serde_json::from_str::<Transform>("[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").unwrap_err();
        assert!(error.to_string().starts_with("is not a rotation"));
        assert_eq!(
            serde_json::from_str::<Transform>(&serde_json::to_string(&t.rows()).unwrap()).unwrap().rows(),
            t.rows()
        );
    }

    #[test]
    fn retraction_has_the_documented_derivative() {
        let (t, x, h) = (sample(), Vec3::new(0.4, 0.5, -1.2), 1e-6);
        let turned = t.rotation * x;
        for k in 0..6 {
            let mut step = Vector6::zeros();
            step[k] = h;
            let numeric = (t.retract(&step).apply(&x) - t.retract(&-step).apply(&x)) / (2.0 * h);
            let analytic = if k < 3 { -skew(&turned).column(k) } else { Mat3::identity().column(k - 3).into() };
            assert!((numeric - analytic).norm() < 1e-8, "column {k}");
        }
    }

    #[test]
    fn angle_is_exact_for_tiny_turns() {
        let a = sample();
        let b = a.retract(&Vector6::new(1e-9, 0.0, 0.0, 0.0, 0.0, 0.0));
        assert!((a.angle_to(&b) - 1e-9).abs() < 1e-13);
    }
}
