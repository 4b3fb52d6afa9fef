//! Bundle adjustment: poses, points and, if wanted, focal length and distortion from all observations at once.
//!
//! # Entry points
//! - [`adjust`]: Levenberg–Marquardt with the points eliminated (Schur complement).
//! - [`residuals`] and [`reject_outliers`]: what does not fit afterwards.
//!
//! # Conventions
//! Poses are `cam_from_head`, points are in the head frame. Residuals are pixels over their standard deviation. Turn, shift
//! and scale of the head frame are held by fixed frames and priors, and what these leave free as [`Gauge`] tells;
//! [`geometry::Similarity`] moves the result wherever it is wanted.
//!
//! # Limits
//! The reduced equations are dense: six unknowns for each frame, up to a few hundred frames.
//!
//! Source: Triggs et al. 2000, *Bundle Adjustment: A Modern Synthesis*.

mod block;
mod check;
mod cholesky;
mod covariance;
mod gauge;
mod lanes;
mod layout;
mod linearise;
mod outliers;
mod panel;
mod priors;
mod report;
mod schur;
mod squares;

pub use covariance::Covariances;
pub use gauge::{Gauge, Held, HeldScale};
pub use outliers::{Rejection, reject_outliers, residuals};
pub use priors::{FocalPrior, LensPrior, PointPrior, PosePrior};
pub use report::{BundleReport, Fit};

use crate::MotionError;
use geometry::least_squares::Loss;
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use layout::Layout;
use linearise::Linearised;
use nalgebra::Vector6;
use schur::Reduced;

/// A point seen in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Index of the frame.
    pub frame: usize,
    /// Index of the point.
    pub point: usize,
    /// Where it is seen, pixels.
    pub pixel: Vec2,
    /// Standard deviation of each coordinate, pixels.
    pub sigma_px: f64,
}

/// Unknowns and observations.
#[derive(Clone, Debug)]
pub struct Bundle {
    /// The camera of all frames.
    pub camera: Camera,
    /// `cam_from_head` of each frame.
    pub poses: Vec<Transform>,
    /// Points in the head frame.
    pub points: Vec<Vec3>,
    /// What is seen. Left out, and their point or frame kept as it is, are observations of a point that is seen once and has
    /// no prior, and those in a frame that sees fewer than three points, is not fixed and has no prior.
    pub observations: Vec<Observation>,
}

/// What [`adjust`] refines, and what else it knows.
#[derive(Clone, Debug)]
pub struct BundleOptions {
    /// Loss of a residual in standard deviations.
    pub loss: Loss,
    /// Refine the focal length; `fy / fx` is kept.
    pub refine_focal: bool,
    /// What is known of the focal length.
    pub focal_prior: Option<FocalPrior>,
    /// Refine `k1` and `k2`.
    pub refine_distortion: bool,
    /// Refine principal point and `k1`, of which this is known.
    pub lens_prior: Option<LensPrior>,
    /// Frames whose pose is kept.
    pub fixed_frames: Vec<usize>,
    /// What is done about turn, shift and scale of the head frame where fixed frames and priors leave them free.
    pub gauge: Gauge,
    /// What is known of points.
    pub point_priors: Vec<PointPrior>,
    /// What is known of poses.
    pub pose_priors: Vec<PosePrior>,
    /// Steps taken at most.
    pub max_iterations: usize,
    /// Stop when a step lowers the cost by less than this part of it.
    pub relative_cost: f64,
    /// Report covariances of poses, points and camera; takes as long as two or three steps.
    pub covariances: bool,
}

impl Default for BundleOptions {
    /// Huber's loss at two standard deviations; camera kept; first pose and the scale kept; no covariances.
    fn default() -> Self {
        Self {
            loss: Loss::Huber(2.0),
            refine_focal: false,
            focal_prior: None,
            refine_distortion: false,
            lens_prior: None,
            fixed_frames: vec![0],
            gauge: Gauge::Held,
            point_priors: Vec::new(),
            pose_priors: Vec::new(),
            max_iterations: 30,
            relative_cost: 1e-7,
            covariances: false,
        }
    }
}

/// What a step changes, and what the priors compare.
#[derive(Clone)]
struct State {
    camera: Camera,
    poses: Vec<Transform>,
    points: Vec<Vec3>,
}

/// A step of all unknowns.
struct Step {
    /// Six for each free frame, then those of the camera.
    cameras: Vec<f64>,
    /// Of every point of the bundle; zero for those that do not count.
    points: Vec<Vec3>,
}

/// Everything that is filled anew in each iteration.
struct Workspace {
    linearised: Linearised,
    reduced: Reduced,
    step: Step,
    candidate: State,
}

/// Refines a bundle in place. On an error nothing is changed.
///
/// The cost is the sum of the losses of the observations' residuals and of the squared residuals of the priors. Points, poses
/// and observations may come in any order; the result does not depend on the number of threads.
///
/// Fails when tables do not fit together, numbers are impossible, there are fewer observations than unknowns, all cameras
/// stand in one place and no point has a prior, or the caller cancels. A point whose own rays are parallel keeps its depth.
pub fn adjust(bundle: &mut Bundle, options: &BundleOptions, progress: &Progress) -> Result<BundleReport, MotionError> {
    let layout = Layout::new(bundle, options)?;
    let mut state = State { camera: bundle.camera, poses: bundle.poses.clone(), points: bundle.points.clone() };
    let mut work = Workspace::new(&layout, &state);
    layout.linearise(&state, &mut work.linearised);
    let mut descent = Descent::new(work.linearised.cost);
    while descent.goes_on(options) {
        progress.step(descent.iterations, options.max_iterations)?;
        let Some(predicted) = layout.candidate(&state, descent.damping, &mut work) else {
            descent.raise_damping();
            continue;
        };
        if descent.accepts(layout.cost(&work.candidate), predicted, options.relative_cost) {
            std::mem::swap(&mut state, &mut work.candidate);
            if descent.goes_on(options) || layout.needs_equations() {
                layout.linearise(&state, &mut work.linearised);
            }
        }
    }
    let report = layout.report(&state, &descent, &mut work);
    (bundle.camera, bundle.poses, bundle.points) = (state.camera, state.poses, state.points);
    Ok(report)
}

/// Where Levenberg–Marquardt stands; Nielsen's damping update.
struct Descent {
    initial_cost: f64,
    cost: f64,
    damping: f64,
    growth: f64,
    /// Accepted steps.
    iterations: usize,
    /// Steps that did not lower the cost, or could not be solved for.
    rejected: usize,
    converged: bool,
}

impl Descent {
    fn new(cost: f64) -> Self {
        Self { initial_cost: cost, cost, damping: 1e-4, growth: 2.0, iterations: 0, rejected: 0, converged: false }
    }

    fn goes_on(&self, options: &BundleOptions) -> bool {
        self.iterations < options.max_iterations && !self.converged && self.damping < 1e12
    }

    fn accepts(&mut self, cost: f64, predicted: f64, relative_cost: f64) -> bool {
        let gain = self.cost - cost;
        // Also false when the cost is not finite.
        if gain > 0.0 {
            let ratio = gain / predicted.max(f64::MIN_POSITIVE);
            self.converged = gain <= relative_cost * self.cost;
            self.cost = cost;
            self.iterations += 1;
            self.damping = (self.damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-12);
            self.growth = 2.0;
            return true;
        }
        self.converged = predicted <= relative_cost * self.cost;
        self.raise_damping();
        false
    }

    fn raise_damping(&mut self) {
        self.rejected += 1;
        (self.damping, self.growth) = (self.damping * self.growth, self.growth * 2.0);
    }
}

impl Workspace {
    fn new(layout: &Layout, state: &State) -> Self {
        Self {
            linearised: Linearised::new(layout),
            reduced: Reduced::new(layout),
            step: Step { cameras: Vec::new(), points: vec![Vec3::zeros(); state.points.len()] },
            candidate: state.clone(),
        }
    }
}

impl Layout<'_> {
    /// Leaves the state after a damped step, and returns the decrease of the cost that the linear model promises.
    fn candidate(&self, state: &State, damping: f64, work: &mut Workspace) -> Option<f64> {
        self.solve(&work.linearised, damping, &mut work.reduced, &mut work.step)?;
        let predicted = self.predicted_decrease(&work.linearised, &work.step, damping);
        self.retract(state, &work.step, &mut work.candidate);
        (predicted.is_finite() && work.candidate.camera.fx > 0.0).then_some(predicted)
    }

    fn retract(&self, state: &State, step: &Step, next: &mut State) {
        for (frame, (next, pose)) in next.poses.iter_mut().zip(&state.poses).enumerate() {
            *next = match self.column_of_frame[frame] {
                Some(column) => pose.retract(&Vector6::from_column_slice(&step.cameras[column..column + 6])),
                None => *pose,
            };
        }
        for ((next, point), change) in next.points.iter_mut().zip(&state.points).zip(&step.points) {
            *next = point + change;
        }
        next.camera = state.camera;
        for (&unknown, &change) in self.camera.iter().zip(&step.cameras[self.frame_columns..]) {
            match unknown {
                0 => {
                    next.camera.fx *= change.exp();
                    next.camera.fy *= change.exp();
                }
                1 => next.camera.k1 += change,
                2 => next.camera.k2 += change,
                3 => next.camera.cx += change,
                _ => next.camera.cy += change,
            }
        }
    }
}

#[cfg(test)]
mod tests;
