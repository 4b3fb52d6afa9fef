//! Cameras from pictures of a board.
//!
//! # Entry points
//! - [`calibrate`]: one camera; [`calibrate_rig`]: several at once, and where they stand.
//!
//! # How
//! The board is looked for in every picture ([`detection`]); of a film, pictures that differ are taken ([`choice`]); the
//! camera is `motion::calibrate`'s.

mod board;
mod camera_file;
mod choice;
mod detection;
mod misfit;
mod near_copies;
mod other_cameras;
mod rig;
mod undistort;
mod valid;

pub use board::{BoardOptions, Grid};
pub use camera_file::CameraFile;
pub use rig::{CalibratedRig, MountedCamera, RigInput, calibrate_rig};
pub use undistort::{Keep, UndistortOptions, undistort};

use crate::{CameraSource, FacewrightError, FrameSet, Schema, SourcedCamera};
use clap::{Args, ValueEnum};
use detection::Detection;
use geometry::{Board, Progress, Transform};
use motion::calibrate::{BoardBend, BoardView, CalibrateWarning, Calibration, CameraDeviations, ViewFit};
use serde::{Deserialize, Serialize};

/// Times of the steps of a calibration, in parts: boards are looked for, the camera is solved for.
const PARTS: [f64; 2] = [0.7, 0.3];

/// Whether to solve for a bend of the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Bend {
    /// Assume a flat board, and warn of a clear bend
    Never,
    /// If it predicts every held-out picture better
    #[default]
    Judged,
    /// In every case
    Always,
}

/// The board that was filmed, and the model of the lens.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct CalibrateOptions {
    /// The board.
    #[command(flatten)]
    #[serde(flatten)]
    pub board: BoardOptions,
    /// Radial distortion terms, 0 to 3
    #[arg(long, default_value_t = Self::default().distortion_terms, value_parser = clap::value_parser!(u8).range(0..=3))]
    pub distortion_terms: u8,
    /// Also solve for tangential distortion
    #[arg(long)]
    pub tangential: bool,
    /// One focal length for both directions
    #[arg(long)]
    pub square_pixels: bool,
    /// When to solve for a board that is not flat; for a rig only with `always`
    #[arg(long, value_enum, default_value_t)]
    pub bend: Bend,
}

impl Default for CalibrateOptions {
    /// The paper's board and lens.
    fn default() -> Self {
        Self {
            board: BoardOptions::default(),
            distortion_terms: 2,
            tangential: false,
            square_pixels: false,
            bend: Bend::default(),
        }
    }
}

impl CalibrateOptions {
    /// Refuses what cannot be.
    ///
    /// # Errors
    /// [`FacewrightError::Option`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        self.board.validate()?;
        if self.distortion_terms > 3 {
            return Err(FacewrightError::Option { name: "the number of distortion terms", expected: "0 to 3" });
        }
        Ok(())
    }

    fn model(&self) -> motion::calibrate::CalibrateOptions {
        let Self { square_pixels, tangential, .. } = *self;
        let (distortion_terms, bend) = (usize::from(self.distortion_terms), self.bend == Bend::Always);
        motion::calibrate::CalibrateOptions { square_pixels, distortion_terms, tangential, bend, ..Default::default() }
    }
}

/// A corner of the board: its number row by row, where it was seen and by how much the camera puts it elsewhere (seen less
/// projected), pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenCorner(pub usize, pub [f64; 2], pub [f64; 2]);

/// What became of one picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoardImage {
    /// File name without extension.
    pub name: String,
    /// Whether the board was found.
    pub found: bool,
    /// Whether the camera was calibrated from it.
    pub used: bool,
    /// Why not.
    pub reason: Option<String>,
    /// Which of the boards it shows.
    pub board: Option<usize>,
    /// Root mean square reprojection error of its corners, pixels.
    pub rms_px: Option<f64>,
    /// Largest error of a corner, pixels.
    pub worst_px: Option<f64>,
    /// The same as `rms_px` with a camera calibrated without this picture.
    pub hold_out_rms_px: Option<f64>,
    /// Pose of the board, four rows.
    pub cam_from_board: Option<Transform>,
    /// Its corners, where it was used.
    #[serde(default)]
    pub corners: Vec<SeenCorner>,
}

/// `camera.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibratedCamera {
    /// Version of the file's fields.
    #[serde(default)]
    pub schema: Schema,
    /// The camera.
    #[serde(flatten)]
    pub camera: SourcedCamera,
    /// Root mean square reprojection error of all corners, pixels.
    pub rms_px: f64,
    /// The same of corners in pictures that were left out.
    pub hold_out_rms_px: Option<f64>,
    /// Standard deviations.
    #[serde(default)]
    pub deviations: CameraDeviations,
    /// How far the board is from flat, where the pictures tell.
    pub bend: Option<BoardBend>,
    /// The boards looked for.
    #[serde(default)]
    pub boards: Vec<Board>,
    /// Each picture.
    #[serde(default)]
    pub images: Vec<BoardImage>,
    /// What to photograph next, and what to distrust.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// Calibrates a camera by Zhang's method from pictures of a board.
///
/// # Examples
/// ```no_run
/// use facewright::{BoardOptions, CalibrateOptions, FrameSet, calibrate, write_json};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let pictures = FrameSet::open(&["boards".into()], &progress)?;
/// let board = BoardOptions { inner: vec![(9, 6).into()], square_mm: 25.5, ..BoardOptions::default() };
/// let camera = calibrate(&pictures, &CalibrateOptions { board, ..CalibrateOptions::default() }, &progress)?;
/// println!("reprojection error {:.3} px", camera.rms_px);
/// write_json(Path::new("camera.json"), &camera)?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn calibrate(
    pictures: &FrameSet,
    options: &CalibrateOptions,
    progress: &Progress,
) -> Result<CalibratedCamera, FacewrightError> {
    options.validate()?;
    let boards = options.board.boards();
    let [looking, solving] = progress.split(&PARTS);
    let detections = detection::detect_all(pictures, &boards, &looking)?;
    let used = choice::choose(&detections, &boards, (pictures.width, pictures.height));
    let views: Vec<BoardView> = used.iter().filter_map(|&i| view(&detections[i], &boards)).collect();
    if views.len() < 3 {
        let hint = detections.iter().find_map(|d| d.as_ref().err()).map_or(String::new(), ToString::to_string);
        return Err(FacewrightError::TooFewBoards { found: views.len(), pictures: pictures.len(), hint });
    }
    solving.stage("calibrate")?;
    let shown = |i: &usize| detections[*i].as_ref().ok().map(|found| found.board);
    let one_board = used.windows(2).all(|pair| shown(&pair[0]) == shown(&pair[1]));
    let (mut solved, allowed_for) = solve(&views, pictures, options, one_board)?;
    near_copies::discount(&mut solved, &views);
    let mut images = images(pictures, &detections);
    for (&i, fit) in used.iter().zip(&solved.views) {
        fill(&mut images[i], &detections[i], fit);
    }
    let name = |k: usize| pictures.frames[used[k]].name.as_str();
    Ok(CalibratedCamera {
        schema: Schema,
        camera: SourcedCamera { camera: solved.camera, source: CameraSource::Board },
        rms_px: solved.rms_px,
        hold_out_rms_px: solved.hold_out_rms_px,
        deviations: solved.deviations,
        bend: solved.bend,
        boards,
        images,
        warnings: solved.warnings.iter().map(|w| sentence(w, name)).chain(allowed_for).collect(),
    })
}

/// The camera, and a warning where it allows for a bent board without having been told to.
fn solve(
    views: &[BoardView],
    pictures: &FrameSet,
    options: &CalibrateOptions,
    one_board: bool,
) -> Result<(Calibration, Option<String>), FacewrightError> {
    let (width, height, model) = (pictures.width, pictures.height, options.model());
    let mut flat = motion::calibrate::calibrate(views, width, height, &model)?;
    if let Some(warning) = misfit::warning(&flat, views, options) {
        // What else the errors would be taken for.
        let of_board = |other: &CalibrateWarning| {
            matches!(other, CalibrateWarning::BentBoard { .. } | CalibrateWarning::Scattered { .. })
        };
        flat.warnings.retain(|other| !of_board(other));
        return Ok((flat, Some(warning)));
    }
    let Some(bend) = flat.bend.filter(|b| b.is_significant() && one_board && options.bend == Bend::Judged) else {
        return Ok((flat, None));
    };
    let free = motion::calibrate::CalibrateOptions { bend: true, ..model };
    let bent = motion::calibrate::calibrate(views, width, height, &free);
    let better = |bent: &Calibration| {
        let pairs = bent.views.iter().zip(&flat.views);
        pairs.map(|(b, f)| Some(b.hold_out_rms_px? < f.hold_out_rms_px?)).all(|better| better == Some(true))
    };
    let Some(bent) = bent.ok().filter(better) else { return Ok((flat, None)) };
    let warning = format!(
        "the board bulges by {:.2} ± {:.2} mm: the calibration allowed for it, but a print glued onto glass or a stiff \
         board gives a better camera",
        bend.bulge_mm, bend.deviation_mm
    );
    Ok((bent, Some(warning)))
}

/// A warning, with the picture's name where it is about one.
fn sentence<'a>(warning: &CalibrateWarning, name: impl Fn(usize) -> &'a str) -> String {
    match warning {
        CalibrateWarning::BadView { view, .. } => {
            warning.to_string().replacen(&format!("picture {}", view + 1), &format!("picture {}", name(*view)), 1)
        }
        _ => warning.to_string(),
    }
}

/// What a picture shows, for the solver.
fn view(detection: &Detection, boards: &[Board]) -> Option<BoardView> {
    let found = detection.as_ref().ok()?;
    let points = boards[found.board].points();
    Some(BoardView {
        points: found.corners.iter().map(|c| points[c.index]).collect(),
        pixels: found.corners.iter().map(|c| c.position).collect(),
    })
}

/// The pictures before the camera is known.
fn images(pictures: &FrameSet, detections: &[Detection]) -> Vec<BoardImage> {
    let image = |(frame, detection): (&crate::Frame, &Detection)| BoardImage {
        name: frame.name.clone(),
        found: detection.is_ok(),
        reason: Some(detection.as_ref().err().map_or_else(|| choice::TOO_ALIKE.to_owned(), ToString::to_string)),
        board: detection.as_ref().ok().map(|found| found.board),
        ..BoardImage::default()
    };
    pictures.frames.iter().zip(detections).map(image).collect()
}

/// What the solver says of a picture it used.
fn fill(image: &mut BoardImage, detection: &Detection, fit: &ViewFit) {
    image.used = true;
    image.reason = None;
    image.rms_px = Some(fit.rms_px);
    image.worst_px = Some(fit.worst_px);
    image.hold_out_rms_px = fit.hold_out_rms_px;
    image.cam_from_board = Some(fit.cam_from_board);
    let seen = detection.iter().flat_map(|found| &found.corners).zip(&fit.residuals);
    image.corners = seen.map(|(c, residual)| SeenCorner(c.index, c.position.into(), *residual)).collect();
}
