//! A small random source with a fixed sequence, so that every build draws the same people.
//!
//! # Entry point
//! [`Random::new`].

use geometry::SplitMix64;

/// A random source.
#[derive(Clone, Debug)]
pub struct Random(SplitMix64);

impl Random {
    /// A source of its own for each pair of seed and stream.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut bits = SplitMix64::new(seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        bits.bits();
        Self(bits)
    }

    /// Uniform in the open interval 0…1.
    pub fn uniform(&mut self) -> f64 {
        ((self.0.bits() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Normal with the given mean and standard deviation (Box–Muller).
    pub fn normal(&mut self, mean: f64, deviation: f64) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        mean + deviation * radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    /// Symmetric Dirichlet weights: gamma variates of the given shape, normalised.
    pub fn dirichlet<const N: usize>(&mut self, shape: f64) -> [f64; N] {
        let gammas: [f64; N] = std::array::from_fn(|_| self.gamma(shape));
        let sum: f64 = gammas.iter().sum();
        gammas.map(|g| g / sum)
    }

    /// Gamma variate by Marsaglia and Tsang (2000), for shapes below one by their boosting rule.
    fn gamma(&mut self, shape: f64) -> f64 {
        let d = shape + 1.0 - 1.0 / 3.0;
        let c = 1.0 / (9.0 * d).sqrt();
        loop {
            let x = self.normal(0.0, 1.0);
            let v = (1.0 + c * x).powi(3);
            if v > 0.0 && self.uniform().ln() < 0.5 * x * x + d * (1.0 - v + v.ln()) {
                return d * v * self.uniform().powf(1.0 / shape);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_laws() {
        let mut random = Random::new(1, 0);
        let n = 40_000;
        let normals: Vec<f64> = (0..n).map(|_| random.normal(2.0, 3.0)).collect();
        let mean = normals.iter().sum::<f64>() / f64::from(n);
        let variance = normals.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        assert!((mean - 2.0).abs() < 0.06 && (variance - 9.0).abs() < 0.3, "{mean} {variance}");
        let gamma = (0..n).map(|_| random.gamma(0.6)).sum::<f64>() / f64::from(n);
        assert!((gamma - 0.6).abs() < 0.02, "{gamma}");
        let weights: [f64; 3] = random.dirichlet(0.6);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn streams_differ_and_repeat() {
        assert_eq!(Random::new(7, 3).uniform(), Random::new(7, 3).uniform());
        assert_ne!(Random::new(7, 3).uniform(), Random::new(7, 4).uniform());
    }
}
