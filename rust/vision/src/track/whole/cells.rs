//! Steps from the products of a patch and the four windows at whole positions around where it is looked for.

use super::pixels::{Block, Reading, add, pair};
use super::{Cut, SLOPE_VALUE, Strip, WholePatch, rows_of};
use crate::pyramid::{Interpolation, Level};
use crate::track::iterate::{Look, Plan, Rest, Stepping};
use crate::track::lanes::{Kernel, Vectors};
use crate::track::measure::Sums;
use crate::track::solve::{Pose, Solver};
use crate::track::window::Window;
use crate::track::words::{Pixel, WordVectors};
use geometry::Vec2;

/// Steps until they are short; `None` when they lead too far.
pub(in crate::track) struct IterateWhole<'s> {
    pub level: &'s Level,
    pub window: Window,
    pub patch: &'s WholePatch,
    pub copy: &'s mut Vec<i16>,
    pub pose: &'s mut Pose,
    pub solver: &'s Solver,
    pub plan: Plan,
}

impl Kernel for IterateWhole<'_> {
    type Output = Option<Rest>;

    #[inline(always)]
    fn call<V: Vectors>(self, v: V) -> Option<Rest> {
        let Self { level, window, patch, copy, pose, solver, plan } = self;
        let (total, half) = ((window.side * window.side) as f64, window.half as f64);
        let cut = Cut::new(window);
        let stepping = Stepping { solver, plan, stats: &patch.stats, total, half };
        let cell = Vec2::from_element(f64::NAN);
        let cells = Cells { level, window, patch, copy, cut, cell, products: [[0.0; 4]; 2] };
        stepping.run::<V, _, false, false>(v, pose, cells)
    }
}

/// Remembers the products of the last cell.
struct Cells<'s> {
    level: &'s Level,
    window: Window,
    patch: &'s WholePatch,
    copy: &'s mut Vec<i16>,
    cut: Cut,
    cell: Vec2,
    products: [[f64; 4]; 2],
}

impl<V: Vectors> Look<V, false, false> for Cells<'_> {
    #[inline(always)]
    fn look(&mut self, v: V, pose: &Pose, _: Interpolation) -> Sums {
        let cell = Vec2::new(pose.position.x.floor(), pose.position.y.floor());
        if cell != self.cell {
            self.products = self.multiply(v, &cell);
            self.cell = cell;
        }
        let (fx, fy) = (pose.position.x - cell.x, pose.position.y - cell.y);
        let mut sums = Sums::default();
        for k in 0..2 {
            let [a, b, c, d] = self.products[k];
            let (above, below) = (a + fx * (b - a), c + fx * (d - c));
            sums.images[k] = above + fy * (below - above);
        }
        sums
    }
}

impl Cells<'_> {
    /// Products of both slopes with the windows at the corners of a cell.
    #[inline(always)]
    fn multiply<V: WordVectors>(&mut self, v: V, cell: &Vec2) -> [[f64; 4]; 2] {
        let Self { level, patch, cut, copy, .. } = self;
        let reach = self.window.half as isize;
        let block = Block {
            left: cell.x as isize - reach,
            top: cell.y as isize - reach,
            width: cut.columns() + 1,
            height: cut.rows() + 1,
        };
        block.read(v, level, copy, Products { patch, cut: *cut })
    }
}

/// Products of a patch's slopes with the windows that begin at the first pixel, the next one, and those below.
pub(super) struct Products<'p> {
    pub patch: &'p WholePatch,
    pub cut: Cut,
}

impl<V: WordVectors> Reading<V> for Products<'_> {
    type Output = [[f64; 4]; 2];

    #[inline(always)]
    fn read<P: Pixel>(self, v: V, pixels: &[P], pitch: usize) -> [[f64; 4]; 2] {
        let mut products = [[0.0; 4]; 2];
        for strip in 0..self.cut.wide {
            self.patch.multiply::<V, P, false>(v, &self.cut.wide_strip(strip), pixels, pitch, &mut products);
        }
        if self.cut.narrow {
            self.patch.multiply::<V, P, true>(v, &self.cut.narrow_strip(), pixels, pitch, &mut products);
        }
        for products in products.as_flattened_mut() {
            *products *= SLOPE_VALUE;
        }
        products
    }
}

impl WholePatch {
    #[inline(always)]
    fn multiply<V: WordVectors, P: Pixel, const PAIRED: bool>(
        &self,
        v: V,
        strip: &Strip,
        pixels: &[P],
        pitch: usize,
        products: &mut [[f64; 4]; 2],
    ) {
        let mut sums = [[v.no_sums(); 4]; 2];
        let mut at = strip.column;
        let mut below = pair::<V, P, PAIRED>(v, pixels, at, pitch);
        for line in &self.lines[strip.first..][..strip.lines] {
            let above = if PAIRED { pair::<V, P, PAIRED>(v, pixels, at, pitch) } else { below };
            below = pair::<V, P, PAIRED>(v, pixels, at + pitch, pitch);
            for k in 0..2 {
                let slope = v.words(line[k]);
                sums[k][0] = v.add_products(sums[k][0], slope, above[0]);
                sums[k][1] = v.add_products(sums[k][1], slope, above[1]);
                sums[k][2] = v.add_products(sums[k][2], slope, below[0]);
                sums[k][3] = v.add_products(sums[k][3], slope, below[1]);
            }
            at += rows_of(PAIRED) * pitch;
        }
        add(&mut products[0], v.totals(sums[0]));
        add(&mut products[1], v.totals(sums[1]));
    }
}
