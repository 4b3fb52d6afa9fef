//! The pose of a frame from points whose place is known.
//!
//! # Entry point
//! [`resect`]: from an initial pose where there is one that explains the frame, by three-point consensus otherwise; then
//! Gauss–Newton under a loss that forgets far points. [`settle`] is only the last.
//!
//! Sources: Fischler and Bolles 1981; Hartley and Zisserman, *Multiple View Geometry*, 7.

mod p3p;

use crate::MotionError;
use crate::random::{Random, samples_needed};
use geometry::least_squares::Loss;
use geometry::{Transform, Vec2, Vec3, skew};
use nalgebra::{Matrix2x3, Matrix6, SMatrix, Vector6};
use p3p::p3p;

/// A pose that is turned from the initial one by no more than this, squared, in its variance, needs no competitor.
const EXPECTED: f64 = 9.0;

/// Widths of the losses, in half thresholds: a rough start must hear points that are far off.
const ROUGH: [f64; 3] = [8.0, 2.0, 1.0];
const NARROW: [f64; 2] = [2.0, 1.0];

/// How [`resect`] searches.
#[derive(Clone, Copy, Debug)]
pub struct ResectOptions {
    /// Distance of a right point from its observation at most, normalised units: pixels over focal length.
    pub threshold: f64,
    /// Wanted probability of having drawn a sample without wrong points.
    pub confidence: f64,
    /// Samples drawn at most.
    pub max_iterations: usize,
    /// Fewest points that must agree.
    pub min_inliers: usize,
    /// Standard deviation of the initial rotation, radians, where something else than the points tells it: a pose that is
    /// turned away from it by `n` deviations must have `n²` more points on its side, or half of all if these are fewer: what
    /// tells the rotation may be wrong altogether. Without it, points alone decide.
    pub initial_sigma_rad: Option<f64>,
    /// Seed of the samples.
    pub seed: u64,
}

impl Default for ResectOptions {
    /// Two pixels at a focal length of 650, confidence 0.999, 500 samples, six points, nothing known of the rotation.
    fn default() -> Self {
        Self {
            threshold: 2.0 / 650.0,
            confidence: 0.999,
            max_iterations: 500,
            min_inliers: 6,
            initial_sigma_rad: None,
            seed: 0,
        }
    }
}

/// The pose of a frame.
#[derive(Clone, Debug)]
pub struct Resection {
    /// The pose.
    pub cam_from_x: Transform,
    /// Which points agree with it.
    pub inliers: Vec<bool>,
    /// Root mean square distance of the inliers from their observations, normalised units.
    pub rms: f64,
}

/// The pose `cam_from_x` of a frame that sees `points` (frame `x`) at `normalised` coordinates.
///
/// `initial` is kept to if at least half of the points agree with the pose it leads to, and that is as expected; otherwise all
/// poses compete. Fails
/// with fewer than four points, or when fewer than `min_inliers` or three of ten agree.
pub fn resect(
    points: &[Vec3],
    normalised: &[Vec2],
    initial: Option<Transform>,
    options: &ResectOptions,
) -> Result<Resection, MotionError> {
    let total = points.len();
    if normalised.len() != total {
        return Err(MotionError::BadIndex {
            table: "point table",
            kind: "point",
            index: total,
            count: normalised.len(),
        });
    }
    let needed = options.min_inliers.max(4);
    if total < needed {
        return Err(MotionError::TooFewPoints { found: total, needed });
    }
    let expected = initial.zip(options.initial_sigma_rad);
    let view = View { points, normalised, options, expected };
    let guessed = initial.map(|pose| view.refine(&pose, &ROUGH));
    let pose = match guessed {
        Some(pose) if 2 * view.count(&pose) >= total && view.unexpected(&pose) <= EXPECTED => pose,
        _ => view.consensus(guessed).ok_or(MotionError::NoPose { agree: 0, total })?,
    };
    let inliers: Vec<bool> = (0..total).map(|i| view.squared(&pose, i) < options.threshold.powi(2)).collect();
    let agree = view.count(&pose);
    if agree < needed || 10 * agree < 3 * total {
        return Err(MotionError::NoPose { agree, total });
    }
    let sum: f64 = (0..total).filter(|&i| inliers[i]).map(|i| view.squared(&pose, i)).sum();
    Ok(Resection { cam_from_x: pose, inliers, rms: (sum / agree as f64).sqrt() })
}

/// The pose `cam_from_x` near a given one that `points` (frame `x`) at `normalised` coordinates give, by those within the
/// threshold.
pub fn settle(points: &[Vec3], normalised: &[Vec2], near: &Transform, options: &ResectOptions) -> Transform {
    View { points, normalised, options, expected: None }.refine(near, &NARROW)
}

struct View<'a> {
    points: &'a [Vec3],
    normalised: &'a [Vec2],
    options: &'a ResectOptions,
    /// The initial pose and the standard deviation of its rotation.
    expected: Option<(Transform, f64)>,
}

impl View<'_> {
    /// Squared distance of a point from its observation; infinite behind the camera.
    fn squared(&self, pose: &Transform, i: usize) -> f64 {
        let p = pose.apply(&self.points[i]);
        if p.z > 0.0 { (p.xy() / p.z - self.normalised[i]).norm_squared() } else { f64::INFINITY }
    }

    fn count(&self, pose: &Transform) -> usize {
        let limit = self.options.threshold.powi(2);
        (0..self.points.len()).filter(|&i| self.squared(pose, i) < limit).count()
    }

    /// Truncated sum of squared distances over the threshold's square; a deviation from the expected turn counts as a
    /// wrong point.
    fn score(&self, pose: &Transform) -> f64 {
        let limit = self.options.threshold.powi(2);
        let unexpected = self.unexpected(pose).min(0.5 * self.points.len() as f64);
        unexpected + (0..self.points.len()).map(|i| (self.squared(pose, i) / limit).min(1.0)).sum::<f64>()
    }

    /// Squared deviation from the expected turn, in its variance; 0 where none is expected.
    fn unexpected(&self, pose: &Transform) -> f64 {
        self.expected.map_or(0.0, |(initial, sigma)| (pose.angle_to(&initial) / sigma).powi(2))
    }

    fn consensus(&self, guessed: Option<Transform>) -> Option<Transform> {
        let (mut random, total) = (Random::new(self.options.seed), self.points.len());
        let (mut best, mut best_score) = (guessed, guessed.map_or(f64::INFINITY, |pose| self.score(&pose)));
        let (mut drawn, mut needed) = (0, self.options.max_iterations);
        while drawn < needed {
            drawn += 1;
            let sample: [usize; 3] = random.sample(total);
            for pose in p3p(&sample.map(|i| self.points[i]), &sample.map(|i| self.normalised[i])) {
                if self.score(&pose) >= best_score {
                    continue;
                }
                // Drawn from wrong points as from right ones, it must not hear what is far from it.
                let refined = self.refine(&pose, &NARROW);
                let (kept, score) = self.better(pose, refined);
                (best, best_score) = (Some(kept), score);
                let share = self.count(&kept) as f64 / total as f64;
                needed = samples_needed(share, 3, self.options.confidence).min(self.options.max_iterations);
            }
        }
        best
    }

    fn better(&self, a: Transform, b: Transform) -> (Transform, f64) {
        let (of_a, of_b) = (self.score(&a), self.score(&b));
        if of_b < of_a { (b, of_b) } else { (a, of_a) }
    }

    /// Levenberg–Marquardt under narrower and narrower losses.
    fn refine(&self, start: &Transform, widths: &[f64]) -> Transform {
        let narrow = 0.5 * self.options.threshold;
        widths.iter().fold(*start, |pose, width| self.minimise(pose, Loss::Cauchy(width * narrow)))
    }

    fn minimise(&self, start: Transform, loss: Loss) -> Transform {
        let (mut pose, mut damping) = (start, 1e-6);
        let (mut cost, mut hessian, mut gradient) = self.linearise(&pose, loss);
        for _ in 0..12 {
            let mut damped = hessian;
            (0..6).for_each(|k| damped[(k, k)] *= 1.0 + damping);
            let Some(factor) = damped.cholesky() else { break };
            let candidate = pose.retract(&-factor.solve(&gradient));
            let next = self.linearise(&candidate, loss);
            // Also false when the candidate is not finite.
            if next.0 < cost {
                let converged = cost - next.0 < 1e-8 * cost;
                (pose, cost, hessian, gradient, damping) = (candidate, next.0, next.1, next.2, damping * 0.1);
                if converged {
                    break;
                }
            } else {
                damping = (damping * 10.0).max(1e-4);
            }
        }
        pose
    }

    /// Cost, `Jᵀ W J` and `Jᵀ W r`; points behind the camera cost as much as points a radian off and pull nowhere.
    fn linearise(&self, pose: &Transform, loss: Loss) -> (f64, Matrix6<f64>, Vector6<f64>) {
        let (mut cost, mut hessian, mut gradient) = (0.0, Matrix6::zeros(), Vector6::zeros());
        for (point, at) in self.points.iter().zip(self.normalised) {
            let turned = pose.rotation * point;
            let p = turned + pose.translation;
            if p.z.is_nan() || p.z <= 1e-9 {
                cost += loss.evaluate(1.0).0;
                continue;
            }
            let seen = p.xy() / p.z;
            let residual = seen - at;
            let by_cam = Matrix2x3::new(1.0, 0.0, -seen.x, 0.0, 1.0, -seen.y) / p.z;
            let mut jacobian = SMatrix::<f64, 2, 6>::zeros();
            jacobian.fixed_columns_mut::<3>(0).copy_from(&(-by_cam * skew(&turned)));
            jacobian.fixed_columns_mut::<3>(3).copy_from(&by_cam);
            let (value, weight) = loss.evaluate(residual.norm_squared());
            cost += value;
            hessian += jacobian.transpose() * jacobian * weight;
            gradient += jacobian.transpose() * residual * weight;
        }
        (cost, hessian, gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use synthetic::{Scene, SceneOptions};

    struct Frame {
        points: Vec<Vec3>,
        normalised: Vec<Vec2>,
        pose: Transform,
    }

    fn frame(seed: u64, points: usize, outliers: f64) -> Frame {
        let options = SceneOptions { seed, points, outliers, frames: 11, ..SceneOptions::default() };
        let scene = Scene::turning_head(&options);
        let index = seed as usize % 11;
        let seen: Vec<_> = scene.observations.iter().filter(|o| o.frame == index).collect();
        Frame {
            points: seen.iter().map(|o| scene.points[o.point]).collect(),
            normalised: seen.iter().map(|o| scene.camera.normalise(&o.pixel)).collect(),
            pose: scene.cam_from_head[index],
        }
    }

    fn check(frame: &Frame, initial: Option<Transform>) {
        let found = resect(&frame.points, &frame.normalised, initial, &ResectOptions::default()).unwrap();
        let turn = found.cam_from_x.angle_to(&frame.pose).to_degrees();
        let shift_mm = 1e3 * (found.cam_from_x.translation - frame.pose.translation).norm();
        assert!(turn < 1.2 && shift_mm < 6.0, "{turn} deg, {shift_mm} mm");
        assert!(found.rms * 615.0 < 0.6);
    }

    #[test]
    fn finds_the_pose_without_a_guess_among_40_percent_wrong_points() {
        for seed in 0..22 {
            check(&frame(seed, 150, 0.4), None);
        }
    }

    #[test]
    fn a_guess_12_degrees_off_leads_to_the_same_pose_and_a_wrong_one_does_no_harm() {
        for seed in 0..11 {
            let frame = frame(seed, 150, 0.1);
            check(&frame, Some(frame.pose.retract(&Vector6::new(0.1, 0.2, 0.0, 0.01, 0.0, 0.02))));
            check(&frame, Some(frame.pose.retract(&Vector6::new(0.0, 2.5, 0.0, 0.0, 0.0, 0.0))));
        }
    }

    #[test]
    fn half_the_points_that_moved_as_one_do_not_turn_the_head_away_from_what_is_known() {
        let frame = frame(5, 60, 0.0);
        // As a frown moves a forehead: the upper points are where a nod by 15 degrees would take them.
        let nod = frame.pose.retract(&Vector6::new(0.26, 0.0, 0.0, 0.0, 0.0, 0.0));
        let mut heights: Vec<f64> = frame.points.iter().map(|p| p.y).collect();
        heights.sort_by(f64::total_cmp);
        let middle = heights[heights.len() * 9 / 20];
        let seen = frame.points.iter().zip(&frame.normalised);
        let moved: Vec<Vec2> = seen
            .map(|(point, at)| {
                let nodded = nod.apply(point);
                if point.y > middle { nodded.xy() / nodded.z } else { *at }
            })
            .collect();
        let rough = frame.pose.retract(&Vector6::new(0.04, -0.03, 0.02, 0.0, 0.0, 0.0));
        let turn = |initial_sigma_rad: Option<f64>| {
            let options = ResectOptions { initial_sigma_rad, ..ResectOptions::default() };
            let found = resect(&frame.points, &moved, Some(rough), &options).unwrap();
            found.cam_from_x.angle_to(&frame.pose).to_degrees()
        };
        assert!(turn(None) > 10.0, "the moved points are the more: without what is known they win");
        assert!(turn(Some(0.05)) < 1.5, "{} degrees off", turn(Some(0.05)));
    }

    #[test]
    fn nonsense_and_too_few_points_are_refused() {
        let frame = frame(3, 150, 1.0);
        let options = ResectOptions::default();
        let found = resect(&frame.points, &frame.normalised, None, &options);
        assert!(matches!(found, Err(MotionError::NoPose { .. })), "{found:?}");
        let found = resect(&frame.points[..3], &frame.normalised[..3], None, &options);
        assert!(matches!(found, Err(MotionError::TooFewPoints { found: 3, .. })));
    }
}
