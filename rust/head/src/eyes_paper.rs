//! The paper's eye (section 2.8): `EM = {R1, R2, Tr}`, two circles of twelve triangles each, and 36 triangles from the
//! larger circle to the eye socket.
//!
//! # Entry point
//! [`paper_eye`].
//!
//! Twelve corners on the circle and 24 on the socket make 12 + 24 = 36 triangles between them. Two triangles that share an
//! edge are one quad here, and that edge is where `geometry::mesh::triangulate` parts it.

use crate::eyes::{EyeFit, opening};
use crate::{GenericHead, HeadError};
use geometry::{Vec2, Vec3};
use nalgebra::Rotation3;
use std::f64::consts::TAU;
use std::ops::Range;

/// Corners of each circle.
const CIRCLE: usize = 12;
/// Corners on the socket.
const SOCKET: usize = 2 * CIRCLE;
/// The small circle lies this far before the large one, metres: seen from anywhere, it hides that one's middle.
const LIFT: f64 = 1e-4;
/// Radius of the small circle, of the large one's.
const PUPIL: f64 = 0.5;
/// Part of the room between the lids that the large circle may take.
const ROOM: f64 = 0.9;

/// An eye of 60 triangles in 30 quads.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperEye {
    /// Centre and corners of the small circle, those of the large one, corners on the socket; head frame, metres.
    pub positions: Vec<Vec3>,
    /// The same across the gaze, subject's left and up, in radii of the iris.
    pub across: Vec<Vec2>,
    /// Where the corners on the socket, the last ones, lie on the skin: an edge, and a share along it.
    pub socket: Vec<([u32; 2], f64)>,
    /// Counter-clockwise seen from the front.
    pub quads: Vec<[u32; 4]>,
    /// Quads of the small circle: the pupil.
    pub r1: Range<usize>,
    /// Quads of the large circle: the iris.
    pub r2: Range<usize>,
    /// Quads between it and the socket: the white.
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
    let on_edge = |([a, b], share): &([u32; 2], f64)| positions[*a as usize].lerp(&positions[*b as usize], *share);
    let rim = socket.iter().map(|place| turn.inverse() * (on_edge(place) - eye.centre));
    let rim: Vec<Vec3> = rim.collect();
    let room = rim.iter().map(|p| p.xy().norm()).fold(f64::INFINITY, f64::min);
    let large = eye.iris_radius.min(ROOM * room);
    let depth = (eye.radius * eye.radius - large * large).max(0.0).sqrt();
    let corners = [circle(PUPIL * large, depth + LIFT), circle(large, depth), rim].concat();
    let (fans, tr) = (CIRCLE / 2, 3 * CIRCLE / 2);
    Ok(PaperEye {
        across: corners.iter().map(|p| p.xy() / eye.iris_radius).collect(),
        positions: corners.iter().map(|p| eye.centre + turn * p).collect(),
        socket,
        quads: [fan(0), fan(CIRCLE as u32 + 1), collar()].concat(),
        r1: 0..fans,
        r2: fans..2 * fans,
        tr: 2 * fans..2 * fans + tr,
    })
}

/// Centre and corners of a circle across +z.
fn circle(radius: f64, depth: f64) -> Vec<Vec3> {
    let corner = |k: usize| {
        let (sine, cosine) = (TAU * k as f64 / CIRCLE as f64).sin_cos();
        Vec3::new(radius * cosine, radius * sine, depth)
    };
    std::iter::once(Vec3::new(0.0, 0.0, depth)).chain((0..CIRCLE).map(corner)).collect()
}

/// Quads of a circle whose centre is vertex `first`.
fn fan(first: u32) -> Vec<[u32; 4]> {
    let corner = |k: u32| first + 1 + k % CIRCLE as u32;
    (0..CIRCLE as u32).step_by(2).map(|k| [first, corner(k), corner(k + 1), corner(k + 2)]).collect()
}

/// Quads between the large circle and the socket: three triangles for every corner of the circle, so three quads for every two.
fn collar() -> Vec<[u32; 4]> {
    let inner = |k: u32| CIRCLE as u32 + 2 + k % CIRCLE as u32;
    let outer = |k: u32| 2 * (CIRCLE as u32 + 1) + k % SOCKET as u32;
    let three = |k: u32| {
        let ([a, b, c], first) = ([k, k + 1, k + 2].map(inner), 2 * k);
        let [p, q, r, s, t] = [0, 1, 2, 3, 4].map(|i| outer(first + i));
        [[a, p, q, b], [b, q, r, s], [s, t, c, b]]
    };
    (0..CIRCLE as u32).step_by(2).flat_map(three).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eyes::{EyeOptions, fit_eyes};
    use crate::testing::{asset, with_eyes};
    use geometry::mesh;
    use std::collections::BTreeMap;

    /// Fits and paper's eyes of a member of the class.
    fn eyes(generic: &GenericHead, positions: &[Vec3]) -> Vec<(EyeFit, PaperEye)> {
        let fits = fit_eyes(generic, positions, &[None; 2], &EyeOptions::default()).unwrap();
        let eye = |(side, fit): (usize, &EyeFit)| (*fit, paper_eye(generic, positions, side, fit).unwrap());
        fits.iter().enumerate().map(eye).collect()
    }

    #[test]
    fn an_eye_is_two_circles_and_a_collar_that_face_forward() {
        let Some(generic) = asset() else { return };
        for (fit, eye) in eyes(&generic, &generic.positions) {
            let triangles = mesh::triangulate(&eye.quads);
            assert_eq!((eye.positions.len(), triangles.len()), (50, 60));
            assert_eq!([&eye.r1, &eye.r2, &eye.tr].map(|quads| 2 * quads.len()), [12, 12, 36]);
            let forward = triangles.iter().filter(|t| mesh::area_normal(&eye.positions, t).z > 0.0).count();
            assert!(forward >= 58, "{forward}");
            let farthest = eye.positions.iter().map(|p| (p - fit.centre).norm()).fold(0.0, f64::max);
            assert!(farthest < 0.022, "{farthest}");
        }
    }

    #[test]
    fn the_small_circle_lies_within_the_large_one_and_before_it() {
        let Some(generic) = asset() else { return };
        for (fit, eye) in eyes(&generic, &with_eyes(&generic, 3, 1.2, 6e-4)) {
            let reach = |first: usize| eye.across[first..first + 13].iter().map(|p| p.norm()).fold(0.0, f64::max);
            assert!(reach(0) < 0.6 * reach(13) && reach(13) <= 1.0 + 1e-9, "{} {}", reach(0), reach(13));
            let depth = |v: usize| (eye.positions[v] - fit.centre).dot(&fit.gaze);
            assert!((0..13).all(|v| (depth(v) - depth(v + 13) - LIFT).abs() < 1e-9));
        }
    }

    #[test]
    fn the_collar_is_closed_from_the_circle_to_the_lids() {
        let Some(generic) = asset() else { return };
        let person = with_eyes(&generic, 4, 1.0, 0.0);
        for (_, eye) in eyes(&generic, &person) {
            let mut uses: BTreeMap<[u32; 2], usize> = BTreeMap::new();
            for t in mesh::triangulate(&eye.quads[eye.tr.clone()]) {
                for [a, b] in [[0, 1], [1, 2], [2, 0]].map(|e| e.map(|k| t[k])) {
                    *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
                }
            }
            let border: Vec<[u32; 2]> = uses.iter().filter(|(_, n)| **n == 1).map(|(e, _)| *e).collect();
            let ring = |first: u32, n: u32| (0..n).map(move |k| [first + k, first + (k + 1) % n]);
            let mut wanted: Vec<[u32; 2]> =
                ring(14, 12).chain(ring(26, 24)).map(|[a, b]| [a.min(b), a.max(b)]).collect();
            wanted.sort_unstable();
            assert_eq!(border, wanted);
            for (corner, ([a, b], _)) in eye.positions[26..].iter().zip(&eye.socket) {
                let (from, to) = (person[*a as usize], person[*b as usize]);
                let round = (corner - from).norm() + (corner - to).norm() - (to - from).norm();
                assert!(round < 1e-9 && !generic.cavity[*a as usize] && !generic.cavity[*b as usize], "{round}");
            }
        }
    }
}
