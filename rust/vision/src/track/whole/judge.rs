//! How well a patch in whole numbers fits where it is.

use super::pixels::{Between, Block, Reading, add, pair};
use super::{Cut, QUARTER, Strip, WholePatch, rows_of};
use crate::pyramid::Level;
use crate::track::lanes::{Kernel, Vectors};
use crate::track::measure::Sums;
use crate::track::solve::Fit;
use crate::track::window::Window;
use crate::track::words::{Pixel, WORDS, WordVectors};
use geometry::Vec2;

/// Measures the fit where a patch is.
pub(in crate::track) struct JudgeWhole<'s> {
    pub level: &'s Level,
    pub window: Window,
    pub patch: &'s WholePatch,
    pub copy: &'s mut Vec<i16>,
    pub position: Vec2,
}

impl Kernel for JudgeWhole<'_> {
    type Output = Fit;

    #[inline(always)]
    fn call<V: Vectors>(self, v: V) -> Fit {
        let Self { level, window, patch, copy, position } = self;
        let (cut, cell, reach) = (Cut::new(window), position.map(f64::floor), window.half as isize);
        let block = Block {
            left: cell.x as isize - reach,
            top: cell.y as isize - reach,
            width: cut.columns() + 1,
            height: cut.rows() + 1,
        };
        let part = position - cell;
        let (fx, fy) = (Between::new(v, part.x), Between::new(v, part.y));
        let sums = block.read(v, level, copy, Comparison { patch, cut, fx, fy });
        Fit::new(&sums, &patch.stats, (window.side * window.side) as f64, false)
    }
}

/// Sums over a window, less the patch's mean.
struct Comparison<'p, W> {
    patch: &'p WholePatch,
    cut: Cut,
    fx: Between<W>,
    fy: Between<W>,
}

impl<V: WordVectors> Reading<V> for Comparison<'_, V::Words> {
    type Output = Sums;

    #[inline(always)]
    fn read<P: Pixel>(self, v: V, pixels: &[P], pitch: usize) -> Sums {
        let mut totals = [0.0; 4];
        for strip in 0..self.cut.wide {
            add(&mut totals, self.compare::<V, P, false>(v, &self.cut.wide_strip(strip), pixels, pitch));
        }
        if self.cut.narrow {
            add(&mut totals, self.compare::<V, P, true>(v, &self.cut.narrow_strip(), pixels, pitch));
        }
        let (pixels, mean) = ((self.cut.side * self.cut.side) as f64, f64::from(self.patch.stats.mean));
        let (sum, squares, values) =
            (totals[0] * QUARTER, totals[1] * QUARTER * QUARTER, totals[2] * QUARTER * QUARTER);
        Sums {
            sum: sum - pixels * mean,
            squares: (squares - 2.0 * mean * sum + pixels * mean * mean).max(0.0),
            values: values - mean * sum,
            ..Sums::default()
        }
    }
}

impl<W: Copy> Comparison<'_, W> {
    /// Sums of a strip's pixels, their squares, and their products with the patch, all of quarters of them.
    #[inline(always)]
    fn compare<V: WordVectors<Words = W>, P: Pixel, const PAIRED: bool>(
        &self,
        v: V,
        strip: &Strip,
        pixels: &[P],
        pitch: usize,
    ) -> [f64; 4] {
        let one = v.words([1; WORDS]);
        let mut sums = [v.no_sums(); 4];
        for (j, line) in self.patch.lines[strip.first..][..strip.lines].iter().enumerate() {
            let at = rows_of(PAIRED) * j * pitch + strip.column;
            let above = self.fx.of(v, pair::<V, P, PAIRED>(v, pixels, at, pitch));
            let below = self.fx.of(v, pair::<V, P, PAIRED>(v, pixels, at + pitch, pitch));
            let grey = v.quarters(v.and(self.fy.of(v, [above, below]), v.words(strip.mask(j))));
            sums[0] = v.add_products(sums[0], grey, one);
            sums[1] = v.add_products(sums[1], grey, grey);
            sums[2] = v.add_products(sums[2], grey, v.quarters(v.words(line[2])));
        }
        v.totals(sums)
    }
}
