//! Which points move with the skull: by their residuals over the whole sequence.

use geometry::{Transform, Vec2, Vec3};
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

/// Where a track is on the head, as far as it has a place, and how its observations fit.
pub(super) struct Placed {
    /// Head frame, in the motion's unit.
    pub point: Vec3,
    /// Distance from the camera in its first frame, in the motion's unit.
    pub depth: f64,
    /// Distances of its observations in posed frames from the point, pixels; infinite behind the camera.
    pub distances: Vec<f64>,
    /// Observations that agree.
    pub near: usize,
}

/// Judges all tracks, those that took part in a motion and those that did not, by that motion.
pub(super) fn judge(tracks: &[PointTrack], motion: &Sequence, threshold_px: f64) -> Vec<Judged> {
    let placed: Vec<Option<Placed>> = tracks.par_iter().map(|track| place(track, motion, threshold_px)).collect();
    let mut all: Vec<f64> = placed.iter().flatten().flat_map(|placed| &placed.distances).copied().collect();
    all.sort_by(f64::total_cmp);
    let usual = all.get(all.len() / 2).copied().unwrap_or(0.0);
    let limit = (USUAL * usual).max(LEAST_LIMIT_PX);
    let judged = |placed: &Option<Placed>| match placed {
        None => Judged::Lost,
        Some(Placed { distances, .. }) => {
            let near = distances.iter().filter(|distance| **distance < limit).count() as f64;
            if near >= LEAST_SHARE * distances.len() as f64 { Judged::Rigid } else { Judged::Moves }
        }
    };
    placed.iter().map(judged).collect()
}

/// Places a track by the poses of a motion; `None` where most of its rays do not meet.
pub(super) fn place(track: &PointTrack, motion: &Sequence, threshold_px: f64) -> Option<Placed> {
    let camera = &motion.camera;
    let seen: Vec<(Transform, Vec2)> =
        track.observations.iter().filter_map(|o| Some((*motion.poses[o.frame].as_ref().ok()?, o.pixel))).collect();
    let rays: Vec<(Transform, Vec2)> = seen.iter().map(|(pose, pixel)| (*pose, camera.normalise(pixel))).collect();
    let (found, near) = triangulate_robust(&rays, threshold_px / camera.fx)?;
    let distance = |(pose, pixel): &(Transform, Vec2)| {
        camera.project(&pose.apply(&found.point)).map_or(f64::INFINITY, |at| (at - pixel).norm())
    };
    Some(Placed {
        point: found.point,
        depth: seen.first()?.0.apply(&found.point).z,
        distances: seen.iter().map(distance).collect(),
        near: near.iter().filter(|near| **near).count(),
    })
}
