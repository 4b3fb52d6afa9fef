//! A camera and where its numbers come from; the one to start with: calibrated, from EXIF, or guessed.

use crate::{FacewrightError, FrameSet};
use geometry::{Camera, Vec2};
use motion::bundle::{FocalPrior, LensPrior};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_SQRT_2;

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

/// What the focal length of a phone or a webcam is, in longer sides of the picture, and the deviation of its logarithm: webcams have 0.75 to
/// 1.1, phones that film 0.8 to 1.3, twice that with the longer lens; points soon outweigh it.
const FOCAL: (f64, f64) = (1.1, 0.35);
/// Standard deviation of the principal point of cameras about the middle of the picture, in longer sides.
const PRINCIPAL_POINT_SIGMA: f64 = 0.012;
/// The radial distortion `k1` of cameras, and its deviation: phones straighten what they film, a compact camera has 0.02, webcams −0.1 to
/// −0.25 (BoofCV's calibration sets), and hardly any lens bends the other way.
const DISTORTION: (f64, f64) = (-0.06, 0.1);

/// What is known of the focal length of any camera before anything moves.
pub(crate) fn usual_focal(camera: &Camera) -> FocalPrior {
    FocalPrior { focal_px: FOCAL.0 * longer(camera), log_sigma: FOCAL.1 }
}

/// What is known of a lens that nobody has calibrated.
pub(crate) fn lens_prior(sourced: &SourcedCamera) -> Option<LensPrior> {
    let camera = &sourced.camera;
    let middle = Camera::centred(camera.width, camera.height, camera.fx);
    (sourced.source != CameraSource::Board).then(|| LensPrior {
        principal_px: Vec2::new(middle.cx, middle.cy),
        principal_sigma_px: PRINCIPAL_POINT_SIGMA * longer(camera),
        k1: DISTORTION.0,
        k1_sigma: DISTORTION.1,
    })
}

/// The same camera, with the usual distortion where nobody has calibrated it.
pub(crate) fn usual_lens(sourced: SourcedCamera) -> SourcedCamera {
    match sourced.source {
        CameraSource::Exif | CameraSource::Estimated if sourced.camera.k1 == 0.0 => {
            SourcedCamera { camera: Camera { k1: DISTORTION.0, ..sourced.camera }, ..sourced }
        }
        _ => sourced,
    }
}

/// A focal length is mostly one that cameras usually have, and not one that the points found, where its logarithm's deviation is more than
/// this: the points alone tell it less well than [`FOCAL`] then.
pub(crate) const UNTOLD_SIGMA: f64 = FRAC_1_SQRT_2 * FOCAL.1;

/// Whether a refined focal length of this relative deviation is mostly what cameras usually have: so uncertain, and not where hardly any camera
/// has its own, to which points alone can have led it.
pub(crate) fn is_usual_focal(refined: &SourcedCamera, relative_sigma: f64) -> bool {
    let off = (refined.camera.fx / (FOCAL.0 * longer(&refined.camera))).ln();
    refined.source == CameraSource::Estimated && relative_sigma > UNTOLD_SIGMA && off.abs() <= 2.0 * FOCAL.1
}

/// Standard deviations, EXIF's and the points' together, beyond which the two contradict one another.
const CONTRADICTION: f64 = 3.0;

/// What is said of EXIF's focal length, that of `told`, where the head's motion found another one with its deviation, pixels.
pub(crate) fn contradicted_exif(told: &SourcedCamera, focal_px: f64, sigma_px: f64) -> Option<String> {
    let apart = (focal_px / told.camera.fx).ln().abs();
    let both = told.source.focal_sigma().hypot(sigma_px / focal_px);
    (told.source == CameraSource::Exif && apart > CONTRADICTION * both).then(|| {
        format!(
            "EXIF tells a focal length of about {:.0} px, and the head's turn one of {focal_px:.0} ± {sigma_px:.0} px, which was taken: calibrate \
             with a board for true proportions",
            told.camera.fx
        )
    })
}

/// What is said of a lens that nobody has calibrated and whose middle the points found elsewhere than the picture's.
pub(crate) fn part_of_picture(camera: &Camera) -> Option<String> {
    let middle = Camera::centred(camera.width, camera.height, camera.fx);
    let aside = Vec2::new(camera.cx - middle.cx, camera.cy - middle.cy);
    let part = |shift: f64, size: u32| 100.0 * shift.abs() / f64::from(size);
    (aside.norm() > 1e-6).then(|| {
        format!(
            "the head moves as if the middle of the lens were {:.0} % of the width and {:.0} % of the height away from the picture's middle: \
             the picture is a part of a larger one. That was solved for; for true proportions film the whole picture or calibrate with \
             a board",
            part(aside.x, camera.width),
            part(aside.y, camera.height)
        )
    })
}

fn longer(camera: &Camera) -> f64 {
    f64::from(camera.width.max(camera.height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_focal_length_far_from_what_cameras_have_was_found_however_uncertain() {
        let with = |focal: f64, source| SourcedCamera { camera: Camera::centred(1000, 600, focal), source };
        assert!(is_usual_focal(&with(1100.0, CameraSource::Estimated), 0.25));
        assert!(is_usual_focal(&with(600.0, CameraSource::Estimated), 0.25));
        assert!(!is_usual_focal(&with(1100.0, CameraSource::Estimated), 0.24));
        assert!(
            !is_usual_focal(&with(300.0, CameraSource::Estimated), 0.5),
            "as of a face in the middle of a large picture"
        );
        assert!(!is_usual_focal(&with(1100.0, CameraSource::Exif), 0.25));
    }

    #[test]
    fn exif_is_contradicted_beyond_three_deviations_of_both() {
        let told = |source| SourcedCamera { camera: Camera::centred(1000, 600, 1000.0), source };
        let said = contradicted_exif(&told(CameraSource::Exif), 500.0, 20.0).unwrap();
        assert!(said.contains("1000 px") && said.contains("500 ± 20 px") && said.contains("a board"), "{said}");
        assert!(
            contradicted_exif(&told(CameraSource::Exif), 1200.0, 24.0).is_some(),
            "0.18 from one another, 0.16 is three deviations"
        );
        assert_eq!(contradicted_exif(&told(CameraSource::Exif), 1150.0, 24.0), None);
        assert_eq!(contradicted_exif(&told(CameraSource::Exif), 500.0, 150.0), None, "the turn hardly tells it");
        assert_eq!(contradicted_exif(&told(CameraSource::Estimated), 500.0, 20.0), None);
    }

    #[test]
    fn a_part_of_a_picture_is_said_with_where_its_lens_is_and_a_whole_one_is_not() {
        let whole = Camera::centred(640, 480, 500.0);
        assert_eq!(part_of_picture(&whole), None);
        let said = part_of_picture(&Camera { cx: whole.cx + 128.0, cy: whole.cy - 48.0, ..whole }).unwrap();
        assert!(said.contains("20 % of the width and 10 % of the height") && said.contains("film the whole"), "{said}");
    }

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
