//! A grey picture and its halved copies.
//!
//! Level 0 is the picture itself; the pixel `x` of level `n` lies at `(x + ½) 2ⁿ − ½` of level 0.

use geometry::Vec2;
use image::GrayImage;
use rayon::prelude::*;
use std::borrow::Cow;

/// Binomial approximation of a Gaussian of standard deviation √1.5 pixels.
const KERNEL: [f32; 7] = [1.0 / 64.0, 6.0 / 64.0, 15.0 / 64.0, 20.0 / 64.0, 15.0 / 64.0, 6.0 / 64.0, 1.0 / 64.0];
const REACH: usize = KERNEL.len() / 2;
/// Rows that one task computes.
const ROWS: usize = 32;

/// Grey values, row by row.
enum Pixels<'a> {
    /// Of the picture.
    Bytes(&'a [u8]),
    /// Of a halved one.
    Floats(Vec<f32>),
}

/// A level of a pyramid.
pub(super) struct Level<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pixels: Pixels<'a>,
}

impl<'a> Level<'a> {
    pub(super) fn from_image(image: &'a GrayImage) -> Self {
        Self { width: image.width() as usize, height: image.height() as usize, pixels: Pixels::Bytes(image.as_raw()) }
    }

    pub(super) fn from_values(width: usize, height: usize, values: Vec<f32>) -> Self {
        Self { width, height, pixels: Pixels::Floats(values) }
    }

    #[inline]
    pub(super) fn value(&self, x: usize, y: usize) -> f32 {
        self.row_values(y).value(x)
    }

    pub(super) fn contains(&self, position: &Vec2, margin: f64) -> bool {
        let inside = |v: f64, size: usize| v >= margin && v <= size as f64 - 1.0 - margin;
        inside(position.x, self.width) && inside(position.y, self.height)
    }

    /// The bilinear value at a position inside the picture.
    pub(super) fn interpolate(&self, position: &Vec2) -> f64 {
        bilinear(position, |x, y| self.value(x.min(self.width - 1), y.min(self.height - 1)))
    }

    /// A row of which single values are read.
    pub(super) fn row_values(&self, y: usize) -> RowValues<'_> {
        let range = y * self.width..(y + 1) * self.width;
        match &self.pixels {
            Pixels::Bytes(bytes) => RowValues::Bytes(&bytes[range]),
            Pixels::Floats(values) => RowValues::Floats(&values[range]),
        }
    }

    fn row(&self, y: usize) -> Cow<'_, [f32]> {
        let range = y * self.width..(y + 1) * self.width;
        match &self.pixels {
            Pixels::Bytes(bytes) => Cow::Owned(bytes[range].iter().map(|&v| f32::from(v)).collect()),
            Pixels::Floats(values) => Cow::Borrowed(&values[range]),
        }
    }

    /// Means of 2×2 pixels; an odd last row or column is dropped.
    pub(super) fn halved(&self) -> Level<'static> {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut values = vec![0.0; width * height];
        values.par_chunks_mut((ROWS * width).max(1)).enumerate().for_each(|(task, rows)| {
            let first = 2 * ROWS * task * self.width;
            let arch = pulp::Arch::new();
            match &self.pixels {
                Pixels::Bytes(bytes) => arch.dispatch(Halve { pixels: &bytes[first..], width: self.width, out: rows }),
                Pixels::Floats(floats) => {
                    arch.dispatch(Halve { pixels: &floats[first..], width: self.width, out: rows })
                }
            }
        });
        Level::from_values(width, height, values)
    }

    /// The light behind the grey values, if they were encoded as sRGB (IEC 61966-2-1), again from 0 to 255.
    pub(super) fn linear(&self) -> Level<'static> {
        /// Steps of the table between two grey values.
        const STEPS: f32 = 16.0;
        let decode = |k: usize| {
            let v = k as f32 / (255.0 * STEPS);
            255.0 * if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        let table: Vec<f32> = (0..=255 * STEPS as usize).map(decode).collect();
        let light = |y: usize| self.row(y).iter().map(|&v| table[(v * STEPS) as usize]).collect::<Vec<f32>>();
        let values = (0..self.height).into_par_iter().with_min_len(ROWS).flat_map_iter(light).collect();
        Level::from_values(self.width, self.height, values)
    }

    /// The picture blurred by [`KERNEL`]; its border is repeated outwards.
    pub(super) fn smoothed(&self) -> Plane {
        let mut values = vec![0.0; self.width * self.height];
        values.par_chunks_mut(ROWS * self.width).enumerate().for_each(|(task, out)| {
            let first = ROWS * task;
            let last = (first + out.len() / self.width + REACH).min(self.height);
            let from = first.saturating_sub(REACH);
            let source: Vec<Cow<[f32]>> = (from..last).map(|y| self.row(y)).collect();
            let mut column = vec![0.0; self.width + 2 * REACH];
            for (k, out) in out.chunks_exact_mut(self.width).enumerate() {
                let rows = std::array::from_fn(|n| {
                    let y = (first + k + n).saturating_sub(REACH).min(self.height - 1);
                    &source[y - from][..]
                });
                pulp::Arch::new().dispatch(SmoothRow { rows, column: &mut column, out });
            }
        });
        Plane { width: self.width, height: self.height, values }
    }
}

/// One row of a level.
pub(super) enum RowValues<'a> {
    /// Of the picture.
    Bytes(&'a [u8]),
    /// Of a halved one.
    Floats(&'a [f32]),
}

impl RowValues<'_> {
    #[inline]
    pub(super) fn value(&self, x: usize) -> f32 {
        match self {
            Self::Bytes(row) => f32::from(row[x]),
            Self::Floats(row) => row[x],
        }
    }

    /// Appends the values of a part of the row.
    pub(super) fn append(&self, columns: std::ops::Range<usize>, to: &mut Vec<f32>) {
        match self {
            Self::Bytes(row) => to.extend(row[columns].iter().map(|&v| f32::from(v))),
            Self::Floats(row) => to.extend_from_slice(&row[columns]),
        }
    }
}

/// Computed values, row by row.
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..(y + 1) * self.width]
    }

    /// The bilinear value at a position inside the plane.
    pub(super) fn interpolate(&self, position: &Vec2) -> f64 {
        bilinear(position, |x, y| self.row(y)[x])
    }
}

fn bilinear(position: &Vec2, at: impl Fn(usize, usize) -> f32) -> f64 {
    let (x, y) = (position.x as usize, position.y as usize);
    let (u, v) = (position.x - x as f64, position.y - y as f64);
    let line = |y: usize| (1.0 - u) * f64::from(at(x, y)) + u * f64::from(at(x + 1, y));
    (1.0 - v) * line(y) + v * line(y + 1)
}

/// Values of which four can be added exactly.
trait Grey: Copy {
    fn mean(four: [Self; 4]) -> f32;
}

impl Grey for u8 {
    #[inline(always)]
    fn mean([a, b, c, d]: [Self; 4]) -> f32 {
        0.25 * f32::from(u16::from(a) + u16::from(b) + u16::from(c) + u16::from(d))
    }
}

impl Grey for f32 {
    #[inline(always)]
    fn mean([a, b, c, d]: [Self; 4]) -> f32 {
        0.25 * (a + b + c + d)
    }
}

/// Halves the rows of a picture, as many as `out` has room for.
struct Halve<'a, T> {
    pixels: &'a [T],
    width: usize,
    out: &'a mut [f32],
}

impl<T: Grey> pulp::NullaryFnOnce for Halve<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { pixels, width, out } = self;
        for (out, rows) in out.chunks_exact_mut(width / 2).zip(pixels.chunks(2 * width)) {
            let (upper, lower) = rows.split_at(width);
            for ((value, a), b) in out.iter_mut().zip(upper.chunks_exact(2)).zip(lower.chunks_exact(2)) {
                *value = T::mean([a[0], a[1], b[0], b[1]]);
            }
        }
    }
}

/// One row of a smoothed picture from the seven around it.
struct SmoothRow<'a> {
    rows: [&'a [f32]; KERNEL.len()],
    /// Room for the row and its margins.
    column: &'a mut [f32],
    out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for SmoothRow<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { rows: [a, b, c, d, e, f, g], column, out } = self;
        let width = out.len();
        let (a, b, c, d) = (&a[..width], &b[..width], &c[..width], &d[..width]);
        let (e, f, g) = (&e[..width], &f[..width], &g[..width]);
        let [w0, w1, w2, w3, ..] = KERNEL;
        for (x, value) in column[REACH..REACH + width].iter_mut().enumerate() {
            *value = w0 * (a[x] + g[x]) + w1 * (b[x] + f[x]) + w2 * (c[x] + e[x]) + w3 * d[x];
        }
        let (first, last) = (column[REACH], column[REACH + width - 1]);
        column[..REACH].fill(first);
        column[REACH + width..].fill(last);
        for (value, w) in out.iter_mut().zip(column.windows(KERNEL.len())) {
            *value = w0 * (w[0] + w[6]) + w1 * (w[1] + w[5]) + w2 * (w[2] + w[4]) + w3 * w[3];
        }
    }
}

/// A picture's position one level finer.
pub(super) fn finer(position: Vec2) -> Vec2 {
    position.map(|x| 2.0 * x + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: u32, height: u32) -> GrayImage {
        GrayImage::from_fn(width, height, |x, y| image::Luma([(3 * x + 2 * y) as u8]))
    }

    #[test]
    fn halving_keeps_a_ramp_and_drops_the_odd_rest() {
        let image = ramp(41, 35);
        let half = Level::from_image(&image).halved();
        assert_eq!((half.width, half.height), (20, 17));
        let quarter = half.halved();
        for (level, scale) in [(&half, 1), (&quarter, 2)] {
            let at = (0..scale).fold(Vec2::new(3.0, 2.0), |p, _| finer(p));
            assert_eq!(level.value(3, 2), (3.0 * at.x + 2.0 * at.y) as f32);
        }
    }

    #[test]
    fn smoothing_keeps_a_ramp_inside_and_the_sum_of_a_dot() {
        let image = ramp(40, 30);
        let smooth = Level::from_image(&image).smoothed();
        assert!((smooth.row(15)[20] - 90.0).abs() < 1e-4);
        let mut dot = vec![0.0; 81 * 70];
        dot[35 * 81 + 40] = 1.0;
        let smooth = Level::from_values(81, 70, dot).smoothed();
        let sum: f32 = smooth.values.iter().sum();
        assert!((sum - 1.0).abs() < 1e-5 && (smooth.row(35)[40] - KERNEL[3] * KERNEL[3]).abs() < 1e-6);
    }
}
