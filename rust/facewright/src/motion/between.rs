//! The frames of a clip that were not chosen: where the head is in them.

use super::{Measured, PosedFrame, lenders};
use crate::faces::TrackedSkin;
use crate::faces::clip::Clip;
use crate::head::shape::Shape;
use crate::track::{Surface, TrackedFrame};
use crate::{FacewrightError, FrameSet};
use geometry::{Progress, Transform};
use head::GenericHead;
use rayon::prelude::*;

/// Frames read at a time.
const CHUNK: usize = 16;

/// The poses, by their points, of the frames that were not chosen and show a face; `None` for chosen ones and where points
/// tell no pose.
pub fn pose_between(
    frames: &FrameSet,
    clip: &Clip,
    head: &GenericHead,
    shape: &Shape,
    progress: &Progress,
) -> Result<Vec<Option<PosedFrame>>, FacewrightError> {
    progress.stage("poses")?;
    let is_chosen = |index: &usize| clip.chosen.iter().any(|c| c.index == *index);
    let open: Vec<usize> = (0..clip.names.len()).filter(|index| !is_chosen(index)).collect();
    let mut poses = vec![None; clip.names.len()];
    if open.is_empty() {
        return Ok(poses);
    }
    let chosen = clip.chosen.iter().zip(&shape.poses);
    let measured: Vec<TrackedFrame> =
        chosen.map(|(c, pose)| TrackedFrame { skin: &c.skin, cam_from_head: *pose }).collect();
    let triangles = head.outer_skin();
    let surface = Surface::new(&shape.positions, &triangles);
    let lenders = lenders(&measured, &shape.camera, &surface);
    let measured = Measured::take(&lenders, &shape.camera, &triangles)?;
    let pose = |index: usize| -> Result<Option<PosedFrame>, FacewrightError> {
        let face = clip.observations[index].face.as_ref();
        let Some((face, fitted)) = face.zip(clip.landmark_fit.frames[index].as_ref()) else { return Ok(None) };
        let expected: Transform = shape.head_from_landmark_head.move_pose(&fitted.pose);
        let positions = head.with_expression(&shape.positions, &fitted.expression);
        measured.pose(&TrackedSkin::of(&frames.load(index)?, face), &positions, &expected)
    };
    for (done, chunk) in open.chunks(CHUNK).enumerate() {
        progress.step(done * CHUNK, open.len())?;
        let found: Result<Vec<_>, _> = chunk.par_iter().map(|&index| pose(index)).collect();
        chunk.iter().zip(found?).for_each(|(&index, found)| poses[index] = found);
    }
    Ok(poses)
}
