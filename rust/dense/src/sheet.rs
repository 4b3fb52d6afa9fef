//! A picture prepared for windows: the logarithm of its grey levels, in which light is added, at a scale at which a straight line between
//! two pixels is as good as the picture.

use image::GrayImage;
use rayon::prelude::*;

/// Added to grey levels before the logarithm: below it they are mostly noise.
const DARK: f32 = 8.0;
/// Pixels per metre from which on a picture is halved: pores are finer, and compression leaves nothing of them …
const FINE: f64 = 3600.0;
/// … and below which it is doubled, by cubic interpolation.
const COARSE: f64 = 1800.0;

/// Logarithms of grey levels.
pub(crate) struct Sheet {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Its pixels per pixel of the picture. Pixel `p` of the picture is `scale p + shift`.
    pub(crate) scale: f64,
    pub(crate) shift: f64,
    pub(crate) values: Vec<f32>,
}

impl Sheet {
    /// Of a picture that shows the surface with so many pixels per metre.
    pub(crate) fn of(picture: &GrayImage, pixels_per_metre: f64) -> Self {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let table: Vec<f32> = (0..256_u16).map(|level| (f32::from(level) + DARK).ln()).collect();
        let values = picture.as_raw().iter().map(|&level| table[usize::from(level)]).collect();
        let mut sheet = Self { width, height, scale: 1.0, shift: 0.0, values };
        let mut density = pixels_per_metre;
        while density > FINE && sheet.width.min(sheet.height) > 64 {
            sheet = sheet.halved();
            density /= 2.0;
        }
        if density < COARSE { sheet.doubled() } else { sheet }
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..(y + 1) * self.width]
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut values = vec![0.0; width * height];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            let (above, below) = (self.row(2 * y), self.row(2 * y + 1));
            for (value, (a, b)) in out.iter_mut().zip(above.chunks_exact(2).zip(below.chunks_exact(2))) {
                *value = 0.25 * (a[0] + a[1] + b[0] + b[1]);
            }
        });
        Self { width, height, scale: self.scale / 2.0, shift: (self.shift - 0.5) / 2.0, values }
    }

    /// Between its pixels by Keys's cubic (a = -1/2).
    fn doubled(&self) -> Self {
        let (width, height) = (2 * self.width - 1, 2 * self.height - 1);
        let mut wide = vec![0.0; width * self.height];
        wide.par_chunks_mut(width).enumerate().for_each(|(y, out)| double_row(self.row(y), out));
        let row = |y: usize| &wide[y.min(self.height - 1) * width..][..width];
        let mut values = vec![0.0; width * height];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            let i = y / 2;
            if y % 2 == 0 {
                out.copy_from_slice(row(i));
                return;
            }
            let outer = row(i.saturating_sub(1)).iter().zip(row(i + 2));
            for (value, ((a, d), (b, c))) in out.iter_mut().zip(outer.zip(row(i).iter().zip(row(i + 1)))) {
                *value = between(*a, *b, *c, *d);
            }
        });
        Self { width, height, scale: 2.0 * self.scale, shift: 2.0 * self.shift, values }
    }
}

fn between(a: f32, b: f32, c: f32, d: f32) -> f32 {
    0.5625 * (b + c) - 0.0625 * (a + d)
}

fn double_row(row: &[f32], out: &mut [f32]) {
    let last = row.len() - 1;
    for (x, &value) in row.iter().enumerate() {
        out[2 * x] = value;
        if x < last {
            out[2 * x + 1] = between(row[x.saturating_sub(1)], value, row[x + 1], row[(x + 2).min(last)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    /// A soft wave, at a place of the picture.
    fn wave(x: f64, y: f64) -> f64 {
        120.0 + 60.0 * (0.35 * x + 0.1 * y).sin()
    }

    fn at(sheet: &Sheet, x: f64, y: f64) -> f64 {
        let [u, v] = [x, y].map(|p| (sheet.scale * p + sheet.shift).round() as usize);
        f64::from(sheet.values[v * sheet.width + u].exp() - DARK)
    }

    #[test]
    fn a_picture_doubled_or_halved_shows_the_same_at_the_same_place() {
        let picture = GrayImage::from_fn(200, 160, |x, y| Luma([wave(f64::from(x), f64::from(y)).round() as u8]));
        let (fine, same, coarse) =
            (Sheet::of(&picture, 900.0), Sheet::of(&picture, 2500.0), Sheet::of(&picture, 5000.0));
        assert_eq!((fine.width, same.width, coarse.width), (399, 200, 100));
        assert!((at(&fine, 100.5, 80.5) - wave(100.5, 80.5)).abs() < 1.5);
        assert!((at(&same, 100.0, 80.0) - wave(100.0, 80.0)).abs() < 1.0);
        assert!((at(&coarse, 100.5, 80.5) - wave(100.5, 80.5)).abs() < 2.5);
    }
}
