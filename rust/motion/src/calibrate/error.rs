//! Why there is no camera, and the checks on what a calibration is given.

use super::{BoardView, CalibrateOptions, homography};
use geometry::{Mat3, Vec2};

/// A picture with fewer corners hardly says more than its own pose.
const MIN_CORNERS: usize = 6;
/// Fewer pictures do not determine a camera.
const MIN_VIEWS: usize = 3;

/// Why there is no camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// Fewer than three pictures.
    #[error("calibration needs at least three pictures of the board, tilted differently; {views} were usable")]
    TooFewViews {
        /// Their number.
        views: usize,
    },
    /// Options or picture size that make no sense.
    #[error("calibration can't work with {what}")]
    InvalidInput {
        /// What is wrong.
        what: &'static str,
    },
    /// A picture without a corner for each board point.
    #[error("picture {} has {found} corners, the board has {expected}", .view + 1)]
    CornerCount {
        /// Its index.
        view: usize,
        /// Corners found.
        found: usize,
        /// Points of the board.
        expected: usize,
    },
    /// A picture that shows too little of the board.
    #[error("picture {} shows {found} corners of the board and {needed} are needed: leave it out", .view + 1)]
    TooFewCorners {
        /// Its index.
        view: usize,
        /// Corners seen.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// A picture whose corners are no picture of a plane.
    #[error("the corners of picture {} lie on a line or are not finite: leave it out", .view + 1)]
    FlatView {
        /// Its index.
        view: usize,
    },
    /// The pictures are alike.
    #[error("the pictures do not determine the focal length: tilt the board by 30° or more to different sides")]
    Degenerate,
    /// Corners and board do not belong together.
    #[error(
        "no camera explains the corners ({rms_px:.1} px left): check the number of corners and that the board is flat"
    )]
    NoCamera {
        /// Root mean square distance, pixels.
        rms_px: f64,
    },
}

impl CalibrateError {
    /// The same with another numbering of the pictures.
    pub(super) fn renumbered(self, number: impl Fn(usize) -> usize) -> Self {
        match self {
            Self::CornerCount { view, found, expected } => Self::CornerCount { view: number(view), found, expected },
            Self::TooFewCorners { view, found, needed } => Self::TooFewCorners { view: number(view), found, needed },
            Self::FlatView { view } => Self::FlatView { view: number(view) },
            other => other,
        }
    }
}

/// The homography of each picture, once everything given makes sense.
pub(super) fn checked_homographies(
    views: &[BoardView],
    width: u32,
    height: u32,
    options: &CalibrateOptions,
) -> Result<Vec<Mat3>, CalibrateError> {
    if width == 0 || height == 0 {
        return Err(CalibrateError::InvalidInput { what: "pictures without pixels" });
    }
    if options.distortion_terms > 3 {
        return Err(CalibrateError::InvalidInput { what: "more than three distortion terms" });
    }
    if views.len() < MIN_VIEWS {
        return Err(CalibrateError::TooFewViews { views: views.len() });
    }
    views.iter().enumerate().map(|(k, view)| checked_homography(k, view)).collect()
}

pub(super) fn checked_homography(view: usize, seen: &BoardView) -> Result<Mat3, CalibrateError> {
    let (expected, found) = (seen.points.len(), seen.pixels.len());
    if found != expected {
        return Err(CalibrateError::CornerCount { view, found, expected });
    }
    if found < MIN_CORNERS {
        return Err(CalibrateError::TooFewCorners { view, found, needed: MIN_CORNERS });
    }
    let finite = |points: &[Vec2]| points.iter().all(|p| p.iter().all(|v| v.is_finite()));
    let usable = finite(&seen.points) && finite(&seen.pixels);
    let found = if usable { homography::fit(&seen.points, &seen.pixels) } else { None };
    found.ok_or(CalibrateError::FlatView { view })
}
