//! Windows of a level as floating point grey levels, the frame's edge repeated.

use super::clamped;
use std::ops::Range;

/// What a level stores.
pub(super) trait Stored: Copy {
    /// In grey levels.
    fn grey(self) -> f32;
}

impl Stored for u8 {
    #[inline(always)]
    fn grey(self) -> f32 {
        f32::from(self)
    }
}

impl Stored for u16 {
    #[inline(always)]
    fn grey(self) -> f32 {
        f32::from(self) * (1.0 / super::UNITS_PER_GREY)
    }
}

/// Copies the window of `width × height` pixels from `(left, top)` on into `out`, row by row.
pub(super) struct CopyWindow<'a, T> {
    pub pixels: &'a [T],
    /// Width and height of the level, neither zero.
    pub size: (usize, usize),
    pub left: isize,
    pub top: isize,
    pub width: usize,
    pub height: usize,
    pub out: &'a mut [f32],
}

impl<T: Stored> pulp::NullaryFnOnce for CopyWindow<'_, T> {
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
                line[..inside.start].fill(row[0].grey());
                line[inside.end..].fill(row[columns - 1].grey());
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
fn widen<T: Stored>(row: &[T], out: &mut [f32]) {
    match row.len() {
        0..4 => out.iter_mut().zip(row).take(3).for_each(|(out, &pixel)| *out = pixel.grey()),
        4..8 => widen_ends::<T, 4>(row, out),
        8..16 => widen_ends::<T, 8>(row, out),
        16..=32 => widen_ends::<T, 16>(row, out),
        _ => {
            for (out, piece) in out.as_chunks_mut::<32>().0.iter_mut().zip(row.as_chunks::<32>().0) {
                widen_piece(piece, out);
            }
            widen_ends::<T, 32>(row, out);
        }
    }
}

/// The first and the last `N` pixels of a row that has so many.
#[inline(always)]
fn widen_ends<T: Stored, const N: usize>(row: &[T], out: &mut [f32]) {
    if let (Some(piece), Some(out)) = (row.first_chunk::<N>(), out.first_chunk_mut::<N>()) {
        widen_piece(piece, out);
    }
    if let (Some(piece), Some(out)) = (row.last_chunk::<N>(), out.last_chunk_mut::<N>()) {
        widen_piece(piece, out);
    }
}

/// A plain loop: the compiler makes no vectors out of `array::map`.
#[inline(always)]
fn widen_piece<T: Stored, const N: usize>(piece: &[T; N], out: &mut [f32; N]) {
    for k in 0..N {
        out[k] = piece[k].grey();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::NullaryFnOnce;

    fn agree<T: Stored>(size: (usize, usize), pixels: &[T]) {
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
            let truth: Vec<f32> = (0..height)
                .flat_map(|j| (0..width).map(move |i| (i, j)))
                .map(|(i, j)| {
                    let (x, y) = (clamped(left + i as isize, size.0), clamped(top + j as isize, size.1));
                    pixels[y * size.0 + x].grey()
                })
                .collect();
            let mut out = vec![f32::NAN; width * height];
            CopyWindow { pixels, size, left, top, width, height, out: &mut out }.call();
            assert_eq!(out, truth, "{width}×{height} at {left} {top}, whatever the processor");
            out.fill(f32::NAN);
            pulp::Arch::new().dispatch(CopyWindow { pixels, size, left, top, width, height, out: &mut out });
            assert_eq!(out, truth, "{width}×{height} at {left} {top}, this processor");
        }
    }

    #[test]
    fn every_instruction_set_copies_every_window_inside_and_outside_the_frame() {
        for size in [(1, 1), (3, 7), (41, 33), (64, 20)] {
            let hash = |i: usize| i.wrapping_mul(2_654_435_761) >> 7;
            agree(size, &(0..size.0 * size.1).map(|i| hash(i) as u8).collect::<Vec<u8>>());
            agree(size, &(0..size.0 * size.1).map(|i| (hash(i) % 65281) as u16).collect::<Vec<u16>>());
        }
    }
}
