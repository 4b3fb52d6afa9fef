//! How much less information tracks hold than they claim: their errors are larger than announced, and correlated from frame to frame.
//!
//! A tracked point of the skin errs by the shape that its patch had when it was chosen, and by the skin's motion relative to
//! the skull; both last for many frames. Counted as independent, a few hundred frames would outvote any prior.
//!
//! The time over which errors stay correlated is the integrated autocorrelation time (Sokal 1997, section 3), taken over all
//! tracks together.

use crate::bundle::{Bundle, Observation};
use geometry::Vec2;
use geometry::least_squares::Loss;

/// Errors whose correlation is below this are taken for independent.
const INDEPENDENT: f64 = 0.05;

/// The variance inflation of a bundle's observations, all frames counted as independent: the observed variance in parts of that
/// announced, times the number of frames over which errors stay correlated. At least 1.
pub(super) fn variance_inflation(bundle: &Bundle, loss: Loss) -> f64 {
    let tracks = residuals(bundle, loss);
    let count: usize = tracks.iter().map(Vec::len).sum();
    let unknowns = 6 * bundle.poses.len() + 3 * tracks.iter().filter(|track| !track.is_empty()).count();
    let freedom = (2 * count).saturating_sub(unknowns).max(1) as f64;
    let squares: f64 = tracks.iter().flatten().map(Vec2::norm_squared).sum();
    (squares / freedom * correlation_time(&tracks)).max(1.0)
}

/// Residuals of each point's observations in the order of the frames, in standard deviations, as far as the loss counts them.
fn residuals(bundle: &Bundle, loss: Loss) -> Vec<Vec<Vec2>> {
    let mut ordered: Vec<&Observation> = bundle.observations.iter().collect();
    ordered.sort_by_key(|o| o.frame);
    let mut tracks = vec![Vec::new(); bundle.points.len()];
    for o in ordered {
        let at = bundle.camera.project(&bundle.poses[o.frame].apply(&bundle.points[o.point]));
        let Some(residual) = at.map(|at| (at - o.pixel) / o.sigma_px) else { continue };
        tracks[o.point].push(residual * loss.evaluate(residual.norm_squared()).1.sqrt());
    }
    tracks
}

/// Number of frames over which errors stay correlated: 1 plus twice the correlations at all lags until they vanish.
fn correlation_time(tracks: &[Vec<Vec2>]) -> f64 {
    let longest = tracks.iter().map(Vec::len).max().unwrap_or(0);
    let moment = |lag: usize| {
        let pairs = tracks.iter().flat_map(|track| track.iter().zip(track.iter().skip(lag)));
        let (sum, count) = pairs.fold((0.0, 0_usize), |(sum, count), (a, b)| (sum + a.dot(b), count + 1));
        sum / count.max(1) as f64
    };
    let variance = moment(0);
    if variance <= 0.0 {
        return 1.0;
    }
    let correlations = (1..longest).map(|lag| moment(lag) / variance);
    1.0 + 2.0 * correlations.take_while(|correlation| *correlation > INDEPENDENT).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Camera, Transform, Vec3};
    use synthetic::Random;

    /// A point straight ahead in many frames, seen where errors put it that keep `memory` of themselves from frame to frame.
    fn seen(memory: f64, sigma_px: f64) -> Bundle {
        let (frames, points) = (60, 300);
        let camera = Camera::centred(640, 480, 500.0);
        let (pose, point) = (Transform::identity(), Vec3::new(0.0, 0.0, 0.5));
        let at = camera.project(&point).unwrap();
        let mut random = Random::new(3);
        let mut observations = Vec::new();
        for point in 0..points {
            let mut error = random.normal2(1.0);
            for frame in 0..frames {
                observations.push(Observation { frame, point, pixel: at + error * sigma_px, sigma_px: 0.2 });
                error = error * memory + random.normal2((1.0 - memory * memory).sqrt());
            }
        }
        Bundle { camera, poses: vec![pose; frames], points: vec![point; points], observations }
    }

    #[test]
    fn errors_that_stay_alike_count_as_fewer_frames() {
        // The autocorrelation time of an autoregressive error is (1 + memory) / (1 − memory).
        for (memory, time) in [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0)] {
            let found = variance_inflation(&seen(memory, 0.2), Loss::Squared);
            assert!((found / time - 1.0).abs() < 0.15, "{found} instead of {time}");
        }
        let found = variance_inflation(&seen(0.0, 0.6), Loss::Squared);
        assert!((found / 9.0 - 1.0).abs() < 0.15, "{found} for three times the noise");
    }

    #[test]
    fn perfect_and_missing_observations_count_as_announced() {
        assert_eq!(variance_inflation(&seen(0.5, 0.0), Loss::Squared), 1.0);
        let none = Bundle { observations: Vec::new(), ..seen(0.0, 0.2) };
        assert_eq!(variance_inflation(&none, Loss::Squared), 1.0);
    }
}
