//! Which points move with the skull: by their residuals over the whole sequence.

use geometry::{Transform, Vec2};
use motion::sequence::{PointTrack, Sequence};
use motion::triangulate::triangulate_robust;
use rayon::prelude::*;

/// Part of its frames in which a rigid point must be where the head takes it.
const LEAST_SHARE: f64 = 0.75;
/// A point is where it should be within so many usual residuals …
const USUAL: f64 = 4.0;
/// … or within this, whichever is more, pixels.
const LEAST_LIMIT_PX: f64 = 0.6;

/// What became of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judged {
    /// It moves with the head.
    Rigid,
    /// It has a place on the head but moves against it.
    Moves,
    /// It could not be placed: seen from one side only, wrong, or on the background.
    Lost,
}

/// Judges all tracks, those that took part in a motion and those that did not, by that motion.
pub(super) fn judge(tracks: &[PointTrack], motion: &Sequence, threshold_px: f64) -> Vec<Judged> {
    let residuals: Vec<Option<Vec<f64>>> =
        tracks.par_iter().map(|track| residuals(track, motion, threshold_px)).collect();
    let mut all: Vec<f64> = residuals.iter().flatten().flatten().copied().collect();
    all.sort_by(f64::total_cmp);
    let usual = all.get(all.len() / 2).copied().unwrap_or(0.0);
    let limit = (USUAL * usual).max(LEAST_LIMIT_PX);
    let judged = |residuals: &Option<Vec<f64>>| match residuals {
        None => Judged::Lost,
        Some(residuals) => {
            let near = residuals.iter().filter(|r| **r < limit).count() as f64;
            if near >= LEAST_SHARE * residuals.len() as f64 { Judged::Rigid } else { Judged::Moves }
        }
    };
    residuals.iter().map(judged).collect()
}

/// Distances of a track's observations from its point, pixels; `None` where it has no place.
fn residuals(track: &PointTrack, motion: &Sequence, threshold_px: f64) -> Option<Vec<f64>> {
    let camera = &motion.camera;
    let seen: Vec<(Transform, Vec2)> =
        track.observations.iter().filter_map(|o| Some((*motion.poses[o.frame].as_ref().ok()?, o.pixel))).collect();
    let rays: Vec<(Transform, Vec2)> = seen.iter().map(|(pose, pixel)| (*pose, camera.normalise(pixel))).collect();
    let (found, _) = triangulate_robust(&rays, threshold_px / camera.fx)?;
    let distance = |(pose, pixel): &(Transform, Vec2)| {
        camera.project(&pose.apply(&found.point)).map_or(f64::INFINITY, |at| (at - pixel).norm())
    };
    Some(seen.iter().map(distance).collect())
}
