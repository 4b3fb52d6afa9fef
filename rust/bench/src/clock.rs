//! Time that the processor spent.

use cpu_time::ProcessTime;
use std::time::Duration;

/// Rounds go on until they took this long together …
const ENOUGH: Duration = Duration::from_millis(400);
/// … and there are so many of them, but no more than so many. `peers/common.py` does the same.
const ROUNDS: std::ops::RangeInclusive<usize> = 3..=200;

/// Median processor time of `work`, milliseconds, and what its first round gave.
///
/// The first round is not counted, unless it alone took long enough: then what is cold at its start does not matter, and it
/// is the only one. The answer does not depend on how many rounds there were.
pub fn timed<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let (first, answer) = round(&mut work);
    if first >= ENOUGH {
        return (milliseconds(first), answer);
    }
    let (started, mut rounds) = (ProcessTime::now(), Vec::new());
    while rounds.len() < *ROUNDS.start() || (rounds.len() < *ROUNDS.end() && started.elapsed() < ENOUGH) {
        rounds.push(milliseconds(round(&mut work).0));
    }
    (median(rounds), answer)
}

/// Median processor time of `work`, milliseconds, where what it gives is of no interest.
pub fn median_ms<T>(work: impl FnMut() -> T) -> f64 {
    timed(work).0
}

fn round<T>(work: &mut impl FnMut() -> T) -> (Duration, T) {
    let started = ProcessTime::now();
    let answer = std::hint::black_box(work());
    (started.elapsed(), answer)
}

fn milliseconds(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

/// The middle value; not a number of nothing.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_is_the_first_rounds_and_a_long_round_is_the_only_one() {
        let mut rounds = 0;
        let count = |rounds: &mut i32| {
            *rounds += 1;
            *rounds
        };
        assert_eq!(timed(|| count(&mut rounds)).1, 1);
        assert!(rounds > 3);
        let (mut rounds, mut spent) = (0, ProcessTime::now());
        let (ms, answer) = timed(|| {
            spent = ProcessTime::now();
            while spent.elapsed() <= ENOUGH {}
            count(&mut rounds)
        });
        assert!(ms >= milliseconds(ENOUGH) && (rounds, answer) == (1, 1));
    }

    #[test]
    fn the_median_lies_between_the_middle_values() {
        assert!((median(vec![4.0, 1.0, 3.0, 2.0]) - 2.5).abs() < 1e-12);
        assert!(median(Vec::new()).is_nan());
    }
}
