//! Reading a warped window of a level fast: the pixels around are fetched once, as `f32` and with the frame's edge
//! already repeated, and every iteration reads from them.

use crate::pyramid::{Interpolation, Level, weights};
use geometry::Vec2;
use nalgebra::Matrix2;

/// Pixels fetched beyond what the first reading needs, so that the iterations that follow stay within.
const SLACK: f64 = 2.0;

/// The shape of a square window. Buffers hold its rows padded to whole vectors; the padding of templates is zero, so
/// that what stands there in samples does not count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub half: usize,
    pub side: usize,
    /// Length of a padded row.
    pub pitch: usize,
}

impl Window {
    pub fn new(side: usize) -> Self {
        Self { half: side / 2, side, pitch: side.next_multiple_of(8) }
    }

    /// Pixels without the padding.
    pub fn count(&self) -> usize {
        self.side * self.side
    }

    /// Length of a buffer.
    pub fn len(&self) -> usize {
        self.side * self.pitch
    }
}

/// Pixels of a level around a window, kept between iterations.
#[derive(Default)]
pub(super) struct Region {
    left: isize,
    top: isize,
    width: usize,
    height: usize,
    pixels: Vec<f32>,
    /// Rows after the horizontal pass of the bicubic kernel.
    rows: Vec<f32>,
}

impl Region {
    /// Forgets what was fetched: another level or picture follows.
    pub fn clear(&mut self) {
        (self.width, self.height) = (0, 0);
    }

    /// Reads `level(centre + warp · x) − offset` for every `x` of the window, row by row, into `out`.
    pub fn read(
        &mut self,
        level: &Level,
        centre: &Vec2,
        warp: &Matrix2<f64>,
        window: Window,
        interpolation: Interpolation,
        offset: f32,
        out: &mut Vec<f32>,
    ) {
        out.resize(window.len(), 0.0);
        self.cover(level, centre, warp, window);
        let local = centre - Vec2::new(self.left as f64, self.top as f64);
        match (*warp == Matrix2::identity(), interpolation) {
            (true, Interpolation::Bilinear) => self.shifted_bilinear(&local, window, offset, out),
            (true, Interpolation::Bicubic) => self.shifted_bicubic(&local, window, offset, out),
            (false, Interpolation::Bilinear) => self.warped_bilinear(&local, warp, window, offset, out),
            (false, Interpolation::Bicubic) => self.warped_bicubic(&local, warp, window, offset, out),
        }
    }

    /// Fetches pixels unless those at hand suffice for every kernel.
    fn cover(&mut self, level: &Level, centre: &Vec2, warp: &Matrix2<f64>, window: Window) {
        let half = window.half as f64;
        // A row's padding is read too, to the right of the window.
        let padding = (window.pitch - window.side) as f64;
        let right = |k: usize| (half + padding) * warp[(k, 0)].abs() + half * warp[(k, 1)].abs();
        let (reach_x, reach_y) = (right(0), right(1));
        let first = |at: f64, slack: f64| (at - 1.0 - slack).floor() as isize;
        let last = |at: f64, slack: f64| (at + 2.0 + slack).floor() as isize;
        let (x0, x1) = (first(centre.x - reach_x, 0.0), last(centre.x + reach_x, 0.0));
        let (y0, y1) = (first(centre.y - reach_y, 0.0), last(centre.y + reach_y, 0.0));
        let held = x0 >= self.left
            && y0 >= self.top
            && x1 < self.left + self.width as isize
            && y1 < self.top + self.height as isize;
        if !held {
            (self.left, self.top) = (first(centre.x - reach_x, SLACK), first(centre.y - reach_y, SLACK));
            self.width = (last(centre.x + reach_x, SLACK) - self.left + 1) as usize;
            self.height = (last(centre.y + reach_y, SLACK) - self.top + 1) as usize;
            level.copy_window(self.left, self.top, self.width, self.height, &mut self.pixels);
        }
    }

    fn shifted_bilinear(&self, centre: &Vec2, window: Window, offset: f32, out: &mut [f32]) {
        let corner = centre.add_scalar(-(window.half as f64));
        let (x, y) = (corner.x as usize, corner.y as usize);
        let (fx, fy) = (corner.x.fract() as f32, corner.y.fract() as f32);
        let w = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
        for (j, line) in out.chunks_exact_mut(window.pitch).enumerate() {
            let at = (y + j) * self.width + x;
            let here = &self.pixels[at..=at + window.pitch];
            let below = &self.pixels[at + self.width..=at + self.width + window.pitch];
            let (a, b) = (&here[..window.pitch], &here[1..]);
            let (c, d) = (&below[..window.pitch], &below[1..]);
            for i in 0..window.pitch {
                line[i] = w[0] * a[i] + w[1] * b[i] + w[2] * c[i] + w[3] * d[i] - offset;
            }
        }
    }

    fn shifted_bicubic(&mut self, centre: &Vec2, window: Window, offset: f32, out: &mut [f32]) {
        let corner = centre.add_scalar(-(window.half as f64));
        let (x, y) = (corner.x as usize, corner.y as usize);
        let wx = weights(Interpolation::Bicubic, corner.x.fract()).map(|w| w as f32);
        let wy = weights(Interpolation::Bicubic, corner.y.fract()).map(|w| w as f32);
        let pitch = window.pitch;
        self.rows.resize((window.side + 3) * pitch, 0.0);
        for (j, line) in self.rows.chunks_exact_mut(pitch).take(window.side + 3).enumerate() {
            let source = &self.pixels[(y + j - 1) * self.width + x - 1..][..pitch + 3];
            let taps = [0, 1, 2, 3].map(|k| &source[k..k + pitch]);
            for i in 0..pitch {
                line[i] = wx[0] * taps[0][i] + wx[1] * taps[1][i] + wx[2] * taps[2][i] + wx[3] * taps[3][i];
            }
        }
        for (j, line) in out.chunks_exact_mut(pitch).enumerate() {
            let taps = [0, 1, 2, 3].map(|k| &self.rows[(j + k) * pitch..][..pitch]);
            for i in 0..pitch {
                line[i] = wy[0] * taps[0][i] + wy[1] * taps[1][i] + wy[2] * taps[2][i] + wy[3] * taps[3][i] - offset;
            }
        }
    }

    fn warped_bilinear(&self, centre: &Vec2, warp: &Matrix2<f64>, window: Window, offset: f32, out: &mut [f32]) {
        for_each_warped(centre, warp, window, out, |column, row, fx, fy| {
            let here = &self.pixels[row * self.width + column..][..self.width + 2];
            let upper = here[0] + fx * (here[1] - here[0]);
            let lower = here[self.width] + fx * (here[self.width + 1] - here[self.width]);
            upper + fy * (lower - upper) - offset
        });
    }

    fn warped_bicubic(&self, centre: &Vec2, warp: &Matrix2<f64>, window: Window, offset: f32, out: &mut [f32]) {
        for_each_warped(centre, warp, window, out, |column, row, fx, fy| {
            let (wx, wy) = (cubic(fx), cubic(fy));
            let around = &self.pixels[(row - 1) * self.width + column - 1..][..3 * self.width + 4];
            let line = |j: usize| {
                let line = &around[j * self.width..][..4];
                wy[j] * (wx[0] * line[0] + wx[1] * line[1] + wx[2] * line[2] + wx[3] * line[3])
            };
            line(0) + line(1) + line(2) + line(3) - offset
        });
    }
}

/// The bicubic weights in single precision.
fn cubic(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [-0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2.0 * t2 - 1.5 * t3, -0.5 * t2 + 0.5 * t3]
}

/// Fills a window with a function of the warped position, given as column, row and the fractions beyond them. Whole and
/// fractional parts come from fixed point numbers: much faster than rounding floating point ones.
#[inline(always)]
fn for_each_warped(
    centre: &Vec2,
    warp: &Matrix2<f64>,
    window: Window,
    out: &mut [f32],
    read: impl Fn(usize, usize, f32, f32) -> f32,
) {
    const UNIT: f64 = (1_u64 << 32) as f64;
    let fixed = |x: f64| (x * UNIT) as i64;
    let fraction = |x: i64| ((x as u32) >> 8) as f32 * (1.0 / (1 << 24) as f32);
    let half = window.half as f64;
    let (dx, dy) = (fixed(warp[(0, 0)]), fixed(warp[(1, 0)]));
    for (j, line) in out.chunks_exact_mut(window.pitch).enumerate() {
        let start = centre + warp * Vec2::new(-half, j as f64 - half);
        let (mut x, mut y) = (fixed(start.x), fixed(start.y));
        for out in &mut line[..window.side] {
            *out = read((x >> 32) as usize, (y >> 32) as usize, fraction(x), fraction(y));
            (x, y) = (x + dx, y + dy);
        }
    }
}

/// Σ a·b in eight lanes; the buffers are padded to whole lanes.
pub(super) fn dot(a: &[f32], b: &[f32]) -> f64 {
    let mut lanes = [0.0_f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for k in 0..8 {
            lanes[k] += a[k] * b[k];
        }
    }
    lanes.iter().map(|&lane| f64::from(lane)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::Pyramid;
    use image::{GrayImage, Luma};

    #[test]
    fn every_reading_agrees_with_sampling_pixel_by_pixel() {
        let picture = GrayImage::from_fn(90, 70, |x, y| Luma([((x * x + 3 * y * x + 7 * y) % 251) as u8]));
        let pyramid = Pyramid::new(&picture, 1);
        let (level, window, centre) = (pyramid.finest(), Window::new(11), Vec2::new(40.37, 30.81));
        for warp in [Matrix2::identity(), Matrix2::new(0.8, 0.2, -0.1, 1.1)] {
            for interpolation in [Interpolation::Bilinear, Interpolation::Bicubic] {
                let (mut region, mut out) = (Region::default(), Vec::new());
                region.read(level, &centre, &warp, window, interpolation, 5.0, &mut out);
                for (j, row) in out.chunks_exact(window.pitch).enumerate() {
                    for (i, &read) in row[..window.side].iter().enumerate() {
                        let at = centre + warp * Vec2::new(i as f64 - 5.0, j as f64 - 5.0);
                        let truth = level.sample(&at, interpolation).unwrap() - 5.0;
                        assert!((f64::from(read) - truth).abs() < 0.01, "{read} is not {truth}");
                    }
                }
            }
        }
    }
}
