//! Points handed on from frame to frame where the reference's patch is not found: lips that smile look different, but not
//! from one frame to the next.
//!
//! The way forward begins where a point was last found by its reference, the way backward where it is found again; where
//! both arrive they must agree. Errors add up on the way, and so do the standard deviations: a point whose place has
//! become uncertain is given up.

use super::findings::{Findings, Loss};
use super::sequence::{CHUNK, Reference, Sequence, Shot};
use crate::FacewrightError;
use crate::patches::{Scene, Seed, Surface};
use geometry::{Progress, Vec2};
use rayon::prelude::*;
use std::collections::BTreeMap;
use vision::correct::{GeometricOptions, Known, Match, geometric};
use vision::track::{Guess, Status, Track, TrackOptions, track};

/// A point less certain than this is given up, pixels, one standard deviation.
const UNCERTAIN_PX: f64 = 0.8;
/// Least standard deviation of one step, pixels.
const STEP_PX: f64 = 0.05;
/// The ways forward and backward agree within so many standard deviations, or within a pixel.
const AGREEING: f64 = 3.0;

/// Points handed on: number of the point and index of the frame; place and one standard deviation.
type Relayed = BTreeMap<(usize, usize), (Vec2, f64)>;

/// Fills gaps of the findings.
pub(super) fn relay(
    sequence: &Sequence,
    references: &[Reference],
    findings: &mut Findings,
    progress: &Progress,
) -> Result<(), FacewrightError> {
    let frames: Vec<usize> = (0..sequence.len()).collect();
    let back: Vec<usize> = frames.iter().rev().copied().collect();
    let [there, returning] = progress.split(&[1.0, 1.0]);
    let forward = way(sequence, references, findings, &frames, &there)?;
    let backward = way(sequence, references, findings, &back, &returning)?;
    for (&(point, frame), there) in &forward {
        if let Some(found) = backward.get(&(point, frame)).map_or(Some(*there), |back| joined(there, back)) {
            findings.fill(point, frame, found);
        }
    }
    for (&(point, frame), back) in backward.iter().filter(|(key, _)| !forward.contains_key(key)) {
        findings.fill(point, frame, *back);
    }
    Ok(())
}

/// The mean of two places by their variances; none if they contradict each other.
fn joined(a: &(Vec2, f64), b: &(Vec2, f64)) -> Option<(Vec2, f64)> {
    let deviation = a.1.hypot(b.1);
    let agreeing = (a.0 - b.0).norm() <= (AGREEING * deviation).max(1.0);
    let weight = (b.1 / deviation).powi(2);
    agreeing.then(|| (a.0 * weight + b.0 * (1.0 - weight), a.1 * b.1 / deviation))
}

/// Hands points on along an order of frames.
fn way(
    sequence: &Sequence,
    references: &[Reference],
    findings: &Findings,
    frames: &[usize],
    progress: &Progress,
) -> Result<Relayed, FacewrightError> {
    let mut relayed = Relayed::new();
    let mut start = 0;
    while start + 1 < frames.len() {
        // The next piece begins with the last frame of this one.
        let piece = &frames[start..(start + CHUNK).min(frames.len())];
        progress.step(start, frames.len())?;
        let shots: Result<Vec<Option<Shot>>, FacewrightError> = piece.par_iter().map(|&i| sequence.shoot(i)).collect();
        let shots = shots?;
        let surfaces: Vec<Option<Surface>> =
            shots.par_iter().map(|shot| shot.as_ref().map(|shot| sequence.surface(shot))).collect();
        let pairs: Vec<_> = shots.iter().zip(&surfaces).collect();
        let scenes: Vec<Option<Scene>> =
            pairs.par_iter().map(|(shot, surface)| Some(sequence.scene(shot.as_ref()?, surface.as_ref()?))).collect();
        for k in 1..piece.len() {
            let is_cut = !sequence.clip.frames.is_one_film(piece[k - 1], piece[k]);
            if let (Some(from), Some(to), false) = (&scenes[k - 1], &scenes[k], is_cut) {
                let step = Step { references, findings, from, to, frames: (piece[k - 1], piece[k]) };
                step.hand_on(sequence, &mut relayed)?;
            }
        }
        start += piece.len() - 1;
    }
    Ok(relayed)
}

/// Two neighbouring frames.
struct Step<'a> {
    references: &'a [Reference<'a>],
    findings: &'a Findings,
    from: &'a Scene<'a>,
    to: &'a Scene<'a>,
    frames: (usize, usize),
}

impl Step<'_> {
    fn hand_on(&self, sequence: &Sequence, relayed: &mut Relayed) -> Result<(), FacewrightError> {
        let wanted = self.wanted(relayed);
        if wanted.is_empty() {
            return Ok(());
        }
        let points: Vec<Vec2> = wanted.iter().map(|w| w.seed.pixel).collect();
        let guesses: Vec<Guess> = wanted.iter().map(|w| w.guess).collect();
        let options = TrackOptions { levels: sequence.search.levels + 1, ..sequence.search.tracker(self.from) };
        let tracked = track(&self.from.skin.pyramid, &self.to.skin.pyramid, &points, Some(&guesses), &options)?;
        let vouched = self.vouched(&wanted, &tracked)?;
        for ((w, t), vouched) in wanted.iter().zip(&tracked).zip(vouched) {
            let sigma_px = w.sigma_px.hypot(t.sigma_px.max(STEP_PX));
            if vouched && t.status == Status::Found && sigma_px < UNCERTAIN_PX {
                relayed.insert((w.number, self.frames.1), (t.position, sigma_px));
            }
        }
        Ok(())
    }

    /// Points that the next frame should show and where they were not found by their reference.
    fn wanted(&self, relayed: &Relayed) -> Vec<Wanted> {
        let (from, to) = self.frames;
        let seeds = self
            .references
            .iter()
            .flat_map(|r| r.anchors.seeds.iter().enumerate().map(|(k, seed)| (r.first + k, seed)));
        let wanted = |(number, seed): (usize, &Seed)| {
            self.findings.at(number, to).err().filter(|(_, loss): &(usize, Loss)| loss.is_failure())?;
            let here = self.findings.at(number, from).ok().map(|o| (o.pixel, o.sigma_px));
            let (pixel, sigma_px) = here.or_else(|| relayed.get(&(number, from)).copied())?;
            let seed = Seed { pixel, point: seed.point };
            let guess = self.from.view.predict(&seed.point, &pixel, &self.to.view)?;
            Some(Wanted { number, seed, guess, sigma_px })
        };
        seeds.filter_map(wanted).collect()
    }

    /// Whether the points that their references found in both frames have nothing against each of the others.
    fn vouched(&self, wanted: &[Wanted], tracked: &[Track]) -> Result<Vec<bool>, FacewrightError> {
        let (from, to) = self.frames;
        let mut matches: Vec<Match> = wanted
            .iter()
            .zip(tracked)
            .map(|(w, t)| match t.status {
                Status::Found => Match { a: w.seed.pixel, b: t.position },
                _ => Match::missing(w.seed.pixel),
            })
            .collect();
        let mut guesses: Vec<Guess> = wanted.iter().map(|w| w.guess).collect();
        for reference in self.references {
            for (k, seed) in reference.anchors.seeds.iter().enumerate() {
                let number = reference.first + k;
                let (Ok(a), Ok(b)) = (self.findings.at(number, from), self.findings.at(number, to)) else { continue };
                let (a, b) = (a.pixel, b.pixel);
                let Some(guess) = self.from.view.predict(&seed.point, &a, &self.to.view) else { continue };
                matches.push(Match { a, b });
                guesses.push(guess);
            }
        }
        let known = Known { predictions: Some(&guesses), ..Known::default() };
        let options = GeometricOptions { search: None, ..GeometricOptions::default() };
        let judged = geometric(&self.from.skin.pyramid, &self.to.skin.pyramid, &matches, &known, &options)?;
        Ok(judged.outcomes[..wanted.len()].iter().map(|outcome| outcome.is_usable()).collect())
    }
}

/// A point to be found again in the next frame.
struct Wanted {
    number: usize,
    seed: Seed,
    guess: Guess,
    /// One standard deviation so far, pixels.
    sigma_px: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_ways_that_agree_are_joined_by_their_certainty() {
        let (a, b) = ((Vec2::new(10.0, 5.0), 0.1), (Vec2::new(10.4, 5.0), 0.2));
        let (place, sigma_px) = joined(&a, &b).unwrap();
        assert!((place - Vec2::new(10.08, 5.0)).norm() < 1e-12);
        assert!((sigma_px - 0.2 / 5.0_f64.sqrt()).abs() < 1e-12);
        assert!(joined(&a, &(Vec2::new(12.0, 5.0), 0.2)).is_none());
    }
}
