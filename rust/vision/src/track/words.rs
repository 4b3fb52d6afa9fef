//! Sixteen whole numbers of sixteen bits at a time, and eight sums of thirty-two. They are exact, so the answer does not
//! depend on the instruction set, nor on the order of sums.

use crate::pyramid::Stored;
#[cfg(any(target_arch = "x86_64", doc))]
use crate::pyramid::{FINE_PER_WORD, WORDS_PER_GREY};

/// Numbers computed together.
pub(super) const WORDS: usize = 16;
/// Sixteen numbers in memory.
pub(super) type Sixteen = [i16; WORDS];
/// Sums of neighbours in memory.
type Sums = [i32; WORDS / 2];

#[cfg(target_arch = "x86_64")]
const WORD_SHIFT: i32 = WORDS_PER_GREY.trailing_zeros() as i32;
#[cfg(target_arch = "x86_64")]
const FINE_SHIFT: i32 = FINE_PER_WORD.trailing_zeros() as i32;

/// Instructions for sixteen words.
pub(super) trait WordVectors: Copy {
    /// Sixteen words.
    type Words: Copy;
    /// Eight sums.
    type Sums: Copy;
    fn words(self, words: Sixteen) -> Self::Words;
    /// Of bytes, in units of [`WORDS_PER_GREY`].
    fn bytes(self, bytes: [u8; WORDS]) -> Self::Words;
    /// Of 1/256 grey level, in units of [`WORDS_PER_GREY`].
    fn fine(self, fine: [u16; WORDS]) -> Self::Words;
    /// Twice eight.
    fn paired_words(self, low: [i16; WORDS / 2], high: [i16; WORDS / 2]) -> Self::Words;
    fn paired_bytes(self, low: [u8; WORDS / 2], high: [u8; WORDS / 2]) -> Self::Words;
    fn paired_fine(self, low: [u16; WORDS / 2], high: [u16; WORDS / 2]) -> Self::Words;
    fn to_words(self, words: Self::Words) -> Sixteen;
    fn plus(self, a: Self::Words, b: Self::Words) -> Self::Words;
    fn minus(self, a: Self::Words, b: Self::Words) -> Self::Words;
    fn and(self, a: Self::Words, b: Self::Words) -> Self::Words;
    /// A quarter of each, rounded down.
    fn quarters(self, a: Self::Words) -> Self::Words;
    /// `a b / 2¹⁵`, rounded to the nearest.
    fn part(self, a: Self::Words, b: Self::Words) -> Self::Words;
    fn no_sums(self) -> Self::Sums;
    /// Adds the products of neighbours, two for each sum.
    fn add_products(self, sums: Self::Sums, a: Self::Words, b: Self::Words) -> Self::Sums;
    fn to_sums(self, sums: Self::Sums) -> Sums;

    /// The sum of all.
    #[inline(always)]
    fn total(self, sums: Self::Sums) -> f64 {
        let sums = self.to_sums(sums);
        let mut pairs = [0_i64; 4];
        for k in 0..4 {
            pairs[k] = i64::from(sums[k]) + i64::from(sums[k + 4]);
        }
        ((pairs[0] + pairs[2]) + (pairs[1] + pairs[3])) as f64
    }

    /// The sum of each.
    #[inline(always)]
    fn totals(self, [a, b, c, d]: [Self::Sums; 4]) -> [f64; 4] {
        [self.total(a), self.total(b), self.total(c), self.total(d)]
    }
}

/// A pixel that sixteen words are read from.
pub(super) trait Pixel: Copy + Default {
    fn sixteen<V: WordVectors>(v: V, pixels: [Self; WORDS]) -> V::Words;
    fn paired<V: WordVectors>(v: V, low: [Self; WORDS / 2], high: [Self; WORDS / 2]) -> V::Words;
}

macro_rules! pixel {
    ($stored:ty, $sixteen:ident, $paired:ident) => {
        impl Pixel for $stored {
            #[inline(always)]
            fn sixteen<V: WordVectors>(v: V, pixels: [Self; WORDS]) -> V::Words {
                v.$sixteen(pixels)
            }

            #[inline(always)]
            fn paired<V: WordVectors>(v: V, low: [Self; WORDS / 2], high: [Self; WORDS / 2]) -> V::Words {
                v.$paired(low, high)
            }
        }
    };
}

pixel!(u8, bytes, paired_bytes);
pixel!(u16, fine, paired_fine);
pixel!(i16, words, paired_words);

#[inline(always)]
fn joined<T: Copy + Default>(low: [T; WORDS / 2], high: [T; WORDS / 2]) -> [T; WORDS] {
    let mut joined = [T::default(); WORDS];
    joined[..WORDS / 2].copy_from_slice(&low);
    joined[WORDS / 2..].copy_from_slice(&high);
    joined
}

impl WordVectors for super::lanes::Plain {
    type Words = Sixteen;
    type Sums = Sums;

    #[inline(always)]
    fn words(self, words: Sixteen) -> Sixteen {
        words
    }

    #[inline(always)]
    fn bytes(self, bytes: [u8; WORDS]) -> Sixteen {
        bytes.map(Stored::read)
    }

    #[inline(always)]
    fn fine(self, fine: [u16; WORDS]) -> Sixteen {
        fine.map(Stored::read)
    }

    #[inline(always)]
    fn paired_words(self, low: [i16; WORDS / 2], high: [i16; WORDS / 2]) -> Sixteen {
        joined(low, high)
    }

    #[inline(always)]
    fn paired_bytes(self, low: [u8; WORDS / 2], high: [u8; WORDS / 2]) -> Sixteen {
        self.bytes(joined(low, high))
    }

    #[inline(always)]
    fn paired_fine(self, low: [u16; WORDS / 2], high: [u16; WORDS / 2]) -> Sixteen {
        self.fine(joined(low, high))
    }

    #[inline(always)]
    fn to_words(self, words: Sixteen) -> Sixteen {
        words
    }

    #[inline(always)]
    fn plus(self, mut a: Sixteen, b: Sixteen) -> Sixteen {
        for k in 0..WORDS {
            a[k] += b[k];
        }
        a
    }

    #[inline(always)]
    fn minus(self, mut a: Sixteen, b: Sixteen) -> Sixteen {
        for k in 0..WORDS {
            a[k] -= b[k];
        }
        a
    }

    #[inline(always)]
    fn and(self, mut a: Sixteen, b: Sixteen) -> Sixteen {
        for k in 0..WORDS {
            a[k] &= b[k];
        }
        a
    }

    #[inline(always)]
    fn quarters(self, mut a: Sixteen) -> Sixteen {
        for a in &mut a {
            *a >>= 2;
        }
        a
    }

    #[inline(always)]
    fn part(self, mut a: Sixteen, b: Sixteen) -> Sixteen {
        for k in 0..WORDS {
            a[k] = ((i32::from(a[k]) * i32::from(b[k]) + (1 << 14)) >> 15) as i16;
        }
        a
    }

    #[inline(always)]
    fn no_sums(self) -> Sums {
        [0; WORDS / 2]
    }

    #[inline(always)]
    fn add_products(self, mut sums: Sums, a: Sixteen, b: Sixteen) -> Sums {
        for (k, sum) in sums.iter_mut().enumerate() {
            let product = |k: usize| i32::from(a[k]) * i32::from(b[k]);
            *sum += product(2 * k) + product(2 * k + 1);
        }
        sums
    }

    #[inline(always)]
    fn to_sums(self, sums: Sums) -> Sums {
        sums
    }
}

#[cfg(target_arch = "x86_64")]
impl WordVectors for pulp::x86::V3 {
    type Words = pulp::i16x16;
    type Sums = pulp::i32x8;

    #[inline(always)]
    fn words(self, words: Sixteen) -> pulp::i16x16 {
        pulp::cast(words)
    }

    // The instructions are named one by one: left to the compiler, overlapping loads become a web of shuffles, and halves
    // that meet in memory have to be waited for.
    #[inline(always)]
    fn bytes(self, bytes: [u8; WORDS]) -> pulp::i16x16 {
        self.shl_const_i16x16::<WORD_SHIFT>(self.convert_u8x16_to_i16x16(pulp::cast(bytes)))
    }

    #[inline(always)]
    fn fine(self, fine: [u16; WORDS]) -> pulp::i16x16 {
        pulp::cast(self.shr_const_u16x16::<FINE_SHIFT>(pulp::cast(fine)))
    }

    #[inline(always)]
    fn paired_words(self, low: [i16; WORDS / 2], high: [i16; WORDS / 2]) -> pulp::i16x16 {
        let low = self.avx._mm256_castsi128_si256(pulp::cast(low));
        pulp::cast(self.avx2._mm256_inserti128_si256::<1>(low, pulp::cast(high)))
    }

    #[inline(always)]
    fn paired_bytes(self, low: [u8; WORDS / 2], high: [u8; WORDS / 2]) -> pulp::i16x16 {
        let low = self.sse4_1._mm_cvtepu8_epi16(self.sse2._mm_set_epi64x(0, i64::from_le_bytes(low)));
        let high = self.sse4_1._mm_cvtepu8_epi16(self.sse2._mm_set_epi64x(0, i64::from_le_bytes(high)));
        self.shl_const_i16x16::<WORD_SHIFT>(self.paired_words(pulp::cast(low), pulp::cast(high)))
    }

    #[inline(always)]
    fn paired_fine(self, low: [u16; WORDS / 2], high: [u16; WORDS / 2]) -> pulp::i16x16 {
        let fine = self.paired_words(pulp::cast(low), pulp::cast(high));
        pulp::cast(self.shr_const_u16x16::<FINE_SHIFT>(pulp::cast(fine)))
    }

    #[inline(always)]
    fn to_words(self, words: pulp::i16x16) -> Sixteen {
        pulp::cast(words)
    }

    #[inline(always)]
    fn plus(self, a: pulp::i16x16, b: pulp::i16x16) -> pulp::i16x16 {
        self.wrapping_add_i16x16(a, b)
    }

    #[inline(always)]
    fn minus(self, a: pulp::i16x16, b: pulp::i16x16) -> pulp::i16x16 {
        self.wrapping_sub_i16x16(a, b)
    }

    #[inline(always)]
    fn and(self, a: pulp::i16x16, b: pulp::i16x16) -> pulp::i16x16 {
        self.and_i16x16(a, b)
    }

    #[inline(always)]
    fn quarters(self, a: pulp::i16x16) -> pulp::i16x16 {
        self.shr_const_i16x16::<2>(a)
    }

    #[inline(always)]
    fn part(self, a: pulp::i16x16, b: pulp::i16x16) -> pulp::i16x16 {
        pulp::cast(self.avx2._mm256_mulhrs_epi16(pulp::cast(a), pulp::cast(b)))
    }

    #[inline(always)]
    fn no_sums(self) -> pulp::i32x8 {
        self.splat_i32x8(0)
    }

    #[inline(always)]
    fn add_products(self, sums: pulp::i32x8, a: pulp::i16x16, b: pulp::i16x16) -> pulp::i32x8 {
        self.wrapping_add_i32x8(sums, self.multiply_wrapping_add_adjacent_i16x16(a, b))
    }

    #[inline(always)]
    fn to_sums(self, sums: pulp::i32x8) -> Sums {
        pulp::cast(sums)
    }

    #[inline(always)]
    fn totals(self, [a, b, c, d]: [pulp::i32x8; 4]) -> [f64; 4] {
        let (a, b) = (sums_of_pairs(self, a), sums_of_pairs(self, b));
        let (c, d) = (sums_of_pairs(self, c), sums_of_pairs(self, d));
        let ab: [pulp::f64x2; 2] = pulp::cast(self.avx._mm256_hadd_pd(a, b));
        let cd: [pulp::f64x2; 2] = pulp::cast(self.avx._mm256_hadd_pd(c, d));
        let sums = [self.add_f64x2(ab[0], ab[1]), self.add_f64x2(cd[0], cd[1])];
        pulp::cast(sums)
    }
}

/// Sums of four pairs, in the order that `hadd` wants.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn sums_of_pairs(v: pulp::x86::V3, sums: pulp::i32x8) -> std::arch::x86_64::__m256d {
    let [low, high]: [pulp::i32x4; 2] = pulp::cast(sums);
    pulp::cast(v.add_f64x4(v.convert_i32x4_to_f64x4(low), v.convert_i32x4_to_f64x4(high)))
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Kernel, Plain, Vectors, dispatch};
    use super::*;

    struct Mix(Sixteen, Sixteen);

    impl Kernel for Mix {
        type Output = (Sixteen, f64, [f64; 4]);

        fn call<V: Vectors>(self, v: V) -> Self::Output {
            let (a, b) = (v.words(self.0), v.words(self.1));
            let mixed = v.and(v.minus(v.quarters(v.plus(a, b)), v.part(a, b)), v.words([-3; WORDS]));
            let sums = v.add_products(v.add_products(v.no_sums(), a, b), mixed, mixed);
            let totals = [sums, v.add_products(sums, a, a), v.add_products(sums, b, mixed), v.no_sums()];
            (v.to_words(mixed), v.total(sums), v.totals(totals))
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_words() {
        let (mut a, mut b) = ([0; WORDS], [0; WORDS]);
        for k in 0..WORDS {
            (a[k], b[k]) = ((k as i16 - 7) * 1151, 32767 - (k as i16) * 3001);
            b[k] /= 3;
        }
        assert_eq!(dispatch(Mix(a, b)), Mix(a, b).call(Plain));
    }

    #[test]
    fn parts_are_rounded_to_the_nearest() {
        let part = |a: i16, b: i16| Plain.part([a; WORDS], [b; WORDS])[0];
        assert_eq!([part(3, 16384), part(-3, 16384), part(8160, 32767), part(-8160, 0)], [2, -1, 8160, 0]);
    }

    #[test]
    fn the_largest_sums_just_fit() {
        // White less black times the steepest slope, in the 31 rows of the largest window.
        let largest = |sums, _| Plain.add_products(sums, [16320; WORDS], [-2040; WORDS]);
        let sums = (0..31).fold(Plain.no_sums(), largest);
        assert_eq!(Plain.total(sums), -31.0 * 16.0 * 16320.0 * 2040.0);
    }
}
