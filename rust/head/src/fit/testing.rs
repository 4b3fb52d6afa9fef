//! A small head for tests: an ellipsoid with bumps that move, landmarks on its front.

use super::FrameObservation;
use crate::{Anchor, GenericHead, IdentityClass, Key, Part, part};
use geometry::{Camera, Transform, Vec2, Vec3};
use nalgebra::Rotation3;

const ROWS: usize = 28;
const COLUMNS: usize = 40;
/// Components of the toy class.
pub(crate) const COMPONENTS: usize = 14;

/// Direction of a vertex: latitude rows from the top, longitude columns from the back of the head.
fn direction(row: usize, column: usize) -> Vec3 {
    let latitude = std::f64::consts::PI * ((row as f64 + 0.5) / ROWS as f64 - 0.5);
    let longitude = std::f64::consts::TAU * column as f64 / COLUMNS as f64;
    Vec3::new(-latitude.cos() * longitude.sin(), -latitude.sin(), -latitude.cos() * longitude.cos())
}

fn place(d: &Vec3) -> Vec3 {
    let nose = 0.02 * (-((d.x / 0.12).powi(2) + ((d.y + 0.15) / 0.15).powi(2))).exp() * f64::from(u8::from(d.z > 0.0));
    Vec3::new(0.075 * d.x, 0.11 * d.y - 0.02, 0.095 * d.z + nose - 0.08)
}

/// What component `j` adds at a direction, metres per standard deviation.
fn component(j: usize, d: &Vec3) -> Vec3 {
    let a = j as f64 + 1.0;
    let wave = (a * 0.9 * d.x + 0.4 * a).sin() * (1.3 * a * d.y + a * a).cos() + (0.8 * a * d.z + 2.0 * a).sin() * 0.5;
    Vec3::new((1.7 * a).sin() * d.x.abs() + 0.3 * d.x, (2.9 * a).cos(), (0.7 * a).sin() + 0.6)
        * (wave * 0.0035 / a.sqrt())
}

/// The toy: every part is there, eyes and the rest are single quads.
pub(crate) fn toy_head() -> GenericHead {
    let directions: Vec<Vec3> = (0..ROWS * COLUMNS).map(|i| direction(i / COLUMNS, i % COLUMNS)).collect();
    let mut positions: Vec<Vec3> = directions.iter().map(place).collect();
    let index = |r: usize, c: usize| (r * COLUMNS + c % COLUMNS) as u32;
    let mut quads: Vec<[u32; 4]> = (0..ROWS - 1)
        .flat_map(|r| (0..COLUMNS).map(move |c| [index(r, c), index(r + 1, c), index(r + 1, c + 1), index(r, c + 1)]))
        .collect();
    let skin = positions.len();
    let mut parts = vec![Part { name: part::SKIN.into(), vertices: 0..skin, quads: 0..quads.len() }];
    for (k, name) in part::ALL.iter().enumerate().skip(1) {
        let centre = match k {
            1 => Vec3::new(0.03, 0.0, 0.0),
            2 => Vec3::new(-0.03, 0.0, 0.0),
            _ => Vec3::new(0.0, -0.06, -0.02),
        };
        let first = positions.len();
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            positions.push(centre + Vec3::new(x, y, 0.0) * 0.006);
        }
        quads.push([0, 1, 2, 3].map(|i| (first + i) as u32));
        parts.push(Part { name: (*name).into(), vertices: first..first + 4, quads: quads.len() - 1..quads.len() });
    }
    let n = positions.len();
    let moved = |j: usize, i: usize| directions.get(i).map_or(Vec3::zeros(), |d| component(j, d));
    let basis = (0..COMPONENTS)
        .flat_map(|j| (0..n).flat_map(move |i| moved(j, i).iter().map(|&x| x as f32).collect::<Vec<_>>()));
    let basis: Vec<f32> = basis.collect();
    GenericHead {
        keys: ["jawOpen", "eyeBlinkLeft", "tongueOut"]
            .iter()
            .enumerate()
            .map(|(k, name)| key(k, name, &directions))
            .collect(),
        identity: IdentityClass { components: COMPONENTS, basis },
        uvs: vec![[[0.0; 2]; 4]; quads.len()],
        mirror: (0..n as u32).collect(),
        cavity: vec![false; n],
        anchors: anchors(&quads[..(ROWS - 1) * COLUMNS], &directions),
        lid_contacts: [Vec::new(), Vec::new()],
        lip_contacts: Vec::new(),
        positions,
        quads,
        parts,
    }
}

fn key(k: usize, name: &str, directions: &[Vec3]) -> Key {
    let (centre, offset) = [
        (Vec3::new(0.0, -0.8, 0.6), Vec3::new(0.0, -0.02, -0.005)),
        (Vec3::new(0.4, 0.2, 0.9), Vec3::new(0.0, -0.006, 0.001)),
        (Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 0.0, 0.01)),
    ][k];
    let bump = |d: &Vec3| (-(d - centre.normalize()).norm_squared() / 0.15).exp();
    let offsets =
        directions.iter().enumerate().filter(|(_, d)| bump(d) > 0.02).map(|(i, d)| (i as u32, offset * bump(d)));
    Key { name: name.to_owned(), offsets: offsets.collect() }
}

/// 468 anchors spread over the quads of the front.
fn anchors(quads: &[[u32; 4]], directions: &[Vec3]) -> Vec<Anchor> {
    let front: Vec<&[u32; 4]> = quads.iter().filter(|q| directions[q[0] as usize].z > 0.3).collect();
    let anchor = |i: usize| {
        let q = front[i * front.len() / 468];
        let a = 0.15 + 0.7 * ((i as f64 * 0.618).fract());
        Anchor { triangle: [q[0], q[1], q[2]], weights: [0.5 * a, 1.0 - a, 0.5 * a], sigma: 0.002 }
    };
    (0..468).map(anchor).collect()
}

/// A number between −1 and 1 that looks like chance (SplitMix64).
pub(crate) fn chance(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// A person outside the class: a member, and bumps that no component knows.
pub(crate) fn person(head: &GenericHead) -> Vec<Vec3> {
    let coefficients: Vec<f64> = (0..COMPONENTS).map(|j| 2.0 * chance(j as u64 + 7)).collect();
    let mut positions = head.with_identity(&coefficients);
    for p in &mut positions {
        *p += Vec3::new((41.0 * p.y).sin(), (37.0 * p.z).sin(), (43.0 * p.x + 1.0).sin()) * 0.0006;
    }
    positions
}

/// The camera of the tests.
pub(crate) fn camera() -> Camera {
    Camera { k1: -0.18, k2: 0.09, ..Camera::centred(352, 288, 615.0) }
}

/// Poses of a head that turns ±25° and nods a little.
pub(crate) fn turn(count: usize) -> Vec<Transform> {
    let pose = |i: usize| {
        let a = 2.0 * i as f64 / (count - 1) as f64 - 1.0;
        let upright = Rotation3::new(Vec3::new(std::f64::consts::PI, 0.0, 0.0));
        let turned = Rotation3::new(Vec3::new(0.08 * (3.0 * a).sin(), 25.0_f64.to_radians() * a, 0.05 * a));
        Transform::new(upright * turned, Vec3::new(0.01 * a, 0.02, 0.7 + 0.02 * a * a))
    };
    (0..count).map(pose).collect()
}

/// Landmarks of a mesh in a frame, with a slip that is the same in all frames and jitter that is not.
pub(crate) fn observe(
    head: &GenericHead,
    positions: &[Vec3],
    pose: &Transform,
    jitter_px: f64,
    slip: f64,
    seed: u64,
) -> FrameObservation {
    let landmark = |(i, p): (usize, Vec3)| {
        let slip = Vec3::new((60.0 * p.x + 1.0).sin(), (50.0 * p.y).cos(), 0.0) * slip;
        let jitter = Vec2::new(chance(seed * 1000 + i as u64), chance(seed * 1000 + 500 + i as u64)) * 1.7 * jitter_px;
        camera().project(&pose.apply(&(p + slip))).unwrap() + jitter
    };
    let landmarks: Vec<Vec2> = head.landmarks(positions).into_iter().enumerate().map(landmark).collect();
    FrameObservation { sigma_px: vec![jitter_px.max(0.1); landmarks.len()], landmarks, ..FrameObservation::default() }
}

/// Root mean square distance of two meshes' front vertices after the best similarity, metres.
pub(crate) fn front_error(head: &GenericHead, found: &[Vec3], truth: &[Vec3]) -> f64 {
    let front: Vec<usize> = head.skin().vertices.clone().filter(|&i| head.positions[i].z > -0.04).collect();
    let pick = |p: &[Vec3]| front.iter().map(|&i| p[i]).collect::<Vec<_>>();
    let fit = geometry::Similarity::fit(&pick(found), &pick(truth), None, true).unwrap();
    let squares = front.iter().map(|&i| (fit.apply(&found[i]) - truth[i]).norm_squared());
    (squares.sum::<f64>() / front.len() as f64).sqrt()
}
