//! Seconds per stage.

use std::collections::BTreeMap;
use std::time::Instant;

/// Adds up the time between calls under names.
pub struct Clock {
    last: Instant,
    seconds: BTreeMap<String, f64>,
}

impl Clock {
    /// Begins now.
    pub fn start() -> Self {
        Self { last: Instant::now(), seconds: BTreeMap::new() }
    }

    /// What passed since the last call belongs to `stage`.
    pub fn lap(&mut self, stage: &str) {
        let now = Instant::now();
        *self.seconds.entry(stage.to_owned()).or_default() += now.duration_since(self.last).as_secs_f64();
        self.last = now;
    }

    /// Seconds per stage, and their sum as `total`, to the millisecond.
    pub fn finish(self) -> BTreeMap<String, f64> {
        let total = self.seconds.values().sum();
        let mut seconds = self.seconds;
        seconds.insert("total".into(), total);
        seconds.values_mut().for_each(|s| *s = (*s * 1000.0).round() / 1000.0);
        seconds
    }
}
