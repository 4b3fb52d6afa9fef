//! The camera from pictures of a flat board (Zhang 1999; paper, section 2.2).
//!
//! # Entry points
//! - [`calibrate`]: corners of a board in three or more pictures in, camera, poses and their uncertainty out.
//!
//! # Conventions
//! Board points are metres in the plane z = 0 of the board's frame; poses are `cam_from_board`. Pixel centres are at
//! integers. The lens is that of [`Camera`].
//!
//! # How
//! Homographies, closed form, `k1, k2` by linear least squares, then everything together by robust non-linear least
//! squares. What the pictures do not determine is an error or a warning, never a guess.

mod closed_form;
mod homography;
mod refine;

use geometry::least_squares::Loss;
use geometry::{Camera, Mat3, Transform, Vec2, Vec3};
use refine::{Freedom, Problem, Solution, State};
use serde::{Deserialize, Serialize};

/// Standard deviation of the focal length, parts of it, from which the pictures do not determine it.
const MAX_FOCAL_DEVIATION: f64 = 0.05;
/// The same, from which a warning is given.
const FOCAL_DEVIATION_WARNING: f64 = 0.005;
/// Fewer pictures give a warning.
const FEW_VIEWS: usize = 6;
/// A board should be seen from directions this far apart, degrees.
const SMALL_TILT_DEG: f64 = 20.0;
/// Corners should reach out to this part of the way from the picture's middle to its corner.
const SMALL_REACH: f64 = 0.6;
/// A picture with this many times the median error is suspicious.
const BAD_VIEW: f64 = 3.0;
/// Corners this far off, parts of the picture's diagonal, are not explained by any camera.
const MAX_SIGMA: f64 = 0.01;
/// A standard deviation is not estimated below this, pixels: perfect data would divide by zero.
const MIN_SIGMA: f64 = 1e-6;
/// The median of the distance from the origin of a normal distribution in the plane, in standard deviations.
const RAYLEIGH_MEDIAN: f64 = 1.177_41;

/// How to calibrate.
#[derive(Clone, Copy, Debug)]
pub struct CalibrateOptions {
    /// Whether `fx` equals `fy`, as in almost every digital camera.
    pub square_pixels: bool,
    /// 0: no distortion, 1: `k1`, 2: `k1, k2`.
    pub distortion_terms: usize,
    /// On distances in standard deviations of a corner, which are estimated.
    pub loss: Loss,
}

impl Default for CalibrateOptions {
    fn default() -> Self {
        Self { square_pixels: false, distortion_terms: 2, loss: Loss::Huber(2.5) }
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
}

/// What the calibration says about one picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewFit {
    /// The board before the camera, metres.
    pub cam_from_board: Transform,
    /// Root mean square distance of its corners from where the camera puts them, pixels.
    pub rms_px: f64,
    /// The largest such distance, pixels.
    pub worst_px: f64,
    /// The same as `rms_px` for the camera that the other pictures give; `None` where they give none.
    pub hold_out_rms_px: Option<f64>,
}

/// A camera and how well it is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera.
    pub camera: Camera,
    /// Standard deviations of its numbers.
    pub deviations: CameraDeviations,
    /// Root mean square distance of all corners from where the camera puts them, pixels.
    pub rms_px: f64,
    /// The same with each picture left out of the calibration it is held against; `None` where that has no answer.
    pub hold_out_rms_px: Option<f64>,
    /// Standard deviation of a corner along one axis, pixels, estimated robustly.
    pub sigma_px: f64,
    /// Each picture, in the order given.
    pub views: Vec<ViewFit>,
    /// What the user should know.
    pub warnings: Vec<CalibrateWarning>,
}

/// A reason to trust a calibration less.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum CalibrateWarning {
    /// Few pictures.
    #[error("only {views} pictures of the board: ten to twenty, tilted to all sides, give a better camera")]
    FewViews {
        /// Their number.
        views: usize,
    },
    /// All boards face nearly the same way.
    #[error(
        "the board was tilted by no more than {tilt_deg:.0}° between pictures: tilt it by 30° and more to all sides"
    )]
    SmallTilt {
        /// Largest angle between two boards.
        tilt_deg: f64,
    },
    /// The focal length is not well determined.
    #[error("the focal length is uncertain by {percent:.1} %: add pictures with the board tilted to other sides")]
    UncertainFocal {
        /// Standard deviation, percent.
        percent: f64,
    },
    /// The board never came near the picture's border.
    #[error(
        "the board reached only {percent:.0} % of the way to the picture's corners: the distortion beyond is extrapolated"
    )]
    SmallReach {
        /// Part of the way, percent.
        percent: f64,
    },
    /// One picture fits much worse than the others.
    #[error("picture {} fits badly ({rms_px:.2} px): leave it out if the board was bent or the picture is blurred", .view + 1)]
    BadView {
        /// Its index.
        view: usize,
        /// Its error, pixels.
        rms_px: f64,
    },
    /// The lens model folds the picture over inside the frame.
    #[error(
        "the distortion found is not valid up to the picture's corners: show the board there, or use one distortion term"
    )]
    FoldedDistortion,
}

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
    /// A picture whose corners are no picture of a plane.
    #[error("the corners of picture {} lie on a line or are not finite: leave it out", .view + 1)]
    FlatView {
        /// Its index.
        view: usize,
    },
    /// The pictures are alike.
    #[error("the pictures do not determine the focal length: tilt the board by 30° and more to different sides")]
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

/// The camera that took `views`: for each picture the pixels of all `board_points`, in their order.
///
/// `board_points` are metres in the board's plane; `width` and `height` the pictures' size.
pub fn calibrate(
    views: &[Vec<Vec2>],
    board_points: &[Vec2],
    width: u32,
    height: u32,
    options: &CalibrateOptions,
) -> Result<Calibration, CalibrateError> {
    let homographies = checked_homographies(views, board_points, width, height, options)?;
    let board: Vec<Vec3> = board_points.iter().map(|p| p.push(0.0)).collect();
    let freedom = Freedom::new(options.square_pixels, options.distortion_terms);
    let mut problem = Problem { views, board: &board, freedom, loss: Loss::Huber(1.0), sigma: 1.0 };
    let start = start(&problem, &homographies, width, height, options);
    let mut solution = problem.minimise(start).ok_or(CalibrateError::Degenerate)?;
    // The loss needs the corners' standard deviation, which needs a fit.
    problem.loss = options.loss;
    for _ in 0..2 {
        problem.sigma = robust_sigma(&problem, &solution.state);
        solution = problem.minimise(solution.state).ok_or(CalibrateError::Degenerate)?;
    }
    let size = f64::from(width).hypot(f64::from(height));
    if problem.sigma > MAX_SIGMA * size {
        return Err(CalibrateError::NoCamera { rms_px: problem.sigma * std::f64::consts::SQRT_2 });
    }
    // Only a valley without a bottom keeps the refinement from ending.
    if !solution.converged {
        return Err(CalibrateError::Degenerate);
    }
    report(&problem, &solution)
}

fn checked_homographies(
    views: &[Vec<Vec2>],
    board: &[Vec2],
    width: u32,
    height: u32,
    options: &CalibrateOptions,
) -> Result<Vec<Mat3>, CalibrateError> {
    let invalid = |what| Err(CalibrateError::InvalidInput { what });
    if width == 0 || height == 0 {
        return invalid("pictures without pixels");
    }
    if options.distortion_terms > 2 {
        return invalid("more than two distortion terms");
    }
    if board.len() < 6 || !board.iter().all(|p| p.iter().all(|v| v.is_finite())) {
        return invalid("a board of fewer than six points");
    }
    if views.len() < 3 {
        return Err(CalibrateError::TooFewViews { views: views.len() });
    }
    let homography = |(view, corners): (usize, &Vec<Vec2>)| {
        if corners.len() != board.len() {
            return Err(CalibrateError::CornerCount { view, found: corners.len(), expected: board.len() });
        }
        let finite = corners.iter().all(|p| p.iter().all(|v| v.is_finite()));
        let found = if finite { homography::fit(board, corners) } else { None };
        found.ok_or(CalibrateError::FlatView { view })
    };
    views.iter().enumerate().map(homography).collect()
}

/// The closed form, and a camera of usual focal length where it has no answer; the refinement decides.
fn start(problem: &Problem, homographies: &[Mat3], width: u32, height: u32, options: &CalibrateOptions) -> State {
    let usual = || Camera::centred(width, height, 1.2 * f64::from(width.max(height)));
    let mut camera = closed_form::camera(homographies, width, height).unwrap_or_else(usual);
    if options.square_pixels {
        camera.fx = (camera.fx * camera.fy).sqrt();
        camera.fy = camera.fx;
    }
    let poses: Vec<Transform> = homographies.iter().map(|h| closed_form::pose(&camera, h)).collect();
    if options.distortion_terms == 2 {
        let seen = problem.views.iter().zip(&poses).flat_map(|(view, pose)| {
            problem.board.iter().zip(view).map(move |(point, pixel)| (pose.apply(point), *pixel))
        });
        let [k1, k2] = closed_form::distortion(&camera, seen).unwrap_or([0.0, 0.0]);
        let distorted = Camera { k1, k2, ..camera };
        let valid = problem.views.iter().zip(&poses).all(|(v, p)| problem.rms(v, &distorted, p).is_some());
        camera = if valid { distorted } else { camera };
    }
    State { camera, poses }
}

/// Standard deviation of a corner along one axis by the median distance.
fn robust_sigma(problem: &Problem, state: &State) -> f64 {
    let each = problem.views.iter().zip(&state.poses);
    let mut all: Vec<f64> =
        each.flat_map(|(v, p)| refine::distances(v, problem.board, &state.camera, p)).flatten().collect();
    all.sort_by(f64::total_cmp);
    let median = all.get(all.len() / 2).copied().unwrap_or(0.0);
    // Fitted residuals are smaller than the errors by the unknowns' share of the data.
    let unknowns = (problem.freedom.count() + 6 * problem.views.len()) as f64;
    let data = 2.0 * all.len() as f64;
    (median / RAYLEIGH_MEDIAN * (data / (data - unknowns).max(1.0)).sqrt()).max(MIN_SIGMA)
}

fn report(problem: &Problem, solution: &Solution) -> Result<Calibration, CalibrateError> {
    let State { camera, poses } = &solution.state;
    let covariance = solution.covariance.ok_or(CalibrateError::Degenerate)?;
    let deviation = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let [fx, fy, cx, cy, k1, k2] = std::array::from_fn(deviation);
    let focal_deviation = (fx / camera.fx).max(fy / camera.fy);
    if camera.validate().is_err() || focal_deviation.is_nan() || focal_deviation > MAX_FOCAL_DEVIATION {
        return Err(CalibrateError::Degenerate);
    }
    let fit = |(k, pose): (usize, &Transform)| {
        let view = &problem.views[k];
        let distances = refine::distances(view, problem.board, camera, pose);
        let rms_px = problem.rms(view, camera, pose)?;
        let worst_px = distances.flatten().fold(0.0, f64::max);
        let hold_out_rms_px = solution.without[k].and_then(|other| problem.resect(view, &other, pose));
        Some(ViewFit { cam_from_board: *pose, rms_px, worst_px, hold_out_rms_px })
    };
    let views: Vec<ViewFit> =
        poses.iter().enumerate().map(fit).collect::<Option<_>>().ok_or(CalibrateError::Degenerate)?;
    let mean =
        |values: Option<Vec<f64>>| values.map(|v| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt());
    Ok(Calibration {
        camera: *camera,
        deviations: CameraDeviations { fx, fy, cx, cy, k1, k2 },
        rms_px: mean(Some(views.iter().map(|v| v.rms_px).collect())).unwrap_or(0.0),
        hold_out_rms_px: mean(views.iter().map(|v| v.hold_out_rms_px).collect()),
        sigma_px: problem.sigma,
        warnings: warnings(problem, camera, &views, focal_deviation),
        views,
    })
}

fn warnings(problem: &Problem, camera: &Camera, views: &[ViewFit], focal_deviation: f64) -> Vec<CalibrateWarning> {
    let mut warnings = Vec::new();
    if views.len() < FEW_VIEWS {
        warnings.push(CalibrateWarning::FewViews { views: views.len() });
    }
    let normal = |v: &ViewFit| v.cam_from_board.rotation * Vec3::z();
    let angle = |a: &ViewFit, b: &ViewFit| normal(a).angle(&normal(b)).to_degrees();
    let tilt_deg = views.iter().flat_map(|a| views.iter().map(move |b| angle(a, b))).fold(0.0, f64::max);
    if tilt_deg < SMALL_TILT_DEG {
        warnings.push(CalibrateWarning::SmallTilt { tilt_deg });
    }
    if focal_deviation > FOCAL_DEVIATION_WARNING {
        warnings.push(CalibrateWarning::UncertainFocal { percent: 100.0 * focal_deviation });
    }
    let border = Vec2::new(f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
    let radius = problem.views.iter().flatten().map(|p| (p - border / 2.0).norm()).fold(0.0, f64::max);
    let reach = radius / (border.norm() / 2.0);
    if reach < SMALL_REACH {
        warnings.push(CalibrateWarning::SmallReach { percent: 100.0 * reach });
    }
    let mut errors: Vec<f64> = views.iter().map(|v| v.rms_px).collect();
    errors.sort_by(f64::total_cmp);
    let limit = BAD_VIEW * errors[errors.len() / 2];
    let bad = views.iter().enumerate().filter(|(_, v)| v.rms_px > limit.max(MIN_SIGMA));
    warnings.extend(bad.map(|(view, v)| CalibrateWarning::BadView { view, rms_px: v.rms_px }));
    let corners = [Vec2::zeros(), Vec2::new(border.x, 0.0), Vec2::new(0.0, border.y), border];
    let returns = |p: &Vec2| camera.project(&camera.ray(p)).is_some_and(|q| (q - p).norm() < 0.1);
    if !corners.iter().all(returns) {
        warnings.push(CalibrateWarning::FoldedDistortion);
    }
    warnings
}

#[cfg(test)]
mod tests;
