//! Cameras from pictures of a flat board (Zhang 1999; paper, section 2.2).
//!
//! # Entry points
//! - [`calibrate`]: corners of a board in three or more pictures in, camera, poses and their uncertainty out.
//! - [`rig::calibrate_rig`]: the same for several cameras at once, with where they stand.
//!
//! # Conventions
//! Board points are metres in the plane z = 0 of the board's frame; poses are `cam_from_board`. Pixel centres are at
//! integers. The lens is that of [`Camera`]. A picture brings its own board points, so that a board may be seen in part, and
//! boards may differ from picture to picture.
//!
//! # How
//! Homographies, closed form, `k1, k2` by linear least squares, then everything together by robust non-linear least
//! squares. What the pictures do not determine is an error or a warning, never a guess. Deviations are those that the
//! corners' noise explains, or those that the scatter of pictures shows, whichever are larger.

mod closed_form;
mod error;
mod gram;
mod homography;
pub mod rig;
mod solve;
mod uncertainty;
mod warnings;

pub use error::CalibrateError;
pub use warnings::{CalibrateWarning, PicturePart, Side};

use error::checked_homographies;
use geometry::least_squares::Loss;
use geometry::{Board, Camera, Transform, Vec2};
use gram::Shape;
use serde::{Deserialize, Serialize};
use solve::{Problem, Sight, State};
use uncertainty::Uncertainty;
use warnings::Evidence;

/// Relative standard deviation of the focal length from which the pictures do not determine it.
const MAX_FOCAL_DEVIATION: f64 = 0.05;
/// A bulge of more than this many standard deviations is significant.
const CLEAR_BULGE: f64 = 4.0;
/// Part of the squared error that a bulge must explain to matter.
const CLEAR_SHARE: f64 = 0.1;
/// Corners this far off, parts of the picture's diagonal, are not explained by any camera.
const MAX_SIGMA: f64 = 0.01;

/// What one picture shows of a board.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardView {
    /// Corners in the board's plane, metres.
    pub points: Vec<Vec2>,
    /// Where each of them is seen, pixels.
    pub pixels: Vec<Vec2>,
}

impl BoardView {
    /// A view of all corners of a board, in the board's order.
    pub fn whole(board: &Board, pixels: Vec<Vec2>) -> Self {
        Self { points: board.points(), pixels }
    }
}

/// How to calibrate.
#[derive(Clone, Copy, Debug)]
pub struct CalibrateOptions {
    /// Whether `fx` equals `fy`, as in almost every digital camera.
    pub square_pixels: bool,
    /// 0: no distortion, 1: `k1`, 2: `k1, k2`, 3: `k1, k2, k3`.
    pub distortion_terms: usize,
    /// Whether to solve for the tangential terms `p1, p2`.
    pub tangential: bool,
    /// Whether to solve for a bend of the board, which must then be the same board in all pictures.
    pub bend: bool,
    /// On distances in standard deviations of a corner, which are estimated. The paper's chain is [`Loss::Squared`]. The
    /// default costs 2 % of the efficiency if corners err normally, and on photographs of three cameras predicts boards that
    /// were left out better than weaker or no robustness.
    pub loss: Loss,
}

impl Default for CalibrateOptions {
    fn default() -> Self {
        Self { square_pixels: false, distortion_terms: 2, tangential: false, bend: false, loss: Loss::Huber(2.0) }
    }
}

impl CalibrateOptions {
    fn model(&self) -> Model {
        let Self { square_pixels, distortion_terms, tangential, bend, .. } = *self;
        Model { square_pixels, distortion_terms, tangential, bend }
    }
}

/// Which numbers are free.
#[derive(Clone, Copy, Debug)]
struct Model {
    square_pixels: bool,
    distortion_terms: usize,
    tangential: bool,
    bend: bool,
}

impl Model {
    /// Columns of the normal equations for lens and bend.
    fn columns(&self) -> usize {
        match self {
            Self { bend: true, .. } => 12,
            Self { tangential: true, .. } | Self { distortion_terms: 3, .. } => 9,
            _ => 6,
        }
    }

    /// Free columns of the lens, in the order of [`Camera::intrinsics`].
    fn free(&self) -> Vec<usize> {
        let focal = if self.square_pixels { 0..1 } else { 0..2 };
        let radial = 4..4 + self.distortion_terms;
        let tangential = if self.tangential { 7..9 } else { 7..7 };
        focal.chain(2..4).chain(radial).chain(tangential).collect()
    }
}

/// Standard deviations of a camera's numbers; 0 where a number was fixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraDeviations {
    /// Of the focal length along x, pixels.
    pub fx: f64,
    /// Of the focal length along y, pixels.
    pub fy: f64,
    /// Of the principal point, pixels.
    pub cx: f64,
    /// Of the principal point, pixels.
    pub cy: f64,
    /// Of the first radial coefficient.
    pub k1: f64,
    /// Of the second radial coefficient.
    pub k2: f64,
    /// Of the third radial coefficient.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k3: f64,
    /// Of the first tangential coefficient.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub p1: f64,
    /// Of the second tangential coefficient.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub p2: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl CameraDeviations {
    /// From the standard deviations of the free unknowns, the first of which is `first`.
    fn of(model: &Model, uncertainty: &Uncertainty, first: usize) -> Self {
        let mut all = [0.0; 9];
        for (k, column) in model.free().into_iter().enumerate() {
            all[column] = uncertainty.deviation(first + k);
        }
        let [fx, fy, cx, cy, k1, k2, k3, p1, p2] = all;
        Self { fx, fy: if model.square_pixels { fx } else { fy }, cx, cy, k1, k2, k3, p1, p2 }
    }

    /// Of the less certain focal length, parts of it.
    fn focal(&self, camera: &Camera) -> f64 {
        (self.fx / camera.fx).max(self.fy / camera.fy)
    }
}

/// What the calibration says about one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewFit {
    /// The board before the camera, metres.
    pub cam_from_board: Transform,
    /// Root mean square distance of its corners from where the camera puts them, pixels.
    pub rms_px: f64,
    /// The largest such distance, pixels.
    pub worst_px: f64,
    /// The same as `rms_px` for the camera that the other pictures give; `None` where they give none.
    pub hold_out_rms_px: Option<f64>,
    /// Each corner less where the camera puts it, pixels.
    pub residuals: Vec<[f64; 2]>,
}

/// How far a board is from flat: its corners' heights are `a x² + b x y + c y²` about its middle, along its z axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoardBend {
    /// `a, b, c`, per metre.
    pub coefficients: [f64; 3],
    /// Highest less lowest corner, measured from their plane, millimetres.
    pub bulge_mm: f64,
    /// Standard deviation of the bulge.
    pub deviation_mm: f64,
    /// Part of a flat board's squared error that the bend explains.
    pub explained: f64,
}

impl BoardBend {
    /// Whether it is no chance.
    pub fn is_significant(&self) -> bool {
        self.bulge_mm > CLEAR_BULGE * self.deviation_mm
    }

    /// Whether it is no chance and matters.
    fn is_clear(&self) -> bool {
        self.is_significant() && self.explained > CLEAR_SHARE
    }
}

/// A camera and how well it is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera.
    pub camera: Camera,
    /// Standard deviations of its numbers: those that the corners' noise explains, or the scatter of pictures (from six on),
    /// whichever is larger, and what a clear bend of the board that was not allowed for shifts.
    pub deviations: CameraDeviations,
    /// By how many times single pictures move the camera further than independent noise of their corners explains: about 1
    /// if the corners of a picture do not err together; `None` for fewer than six pictures.
    pub scatter: Option<f64>,
    /// Root mean square distance of all corners from where the camera puts them, pixels.
    pub rms_px: f64,
    /// The same with each picture left out of the calibration it is held against; `None` where that has no answer.
    pub hold_out_rms_px: Option<f64>,
    /// Standard deviation of a corner along one axis, pixels, estimated robustly.
    pub sigma_px: f64,
    /// How far the board is from flat, whether the camera allows for it or not; `None` where the pictures do not tell.
    pub bend: Option<BoardBend>,
    /// Each picture, in the order given.
    pub views: Vec<ViewFit>,
    /// What the user should know.
    pub warnings: Vec<CalibrateWarning>,
}

/// The camera that took `views`, pictures of `width × height` pixels.
pub fn calibrate(
    views: &[BoardView],
    width: u32,
    height: u32,
    options: &CalibrateOptions,
) -> Result<Calibration, CalibrateError> {
    let homographies = checked_homographies(views, width, height, options)?;
    let model = options.model();
    let (camera, boards) = closed_form::start(views, &homographies, (width, height), &model);
    let shape = Shape { middle: solve::middle(views.iter()), bend: [0.0; 3] };
    let start = State { cameras: vec![camera], mounts: vec![Transform::identity()], boards, shape };
    let sights = views.iter().enumerate().map(|(moment, view)| Sight { camera: 0, moment, view }).collect();
    let mut problem = Problem { sights, model, loss: options.loss, sigmas: vec![1.0] };
    let solution = problem.solve(start).ok_or(CalibrateError::Degenerate)?;
    if problem.sigmas[0] > MAX_SIGMA * f64::from(width).hypot(f64::from(height)) {
        return Err(CalibrateError::NoCamera { rms_px: problem.sigmas[0] * std::f64::consts::SQRT_2 });
    }
    // Only a valley without a bottom keeps the refinement from ending.
    if !solution.converged {
        return Err(CalibrateError::Degenerate);
    }
    report(&problem, &solution.state)
}

fn report(problem: &Problem, state: &State) -> Result<Calibration, CalibrateError> {
    let camera = state.cameras[0];
    let (uncertainty, bend) = uncertainty::with_bend(problem, state).ok_or(CalibrateError::Degenerate)?;
    let deviations = CameraDeviations::of(&problem.model, &uncertainty, 0);
    let focal_deviation = deviations.focal(&camera);
    if camera.validate().is_err() || focal_deviation.is_nan() || focal_deviation > MAX_FOCAL_DEVIATION {
        return Err(CalibrateError::Degenerate);
    }
    let fits = problem.sights.iter().map(|sight| view_fit(problem, sight, state, &uncertainty));
    let views: Vec<ViewFit> = fits.collect::<Option<_>>().ok_or(CalibrateError::Degenerate)?;
    let pictures: Vec<&BoardView> = problem.sights.iter().map(|s| s.view).collect();
    let evidence = Evidence { camera: &camera, pictures: &pictures, views: &views, focal_deviation };
    let mut warnings = evidence.warnings();
    let bend_left_out = bend.filter(|_| !problem.model.bend);
    warnings.extend(warnings::of_board(bend_left_out.as_ref(), uncertainty.scatter()));
    Ok(Calibration {
        camera,
        deviations,
        scatter: uncertainty.scatter(),
        rms_px: over_all(&pictures, views.iter().map(|v| Some(v.rms_px))).unwrap_or(0.0),
        hold_out_rms_px: over_all(&pictures, views.iter().map(|v| v.hold_out_rms_px)),
        sigma_px: problem.sigmas[0],
        bend,
        warnings,
        views,
    })
}

/// `None` where a corner has no pixel.
fn view_fit(problem: &Problem, sight: &Sight, state: &State, uncertainty: &Uncertainty) -> Option<ViewFit> {
    let residuals = problem.residuals(sight, state)?;
    let without = uncertainty.without(problem, state, sight.moment);
    Some(ViewFit {
        cam_from_board: state.pose(sight),
        rms_px: rms(&residuals),
        worst_px: residuals.iter().map(|r| r.norm()).fold(0.0, f64::max),
        hold_out_rms_px: without.and_then(|other| problem.residuals(sight, &other)).as_deref().map(rms),
        residuals: residuals.into_iter().map(Into::into).collect(),
    })
}

fn rms(residuals: &[Vec2]) -> f64 {
    (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / residuals.len() as f64).sqrt()
}

/// The root mean square over all corners of pictures with these; `None` if one is missing.
fn over_all(pictures: &[&BoardView], each: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let (mut squares, mut corners) = (0.0, 0.0);
    for (picture, rms) in pictures.iter().zip(each) {
        let count = picture.pixels.len() as f64;
        squares += rms?.powi(2) * count;
        corners += count;
    }
    Some((squares / f64::max(corners, 1.0)).sqrt())
}

#[cfg(test)]
mod tests;
