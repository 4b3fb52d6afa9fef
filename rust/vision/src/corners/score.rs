//! Scores of a tile and the peaks among them, row by row: gradients enter and leave sums over columns as the window
//! slides down, sums over columns are added up to windows by doubling, and three rows of scores at a time are searched
//! for peaks. Whatever is read twice stays in the nearest cache, and no picture of scores is kept.
//!
//! Sums are whole numbers: a pixel's score depends neither on the tile nor on the instruction set. The loops over pixels
//! are plain ones, since the compiler makes no vectors out of `array::map`.

use super::peaks::{Peak, Threshold};
use super::tiles::Tile;
use image::GrayImage;

/// Sobel's weights sum to 8 grey levels per pixel of slope, and the matrix holds squares.
const SOBEL_SQUARED: f32 = 64.0;
/// Pixels of which is told at once whether one is a peak.
const PIECE: usize = 16;

/// Buffers that a thread uses for one tile after another.
#[derive(Default)]
pub(super) struct Scratch {
    /// Slopes along x and y of as many rows as the window has.
    slopes: [Vec<i16>; 2],
    /// The row of slopes that enters.
    entering: [Vec<i16>; 2],
    /// Sums over columns of the products xx, xy, yy.
    columns: [Vec<i32>; 3],
    /// Sums over windows of the same.
    windows: [Vec<i32>; 3],
    /// Sums over 2, 4, 8 … columns, two generations.
    doubled: [Vec<i32>; 2],
    /// Three rows of scores.
    scores: [Vec<f32>; 3],
    /// Not zero where a pixel is a peak.
    flags: Vec<u8>,
}

/// Collects the peaks of a tile. The tile, half a window and two pixels more lie within the picture.
pub(super) struct FindPeaks<'a> {
    pub picture: &'a GrayImage,
    pub mask: Option<&'a GrayImage>,
    pub tile: Tile,
    pub half: usize,
    pub threshold: Threshold,
    pub scratch: &'a mut Scratch,
}

impl pulp::NullaryFnOnce for FindPeaks<'_> {
    type Output = Vec<Peak>;

    #[inline(always)]
    fn call(mut self) -> Vec<Peak> {
        let (side, tile) = (2 * self.half + 1, self.tile);
        // Peaks are told by the pixels around: scores reach one pixel further than the tile, slopes half a window more.
        let (scored, span) = (tile.width + 2, tile.width + 2 + 2 * self.half);
        self.scratch.clear(side, span, scored);
        let left = tile.left - 1 - self.half;
        let per_score = 1.0 / (2.0 * SOBEL_SQUARED * (side * side) as f32);
        let mut peaks = Vec::new();
        for n in 0..tile.height + 2 + 2 * self.half {
            self.slide(tile.top + n - 1 - self.half, left, n % side * span);
            let Some(row) = (n + 1).checked_sub(side) else { continue };
            let Scratch { columns, windows, doubled, scores, .. } = &mut *self.scratch;
            for (columns, windows) in columns.iter().zip(&mut *windows) {
                add_up(columns, side, doubled, windows);
            }
            smaller_eigenvalues(windows, per_score, &mut scores[row % 3]);
            if let Some(middle) = row.checked_sub(1).filter(|&middle| middle > 0) {
                self.search(middle, &mut peaks);
            }
        }
        peaks
    }
}

impl FindPeaks<'_> {
    /// Lets the slopes of row `y` take the place of those at `slot`, in the ring and in the sums over columns.
    #[inline(always)]
    fn slide(&mut self, y: usize, left: usize, slot: usize) {
        let Scratch { slopes: [old_x, old_y], entering: [new_x, new_y], columns, .. } = &mut *self.scratch;
        let (span, width) = (new_x.len(), self.picture.width() as usize);
        let rows = [y - 1, y, y + 1].map(|y| &self.picture.as_raw()[y * width + left - 1..][..span + 2]);
        sobel(rows, new_x, new_y);
        let (old_x, old_y) = (&mut old_x[slot..][..span], &mut old_y[slot..][..span]);
        exchange(columns, [old_x, old_y], [new_x, new_y]);
        old_x.copy_from_slice(new_x);
        old_y.copy_from_slice(new_y);
    }

    /// Collects the peaks of a row of scores that has both neighbours; scores begin one row above the tile.
    #[inline(always)]
    fn search(&mut self, row: usize, peaks: &mut Vec<Peak>) {
        let Scratch { scores, flags, .. } = &mut *self.scratch;
        let [above, here, below] = [row - 1, row, row + 1].map(|row| &scores[row % 3][..]);
        let (tile, width) = (self.tile, self.picture.width() as usize);
        flag_peaks([above, here, below], self.threshold.least(), &mut flags[..tile.width]);
        let first = (tile.top + row - 1) * width + tile.left;
        for (k, piece) in flags.as_chunks::<PIECE>().0.iter().enumerate() {
            let mut left = u128::from_le_bytes(*piece);
            while left != 0 {
                let x = k * PIECE + (left.trailing_zeros() / 8) as usize;
                left &= left - 1;
                let (score, at) = (here[x + 1], first + x);
                if self.mask.is_none_or(|mask| mask.as_raw()[at] != 0) && self.threshold.admits(score) {
                    peaks.push(Peak {
                        at,
                        score,
                        along_x: [here[x], here[x + 2]],
                        along_y: [above[x + 1], below[x + 1]],
                    });
                }
            }
        }
    }
}

impl Scratch {
    /// Nothing has entered yet.
    fn clear(&mut self, side: usize, span: usize, scored: usize) {
        let zeros = |buffer: &mut Vec<i16>, len: usize| {
            buffer.clear();
            buffer.resize(len, 0);
        };
        self.slopes.iter_mut().for_each(|slopes| zeros(slopes, side * span));
        self.entering.iter_mut().for_each(|slopes| zeros(slopes, span));
        for columns in &mut self.columns {
            columns.clear();
            columns.resize(span, 0);
        }
        self.windows.iter_mut().for_each(|windows| windows.resize(scored, 0));
        self.doubled.iter_mut().for_each(|doubled| doubled.resize(span, 0));
        self.scores.iter_mut().for_each(|scores| scores.resize(scored, 0.0));
        self.flags.clear();
        self.flags.resize((scored - 2).next_multiple_of(PIECE), 0);
    }
}

/// Sobel's slopes of the middle row, which begins one pixel to the left.
#[inline(always)]
fn sobel([above, here, below]: [&[u8]; 3], gx: &mut [i16], gy: &mut [i16]) {
    let span = gx.len();
    let (above, here, below) = (&above[..span + 2], &here[..span + 2], &below[..span + 2]);
    let gy = &mut gy[..span];
    for x in 0..span {
        let (a0, a1, a2) = (i16::from(above[x]), i16::from(above[x + 1]), i16::from(above[x + 2]));
        let (b0, b2) = (i16::from(here[x]), i16::from(here[x + 2]));
        let (c0, c1, c2) = (i16::from(below[x]), i16::from(below[x + 1]), i16::from(below[x + 2]));
        gx[x] = a2 - a0 + 2 * (b2 - b0) + c2 - c0;
        gy[x] = c0 - a0 + 2 * (c1 - a1) + c2 - a2;
    }
}

/// Takes the products of the old slopes out of the sums and adds those of the new ones.
#[inline(always)]
fn exchange([xx, xy, yy]: &mut [Vec<i32>; 3], [old_x, old_y]: [&[i16]; 2], [new_x, new_y]: [&[i16]; 2]) {
    let span = xx.len();
    let (xy, yy) = (&mut xy[..span], &mut yy[..span]);
    let (old_x, old_y, new_x, new_y) = (&old_x[..span], &old_y[..span], &new_x[..span], &new_y[..span]);
    for x in 0..span {
        let (ox, oy) = (i32::from(old_x[x]), i32::from(old_y[x]));
        let (nx, ny) = (i32::from(new_x[x]), i32::from(new_y[x]));
        xx[x] += nx * nx - ox * ox;
        xy[x] += nx * ny - ox * oy;
        yy[x] += ny * ny - oy * oy;
    }
}

/// Sums of `side` neighbours: those of 1, 2, 4 … neighbours whose counts add up to `side`, one after the other.
#[inline(always)]
fn add_up(columns: &[i32], side: usize, doubled: &mut [Vec<i32>; 2], out: &mut [i32]) {
    let [even, odd] = doubled;
    let (mut last, mut next) = (&mut even[..], &mut odd[..]);
    let count = out.len();
    // A window's side is odd.
    out.copy_from_slice(&columns[..count]);
    let (mut step, mut offset) = (1, 1);
    while 2 * step <= side {
        let source = if step == 1 { columns } else { &*last };
        let len = columns.len() + 1 - 2 * step;
        let (a, b, sums) = (&source[..len], &source[step..][..len], &mut next[..len]);
        for x in 0..len {
            sums[x] = a[x] + b[x];
        }
        (last, next) = (next, last);
        step *= 2;
        if side & step != 0 {
            for (out, sum) in out.iter_mut().zip(&last[offset..][..count]) {
                *out += sum;
            }
            offset += step;
        }
    }
}

/// The score of each window.
#[inline(always)]
fn smaller_eigenvalues([xx, xy, yy]: &[Vec<i32>; 3], per_score: f32, out: &mut [f32]) {
    let count = out.len();
    let (xx, xy, yy) = (&xx[..count], &xy[..count], &yy[..count]);
    for x in 0..count {
        let (xx, xy, yy) = (xx[x] as f32, xy[x] as f32, yy[x] as f32);
        let difference = xx - yy;
        out[x] = (xx + yy - (difference * difference + 4.0 * xy * xy).sqrt()) * per_score;
    }
}

/// Marks the pixels of the middle row that exceed those before them in reading order, are no less than those after
/// them, and reach `least`.
#[inline(always)]
fn flag_peaks([above, here, below]: [&[f32]; 3], least: f32, flags: &mut [u8]) {
    let count = flags.len();
    let (above, here, below) = (&above[..count + 2], &here[..count + 2], &below[..count + 2]);
    let larger = |a: f32, b: f32| if a > b { a } else { b };
    for x in 0..count {
        let score = here[x + 1];
        let before = larger(larger(above[x], above[x + 1]), larger(above[x + 2], here[x]));
        let after = larger(larger(below[x], below[x + 1]), larger(below[x + 2], here[x + 2]));
        flags[x] = u8::from((score > before) & (score >= larger(after, least)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;
    use pulp::NullaryFnOnce;

    /// Peaks as they are defined, every sum taken anew.
    fn plain(picture: &GrayImage, mask: Option<&GrayImage>, tile: Tile, half: usize, least: f64) -> Vec<Peak> {
        let grey = |x: usize, y: usize| i64::from(picture.get_pixel(x as u32, y as u32).0[0]);
        let slope = |x: usize, y: usize| {
            let across = |y: usize| grey(x + 1, y) - grey(x - 1, y);
            let down = |x: usize| grey(x, y + 1) - grey(x, y - 1);
            (across(y - 1) + 2 * across(y) + across(y + 1), down(x - 1) + 2 * down(x) + down(x + 1))
        };
        let score = |x: usize, y: usize| {
            let mut sums = [0_i64; 3];
            for (u, v) in (y - half..=y + half).flat_map(|v| (x - half..=x + half).map(move |u| (u, v))) {
                let (gx, gy) = slope(u, v);
                sums = [sums[0] + gx * gx, sums[1] + gx * gy, sums[2] + gy * gy];
            }
            let [xx, xy, yy] = sums.map(|sum| sum as f32);
            let side = 2 * half + 1;
            (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt()) * (1.0 / (128.0 * (side * side) as f32))
        };
        let mut peaks = Vec::new();
        for y in tile.top..tile.top + tile.height {
            for x in tile.left..tile.left + tile.width {
                let here = score(x, y);
                let around = |dx: usize, dy: usize| score(x + dx - 1, y + dy - 1);
                let before = [around(0, 0), around(1, 0), around(2, 0), around(0, 1)];
                let after = [around(2, 1), around(0, 2), around(1, 2), around(2, 2)];
                let peak = before.iter().all(|&s| s < here) && after.iter().all(|&s| s <= here);
                let allowed = mask.is_none_or(|mask| mask.get_pixel(x as u32, y as u32).0[0] != 0);
                if peak && allowed && f64::from(here) >= least {
                    let at = y * picture.width() as usize + x;
                    peaks.push(Peak {
                        at,
                        score: here,
                        along_x: [around(0, 1), around(2, 1)],
                        along_y: [around(1, 0), around(1, 2)],
                    });
                }
            }
        }
        peaks
    }

    #[test]
    fn every_instruction_set_finds_the_defined_peaks_whatever_the_tile() {
        let picture = GrayImage::from_fn(83, 61, |x, y| {
            Luma([(x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503 * (x / 3 + 7))).to_le_bytes()[1]])
        });
        let mask = GrayImage::from_fn(83, 61, |x, y| Luma([u8::from((x / 7 + y / 5) % 3 != 0)]));
        let tiles = [(20, 20, 1, 1), (20, 20, 16, 2), (18, 22, 17, 3), (19, 19, 45, 21)];
        for (half, (left, top, width, height)) in [1, 2, 3, 4, 7, 15].into_iter().flat_map(|h| tiles.map(|t| (h, t))) {
            let tile = Tile { left, top, width, height };
            for mask in [None, Some(&mask)] {
                let truth = plain(&picture, mask, tile, half, 30.0);
                // Scratch of another size is at hand.
                let mut scratch = Scratch::default();
                scratch.clear(5, 90, 84);
                let scratch = &mut scratch;
                let threshold = Threshold::new(30.0, 0.0);
                let find = FindPeaks { picture: &picture, mask, tile, half, threshold, scratch };
                assert_eq!(find.call(), truth, "half {half}, {tile:?}, whatever the processor");
                let threshold = Threshold::new(30.0, 0.0);
                let find = FindPeaks { picture: &picture, mask, tile, half, threshold, scratch };
                assert_eq!(pulp::Arch::new().dispatch(find), truth, "half {half}, {tile:?}, this processor");
            }
        }
    }

    #[test]
    fn the_strongest_slopes_do_not_overflow_the_largest_window() {
        let stripes = GrayImage::from_fn(60, 60, |x, y| Luma([if (x / 2 + y / 2) % 2 == 0 { 0 } else { 255 }]));
        let tile = Tile { left: 20, top: 20, width: 20, height: 20 };
        let threshold = Threshold::new(0.0, 0.0);
        let scratch = &mut Scratch::default();
        let found = FindPeaks { picture: &stripes, mask: None, tile, half: 15, threshold, scratch }.call();
        assert_eq!(found, plain(&stripes, None, tile, 15, 0.0));
    }
}
