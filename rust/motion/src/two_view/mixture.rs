//! A motion together with the distribution of its distances: those of right matches are normal, those of wrong ones uniform.
//!
//! Generalised expectation–maximisation (Dempster, Laird and Rubin 1977): each round weighs the matches by the probability
//! that they are right, takes one step of the motion and refits the noise.

use super::essential::{most_in_front, pose_from_essential};
use super::kernel::{Equations, Matches, squares_of};
use super::refine::retract;
use super::{RoughTurn, essential_of, points, support, verdict};
use geometry::{Mat3, Transform, Vec2, Vec3};
use nalgebra::{Matrix5, Rotation3, Vector5};

/// Rounds at most.
const ROUNDS: usize = 40;
/// A step shorter than this, in standard deviations of the motion, is the last.
const SETTLED: f64 = 1e-2;

/// The standard deviation of correct matches that a threshold implies, in thresholds …
const EXPECTED_SIGMA: f64 = 0.35;
/// … which counts as much as so many matches.
const TRUST: f64 = 20.0;

/// How distances are distributed.
#[derive(Clone, Copy)]
struct Mixture {
    /// Variance of right matches.
    variance: f64,
    /// Density of wrong matches over the peak density of right ones.
    floor: f64,
    /// Peak density of right matches.
    peak: f64,
    /// Distances of wrong ones are spread over minus to plus this.
    reach: f64,
}

impl Mixture {
    /// `share`: part of right matches; `reach`: wrong distances are spread over `-reach…reach`.
    fn new(sigma: f64, share: f64, reach: f64) -> Self {
        let peak = share / (sigma * std::f64::consts::TAU.sqrt());
        Self { variance: sigma * sigma, floor: (1.0 - share) / (2.0 * reach) / peak, peak, reach }
    }

    /// Probability that a match at this squared distance is right; `factor`: how much likelier than others it is wrong.
    fn weight(&self, squared: f64, factor: f64) -> f64 {
        let right = (-0.5 * squared / self.variance).exp();
        right / (right + self.floor * factor)
    }

    /// The mixture that fits the squared distances best, given the weights by this one.
    fn refitted(&self, squares: &[f64], weights: &[f64], threshold: f64) -> Self {
        let (mut right, mut spread, mut wrong) = (0.0, 0.0, 0.0);
        for (squared, weight) in squares.iter().zip(weights) {
            right += weight;
            spread += weight * squared;
            wrong += (1.0 - weight) * squared;
        }
        let total = squares.len() as f64;
        // Five unknowns fit part of the noise. What the threshold says of it keeps a lucky few from declaring all others wrong.
        let said = EXPECTED_SIGMA * threshold;
        let variance = (spread + TRUST * said * said) / ((right - 5.0).max(0.0) + TRUST);
        let sigma = variance.sqrt().min(threshold);
        let reach = 2.0 * (wrong / (total - right).max(1.0)).sqrt();
        Self::new(sigma, (right / total).clamp(0.1, 0.98), reach.max(10.0 * threshold))
    }

    /// Negative logarithm of the likelihood of squared distances, and of the standard deviation's.
    fn surprise(&self, squares: &[f64], threshold: f64) -> f64 {
        let density = |squared: &f64| self.peak * ((-0.5 * squared / self.variance).exp() + self.floor);
        let said = (EXPECTED_SIGMA * threshold).powi(2) / self.variance;
        0.5 * TRUST * (said - said.ln()) - squares.iter().map(density).map(f64::ln).sum::<f64>()
    }
}

/// Matches and what else is known of their motion.
pub(super) struct Problem<'a> {
    pub(super) a: &'a [Vec2],
    pub(super) b: &'a [Vec2],
    pub(super) matches: &'a Matches,
    /// Distance of a right match at most.
    pub(super) threshold: f64,
    pub(super) rough_turn: Option<RoughTurn>,
}

/// A motion with the mixture that fits its distances.
pub(super) struct Fitted {
    pub(super) pose: Transform,
    mixture: Mixture,
    /// Negative logarithm of the likelihood, and of the rough turn's.
    surprise: f64,
    /// Which matches are more probably right than wrong.
    pub(super) inliers: Vec<bool>,
}

/// A twin less likely than the first motion by more than this per match is not refined.
const WORTH_A_LOOK: f64 = 0.5;
/// Where more than this share of the matches agree, no wrong one hides among them.
const CLEAN: f64 = 0.97;

impl Problem<'_> {
    /// The likeliest of some motions, the mirror of the first and one with the rough turn that has its points before the
    /// cameras.
    ///
    /// Seen from afar, a turn and the opposite turn of the depth-reversed points give nearly the same pictures: both motions
    /// are minima of the cost, and consensus may have found either.
    pub(super) fn likeliest(&self, starts: &[Transform]) -> Option<Fitted> {
        let mut fits = starts.iter().map(|start| self.refined(*start, &self.alike()));
        let first = fits.next()?;
        let (in_a, in_b) = (verdict::select(self.a, &first.inliers), verdict::select(self.b, &first.inliers));
        let inliers = Matches::new(&in_a, &in_b);
        let rough = self.rough_turn.and_then(|rough| moved_best(&in_a, &in_b, rough.b_from_a));
        let others = [depth_reversed(&in_a, &in_b, &first.pose), rough].into_iter().flatten().filter_map(|other| {
            // Plain least squares on matches known to be right reaches further than the mixture, which would forget them.
            let other = least_squares(&inliers, other, 10);
            let squares = squares_of(self.matches, &other);
            let surprise = first.mixture.surprise(&squares, self.threshold) + self.surprise_of_turn(&other);
            let close = surprise < first.surprise + WORTH_A_LOOK * self.a.len() as f64;
            close.then(|| self.refined(other, &self.alike()))
        });
        let others: Vec<Fitted> = others.chain(fits).collect();
        let valid = std::iter::once(first).chain(others).filter_map(|fitted| self.before_cameras(fitted));
        valid.min_by(|p, q| p.surprise.total_cmp(&q.surprise))
    }

    /// The fit again with matches left out that move along their lines as no neighbour does.
    pub(super) fn supported(&self, fitted: Fitted) -> Fitted {
        let agree = fitted.inliers.iter().filter(|i| **i).count();
        if (agree as f64) > CLEAN * self.a.len() as f64 {
            return fitted;
        }
        let factors = support::factors(self.a, self.b, &fitted.pose, &fitted.inliers, fitted.mixture.reach);
        let again = self.refined(fitted.pose, &factors);
        self.before_cameras(again).unwrap_or(fitted)
    }

    /// Nothing that tells wrong matches from right ones but their distance.
    fn alike(&self) -> Vec<f64> {
        vec![1.0; self.a.len()]
    }

    /// Negative logarithm of the rough turn's likelihood.
    fn surprise_of_turn(&self, pose: &Transform) -> f64 {
        self.rough_turn.as_ref().map_or(0.0, |rough| 0.5 * (rough.miss(pose) / rough.sigma_rad).norm_squared())
    }

    /// Adds the rough turn to the equations, on their scale.
    fn with_turn(&self, mut equations: Equations, pose: &Transform, variance: f64) -> Equations {
        if let Some(rough) = &self.rough_turn {
            let (miss, weight) = (rough.miss(pose), variance / rough.sigma_rad.powi(2));
            equations.cost += weight * miss.norm_squared();
            for k in 0..3 {
                equations.hessian[(k, k)] += weight;
                equations.gradient[k] += weight * miss[k];
            }
        }
        equations
    }

    fn refined(&self, start: Transform, factors: &[f64]) -> Fitted {
        let threshold = self.threshold;
        let (mut pose, mut mixture) = (start, Mixture::new(EXPECTED_SIGMA * threshold, 0.7, 10.0 * threshold));
        let (mut squares, mut moved) = (squares_of(self.matches, &pose), Vec::new());
        let mut damping = 1e-4;
        let mut weights = Vec::with_capacity(squares.len());
        for _ in 0..ROUNDS {
            weights.clear();
            weights.extend(squares.iter().zip(factors).map(|(squared, factor)| mixture.weight(*squared, *factor)));
            let equations = self.with_turn(self.matches.equations(&pose, &weights), &pose, mixture.variance);
            let Some(step) = damped_step(&equations, damping) else { break };
            let candidate = retract(&pose, &step);
            self.matches.squares(&essential_of(&candidate), &mut moved);
            let cost: f64 = weights.iter().zip(&moved).map(|(weight, squared)| weight * squared).sum();
            let cost = cost + 2.0 * mixture.variance * self.surprise_of_turn(&candidate);
            // Also false when the candidate is not finite.
            let better = cost <= equations.cost;
            // What the linearised cost gains is the squared length of the step in standard deviations.
            let length = (-equations.gradient.dot(&step) / mixture.variance).max(0.0).sqrt();
            if better {
                (pose, damping) = (candidate, (damping * 0.1).max(1e-9));
                std::mem::swap(&mut squares, &mut moved);
            } else {
                damping *= 10.0;
            }
            let before = mixture;
            mixture = mixture.refitted(&squares, &weights, threshold);
            let steady = (mixture.variance / before.variance - 1.0).abs() < 1e-2;
            if damping > 1e8 || (length < SETTLED && (steady || !better)) {
                break;
            }
        }
        let surprise = mixture.surprise(&squares, threshold) + self.surprise_of_turn(&pose);
        let right = |(squared, factor): (&f64, &f64)| mixture.weight(*squared, *factor) > 0.5;
        let inliers = squares.iter().zip(factors).map(right).collect();
        Fitted { pose, mixture, surprise, inliers }
    }

    /// The same fit with the points before both cameras: the distances are blind to the side on which they lie.
    fn before_cameras(&self, fitted: Fitted) -> Option<Fitted> {
        let (in_a, in_b) = (verdict::select(self.a, &fitted.inliers), verdict::select(self.b, &fitted.inliers));
        let pose = pose_from_essential(&essential_of(&fitted.pose), &in_a, &in_b)?;
        Some(Fitted { pose, ..fitted })
    }
}

impl RoughTurn {
    /// The rotation vector from the rough turn to a motion's.
    fn miss(&self, pose: &Transform) -> Vec3 {
        (pose.rotation * self.b_from_a.inverse()).scaled_axis()
    }
}

fn damped_step(equations: &Equations, damping: f64) -> Option<Vector5<f64>> {
    let mut damped: Matrix5<f64> = equations.hessian;
    (0..5).for_each(|k| damped[(k, k)] += damping * damped[(k, k)].max(1e-12));
    damped.cholesky().map(|factor| -factor.solve(&equations.gradient))
}

/// Gauss–Newton on all matches alike; a step that does not lower the cost is damped and tried again.
pub(super) fn least_squares(matches: &Matches, start: Transform, rounds: usize) -> Transform {
    reweighted(matches, start, rounds, |_| 1.0)
}

/// The same with weights by squared distance, chosen anew each round.
pub(super) fn reweighted(matches: &Matches, start: Transform, rounds: usize, weight: impl Fn(f64) -> f64) -> Transform {
    let (mut pose, mut damping) = (start, 1e-4);
    let (mut squares, mut moved) = (squares_of(matches, &pose), Vec::new());
    for _ in 0..rounds {
        let weights: Vec<f64> = squares.iter().map(|squared| weight(*squared)).collect();
        let equations = matches.equations(&pose, &weights);
        let Some(step) = damped_step(&equations, damping) else { break };
        let candidate = retract(&pose, &step);
        matches.squares(&essential_of(&candidate), &mut moved);
        let cost: f64 = weights.iter().zip(&moved).map(|(weight, squared)| weight * squared).sum();
        if cost < equations.cost {
            let settled = equations.cost - cost < 1e-4 * equations.cost;
            (pose, damping) = (candidate, damping * 0.1);
            std::mem::swap(&mut squares, &mut moved);
            if settled {
                break;
            }
        } else {
            damping *= 100.0;
        }
    }
    pose
}

/// The motion with a given turn whose epipolar lines pass nearest to the matches.
fn moved_best(a: &[Vec2], b: &[Vec2], rotation: Rotation3<f64>) -> Option<Transform> {
    let normal = |(a, b): (&Vec2, &Vec2)| (rotation * a.push(1.0)).cross(&b.push(1.0));
    let moments: Mat3 = a.iter().zip(b).map(normal).map(|n| n * n.transpose()).sum();
    let eigen = moments.try_symmetric_eigen(f64::EPSILON, 100)?;
    let translation = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    Some(Transform::new(rotation, translation))
}

/// The motion that keeps the centroid of the points and turns the depth-reversed points the opposite way.
fn depth_reversed(a: &[Vec2], b: &[Vec2], pose: &Transform) -> Option<Transform> {
    let (_, pose) = most_in_front(&essential_of(pose), a, b)?;
    let mut depths: Vec<f64> = a.iter().zip(b).filter_map(|(a, b)| points::point(&pose, a, b)).map(|p| p.z).collect();
    depths.sort_by(f64::total_cmp);
    // Far points of a poor motion would drag a mean away.
    let centre = (a.iter().sum::<Vec2>() / a.len() as f64).push(1.0) * *depths.get(depths.len() / 2)?;
    let mirror = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, -1.0));
    let rotation = Rotation3::from_matrix_unchecked(mirror * pose.rotation.matrix() * mirror);
    let translation = (pose.apply(&centre) - rotation * centre).try_normalize(1e-9)?;
    Some(Transform::new(rotation, translation))
}
