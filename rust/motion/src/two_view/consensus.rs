//! Consensus over five-point samples, locally optimised, then refined as a mixture of right and wrong matches.
//!
//! Sources: Chum, Matas and Kittler 2003 (local optimisation), Baráth, Noskova, Ivashechkin and Matas 2020 (MAGSAC++: the
//! score), Chum and Matas 2005 (PROSAC: trusted matches first).

use super::essential::pose_from_essential;
use super::kernel::Matches;
use super::mixture::{Problem, reweighted};
use super::score::Score;
use super::{TwoView, TwoViewOptions, assemble, check_matches, essential_of, five_point, verdict};
use crate::MotionError;
use crate::random::{Random, samples_needed};
use geometry::{Mat3, Transform, Vec2};

/// Rounds of a local optimisation.
const OPTIMISATION_ROUNDS: usize = 6;
/// Fewest draws: where hardly a match is wrong one sample explains them, but perhaps by another minimum than the right one.
const FEWEST_DRAWS: usize = 20;
/// Draws after which samples come from all matches whatever their order.
const TRUSTING_DRAWS: f64 = 200.0;

/// The motion between two frames in spite of wrong matches.
///
/// `a`, `b`: matches in normalised coordinates. Fails when there are fewer than eight, when the head does not turn between
/// the frames or the picture is merely magnified, and when no motion explains three of ten.
pub fn robust(a: &[Vec2], b: &[Vec2], options: &TwoViewOptions) -> Result<TwoView, MotionError> {
    check_matches(a, b)?;
    check_options(options, a.len())?;
    let total = a.len();
    let matches = Matches::new(a, b);
    let problem = Problem { a, b, matches: &matches, threshold: options.threshold, rough_turn: options.rough_turn };
    let starts = Search { a, b, matches: &matches, options, squares: Vec::new() }.run();
    let fitted = problem.likeliest(&starts).map(|fitted| problem.supported(fitted));
    let fitted = fitted.ok_or(MotionError::NoAgreement { agree: 0, total })?;
    let agree = fitted.inliers.iter().filter(|i| **i).count();
    if agree < super::FEWEST || 10 * agree < 3 * total {
        return Err(MotionError::NoAgreement { agree, total });
    }
    let (in_a, in_b) = (verdict::select(a, &fitted.inliers), verdict::select(b, &fitted.inliers));
    verdict::check_parallax(&in_a, &in_b, 1.5 * options.threshold, total)?;
    Ok(assemble(a, b, fitted.pose, fitted.inliers))
}

fn check_options(options: &TwoViewOptions, total: usize) -> Result<(), MotionError> {
    if !(options.threshold > 0.0 && options.threshold.is_finite()) {
        return Err(MotionError::BadNumber { name: "the two-view threshold", value: options.threshold });
    }
    if let Some(sigma) = options.rough_turn.map(|rough| rough.sigma_rad).filter(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(MotionError::BadNumber {
            name: "the standard deviation of the approximate rotation",
            value: sigma,
        });
    }
    match options.order.iter().flatten().find(|i| **i >= total) {
        Some(&index) => Err(MotionError::BadIndex { table: "match order", kind: "match", index, count: total }),
        None => Ok(()),
    }
}

struct Search<'a> {
    a: &'a [Vec2],
    b: &'a [Vec2],
    matches: &'a Matches,
    options: &'a TwoViewOptions,
    /// Room for squared distances.
    squares: Vec<f64>,
}

/// A sample's motion is optimised where its score is below this many times the best of all samples before.
const WORTH_OPTIMISING: f64 = 1.1;
/// Motions whose turns are further apart than this are different minima.
const DIFFERENT_RAD: f64 = 0.035;

/// A motion of the search.
struct Candidate {
    pose: Transform,
    score: f64,
}

impl Search<'_> {
    /// The best motion found, and the best that differs from it.
    fn run(&mut self) -> Vec<Transform> {
        let score = Score::new(self.options.threshold);
        let mut random = Random::new(self.options.seed);
        let mut found: Vec<Candidate> = Vec::new();
        let (mut best, mut best_sampled) = (f64::INFINITY, f64::INFINITY);
        let (mut needed, mut drawn) = (self.options.max_iterations, 0);
        while drawn < needed {
            let sample = self.draw(&mut random, drawn);
            drawn += 1;
            for essential in five_point(&sample.map(|i| self.a[i]), &sample.map(|i| self.b[i])) {
                let limit = WORTH_OPTIMISING * best_sampled;
                let sampled = self.score(&score, &essential, limit);
                if sampled >= limit {
                    continue;
                }
                best_sampled = best_sampled.min(sampled);
                let Some(candidate) = self.optimise(&score, &essential) else { continue };
                if candidate.score < best {
                    best = candidate.score;
                    let near = self.squares.iter().filter(|squared| **squared < score.limit()).count();
                    let clean = samples_needed(near as f64 / self.matches.len() as f64, 5, self.options.confidence);
                    needed = clean.max(FEWEST_DRAWS).min(self.options.max_iterations);
                }
                found.push(candidate);
            }
        }
        found.sort_by(|p, q| p.score.total_cmp(&q.score));
        let Some(first) = found.first().map(|best| best.pose) else { return Vec::new() };
        let differs = |candidate: &&Candidate| candidate.pose.angle_to(&first) > DIFFERENT_RAD;
        let second = found.iter().find(differs).map(|candidate| candidate.pose);
        std::iter::once(first).chain(second).collect()
    }

    /// Five matches from the front of the trusted order. The front grows as PROSAC's does: as if samples had been drawn from
    /// all matches and were taken in the order of their least trusted one.
    fn draw(&self, random: &mut Random, drawn: usize) -> [usize; 5] {
        let Some(order) = self.options.order.as_deref().filter(|order| order.len() >= 5) else {
            return random.sample(self.a.len());
        };
        // Of so many samples from all matches this share lies among the first n: about (n / all)⁵.
        let front = order.len() as f64 * ((drawn + 1) as f64 / TRUSTING_DRAWS).powf(0.2).min(1.0);
        random.sample((front.ceil() as usize).clamp(5, order.len())).map(|i: usize| order[i])
    }

    fn score(&mut self, score: &Score, essential: &Mat3, limit: f64) -> f64 {
        self.matches.squares(essential, &mut self.squares);
        score.sum(&self.squares, limit)
    }

    /// The motion of a hypothesis, refined on all matches with weights that forget far ones.
    fn optimise(&mut self, score: &Score, essential: &Mat3) -> Option<Candidate> {
        self.matches.squares(essential, &mut self.squares);
        let near: Vec<usize> = (0..self.a.len()).filter(|&i| self.squares[i] < score.limit()).collect();
        let pick = |points: &[Vec2]| -> Vec<Vec2> { near.iter().map(|&i| points[i]).collect() };
        let pose = pose_from_essential(essential, &pick(self.a), &pick(self.b))?;
        let pose = reweighted(self.matches, pose, OPTIMISATION_ROUNDS, |squared| score.weight(squared));
        let score = self.score(score, &essential_of(&pose), f64::INFINITY);
        Some(Candidate { pose, score })
    }
}
