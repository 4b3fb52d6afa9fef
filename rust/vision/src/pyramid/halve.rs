//! A level from the next finer one: each row is smoothed and thinned along x once, and five of the thinned rows make a
//! row of the coarser level while they are in the nearest cache.
//!
//! Sums are whole numbers, so every instruction set gives the same bytes. Those of a picture's bytes fit into sixteen
//! bits, `16 · 16 · 255 = 65280`, and are 1/256 grey level as they are.

use super::clamped;

/// Taps along each axis.
const TAPS: usize = 5;

/// A pixel of a picture or of a coarser level.
pub(super) trait Pixel: Copy {
    /// Holds 256 times the largest pixel of a picture, or 256 times that of a level.
    type Sum: Copy + Default;

    /// Two neighbours.
    fn pair(two: [Self; 2]) -> (Self::Sum, Self::Sum);

    /// The pixel in its own units.
    fn sum(self) -> Self::Sum;

    /// Five neighbours by their binomial weights.
    fn weigh(five: [Self::Sum; TAPS]) -> Self::Sum;

    /// Sums along both axes in 1/256 grey level.
    fn level(sum: Self::Sum) -> u16;
}

impl Pixel for u8 {
    type Sum = u16;

    #[inline(always)]
    fn pair(two: [u8; 2]) -> (u16, u16) {
        let word = u16::from_le_bytes(two);
        (word & 255, word >> 8)
    }

    #[inline(always)]
    fn sum(self) -> u16 {
        u16::from(self)
    }

    #[inline(always)]
    fn weigh([a, b, c, d, e]: [u16; TAPS]) -> u16 {
        a + e + 4 * (b + d) + 6 * c
    }

    #[inline(always)]
    fn level(sum: u16) -> u16 {
        sum
    }
}

impl Pixel for u16 {
    type Sum = u32;

    #[inline(always)]
    fn pair([even, odd]: [u16; 2]) -> (u32, u32) {
        (u32::from(even), u32::from(odd))
    }

    #[inline(always)]
    fn sum(self) -> u32 {
        u32::from(self)
    }

    #[inline(always)]
    fn weigh([a, b, c, d, e]: [u32; TAPS]) -> u32 {
        a + e + 4 * (b + d) + 6 * c
    }

    #[inline(always)]
    fn level(sum: u32) -> u16 {
        ((sum + 128) >> 8) as u16
    }
}

/// Halves `pixels`, rows of `width`; neither side is zero. Gives rows of half the width, rounded up.
pub(super) struct Halve<'a, T> {
    pub pixels: &'a [T],
    pub width: usize,
}

impl<T: Pixel> pulp::NullaryFnOnce for Halve<'_, T> {
    type Output = Vec<u16>;

    #[inline(always)]
    fn call(self) -> Vec<u16> {
        let (height, width) = (self.pixels.len() / self.width, self.width.div_ceil(2));
        let mut halved = Vec::with_capacity(width * height.div_ceil(2));
        let mut thinned = vec![T::Sum::default(); TAPS * width];
        let mut line = vec![0; width];
        let mut next = 0;
        for y in 0..height.div_ceil(2) {
            while next < (2 * y + 3).min(height) {
                let row = &self.pixels[next * self.width..][..self.width];
                thin(row, &mut thinned[next % TAPS * width..][..width]);
                next += 1;
            }
            let rows = [0, 1, 2, 3, 4].map(|j| {
                let row = clamped(2 * y as isize + j - 2, height);
                &thinned[row % TAPS * width..][..width]
            });
            merge::<T>(rows, &mut line);
            halved.extend_from_slice(&line);
        }
        halved
    }
}

/// Smooths a row and takes every second pixel of it.
#[inline(always)]
fn thin<T: Pixel>(row: &[T], out: &mut [T::Sum]) {
    let (pairs, _) = row.as_chunks::<2>();
    let inner = pairs.len().saturating_sub(2);
    if inner > 0 {
        let (before, here, after) = (&pairs[..inner], &pairs[1..][..inner], &pairs[2..][..inner]);
        let out = &mut out[1..][..inner];
        for x in 0..inner {
            let ((a, b), (c, d), (e, _)) = (T::pair(before[x]), T::pair(here[x]), T::pair(after[x]));
            out[x] = T::weigh([a, b, c, d, e]);
        }
    }
    let at_edge = |x: usize| T::weigh([0, 1, 2, 3, 4].map(|k| row[clamped(2 * x as isize + k - 2, row.len())].sum()));
    out[0] = at_edge(0);
    for (x, out) in out.iter_mut().enumerate().skip(inner + 1) {
        *out = at_edge(x);
    }
}

/// Smooths down five thinned rows.
#[inline(always)]
fn merge<T: Pixel>([a, b, c, d, e]: [&[T::Sum]; TAPS], out: &mut [u16]) {
    let width = out.len();
    let (a, b, c, d, e) = (&a[..width], &b[..width], &c[..width], &d[..width], &e[..width]);
    for x in 0..width {
        out[x] = T::level(T::weigh([a[x], b[x], c[x], d[x], e[x]]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::NullaryFnOnce;

    /// Pixel by pixel, as it is defined, from pixels in `units` per grey level.
    fn plain<T: Pixel + Into<u64>>(pixels: &[T], width: usize, units: u64) -> Vec<u16> {
        const WEIGHTS: [u64; TAPS] = [1, 4, 6, 4, 1];
        let height = pixels.len() / width;
        let pixel = |x: usize, y: usize| {
            let taps = (0..TAPS).flat_map(|j| (0..TAPS).map(move |i| (i, j)));
            let weighted = taps.map(|(i, j)| {
                let u = clamped((2 * x + i) as isize - 2, width);
                let v = clamped((2 * y + j) as isize - 2, height);
                WEIGHTS[i] * WEIGHTS[j] * pixels[v * width + u].into()
            });
            ((weighted.sum::<u64>() + units / 2) / units) as u16
        };
        let rows = 0..height.div_ceil(2);
        rows.flat_map(|y| (0..width.div_ceil(2)).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
    }

    fn agree<T: Pixel + Into<u64>>(units: u64, pixel: impl Fn(usize) -> T) {
        for (width, height) in [(1, 1), (2, 1), (1, 2), (3, 2), (2, 5), (4, 4), (5, 3), (37, 10), (64, 7), (131, 9)] {
            let pixels: Vec<T> = (0..width * height).map(&pixel).collect();
            let halve = || Halve { pixels: &pixels, width };
            let truth = plain(&pixels, width, units);
            assert_eq!(halve().call(), truth, "{width}×{height}, whatever the processor");
            assert_eq!(pulp::Arch::new().dispatch(halve()), truth, "{width}×{height}, this processor");
        }
    }

    #[test]
    fn every_instruction_set_gives_the_defined_pixels_whatever_the_size() {
        agree(1, |i| (i.wrapping_mul(2_654_435_761) >> 7) as u8);
        agree(256, |i| ((i.wrapping_mul(2_654_435_761) >> 7) % 65281) as u16);
    }

    #[test]
    fn white_stays_white() {
        let white = vec![255_u8; 40 * 30];
        let half = Halve { pixels: &white, width: 40 }.call();
        assert!(half.iter().all(|&v| v == 255 * 256));
        assert!(Halve { pixels: &half, width: 20 }.call().iter().all(|&v| v == 255 * 256));
    }
}
