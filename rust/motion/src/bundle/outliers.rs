//! Observations that do not fit, and how many go with them.

use super::{Bundle, Observation};

/// What [`reject_outliers`] removed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rejection {
    /// Observations removed.
    pub observations: usize,
    /// Robust standard deviation of the residuals, in announced standard deviations: 1 when the announcement was right.
    pub noise: f64,
    /// Distance beyond which an observation was removed, in announced standard deviations.
    pub limit: f64,
}

/// The distance of each observation from the projection of its point, in standard deviations; `None` where there is none.
pub fn residuals(bundle: &Bundle) -> Vec<Option<f64>> {
    let residual = |o: &Observation| {
        let in_cam = bundle.poses.get(o.frame)?.apply(bundle.points.get(o.point)?);
        Some((bundle.camera.project(&in_cam)? - o.pixel).norm() / o.sigma_px)
    };
    bundle.observations.iter().map(residual).collect()
}

/// Removes observations farther off than `limit` robust standard deviations of all residuals, or without a projection.
///
/// The robust standard deviation is the median distance over 1.177, the median of a normal error in two dimensions; it counts as at
/// least 0.5 announced standard deviations, so that perfect data are not thinned out.
pub fn reject_outliers(bundle: &mut Bundle, limit: f64) -> Rejection {
    let residuals = residuals(bundle);
    let mut sorted: Vec<f64> = residuals.iter().flatten().copied().collect();
    sorted.sort_by(f64::total_cmp);
    let noise = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0) / 1.177;
    let limit = limit * noise.max(0.5);
    let before = bundle.observations.len();
    let mut keep = residuals.iter().map(|r| r.is_some_and(|r| r <= limit));
    bundle.observations.retain(|_| keep.next().unwrap_or(false));
    Rejection { observations: before - bundle.observations.len(), noise, limit }
}
