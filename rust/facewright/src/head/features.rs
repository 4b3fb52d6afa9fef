//! Lips, lids and brows where the frames show them.

use super::Measured;
use crate::FacewrightError;
use crate::faces::Clip;
use geometry::Vec3;
use head::features::{FeatureFrame, FeatureOptions, align_features};

/// The vertices of a measured head with its features slid along the skin to where the chosen frames show them.
pub fn align(clip: &Clip, measured: &Measured) -> Result<Vec<Vec3>, FacewrightError> {
    let chosen = measured.chosen_poses();
    let frame = |&(index, pose): &(usize, geometry::Transform)| {
        let fitted = clip.landmark_fit.frames[index].as_ref()?;
        Some(FeatureFrame { seen: &clip.seen[index], pose, expression: &fitted.expression })
    };
    let frames: Vec<FeatureFrame> = chosen.iter().filter_map(frame).collect();
    Ok(align_features(clip.head, &measured.positions, &measured.camera, &frames, &FeatureOptions::default())?)
}
