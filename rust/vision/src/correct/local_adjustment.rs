//! The paper's local adjustment: no two matches on a line may cross (section 2.4, after Jia, Zhang and Lin 2000).
//!
//! The paper's steps, and what is done where its print leaves them open:
//! - *Lines.* Through every point runs a band of rows and a band of columns, so that lines overlap and a head that nods
//!   is ordered as well as one that turns. Two points are compared along the axis on which they are farther apart.
//! - *Cross matches.* Two points of a line cross if their order along it is not the same in both frames, or if they fall
//!   together in the second one.
//! - *The point with the most cross matches* goes first; of several the one that looks least alike in both frames.
//! - *The range of its new match* lies around the shift of its neighbours on its lines, of those that cross no other: as
//!   far off as the surface may be folded, so the wider the farther away they are.
//! - *The new match* is the place of that range with fewer cross matches that looks most alike (normalised cross
//!   correlation, less a little for places far from the neighbours' shift), finely placed by the tracker.
//! - *Until none is left.* A point for which there is no such place is set aside.
//!
//! Order alone does not see every wrong match: one that slid along a lash keeps its order. So the same search is then made
//! for each match that most of its neighbours contradict, or one of them where it also looks much less alike than others of
//! the two frames do; for those set aside; and for the points that the tracker had lost. Matches that most neighbours
//! still contradict then, or one where it does not look alike at all, are rejected.

mod lines;
mod range;
mod windows;

use super::{CorrectError, Correction, Match, Outcome, Reason, positive};
use crate::pyramid::Pyramid;
use crate::track::{Guess, Status, TrackOptions, track};
use geometry::Vec2;
use lines::{Lines, Neighbour, crosses};
use range::{Range, contradictions};
use windows::Windows;

/// Smaller windows look alike in too many places to be told apart, pixels.
const LEAST_WINDOW: usize = 11;
/// What a place loses in likeness at the limit of its range.
const FAR: f64 = 0.15;
/// The tracker does not place a match farther than this from where it looks most alike, pixels.
const FINE_PX: f64 = 2.0;
/// Matches that became right show others where to look: so often all are looked at.
const ROUNDS: usize = 3;

/// How lines are made and searched.
#[derive(Clone, Debug)]
pub struct LocalAdjustmentOptions {
    /// Height of the bands of rows and width of the bands of columns of `a` that count as lines, pixels; the paper gives
    /// none. About a fifth of a face's width: 24 suits 352×288.
    pub band_px: f64,
    /// Side of the tracker's window, pixels; odd. Windows that are compared are no smaller than it and 11 pixels.
    pub window: usize,
    /// How far two right matches' shifts differ by their own errors, pixels.
    pub slack_px: f64,
    /// How far they differ besides, per pixel that they are apart, before they contradict each other: skin that is
    /// inclined to the picture by 45° has 0.2 at a turn of 12°.
    pub gradient: f64,
    /// The same for places where a match is looked for; two that cross have more than 1.
    pub search_gradient: f64,
    /// A match that a neighbour contradicts is searched again if its correlation is below this part of the best tenth's.
    pub alike: f64,
    /// A match that a neighbour contradicts in the end is rejected if its correlation is below this, −1 … 1.
    pub least_likeness: f64,
}

impl Default for LocalAdjustmentOptions {
    fn default() -> Self {
        Self {
            band_px: 24.0,
            window: 7,
            slack_px: 1.5,
            gradient: 0.2,
            search_gradient: 0.5,
            alike: 0.8,
            least_likeness: 0.4,
        }
    }
}

/// Moves or rejects matches until no two on a line cross, and none is out of its range.
pub fn local_adjustment(
    a: &Pyramid,
    b: &Pyramid,
    matches: &[Match],
    options: &LocalAdjustmentOptions,
) -> Result<Correction, CorrectError> {
    positive("band_px", options.band_px)?;
    positive("slack_px", options.slack_px)?;
    positive("gradient", options.gradient)?;
    positive("search_gradient", options.search_gradient)?;
    let mut correction = Correction::unchanged(matches);
    let mut adjuster = Adjuster {
        pictures: [a, b],
        options,
        lines: Lines::new(matches, options.band_px),
        windows: Windows::new(a.finest(), b.finest(), options.window.max(LEAST_WINDOW)),
        against: correction.outcomes.iter().map(|outcome| (!outcome.is_usable()).then_some(Reason::Missing)).collect(),
        usable: correction.outcomes.iter().map(|outcome| outcome.is_usable()).collect(),
        matches: matches.to_vec(),
    };
    correction.violations_before = adjuster.cross_matches();
    adjuster.set_aside_unlike();
    adjuster.uncross();
    for _ in 0..ROUNDS {
        adjuster.bring_into_range();
        adjuster.search_set_aside();
    }
    adjuster.uncross();
    adjuster.reject();
    correction.violations_after = adjuster.cross_matches();
    for (i, outcome) in correction.outcomes.iter_mut().enumerate() {
        let reason = adjuster.against[i].unwrap_or(Reason::Order);
        let moved = adjuster.matches[i].b != matches[i].b;
        *outcome = match adjuster.usable[i] {
            true if moved => Outcome::Moved(reason),
            true => Outcome::Kept,
            false => Outcome::Rejected(reason),
        };
        if adjuster.usable[i] {
            correction.matches[i] = adjuster.matches[i];
        }
    }
    Ok(correction)
}

struct Adjuster<'p> {
    pictures: [&'p Pyramid; 2],
    options: &'p LocalAdjustmentOptions,
    lines: Lines,
    windows: Windows<'p>,
    matches: Vec<Match>,
    /// What was said against each match last.
    against: Vec<Option<Reason>>,
    /// Those not set aside.
    usable: Vec<bool>,
}

impl Adjuster<'_> {
    /// Moves the match with the most cross matches until there are none.
    fn uncross(&mut self) {
        loop {
            let counts = self.counts();
            let Some(most) = counts.iter().copied().max().filter(|&most| most > 0) else { return };
            let candidates = (0..counts.len()).filter(|&i| counts[i] == most).map(|i| (i, self.likeness(i)));
            let Some((i, _)) = candidates.collect::<Vec<_>>().into_iter().min_by(|x, y| x.1.total_cmp(&y.1)) else {
                return;
            };
            // A neighbour that crosses others is no bound.
            let near = self.lines.nearest(i, |j| self.usable[j] && counts[j] == 0);
            self.replace(i, &near, most, Reason::Order);
        }
    }

    /// Sets matches aside that look much less alike than others do and that a neighbour contradicts.
    fn set_aside_unlike(&mut self) {
        let usable: Vec<usize> = (0..self.matches.len()).filter(|&i| self.usable[i]).collect();
        let mut likeness: Vec<(f64, usize)> = usable.into_iter().map(|i| (self.likeness(i), i)).collect();
        likeness.sort_by(|x, y| x.0.total_cmp(&y.0));
        let Some((best_tenth, _)) = likeness.get(9 * likeness.len() / 10) else { return };
        let (least, counts) = (self.options.alike * best_tenth, self.counts());
        likeness.retain(|&(likeness, i)| likeness < least && self.contradictions(i) > 0.0);
        for (_, i) in likeness {
            self.usable[i] = false;
            self.against[i] = Some(if counts[i] > 0 { Reason::Order } else { Reason::Appearance });
        }
    }

    /// Searches each match again that most of its neighbours contradict, those that have most against them first.
    fn bring_into_range(&mut self) {
        let mut tried = vec![false; self.matches.len()];
        loop {
            let mut worst: Option<(f64, usize)> = None;
            for i in (0..self.matches.len()).filter(|&i| self.usable[i] && !tried[i]) {
                let share = self.contradictions(i);
                if share > 0.5 && worst.is_none_or(|(most, _)| share > most) {
                    worst = Some((share, i));
                }
            }
            let Some((share, i)) = worst else { return };
            tried[i] = true;
            let near = self.near(i);
            self.replace(i, &near, usize::MAX, Reason::Residual);
            self.usable[i] &= self.contradictions(i) < share;
        }
    }

    /// Searches the points that were set aside or lost where they cross none.
    fn search_set_aside(&mut self) {
        for i in 0..self.matches.len() {
            if !self.usable[i] {
                let near = self.near(i);
                if let Some(found) = self.search(i, &near, 1) {
                    self.matches[i].b = found;
                    self.usable[i] = true;
                }
            }
        }
    }

    /// Sets matches aside for good that their neighbours or their looks contradict.
    fn reject(&mut self) {
        for i in 0..self.matches.len() {
            if !self.usable[i] {
                continue;
            }
            let contradictions = self.contradictions(i);
            if contradictions > 0.5 {
                (self.usable[i], self.against[i]) = (false, Some(Reason::Residual));
            } else if contradictions > 0.0 && self.likeness(i) < self.options.least_likeness {
                (self.usable[i], self.against[i]) = (false, Some(Reason::Appearance));
            }
        }
    }

    /// Searches a match again and sets it aside if that finds none.
    fn replace(&mut self, i: usize, near: &[Neighbour], fewer_than: usize, reason: Reason) {
        self.against[i] = Some(reason);
        match self.search(i, near, fewer_than) {
            Some(found) => self.matches[i].b = found,
            None => self.usable[i] = false,
        }
    }

    /// Where a point looks most alike in its range with fewer cross matches than so many.
    fn search(&mut self, i: usize, near: &[Neighbour], fewer_than: usize) -> Option<Vec2> {
        let (u, options) = (self.matches[i].a, self.options);
        let range = Range::settle(&u, near, &self.matches, options.slack_px, options.search_gradient)?;
        // Candidates are whole pixels away from `u`, so that windows can be compared without interpolation.
        let middle = range.shift.map(f64::round);
        let reach = range.reach.ceil() as i64;
        let mut best: Option<(f64, Vec2)> = None;
        for (dy, dx) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dy, dx))) {
            let candidate = u + middle + Vec2::new(dx as f64, dy as f64);
            if self.crossings(i, &candidate) >= fewer_than {
                continue;
            }
            let Some(likeness) = self.windows.likeness(&u, &candidate) else { continue };
            let far = (candidate - u - range.shift) / range.reach;
            let score = likeness - FAR * far.norm_squared();
            if best.is_none_or(|(most, _)| score > most) {
                best = Some((score, candidate));
            }
        }
        let (_, coarse) = best?;
        let fine = self.finely_placed(&u, &coarse).filter(|fine| self.crossings(i, fine) < fewer_than);
        Some(fine.unwrap_or(coarse))
    }

    /// What the tracker makes of a place to the whole pixel; none if it does not stay there.
    fn finely_placed(&self, u: &Vec2, coarse: &Vec2) -> Option<Vec2> {
        let options = TrackOptions { levels: 1, forward_backward_px: None, ..TrackOptions::default() };
        let [a, b] = self.pictures;
        let tracks = track(a, b, &[*u], Some(&[Guess::at(*coarse)]), &options).ok()?;
        let found = tracks.first().filter(|track| track.status == Status::Found)?;
        Some(found.position).filter(|fine| (fine - coarse).norm() < FINE_PX)
    }

    /// Cross matches of point `i` if its match were `b`.
    fn crossings(&self, i: usize, b: &Vec2) -> usize {
        self.lines.of(i).iter().filter(|n| self.usable[n.index] && crosses(b, n, &self.matches)).count()
    }

    /// Cross matches of each point.
    fn counts(&self) -> Vec<usize> {
        let count = |i: usize| if self.usable[i] { self.crossings(i, &self.matches[i].b) } else { 0 };
        (0..self.matches.len()).map(count).collect()
    }

    /// Pairs that cross.
    fn cross_matches(&self) -> usize {
        self.counts().iter().sum::<usize>() / 2
    }

    fn near(&self, i: usize) -> Vec<Neighbour> {
        self.lines.nearest(i, |j| self.usable[j])
    }

    /// Which part of its neighbours contradicts a match.
    fn contradictions(&self, i: usize) -> f64 {
        let options = self.options;
        contradictions(&self.matches[i], &self.near(i), &self.matches, options.slack_px, options.gradient)
    }

    /// Correlation of a match; where a window leaves the frame nothing speaks against it.
    fn likeness(&mut self, i: usize) -> f64 {
        let m = self.matches[i];
        self.windows.likeness(&m.a, &m.b).unwrap_or(1.0)
    }
}

#[cfg(test)]
mod tests;
