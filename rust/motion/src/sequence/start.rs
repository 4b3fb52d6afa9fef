//! Where a sequence begins: tracks that stand still, and the pair of frames that shows the head from two sides best.

use super::PointTrack;
use super::grow::Reconstruction;
use crate::MotionError;
use crate::two_view::{TwoView, TwoViewOptions, robust};
use geometry::{Progress, Transform, Vec2};
use rayon::prelude::*;

/// Frames among which the pair is sought.
const SAMPLED_FRAMES: usize = 24;
/// Pairs tried in earnest.
const TRIED_PAIRS: usize = 12;
/// Parts of a track's life in which others are watched.
const PARTS_OF_LIFE: usize = 6;
/// More parallax than the paper's fifteen degrees does not make a pair better, radians.
const ENOUGH_TURN_RAD: f64 = 0.26;
/// What a face 0.1 m around its axis moves at that turn, at arm's length, normalised units.
const WANTED_SHIFT: f64 = 0.03;

/// A pair of frames with its motion.
pub(super) struct Pair {
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) tracks: Vec<usize>,
    pub(super) motion: TwoView,
}

/// Which tracks stand still while others move: the background, seen by a camera that does not turn.
///
/// A track that moves less than `limit_px` over its life stands still if in some part of its life several others move more
/// than four times as much.
pub(super) fn standing_still(tracks: &[PointTrack], frames: usize, limit_px: f64) -> Vec<bool> {
    let dense = |track: &PointTrack| {
        let mut pixels = vec![None; frames];
        track.observations.iter().for_each(|o| pixels[o.frame] = Some(o.pixel));
        pixels
    };
    let pixels: Vec<Vec<Option<Vec2>>> = tracks.par_iter().map(dense).collect();
    let others_move = |from: usize, to: usize| {
        let shifts: Vec<f64> = pixels.iter().filter_map(|p| Some((p[from]? - p[to]?).norm())).collect();
        // Several: not a few that slipped. The head may well be the lesser part of the picture.
        let moving = shifts.iter().filter(|s| **s > 4.0 * limit_px).count();
        moving >= 8 && 50 * moving >= shifts.len()
    };
    let stands = |track: &PointTrack| {
        let mut seen: Vec<usize> = track.observations.iter().map(|o| o.frame).collect();
        seen.sort_unstable();
        let part = seen.len().div_ceil(PARTS_OF_LIFE);
        part > 0
            && extent(track) <= limit_px
            && seen.windows(part + 1).step_by(part).any(|w| others_move(w[0], w[part]))
    };
    tracks.par_iter().map(stands).collect()
}

/// How far a track gets from its middle, nine tenths of the time.
fn extent(track: &PointTrack) -> f64 {
    let median = |axis: usize| {
        let mut values: Vec<f64> = track.observations.iter().map(|o| o.pixel[axis]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let middle = Vec2::new(median(0), median(1));
    let mut distances: Vec<f64> = track.observations.iter().map(|o| (o.pixel - middle).norm()).collect();
    distances.sort_by(f64::total_cmp);
    distances[(distances.len() - 1) * 9 / 10]
}

impl Reconstruction<'_> {
    /// The best of the most promising pairs, with its motion.
    pub(super) fn initial_pair(&self, progress: &Progress) -> Result<Pair, MotionError> {
        let mut promising = self.promising_pairs();
        promising.truncate(TRIED_PAIRS);
        progress.step(0, 1)?;
        let options =
            TwoViewOptions { threshold: self.threshold(), seed: self.options.seed, ..TwoViewOptions::default() };
        let tried: Vec<Result<Pair, MotionError>> = promising
            .par_iter()
            .map(|&(_, a, b)| {
                let (tracks, in_a, in_b) = self.matches(a, b);
                robust(&in_a, &in_b, &options).map(|motion| Pair { a, b, tracks, motion })
            })
            .collect();
        let mut first_failure = None;
        let mut best: Option<Pair> = None;
        for result in tried {
            match result {
                Ok(pair) if best.as_ref().is_none_or(|best| worth(&pair) > worth(best)) => best = Some(pair),
                Ok(_) => {}
                Err(error) => first_failure = first_failure.or(Some(error)),
            }
        }
        let reason = first_failure.unwrap_or(MotionError::TooFewMatches { found: 0, needed: 8 }).to_string();
        best.ok_or(MotionError::NoInitialPair { reason })
    }

    /// Pairs of sampled frames, most promising first: many shared tracks, a turn as wanted, near the front.
    fn promising_pairs(&self) -> Vec<(f64, usize, usize)> {
        let key: Vec<usize> = (0..self.options.frames).filter(|&frame| self.key[frame]).collect();
        let stride = key.len().div_ceil(SAMPLED_FRAMES).max(1);
        let sampled: Vec<usize> = key.into_iter().step_by(stride).collect();
        let mut pairs: Vec<_> = sampled
            .iter()
            .flat_map(|&a| sampled.iter().filter(move |&&b| a < b).map(move |&b| (a, b)))
            .map(|(a, b)| (self.promise(a, b), a, b))
            .filter(|(promise, ..)| *promise > 0.0)
            .collect();
        pairs.sort_by(|p, q| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1)).then(p.2.cmp(&q.2)));
        pairs
    }

    fn promise(&self, a: usize, b: usize) -> f64 {
        let (_, in_a, in_b) = self.matches(a, b);
        if in_a.len() < 8 {
            return 0.0;
        }
        let shared = in_a.len() as f64;
        let mut shifts: Vec<f64> = in_a.iter().zip(&in_b).map(|(a, b)| (a - b).norm()).collect();
        shifts.sort_by(f64::total_cmp);
        // What does not turn moves little: the upper part of the tracks tells the turn.
        shared * (shifts[shifts.len() * 3 / 4] / WANTED_SHIFT).min(1.0)
    }

    /// Tracks seen in both frames that do not stand still, and where, normalised.
    pub(super) fn matches(&self, a: usize, b: usize) -> (Vec<usize>, Vec<Vec2>, Vec<Vec2>) {
        let (mut tracks, mut in_a, mut in_b) = (Vec::new(), Vec::new(), Vec::new());
        for (track, sightings) in self.sightings.iter().enumerate().filter(|(track, _)| !self.still[*track]) {
            let at = |frame: usize| sightings.binary_search_by_key(&frame, |s| s.frame);
            if let (Ok(p), Ok(q)) = (at(a), at(b)) {
                tracks.push(track);
                in_a.push(sightings[p].normalised);
                in_b.push(sightings[q].normalised);
            }
        }
        (tracks, in_a, in_b)
    }
}

/// Many points, seen under a large angle, by a motion that is well determined.
fn worth(pair: &Pair) -> f64 {
    let inliers = pair.motion.inliers.iter().filter(|i| **i).count() as f64;
    let parallax = pair.motion.parallax_rad.min(ENOUGH_TURN_RAD);
    let certainty = 1.0 / (1.0 + pair.motion.direction_sigma_rad / 0.05);
    inliers * parallax * certainty * if pair.motion.planar { 0.1 } else { 1.0 }
}

/// Poses of the pair, in units of the distance between its frames.
pub(super) fn pair_poses(pair: &Pair) -> [(usize, Transform); 2] {
    [(pair.a, Transform::identity()), (pair.b, pair.motion.b_from_a)]
}
