//! Several cameras from pictures of one board: the lens of each, and where they stand to each other.
//!
//! # Entry points
//! - [`calibrate_rig`]: what each camera saw of the board at each moment in; cameras, places and their uncertainty out.
//!
//! # Conventions
//! A moment is one position of the board; at each one any of the cameras may see it or not. The rig's frame is the first
//! camera's. A board that looks the same after a turn ([`BoardSymmetry`]) may be counted from another end in each picture.
//!
//! # How
//! Each camera alone, the motions between them by agreement over moments, then everything in one bundle.

mod error;
mod start;

pub use error::{RigError, RigWarning};

use super::gram::Shape;
use super::solve::{self, Problem, Sight, State};
use super::uncertainty::{self, Uncertainty};
use super::warnings::{self, Evidence};
use super::{BoardBend, BoardView, CalibrateOptions, CalibrateWarning, CameraDeviations, ViewFit};
use super::{MAX_FOCAL_DEVIATION, over_all, view_fit};
use geometry::{Board, Camera, Pattern, Transform, Vec2};
use nalgebra::{Matrix6, Rotation3, Vector3};
use serde::{Deserialize, Serialize};
use start::Start;
use std::f64::consts::TAU;

/// What one camera saw.
#[derive(Clone, Debug, PartialEq)]
pub struct RigCamera {
    /// Picture width, pixels.
    pub width: u32,
    /// Picture height, pixels.
    pub height: u32,
    /// The board at each moment, in the same order for all cameras; `None` where this one does not see it.
    pub views: Vec<Option<BoardView>>,
}

/// The turns in its plane after which a board looks the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardSymmetry {
    /// The point that stays, metres.
    pub centre: Vec2,
    /// How many equal turns make a full one: 1 for a board that never looks the same, 2 or 4.
    pub turns: u32,
}

impl BoardSymmetry {
    /// Of a board whose first corner is known, by a mark or by its pattern.
    pub fn none() -> Self {
        Self { centre: Vec2::zeros(), turns: 1 }
    }

    /// Of a board without a mark.
    pub fn of(board: &Board) -> Self {
        let quarter = match board.pattern {
            // A quarter of a turn swaps black and white if the corners in a row are odd.
            Pattern::Checkerboard => board.columns == board.rows && board.columns.is_multiple_of(2),
            Pattern::Squares { .. } => board.columns == board.rows,
        };
        let turns = match (quarter, board.is_symmetric()) {
            (true, _) => 4,
            (false, true) => 2,
            (false, false) => 1,
        };
        Self { centre: board.centre(), turns }
    }

    /// The turns as motions of the board's frame.
    fn board_from_board(&self) -> Vec<Transform> {
        let centre = self.centre.push(0.0);
        let turn = |k: u32| {
            let rotation = Rotation3::new(Vector3::z() * (TAU * f64::from(k) / f64::from(self.turns)));
            Transform::new(rotation, centre - rotation * centre)
        };
        (0..self.turns).map(turn).collect()
    }
}

/// The pose of a camera of a rig, and how well it is known; all standard deviations are 0 for the first one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mount {
    /// Where it stands; the identity for the first one.
    pub camera_from_rig: Transform,
    /// Standard deviations of small rotations about this camera's axes, radians.
    pub rotation_deviations: [f64; 3],
    /// Standard deviations of the translation along this camera's axes, metres.
    pub translation_deviations: [f64; 3],
    /// Covariance of both, in this order.
    pub covariance: [[f64; 6]; 6],
    /// Distance of its centre from the first camera's, metres.
    pub baseline: f64,
    /// Standard deviation of that distance.
    pub baseline_deviation: f64,
}

/// A camera of a rig, and how well it and its place are known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MountedCamera {
    /// The camera.
    pub camera: Camera,
    /// Standard deviations of its numbers, as in [`super::Calibration`].
    pub deviations: CameraDeviations,
    /// Where it stands.
    #[serde(flatten)]
    pub mount: Mount,
    /// Root mean square distance of its corners from where it puts them, pixels.
    pub rms_px: f64,
    /// Standard deviation of a corner along one axis, pixels, estimated robustly.
    pub sigma_px: f64,
    /// Each moment; `None` where it does not see the board or its picture was left out.
    pub views: Vec<Option<ViewFit>>,
}

/// Cameras and how well they are known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// In the order given.
    pub cameras: Vec<MountedCamera>,
    /// `rig_from_board` at each moment; `None` where no camera sees the board.
    pub boards: Vec<Option<Transform>>,
    /// Root mean square distance of all corners from where their cameras put them, pixels.
    pub rms_px: f64,
    /// The same with each moment left out of the calibration it is held against; `None` where that has no answer.
    pub hold_out_rms_px: Option<f64>,
    /// As [`super::Calibration::scatter`], of moments.
    pub scatter: Option<f64>,
    /// How far the board is from flat; `None` where the pictures do not tell.
    pub bend: Option<BoardBend>,
    /// What the user should know.
    pub warnings: Vec<RigWarning>,
}

/// The cameras that saw one board at the same moments, and where they stand.
pub fn calibrate_rig(
    cameras: &[RigCamera],
    symmetry: &BoardSymmetry,
    options: &CalibrateOptions,
) -> Result<Rig, RigError> {
    check(cameras, symmetry)?;
    let start = start::start(cameras, symmetry, options)?;
    let sights = start.views.iter().map(|(camera, moment, view)| Sight { camera: *camera, moment: *moment, view });
    let shape = Shape { middle: solve::middle(start.views.iter().map(|(_, _, view)| view)), bend: [0.0; 3] };
    let state =
        State { cameras: start.cameras.clone(), mounts: start.mounts.clone(), boards: start.boards.clone(), shape };
    let sigmas = vec![1.0; cameras.len()];
    let mut problem = Problem { sights: sights.collect(), model: options.model(), loss: options.loss, sigmas };
    let solution = problem.solve(state).filter(|s| s.converged).ok_or(RigError::Degenerate)?;
    Report::of(&problem, &solution.state, &start).and_then(|report| report.rig(cameras[0].views.len()))
}

fn check(cameras: &[RigCamera], symmetry: &BoardSymmetry) -> Result<(), RigError> {
    let Some(first) = cameras.first().filter(|_| cameras.len() > 1) else {
        return Err(RigError::TooFewCameras { cameras: cameras.len() });
    };
    let expected = first.views.len();
    for (camera, found) in cameras.iter().map(|c| c.views.len()).enumerate() {
        if found != expected {
            return Err(RigError::MomentCount { camera, found, expected });
        }
    }
    if symmetry.turns == 0 || !symmetry.centre.iter().all(|v| v.is_finite()) {
        return Err(RigError::InvalidSymmetry { turns: symmetry.turns });
    }
    Ok(())
}

/// What a rig is told from.
struct Report<'a> {
    problem: &'a Problem<'a>,
    state: &'a State,
    start: &'a Start,
    uncertainty: Uncertainty,
    bend: Option<BoardBend>,
    /// Of each sight.
    fits: Vec<ViewFit>,
}

impl<'a> Report<'a> {
    fn of(problem: &'a Problem<'a>, state: &'a State, start: &'a Start) -> Result<Self, RigError> {
        let (uncertainty, bend) = uncertainty::with_bend(problem, state).ok_or(RigError::Degenerate)?;
        let fits = problem.sights.iter().map(|sight| view_fit(problem, sight, state, &uncertainty));
        let fits = fits.collect::<Option<_>>().ok_or(RigError::Degenerate)?;
        Ok(Self { problem, state, start, uncertainty, bend, fits })
    }

    fn rig(&self, moments: usize) -> Result<Rig, RigError> {
        let count = self.state.cameras.len();
        let cameras = (0..count).map(|c| self.mounted(c, moments)).collect::<Result<Vec<_>, _>>()?;
        let mut boards = vec![None; moments];
        for (board, &moment) in self.state.boards.iter().zip(&self.start.moments) {
            boards[moment] = Some(*board);
        }
        let pictures: Vec<&BoardView> = self.problem.sights.iter().map(|s| s.view).collect();
        Ok(Rig {
            rms_px: over_all(&pictures, self.fits.iter().map(|f| Some(f.rms_px))).unwrap_or(0.0),
            hold_out_rms_px: over_all(&pictures, self.fits.iter().map(|f| f.hold_out_rms_px)),
            scatter: self.uncertainty.scatter(),
            bend: self.bend,
            warnings: self.warnings(&cameras),
            cameras,
            boards,
        })
    }

    /// Index and fit of the pictures of a camera.
    fn of_camera(&self, camera: usize) -> impl Iterator<Item = (&Sight<'a>, &ViewFit)> {
        self.problem.sights.iter().zip(&self.fits).filter(move |(sight, _)| sight.camera == camera)
    }

    fn mounted(&self, camera: usize, moments: usize) -> Result<MountedCamera, RigError> {
        let (layout, lens) = (self.problem.layout(), self.state.cameras[camera]);
        let deviations = CameraDeviations::of(&self.problem.model, &self.uncertainty, layout.lens_at(camera));
        let focal_deviation = deviations.focal(&lens);
        if lens.validate().is_err() || focal_deviation.is_nan() || focal_deviation > MAX_FOCAL_DEVIATION {
            return Err(RigError::Degenerate);
        }
        let mut views = vec![None; moments];
        for (sight, fit) in self.of_camera(camera) {
            views[self.start.moments[sight.moment]] = Some(fit.clone());
        }
        let pictures: Vec<&BoardView> = self.of_camera(camera).map(|(sight, _)| sight.view).collect();
        let errors = self.of_camera(camera).map(|(_, fit)| Some(fit.rms_px));
        Ok(MountedCamera {
            camera: lens,
            deviations,
            mount: self.mount(camera),
            rms_px: over_all(&pictures, errors).unwrap_or(0.0),
            sigma_px: self.problem.sigmas[camera],
            views,
        })
    }

    fn mount(&self, camera: usize) -> Mount {
        let camera_from_rig = self.state.mounts[camera];
        let (mut covariance, mut baseline_deviation) = (Matrix6::zeros(), 0.0);
        if camera > 0 {
            covariance = self.uncertainty.raised::<6>(self.problem.layout().mount_at(camera));
            let along = camera_from_rig.translation.normalize();
            let of_translation = covariance.fixed_view::<3, 3>(3, 3);
            baseline_deviation = along.dot(&(of_translation * along)).max(0.0).sqrt();
        }
        let [a, b, c, x, y, z] = std::array::from_fn(|k| covariance[(k, k)].max(0.0).sqrt());
        Mount {
            camera_from_rig,
            rotation_deviations: [a, b, c],
            translation_deviations: [x, y, z],
            // Symmetric: rows are columns.
            covariance: covariance.into(),
            baseline: camera_from_rig.translation.norm(),
            baseline_deviation,
        }
    }

    fn warnings(&self, cameras: &[MountedCamera]) -> Vec<RigWarning> {
        let mut all = self.start.warnings.clone();
        for (camera, mounted) in cameras.iter().enumerate() {
            let (sights, views): (Vec<&Sight>, Vec<ViewFit>) =
                self.of_camera(camera).map(|(s, f)| (s, f.clone())).unzip();
            let pictures: Vec<&BoardView> = sights.iter().map(|s| s.view).collect();
            let focal_deviation = mounted.deviations.focal(&mounted.camera);
            let evidence = Evidence { camera: &mounted.camera, pictures: &pictures, views: &views, focal_deviation };
            let by_moment = |warning| match warning {
                CalibrateWarning::BadView { view, rms_px } => {
                    CalibrateWarning::BadView { view: self.start.moments[sights[view].moment], rms_px }
                }
                other => other,
            };
            let own = evidence.warnings().into_iter().map(by_moment);
            all.extend(own.map(|warning| RigWarning::Camera { camera, warning }));
        }
        let bend = self.bend.filter(|_| !self.problem.model.bend);
        all.extend(warnings::of_board(bend.as_ref(), self.uncertainty.scatter()).map(RigWarning::Rig));
        all
    }
}

#[cfg(test)]
mod tests;
