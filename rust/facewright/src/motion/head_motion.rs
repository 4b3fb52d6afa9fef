//! What `motion.json` holds.

use crate::formats::{self, Format, Schema, at_least_0, finite, null_is_default, once};
use crate::reason::known_kind;
use crate::{FacewrightError, FrameSet, Method, ReasonKind, Region, Scale, SourcedCamera};
use geometry::{Mat3, Transform, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameMotion {
    /// File name without extension.
    pub name: String,
    /// Whether the head could be placed in it.
    pub used: bool,
    /// What it rests on, or why there is no pose.
    #[serde(default, deserialize_with = "null_is_default")]
    pub reason: String,
    /// The same as a word; `None` in older files, and where a newer one has a word that this version does not know.
    #[serde(default, deserialize_with = "known_kind", skip_serializing_if = "Option::is_none")]
    pub reason_kind: Option<ReasonKind>,
    /// Pose of the head.
    pub cam_from_head: Option<Transform>,
    /// Standard deviation of the rotation, degrees, root of the sum over the axes.
    pub rotation_sigma_deg: Option<f64>,
    /// Standard deviation of the position at the head's centre, millimetres, root of the sum over the axes.
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
    /// Of the points' centre, millimetres.
    pub translation_mm: f64,
}

/// `motion.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeadMotion {
    /// Version of the file's fields.
    #[serde(default)]
    pub schema: Schema,
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
    #[serde(default, skip_serializing_if = "is_untold")]
    pub rigid_agreement: f64,
    /// Unsteadiness.
    pub roughness: Roughness,
    /// Seconds per stage.
    #[serde(default)]
    pub timings_s: BTreeMap<String, f64>,
    /// What the artist should know.
    pub warnings: Vec<String>,
}

fn is_untold(agreement: &f64) -> bool {
    *agreement == 0.0
}

impl HeadMotion {
    /// Refuses the motion of other frames.
    pub(crate) fn check(&self, frames: &FrameSet) -> Result<(), FacewrightError> {
        let (camera, names) = (&self.camera.camera, self.frames.iter().map(|frame| &frame.name));
        frames
            .is_clip_of(names, (camera.width, camera.height))
            .map_err(|reason| FacewrightError::OtherMotion { reason })
    }

    /// Reads a `motion.json`.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, or what it says cannot be.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        formats::read(path)
    }

    /// Reads the text of a `motion.json`; errors as those of [`HeadMotion::read`].
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        formats::parse(text)
    }

    /// Writes a `motion.json`, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), FacewrightError> {
        formats::write(path, self)
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

impl Format for HeadMotion {
    const FILE: &'static str = "motion.json";
    const HOLDS: &'static str = "motion";
    const KEYS: &'static [&'static str] = &["frames", "scale", "roughness"];

    fn validate(&self) -> Result<(), String> {
        self.camera.camera.validate().map_err(|e| e.to_string())?;
        at_least_0(self.focal_sigma_px, || "its focal_sigma_px".to_owned())?;
        at_least_0(self.reprojection_rms_px, || "its reprojection_rms_px".to_owned())?;
        self.scale.validate()?;
        at_least_0(self.roughness.rotation_deg, || "the rotation_deg of its roughness".to_owned())?;
        at_least_0(self.roughness.translation_mm, || "the translation_mm of its roughness".to_owned())?;
        once(self.frames.iter().map(|frame| frame.name.as_str()), "frame")?;
        once(self.points.iter().map(|point| point.id), "point")?;
        self.frames.iter().try_for_each(FrameMotion::validate)?;
        self.points.iter().try_for_each(PointMotion::validate)?;
        let posed = self.frames.iter().any(|frame| frame.cam_from_head.is_some());
        if posed { Ok(()) } else { Err("none of its frames has a pose".to_owned()) }
    }
}

impl FrameMotion {
    fn validate(&self) -> Result<(), String> {
        let numbers = [
            ("rotation_sigma_deg", self.rotation_sigma_deg),
            ("translation_sigma_mm", self.translation_sigma_mm),
            ("reprojection_rms_px", self.reprojection_rms_px),
        ];
        numbers
            .into_iter()
            .try_for_each(|(key, value)| at_least_0(value, || format!("the {key} of frame {}", self.name)))
    }
}

impl PointMotion {
    fn validate(&self) -> Result<(), String> {
        let what = |key: &str| format!("the {key} of point {}", self.id);
        finite(&self.position, || what("position"))?;
        at_least_0(self.sigma_mm, || what("sigma_mm"))?;
        finite(self.covariance_mm2.as_ref().map_or(&[], |entries| &entries[..]), || what("covariance_mm2"))?;
        at_least_0(self.reprojection_rms_px, || what("reprojection_rms_px"))
    }
}
