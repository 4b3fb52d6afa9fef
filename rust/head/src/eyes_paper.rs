//! The paper's eye (section 2.8): `EM = {R1, R2, Tr}`, two circles of twelve triangles each, and 36 triangles from the
//! larger circle to the eye socket.
//!
//! # Entry point
//! [`paper_eye`].
//!
//! Twelve corners on the circle and 24 on the socket make 12 + 24 = 36 triangles between them.

use crate::eyes::{EyeFit, opening};
use crate::{GenericHead, HeadError};
use geometry::Vec3;
use nalgebra::Rotation3;
use std::f64::consts::TAU;
use std::ops::Range;

/// Corners of each circle.
const CIRCLE: usize = 12;
/// Corners on the socket.
const SOCKET: usize = 2 * CIRCLE;

/// An eye of 60 triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperEye {
    /// Centre and corners of the small circle, those of the large one, corners on the socket; head frame, metres.
    pub positions: Vec<Vec3>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles of the small circle: the pupil.
    pub r1: Range<usize>,
    /// Triangles of the large circle: the iris.
    pub r2: Range<usize>,
    /// Triangles between it and the socket: the white.
    pub tr: Range<usize>,
}

/// The paper's eye in the socket of a person (`positions`: all vertices of the generic head's topology); `side` 0 is the
/// subject's left. The large circle is the iris, or as much of it as the lids leave free all round; the small one, half as
/// large, the pupil.
///
/// # Errors
/// [`HeadError::Degenerate`] where the generic head has no socket, [`HeadError::Topology`] for another number of vertices.
pub fn paper_eye(generic: &GenericHead, positions: &[Vec3], side: usize, eye: &EyeFit) -> Result<PaperEye, HeadError> {
    let (found, wanted) = (positions.len(), generic.positions.len());
    if found != wanted {
        return Err(HeadError::Topology { found, wanted });
    }
    let turn = Rotation3::rotation_between(&Vec3::z(), &eye.gaze).unwrap_or_else(Rotation3::identity);
    let socket = opening(generic, side, SOCKET)?;
    let point = |([a, b], share): &([u32; 2], f64)| positions[*a as usize].lerp(&positions[*b as usize], *share);
    let rim: Vec<Vec3> = socket.iter().map(point).collect();
    let large = eye.iris_radius.min(0.9 * room(&rim, eye));
    let mut points = Vec::with_capacity(2 * (CIRCLE + 1) + SOCKET);
    let mut triangles = Vec::new();
    for radius in [large / 2.0, large] {
        let first = points.len() as u32;
        let depth = (eye.radius * eye.radius - radius * radius).max(0.0).sqrt();
        points.push(eye.centre + turn * Vec3::new(0.0, 0.0, depth));
        points.extend((0..CIRCLE).map(|k| {
            let angle = TAU * k as f64 / CIRCLE as f64;
            eye.centre + turn * Vec3::new(radius * angle.cos(), radius * angle.sin(), depth)
        }));
        triangles.extend((0..CIRCLE as u32).map(|k| [first, first + 1 + k, first + 1 + (k + 1) % CIRCLE as u32]));
    }
    points.extend(rim);
    let (circle, rim) = ((CIRCLE + 2) as u32, (2 * (CIRCLE + 1)) as u32);
    for k in 0..CIRCLE as u32 {
        let (a, b) = (circle + k, circle + (k + 1) % CIRCLE as u32);
        let [p, q, r] = [0, 1, 2].map(|i| rim + (2 * k + i) % SOCKET as u32);
        triangles.extend([[a, p, q], [a, q, b], [b, q, r]]);
    }
    Ok(PaperEye { positions: points, triangles, r1: 0..CIRCLE, r2: CIRCLE..2 * CIRCLE, tr: 2 * CIRCLE..5 * CIRCLE })
}

/// Distance across the gaze from the iris to the nearest corner of the socket.
fn room(rim: &[Vec3], eye: &EyeFit) -> f64 {
    let across = |p: &Vec3| {
        let way = p - eye.centre;
        (way - eye.gaze * way.dot(&eye.gaze)).norm()
    };
    rim.iter().map(across).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eyes::{EyeOptions, fit_eyes};
    use crate::testing::asset;
    use geometry::mesh;

    #[test]
    fn an_eye_is_two_circles_and_a_collar_that_face_forward() {
        let Some(generic) = asset() else { return };
        let eyes = fit_eyes(&generic, &generic.positions, &[None; 2], &EyeOptions::default()).unwrap();
        for (side, fit) in eyes.iter().enumerate() {
            let eye = paper_eye(&generic, &generic.positions, side, fit).unwrap();
            assert_eq!((eye.positions.len(), eye.triangles.len()), (50, 60));
            assert_eq!([eye.r1.len(), eye.r2.len(), eye.tr.len()], [12, 12, 36]);
            let forward = eye.triangles.iter().filter(|t| mesh::area_normal(&eye.positions, t).z > 0.0).count();
            assert!(forward >= 58, "{forward}");
            let farthest = eye.positions.iter().map(|p| (p - fit.centre).norm()).fold(0.0, f64::max);
            assert!(farthest < 0.022, "{farthest}");
        }
    }
}
