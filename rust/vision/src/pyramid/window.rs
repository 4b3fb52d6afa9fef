//! Windows of a level as floating point grey levels or as words, the frame's edge repeated.

use super::clamped;
use std::ops::Range;

/// What a level stores, read as `f32` (grey levels) or as `i16` (units of [`WORDS_PER_GREY`](super::WORDS_PER_GREY)).
pub(crate) trait Stored<O>: Copy {
    fn read(self) -> O;
}

impl Stored<f32> for u8 {
    #[inline(always)]
    fn read(self) -> f32 {
        f32::from(self)
    }
}

impl Stored<f32> for u16 {
    #[inline(always)]
    fn read(self) -> f32 {
        f32::from(self) * (1.0 / super::UNITS_PER_GREY)
    }
}

impl Stored<i16> for u8 {
    #[inline(always)]
    fn read(self) -> i16 {
        i16::from(self) * super::WORDS_PER_GREY
    }
}

impl Stored<i16> for u16 {
    /// Rounded down; the largest, 65280, becomes 16320.
    #[inline(always)]
    fn read(self) -> i16 {
        (self / super::FINE_PER_WORD) as i16
    }
}

/// Copies the window of `width × height` pixels from `(left, top)` on into `out`, row by row.
pub(super) struct CopyWindow<'a, T, O> {
    pub pixels: &'a [T],
    /// Width and height of the level, neither zero.
    pub size: (usize, usize),
    pub left: isize,
    pub top: isize,
    pub width: usize,
    pub height: usize,
    pub out: &'a mut [O],
}

impl<T: Stored<O>, O: Copy> pulp::NullaryFnOnce for CopyWindow<'_, T, O> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { pixels, size: (columns, rows), left, top, width, height, out } = self;
        let row = |j: usize| &pixels[clamped(top + j as isize, rows) * columns..][..columns];
        // The usual case has a loop of its own, free of all that the other one needs.
        if left >= 0 && left as usize + width <= columns {
            let left = left as usize;
            for j in 0..height {
                widen(&row(j)[left..][..width], &mut out[j * width..][..width]);
            }
        } else {
            let inside = inside(left, width, columns);
            let first = (left + inside.start as isize).max(0) as usize;
            for j in 0..height {
                let (row, line) = (row(j), &mut out[j * width..][..width]);
                line[..inside.start].fill(row[0].read());
                line[inside.end..].fill(row[columns - 1].read());
                if !inside.is_empty() {
                    widen(&row[first..][..inside.len()], &mut line[inside.clone()]);
                }
            }
        }
    }
}

/// Columns of a window that lie within the frame.
fn inside(left: isize, width: usize, columns: usize) -> Range<usize> {
    let width = width as isize;
    let start = (-left).clamp(0, width);
    let end = (columns as isize - left).clamp(start, width);
    start as usize..end as usize
}

/// Rows are short: two pieces that overlap make most of them, without a loop.
#[inline(always)]
fn widen<T: Stored<O>, O>(row: &[T], out: &mut [O]) {
    match row.len() {
        0..4 => out.iter_mut().zip(row).take(3).for_each(|(out, &pixel)| *out = pixel.read()),
        4..8 => widen_ends::<T, O, 4>(row, out),
        8..16 => widen_ends::<T, O, 8>(row, out),
        16..=32 => widen_ends::<T, O, 16>(row, out),
        _ => {
            for (out, piece) in out.as_chunks_mut::<32>().0.iter_mut().zip(row.as_chunks::<32>().0) {
                widen_piece(piece, out);
            }
            widen_ends::<T, O, 32>(row, out);
        }
    }
}

/// The first and the last `N` pixels of a row that has so many.
#[inline(always)]
fn widen_ends<T: Stored<O>, O, const N: usize>(row: &[T], out: &mut [O]) {
    if let (Some(piece), Some(out)) = (row.first_chunk::<N>(), out.first_chunk_mut::<N>()) {
        widen_piece(piece, out);
    }
    if let (Some(piece), Some(out)) = (row.last_chunk::<N>(), out.last_chunk_mut::<N>()) {
        widen_piece(piece, out);
    }
}

/// A plain loop: the compiler makes no vectors out of `array::map`.
#[inline(always)]
fn widen_piece<T: Stored<O>, O, const N: usize>(piece: &[T; N], out: &mut [O; N]) {
    for k in 0..N {
        out[k] = piece[k].read();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::NullaryFnOnce;

    fn agree<T: Stored<O>, O>(size: (usize, usize), pixels: &[T], unset: O)
    where
        O: Copy + PartialEq + std::fmt::Debug,
    {
        for (left, top, width, height) in [
            (0, 0, 1, 1),
            (-3, -2, 5, 4),
            (2, 1, 14, 9),
            (1, 0, 16, 3),
            (4, 2, 35, 2),
            (-40, 5, 9, 2),
            (60, -9, 21, 30),
            (-9, 0, 70, 4),
        ] {
            let truth: Vec<O> = (0..height)
                .flat_map(|j| (0..width).map(move |i| (i, j)))
                .map(|(i, j)| {
                    let (x, y) = (clamped(left + i as isize, size.0), clamped(top + j as isize, size.1));
                    pixels[y * size.0 + x].read()
                })
                .collect();
            let mut out = vec![unset; width * height];
            CopyWindow { pixels, size, left, top, width, height, out: &mut out }.call();
            assert_eq!(out, truth, "{width}×{height} at {left} {top}, whatever the processor");
            out.fill(unset);
            pulp::Arch::new().dispatch(CopyWindow { pixels, size, left, top, width, height, out: &mut out });
            assert_eq!(out, truth, "{width}×{height} at {left} {top}, this processor");
        }
    }

    #[test]
    fn words_are_grey_levels_rounded_down() {
        let words: [i16; 4] = [3_u8.read(), 3_u16.read(), 4_u16.read(), 65280_u16.read()];
        assert_eq!(words, [192, 0, 1, 16320]);
    }

    #[test]
    fn every_instruction_set_copies_every_window_inside_and_outside_the_frame() {
        for size in [(1, 1), (3, 7), (41, 33), (64, 20)] {
            let hash = |i: usize| i.wrapping_mul(2_654_435_761) >> 7;
            let bytes: Vec<u8> = (0..size.0 * size.1).map(|i| hash(i) as u8).collect();
            let units: Vec<u16> = (0..size.0 * size.1).map(|i| (hash(i) % 65281) as u16).collect();
            agree(size, &bytes, f32::NAN);
            agree(size, &units, f32::NAN);
            agree(size, &bytes, -1_i16);
            agree(size, &units, -1_i16);
        }
    }
}
