//! A whole sequence: from tracks to the pose of every frame and the place of every point.
//!
//! # Entry point
//! [`reconstruct_sequence`]: with initial poses (from a face fitted to landmarks) or without (from the best pair of frames);
//! then points from poses and poses from points in turn, and bundles over all.
//!
//! # Conventions
//! With initial poses the head frame is theirs, scale included. Without them it is the camera frame of one frame of the
//! initial pair, scaled to the distance in the options: [`geometry::Similarity`] moves it wherever it is wanted.

mod adjusting;
mod focal;
mod grow;
mod inflation;
mod key_frames;
mod lens;
mod start;

use crate::MotionError;
use crate::bundle::{BundleReport, FocalPrior, LensPrior, Observation, PointPrior};
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use grow::Reconstruction;

/// Where one point is seen in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Index of the frame.
    pub frame: usize,
    /// Where, pixels.
    pub pixel: Vec2,
    /// Standard deviation of each coordinate, pixels.
    pub sigma_px: f64,
}

/// One point followed through the frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointTrack {
    /// At most one sighting in a frame, in any order.
    pub observations: Vec<Sighting>,
}

/// How [`reconstruct_sequence`] works.
#[derive(Clone, Debug)]
pub struct SequenceOptions {
    /// Number of frames.
    pub frames: usize,
    /// Poses known to some extent, one entry for each frame.
    pub initial_poses: Option<Vec<Option<Transform>>>,
    /// Poses to begin with instead of these, one entry for each frame: what an earlier solution made of the same initial
    /// poses.
    pub start_poses: Option<Vec<Option<Transform>>>,
    /// Standard deviation of the initial rotations, radians.
    pub initial_sigma_rad: f64,
    /// Standard deviation of each coordinate of the initial translations, metres.
    pub initial_sigma_m: f64,
    /// Distance of a right observation from its projection at most, pixels.
    pub threshold_px: f64,
    /// Rays of a point must part by this angle before it counts, radians.
    pub min_parallax_rad: f64,
    /// Frames at most that points and focal length are solved from; the others are placed by what these give.
    pub key_frames: usize,
    /// Refine the focal length in the last bundles.
    pub refine_focal: bool,
    /// Find out how far the tracks determine a refined focal length, by a dozen further bundles.
    pub focal_sigma: bool,
    /// What is known of the focal length.
    pub focal_prior: Option<FocalPrior>,
    /// What is known of principal point and `k1` where the focal length is refined. They are kept, and what their deviations leave open
    /// counts in that of the focal length, unless the tracks contradict them.
    pub lens_prior: Option<LensPrior>,
    /// What is known of points; only sensible with initial poses, which define the head frame. `point` is the track.
    pub point_priors: Vec<PointPrior>,
    /// Distance of the head from the camera where no initial pose tells it, metres.
    pub distance_m: f64,
    /// Seed of all samples.
    pub seed: u64,
}

impl Default for SequenceOptions {
    /// No poses known; 1.5 px, 2° of parallax, 128 key frames, camera kept, head 0.6 m away.
    fn default() -> Self {
        Self {
            frames: 0,
            initial_poses: None,
            start_poses: None,
            initial_sigma_rad: 0.1,
            initial_sigma_m: 0.03,
            threshold_px: 1.5,
            min_parallax_rad: 0.035,
            key_frames: 128,
            refine_focal: false,
            focal_sigma: true,
            focal_prior: None,
            lens_prior: None,
            point_priors: Vec::new(),
            distance_m: 0.6,
            seed: 0,
        }
    }
}

/// A reconstructed sequence.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// Whether initial poses define the head frame and its scale: false without any, or if the tracks contradict them.
    pub anchored: bool,
    /// Whether the tracks contradict the principal point, as those of a part of a picture do: it and `k1` are refined then.
    pub is_lens_free: bool,
    /// The camera, its focal length refined if that was asked for.
    pub camera: Camera,
    /// `cam_from_head` of each frame, or why it has none.
    pub poses: Vec<Result<Transform, MotionError>>,
    /// The point of each track in the head frame; `None` where it could not be placed: wrong, seen from one side only, or
    /// on the background.
    pub points: Vec<Option<Vec3>>,
    /// The sightings that agree with poses and points; `point` is the track.
    pub observations: Vec<Observation>,
    /// Standard deviation of the focal length `fx`, pixels, if it was refined and that was asked for: by what the tracks and an unknown lens leave
    /// open, which is more than the last bundle says.
    pub focal_sigma_px: Option<f64>,
    /// The last bundle's report.
    pub report: BundleReport,
}

/// Times of the steps, in parts: points and poses to begin with, further key frames, the last bundles.
const PARTS: [f64; 3] = [20.0, 10.0, 70.0];

/// Poses and points from tracks.
///
/// Fails when no pair of frames can start, when tables do not fit together, or when the caller cancels. Frames that cannot be
/// placed say why in [`Sequence::poses`].
pub fn reconstruct_sequence(
    tracks: &[PointTrack],
    camera: &Camera,
    options: &SequenceOptions,
    progress: &Progress,
) -> Result<Sequence, MotionError> {
    check(tracks, options)?;
    progress.stage("motion")?;
    let [starting, growing, finishing] = progress.split(&PARTS);
    let mut reconstruction = Reconstruction::new(tracks, camera, options);
    let started = match &options.initial_poses {
        Some(initial) => {
            let poses = options.start_poses.as_ref().unwrap_or(initial);
            reconstruction.start_from_poses(poses, initial, &starting)?
        }
        None => false,
    };
    if !started {
        reconstruction.start_from_pair(&starting)?;
    }
    reconstruction.grow(&growing)?;
    reconstruction.finish(&finishing)
}

fn check(tracks: &[PointTrack], options: &SequenceOptions) -> Result<(), MotionError> {
    let count = options.frames;
    let tables = [&options.initial_poses, &options.start_poses].map(|poses| poses.as_ref().map(Vec::len));
    if let Some(index) = tables.into_iter().flatten().find(|length| *length != count) {
        return Err(MotionError::BadIndex {
            table: "table of initial poses or rotations",
            kind: "frame",
            index,
            count,
        });
    }
    for o in tracks.iter().flat_map(|track| &track.observations) {
        if o.frame >= count {
            return Err(MotionError::BadIndex { table: "track table", kind: "frame", index: o.frame, count });
        }
        if !(o.sigma_px > 0.0 && o.pixel.iter().all(|v| v.is_finite())) {
            return Err(MotionError::BadNumber {
                name: "a tracked pixel or its standard deviation",
                value: o.sigma_px,
            });
        }
    }
    if let Some(prior) = options.point_priors.iter().find(|prior| prior.point >= tracks.len()) {
        let (index, count) = (prior.point, tracks.len());
        return Err(MotionError::BadIndex { table: "table of point priors", kind: "track", index, count });
    }
    let numbers = [
        ("the threshold", options.threshold_px),
        ("the least parallax", options.min_parallax_rad),
        ("the distance of the head", options.distance_m),
        ("the number of key frames less one", options.key_frames as f64 - 1.0),
    ];
    match numbers.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
        Some((name, value)) => Err(MotionError::BadNumber { name, value }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
