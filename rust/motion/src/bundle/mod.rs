//! Bundle adjustment: poses, points and, if wanted, focal length and distortion from all observations at once.
//!
//! # Entry points
//! - [`adjust`]: Levenberg–Marquardt with the points reduced (Schur complement).
//! - [`residuals`] and [`reject_outliers`]: what does not fit afterwards.
//!
//! # Conventions
//! Poses are `cam_from_head`, points are in the head frame. Residuals are pixels over their standard deviation. Scale, and
//! without fixed frames or priors also place and direction of the head frame, are free: the damping leaves them near their
//! start, and [`geometry::Similarity`] moves the result wherever it is wanted.
//!
//! Source: Triggs et al. 2000, *Bundle Adjustment: A Modern Synthesis*.

mod cholesky;
mod linearise;
mod outliers;
mod priors;
mod report;
mod schur;

pub use outliers::{Rejection, reject_outliers, residuals};
pub use priors::{FocalPrior, PointPrior, PosePrior};
pub use report::{BundleReport, Fit};

use crate::MotionError;
use geometry::least_squares::Loss;
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use linearise::{Layout, Linearised};
use nalgebra::{DVector, Vector6};

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
    /// What is seen. Observations of a point that is seen once and has no prior are left out.
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
    /// Frames whose pose is kept.
    pub fixed_frames: Vec<usize>,
    /// What is known of points.
    pub point_priors: Vec<PointPrior>,
    /// What is known of poses.
    pub pose_priors: Vec<PosePrior>,
    /// Steps taken at most.
    pub max_iterations: usize,
    /// Stop when a step lowers the cost by less than this part of it.
    pub relative_cost: f64,
}

impl Default for BundleOptions {
    /// Huber's loss at two standard deviations; camera kept; first pose kept.
    fn default() -> Self {
        Self {
            loss: Loss::Huber(2.0),
            refine_focal: false,
            focal_prior: None,
            refine_distortion: false,
            fixed_frames: vec![0],
            point_priors: Vec::new(),
            pose_priors: Vec::new(),
            max_iterations: 30,
            relative_cost: 1e-7,
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
    cameras: DVector<f64>,
    points: Vec<Vec3>,
}

/// Refines a bundle in place. On an error nothing is changed.
///
/// Fails when tables do not fit together, numbers are impossible, there are fewer observations than unknowns, or the caller
/// cancels.
pub fn adjust(bundle: &mut Bundle, options: &BundleOptions, progress: &Progress) -> Result<BundleReport, MotionError> {
    let layout = Layout::new(bundle, options)?;
    let mut state = State { camera: bundle.camera, poses: bundle.poses.clone(), points: bundle.points.clone() };
    let mut linearised = layout.linearise(&state);
    let initial_cost = linearised.cost;
    let (mut damping, mut growth, mut iterations, mut converged) = (1e-4, 2.0, 0, false);
    while iterations < options.max_iterations && !converged && damping < 1e12 {
        progress.step(iterations, options.max_iterations)?;
        let Some((candidate, predicted)) = layout.candidate(&state, &linearised, damping) else {
            (damping, growth) = (damping * growth, growth * 2.0);
            continue;
        };
        let gain = linearised.cost - layout.cost(&candidate);
        // Also false when the cost is not finite.
        if gain > 0.0 {
            let ratio = gain / predicted.max(f64::MIN_POSITIVE);
            converged = gain <= options.relative_cost * linearised.cost;
            state = candidate;
            linearised = layout.linearise(&state);
            iterations += 1;
            damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-12);
            growth = 2.0;
        } else {
            converged = predicted <= options.relative_cost * linearised.cost;
            (damping, growth) = (damping * growth, growth * 2.0);
        }
    }
    let report = layout.report(&state, &linearised, initial_cost, iterations, converged);
    (bundle.camera, bundle.poses, bundle.points) = (state.camera, state.poses, state.points);
    Ok(report)
}

impl Layout<'_> {
    /// The state after a damped step, and the decrease of the cost the linear model promises.
    fn candidate(&self, state: &State, linearised: &Linearised, damping: f64) -> Option<(State, f64)> {
        let step = self.solve(linearised, damping)?;
        let predicted = self.predicted_decrease(linearised, &step, damping);
        let candidate = self.retract(state, &step);
        (predicted.is_finite() && candidate.camera.fx > 0.0).then_some((candidate, predicted))
    }

    fn retract(&self, state: &State, step: &Step) -> State {
        let mut next = state.clone();
        for (frame, pose) in next.poses.iter_mut().enumerate() {
            if let Some(column) = self.column_of_frame[frame] {
                *pose = pose.retract(&Vector6::from_fn(|k, _| step.cameras[column + k]));
            }
        }
        for (point, change) in next.points.iter_mut().zip(&step.points) {
            *point += change;
        }
        let intrinsics = &step.cameras.as_slice()[self.frame_columns..];
        if self.options.refine_focal {
            let factor = intrinsics[0].exp();
            next.camera.fx *= factor;
            next.camera.fy *= factor;
        }
        if self.options.refine_distortion {
            let first = usize::from(self.options.refine_focal);
            next.camera.k1 += intrinsics[first];
            next.camera.k2 += intrinsics[first + 1];
        }
        next
    }
}

#[cfg(test)]
mod tests;
