//! Pixels of a level around a window, fetched once, and the ways to read a window from them.
//!
//! A [`Reader`] walks down a strip of eight columns and gives eight samples per row. Without a warp all pixels of a
//! window lie equally far between their neighbours, and each row is interpolated along x only once.

use super::lanes::{Eight, LANES, Lanes, Vectors, nearest};
use crate::pyramid::{Interpolation, Level};
use geometry::Vec2;
use nalgebra::Matrix2;

/// Pixels fetched beyond what the first reading needs, so that the iterations that follow stay within.
const SLACK: isize = 2;

/// A window to be read: `columns × rows` samples, that at `(i, j)` from `centre + warp · (i − origin, j − origin)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub centre: Vec2,
    pub warp: Matrix2<f64>,
    pub origin: usize,
    pub columns: usize,
    pub rows: usize,
    /// Columns that are read, wanted or not, so that strips are whole.
    pub span: usize,
}

impl Sight {
    /// Whether it is only shifted.
    #[inline(always)]
    fn is_shifted(&self) -> bool {
        self.warp == Matrix2::identity()
    }

    /// First and last column and row of pixels that the kernels touch.
    #[inline(always)]
    fn bounds(&self, interpolation: Interpolation) -> [isize; 4] {
        let (before, after) = (self.origin as f64, (self.rows - 1 - self.origin) as f64);
        if self.is_shifted() {
            let (x, y) = (self.centre.x.floor() as isize, self.centre.y.floor() as isize);
            let (left, top) = (x - self.origin as isize, y - self.origin as isize);
            let more = if interpolation == Interpolation::Bicubic { 1 } else { 0 };
            let (right, bottom) = (left + self.span as isize + more, top + self.rows as isize + more);
            return [left - more, right, top - more, bottom];
        }
        let far = before.max(after);
        let x = far * (self.warp.m11.abs() + self.warp.m12.abs());
        let y = far * (self.warp.m21.abs() + self.warp.m22.abs());
        let (cx, cy) = (self.centre.x, self.centre.y);
        [
            (cx - x).floor() as isize - 2,
            (cx + x).floor() as isize + 3,
            (cy - y).floor() as isize - 2,
            (cy + y).floor() as isize + 3,
        ]
    }
}

/// Pixels of a level around a window.
#[derive(Default)]
pub(super) struct Region {
    left: isize,
    top: isize,
    width: usize,
    height: usize,
    pixels: Vec<f32>,
}

impl Region {
    /// Forgets what was fetched: another level or picture follows.
    #[inline(always)]
    pub fn clear(&mut self) {
        (self.width, self.height) = (0, 0);
    }

    /// Fetches pixels unless those at hand suffice for every kernel; `slack` for more than one reading.
    #[inline(always)]
    pub fn cover(&mut self, level: &Level, sight: &Sight, interpolation: Interpolation, slack: bool) {
        let [x0, x1, y0, y1] = sight.bounds(interpolation);
        let held = x0 >= self.left
            && y0 >= self.top
            && x1 < self.left + self.width as isize
            && y1 < self.top + self.height as isize;
        if held {
            return;
        }
        let slack = if slack { SLACK } else { 0 };
        (self.left, self.top) = (x0 - slack, y0 - slack);
        self.width = ((x1 + slack - self.left + 1) as usize).next_multiple_of(LANES);
        self.height = (y1 + slack - self.top + 1) as usize;
        level.copy_window(self.left, self.top, self.width, self.height, &mut self.pixels);
    }

    #[inline(always)]
    fn local(&self, at: &Vec2) -> Vec2 {
        Vec2::new(at.x - self.left as f64, at.y - self.top as f64)
    }

    /// The index of the window's first pixel and how far beyond it the window begins, for a shifted window.
    #[inline(always)]
    fn corner(&self, sight: &Sight) -> (usize, f32, f32) {
        let at = self.local(&sight.centre);
        let (x, y) = (at.x as usize, at.y as usize);
        let first = (y - sight.origin) * self.width + x - sight.origin;
        (first, (at.x - x as f64) as f32, (at.y - y as f64) as f32)
    }

    /// Calls `task` with the reader that suits the window; what it needs must have been covered.
    #[inline(always)]
    pub fn read<V: Vectors, T: Task<V>>(
        &self,
        v: V,
        sight: &Sight,
        interpolation: Interpolation,
        task: T,
    ) -> T::Output {
        match (sight.is_shifted(), interpolation) {
            (true, Interpolation::Bilinear) => task.run(&mut ShiftedBilinear::new(v, self, sight)),
            (true, Interpolation::Bicubic) => task.run(&mut ShiftedBicubic::new(v, self, sight)),
            (false, Interpolation::Bilinear) => task.run(&mut Warped::<V, false>::new(v, self, sight)),
            (false, Interpolation::Bicubic) => task.run(&mut Warped::<V, true>::new(v, self, sight)),
        }
    }
}

/// Samples of a window, strip by strip.
pub(super) trait Reader<V: Vectors> {
    /// Goes to the top of the strip that begins at a column.
    fn strip(&mut self, column: usize);
    /// The next row of the strip.
    fn row(&mut self) -> Lanes<V>;
}

/// Something done with a reader of any kind.
pub(super) trait Task<V: Vectors> {
    type Output;
    fn run(self, reader: &mut impl Reader<V>) -> Self::Output;
}

struct ShiftedBilinear<'r, V: Vectors> {
    v: V,
    pixels: &'r [f32],
    pitch: usize,
    first: usize,
    cursor: usize,
    fx: Lanes<V>,
    fy: Lanes<V>,
    above: Lanes<V>,
}

impl<'r, V: Vectors> ShiftedBilinear<'r, V> {
    #[inline(always)]
    fn new(v: V, region: &'r Region, sight: &Sight) -> Self {
        let (first, fx, fy) = region.corner(sight);
        let (fx, fy) = (Lanes::all(v, fx), Lanes::all(v, fy));
        Self { v, pixels: &region.pixels, pitch: region.width, first, cursor: first, fx, fy, above: Lanes::zero(v) }
    }

    #[inline(always)]
    fn along_x(&self) -> Lanes<V> {
        let pixels = &self.pixels[self.cursor..][..LANES + 1];
        let left = Lanes::load(self.v, pixels);
        left + self.fx * (Lanes::load(self.v, &pixels[1..]) - left)
    }
}

impl<V: Vectors> Reader<V> for ShiftedBilinear<'_, V> {
    #[inline(always)]
    fn strip(&mut self, column: usize) {
        self.cursor = self.first + column;
        self.above = self.along_x();
    }

    #[inline(always)]
    fn row(&mut self) -> Lanes<V> {
        self.cursor += self.pitch;
        let (above, below) = (self.above, self.along_x());
        self.above = below;
        above + self.fy * (below - above)
    }
}

struct ShiftedBicubic<'r, V: Vectors> {
    v: V,
    pixels: &'r [f32],
    pitch: usize,
    first: usize,
    cursor: usize,
    wx: [Lanes<V>; 4],
    wy: [Lanes<V>; 4],
    rows: [Lanes<V>; 3],
}

impl<'r, V: Vectors> ShiftedBicubic<'r, V> {
    #[inline(always)]
    fn new(v: V, region: &'r Region, sight: &Sight) -> Self {
        let (corner, fx, fy) = region.corner(sight);
        let (first, pitch) = (corner - region.width - 1, region.width);
        let (wx, wy) = (cubic(v, Lanes::all(v, fx)), cubic(v, Lanes::all(v, fy)));
        Self { v, pixels: &region.pixels, pitch, first, cursor: first, wx, wy, rows: [Lanes::zero(v); 3] }
    }

    #[inline(always)]
    fn along_x(&mut self) -> Lanes<V> {
        let pixels = &self.pixels[self.cursor..][..LANES + 3];
        self.cursor += self.pitch;
        let w = &self.wx;
        (w[0] * Lanes::load(self.v, pixels) + w[1] * Lanes::load(self.v, &pixels[1..]))
            + (w[2] * Lanes::load(self.v, &pixels[2..]) + w[3] * Lanes::load(self.v, &pixels[3..]))
    }
}

impl<V: Vectors> Reader<V> for ShiftedBicubic<'_, V> {
    #[inline(always)]
    fn strip(&mut self, column: usize) {
        self.cursor = self.first + column;
        for k in 0..3 {
            self.rows[k] = self.along_x();
        }
    }

    #[inline(always)]
    fn row(&mut self) -> Lanes<V> {
        let ([a, b, c], d, w) = (self.rows, self.along_x(), &self.wy);
        self.rows = [b, c, d];
        (w[0] * a + w[1] * b) + (w[2] * c + w[3] * d)
    }
}

struct Warped<'r, V: Vectors, const CUBIC: bool> {
    v: V,
    pixels: &'r [f32],
    pitch: usize,
    columns: usize,
    /// Position of the first sample, and what one column and one row add to it.
    start: [f32; 2],
    per_column: [f32; 2],
    per_row: [f32; 2],
    count: usize,
    x: Lanes<V>,
    y: Lanes<V>,
}

impl<'r, V: Vectors, const CUBIC: bool> Warped<'r, V, CUBIC> {
    #[inline(always)]
    fn new(v: V, region: &'r Region, sight: &Sight) -> Self {
        let (warp, origin) = (&sight.warp, sight.origin as f64);
        let start = region.local(&sight.centre) - warp * Vec2::new(origin, origin);
        Self {
            v,
            pixels: &region.pixels,
            pitch: region.width,
            columns: sight.columns,
            start: [start.x as f32, start.y as f32],
            per_column: [warp.m11 as f32, warp.m21 as f32],
            per_row: [warp.m12 as f32, warp.m22 as f32],
            count: 0,
            x: Lanes::zero(v),
            y: Lanes::zero(v),
        }
    }
}

impl<V: Vectors, const CUBIC: bool> Reader<V> for Warped<'_, V, CUBIC> {
    #[inline(always)]
    fn strip(&mut self, column: usize) {
        let columns = Lanes::count(self.v, column as f32);
        self.count = LANES.min(self.columns.saturating_sub(column));
        self.x = Lanes::all(self.v, self.start[0]) + columns * Lanes::all(self.v, self.per_column[0]);
        self.y = Lanes::all(self.v, self.start[1]) + columns * Lanes::all(self.v, self.per_column[1]);
    }

    #[inline(always)]
    fn row(&mut self) -> Lanes<V> {
        let (x, y) = (self.x, self.y);
        self.x += Lanes::all(self.v, self.per_row[0]);
        self.y += Lanes::all(self.v, self.per_row[1]);
        // Half a pixel less, rounded to the nearest, is the whole part or, at whole positions, the one before it.
        let half = Lanes::all(self.v, 0.5);
        let (left, top) = ((x - half).rounded(nearest(0)), (y - half).rounded(nearest(0)));
        let index = top * Lanes::all(self.v, self.pitch as f32) + left;
        // Numbers below 2²² are whole in the mantissa's last bits after this sum.
        const MAGIC: f32 = nearest(0);
        let shifted = (index + Lanes::all(self.v, MAGIC)).numbers();
        let mut first = [0; LANES];
        for k in 0..LANES {
            first[k] = shifted[k].to_bits().wrapping_sub(MAGIC.to_bits());
        }
        let (fx, fy) = (x - left, y - top);
        if CUBIC {
            bicubic(self.v, self.pixels, self.pitch, &first, self.count, fx, fy)
        } else {
            bilinear(self.v, self.pixels, self.pitch, &first, self.count, fx, fy)
        }
    }
}

#[inline(always)]
fn bilinear<V: Vectors>(
    v: V,
    pixels: &[f32],
    pitch: usize,
    first: &[u32; LANES],
    count: usize,
    fx: Lanes<V>,
    fy: Lanes<V>,
) -> Lanes<V> {
    let mut corners: [Eight; 4] = [[0.0; LANES]; 4];
    for k in 0..count.min(LANES) {
        let around = &pixels[first[k] as usize..][..pitch + 2];
        corners[0][k] = around[0];
        corners[1][k] = around[1];
        corners[2][k] = around[pitch];
        corners[3][k] = around[pitch + 1];
    }
    let [a, b] = [Lanes::new(v, corners[0]), Lanes::new(v, corners[1])];
    let [c, d] = [Lanes::new(v, corners[2]), Lanes::new(v, corners[3])];
    let (above, below) = (a + fx * (b - a), c + fx * (d - c));
    above + fy * (below - above)
}

#[inline(always)]
fn bicubic<V: Vectors>(
    v: V,
    pixels: &[f32],
    pitch: usize,
    first: &[u32; LANES],
    count: usize,
    fx: Lanes<V>,
    fy: Lanes<V>,
) -> Lanes<V> {
    let (wx, wy) = (cubic(v, fx), cubic(v, fy));
    let wy = [wy[0].numbers(), wy[1].numbers(), wy[2].numbers(), wy[3].numbers()];
    let mut columns: [Eight; 4] = [[0.0; LANES]; 4];
    for k in 0..count.min(LANES) {
        let around = &pixels[first[k] as usize - pitch - 1..][..3 * pitch + 4];
        let mut sums = [0.0; 4];
        for (j, w) in wy.iter().enumerate() {
            let line = &around[j * pitch..][..4];
            for i in 0..4 {
                sums[i] += w[k] * line[i];
            }
        }
        for i in 0..4 {
            columns[i][k] = sums[i];
        }
    }
    let [a, b] = [Lanes::new(v, columns[0]), Lanes::new(v, columns[1])];
    let [c, d] = [Lanes::new(v, columns[2]), Lanes::new(v, columns[3])];
    (wx[0] * a + wx[1] * b) + (wx[2] * c + wx[3] * d)
}

/// The bicubic weights of the pixels −1, 0, 1 and 2.
#[inline(always)]
fn cubic<V: Vectors>(v: V, t: Lanes<V>) -> [Lanes<V>; 4] {
    let (t2, t3) = (t * t, t * t * t);
    let (half_t, half_t3) = (Lanes::all(v, 0.5) * t, Lanes::all(v, 0.5) * t3);
    [
        t2 - half_t - half_t3,
        Lanes::all(v, 1.0) - Lanes::all(v, 2.5) * t2 + Lanes::all(v, 1.5) * t3,
        half_t + Lanes::all(v, 2.0) * t2 - Lanes::all(v, 1.5) * t3,
        half_t3 - Lanes::all(v, 0.5) * t2,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::Pyramid;
    use crate::track::lanes::Plain;
    use image::{GrayImage, Luma};

    /// Keeps what it reads.
    struct Copy {
        columns: usize,
        rows: usize,
    }

    impl<V: Vectors> Task<V> for Copy {
        type Output = Vec<Vec<f32>>;

        fn run(self, reader: &mut impl Reader<V>) -> Self::Output {
            let mut out = vec![Vec::new(); self.rows];
            for column in (0..self.columns).step_by(LANES) {
                reader.strip(column);
                for line in &mut out {
                    line.extend_from_slice(&reader.row().numbers()[..LANES.min(self.columns - column)]);
                }
            }
            out
        }
    }

    #[test]
    fn every_reading_agrees_with_sampling_pixel_by_pixel() {
        let picture = GrayImage::from_fn(91, 71, |x, y| Luma([((x * x + 3 * y * x + 7 * y) % 251) as u8]));
        let pyramid = Pyramid::new(&picture, 1);
        let (level, mut region) = (pyramid.finest(), Region::default());
        for (side, centre) in
            [(3_usize, Vec2::new(40.0, 30.0)), (11, Vec2::new(40.37, 30.81)), (31, Vec2::new(45.99, 35.5))]
        {
            for warp in [Matrix2::identity(), Matrix2::new(0.8, 0.2, -0.1, 1.1)] {
                for interpolation in [Interpolation::Bilinear, Interpolation::Bicubic] {
                    let (origin, half, span) = (side / 2, (side / 2) as f64, side.next_multiple_of(LANES));
                    let sight = Sight { centre, warp, origin, columns: side, rows: side, span };
                    region.cover(level, &sight, interpolation, true);
                    let read = region.read(Plain, &sight, interpolation, Copy { columns: side, rows: side });
                    for (j, row) in read.iter().enumerate() {
                        for (i, &read) in row.iter().enumerate() {
                            let at = centre + warp * Vec2::new(i as f64 - half, j as f64 - half);
                            let truth = level.sample(&at, interpolation).unwrap();
                            assert!((f64::from(read) - truth).abs() < 0.01, "{side}: {read} is not {truth}");
                        }
                    }
                }
            }
        }
    }
}
