//! What no frame measured: skull, back, neck, ears.
//!
//! The class explains the face with coefficients that also move the rest of the head, where nothing holds them: a long face
//! would get a steeple. There the average head is the better guess, placed and sized by the face, and moved with the measured skin's
//! rim.

use geometry::{Similarity, Vec3, smooth_step};
use head::GenericHead;
use head::ears::keep_ears;
use head::extend::extend;
use rayon::prelude::*;

/// Skin within this of a measured point counts as measured, and beyond the second it does not, metres.
const MEASURED: (f64, f64) = (0.012, 0.024);
/// How far what was not measured follows the rim of what was, metres: what people's skulls differ by from the average one goes on
/// about so far.
const LENGTH: f64 = 0.06;

/// Replaces what lies away from the measured `points` (head frame, metres) by the average head; `positions` are all
/// vertices. Unchanged when too little was measured to place the average head.
pub fn replace_unseen(head: &GenericHead, positions: &[Vec3], points: &[Vec3]) -> Vec<Vec3> {
    let share = shares(positions, points);
    let skin = head.skin().vertices.clone();
    let seen: Vec<usize> = skin.clone().filter(|&v| !head.cavity[v] && share[v] >= 1.0).collect();
    let (from, to): (Vec<Vec3>, Vec<Vec3>) = seen.iter().map(|&v| (head.positions[v], positions[v])).unzip();
    let Some(placed) = Similarity::fit(&from, &to, None, true) else { return positions.to_vec() };
    let average: Vec<Vec3> = head.positions.iter().map(|p| placed.apply(p)).collect();
    let mut whole = extend(positions, &average, &share, skin, LENGTH);
    keep_ears(head, &mut whole, &average);
    whole
}

/// How much of each vertex was measured, 0…1.
fn shares(positions: &[Vec3], points: &[Vec3]) -> Vec<f64> {
    let nearest = |p: &Vec3| points.iter().map(|q| (p - q).norm_squared()).fold(f64::MAX, f64::min).sqrt();
    positions.par_iter().map(|p| smooth_step(MEASURED.1, MEASURED.0, nearest(p))).collect()
}
