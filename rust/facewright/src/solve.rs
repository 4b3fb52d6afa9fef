//! From tracks to refined poses and a cloud of skin points: the motion of the chosen frames.

use crate::FacewrightError;
use crate::motion::{LANDMARK_SIGMA_M, LANDMARK_SIGMA_RAD, SURFACE_SIGMA_M, threshold_px};
use crate::track::FaceTrack;
use geometry::{Camera, Mat3, Progress, Transform, Vec2, Vec3};
use head::fit::CloudPoint;
use motion::bundle::{FocalPrior, PointPrior};
use motion::sequence::{PointTrack, Sequence, SequenceOptions, Sighting, reconstruct_sequence};

/// A point in fewer frames tells no shape.
const LEAST_SEEN: usize = 3;

/// Poses and points in one frame, which is the head's as far as it was known.
#[derive(Clone, Debug)]
pub struct Structure {
    /// The camera, refined where that was asked for.
    pub camera: Camera,
    /// Pose of every chosen frame, `cam_from_cloud`; the one given where its points tell none.
    pub poses: Vec<Transform>,
    /// Points of the skin.
    pub cloud: Vec<CloudPoint>,
    /// Root mean square reprojection error per chosen frame, pixels; `None` without points.
    pub rms_px: Vec<Option<f64>>,
    /// Part of the observations that one motion of the head explains.
    pub agreement: f64,
}

/// Solves for poses and points. `poses` are the landmark fit's, one per chosen frame; `focal_sigma` is the relative standard
/// deviation of the focal length, 0 keeps it.
pub fn solve(
    tracks: &[FaceTrack],
    poses: &[Transform],
    camera: &Camera,
    focal_sigma: f64,
    progress: &Progress,
) -> Result<Structure, FacewrightError> {
    let sighting = |&(frame, pixel, sigma_px): &(usize, Vec2, f64)| Sighting { frame, pixel, sigma_px };
    let seen = |track: &FaceTrack| PointTrack { observations: track.observations.iter().map(sighting).collect() };
    let seen: Vec<PointTrack> = tracks.iter().map(seen).collect();
    let on_head = |(k, track): (usize, &FaceTrack)| PointPrior::near(k, track.point, SURFACE_SIGMA_M);
    let options = SequenceOptions {
        frames: poses.len(),
        initial_poses: Some(poses.iter().copied().map(Some).collect()),
        initial_sigma_rad: LANDMARK_SIGMA_RAD,
        initial_sigma_m: LANDMARK_SIGMA_M,
        threshold_px: threshold_px(poses, camera),
        key_frames: poses.len(),
        refine_focal: focal_sigma > 0.0,
        focal_prior: (focal_sigma > 0.0)
            .then_some(FocalPrior { focal_px: camera.fx, sigma_px: focal_sigma * camera.fx }),
        point_priors: tracks.iter().enumerate().map(on_head).collect(),
        ..SequenceOptions::default()
    };
    let motion = reconstruct_sequence(&seen, camera, &options, progress)?;
    let observations: usize = seen.iter().map(|track| track.observations.len()).sum();
    Ok(structure(motion, poses, observations))
}

fn structure(motion: Sequence, poses: &[Transform], observations: usize) -> Structure {
    let mut information = vec![Mat3::zeros(); motion.points.len()];
    let mut seen = vec![0_usize; motion.points.len()];
    for o in &motion.observations {
        let (Ok(pose), Some(point)) = (&motion.poses[o.frame], &motion.points[o.point]) else { continue };
        let Some((_, jacobian)) = motion.camera.project_with_jacobian(&pose.apply(point)) else { continue };
        let by_point = jacobian.point * pose.rotation.matrix() / o.sigma_px;
        information[o.point] += by_point.transpose() * by_point;
        seen[o.point] += 1;
    }
    // The trackers' own sigmas know nothing of what changes between frames: scale them to what the bundle found.
    let located = |(i, point): (usize, &Option<Vec3>)| {
        let covariance = information[i].try_inverse().filter(|_| seen[i] >= LEAST_SEEN)? * motion.report.excess;
        Some(CloudPoint { position: (*point)?, covariance })
    };
    Structure {
        camera: motion.camera,
        cloud: motion.points.iter().enumerate().filter_map(located).collect(),
        rms_px: motion.report.frames.iter().map(|fit| (fit.observations > 0).then_some(fit.rms_px)).collect(),
        agreement: motion.observations.len() as f64 / observations.max(1) as f64,
        poses: motion.poses.iter().zip(poses).map(|(found, given)| *found.as_ref().unwrap_or(given)).collect(),
    }
}
