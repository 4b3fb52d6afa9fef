//! A head that several cameras saw at the same moments, their places being known: one pose for each moment, in metres.
//!
//! # Entry point
//! [`reconstruct_rig`]: points that two cameras saw at one moment are where their rays meet, and place a rough model of the head at that
//! moment; then points from poses and poses from points in turn, as far as the cameras' places may be off.
//!
//! # Conventions
//! Frames are those of the first camera in the order of the moments, then those of the second, and so on; all have the intrinsics of
//! one camera. The rig's frame is where `camera_from_rig` leads from; the head frame is that of the model, in metres.
//!
//! Source: Triggs et al. 2000, *Bundle Adjustment: A Modern Synthesis*, for `adjust`.

mod adjust;
mod equations;
mod finish;
mod start;

use crate::MotionError;
use crate::bundle::Observation;
use crate::sequence::{PointTrack, Sequence};
use crate::triangulate::triangulate_robust;
use adjust::{Seen, State};
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use nalgebra::Matrix6;
use rayon::prelude::*;

/// Poses from the model are off by several pixels: the first points are sought with the threshold widened by these factors.
const WIDENING: [f64; 4] = [8.0, 4.0, 2.0, 1.0];
/// Steps of each adjustment.
const STEPS: usize = 8;
/// Observations farther off than this many robust standard deviations are rejected before the last one.
const REJECTION: f64 = 4.0;

/// Where a camera of a rig stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its place as calibrated.
    pub camera_from_rig: Transform,
    /// Covariance of a [`Transform::retract`] step from there to its true place; zero where it is exact.
    pub covariance: Matrix6<f64>,
}

/// What is known of a rig's films, and how [`reconstruct_rig`] works.
#[derive(Clone, Debug)]
pub struct RigOptions {
    /// Each camera's place.
    pub places: Vec<Place>,
    /// Frames of each camera.
    pub moments: usize,
    /// `cam_from_head` of the model in each frame, where it is known to some extent, in the model's unit.
    pub initial_poses: Vec<Option<Transform>>,
    /// Where each track is on the model, in the model's unit.
    pub model: Vec<Option<Vec3>>,
    /// Distance of a right observation from its projection at most, pixels.
    pub threshold_px: f64,
    /// Rays of a point must part by this angle before it counts, radians.
    pub min_parallax_rad: f64,
    /// Moments at most that points are solved from; the others are placed by what these give.
    pub key_moments: usize,
}

/// A reconstructed head.
#[derive(Clone, Debug)]
pub struct RigSequence {
    /// Poses of all frames, points and how they fit; metres.
    pub sequence: Sequence,
    /// Relative standard deviation of the size: by the uncertainty of the cameras' poses, and by the tracker's.
    pub size_sigma: f64,
}

/// Poses and points from tracks.
///
/// # Errors
/// [`MotionError::FewShared`] where hardly a point was seen by two cameras at one moment; [`MotionError::BadIndex`] where tables do not
/// fit together; the caller's cancellation. Frames that cannot be placed say why in [`Sequence::poses`].
pub fn reconstruct_rig(
    tracks: &[PointTrack],
    camera: &Camera,
    options: &RigOptions,
    progress: &Progress,
) -> Result<RigSequence, MotionError> {
    check(tracks, options)?;
    progress.stage("motion")?;
    let mut rig = Rig::new(tracks, camera, options);
    rig.start()?;
    for (round, widening) in WIDENING.into_iter().enumerate() {
        progress.step(round, WIDENING.len() + 2)?;
        rig.triangulate_all(widening);
        rig.adjust(&rig.observations(widening, true), STEPS);
    }
    rig.finish(progress)
}

fn check(tracks: &[PointTrack], options: &RigOptions) -> Result<(), MotionError> {
    let count = options.places.len() * options.moments;
    let bad = |table, kind, index, count| Err(MotionError::BadIndex { table, kind, index, count });
    if options.initial_poses.len() != count {
        return bad("table of initial poses", "frame", options.initial_poses.len(), count);
    }
    if options.model.len() != tracks.len() {
        return bad("table of the model's points", "track", options.model.len(), tracks.len());
    }
    for o in tracks.iter().flat_map(|track| &track.observations) {
        if o.frame >= count {
            return bad("track table", "frame", o.frame, count);
        }
        if !(o.sigma_px > 0.0 && o.pixel.iter().all(|v| v.is_finite())) {
            return Err(MotionError::BadNumber {
                name: "a tracked pixel or its standard deviation",
                value: o.sigma_px,
            });
        }
    }
    Ok(())
}

/// A sighting, with its undistorted coordinates.
#[derive(Clone, Copy)]
struct Sight {
    frame: usize,
    normalised: Vec2,
    pixel: Vec2,
    sigma_px: f64,
}

/// What is known so far.
struct Rig<'a> {
    options: &'a RigOptions,
    camera: Camera,
    /// Sightings of each track, by frame.
    sights: Vec<Vec<Sight>>,
    /// Moments that the points are solved from.
    key: Vec<bool>,
    /// `camera_from_rig` of each camera.
    places: Vec<Transform>,
    /// `rig_from_head` of each moment.
    poses: Vec<Option<Transform>>,
    points: Vec<Option<Vec3>>,
}

impl<'a> Rig<'a> {
    fn new(tracks: &[PointTrack], camera: &Camera, options: &'a RigOptions) -> Self {
        let sights = |track: &PointTrack| {
            let sight = |o: &crate::sequence::Sighting| Sight {
                frame: o.frame,
                normalised: camera.normalise(&o.pixel),
                pixel: o.pixel,
                sigma_px: o.sigma_px,
            };
            let mut sights: Vec<Sight> = track.observations.iter().map(sight).collect();
            sights.sort_by_key(|sight| sight.frame);
            sights
        };
        let step = options.moments.div_ceil(options.key_moments.max(1)).max(1);
        Self {
            options,
            camera: *camera,
            sights: tracks.iter().map(sights).collect(),
            key: (0..options.moments).map(|moment| moment % step == 0).collect(),
            places: options.places.iter().map(|place| place.camera_from_rig).collect(),
            poses: vec![None; options.moments],
            points: vec![None; tracks.len()],
        }
    }

    fn moment(&self, frame: usize) -> usize {
        frame % self.options.moments
    }

    fn place(&self, frame: usize) -> Transform {
        self.places[frame / self.options.moments]
    }

    /// `cam_from_head` of a frame.
    fn pose(&self, frame: usize) -> Option<Transform> {
        Some(self.place(frame) * self.poses[self.moment(frame)]?)
    }

    /// The threshold in normalised units.
    fn threshold(&self) -> f64 {
        self.options.threshold_px / self.camera.fx
    }

    /// Places every track anew from all moments that the structure is solved from.
    fn triangulate_all(&mut self, widening: f64) {
        let threshold = widening * self.threshold();
        let locate = |sights: &Vec<Sight>| {
            let keys = sights.iter().filter(|s| self.key[self.moment(s.frame)]);
            let rays: Vec<(Transform, Vec2)> = keys.filter_map(|s| Some((self.pose(s.frame)?, s.normalised))).collect();
            let (found, _) = triangulate_robust(&rays, threshold)?;
            (found.angle_rad >= self.options.min_parallax_rad).then_some(found.point)
        };
        self.points = self.sights.par_iter().map(locate).collect();
    }

    /// Distance of a point from where a frame sees it, pixels; infinite where there is none.
    fn distance_px(&self, track: usize, sight: &Sight) -> f64 {
        let at = self.points[track].zip(self.pose(sight.frame));
        let at = at.and_then(|(point, pose)| self.camera.project(&pose.apply(&point)));
        at.map_or(f64::INFINITY, |at| (at - sight.pixel).norm())
    }

    /// Observations within the widened threshold of their points, of the moments that the structure is solved from or of all.
    fn observations(&self, widening: f64, of_keys: bool) -> Vec<Observation> {
        let limit = widening * self.options.threshold_px;
        let mut kept = Vec::new();
        for (point, sights) in self.sights.iter().enumerate() {
            let near = sights.iter().filter(|s| !of_keys || self.key[self.moment(s.frame)]);
            let near = near.filter(|s| self.distance_px(point, s) < limit);
            let first = kept.len();
            kept.extend(near.map(|s| Observation { frame: s.frame, point, pixel: s.pixel, sigma_px: s.sigma_px }));
            if kept.len() < first + 2 {
                kept.truncate(first);
            }
        }
        kept
    }

    /// Lets everything fit the observations; the covariance of each camera's pose, and the variance inflation.
    fn adjust(&mut self, observations: &[Observation], steps: usize) -> adjust::Adjusted {
        let seen = |o: &Observation| Seen {
            moment: self.moment(o.frame),
            camera: o.frame / self.options.moments,
            point: o.point,
            pixel: o.pixel,
            sigma_px: o.sigma_px,
        };
        let seen: Vec<Seen> = observations.iter().map(seen).collect();
        let mut state = State {
            places: self.places.clone(),
            poses: self.poses.iter().map(|pose| pose.unwrap_or_else(Transform::identity)).collect(),
            points: self.points.iter().map(|point| point.unwrap_or_else(Vec3::zeros)).collect(),
        };
        let adjusted = adjust::adjust(&mut state, &seen, &self.camera, &self.options.places, steps);
        self.places = state.places;
        self.poses.iter_mut().zip(state.poses).for_each(|(pose, found)| *pose = pose.map(|_| found));
        self.points.iter_mut().zip(state.points).for_each(|(point, found)| *point = point.map(|_| found));
        adjusted
    }
}

#[cfg(test)]
mod tests;
