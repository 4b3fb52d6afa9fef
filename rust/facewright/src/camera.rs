//! A camera and where its numbers come from; the one to start with: calibrated, from EXIF, or guessed.

use crate::{FacewrightError, FrameSet};
use geometry::Camera;
use serde::{Deserialize, Serialize};

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
