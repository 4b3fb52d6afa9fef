//! How a long loop says how far it is and learns that it should stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// The caller asked to stop; nothing was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

#[derive(Debug, Default)]
struct State {
    cancelled: AtomicBool,
    fraction_bits: AtomicU64,
    stage: Mutex<String>,
}

/// A handle shared by the one who computes and the one who watches. Clones watch the same work.
///
/// The computing side calls [`Progress::stage`] once per stage and [`Progress::step`] in its loops; the watching side
/// polls [`Progress::snapshot`] and may call [`Progress::cancel`] from any thread.
#[derive(Clone, Debug, Default)]
pub struct Progress(Arc<State>);

impl Progress {
    /// A handle nobody watches.
    pub fn new() -> Self {
        Self::default()
    }

    /// Names the stage that begins and sets its fraction to zero.
    pub fn stage(&self, name: &str) -> Result<(), Cancelled> {
        *self.0.stage.lock().unwrap_or_else(PoisonError::into_inner) = name.to_owned();
        self.step(0, 1)
    }

    /// `done` of `total` steps of the present stage are behind us. `Err` means: stop now.
    pub fn step(&self, done: usize, total: usize) -> Result<(), Cancelled> {
        let fraction = done as f64 / total.max(1) as f64;
        self.0.fraction_bits.store(fraction.to_bits(), Ordering::Relaxed);
        if self.0.cancelled.load(Ordering::Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    /// Asks the computing side to stop at its next step.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    /// The present stage's name and the fraction of it that is done, 0…1.
    pub fn snapshot(&self) -> (String, f64) {
        let stage = self.0.stage.lock().unwrap_or_else(PoisonError::into_inner).clone();
        (stage, f64::from_bits(self.0.fraction_bits.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clone_cancels_the_work() {
        let work = Progress::new();
        let watcher = work.clone();
        work.stage("track").unwrap();
        work.step(1, 4).unwrap();
        assert_eq!(watcher.snapshot(), ("track".to_owned(), 0.25));
        watcher.cancel();
        assert_eq!(work.step(2, 4), Err(Cancelled));
    }
}
