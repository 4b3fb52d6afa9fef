//! Our correction: a surface seen from two sides moves its points in order and, nearby, affinely.
//!
//! On the Delaunay graph of frame `a` each match is compared with the local affine map of its neighbours; the scale of
//! a residual is the median over the picture or, where the surface bends more, over the neighbours, and a triangle that turns over between the frames counts against its
//! three corners. In each round the worst match of each neighbourhood goes, and the others are judged again without
//! it. What went is then searched again, near the place and with the warp its neighbours predict, and rejected only if
//! it is not found there. What the caller knows of the motion (an epipolar line, a predicted position) is one more
//! test; where the caller predicts positions and warps (from a head's pose), the neighbours are compared by how far
//! they are from their predictions, which leaves them only what the prediction has wrong.

use super::neighbours::{Displaced, Graph, LocalMap, MEDIAN_LENGTH, local_map};
use super::{CorrectError, Correction, Match, Outcome, Reason, positive};
use crate::pyramid::Pyramid;
use crate::track::{Guess, Status, TrackOptions, track};
use geometry::{Vec2, median};
use rayon::prelude::*;

/// A match found again in its old place may be so many times further from where its neighbours put it.
const FOUND_AGAIN: f64 = 2.5;

/// What the caller knows of where a match must be in `b`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Expectation {
    /// Nothing.
    #[default]
    Unknown,
    /// Near a position.
    Position(Vec2),
    /// Near the line `normal · x = offset`, with a normal of length one.
    Line {
        /// Unit normal.
        normal: Vec2,
        /// Distance from the origin along the normal, pixels.
        offset: f64,
    },
}

impl Expectation {
    /// Distance of a point of `b` from what is expected, pixels.
    pub fn distance(&self, point: &Vec2) -> f64 {
        match self {
            Self::Unknown => 0.0,
            Self::Position(position) => (point - position).norm(),
            Self::Line { normal, offset } => (normal.dot(point) - offset).abs(),
        }
    }
}

/// How strictly matches are judged and how they are searched again.
#[derive(Clone, Debug)]
pub struct GeometricOptions {
    /// A match may be so many standard deviations from where its neighbours put it.
    pub deviations: f64,
    /// It may always be this far from there, pixels.
    pub residual_px: f64,
    /// A triangle is flipped if its height in `b` is negative by more than this, pixels.
    pub flip_px: f64,
    /// A match may be this far from what the caller expects, pixels.
    pub expectation_px: f64,
    /// Rounds at most; each takes the worst match of each neighbourhood away.
    pub rounds: usize,
    /// How a match is searched again from its neighbours' prediction; `None` rejects instead.
    pub search: Option<TrackOptions>,
}

impl Default for GeometricOptions {
    fn default() -> Self {
        let search = TrackOptions { levels: 1, ..TrackOptions::default() };
        Self { deviations: 3.5, residual_px: 0.5, flip_px: 0.5, expectation_px: 2.0, rounds: 30, search: Some(search) }
    }
}

/// What the caller knows of the matches, one entry per match.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'a> {
    /// Where each point should be in `b`, and how its surroundings are warped there.
    pub predictions: Option<&'a [Guess]>,
    /// Where each point must be in `b`.
    pub expectations: Option<&'a [Expectation]>,
}

impl Known<'_> {
    fn check(&self, matches: usize) -> Result<(), CorrectError> {
        let counts = [self.predictions.map(<[_]>::len), self.expectations.map(<[_]>::len)];
        match counts.into_iter().flatten().find(|&count| count != matches) {
            Some(known) => Err(CorrectError::Known { known, matches }),
            None => Ok(()),
        }
    }

    /// Where a match comes from, and the warp it comes with.
    fn origin(&self, i: usize, m: &Match) -> Guess {
        self.predictions.map_or_else(|| Guess::at(m.a), |all| all[i])
    }
}

/// Judges matches by their neighbours and by what is `known`, and searches again those that fail.
pub fn geometric(
    a: &Pyramid,
    b: &Pyramid,
    matches: &[Match],
    known: &Known,
    options: &GeometricOptions,
) -> Result<Correction, CorrectError> {
    for (name, value) in [
        ("deviations", options.deviations),
        ("residual_px", options.residual_px),
        ("flip_px", options.flip_px),
        ("expectation_px", options.expectation_px),
    ] {
        positive(name, value)?;
    }
    known.check(matches.len())?;
    let correction = Correction::unchanged(matches);
    let usable: Vec<bool> = correction.outcomes.iter().map(|outcome| outcome.is_usable()).collect();
    let origins: Vec<Guess> = matches.iter().enumerate().map(|(i, m)| known.origin(i, m)).collect();
    let graph = Graph::new(&origins.iter().map(|origin| origin.position).collect::<Vec<_>>());
    let expectations = known.expectations;
    let mut judge =
        Judge { graph, origins, active: usable, scale: options.residual_px, correction, expectations, options };
    judge.correction.violations_before = judge.flips().0;
    judge.expect();
    judge.thin_out();
    judge.search_again(a, b)?;
    judge.correction.violations_after = judge.flips().0;
    Ok(judge.correction)
}

struct Judge<'a> {
    graph: Graph,
    /// Where each match comes from.
    origins: Vec<Guess>,
    /// Matches that their neighbours are judged by.
    active: Vec<bool>,
    /// Standard deviation of a residual along an axis, pixels.
    scale: f64,
    correction: Correction,
    expectations: Option<&'a [Expectation]>,
    options: &'a GeometricOptions,
}

impl Judge<'_> {
    fn displaced(&self) -> Vec<Displaced> {
        let pairs = self.origins.iter().zip(&self.correction.matches);
        pairs.map(|(origin, m)| Displaced { from: origin.position, to: m.b }).collect()
    }

    fn flips(&self) -> (usize, Vec<usize>) {
        self.graph.flips(&self.displaced(), &self.active, self.options.flip_px)
    }

    fn unexpected(&self, i: usize, point: &Vec2) -> bool {
        self.expectations.is_some_and(|all| all[i].distance(point) > self.options.expectation_px)
    }

    fn take_away(&mut self, i: usize, reason: Reason) {
        self.active[i] = false;
        self.correction.outcomes[i] = Outcome::Rejected(reason);
    }

    /// Takes away what is not where the caller expects it.
    fn expect(&mut self) {
        for i in 0..self.active.len() {
            if self.active[i] && self.unexpected(i, &self.correction.matches[i].b) {
                self.take_away(i, Reason::Expectation);
            }
        }
    }

    /// The local maps of all matches that satisfy a condition, in order.
    fn maps(&self, wanted: impl Fn(usize) -> bool + Sync) -> Vec<Option<LocalMap>> {
        let mut maps: Vec<Option<LocalMap>> = (0..self.active.len()).map(|_| None).collect();
        self.renew(&mut maps, wanted);
        maps
    }

    /// Makes those local maps anew that satisfy a condition.
    fn renew(&self, maps: &mut [Option<LocalMap>], wanted: impl Fn(usize) -> bool + Sync) {
        let displaced = self.displaced();
        maps.par_iter_mut()
            .with_min_len(16)
            .enumerate()
            .filter(|(i, _)| wanted(*i))
            .for_each(|(i, map)| *map = local_map(i, &self.graph, &displaced, &self.active));
    }

    /// Makes the maps of active matches anew that rest on matches that went.
    fn renew_without(&self, gone: &[usize], maps: &mut [Option<LocalMap>]) {
        let mut is_stale = vec![false; maps.len()];
        for &i in gone {
            maps[i] = None;
            self.graph.second[i].iter().for_each(|&j| is_stale[j] = true);
        }
        self.renew(maps, |i| is_stale[i] && self.active[i]);
    }

    /// The distance from its neighbours' prediction that a match may have, pixels.
    fn limit(&self, map: &LocalMap) -> f64 {
        self.options.residual_px.max(self.options.deviations * self.scale.max(map.scale)) * map.spread
    }

    /// Rounds of judging, until nothing more goes.
    fn thin_out(&mut self) {
        let mut maps = self.maps(|i| self.active[i]);
        for _ in 0..self.options.rounds {
            let residual = |i: usize| maps[i].as_ref().map(|map| (self.correction.matches[i].b - map.position).norm());
            let lengths = (0..maps.len()).filter_map(|i| Some(residual(i)? / maps[i].as_ref()?.spread));
            self.scale = median(lengths).unwrap_or(0.0) / MEDIAN_LENGTH;
            let (_, flips) = self.flips();
            // A flip accuses three matches; the residual tells which of them it is.
            let score = |i: usize| match &maps[i] {
                Some(map) if self.active[i] => residual(i).unwrap_or(0.0) / self.limit(map) + flips[i] as f64,
                _ => 0.0,
            };
            let scores: Vec<f64> = (0..maps.len()).map(score).collect();
            let worst_here =
                |&i: &usize| scores[i] > 1.0 && self.graph.first[i].iter().all(|&j| (scores[j], j) <= (scores[i], i));
            let gone: Vec<usize> = (0..scores.len()).filter(worst_here).collect();
            for &i in &gone {
                self.take_away(i, if flips[i] > 0 { Reason::Order } else { Reason::Residual });
            }
            if gone.is_empty() {
                break;
            }
            self.renew_without(&gone, &mut maps);
        }
        for (i, map) in maps.iter().enumerate() {
            if self.active[i] && map.is_none() {
                self.correction.outcomes[i] = Outcome::Rejected(Reason::Isolated);
            }
        }
        self.active = self.correction.outcomes.iter().map(|outcome| outcome.is_usable()).collect();
    }

    /// Gives matches that went another chance: where they are, if that agrees with what is left, or where they are
    /// found near their neighbours' prediction.
    fn search_again(&mut self, a: &Pyramid, b: &Pyramid) -> Result<(), CorrectError> {
        let maps = self.maps(|i| !self.active[i]);
        let mut lost = Vec::new();
        for (i, map) in maps.iter().enumerate() {
            if let (Some(map), Outcome::Rejected(reason)) = (map, self.correction.outcomes[i]) {
                let here = self.correction.matches[i].b;
                if (here - map.position).norm() <= self.limit(map) && !self.unexpected(i, &here) && self.stands(i, here)
                {
                    self.correction.outcomes[i] = Outcome::Kept;
                } else {
                    lost.push((i, map, reason));
                }
            }
        }
        let Some(search) = &self.options.search else { return Ok(()) };
        let points: Vec<Vec2> = lost.iter().map(|&(i, ..)| self.correction.matches[i].a).collect();
        let guess = |&(i, map, _): &(usize, &LocalMap, Reason)| Guess {
            position: map.position,
            warp: map.warp * self.origins[i].warp,
        };
        let guesses: Vec<Guess> = lost.iter().map(guess).collect();
        for (&(i, map, reason), found) in lost.iter().zip(track(a, b, &points, Some(&guesses), search)?) {
            if found.status != Status::Found || self.unexpected(i, &found.position) {
                continue;
            }
            let away = (found.position - map.position).norm() / self.limit(map);
            // A place found a second time from elsewhere has earned more trust than its neighbours alone give it.
            let again = (found.position - self.correction.matches[i].b).norm() <= self.options.residual_px;
            if away <= if again { FOUND_AGAIN } else { 1.0 } && self.stands(i, found.position) {
                self.correction.outcomes[i] = if again { Outcome::Kept } else { Outcome::Moved(reason) };
            }
        }
        Ok(())
    }

    /// Makes a match active at a place unless that flips a triangle.
    fn stands(&mut self, i: usize, place: Vec2) -> bool {
        let before = std::mem::replace(&mut self.correction.matches[i].b, place);
        self.active[i] = true;
        let flipped = self.flips().1[i] > 0;
        if flipped {
            self.correction.matches[i].b = before;
            self.active[i] = false;
        }
        !flipped
    }
}

#[cfg(test)]
mod tests {
    use super::super::neighbours::tests::{displaced, picture};
    use super::*;
    use crate::corners::{CornerOptions, detect};

    const SHIFT: Vec2 = Vec2::new(5.3, -2.6);

    /// Corners of the picture with their true matches, and the two pictures.
    fn scene() -> (Pyramid, Pyramid, Vec<Match>) {
        let a = picture(Vec2::zeros());
        let options = CornerOptions { max_count: 120, border: 20, ..Default::default() };
        let points: Vec<Vec2> = detect(&a, None, &options).unwrap().iter().map(|corner| corner.position).collect();
        (a, picture(SHIFT), displaced(&points, SHIFT))
    }

    fn expecting(expectations: &[Expectation]) -> Known<'_> {
        Known { expectations: Some(expectations), ..Known::default() }
    }

    #[test]
    fn planted_errors_are_moved_back_and_nothing_else() {
        let (a, b, mut matches) = scene();
        let planted: Vec<usize> = (0..matches.len()).step_by(6).collect();
        for &i in &planted {
            let turn = i as f64;
            matches[i].b += Vec2::new(turn.cos(), turn.sin()) * (2.0 + turn % 23.0);
        }
        let correction = geometric(&a, &b, &matches, &Known::default(), &GeometricOptions::default()).unwrap();
        assert!(correction.violations_before > 0);
        assert_eq!(correction.violations_after, 0);
        let mut recovered = 0;
        for (i, (m, outcome)) in correction.matches.iter().zip(&correction.outcomes).enumerate() {
            if outcome.is_usable() {
                assert!((m.b - m.a - SHIFT).norm() < 0.3, "{i} {outcome:?}");
            }
            match outcome {
                Outcome::Kept => assert!(!planted.contains(&i)),
                Outcome::Moved(_) => recovered += usize::from(planted.contains(&i)),
                Outcome::Rejected(_) => assert!(planted.contains(&i), "{i}"),
            }
        }
        assert!(recovered * 10 >= planted.len() * 8, "{recovered} of {}", planted.len());
    }

    #[test]
    fn a_smooth_turn_is_left_alone() {
        let (a, b, mut matches) = scene();
        // A cylinder that turns: the field bends, but keeps its order.
        for m in &mut matches {
            let angle = ((m.a.x - 120.0) / 140.0).asin() + 0.2;
            m.b = Vec2::new(120.0 + 140.0 * angle.sin(), m.a.y);
        }
        let correction = geometric(&a, &b, &matches, &Known::default(), &GeometricOptions::default()).unwrap();
        let kept = correction.outcomes.iter().filter(|&&outcome| outcome == Outcome::Kept).count();
        assert!(kept as f64 >= 0.97 * matches.len() as f64, "{kept} of {}", matches.len());
    }

    #[test]
    fn what_the_caller_expects_is_a_test_of_its_own() {
        let (a, b, matches) = scene();
        let mut expectations: Vec<Expectation> = matches.iter().map(|m| Expectation::Position(m.b)).collect();
        let (up, at) = (Vec2::y(), matches[7].b.y);
        expectations[7] = Expectation::Line { normal: up, offset: at + 5.0 };
        expectations[8] = Expectation::Line { normal: up, offset: matches[8].b.y - 0.5 };
        expectations[9] = Expectation::Unknown;
        let correction = geometric(&a, &b, &matches, &expecting(&expectations), &GeometricOptions::default()).unwrap();
        for (i, outcome) in correction.outcomes.iter().enumerate() {
            let expected = if i == 7 { Outcome::Rejected(Reason::Expectation) } else { Outcome::Kept };
            assert_eq!(*outcome, expected, "{i}");
        }
        let refused = geometric(&a, &b, &matches, &expecting(&[]), &GeometricOptions::default());
        assert!(matches!(refused, Err(CorrectError::Known { known: 0, .. })));
    }

    #[test]
    fn too_few_matches_cannot_be_judged() {
        let (a, b, matches) = scene();
        let correction = geometric(&a, &b, &matches[..3], &Known::default(), &GeometricOptions::default()).unwrap();
        assert_eq!(correction.outcomes, [Outcome::Rejected(Reason::Isolated); 3]);
        assert!(geometric(&a, &b, &[], &Known::default(), &GeometricOptions::default()).unwrap().matches.is_empty());
    }

    #[test]
    fn missing_matches_are_found_from_their_neighbours() {
        let (a, b, mut matches) = scene();
        let missing: Vec<usize> = (3..matches.len()).step_by(5).collect();
        missing.iter().for_each(|&i| matches[i] = Match::missing(matches[i].a));
        matches.push(Match { a: Vec2::new(f64::NAN, 1.0), b: Vec2::zeros() });
        let correction = geometric(&a, &b, &matches, &Known::default(), &GeometricOptions::default()).unwrap();
        assert_eq!(correction.outcomes.last(), Some(&Outcome::Rejected(Reason::Missing)));
        let found = missing.iter().filter(|&&i| correction.outcomes[i] == Outcome::Moved(Reason::Missing)).count();
        assert!(found * 10 >= missing.len() * 8, "{found} of {}", missing.len());
        for m in correction.usable() {
            assert!((m.b - m.a - SHIFT).norm() < 0.3);
        }
    }

    #[test]
    fn one_thread_and_four_give_the_same_bytes() {
        let (a, b, mut matches) = scene();
        matches.iter_mut().step_by(5).for_each(|m| m.b.x += 9.0);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| geometric(&a, &b, &matches, &Known::default(), &GeometricOptions::default()).unwrap())
        };
        assert_eq!(run(1), run(4));
    }
}
