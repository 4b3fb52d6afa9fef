//! Numbers of several observations in a vector register, with the operators of one number.

use super::block::Column;
use pulp::Simd;
use std::ops::{Add, Mul, Neg, Sub};

/// A register of numbers. Products and sums are rounded one by one, so that every processor gives the same bits.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd>(S, S::f64s);

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(super) fn splat(simd: S, value: f64) -> Self {
        Self(simd, simd.splat_f64s(value))
    }

    /// The `i`-th register of a column.
    #[inline(always)]
    pub(super) fn load(simd: S, column: &Column, i: usize) -> Self {
        Self(simd, S::as_simd_f64s(column).0[i])
    }

    #[inline(always)]
    pub(super) fn store(self, column: &mut Column, i: usize) {
        S::as_mut_simd_f64s(column).0[i] = self.1;
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, right: Self) -> Self {
        Self(self.0, self.0.add_f64s(self.1, right.1))
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, right: Self) -> Self {
        Self(self.0, self.0.sub_f64s(self.1, right.1))
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, right: Self) -> Self {
        Self(self.0, self.0.mul_f64s(self.1, right.1))
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f64s(self.1))
    }
}
