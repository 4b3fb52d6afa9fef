//! A level from the next finer one: each row is smoothed and thinned along x once, and five of the thinned rows make a
//! row of the coarser level while they are in the nearest cache.
//!
//! In 1/16 grey level both passes stay within sixteen bits: `16 · 255 · 16 = 65280`. Sums are whole numbers, so every
//! instruction set gives the same bytes.

use super::clamped;

/// Binomial weights sum to `1 << SHIFT` along each axis.
const SHIFT: u32 = 4;
/// Added before a sum is divided, to round to nearest.
const HALF: u16 = 1 << (SHIFT - 1);
/// Taps along each axis.
const TAPS: usize = 5;

/// A pixel of a picture or of a coarser level.
pub(super) trait Pixel: Copy + Sync {
    /// Two neighbours.
    fn pair(two: [Self; 2]) -> (u16, u16);

    /// The weighted sum of five pixels, in 1/16 grey level.
    fn rounded(sum: u16) -> u16;

    /// The pixel in its own units.
    fn raw(self) -> u16;
}

impl Pixel for u8 {
    #[inline(always)]
    fn pair(two: [u8; 2]) -> (u16, u16) {
        let word = u16::from_le_bytes(two);
        (word & 255, word >> 8)
    }

    #[inline(always)]
    fn rounded(sum: u16) -> u16 {
        sum
    }

    #[inline(always)]
    fn raw(self) -> u16 {
        u16::from(self)
    }
}

impl Pixel for u16 {
    #[inline(always)]
    fn pair([even, odd]: [u16; 2]) -> (u16, u16) {
        (even, odd)
    }

    #[inline(always)]
    fn rounded(sum: u16) -> u16 {
        (sum + HALF) >> SHIFT
    }

    #[inline(always)]
    fn raw(self) -> u16 {
        self
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
        let mut thinned = vec![0; TAPS * width];
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
            merge(rows, &mut line);
            halved.extend_from_slice(&line);
        }
        halved
    }
}

/// Smooths a row and takes every second pixel of it.
#[inline(always)]
fn thin<T: Pixel>(row: &[T], out: &mut [u16]) {
    let (pairs, _) = row.as_chunks::<2>();
    let inner = pairs.len().saturating_sub(2);
    if inner > 0 {
        let (before, here, after) = (&pairs[..inner], &pairs[1..][..inner], &pairs[2..][..inner]);
        let out = &mut out[1..][..inner];
        for x in 0..inner {
            let ((a, b), (c, d), (e, _)) = (T::pair(before[x]), T::pair(here[x]), T::pair(after[x]));
            out[x] = T::rounded(a + e + 4 * (b + d) + 6 * c);
        }
    }
    let at_edge = |x: usize| {
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k| row[clamped(2 * x as isize + k - 2, row.len())].raw());
        T::rounded(a + e + 4 * (b + d) + 6 * c)
    };
    out[0] = at_edge(0);
    for (x, out) in out.iter_mut().enumerate().skip(inner + 1) {
        *out = at_edge(x);
    }
}

/// Smooths down five thinned rows.
#[inline(always)]
fn merge([a, b, c, d, e]: [&[u16]; TAPS], out: &mut [u16]) {
    let width = out.len();
    let (a, b, c, d, e) = (&a[..width], &b[..width], &c[..width], &d[..width], &e[..width]);
    for x in 0..width {
        out[x] = (a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x] + HALF) >> SHIFT;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::NullaryFnOnce;

    /// Pixel by pixel, as it is defined.
    fn plain<T: Pixel>(pixels: &[T], width: usize) -> Vec<u16> {
        const WEIGHTS: [u16; TAPS] = [1, 4, 6, 4, 1];
        let height = pixels.len() / width;
        let sum = |tap: &dyn Fn(isize) -> u16| (0..TAPS).map(|k| WEIGHTS[k] * tap(k as isize - 2)).sum::<u16>();
        let along =
            |x: usize, y: usize| T::rounded(sum(&|k| pixels[y * width + clamped(2 * x as isize + k, width)].raw()));
        let down = |x: usize, y: usize| (sum(&|k| along(x, clamped(2 * y as isize + k, height))) + 8) / 16;
        let rows = 0..height.div_ceil(2);
        rows.flat_map(|y| (0..width.div_ceil(2)).map(move |x| (x, y))).map(|(x, y)| down(x, y)).collect()
    }

    fn agree<T: Pixel>(pixel: impl Fn(usize) -> T) {
        for (width, height) in [(1, 1), (2, 1), (1, 2), (3, 2), (2, 5), (4, 4), (5, 3), (37, 10), (64, 7), (131, 9)] {
            let pixels: Vec<T> = (0..width * height).map(&pixel).collect();
            let halve = || Halve { pixels: &pixels, width };
            let truth = plain(&pixels, width);
            assert_eq!(halve().call(), truth, "{width}×{height}, whatever the processor");
            assert_eq!(pulp::Arch::new().dispatch(halve()), truth, "{width}×{height}, this processor");
        }
    }

    #[test]
    fn every_instruction_set_gives_the_defined_bytes_whatever_the_size() {
        agree(|i| (i.wrapping_mul(2_654_435_761) >> 7) as u8);
        agree(|i| ((i.wrapping_mul(2_654_435_761) >> 7) % 4081) as u16);
    }

    #[test]
    fn white_stays_white() {
        let white = vec![255_u8; 40 * 30];
        let half = Halve { pixels: &white, width: 40 }.call();
        assert!(half.iter().all(|&v| v == 255 * 16));
        assert!(Halve { pixels: &half, width: 20 }.call().iter().all(|&v| v == 255 * 16));
    }
}
