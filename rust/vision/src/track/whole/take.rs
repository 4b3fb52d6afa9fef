//! A patch in whole numbers: its pixels, its slopes and the sums over it.

use super::pixels::{Between, Block, Reading, add, load, pair};
use super::{Cut, FRAME, QUARTER, SLOPE_SLOPE, SLOPE_VALUE, SLOPES_PER_GREY, Strip, WholePatch, rows_of};
use crate::pyramid::{Level, WORDS_PER_GREY};
use crate::track::lanes::{Kernel, Vectors};
use crate::track::patch::Stats;
use crate::track::window::Window;
use crate::track::words::{Pixel, WORDS, WordVectors};
use geometry::Vec2;

/// Where a patch is taken.
pub(in crate::track) struct TakingWhole<'t> {
    pub level: &'t Level,
    pub centre: Vec2,
    pub window: Window,
    pub copy: &'t mut Vec<i16>,
    pub patch: &'t mut WholePatch,
}

impl Kernel for TakingWhole<'_> {
    type Output = ();

    #[inline(always)]
    fn call<V: Vectors>(self, v: V) {
        let Self { level, centre, window, copy, patch } = self;
        let cut = Cut::new(window);
        let (cell, reach) = (centre.map(f64::floor), window.half as isize + 1);
        let columns = (window.side + 2).next_multiple_of(WORDS);
        let block = Block {
            left: cell.x as isize - reach,
            top: cell.y as isize - reach,
            width: columns + 1,
            height: cut.rows() + 3,
        };
        let part = centre - cell;
        let (fx, fy) = (Between::new(v, part.x), Between::new(v, part.y));
        block.read(v, level, copy, Framing { fx, fy, columns, frame: &mut patch.frame[..cut.rows() + 2] });
        let mut totals = [[0.0; 4]; 2];
        for strip in 0..cut.wide {
            patch.differentiate::<V, false>(v, &cut.wide_strip(strip), &mut totals);
        }
        if cut.narrow {
            patch.differentiate::<V, true>(v, &cut.narrow_strip(), &mut totals);
        }
        patch.stats.fill(totals, (window.side * window.side) as f64);
    }
}

/// Reads a window between the pixels.
struct Framing<'f, W> {
    fx: Between<W>,
    fy: Between<W>,
    columns: usize,
    frame: &'f mut [[i16; FRAME]],
}

impl<V: WordVectors> Reading<V> for Framing<'_, V::Words> {
    type Output = ();

    #[inline(always)]
    fn read<P: Pixel>(self, v: V, pixels: &[P], pitch: usize) {
        for column in (0..self.columns).step_by(WORDS) {
            let mut above = self.fx.of(v, pair::<V, P, false>(v, pixels, column, pitch));
            for (j, row) in self.frame.iter_mut().enumerate() {
                let below = self.fx.of(v, pair::<V, P, false>(v, pixels, column + (j + 1) * pitch, pitch));
                row[column..][..WORDS].copy_from_slice(&v.to_words(self.fy.of(v, [above, below])));
                above = below;
            }
        }
    }
}

impl WholePatch {
    /// Values and slopes of a strip, from the frame; adds up their products.
    #[inline(always)]
    fn differentiate<V: WordVectors, const PAIRED: bool>(&mut self, v: V, strip: &Strip, totals: &mut [[f64; 4]; 2]) {
        const UNIT: i32 = 32768 / (WORDS_PER_GREY / SLOPES_PER_GREY) as i32;
        const SIDE: i16 = (3 * UNIT / 32) as i16;
        const MIDDLE: i16 = (10 * UNIT / 32) as i16;
        let (side, middle, one) = (v.words([SIDE; WORDS]), v.words([MIDDLE; WORDS]), v.words([1; WORDS]));
        let frame = self.frame.as_flattened();
        let (mut slopes, mut values) = ([v.no_sums(); 4], [v.no_sums(); 4]);
        for (j, line) in self.lines[strip.first..][..strip.lines].iter_mut().enumerate() {
            let mask = v.words(strip.mask(j));
            let above = rows_of(PAIRED) * j * FRAME + strip.column;
            let (here, below) = (above + FRAME, above + 2 * FRAME);
            let falling = v.minus(at::<V, PAIRED>(v, frame, below + 2), at::<V, PAIRED>(v, frame, above));
            let rising = v.minus(at::<V, PAIRED>(v, frame, above + 2), at::<V, PAIRED>(v, frame, below));
            let across = v.minus(at::<V, PAIRED>(v, frame, here + 2), at::<V, PAIRED>(v, frame, here));
            let down = v.minus(at::<V, PAIRED>(v, frame, below + 1), at::<V, PAIRED>(v, frame, above + 1));
            let gx = v.and(v.plus(v.part(v.plus(falling, rising), side), v.part(across, middle)), mask);
            let gy = v.and(v.plus(v.part(v.minus(falling, rising), side), v.part(down, middle)), mask);
            let value = v.and(at::<V, PAIRED>(v, frame, here + 1), mask);
            let quarter = v.quarters(value);
            *line = [v.to_words(gx), v.to_words(gy), v.to_words(value)];
            slopes[0] = v.add_products(slopes[0], gx, gx);
            slopes[1] = v.add_products(slopes[1], gx, gy);
            slopes[2] = v.add_products(slopes[2], gy, gy);
            values[0] = v.add_products(values[0], gx, value);
            values[1] = v.add_products(values[1], gy, value);
            values[2] = v.add_products(values[2], quarter, quarter);
            values[3] = v.add_products(values[3], quarter, one);
        }
        add(&mut totals[0], v.totals(slopes));
        add(&mut totals[1], v.totals(values));
    }
}

/// Words of the frame.
#[inline(always)]
fn at<V: WordVectors, const PAIRED: bool>(v: V, frame: &[i16], first: usize) -> V::Words {
    load::<V, i16, PAIRED>(v, frame, first, FRAME)
}

impl Stats {
    /// From the sums of products of slopes with slopes, and of slopes with values, values with values, and values.
    #[inline(always)]
    fn fill(&mut self, [[xx, xy, yy, _], [x, y, squares, values]]: [[f64; 4]; 2], pixels: f64) {
        let mean = values * QUARTER / pixels;
        self.mean = mean as f32;
        self.energy = (squares * QUARTER * QUARTER - pixels * mean * mean).max(0.0);
        (self.cross[0], self.cross[1]) = (x * SLOPE_VALUE, y * SLOPE_VALUE);
        (self.hessian[(0, 0)], self.hessian[(1, 1)]) = (xx * SLOPE_SLOPE, yy * SLOPE_SLOPE);
        (self.hessian[(0, 1)], self.hessian[(1, 0)]) = (xy * SLOPE_SLOPE, xy * SLOPE_SLOPE);
    }
}
