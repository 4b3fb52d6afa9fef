//! `cargo x fuzz`: files broken at random, for longer than the tests take.

use crate::run::{cargo, run, say};
use std::time::{SystemTime, UNIX_EPOCH};

/// Targets of `tests/rust/tests/fuzz`, which share the time.
const TARGETS: u64 = 11;

/// Runs every target for its part of the minutes, one after the other; without a seed, from one of this moment.
pub fn fuzz(minutes: u64, seed: Option<u64>) -> anyhow::Result<()> {
    let seed = match seed {
        Some(seed) => seed,
        None => SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs(),
    };
    say(&format!("fuzz: again with --seed {seed}; an input that fails stays in target/fuzz"));
    // One after the other: the memory that an input takes is the process's.
    let mut tests = cargo(&["test", "--release", "--workspace", "--test", "fuzz", "--no-fail-fast"]);
    tests.args(["--", "--test-threads=1", "--nocapture"]);
    let seconds = (60 * minutes).div_ceil(TARGETS);
    run(tests.env("FACEWRIGHT_FUZZ_SECONDS", seconds.to_string()).env("FACEWRIGHT_FUZZ_SEED", seed.to_string()))
}
