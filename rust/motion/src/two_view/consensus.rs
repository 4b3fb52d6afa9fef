//! Consensus over five-point samples, locally optimised, then refined as a mixture of right and wrong matches.
//!
//! Sources: Chum, Matas and Kittler 2003 (local optimisation), Torr and Zisserman 2000 (truncated score),
//! Chum and Matas 2005 (trusted matches first).

use super::essential::{most_in_front, pose_from_essential};
use super::refine::{refine_with, sampson_squared};
use super::{TwoView, TwoViewOptions, assemble, check_matches, essential_of, five_point, verdict};
use crate::MotionError;
use crate::random::{Random, samples_needed};
use crate::triangulate::triangulate;
use geometry::{Mat3, Transform, Vec2, Vec3};
use nalgebra::Rotation3;

/// Where the search stops telling distances apart, in parts of the largest distance of a right match: about 2.3 standard
/// deviations when that is 3.3. Beyond, among few matches, wrong ones decide which motion wins.
const TRUNCATION: f64 = 0.7;

/// The motion between two frames in spite of wrong matches.
///
/// `a`, `b`: matches in normalised coordinates. Fails when there are fewer than eight, when the head does not turn between
/// the frames, and when no motion explains three of ten.
pub fn robust(a: &[Vec2], b: &[Vec2], options: &TwoViewOptions) -> Result<TwoView, MotionError> {
    check_matches(a, b)?;
    check_options(options, a.len())?;
    let total = a.len();
    let start = Search { a, b, options, threshold2: (TRUNCATION * options.threshold).powi(2) }.run();
    let start = start.ok_or(MotionError::NoAgreement { agree: 0, total })?;
    let fitted = likelier_of_twins(a, b, start, options.threshold);
    let fitted = fitted.ok_or(MotionError::NoAgreement { agree: 0, total })?;
    let inliers = fitted.inliers(a, b);
    let agree = inliers.iter().filter(|i| **i).count();
    if agree < super::FEWEST || 10 * agree < 3 * total {
        return Err(MotionError::NoAgreement { agree, total });
    }
    let (in_a, in_b) = (verdict::select(a, &inliers), verdict::select(b, &inliers));
    let still = verdict::explained_by_rotation(&in_a, &in_b, 1.5 * options.threshold);
    if 10 * still >= 9 * agree {
        return Err(MotionError::NoParallax { agree: still, total });
    }
    Ok(assemble(a, b, fitted.pose, inliers))
}

fn check_options(options: &TwoViewOptions, total: usize) -> Result<(), MotionError> {
    if !(options.threshold > 0.0 && options.threshold.is_finite()) {
        return Err(MotionError::BadNumber { name: "the two-view threshold", value: options.threshold });
    }
    match options.order.iter().flatten().find(|i| **i >= total) {
        Some(&index) => Err(MotionError::BadIndex { table: "match order", kind: "match", index, count: total }),
        None => Ok(()),
    }
}

struct Search<'a> {
    a: &'a [Vec2],
    b: &'a [Vec2],
    options: &'a TwoViewOptions,
    threshold2: f64,
}

impl Search<'_> {
    fn run(&self) -> Option<Transform> {
        let (mut random, total) = (Random::new(self.options.seed), self.a.len());
        let (mut best, mut best_score) = (None, f64::INFINITY);
        let (mut needed, mut drawn) = (self.options.max_iterations, 0);
        while drawn < needed {
            let sample = self.draw(&mut random, drawn);
            drawn += 1;
            for essential in five_point(&sample.map(|i| self.a[i]), &sample.map(|i| self.b[i])) {
                if self.score(&essential, best_score) >= best_score {
                    continue;
                }
                let Some(pose) = self.optimise(&essential) else { continue };
                let score = self.score(&essential_of(&pose), best_score);
                if score < best_score {
                    (best, best_score) = (Some(pose), score);
                    let share = self.inliers(&essential_of(&pose)).len() as f64 / total as f64;
                    needed = samples_needed(share, 5, self.options.confidence).min(self.options.max_iterations);
                }
            }
        }
        best
    }

    /// Five matches from the front of the trusted order; the front widens to all over the first fifty draws.
    fn draw(&self, random: &mut Random, drawn: usize) -> [usize; 5] {
        match self.options.order.as_deref().filter(|order| order.len() >= 5) {
            Some(order) => random.sample((order.len() * (drawn + 10).min(60) / 60).max(5)).map(|i: usize| order[i]),
            None => random.sample(self.a.len()),
        }
    }

    /// Truncated sum of squared distances over the threshold's square, given up once it reaches `limit`.
    fn score(&self, essential: &Mat3, limit: f64) -> f64 {
        let mut sum = 0.0;
        for (a, b) in self.a.iter().zip(self.b) {
            sum += (sampson_squared(essential, a, b) / self.threshold2).min(1.0);
            if sum >= limit {
                break;
            }
        }
        sum
    }

    fn inliers(&self, essential: &Mat3) -> Vec<usize> {
        let within = |&i: &usize| sampson_squared(essential, &self.a[i], &self.b[i]) < self.threshold2;
        (0..self.a.len()).filter(within).collect()
    }

    /// The motion of a hypothesis, refined on all matches under a loss that forgets far ones.
    fn optimise(&self, essential: &Mat3) -> Option<Transform> {
        let inliers = self.inliers(essential);
        let pick = |points: &[Vec2]| -> Vec<Vec2> { inliers.iter().map(|&i| points[i]).collect() };
        let pose = pose_from_essential(essential, &pick(self.a), &pick(self.b))?;
        // Geman and McClure's loss forgets like the mixture without its exponentials.
        let forget = |squared: f64| {
            let weight = self.threshold2 / (squared + self.threshold2);
            (squared * weight, weight * weight)
        };
        Some(refine_with(self.a, self.b, &pose, 6, forget))
    }
}

/// Distances of right matches are normal, those of wrong ones uniform.
struct Mixture {
    /// Variance of right matches.
    variance: f64,
    /// Density of wrong matches over the peak density of right ones.
    floor: f64,
    /// Peak density of right matches.
    peak: f64,
}

impl Mixture {
    /// `share`: part of right matches; `reach`: wrong distances are spread over `-reach…reach`.
    fn new(sigma: f64, share: f64, reach: f64) -> Self {
        let peak = share / (sigma * std::f64::consts::TAU.sqrt());
        Self { variance: sigma * sigma, floor: (1.0 - share) / (2.0 * reach) / peak, peak }
    }

    /// Probability that a match at this squared distance is right.
    fn weight(&self, squared: f64) -> f64 {
        let right = (-0.5 * squared / self.variance).exp();
        right / (right + self.floor)
    }

    /// One round of expectation–maximisation on squared distances.
    fn refitted(&self, squares: &[f64], threshold: f64) -> Self {
        let (mut right, mut spread, mut wrong) = (0.0, 0.0, 0.0);
        for &squared in squares {
            let weight = self.weight(squared);
            right += weight;
            spread += weight * squared;
            wrong += (1.0 - weight) * squared;
        }
        let total = squares.len() as f64;
        // Five unknowns fit part of the noise. The bounds keep a lucky few from declaring all others wrong.
        let sigma = (spread / (right - 5.0).max(1.0)).sqrt().clamp(0.1 * threshold, threshold);
        let reach = 2.0 * (wrong / (total - right).max(1.0)).sqrt();
        Self::new(sigma, (right / total).clamp(0.1, 0.98), reach.max(10.0 * threshold))
    }

    /// Negative logarithm of the likelihood of squared distances.
    fn surprise(&self, squares: &[f64]) -> f64 {
        let density = |squared: &f64| self.peak * ((-0.5 * squared / self.variance).exp() + self.floor);
        -squares.iter().map(density).map(f64::ln).sum::<f64>()
    }

    /// Negative log-likelihood in squared units, and its weight.
    fn loss(&self, squared: f64) -> (f64, f64) {
        let right = (-0.5 * squared / self.variance).exp();
        let cost = -2.0 * self.variance * ((right + self.floor) / (1.0 + self.floor)).ln();
        (cost, right / (right + self.floor))
    }
}

/// A motion with the mixture that fits its distances.
struct Fitted {
    pose: Transform,
    mixture: Mixture,
    /// Negative logarithm of the likelihood.
    surprise: f64,
}

impl Fitted {
    fn inliers(&self, a: &[Vec2], b: &[Vec2]) -> Vec<bool> {
        squares(a, b, &self.pose).into_iter().map(|squared| self.mixture.weight(squared) > 0.5).collect()
    }

    /// The same fit with the points before both cameras: the distances are blind to the side on which they lie.
    fn before_cameras(self, a: &[Vec2], b: &[Vec2]) -> Option<Self> {
        let inliers = self.inliers(a, b);
        let (in_a, in_b) = (verdict::select(a, &inliers), verdict::select(b, &inliers));
        let pose = pose_from_essential(&essential_of(&self.pose), &in_a, &in_b)?;
        Some(Self { pose, ..self })
    }
}

/// A twin less likely than the first motion by more than this per match is not refined.
const WORTH_A_LOOK: f64 = 0.5;

/// Seen from afar, a turn and the opposite turn of the depth-reversed points give nearly the same pictures: both motions are
/// minima of the cost, and consensus may have found either. The likelier one with its points before the cameras is right.
fn likelier_of_twins(a: &[Vec2], b: &[Vec2], start: Transform, threshold: f64) -> Option<Fitted> {
    let first = refine_mixture(a, b, start, threshold);
    let inliers = first.inliers(a, b);
    let (in_a, in_b) = (verdict::select(a, &inliers), verdict::select(b, &inliers));
    // Plain least squares on matches known to be right reaches further than the mixture, which would forget them first.
    let twin =
        depth_reversed(&in_a, &in_b, &first.pose).map(|t| refine_with(&in_a, &in_b, &t, 10, |squared| (squared, 1.0)));
    // Only a twin that comes close is worth its own mixture.
    let close = |twin: &Transform| {
        first.mixture.surprise(&squares(a, b, twin)) < first.surprise + WORTH_A_LOOK * a.len() as f64
    };
    let second = twin.filter(close).map(|twin| refine_mixture(a, b, twin, threshold));
    let valid = [Some(first), second].into_iter().flatten().filter_map(|fitted| fitted.before_cameras(a, b));
    valid.min_by(|p, q| p.surprise.total_cmp(&q.surprise))
}

/// Squared distances of matches from a motion.
fn squares(a: &[Vec2], b: &[Vec2], pose: &Transform) -> Vec<f64> {
    let essential = essential_of(pose);
    a.iter().zip(b).map(|(a, b)| sampson_squared(&essential, a, b)).collect()
}

/// The motion that keeps the centroid of the points and turns the depth-reversed points the opposite way.
fn depth_reversed(a: &[Vec2], b: &[Vec2], pose: &Transform) -> Option<Transform> {
    let (_, pose) = most_in_front(&essential_of(pose), a, b)?;
    let rays = a.iter().zip(b).map(|(a, b)| [(Transform::identity(), *a), (pose, *b)]);
    let mut depths: Vec<f64> = rays.filter_map(|rays| triangulate(&rays)).map(|t| t.point.z).collect();
    depths.sort_by(f64::total_cmp);
    // Far points of a poor motion would drag a mean away.
    let centre = (a.iter().sum::<Vec2>() / a.len() as f64).push(1.0) * *depths.get(depths.len() / 2)?;
    let mirror = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, -1.0));
    let rotation = Rotation3::from_matrix_unchecked(mirror * pose.rotation.matrix() * mirror);
    let translation = (pose.apply(&centre) - rotation * centre).try_normalize(1e-9)?;
    Some(Transform::new(rotation, translation))
}

/// Expectation–maximisation of motion, noise, share of right matches and spread of wrong ones.
fn refine_mixture(a: &[Vec2], b: &[Vec2], start: Transform, threshold: f64) -> Fitted {
    let (mut pose, mut mixture) = (start, Mixture::new(0.5 * threshold, 0.7, 10.0 * threshold));
    let mut surprise = f64::INFINITY;
    for _ in 0..6 {
        pose = refine_with(a, b, &pose, 8, |squared| mixture.loss(squared));
        let squares = squares(a, b, &pose);
        mixture = mixture.refitted(&squares, threshold);
        let now = mixture.surprise(&squares);
        let settled = (surprise - now).abs() < 1e-3;
        surprise = now;
        if settled {
            break;
        }
    }
    Fitted { pose, mixture, surprise }
}
