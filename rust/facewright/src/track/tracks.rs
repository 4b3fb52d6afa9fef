//! `tracks.json`: the same points of a face in many frames.

use crate::formats::{self, Format, Schema, null_is_default};
use crate::reason::known_kind;
use crate::{FacewrightError, FrameSet, Method, ReasonKind, SourcedCamera};
use geometry::{Transform, Vec2};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What part of the face a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Region {
    /// Skin that follows the skull, as far as skin does.
    Skin,
    /// The lips and what touches them.
    Mouth,
    /// The lids.
    Eyes,
    /// The brows.
    Brows,
}

/// A place of the face in one frame; in files `[frame, u, v, sigma]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(usize, f64, f64, f64)", into = "(usize, f64, f64, f64)")]
pub struct PointObservation {
    /// Index of the frame.
    pub frame: usize,
    /// Where it is in the picture as filmed: x right, y down, pixel centres at integers.
    pub pixel: Vec2,
    /// One standard deviation along each axis, pixels.
    pub sigma_px: f64,
}

impl From<(usize, f64, f64, f64)> for PointObservation {
    fn from((frame, u, v, sigma_px): (usize, f64, f64, f64)) -> Self {
        Self { frame, pixel: Vec2::new(u, v), sigma_px }
    }
}

impl From<PointObservation> for (usize, f64, f64, f64) {
    fn from(seen: PointObservation) -> Self {
        (seen.frame, seen.pixel.x, seen.pixel.y, seen.sigma_px)
    }
}

/// Frames in which a point was not found; in files `[first, last, reason]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "(usize, usize, String)", into = "(usize, usize, String)")]
pub struct PointGap {
    /// Index of the first one.
    pub first: usize,
    /// Index of the last one.
    pub last: usize,
    /// Why.
    pub reason: String,
}

impl From<(usize, usize, String)> for PointGap {
    fn from((first, last, reason): (usize, usize, String)) -> Self {
        Self { first, last, reason }
    }
}

impl From<PointGap> for (usize, usize, String) {
    fn from(gap: PointGap) -> Self {
        (gap.first, gap.last, gap.reason)
    }
}

/// A place at which an artist disabled a point in one frame; in files `[frame, u, v]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(usize, f64, f64)", into = "(usize, f64, f64)")]
pub struct DisabledPoint {
    /// Index of the frame.
    pub frame: usize,
    /// Where it is in the picture as filmed: x right, y down, pixel centres at integers.
    pub pixel: Vec2,
}

impl From<(usize, f64, f64)> for DisabledPoint {
    fn from((frame, u, v): (usize, f64, f64)) -> Self {
        Self { frame, pixel: Vec2::new(u, v) }
    }
}

impl From<DisabledPoint> for (usize, f64, f64) {
    fn from(disabled: DisabledPoint) -> Self {
        (disabled.frame, disabled.pixel.x, disabled.pixel.y)
    }
}

/// One point of the face.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointTrack {
    /// Its number, unique among the tracks.
    pub id: usize,
    /// Index of the frame in which it was chosen.
    pub reference: usize,
    /// What it belongs to.
    pub region: Region,
    /// Where it is on the landmarks' head at rest, head frame, metres; the artist's own points have no place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f64; 3]>,
    /// Where it was found; ascending frames, the reference among them.
    pub observations: Vec<PointObservation>,
    /// The frames in which it was not found, and why.
    pub gaps: Vec<PointGap>,
}

/// One frame of the sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameTracks {
    /// File name without extension.
    pub name: String,
    /// Whether points were found in it.
    pub used: bool,
    /// What it shows, or why nothing was found.
    #[serde(default, deserialize_with = "null_is_default")]
    pub reason: String,
    /// The same as a word; `None` in older files, and where a newer one has a word that this version does not know.
    #[serde(default, deserialize_with = "known_kind", skip_serializing_if = "Option::is_none")]
    pub reason_kind: Option<ReasonKind>,
    /// Pose of the head by its landmarks; `null` where no face was found.
    pub cam_from_head: Option<Transform>,
    /// Points found.
    #[serde(default)]
    pub points: usize,
}

/// `tracks.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    /// Version of the file's fields.
    #[serde(default)]
    pub schema: Schema,
    /// Version of Facewright.
    pub version: String,
    /// How they were tracked.
    pub method: Method,
    /// The camera; its focal length is the landmarks' estimate unless it was calibrated.
    pub camera: SourcedCamera,
    /// Distance between the pupils of the landmarks' head, whose poses the frames have, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interocular: Option<f64>,
    /// Side of the tracker's window in the first reference frame, pixels.
    pub window: usize,
    /// Every frame given.
    pub frames: Vec<FrameTracks>,
    /// The points.
    pub tracks: Vec<PointTrack>,
    /// Where an artist disabled points, of tracks that are among these or gone: nothing near is measured in that frame.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub disabled: Vec<DisabledPoint>,
    /// What the artist should know.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

impl Tracks {
    /// Reads a `tracks.json`.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, or what it says cannot be.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        formats::read(path)
    }

    /// Reads the text of a `tracks.json`; errors as those of [`Tracks::read`].
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        formats::parse(text)
    }

    /// Writes a `tracks.json`, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), FacewrightError> {
        formats::write(path, self)
    }

    /// Says what cannot be in tracks that were put together by hand.
    ///
    /// # Errors
    /// [`FacewrightError::Tracks`].
    pub fn checked(self) -> Result<Self, FacewrightError> {
        self.validate().map_err(|reason| FacewrightError::Tracks { reason })?;
        Ok(self)
    }

    /// Refuses the tracks of other frames.
    pub(crate) fn check(&self, frames: &FrameSet) -> Result<(), FacewrightError> {
        let (camera, names) = (&self.camera.camera, self.frames.iter().map(|frame| &frame.name));
        frames.is_clip_of(names, (camera.width, camera.height)).map_err(|reason| FacewrightError::Tracks { reason })
    }
}
