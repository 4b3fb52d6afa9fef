//! A camera and where its numbers come from; the one to start with: calibrated, from EXIF, or guessed.

use crate::{FacewrightError, FrameSet};
use geometry::Camera;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Where the camera's numbers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CameraSource {
    /// Calibrated with a board.
    Board,
    /// Focal length from EXIF, refined.
    Exif,
    /// Focal length guessed from the usual field of view, refined: the head's depth is uncertain with it.
    Estimated,
}

/// The camera and where it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourcedCamera {
    /// The numbers.
    #[serde(flatten)]
    pub camera: Camera,
    /// Their origin.
    #[serde(default = "board")]
    pub source: CameraSource,
}

fn board() -> CameraSource {
    CameraSource::Board
}

impl SourcedCamera {
    /// Reads a `camera.json`.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        let read = |reason: String| FacewrightError::Read { path: path.to_owned(), reason };
        Self::parse(&std::fs::read_to_string(path).map_err(|e| read(e.to_string()))?).map_err(|e| match e {
            FacewrightError::Read { reason, .. } => read(reason),
            other => other,
        })
    }

    /// Reads the text of a `camera.json`: the camera itself, or an object that holds it as `camera`.
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        let read = |e: serde_json::Error| FacewrightError::Read { path: "camera.json".into(), reason: e.to_string() };
        let value: serde_json::Value = serde_json::from_str(text).map_err(read)?;
        let inner = value.get("camera").cloned().unwrap_or(value);
        let camera: Self = serde_json::from_value(inner).map_err(read)?;
        camera.camera.validate()?;
        Ok(camera)
    }
}

/// Focal length of webcams and phones filming video, in picture widths: 62° across, give or take.
const USUAL_FOCAL: f64 = 0.85;

/// The camera of a clip: the calibrated one if it fits the frames, otherwise EXIF's focal length or the usual one.
pub fn starting_camera(
    frames: &FrameSet,
    calibrated: Option<&SourcedCamera>,
) -> Result<SourcedCamera, FacewrightError> {
    let (width, height) = (frames.width, frames.height);
    if let Some(known) = calibrated {
        known.camera.validate()?;
        let (camera_width, camera_height) = (known.camera.width, known.camera.height);
        if (camera_width, camera_height) != (width, height) {
            return Err(FacewrightError::OtherCamera { camera_width, camera_height, width, height });
        }
        return Ok(*known);
    }
    let (focal, source) = match frames.exif_focal {
        Some(focal) => (focal, CameraSource::Exif),
        None => (USUAL_FOCAL * f64::from(width.max(height)), CameraSource::Estimated),
    };
    Ok(SourcedCamera { camera: Camera::centred(width, height, focal), source })
}

impl CameraSource {
    /// Relative standard deviation of a focal length from this source; 0 for one that is not to be refined.
    pub fn focal_sigma(self) -> f64 {
        match self {
            Self::Board => 0.0,
            Self::Exif => 0.05,
            Self::Estimated => 0.15,
        }
    }
}
