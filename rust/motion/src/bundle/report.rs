//! What an adjustment found and how good it is.

use super::State;
use super::linearise::{Layout, Linearised, squared};
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
    /// Whether it stopped because nothing more was to be gained.
    pub converged: bool,
    /// Root mean square distance between projections and observations, pixels.
    pub rms_px: f64,
    /// The fit of each frame.
    pub frames: Vec<Fit>,
    /// The fit of each point.
    pub points: Vec<Fit>,
    /// Standard deviation of each point if the cameras were exact, metres, root mean square over the axes; infinite for a
    /// point that nothing determines.
    pub point_sigma: Vec<f64>,
    /// Standard deviation of the focal length `fx`, pixels, if it was refined.
    pub focal_sigma_px: Option<f64>,
}

impl Layout<'_> {
    pub(super) fn report(
        &self,
        state: &State,
        linearised: &Linearised,
        initial_cost: f64,
        iterations: usize,
        converged: bool,
    ) -> BundleReport {
        let squares: Vec<f64> = self.sights.iter().map(|sight| squared(sight, state) / sight.information()).collect();
        let fit = |sights: &mut dyn Iterator<Item = usize>| {
            let (observations, sum) = sights.fold((0_usize, 0.0), |(count, sum), i| (count + 1, sum + squares[i]));
            Fit { observations, rms_px: (sum / observations.max(1) as f64).sqrt() }
        };
        let freedom = (2 * self.sights.len()).saturating_sub(self.unknowns()).max(1) as f64;
        // Standard deviations follow the noise that was met where it exceeds the one that was announced.
        let excess = (linearised.cost / freedom).max(1.0);
        let point_sigma = |hessian: &Mat3| {
            let covariance = hessian.try_inverse().filter(|c| c.iter().all(|v| v.is_finite()));
            covariance.map_or(f64::INFINITY, |c| (excess * c.trace() / 3.0).sqrt())
        };
        let focal_variance = self.intrinsic_covariance(linearised).filter(|_| self.options.refine_focal);
        BundleReport {
            initial_cost,
            final_cost: linearised.cost,
            iterations,
            converged,
            rms_px: fit(&mut (0..squares.len())).rms_px,
            frames: self.of_frame.iter().map(|sights| fit(&mut sights.iter().copied())).collect(),
            points: self.of_point.iter().map(|sights| fit(&mut sights.clone())).collect(),
            point_sigma: linearised.points.iter().map(|(hessian, _)| point_sigma(hessian)).collect(),
            focal_sigma_px: focal_variance.map(|c| state.camera.fx * (excess * c[(0, 0)]).sqrt()),
        }
    }
}

impl Fit {
    /// Counts one observation more, whose squared distance is given, squared pixels.
    pub(crate) fn add(&mut self, squared_px: f64) {
        let sum = self.rms_px * self.rms_px * self.observations as f64 + squared_px;
        self.observations += 1;
        self.rms_px = (sum / self.observations as f64).sqrt();
    }
}
