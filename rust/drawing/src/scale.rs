//! Pixels of a picture that a pixel of the page shows, and how much of each.

/// Weights of neighbouring pixels along one axis; they add up to 1.
pub struct Weights {
    first: usize,
    weights: Vec<f64>,
}

impl Weights {
    /// Of the page's pixel that begins at `at`, where `count` pixels of the picture lie between `low` and `high`: a tent as
    /// wide as the larger of the two pixels, so that a finer picture is averaged and a coarser one interpolated.
    pub fn new(at: f64, (low, high): (f64, f64), count: usize) -> Self {
        let pitch = (high - low) / count as f64;
        let reach = (1.0 / pitch).max(1.0);
        let middle = ((at + 0.5 - low) / pitch - 0.5).clamp(0.0, count as f64 - 1.0);
        let first = (middle - reach).ceil().max(0.0) as usize;
        let last = ((middle + reach).floor() as usize).min(count - 1);
        let mut weights: Vec<f64> =
            (first..=last).map(|i| (1.0 - (i as f64 - middle).abs() / reach).max(0.0)).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        Self { first, weights }
    }

    /// The weighted mean of what the pixels are.
    pub fn mean(&self, level: impl Fn(usize) -> f64) -> f64 {
        self.weights.iter().enumerate().map(|(k, weight)| weight * level(self.first + k)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_levels_stay_and_all_pixels_count_alike() {
        for count in [1, 3, 40] {
            let weights: Vec<Weights> = (0..10).map(|at| Weights::new(f64::from(at), (0.0, 10.0), count)).collect();
            assert!(weights.iter().all(|w| (w.mean(|_| 7.0) - 7.0).abs() < 1e-12));
            let share = |i: usize| weights.iter().map(|w| w.mean(|k| f64::from(u8::from(k == i)))).sum::<f64>();
            for i in 5 * count / 10..count.div_ceil(2) {
                assert!((share(i) - 10.0 / count as f64).abs() < 0.35 * 10.0 / count as f64, "{i} of {count}");
            }
        }
    }
}
