//! Eight numbers at a time. Products and sums are rounded one by one and added up in the same order everywhere, so that
//! the answer does not depend on the instruction set.

/// Numbers computed together.
pub(super) const LANES: usize = 8;
/// Eight numbers in memory.
pub(super) type Eight = [f32; LANES];

/// Instructions for eight numbers. Compilers left alone with arrays shuffle them between registers of other widths.
pub(super) trait Vectors: super::words::WordVectors {
    /// A register, or several.
    type Register: Copy;
    fn put(self, numbers: Eight) -> Self::Register;
    fn get(self, register: Self::Register) -> Eight;
    fn add(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn sub(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn mul(self, a: Self::Register, b: Self::Register) -> Self::Register;
}

/// Whatever the compiler makes of arrays.
#[derive(Clone, Copy)]
pub(super) struct Plain;

macro_rules! plain {
    ($name:ident, $op:tt) => {
        #[inline(always)]
        fn $name(self, mut a: Eight, b: Eight) -> Eight {
            for (a, b) in a.iter_mut().zip(&b) {
                *a $op *b;
            }
            a
        }
    };
}

impl Vectors for Plain {
    type Register = Eight;

    #[inline(always)]
    fn put(self, numbers: Eight) -> Eight {
        numbers
    }

    #[inline(always)]
    fn get(self, register: Eight) -> Eight {
        register
    }

    plain!(add, +=);
    plain!(sub, -=);
    plain!(mul, *=);
}

#[cfg(target_arch = "x86_64")]
impl Vectors for pulp::x86::V3 {
    type Register = pulp::f32x8;

    #[inline(always)]
    fn put(self, numbers: Eight) -> pulp::f32x8 {
        pulp::cast(numbers)
    }

    #[inline(always)]
    fn get(self, register: pulp::f32x8) -> Eight {
        pulp::cast(register)
    }

    #[inline(always)]
    fn add(self, a: pulp::f32x8, b: pulp::f32x8) -> pulp::f32x8 {
        pulp::Simd::add_f32s(self, a, b)
    }

    #[inline(always)]
    fn sub(self, a: pulp::f32x8, b: pulp::f32x8) -> pulp::f32x8 {
        pulp::Simd::sub_f32s(self, a, b)
    }

    #[inline(always)]
    fn mul(self, a: pulp::f32x8, b: pulp::f32x8) -> pulp::f32x8 {
        pulp::Simd::mul_f32s(self, a, b)
    }
}

/// Work on vectors of eight.
pub(super) trait Kernel {
    type Output;
    fn call<V: Vectors>(self, vectors: V) -> Self::Output;
}

/// Does work with the best instructions there are.
#[inline]
pub(super) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(vectors) = pulp::x86::V3::try_new() {
        struct With<K>(K, pulp::x86::V3);
        impl<K: Kernel> pulp::NullaryFnOnce for With<K> {
            type Output = K::Output;

            #[inline(always)]
            fn call(self) -> K::Output {
                self.0.call(self.1)
            }
        }
        return pulp::Simd::vectorize(vectors, With(kernel, vectors));
    }
    kernel.call(Plain)
}

/// Eight numbers being computed with; operators work on each.
#[derive(Clone, Copy)]
pub(super) struct Lanes<V: Vectors> {
    vectors: V,
    register: V::Register,
}

impl<V: Vectors> Lanes<V> {
    #[inline(always)]
    pub(super) fn new(vectors: V, numbers: Eight) -> Self {
        Self { vectors, register: vectors.put(numbers) }
    }

    #[inline(always)]
    pub(super) fn all(vectors: V, value: f32) -> Self {
        Self::new(vectors, [value; LANES])
    }

    #[inline(always)]
    pub(super) fn zero(vectors: V) -> Self {
        Self::all(vectors, 0.0)
    }

    /// The first eight of a slice that has as many.
    #[inline(always)]
    pub(super) fn load(vectors: V, from: &[f32]) -> Self {
        let mut numbers = [0.0; LANES];
        numbers.copy_from_slice(&from[..LANES]);
        Self::new(vectors, numbers)
    }

    /// `first`, `first + 1` …
    #[inline(always)]
    pub(super) fn count(vectors: V, first: f32) -> Self {
        Self::new(vectors, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) + Self::all(vectors, first)
    }

    #[inline(always)]
    pub(super) fn numbers(self) -> Eight {
        self.vectors.get(self.register)
    }

    /// The nearest multiples of 2⁻ᵏ, for numbers that are small against 2^(22 − k); `magic` is [`nearest`]`(k)`.
    #[inline(always)]
    pub(super) fn rounded(self, magic: f32) -> Self {
        let magic = Self::all(self.vectors, magic);
        (self + magic) - magic
    }

    /// The sum, in double precision from the second halving on.
    #[inline(always)]
    pub(super) fn sum(self) -> f64 {
        let v = self.numbers();
        let [a, b, c, d] = [v[0] + v[4], v[1] + v[5], v[2] + v[6], v[3] + v[7]];
        (f64::from(a) + f64::from(c)) + (f64::from(b) + f64::from(d))
    }
}

/// Added to a small number, it leaves the nearest multiple of 2⁻ᵏ in the last bits of the mantissa.
pub(super) const fn nearest(k: i32) -> f32 {
    12_582_912.0 / (1_u32 << k) as f32
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<V: Vectors> std::ops::$trait for Lanes<V> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { vectors: self.vectors, register: self.vectors.$name(self.register, other.register) }
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);

impl<V: Vectors> std::ops::AddAssign for Lanes<V> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Mix(Eight, Eight);

    impl Kernel for Mix {
        type Output = (Eight, f64);

        fn call<V: Vectors>(self, v: V) -> Self::Output {
            let (a, b) = (Lanes::new(v, self.0), Lanes::new(v, self.1));
            let mixed = (a * b + Lanes::count(v, 3.0) - Lanes::all(v, 0.7)) * a;
            (mixed.numbers(), mixed.sum())
        }
    }

    #[test]
    fn lanes_round_to_the_nearest_step_and_sum() {
        let lanes = Lanes::new(Plain, [0.3, -0.3, 1.49, 1.51, -7.5, 100.26, 0.0, -0.01]);
        assert_eq!(lanes.rounded(nearest(1)).numbers(), [0.5, -0.5, 1.5, 1.5, -7.5, 100.5, 0.0, 0.0]);
        assert_eq!(Lanes::count(Plain, 3.0).sum(), 52.0);
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            (a[k], b[k]) = ((k as f32 * 1.37).sin() * 31.0, (k as f32 * 0.71).cos() / 7.0);
        }
        assert_eq!(dispatch(Mix(a, b)), Mix(a, b).call(Plain));
    }
}
