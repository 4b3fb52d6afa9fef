//! What `motion.json` holds.

use crate::{FacewrightError, FrameSet, Method, Region, Scale, SourcedCamera};
use geometry::{Mat3, Transform, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameMotion {
    /// File name without extension.
    pub name: String,
    /// Whether the head could be placed in it.
    pub used: bool,
    /// What it rests on, or why there is no pose.
    pub reason: String,
    /// Pose of the head.
    pub cam_from_head: Option<Transform>,
    /// Standard deviation of the rotation, degrees, root of the sum over the axes.
    pub rotation_sigma_deg: Option<f64>,
    /// Standard deviation of the position at the head's middle, millimetres, root of the sum over the axes.
    pub translation_sigma_mm: Option<f64>,
    /// Root mean square distance of its points from where they are seen, pixels.
    pub reprojection_rms_px: Option<f64>,
    /// Points that agree with the pose.
    pub points: usize,
}

/// One point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointMotion {
    /// Number of its track.
    pub id: usize,
    /// Head frame, metres.
    pub position: [f64; 3],
    /// Standard deviation, millimetres, root mean square over the axes.
    pub sigma_mm: f64,
    /// Its covariance along the head's axes, mm²: xx, xy, xz, yy, yz, zz; missing in older files and of points that move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance_mm2: Option<[f64; 6]>,
    /// Frames that agree with it.
    pub frames: usize,
    /// Root mean square distance from where it is seen in them, pixels.
    pub reprojection_rms_px: f64,
    /// What it belongs to.
    pub region: Region,
    /// Whether it moves against the head, and took no part in the motion.
    pub moves: bool,
}

impl PointMotion {
    /// Its covariance along the head's axes, m²; the same in all directions where the file does not tell.
    pub fn covariance(&self) -> Mat3 {
        let Some([xx, xy, xz, yy, yz, zz]) = self.covariance_mm2 else {
            return Mat3::identity() * (self.sigma_mm / 1000.0).powi(2);
        };
        Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * 1e-6
    }

    /// Head frame, metres.
    pub fn position(&self) -> Vec3 {
        Vec3::from(self.position)
    }
}

/// How unsteady the motion is: median second differences over neighbouring frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Roughness {
    /// Of the rotation, degrees.
    pub rotation_deg: f64,
    /// Of the middle of the points, millimetres.
    pub translation_mm: f64,
}

/// `motion.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeadMotion {
    /// Version of Facewright.
    pub version: String,
    /// How it was solved.
    pub method: Method,
    /// The camera, its focal length refined unless it was calibrated.
    pub camera: SourcedCamera,
    /// Standard deviation of a refined focal length, pixels.
    pub focal_sigma_px: Option<f64>,
    /// Every frame of the tracks.
    pub frames: Vec<FrameMotion>,
    /// Every point that has a place.
    pub points: Vec<PointMotion>,
    /// Size.
    pub scale: Scale,
    /// Root mean square distance of points from where they are seen, pixels, over all that agree.
    pub reprojection_rms_px: f64,
    /// Part of the tracks' observations that one motion of the head explains, 0…1; 0 in files that do not tell.
    #[serde(default)]
    pub rigid_agreement: f64,
    /// Unsteadiness.
    pub roughness: Roughness,
    /// Seconds per stage.
    pub timings_s: BTreeMap<String, f64>,
    /// What the artist should know.
    pub warnings: Vec<String>,
}

impl HeadMotion {
    /// Refuses the motion of other frames.
    pub(crate) fn check(&self, frames: &FrameSet) -> Result<(), FacewrightError> {
        let (camera, names) = (&self.camera.camera, self.frames.iter().map(|frame| &frame.name));
        frames
            .is_clip_of(names, (camera.width, camera.height))
            .map_err(|reason| FacewrightError::OtherMotion { reason })
    }

    /// Makes the head and its way larger by a factor, which rests on what `scale` says.
    pub(super) fn resize(&mut self, factor: f64, scale: Scale) {
        for frame in &mut self.frames {
            frame.cam_from_head.iter_mut().for_each(|pose| pose.translation *= factor);
            frame.translation_sigma_mm.iter_mut().for_each(|sigma| *sigma *= factor);
        }
        for point in &mut self.points {
            point.position = (point.position() * factor).into();
            point.sigma_mm *= factor;
            point.covariance_mm2.iter_mut().flatten().for_each(|entry| *entry *= factor * factor);
        }
        self.roughness.translation_mm *= factor;
        self.scale = scale;
    }
}
