//! Lips, lids and brows where the frames show them.

use super::Measured;
use crate::FacewrightError;
use crate::faces::Clip;
use geometry::Vec3;
use head::features::{FeatureFrame, FeatureOptions, align_features};

/// A measured head's vertices at rest, `positions`, with its features slid along the skin to where the chosen frames show them.
pub fn align(clip: &Clip, measured: &Measured, positions: &[Vec3]) -> Result<Vec<Vec3>, FacewrightError> {
    let own = |frame: usize| Some(clip.rest.from_rest(&clip.landmark_fit.frames[frame].as_ref()?.expression));
    let chosen: Vec<_> =
        measured.chosen_poses().into_iter().filter_map(|(frame, pose)| Some((frame, pose, own(frame)?))).collect();
    let frames: Vec<FeatureFrame> = chosen
        .iter()
        .map(|(frame, pose, expression)| FeatureFrame { seen: &clip.seen[*frame], pose: *pose, expression })
        .collect();
    Ok(align_features(clip.head, positions, &measured.camera, &frames, &FeatureOptions::default())?)
}
