//! Pixels of a level as words: read where they are, or from a copy with the frame's edge repeated.

use crate::pyramid::{Level, View};
use crate::track::words::{Pixel, WORDS, WordVectors};

/// Narrower windows put two rows into sixteen words.
pub(super) const NARROW: usize = WORDS / 2;

/// Pixels that are looked at: `width × height` from `(left, top)` on.
#[derive(Clone, Copy)]
pub(super) struct Block {
    pub left: isize,
    pub top: isize,
    pub width: usize,
    pub height: usize,
}

/// Something done with the pixels of a block, whatever they are stored as.
pub(super) trait Reading<V: WordVectors> {
    type Output;

    /// `pixels` begin with the block's first; its rows are `pitch` apart.
    fn read<P: Pixel>(self, v: V, pixels: &[P], pitch: usize) -> Self::Output;
}

impl Block {
    /// Reads the pixels where they are if all are within the frame, else from a copy.
    #[inline(always)]
    pub fn read<V: WordVectors, R: Reading<V>>(
        &self,
        v: V,
        level: &Level,
        copy: &mut Vec<i16>,
        reading: R,
    ) -> R::Output {
        let Self { left, top, width, height } = *self;
        match level.view(left, top, width, height) {
            Some(View::Picture(bytes)) => reading.read(v, bytes, level.width()),
            Some(View::Fine(units)) => reading.read(v, units, level.width()),
            None => {
                level.copy_window(left, top, width, height, copy);
                reading.read(v, copy, width)
            }
        }
    }
}

/// Sixteen words, or twice eight of two rows.
#[inline(always)]
pub(super) fn load<V: WordVectors, P: Pixel, const PAIRED: bool>(
    v: V,
    pixels: &[P],
    at: usize,
    pitch: usize,
) -> V::Words {
    if PAIRED {
        P::paired(v, first(&pixels[at..][..NARROW]), first(&pixels[at + pitch..][..NARROW]))
    } else {
        P::sixteen(v, first(&pixels[at..][..WORDS]))
    }
}

/// The same, and those one pixel further.
#[inline(always)]
pub(super) fn pair<V: WordVectors, P: Pixel, const PAIRED: bool>(
    v: V,
    pixels: &[P],
    at: usize,
    pitch: usize,
) -> [V::Words; 2] {
    if PAIRED {
        let (above, below) = (&pixels[at..][..=NARROW], &pixels[at + pitch..][..=NARROW]);
        [P::paired(v, first(above), first(below)), P::paired(v, first(&above[1..]), first(&below[1..]))]
    } else {
        let row = &pixels[at..][..=WORDS];
        [P::sixteen(v, first(row)), P::sixteen(v, first(&row[1..]))]
    }
}

#[inline(always)]
fn first<P: Pixel, const N: usize>(pixels: &[P]) -> [P; N] {
    let mut first = [P::default(); N];
    first.copy_from_slice(&pixels[..N]);
    first
}

/// Part of the way between neighbours, in 2⁻¹⁵.
#[derive(Clone, Copy)]
pub(super) struct Between<W> {
    part: W,
}

impl<W: Copy> Between<W> {
    /// `part` is within 0 … 1.
    #[inline(always)]
    pub fn new<V: WordVectors<Words = W>>(v: V, part: f64) -> Self {
        Self { part: v.words([(part * 32768.0 + 0.5).min(32767.0) as i16; WORDS]) }
    }

    #[inline(always)]
    pub fn of<V: WordVectors<Words = W>>(&self, v: V, [a, b]: [W; 2]) -> W {
        v.plus(a, v.part(v.minus(b, a), self.part))
    }
}

#[inline(always)]
pub(super) fn add(totals: &mut [f64; 4], sums: [f64; 4]) {
    for k in 0..4 {
        totals[k] += sums[k];
    }
}
