//! Eight numbers at a time, in plain Rust that compilers turn into vector instructions, and the error function of them.

use std::ops::{Add, Mul, Neg, Sub};

/// Numbers computed together.
pub(super) const LANES: usize = 8;

/// Eight numbers; operators work on each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lanes(pub(super) [f32; LANES]);

impl Lanes {
    #[cfg(test)]
    pub(super) fn all(value: f32) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    pub(super) fn map(self, f: impl Fn(f32) -> f32) -> Self {
        // The standard library's maps of arrays are not inlined into code for wider vectors.
        let mut result = self;
        for value in &mut result.0 {
            *value = f(*value);
        }
        result
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut result = self;
        for (a, b) in result.0.iter_mut().zip(&other.0) {
            *a = f(*a, *b);
        }
        result
    }

    /// `self · factor + sum`, rounded once if `FUSED`.
    #[inline(always)]
    pub(super) fn times_plus<const FUSED: bool>(self, factor: Self, sum: Self) -> Self {
        let mut result = sum;
        for (k, value) in result.0.iter_mut().enumerate() {
            *value = times_plus::<FUSED>(self.0[k], factor.0[k], *value);
        }
        result
    }

    /// The sum, in double precision.
    pub(super) fn sum(self) -> f64 {
        self.0.iter().map(|&v| f64::from(v)).sum()
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $op:tt) => {
        impl $trait for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }

        impl $trait<f32> for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: f32) -> Self {
                self.map(|a| a $op other)
            }
        }
    };
}

operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);

impl Neg for Lanes {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

/// `a · b + c`, rounded once if `FUSED`.
#[inline(always)]
fn times_plus<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// The polynomial with these coefficients, that of the highest power first.
#[inline(always)]
fn polynomial<const FUSED: bool, const COUNT: usize>(x: f32, coefficients: [f32; COUNT]) -> f32 {
    let mut value = coefficients[0];
    for coefficient in &coefficients[1..] {
        value = times_plus::<FUSED>(value, x, *coefficient);
    }
    value
}

/// `erf(x)` within 5e-7 (Abramowitz and Stegun, 7.1.26) and `exp(−x²)`.
#[inline(always)]
pub(super) fn erf_and_gauss<const FUSED: bool>(x: Lanes) -> (Lanes, Lanes) {
    let gauss = (x * x).map(exp_negative::<FUSED>);
    let series = x.map(|x| {
        let t = 1.0 / times_plus::<FUSED>(0.327_591_1, x.abs(), 1.0);
        t * polynomial::<FUSED, 5>(t, [1.061_405_4, -1.453_152_1, 1.421_413_8, -0.284_496_74, 0.254_829_6])
    });
    let magnitude = -(series * gauss) + 1.0;
    (magnitude.zip(x, f32::copysign), gauss)
}

/// `exp(−x)` for `x ≥ 0`, within 3e-7 of it; about 1e-38 from 87 on.
#[inline(always)]
fn exp_negative<const FUSED: bool>(x: f32) -> f32 {
    /// Added to a small number, it leaves the nearest integer in the mantissa's last bits.
    const ROUND: f32 = 12_582_912.0;
    let power = x.min(87.0) * -std::f32::consts::LOG2_E;
    let shifted = power + ROUND;
    let f = (power - (shifted - ROUND)) * std::f32::consts::LN_2;
    let series = polynomial::<FUSED, 6>(f, [0.008_374_16, 0.041_665_795, 0.166_666_5, 0.5, 1.0, 1.0]);
    let exponent = shifted.to_bits().wrapping_add(127) << 23;
    series * f32::from_bits(exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_function_and_the_gaussian_are_right() {
        // From tables of erf.
        let known = [(0.0, 0.0), (0.1, 0.112_462_92), (0.5, 0.520_499_9), (1.0, 0.842_700_8), (2.0, 0.995_322_3)];
        for (x, erf) in known {
            let (found, gauss) = erf_and_gauss::<true>(Lanes::all(x));
            assert!((found.0[0] - erf).abs() < 1e-6, "{x}: {}", found.0[0]);
            assert!((erf_and_gauss::<false>(Lanes::all(-x)).0.0[3] + erf).abs() < 1e-6);
            assert!((gauss.0[5] - (-x * x).exp()).abs() < 1e-6);
        }
        let far = erf_and_gauss::<true>(Lanes::all(40.0));
        assert_eq!((far.0.0[0], far.1.0[0] < 1e-30), (1.0, true));
    }
}
