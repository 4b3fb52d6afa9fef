//! The motion between two frames (paper, section 2.5, eq. 5–7).
//!
//! # Entry points
//! - [`robust`]: five-point consensus, locally optimised, scored without a known noise (MAGSAC++), trusted matches first
//!   (PROSAC); then motion, noise and share of wrong matches by expectation–maximisation of Sampson's distances, from both
//!   mirror solutions, and by the parallax of neighbours; a rough turn of the head may be given. No parallax and mere
//!   magnification are errors, a plane is [`TwoView::planar`]. Wrong matches may be many.
//! - [`paper`]: the paper's chain; normalised eight points with two equal singular values, rotation and translation by the
//!   points in front, least sum of squared epipolar distances, triangulation. Every match counts.
//! - The parts: [`eight_point`], [`five_point()`], [`decompose`], [`pose_from_essential`], [`refine_epipolar`],
//!   [`refine_sampson`].
//!
//! # Conventions
//! Matches are normalised coordinates `a[i]`, `b[i]` of one point in two frames. `bᵀ E a = 0` with `E = [t]× R` and
//! `b_from_a = (R, t)`; the length of `t` cannot be known and is one.

mod consensus;
mod eight_point;
mod essential;
mod five_point;
mod kernel;
mod mixture;
mod points;
mod refine;
mod score;
mod support;
mod verdict;

pub use consensus::robust;
pub use eight_point::eight_point;
pub use essential::{decompose, essential_of, pose_from_essential};
pub use five_point::five_point;
pub use refine::{refine_epipolar, refine_epipolar_trimmed, refine_sampson};

use crate::MotionError;
use geometry::{Transform, Vec2, Vec3};
use nalgebra::Rotation3;

/// How [`robust`] searches.
#[derive(Clone, Debug)]
pub struct TwoViewOptions {
    /// Distance of a right match from its epipolar line at most, normalised units: pixels over focal length.
    pub threshold: f64,
    /// Wanted probability of having drawn a sample without wrong matches.
    pub confidence: f64,
    /// Samples drawn at most.
    pub max_iterations: usize,
    /// Seed of the samples.
    pub seed: u64,
    /// Indices of the matches, most trusted first: early samples come from the front (Chum and Matas 2005).
    pub order: Option<Vec<usize>>,
    /// What is known of the turn beforehand. A small turn of a small object is hard to tell from a larger turn of a flatter
    /// one, or from the opposite turn of a hollow one; even a rough turn tells them apart.
    pub rough_turn: Option<RoughTurn>,
}

/// A rotation known to within a standard deviation, from the head poses of two frames for instance.
#[derive(Clone, Copy, Debug)]
pub struct RoughTurn {
    /// The rotation.
    pub b_from_a: Rotation3<f64>,
    /// Standard deviation of its error about each axis, radians.
    pub sigma_rad: f64,
}

impl Default for TwoViewOptions {
    /// One pixel at a focal length of 650, confidence 0.9999, 2000 samples, nothing known beforehand.
    fn default() -> Self {
        Self {
            threshold: 1.0 / 650.0,
            confidence: 0.9999,
            max_iterations: 2000,
            seed: 0,
            order: None,
            rough_turn: None,
        }
    }
}

/// The motion between two frames and how far it can be trusted.
#[derive(Clone, Debug)]
pub struct TwoView {
    /// The motion, with a translation of length one.
    pub b_from_a: Transform,
    /// Which matches agree with it.
    pub inliers: Vec<bool>,
    /// The point of each inlier in frame `a`, in units of the translation; `None` where its rays are parallel or part.
    pub points: Vec<Option<Vec3>>,
    /// Median angle between the rays of a match, radians.
    pub parallax_rad: f64,
    /// Standard deviation of the inliers' distances from their epipolar lines, normalised units.
    pub sigma: f64,
    /// Standard deviation of the rotation, radians.
    pub rotation_sigma_rad: f64,
    /// Standard deviation of the translation's direction, radians.
    pub direction_sigma_rad: f64,
    /// Whether one plane explains the inliers: then a second motion explains them too, and this one may be it.
    pub planar: bool,
}

impl TwoView {
    /// What to tell the user of a motion that is not to be trusted.
    pub fn warning(&self) -> Option<&'static str> {
        self.planar.then_some(
            "the points matched between these two frames lie on one plane, which two different motions explain alike: \
             choose frames or points that show more of the head's depth",
        )
    }
}

/// The paper's chain: eight-point `E`, rotation and translation from it, least epipolar distances, triangulation.
///
/// Fails with fewer than eight matches, when nothing turns, or when no motion puts the points before both cameras.
pub fn paper(a: &[Vec2], b: &[Vec2]) -> Result<TwoView, MotionError> {
    check_matches(a, b)?;
    let everything = vec![true; a.len()];
    let start = eight_point(a, b).and_then(|essential| pose_from_essential(&essential, a, b));
    let start = start.ok_or(MotionError::NoAgreement { agree: 0, total: a.len() })?;
    Ok(assemble(a, b, refine_epipolar(a, b, &start), everything))
}

/// Fewest matches of which a motion is claimed: five define it, the others confirm it.
const FEWEST: usize = 8;

fn check_matches(a: &[Vec2], b: &[Vec2]) -> Result<(), MotionError> {
    if a.len() != b.len() {
        return Err(MotionError::BadIndex { table: "match table", kind: "match", index: a.len(), count: b.len() });
    }
    if a.len() < FEWEST {
        return Err(MotionError::TooFewMatches { found: a.len(), needed: FEWEST });
    }
    match a.iter().chain(b).flat_map(|p| p.iter()).find(|v| !v.is_finite()) {
        Some(&value) => Err(MotionError::BadNumber { name: "a matched coordinate", value }),
        None => Ok(()),
    }
}

/// Triangulates the inliers and measures how well the motion is determined.
fn assemble(a: &[Vec2], b: &[Vec2], b_from_a: Transform, inliers: Vec<bool>) -> TwoView {
    let (in_a, in_b) = (verdict::select(a, &inliers), verdict::select(b, &inliers));
    let spread = verdict::spread(&in_a, &in_b, &b_from_a);
    let points = (0..a.len()).map(|i| inliers[i].then(|| points::point(&b_from_a, &a[i], &b[i])).flatten()).collect();
    TwoView {
        parallax_rad: verdict::median_parallax(&in_a, &in_b, &b_from_a),
        planar: verdict::is_planar(&in_a, &in_b, &b_from_a, spread.sigma),
        points,
        sigma: spread.sigma,
        rotation_sigma_rad: spread.rotation_rad,
        direction_sigma_rad: spread.direction_rad,
        b_from_a,
        inliers,
    }
}

#[cfg(test)]
mod tests;

/// Processor time of this process in milliseconds: what the ignored measurements report on a busy machine.
#[cfg(test)]
pub(crate) fn processor_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<f64> =
        stat.rsplit(')').next().unwrap().split_whitespace().map(|f| f.parse().unwrap_or(0.0)).collect();
    (fields[11] + fields[12]) * 10.0
}
