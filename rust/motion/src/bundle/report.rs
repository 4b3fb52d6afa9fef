//! What an adjustment found and how good it is.

use super::layout::Layout;
use super::{Covariances, Descent, Gauge, Held, Observation, State, Workspace};
use geometry::Mat3;

/// How well a frame or a point fits its observations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fit {
    /// Observations that count.
    pub observations: usize,
    /// Root mean square distance between projections and observations, pixels; 0 without observations.
    pub rms_px: f64,
}

/// What [`super::adjust`] found.
#[derive(Clone, Debug)]
pub struct BundleReport {
    /// Sum of the losses at the start.
    pub initial_cost: f64,
    /// Sum of the losses at the end.
    pub final_cost: f64,
    /// Accepted steps.
    pub iterations: usize,
    /// Steps that were tried and not taken.
    pub rejected_steps: usize,
    /// Whether it stopped because nothing more was to be gained.
    pub converged: bool,
    /// Root mean square distance between projections and observations, pixels.
    pub rms_px: f64,
    /// Variance inflation: the factor by which the residuals' variance exceeds that announced, at least 1; the standard deviations
    /// below include it.
    pub excess: f64,
    /// The fit of each frame.
    pub frames: Vec<Fit>,
    /// The fit of each point.
    pub points: Vec<Fit>,
    /// Standard deviation of each point if the cameras were exact, metres, root mean square over the axes; infinite for a
    /// point that nothing determines.
    pub point_sigma: Vec<f64>,
    /// What was held beside fixed frames and priors.
    pub held: Held,
    /// Standard deviation of the focal length `fx`, pixels, all else free, if it was refined and something determines it.
    pub focal_sigma_px: Option<f64>,
    /// Covariances, if they were asked for and the gauge is held; `None` also where observations and priors leave more
    /// undetermined than the gauge.
    pub covariances: Option<Covariances>,
}

impl Layout<'_> {
    /// Whether the report is made from the equations at the end.
    pub(super) fn needs_equations(&self) -> bool {
        self.options.covariances || self.options.refine_focal
    }

    pub(super) fn report(&self, state: &State, descent: &Descent, work: &mut Workspace) -> BundleReport {
        let squares = self.squared(state);
        let (mut frames, mut points) = (vec![(0, 0.0); state.poses.len()], vec![(0, 0.0); state.points.len()]);
        let mut all = (0, 0.0);
        for (sight, square) in self.sights.iter().zip(&squares) {
            let square = square / (sight.inverse_sigma * sight.inverse_sigma);
            for (count, sum) in [&mut frames[sight.frame], &mut points[sight.point], &mut all] {
                *count += 1;
                *sum += square;
            }
        }
        let fit =
            |(observations, sum): (usize, f64)| Fit { observations, rms_px: (sum / observations.max(1) as f64).sqrt() };
        let freedom = self.numbers().saturating_sub(self.unknowns()).max(1) as f64;
        // Covariances follow the noise that was met where it exceeds the one that was announced.
        let excess = (descent.cost / freedom).max(1.0);
        let uncertainty = self.uncertainty(work, excess, state.camera.fx);
        BundleReport {
            initial_cost: descent.initial_cost,
            final_cost: descent.cost,
            iterations: descent.iterations,
            rejected_steps: descent.rejected,
            converged: descent.converged,
            rms_px: fit(all).rms_px,
            excess,
            frames: frames.into_iter().map(fit).collect(),
            points: points.into_iter().map(fit).collect(),
            point_sigma: self.point_sigma(state, excess),
            held: self.held,
            focal_sigma_px: uncertainty.0,
            covariances: uncertainty.1,
        }
    }

    /// Standard deviations of the points given the cameras.
    fn point_sigma(&self, state: &State, excess: f64) -> Vec<f64> {
        let mut information = vec![Mat3::zeros(); state.points.len()];
        for sight in &self.sights {
            let pose = &state.poses[sight.frame];
            let Some((pixel, jacobian)) = state.camera.project_with_jacobian(&pose.apply(&state.points[sight.point]))
            else {
                continue;
            };
            let by_point = jacobian.point * pose.rotation.matrix() * sight.inverse_sigma;
            let squared = (pixel - sight.pixel).norm_squared() * sight.inverse_sigma * sight.inverse_sigma;
            information[sight.point] += by_point.transpose() * by_point * self.options.loss.evaluate(squared).1;
        }
        for prior in &self.options.point_priors {
            information[prior.point] += prior.information;
        }
        let sigma = |information: &Mat3| {
            let covariance = information.try_inverse().filter(|c| c.iter().all(|v| v.is_finite()));
            covariance.map_or(f64::INFINITY, |c| (excess * c.trace() / 3.0).sqrt())
        };
        information.iter().map(sigma).collect()
    }

    /// Standard deviation of the focal length, and the covariances, as far as they are asked for.
    fn uncertainty(&self, work: &mut Workspace, excess: f64, focal_px: f64) -> (Option<f64>, Option<Covariances>) {
        if !self.needs_equations() {
            return (None, None);
        }
        let held = self.options.gauge == Gauge::Held;
        // A trace of damping fixes what the observations leave free; the camera does not depend on it.
        let damping = if held { 0.0 } else { 1e-9 };
        let factorised = self.reduce(&work.linearised, damping, &mut work.reduced);
        if factorised.and_then(|()| work.reduced.matrix.factorise()).is_none() {
            return (None, None);
        }
        let focal = self.options.refine_focal.then(|| self.camera_covariance(&work.reduced, focal_px));
        let covariances = (self.options.covariances && held).then(|| self.covariances(&work.reduced, excess, focal_px));
        (focal.map(|covariance| (excess * covariance[(0, 0)]).sqrt()), covariances)
    }
}

impl BundleReport {
    /// Counts an observation of a frame that took no part in the adjustment, whose squared distance is given, squared pixels.
    pub(crate) fn count(&mut self, o: &Observation, squared_px: f64) {
        let all: usize = self.frames.iter().map(|frame| frame.observations).sum();
        let mut whole = Fit { observations: all, rms_px: self.rms_px };
        for fit in [&mut self.frames[o.frame], &mut self.points[o.point], &mut whole] {
            let sum = fit.rms_px * fit.rms_px * fit.observations as f64 + squared_px;
            fit.observations += 1;
            fit.rms_px = (sum / fit.observations as f64).sqrt();
        }
        self.rms_px = whole.rms_px;
    }
}
