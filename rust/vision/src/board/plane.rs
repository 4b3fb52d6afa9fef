//! Grey pictures in floating point and their halved copies.
//!
//! Level 0 is the picture itself; the pixel `x` of level `n` lies at `(x + ½) 2ⁿ − ½` of level 0.

use geometry::Vec2;
use image::GrayImage;
use rayon::prelude::*;

/// Binomial approximation of a Gaussian of standard deviation √1.5 pixels.
const KERNEL: [f32; 7] = [1.0 / 64.0, 6.0 / 64.0, 15.0 / 64.0, 20.0 / 64.0, 15.0 / 64.0, 6.0 / 64.0, 1.0 / 64.0];
const REACH: usize = KERNEL.len() / 2;

/// A grey picture, row by row.
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<f32>,
}

impl Plane {
    pub(super) fn from_image(image: &GrayImage) -> Self {
        let pixels = image.as_raw().par_iter().with_min_len(1 << 14).map(|&v| f32::from(v)).collect();
        Self { width: image.width() as usize, height: image.height() as usize, pixels }
    }

    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.pixels[y * self.width..(y + 1) * self.width]
    }

    /// The bilinear value at a position inside the picture.
    pub(super) fn interpolate(&self, position: &Vec2) -> f64 {
        let (x, y) = (position.x as usize, position.y as usize);
        let (u, v) = (position.x - x as f64, position.y - y as f64);
        let line = |row: &[f32]| (1.0 - u) * f64::from(row[x]) + u * f64::from(row[x + 1]);
        (1.0 - v) * line(self.row(y)) + v * line(self.row(y + 1))
    }

    /// Means of 2×2 pixels; an odd last row or column is dropped.
    pub(super) fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut pixels = vec![0.0; width * height];
        pixels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, out)| {
            let (upper, lower) = (self.row(2 * y), self.row(2 * y + 1));
            for ((value, a), b) in out.iter_mut().zip(upper.chunks_exact(2)).zip(lower.chunks_exact(2)) {
                *value = 0.25 * (a[0] + a[1] + b[0] + b[1]);
            }
        });
        Self { width, height, pixels }
    }

    /// The picture blurred by [`KERNEL`]; its border is repeated outwards.
    pub(super) fn smoothed(&self) -> Self {
        let mut pixels = vec![0.0; self.pixels.len()];
        pixels.par_chunks_mut(self.width).enumerate().for_each(|(y, out)| {
            let mut column = vec![0.0; self.width + 2 * REACH];
            for (k, weight) in KERNEL.iter().enumerate() {
                let row = self.row((y + k).saturating_sub(REACH).min(self.height - 1));
                for (sum, value) in column[REACH..].iter_mut().zip(row) {
                    *sum += weight * value;
                }
            }
            let (first, last) = (column[REACH], column[REACH + self.width - 1]);
            column[..REACH].fill(first);
            column[REACH + self.width..].fill(last);
            for (k, weight) in KERNEL.iter().enumerate() {
                for (sum, value) in out.iter_mut().zip(&column[k..]) {
                    *sum += weight * value;
                }
            }
        });
        Self { width: self.width, height: self.height, pixels }
    }
}

/// A picture's position one level finer.
pub(super) fn finer(position: Vec2) -> Vec2 {
    position.map(|x| 2.0 * x + 0.5)
}
