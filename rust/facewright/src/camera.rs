//! A camera and where its numbers come from; the one to start with: calibrated, from EXIF, or guessed.

use crate::{FacewrightError, FrameSet};
use geometry::{Camera, Vec2};
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

/// No lens puts a corner of its picture this many times as far from the middle as it were without distortion: those made for cameras
/// stretch by some hundredths.
const MOST_STRETCH: f64 = 2.0;

/// Refuses a lens of which a part of the picture's middle row or column shows nothing, or that stretches beyond reason. What is beyond
/// the fold of a wide lens in the corners is not seen, and does no harm.
pub(crate) fn check_lens(camera: &Camera) -> Result<(), FacewrightError> {
    let (right, bottom) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
    let middles = [[0.0, camera.cy], [right, camera.cy], [camera.cx, 0.0], [camera.cx, bottom]];
    if middles.iter().any(|pixel| camera.try_normalise(&Vec2::from(*pixel)).is_none()) {
        return Err(FacewrightError::Lens { what: "folds the picture over before it reaches its edges".to_owned() });
    }
    let corners = [[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]];
    let stretch = |corner: &[f64; 2]| {
        let pinhole = Vec2::new((corner[0] - camera.cx) / camera.fx, (corner[1] - camera.cy) / camera.fy);
        Some(pinhole.norm() / camera.try_normalise(&Vec2::from(*corner))?.norm())
    };
    match corners.iter().filter_map(stretch).find(|stretch| *stretch > MOST_STRETCH) {
        Some(stretch) => Err(FacewrightError::Lens {
            what: format!(
                "puts a corner of the picture {stretch:.1} times as far from its middle as it were without distortion"
            ),
        }),
        None => Ok(()),
    }
}

/// The camera of a clip: the calibrated one if it fits the frames, otherwise EXIF's focal length or the usual one.
pub fn starting_camera(
    frames: &FrameSet,
    calibrated: Option<&SourcedCamera>,
) -> Result<SourcedCamera, FacewrightError> {
    let (width, height) = (frames.width, frames.height);
    if let Some(known) = calibrated {
        known.camera.validate()?;
        check_lens(&known.camera)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_that_no_camera_has_is_refused_and_wide_ones_are_not() {
        let said = |k1: f64, k2: f64| {
            let camera = Camera { k1, k2, ..Camera::centred(640, 480, 500.0) };
            check_lens(&camera).map_or_else(|error| error.to_string(), |()| String::new())
        };
        assert!(said(1e6, 0.0).contains("times as far from its middle"), "{}", said(1e6, 0.0));
        assert!(said(-1e6, 0.0).contains("folds the picture over"), "{}", said(-1e6, 0.0));
        assert!(said(-2.0, 0.0).contains("folds"));
        // As of a wide lens: 30 % towards the middle in the corners, 10 % away from it, and one that folds in the corners alone.
        for (k1, k2) in [(0.0, 0.0), (-0.35, 0.12), (0.2, 0.0), (-0.35, 0.0)] {
            assert_eq!(said(k1, k2), "", "{k1} {k2}");
        }
        let corner = Camera { k1: -0.35, ..Camera::centred(640, 480, 500.0) };
        assert!(corner.try_normalise(&Vec2::new(0.0, 0.0)).is_none());
    }
}
