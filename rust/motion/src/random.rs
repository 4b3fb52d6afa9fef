//! Seeded sampling for consensus loops: the same seed draws the same samples on every machine.

use geometry::SplitMix64;

/// Numbers from a stream of random bits.
pub(crate) struct Random(SplitMix64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// Uniform in `0..n`; the bias of the multiplication is below `n / 2⁶⁴`.
    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.0.bits()) * n as u128) >> 64) as usize
    }

    /// `K` different numbers of `0..n`; `n` must be at least `K`.
    pub(crate) fn sample<const K: usize>(&mut self, n: usize) -> [usize; K] {
        let mut chosen = [0; K];
        for i in 0..K {
            chosen[i] = loop {
                let candidate = self.below(n);
                if !chosen[..i].contains(&candidate) {
                    break candidate;
                }
            };
        }
        chosen
    }
}

/// Samples of `size` needed to draw one without outliers with the given confidence.
pub(crate) fn samples_needed(inlier_share: f64, size: i32, confidence: f64) -> usize {
    let clean = inlier_share.clamp(0.0, 1.0).powi(size);
    if clean >= 1.0 - 1e-12 {
        return 1;
    }
    let needed = (1.0 - confidence.clamp(0.0, 1.0 - 1e-12)).ln() / (-clean).ln_1p();
    // Without a clean sample to be had the quotient is infinite: draw as many as possible.
    if needed.is_finite() { needed.ceil().max(1.0) as usize } else { usize::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_different_and_reach_every_number() {
        let (mut random, mut seen) = (Random::new(1), [false; 7]);
        for _ in 0..100 {
            let s: [usize; 5] = random.sample(7);
            for i in 0..5 {
                assert!(s[i] < 7 && !s[..i].contains(&s[i]));
                seen[s[i]] = true;
            }
        }
        assert!(seen.iter().all(|s| *s));
    }

    #[test]
    fn sample_counts_are_those_of_the_textbook() {
        assert_eq!(samples_needed(0.5, 5, 0.99), 146);
        assert_eq!(samples_needed(1.0, 5, 0.99), 1);
        assert!(samples_needed(0.0, 5, 0.99) > 1_000_000);
    }
}
