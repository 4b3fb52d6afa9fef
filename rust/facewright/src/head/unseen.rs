//! What no frame measured: skull, back, neck.
//!
//! The class explains the face with coefficients that also move the rest of the head, where nothing holds them: a long face
//! would get a steeple. There the average head is the better guess, placed and sized by the face.

use geometry::{Similarity, Vec3};
use head::GenericHead;
use rayon::prelude::*;

/// Skin within this of a measured point counts as measured, metres …
const MEASURED: f64 = 0.012;
/// … and from there the average head takes over within this distance, metres.
const TRANSITION: f64 = 0.05;

/// Replaces what lies away from the measured `points` (head frame, metres) by the average head; `positions` are all
/// vertices. Unchanged when too little was measured to place the average head.
pub fn replace_unseen(head: &GenericHead, positions: &[Vec3], points: &[Vec3]) -> Vec<Vec3> {
    let distance = distances(positions, points);
    let skin = head.skin().vertices.clone();
    let seen: Vec<usize> = skin.filter(|&v| !head.cavity[v] && distance[v] < MEASURED).collect();
    let (from, to): (Vec<Vec3>, Vec<Vec3>) = seen.iter().map(|&v| (head.positions[v], positions[v])).unzip();
    let Some(placed) = Similarity::fit(&from, &to, None, true) else { return positions.to_vec() };
    let blend = |v: usize| {
        let t = ((distance[v] - MEASURED) / TRANSITION).clamp(0.0, 1.0);
        let away = t * t * (3.0 - 2.0 * t);
        positions[v] * (1.0 - away) + placed.apply(&head.positions[v]) * away
    };
    (0..positions.len()).map(blend).collect()
}

/// Distance of each vertex from the nearest measured point.
fn distances(positions: &[Vec3], points: &[Vec3]) -> Vec<f64> {
    let nearest = |p: &Vec3| points.iter().map(|q| (p - q).norm_squared()).fold(f64::MAX, f64::min).sqrt();
    positions.par_iter().map(nearest).collect()
}
