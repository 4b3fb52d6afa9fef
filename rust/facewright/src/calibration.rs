//! A camera from pictures of a board.

use crate::{CameraSource, FacewrightError, FrameSet, SourcedCamera};
use geometry::{Board, Progress, Vec2};
use image::imageops;
use motion::calibrate::{Calibration, CameraDeviations};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};
use vision::board::{BoardCorners, BoardError, BoardOptions, detect};

/// The board that was filmed.
#[derive(Clone, Copy, Debug)]
pub struct CalibrateOptions {
    /// Inner corners: columns, rows.
    pub inner: (u32, u32),
    /// Side of a square, metres.
    pub square: f64,
}

impl Default for CalibrateOptions {
    /// The paper's board.
    fn default() -> Self {
        Self { inner: (9, 6), square: 0.0255 }
    }
}

/// What became of one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoardImage {
    /// File name without extension.
    pub name: String,
    /// Whether the board was found.
    pub found: bool,
    /// Why not.
    pub reason: Option<String>,
    /// Root mean square reprojection error of its corners, pixels.
    pub rms_px: Option<f64>,
    /// Largest error of a corner, pixels.
    pub worst_px: Option<f64>,
    /// The same with a camera calibrated without this picture.
    pub hold_out_rms_px: Option<f64>,
    /// Pose of the board, four rows.
    pub cam_from_board: Option<geometry::Transform>,
}

/// `camera.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibratedCamera {
    /// The camera.
    #[serde(flatten)]
    pub camera: SourcedCamera,
    /// Root mean square reprojection error of all corners, pixels.
    pub rms_px: f64,
    /// The same of corners in pictures that were left out.
    pub hold_out_rms_px: Option<f64>,
    /// Standard deviations.
    pub deviations: CameraDeviations,
    /// Each picture.
    pub images: Vec<BoardImage>,
    /// What to photograph next, and what to distrust.
    pub warnings: Vec<String>,
}

type Detection = Result<BoardCorners, BoardError>;

/// Calibrates a camera by Zhang's method from pictures of a checkerboard.
pub fn calibrate(
    pictures: &FrameSet,
    options: &CalibrateOptions,
    progress: &Progress,
) -> Result<CalibratedCamera, FacewrightError> {
    if !(options.square > 0.0 && options.square.is_finite()) {
        return Err(FacewrightError::Option { name: "the board's square", expected: "longer than 0 mm" });
    }
    let detections = detect_all(pictures, options, progress)?;
    let views: Vec<Vec<Vec2>> =
        detections.iter().flatten().map(|board| board.corners.iter().map(|c| c.position).collect()).collect();
    if views.len() < 3 {
        let hint = detections.iter().find_map(|d| d.as_ref().err()).map_or(String::new(), ToString::to_string);
        return Err(FacewrightError::TooFewBoards { found: views.len(), pictures: pictures.len(), hint });
    }
    progress.stage("calibrate")?;
    let solved = motion::calibrate::calibrate(
        &views,
        &board_points(options),
        pictures.width,
        pictures.height,
        &motion::calibrate::CalibrateOptions::default(),
    )?;
    Ok(report(pictures, &detections, &solved))
}

fn detect_all(
    pictures: &FrameSet,
    options: &CalibrateOptions,
    progress: &Progress,
) -> Result<Vec<Detection>, FacewrightError> {
    progress.stage("boards")?;
    let done = AtomicUsize::new(0);
    let board = Board::checkerboard(options.inner.0, options.inner.1, options.square);
    let look = |i: usize| -> Result<Detection, FacewrightError> {
        progress.step(done.fetch_add(1, Ordering::Relaxed), pictures.len())?;
        Ok(detect(&imageops::grayscale(&pictures.load(i)?), &[board], &BoardOptions::default()))
    };
    (0..pictures.len()).into_par_iter().map(look).collect()
}

/// Corners in the board's plane, row by row, metres.
fn board_points(options: &CalibrateOptions) -> Vec<Vec2> {
    let (columns, rows) = options.inner;
    let corner = |i: u32, j: u32| Vec2::new(f64::from(i), f64::from(j)) * options.square;
    (0..rows).flat_map(|j| (0..columns).map(move |i| corner(i, j))).collect()
}

fn report(pictures: &FrameSet, detections: &[Detection], solved: &Calibration) -> CalibratedCamera {
    let mut fits = solved.views.iter();
    let image = |(frame, detection): (&crate::Frame, &Detection)| {
        let fit = detection.as_ref().ok().and_then(|_| fits.next());
        BoardImage {
            name: frame.name.clone(),
            found: detection.is_ok(),
            reason: detection.as_ref().err().map(ToString::to_string),
            rms_px: fit.map(|f| f.rms_px),
            worst_px: fit.map(|f| f.worst_px),
            hold_out_rms_px: fit.and_then(|f| f.hold_out_rms_px),
            cam_from_board: fit.map(|f| f.cam_from_board),
        }
    };
    CalibratedCamera {
        camera: SourcedCamera { camera: solved.camera, source: CameraSource::Board },
        rms_px: solved.rms_px,
        hold_out_rms_px: solved.hold_out_rms_px,
        deviations: solved.deviations,
        images: pictures.frames.iter().zip(detections).map(image).collect(),
        warnings: solved.warnings.iter().map(ToString::to_string).collect(),
    }
}
