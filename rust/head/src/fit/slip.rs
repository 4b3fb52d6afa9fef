//! What is known beforehand about where the net's landmarks sit on this person's skin.
//!
//! The net's idea of a landmark differs from the anchor by the same amount in every frame, and neighbours are off
//! together. That is neither noise nor shape: each landmark gets a slip along the skin, shared by all frames, with a
//! Gaussian process as its prior: variance from the anchor, part of it common to landmarks within a correlation length.

use super::model::ModelLandmark;
use faer::Mat;
use faer::Side;
use faer::prelude::Solve;

/// `2L × 2L` inverse covariance of the slips (metres along [`ModelLandmark::tangents`]). `common` is the part of the
/// variance that neighbours share, below 1; `length` is where their correlation has fallen to `e^−½`.
pub(crate) fn precision(landmarks: &[ModelLandmark], scale: f64, common: f64, length: f64) -> Option<Mat<f64>> {
    let covariance = |row: usize, column: usize| {
        let (a, b) = (&landmarks[row / 2], &landmarks[column / 2]);
        let variance = a.sigma * b.sigma * scale * scale;
        let distance = (a.point.mean - b.point.mean).norm() / length;
        let shared = common * (-0.5 * distance * distance).exp();
        let own = if row / 2 == column / 2 { 1.0 - common } else { 0.0 };
        variance * (shared + own) * a.tangents[row % 2].dot(&b.tangents[column % 2])
    };
    let size = 2 * landmarks.len();
    let matrix = Mat::from_fn(size, size, covariance);
    Some(matrix.llt(Side::Lower).ok()?.solve(Mat::<f64>::identity(size, size)))
}
