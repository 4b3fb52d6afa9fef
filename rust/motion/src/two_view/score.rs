//! How well distances speak for a motion when the noise is not known (MAGSAC++, Baráth et al. 2020, for one dimension).
//!
//! The standard deviation of correct matches may be anything up to a largest one. Averaged over all of them, the weight of a squared
//! distance `x` (over twice the largest variance) is `E₁(x) - E₁(c)`, and the loss its integral; beyond `c` it is constant.

use std::sync::LazyLock;

/// The largest distance of a correct match, in largest standard deviations: 99 of 100 correct matches are nearer.
const REACH: f64 = 2.576;
/// Steps of the table over squared distances.
const STEPS: usize = 512;

/// Losses over squared distances from zero to the limit, one at the limit.
static LOSSES: LazyLock<[f64; STEPS + 1]> = LazyLock::new(|| {
    let loss = |k: usize| loss(CUT * k as f64 / STEPS as f64);
    std::array::from_fn(|k| loss(k) / loss(STEPS))
});
/// The argument `c` of the limit.
const CUT: f64 = 0.5 * REACH * REACH;

/// The integral of the weight from zero.
fn loss(x: f64) -> f64 {
    let spread = if x > 0.0 { x * (exponential_integral(x) - exponential_integral(CUT)) } else { 0.0 };
    spread + 1.0 - (-x).exp()
}

/// `E₁(x)`, the integral of `exp(-u) / u` from `x > 0` on: its series, or its continued fraction by Lentz.
fn exponential_integral(x: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if x < 1.0 {
        let (mut sum, mut term) = (-EULER - x.ln(), -1.0);
        for k in 1..30 {
            term *= -x / f64::from(k);
            sum += term / f64::from(k);
        }
        return sum;
    }
    let (mut fraction, mut b) = (0.0, x + 81.0);
    for k in (1..=40).rev() {
        fraction = f64::from(k * k) / (b - fraction);
        b -= 2.0;
    }
    (-x).exp() / (b - fraction)
}

/// The score of matches whose distance is at most a threshold where they are right.
pub(super) struct Score {
    losses: &'static [f64; STEPS + 1],
    limit: f64,
}

impl Score {
    pub(super) fn new(threshold: f64) -> Self {
        Self { losses: &LOSSES, limit: threshold * threshold }
    }

    /// The squared distance from which a match counts as wrong.
    pub(super) fn limit(&self) -> f64 {
        self.limit
    }

    /// Sum of losses, each at most one; given up once it reaches `limit`.
    pub(super) fn sum(&self, squares: &[f64], limit: f64) -> f64 {
        let (scale, mut sum) = (STEPS as f64 / self.limit, 0.0);
        for chunk in squares.chunks(16) {
            for squared in chunk {
                // A distance that is not a number becomes place zero, but no finite motion has one.
                sum += self.losses[((squared * scale) as usize).min(STEPS)];
            }
            if sum >= limit {
                break;
            }
        }
        sum
    }

    /// A weight that falls like the loss flattens, without its pole: Geman and McClure's for half the threshold.
    pub(super) fn weight(&self, squared: f64) -> f64 {
        let scale = 0.25 * self.limit;
        let weight = scale / (squared + scale);
        weight * weight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_integral_is_that_of_the_tables() {
        for (x, truth) in [(0.1, 1.822_923_958), (0.5, 0.559_773_595), (1.0, 0.219_383_934), (3.0, 0.013_048_381)] {
            assert!((exponential_integral(x) - truth).abs() < 1e-8, "{x}");
        }
    }

    #[test]
    fn losses_rise_from_zero_to_one_and_stay_there() {
        let score = Score::new(2.0);
        let at = |squared: f64| score.sum(&[squared], f64::INFINITY);
        assert!(at(0.0) == 0.0 && at(4.0) == 1.0 && at(1e9) == 1.0);
        for k in 0..100 {
            assert!(at(0.04 * f64::from(k)) <= at(0.04 * f64::from(k + 1)));
        }
        assert!(at(0.4) > 0.25, "steep where right matches are");
    }

    #[test]
    fn the_sum_is_given_up_at_its_limit() {
        let score = Score::new(1.0);
        let sum = score.sum(&[2.0; 1000], 10.0);
        assert!((10.0..=32.0).contains(&sum));
    }
}
