//! Time that the processor spent.

use cpu_time::ProcessTime;
use std::time::Duration;

/// Rounds go on until they took this long together …
const ENOUGH: Duration = Duration::from_millis(400);
/// … and there are so many of them, but no more than so many. `peers/common.py` does the same.
const ROUNDS: std::ops::RangeInclusive<usize> = 3..=200;

/// Median processor time of `work`, milliseconds, after one round that is not counted.
pub fn median_ms<T>(mut work: impl FnMut() -> T) -> f64 {
    std::hint::black_box(work());
    let (started, mut rounds) = (ProcessTime::now(), Vec::new());
    while rounds.len() < *ROUNDS.start() || (rounds.len() < *ROUNDS.end() && started.elapsed() < ENOUGH) {
        let round = ProcessTime::now();
        std::hint::black_box(work());
        rounds.push(round.elapsed().as_secs_f64() * 1e3);
    }
    median(rounds)
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
    fn the_median_lies_between_the_middle_values() {
        assert!((median(vec![4.0, 1.0, 3.0, 2.0]) - 2.5).abs() < 1e-12);
        assert!(median(Vec::new()).is_nan());
    }
}
