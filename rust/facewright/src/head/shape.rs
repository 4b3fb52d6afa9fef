//! Our way to the shape: the points of a motion, the class of heads, and a free deformation.

use super::regions::{covered_landmarks, nearest};
use super::{Measured, MeasuredFrame};
use crate::faces::{Chosen, Clip, KnownFrame, KnownHead};
use crate::{FacewrightError, FrameMotion, HeadMotion, SizeOptions};
use geometry::{Progress, Similarity, Transform};
use head::deform::{DeformOptions, refine};
use head::fit::{CloudFrame, CloudPoint, FitOptions, HeadFit, HeadSize, fit_cloud};

/// Fewer skin points than this do not improve on the landmarks.
const LEAST_POINTS: usize = 40;

/// The frames that shape and texture are taken from: of those that the points of a motion pose, if they are enough to tell shape.
///
/// # Errors
/// Those of [`Chosen::of`].
pub fn choose(clip: &Clip, motion: &HeadMotion) -> Result<Chosen, FacewrightError> {
    let by_points: Vec<Option<Transform>> = motion.frames.iter().map(|frame| frame.cam_from_head).collect();
    let by_landmarks: Vec<Option<Transform>> = (0..clip.frames.len()).map(|frame| clip.known.pose(frame)).collect();
    let is_enough = cloud(motion, clip.frames.fewest_sightings()).len() >= LEAST_POINTS;
    Chosen::of(clip, if is_enough { &by_points } else { &by_landmarks })
}

/// Measures the shape of the head in a clip whose motion is known; `known` is the head that the motion's tracks were predicted by.
///
/// # Errors
/// [`head::HeadError`], [`FacewrightError::Cancelled`].
pub fn measure(
    clip: &Clip,
    known: &KnownHead,
    motion: &HeadMotion,
    chosen: Chosen,
    size: &SizeOptions,
    progress: &Progress,
) -> Result<Measured, FacewrightError> {
    progress.stage("shape")?;
    let poses: Vec<Option<Transform>> = motion.frames.iter().map(|frame| frame.cam_from_head).collect();
    let mut cloud = cloud(motion, clip.frames.fewest_sightings());
    leave_out_covered(&mut cloud, clip, known);
    if cloud.len() < LEAST_POINTS {
        return Ok(by_landmarks(clip, chosen));
    }
    let size = if motion.scale.measured { HeadSize::Cloud } else { size.head_size() };
    let options = FitOptions { size, ..FitOptions::default() };
    let frame = |&index: &usize| Some(CloudFrame { seen: &clip.seen[index], pose: poses[index]?, index });
    let frames: Vec<CloudFrame> = chosen.frames.iter().filter_map(frame).collect();
    let camera = motion.camera.camera;
    let fit = fit_cloud(clip.head, &camera, &frames, &cloud, &clip.landmark_fit, &options, progress)?;
    let carried = refine(clip.head, &fit, &cloud, &DeformOptions::default())?;
    Ok(Measured {
        camera,
        positions: carried.positions,
        frames: placed(clip, known, motion, &fit),
        chosen,
        points: cloud.iter().map(|point| fit.head_from_cloud.apply(&point.position)).collect(),
        agreement: motion.rigid_agreement,
        points_median: fit.median_distance,
        coefficients: fit.coefficients,
        focal_sigma_px: motion.focal_sigma_px,
        warnings: Vec::new(),
    })
}

/// Points that move with the skull and are certain enough to tell shape.
fn cloud(motion: &HeadMotion, fewest_frames: usize) -> Vec<CloudPoint> {
    let fixed = motion.points.iter().filter(|point| !point.moves && point.frames >= fewest_frames);
    fixed.map(|point| CloudPoint { position: point.position(), covariance: point.covariance() }).collect()
}

/// Leaves out points on what covers the face all the time: they are no skin.
fn leave_out_covered(cloud: &mut Vec<CloudPoint>, clip: &Clip, known: &KnownHead) {
    let covered = covered_landmarks(clip.head, clip.faces.appearance());
    if covered.contains(&true) {
        let at = clip.head.landmarks(&known.positions);
        cloud.retain(|point| !covered[nearest(&at, &point.position).0]);
    }
}

/// Every frame by its points; where these tell no pose, by the head that its landmarks or its neighbours' gave.
fn placed(clip: &Clip, known: &KnownHead, motion: &HeadMotion, fit: &HeadFit) -> Vec<MeasuredFrame> {
    let to_head = &fit.head_from_cloud;
    let pairs = motion.frames.iter().zip(&known.frames);
    let both = pairs.clone().filter_map(|(found, known)| Some((known.as_ref()?.cam_from_head, found.cam_from_head?)));
    let both: Vec<(Transform, Transform)> = both.map(|(known, found)| (known, to_head.move_pose(&found))).collect();
    let from_landmarks = Similarity::of_poses(&both).unwrap_or_else(Similarity::identity);
    let frame = |(index, (found, known)): (usize, (&FrameMotion, &Option<KnownFrame>))| {
        if let Some(pose) = found.cam_from_head {
            let pose = Some(to_head.move_pose(&pose));
            return MeasuredFrame { pose, rms_px: found.reprojection_rms_px, by_landmarks: false };
        }
        let pose = known.as_ref().map(|known| from_landmarks.move_pose(&known.cam_from_head));
        let rms_px = clip.landmark_fit.frames[index].as_ref().map(|fitted| fitted.rms_px);
        MeasuredFrame { pose, rms_px, by_landmarks: pose.is_some() }
    };
    pairs.enumerate().map(frame).collect()
}

/// The head that landmarks alone give.
fn by_landmarks(clip: &Clip, chosen: Chosen) -> Measured {
    let frame = |index: usize| MeasuredFrame {
        pose: clip.known.pose(index),
        rms_px: clip.landmark_fit.frames[index].as_ref().map(|fitted| fitted.rms_px),
        by_landmarks: clip.known.pose(index).is_some(),
    };
    Measured {
        camera: clip.landmark_fit.camera,
        positions: clip.landmark_fit.positions.clone(),
        frames: (0..clip.frames.len()).map(frame).collect(),
        chosen,
        points: Vec::new(),
        coefficients: clip.landmark_fit.coefficients.clone(),
        agreement: 0.0,
        points_median: 0.0,
        focal_sigma_px: None,
        warnings: vec![
            "too few points of the skin could be tracked: the shape rests on the landmarks alone".to_owned(),
        ],
    }
}
