//! Shifts of evenly weighed patches in whole numbers: what the paper's tracker is made of.
//!
//! Between the same four pixels a window is bilinear in its position, and so are its products with the slopes of a
//! patch. Those with the four windows at whole positions around it, the corners of a cell, give the steps everywhere in
//! between at no further cost; they need no interpolation, and sixteen bits hold all that is multiplied.

mod cells;
mod judge;
mod pixels;
mod take;

use super::patch::Stats;
use super::window::{ROWS, Window};
use super::words::{Sixteen, WORDS};
use crate::pyramid::WORDS_PER_GREY;
pub(super) use cells::IterateWhole;
pub(super) use judge::JudgeWhole;
use pixels::NARROW;
pub(super) use take::TakingWhole;

/// Words of a row of the patch with one more pixel all round, padded.
const FRAME: usize = 3 * WORDS;
/// Numbers that are kept of sixteen pixels.
const KEPT_PER_LINE: usize = 3 * WORDS;
/// Units of slopes per grey level and pixel. With [`WORDS_PER_GREY`], sums over the largest window just fit.
const SLOPES_PER_GREY: i16 = 16;
/// Grey levels per unit of a quarter of a word. Squares are summed of those, lest they overflow.
const QUARTER: f64 = 4.0 / WORDS_PER_GREY as f64;

/// Scharr's derivatives along x and y of sixteen pixels, and their values; zero beside the window.
type Line = [Sixteen; 3];

/// Grey levels squared per pixel of a unit of a product of slopes, and of a slope and a value.
const SLOPE_SLOPE: f64 = 1.0 / (SLOPES_PER_GREY as f64 * SLOPES_PER_GREY as f64);
const SLOPE_VALUE: f64 = 1.0 / (SLOPES_PER_GREY as f64 * WORDS_PER_GREY as f64);

/// A reference patch, ready to be looked for.
pub(super) struct WholePatch {
    lines: [Line; 2 * ROWS],
    pub stats: Stats,
    frame: [[i16; FRAME]; ROWS + 1],
}

impl Default for WholePatch {
    fn default() -> Self {
        Self { lines: [[[0; WORDS]; 3]; 2 * ROWS], stats: Stats::default(), frame: [[0; FRAME]; ROWS + 1] }
    }
}

impl WholePatch {
    /// How many numbers are kept of a patch.
    pub fn kept_length(window: Window) -> usize {
        Cut::new(window).lines() * KEPT_PER_LINE
    }

    /// Writes slopes and values, [`Self::kept_length`] numbers.
    pub fn pack(&self, out: &mut [i16]) {
        for (line, out) in self.lines.iter().zip(out.chunks_exact_mut(KEPT_PER_LINE)) {
            out.copy_from_slice(line.as_flattened());
        }
    }

    /// Takes back what [`Self::pack`] wrote.
    pub fn unpack(&mut self, packed: &[i16], stats: &Stats) {
        self.stats.clone_from(stats);
        for (line, packed) in self.lines.iter_mut().zip(packed.chunks_exact(KEPT_PER_LINE)) {
            line.as_flattened_mut().copy_from_slice(packed);
        }
    }
}

/// How a window is cut into lines of sixteen words: strips of sixteen columns, then, if no more than eight are left, a
/// strip of eight with two rows in each line.
#[derive(Clone, Copy)]
struct Cut {
    side: usize,
    /// Strips of sixteen columns.
    wide: usize,
    narrow: bool,
}

/// A strip of a window.
#[derive(Clone, Copy)]
struct Strip {
    /// Its first line and their number.
    first: usize,
    lines: usize,
    /// Its first column.
    column: usize,
    /// Words of the window: of all lines but the last, and of the last.
    masks: [Sixteen; 2],
}

impl Cut {
    #[inline(always)]
    fn new(window: Window) -> Self {
        let side = window.side;
        let left = side % WORDS;
        let narrow = left > 0 && left <= NARROW;
        Self { side, wide: if narrow { side / WORDS } else { side.div_ceil(WORDS) }, narrow }
    }

    /// Lines of all strips.
    #[inline(always)]
    fn lines(&self) -> usize {
        self.wide * self.side + if self.narrow { self.side.div_ceil(2) } else { 0 }
    }

    /// Rows that the lines touch: pairs make an odd number even.
    #[inline(always)]
    fn rows(&self) -> usize {
        if self.narrow { self.side.next_multiple_of(2) } else { self.side }
    }

    /// Columns that the lines touch.
    #[inline(always)]
    fn columns(&self) -> usize {
        self.wide * WORDS + if self.narrow { NARROW } else { 0 }
    }

    #[inline(always)]
    fn wide_strip(&self, index: usize) -> Strip {
        let (column, mut mask) = (index * WORDS, [0; WORDS]);
        for (k, mask) in mask.iter_mut().enumerate() {
            *mask = if column + k < self.side { -1 } else { 0 };
        }
        Strip { first: index * self.side, lines: self.side, column, masks: [mask, mask] }
    }

    #[inline(always)]
    fn narrow_strip(&self) -> Strip {
        let (column, mut usual, mut last) = (self.wide * WORDS, [0; WORDS], [0; WORDS]);
        for k in 0..WORDS {
            usual[k] = if column + k % NARROW < self.side { -1 } else { 0 };
            // The side is odd: the last pair has one row.
            last[k] = if k < NARROW { usual[k] } else { 0 };
        }
        Strip { first: self.wide * self.side, lines: self.side.div_ceil(2), column, masks: [usual, last] }
    }
}

impl Strip {
    /// Which words of a line belong to the window.
    #[inline(always)]
    fn mask(&self, line: usize) -> Sixteen {
        self.masks[usize::from(line + 1 == self.lines)]
    }
}

/// Rows of a line.
const fn rows_of(paired: bool) -> usize {
    if paired { 2 } else { 1 }
}

#[cfg(test)]
mod tests;
