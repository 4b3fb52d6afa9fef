//! How a long loop says how far it is, shows what it has, and learns that it should stop.

use crate::Vec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Nothing is said of the time left before this much has passed …
const SOONEST: Duration = Duration::from_secs(1);
/// … and this fraction of the work is done.
const LEAST_FRACTION: f64 = 0.02;

/// The caller asked to stop; nothing was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// How far a work is.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgressSnapshot {
    /// Name of the present stage.
    pub stage: String,
    /// Part of the whole work that is done, 0…1; never less than before.
    pub fraction: f64,
    /// Seconds left, by what the work took so far; `None` while that tells nothing.
    pub remaining_s: Option<f64>,
    /// Number of the present step, counted from 1, and of all steps; `None` where the work has only one.
    pub step: Option<(usize, usize)>,
}

/// What is made, while it is being made.
#[derive(Clone, Debug)]
pub struct Sketch {
    /// How many came before it in the same work, and itself.
    pub number: usize,
    /// Places of the vertices, in the unit and frame of what is made.
    pub positions: Arc<[Vec3]>,
}

/// What all parts of a work share.
#[derive(Debug)]
struct Work {
    cancelled: AtomicBool,
    /// Bits of the fraction done: those of numbers that are not negative are in the numbers' order.
    fraction_bits: AtomicU64,
    stage: Mutex<String>,
    /// Number of the step that is furthest, and of all steps that are known of.
    step: AtomicUsize,
    steps: AtomicUsize,
    sketch: Mutex<Option<Sketch>>,
    started: Instant,
}

/// A handle shared by the one who computes and the one who watches. Clones watch the same work.
///
/// The computing side [splits](Progress::split) the handle into one for each step, calls [`Progress::stage`] when a step
/// begins and [`Progress::step`] in its loops; the watching side polls [`Progress::snapshot`] and may call
/// [`Progress::cancel`] from any thread. Of several stages of one handle, none is shown to be behind an earlier one.
#[derive(Clone, Debug)]
pub struct Progress {
    work: Arc<Work>,
    /// Fraction of the work that is done when this part begins.
    begin: f64,
    /// This part's share of the work.
    share: f64,
    /// Number of the step that it is, or is in; 0 where steps are not counted.
    step: usize,
}

impl Default for Progress {
    fn default() -> Self {
        let work = Work {
            cancelled: AtomicBool::new(false),
            fraction_bits: AtomicU64::new(0),
            stage: Mutex::new(String::new()),
            step: AtomicUsize::new(0),
            steps: AtomicUsize::new(0),
            sketch: Mutex::new(None),
            started: Instant::now(),
        };
        Self { work: Arc::new(work), begin: 0.0, share: 1.0, step: 0 }
    }
}

impl Progress {
    /// A handle nobody watches.
    pub fn new() -> Self {
        Self::default()
    }

    /// A handle for each of the steps that this part of the work consists of, one after the other; the weights are their
    /// times, in any unit.
    pub fn split<const N: usize>(&self, weights: &[f64; N]) -> [Self; N] {
        let total: f64 = weights.iter().sum();
        let unit = if total > 0.0 { self.share / total } else { 0.0 };
        let mut begin = self.begin;
        weights.map(|weight| {
            let part = Self { begin, share: unit * weight, ..self.clone() };
            begin += part.share;
            part
        })
    }

    /// The same, where each part that takes time is a step for the watching side to count; the first has this part's number.
    pub fn split_steps<const N: usize>(&self, weights: &[f64; N]) -> [Self; N] {
        let mut parts = self.split(weights);
        let mut next = self.step.max(1);
        for (part, weight) in parts.iter_mut().zip(weights) {
            part.step = next;
            next += usize::from(*weight > 0.0);
        }
        self.work.steps.fetch_max(next - 1, Ordering::Relaxed);
        parts
    }

    /// This part as a step, counted from 1, of a number of them that are known to come.
    pub fn as_step(&self, number: usize, steps: usize) -> Self {
        self.work.steps.fetch_max(steps, Ordering::Relaxed);
        Self { step: number, ..self.clone() }
    }

    /// A handle for each of a number of equal parts.
    pub fn split_evenly(&self, parts: usize) -> Vec<Self> {
        let share = self.share / parts.max(1) as f64;
        let part = |k: usize| Self { begin: self.begin + k as f64 * share, share, ..self.clone() };
        (0..parts).map(part).collect()
    }

    /// A handle for each of several rounds, the number of which nobody knows before: the first one, and one for all that follow it.
    pub fn round(&self) -> [Self; 2] {
        self.split(&[1.0, 1.0])
    }

    /// A handle for work in this part whose steps are counted outside of it: it can be cancelled, and moves nothing.
    pub fn uncounted(&self) -> Self {
        Self { share: 0.0, ..self.clone() }
    }

    /// Names the stage that begins.
    pub fn stage(&self, name: &str) -> Result<(), Cancelled> {
        *self.work.stage.lock().unwrap_or_else(PoisonError::into_inner) = name.to_owned();
        self.work.step.fetch_max(self.step, Ordering::Relaxed);
        self.step(0, 1)
    }

    /// Shows what is made as far as it is, in the place of what was shown before.
    pub fn show(&self, positions: &[Vec3]) {
        let mut sketch = self.work.sketch.lock().unwrap_or_else(PoisonError::into_inner);
        let number = sketch.as_ref().map_or(0, |before| before.number) + 1;
        *sketch = Some(Sketch { number, positions: positions.into() });
    }

    /// What was shown last.
    pub fn sketch(&self) -> Option<Sketch> {
        self.work.sketch.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// `done` of `total` steps of this part are behind us. `Err` means: stop now.
    pub fn step(&self, done: usize, total: usize) -> Result<(), Cancelled> {
        let part = (done as f64 / total.max(1) as f64).min(1.0);
        let fraction = (self.begin + self.share * part).clamp(0.0, 1.0);
        self.work.fraction_bits.fetch_max(fraction.to_bits(), Ordering::Relaxed);
        if self.work.cancelled.load(Ordering::Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    /// This part is done. `Err` means: stop now.
    pub fn done(&self) -> Result<(), Cancelled> {
        self.step(1, 1)
    }

    /// Asks the computing side to stop at its next step, in whatever part.
    pub fn cancel(&self) {
        self.work.cancelled.store(true, Ordering::Relaxed);
    }

    /// How far the whole work is, seen from any of its parts.
    pub fn snapshot(&self) -> ProgressSnapshot {
        let stage = self.work.stage.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let fraction = f64::from_bits(self.work.fraction_bits.load(Ordering::Relaxed));
        let [step, steps] = [&self.work.step, &self.work.steps].map(|number| number.load(Ordering::Relaxed));
        ProgressSnapshot {
            stage,
            fraction,
            remaining_s: remaining_s(self.work.started.elapsed(), fraction),
            step: (step > 0 && steps > 1).then_some((step, steps)),
        }
    }
}

/// Seconds left when a fraction took so long.
fn remaining_s(elapsed: Duration, fraction: f64) -> Option<f64> {
    let tells = elapsed >= SOONEST && fraction >= LEAST_FRACTION;
    tells.then(|| elapsed.as_secs_f64() * (1.0 - fraction) / fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fraction(progress: &Progress) -> f64 {
        progress.snapshot().fraction
    }

    #[test]
    fn a_clone_cancels_the_work() {
        let work = Progress::new();
        let watcher = work.clone();
        work.stage("track").unwrap();
        work.step(1, 4).unwrap();
        let shown = watcher.snapshot();
        assert_eq!((shown.stage.as_str(), shown.fraction), ("track", 0.25));
        watcher.cancel();
        assert_eq!(work.step(2, 4), Err(Cancelled));
    }

    #[test]
    fn parts_fill_their_shares_of_one_bar() {
        let work = Progress::new();
        let [first, second] = work.split(&[1.0, 3.0]);
        let [left, right] = second.split(&[2.0, 2.0]);
        first.step(1, 2).unwrap();
        assert_eq!(fraction(&work), 0.125);
        left.stage("left").unwrap();
        assert_eq!(fraction(&first), 0.25);
        right.step(1, 1).unwrap();
        assert_eq!(fraction(&work), 1.0);
        assert_eq!(work.snapshot().stage, "left");
    }

    #[test]
    fn the_bar_never_goes_back() {
        let work = Progress::new();
        let parts = work.split_evenly(4);
        parts[2].step(1, 2).unwrap();
        parts[1].stage("late").unwrap();
        work.step(1, 10).unwrap();
        assert_eq!(fraction(&work), 0.625);
        parts[3].step(9, 3).unwrap();
        assert_eq!(fraction(&work), 1.0);
    }

    #[test]
    fn cancelling_one_part_stops_all() {
        let work = Progress::new();
        let [first, second] = work.split(&[1.0, 1.0]);
        first.cancel();
        assert_eq!(second.stage("second"), Err(Cancelled));
    }

    #[test]
    fn parts_without_weight_take_nothing() {
        let [first, second] = Progress::new().split(&[0.0, 0.0]);
        first.step(1, 1).unwrap();
        assert_eq!(fraction(&second), 0.0);
    }

    #[test]
    fn steps_are_counted_on_through_the_parts_of_a_part() {
        let work = Progress::new();
        let [opening, working] = work.as_step(1, 4).split_steps(&[1.0, 9.0]);
        let [first, none, third, last] = working.split_steps(&[1.0, 0.0, 1.0, 1.0]);
        assert_eq!(work.snapshot().step, None);
        opening.stage("open").unwrap();
        assert_eq!(work.snapshot().step, Some((1, 4)));
        let [_, inner] = first.split(&[1.0, 1.0]);
        inner.stage("first").unwrap();
        assert_eq!(work.snapshot().step, Some((2, 4)));
        none.stage("what takes no time is no step").unwrap();
        third.stage("third").unwrap();
        last.stage("last").unwrap();
        third.stage("late").unwrap();
        assert_eq!(work.snapshot().step, Some((4, 4)));
    }

    #[test]
    fn work_of_one_step_counts_none() {
        let work = Progress::new();
        work.stage("motion").unwrap();
        assert_eq!(work.snapshot().step, None);
    }

    #[test]
    fn the_last_sketch_is_shown_from_whichever_part() {
        let work = Progress::new();
        assert!(work.sketch().is_none());
        let [first, second] = work.split(&[1.0, 1.0]);
        first.show(&[Vec3::x()]);
        second.show(&[Vec3::y(), Vec3::z()]);
        let sketch = work.sketch().unwrap();
        assert_eq!((sketch.number, &*sketch.positions), (2, &[Vec3::y(), Vec3::z()][..]));
    }

    #[test]
    fn rounds_of_an_unknown_number_take_half_of_what_is_left_each() {
        let work = Progress::new();
        let mut rest = work.clone();
        for expected in [0.5, 0.75, 0.875] {
            let [round, later] = rest.round();
            round.done().unwrap();
            assert_eq!(fraction(&work), expected);
            rest = later;
        }
    }

    #[test]
    fn what_is_uncounted_can_be_cancelled_and_moves_nothing() {
        let work = Progress::new();
        let [_, second] = work.split(&[1.0, 3.0]);
        let inner = second.uncounted();
        inner.done().unwrap();
        assert_eq!(fraction(&work), 0.25);
        work.cancel();
        assert_eq!(inner.step(0, 1), Err(Cancelled));
    }

    #[test]
    fn the_time_left_is_told_once_the_work_tells() {
        assert_eq!(remaining_s(Duration::from_secs(30), 0.75), Some(10.0));
        assert_eq!(remaining_s(Duration::from_secs(30), 0.01), None);
        assert_eq!(remaining_s(Duration::from_millis(20), 0.5), None);
    }
}
