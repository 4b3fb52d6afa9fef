//! How far points lie from the truth where nothing tells place, turn and size.

use crate::clock::median;
use geometry::{Similarity, Vec3};
use synthetic::Random;

/// Triples of points that are tried as the right ones.
const TRIPLES: usize = 300;
/// Rounds in which the points that agree choose the similarity anew.
const ROUNDS: usize = 10;
/// Points count as long as they are off by no more than this many robust standard deviations.
const AGREEING: f64 = 3.0;
/// Standard deviations of a normal number per median of its absolute value.
const SIGMA_PER_MEDIAN: f64 = 1.4826;

/// The similarity that brings most points to the truth, however far off the others are: the triple with the least median
/// (Rousseeuw 1984), then least squares of all that agree. `None` with fewer than three points.
pub fn similarity_of_most(points: &[Vec3], truth: &[Vec3]) -> Option<Similarity> {
    if points.len() < 3 {
        return None;
    }
    let mut random = Random::new(11);
    let mut pick = || (random.uniform() * points.len() as f64) as usize;
    let tried = (0..TRIPLES).filter_map(|_| {
        let triple = [pick(), pick(), pick()];
        let fit = Similarity::fit(&triple.map(|i| points[i]), &triple.map(|i| truth[i]), None, true)?;
        Some((median(errors_mm(&fit, points, truth)), fit))
    });
    let (_, mut best) = tried.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
    for _ in 0..ROUNDS {
        let errors = errors_mm(&best, points, truth);
        let limit = AGREEING * SIGMA_PER_MEDIAN * median(errors.clone());
        let weights: Vec<f64> = errors.iter().map(|error| f64::from(u8::from(*error <= limit))).collect();
        best = Similarity::fit(points, truth, Some(&weights), true)?;
    }
    Some(best)
}

/// The distance of each point from the truth, millimetres.
pub fn errors_mm(truth_from_points: &Similarity, points: &[Vec3], truth: &[Vec3]) -> Vec<f64> {
    points.iter().zip(truth).map(|(p, t)| 1e3 * (truth_from_points.apply(p) - t).norm()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Transform;
    use nalgebra::Rotation3;

    #[test]
    fn points_far_off_do_not_move_the_others() {
        let mut random = Random::new(1);
        let mut place = |size: f64| Vec3::new(random.normal(), random.normal(), random.normal()) * size;
        let truth: Vec<Vec3> = (0..100).map(|_| place(0.1)).collect();
        let turn = Rotation3::new(Vec3::new(0.4, -1.0, 0.2));
        let moved = Similarity { scale: 3.0, rigid: Transform::new(turn, Vec3::new(1.0, 2.0, 3.0)) };
        let mut points: Vec<Vec3> = truth.iter().map(|t| moved.apply(&(t + place(1e-4)))).collect();
        points.iter_mut().step_by(3).for_each(|point| *point += place(1e3));
        let fit = similarity_of_most(&points, &truth).unwrap();
        assert!(median(errors_mm(&fit, &points, &truth)) < 0.4);
        assert!((fit.scale * moved.scale - 1.0).abs() < 1e-3);
    }
}
