//! Square, possibly turned parts of a picture, resampled for the nets.
//!
//! # Entry points
//! [`Region`], [`crop`], [`mirrored`].
//!
//! # Conventions
//! A region's own coordinates run from 0 to 1 between its edges, so the centre of pixel `i` of an `n` pixel crop lies at
//! `(i + ½) / n`. Where a crop is coarser than the picture, picture pixels are first averaged in square blocks and the
//! rest of the reduction is averaged over 2 × 2 bilinear samples, so nothing aliases.

use geometry::Vec2;
use image::RgbImage;

/// A square part of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Its centre, pixels.
    pub centre: Vec2,
    /// Length of an edge, pixels.
    pub side: f64,
    /// Turn of its x axis from the picture's x axis towards its y axis, radians.
    pub angle: f64,
}

impl Region {
    /// The smallest upright square around a whole picture.
    pub fn whole(image: &RgbImage) -> Self {
        let (width, height) = (f64::from(image.width()), f64::from(image.height()));
        Self { centre: Vec2::new(width - 1.0, height - 1.0) / 2.0, side: width.max(height), angle: 0.0 }
    }

    /// Directions of the region's axes in the picture.
    pub fn axes(&self) -> [Vec2; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [Vec2::new(cos, sin), Vec2::new(-sin, cos)]
    }

    /// Whether another region is about the same.
    pub fn is_near(&self, other: &Self, limits: Nearness) -> bool {
        let turn = (self.angle - other.angle).sin().atan2((self.angle - other.angle).cos());
        (self.centre - other.centre).norm() < limits.shift * other.side
            && (self.side / other.side).max(other.side / self.side) < limits.growth
            && turn.abs() < limits.turn
    }

    /// The picture's point of a point in the region's own coordinates.
    pub fn point(&self, unit: &Vec2) -> Vec2 {
        let [x, y] = self.axes();
        self.centre + (x * (unit.x - 0.5) + y * (unit.y - 0.5)) * self.side
    }

    /// The point in the region's own coordinates of a picture's point.
    pub fn unit(&self, pixel: &Vec2) -> Vec2 {
        let from_centre = (pixel - self.centre) / self.side;
        let [x, y] = self.axes();
        Vec2::new(x.dot(&from_centre) + 0.5, y.dot(&from_centre) + 0.5)
    }
}

/// How much two regions may differ.
#[derive(Clone, Copy, Debug)]
pub struct Nearness {
    /// Distance of the centres, in edges.
    pub shift: f64,
    /// How many times larger the larger one is.
    pub growth: f64,
    /// Angle between them, radians.
    pub turn: f64,
}

/// What lies beyond the picture's border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// Black.
    Black,
    /// The nearest pixel.
    Nearest,
}

/// How crop values are scaled for a net.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Value of black.
    pub black: f32,
    /// Value of white.
    pub white: f32,
}

/// A picture block-averaged by a whole factor, as far as a region needs it.
struct Reduced {
    pixels: Vec<[f32; 3]>,
    width: usize,
    height: usize,
    /// Picture pixel at the corner of the first block.
    origin: [i64; 2],
    /// Picture pixels along a block's edge.
    block: i64,
}

impl Reduced {
    /// The part of `image` around `region`, in blocks of `block` × `block`.
    fn new(image: &RgbImage, region: &Region, block: i64, border: Border) -> Self {
        let [x, y] = region.axes();
        let reach = |axis: usize| (x[axis].abs() + y[axis].abs()) * region.side / 2.0 + block as f64 + 1.0;
        let first = [0, 1].map(|axis| (region.centre[axis] - reach(axis)).floor() as i64);
        let count = [0, 1].map(|axis| ((2.0 * reach(axis)) / block as f64).ceil() as usize + 2);
        let columns = Span::all(first[0], count[0], block, i64::from(image.width()), border);
        let rows = Span::all(first[1], count[1], block, i64::from(image.height()), border);
        let mut pixels = Vec::with_capacity(count[0] * count[1]);
        for row in &rows {
            pixels.extend(columns.iter().map(|column| average(image, column, row)));
        }
        Self { pixels, width: count[0], height: count[1], origin: first, block }
    }

    /// The bilinear value at a picture point, which must lie inside the region.
    fn sample(&self, at: &Vec2) -> [f32; 3] {
        let half_block = (self.block - 1) as f64 / 2.0;
        let place = |axis: usize, size: usize| {
            let position = (at[axis] - self.origin[axis] as f64 - half_block) / self.block as f64;
            let whole = position.floor().clamp(0.0, (size - 2) as f64);
            (whole as usize, (position - whole) as f32)
        };
        let ((column, right), (row, below)) = (place(0, self.width), place(1, self.height));
        let top = row * self.width + column;
        let bottom = top + self.width;
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        std::array::from_fn(|c| {
            let above = mix(self.pixels[top][c], self.pixels[top + 1][c], right);
            mix(above, mix(self.pixels[bottom][c], self.pixels[bottom + 1][c], right), below)
        })
    }
}

/// The pixels of one row or column of blocks: those inside the picture, and how much of the block they are.
struct Span {
    start: u32,
    end: u32,
    weight: f32,
}

impl Span {
    fn all(first: i64, count: usize, block: i64, size: i64, border: Border) -> Vec<Self> {
        (0..count as i64).map(|k| Self::new(first + k * block, block, size, border)).collect()
    }

    fn new(start: i64, block: i64, size: i64, border: Border) -> Self {
        let (inside, end) = (start.clamp(0, size), (start + block).clamp(0, size));
        if inside < end {
            let share = if border == Border::Black { block } else { end - inside };
            return Self { start: inside as u32, end: end as u32, weight: 1.0 / share as f32 };
        }
        let edge = start.clamp(0, size - 1) as u32;
        Self { start: edge, end: edge + 1, weight: if border == Border::Black { 0.0 } else { 1.0 } }
    }
}

/// The weighted mean of a block.
fn average(image: &RgbImage, columns: &Span, rows: &Span) -> [f32; 3] {
    let weight = columns.weight * rows.weight;
    if weight == 0.0 {
        return [0.0; 3];
    }
    let width = image.width() as usize;
    let mut sum = [0u32; 3];
    for row in rows.start as usize..rows.end as usize {
        let line = 3 * (row * width + columns.start as usize)..3 * (row * width + columns.end as usize);
        for pixel in image.as_raw()[line].chunks_exact(3) {
            for (total, &value) in sum.iter_mut().zip(pixel) {
                *total += u32::from(value);
            }
        }
    }
    sum.map(|total| total as f32 * weight)
}

/// The part of `image` inside `region` as `size` × `size` pixels: planes red, green, blue, each row by row.
pub fn crop(image: &RgbImage, region: &Region, size: usize, border: Border, range: Range) -> Vec<f32> {
    let step = region.side / size as f64;
    let block = (step.floor() as i64).max(1);
    let reduced = Reduced::new(image, region, block, border);
    // One sample when enlarging; 2 × 2 over the crop pixel when the blocks are still finer than it.
    let offsets: &[f64] = if step > block as f64 { &[-0.25, 0.25] } else { &[0.0] };
    let scale = (range.white - range.black) / 255.0 / (offsets.len() * offsets.len()) as f32;
    let [x, y] = region.axes().map(|axis| axis * step);
    let middle = (size as f64 - 1.0) / 2.0;
    let mut planes = vec![range.black; 3 * size * size];
    for row in 0..size {
        for column in 0..size {
            let centre = region.centre + x * (column as f64 - middle) + y * (row as f64 - middle);
            let mut sum = [0.0; 3];
            for down in offsets {
                for across in offsets {
                    let value = reduced.sample(&(centre + x * *across + y * *down));
                    (0..3).for_each(|c| sum[c] += value[c]);
                }
            }
            (0..3).for_each(|c| planes[(c * size + row) * size + column] += sum[c] * scale);
        }
    }
    planes
}

/// A crop seen in a mirror: every row reversed.
pub fn mirrored(planes: &[f32], size: usize) -> Vec<f32> {
    planes.chunks_exact(size).flat_map(|row| row.iter().rev().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    const PLAIN: Range = Range { black: 0.0, white: 255.0 };

    /// A picture whose red is its column and green its row, times `slope`.
    fn ramp(width: u32, height: u32, slope: f64) -> RgbImage {
        let value = |n: u32| (f64::from(n) * slope).round() as u8;
        RgbImage::from_fn(width, height, |x, y| Rgb([value(x), value(y), 200]))
    }

    #[test]
    fn crop_pixels_have_the_values_of_the_points_they_stand_for() {
        let image = ramp(250, 250, 1.0);
        for (side, size, angle) in [(64.0, 64, 0.0), (60.0, 96, 0.3), (100.0, 64, -0.7), (130.0, 32, 1.2)] {
            let region = Region { centre: Vec2::new(121.3, 118.9), side, angle };
            let planes = crop(&image, &region, size, Border::Black, PLAIN);
            for (column, row) in [(0, 0), (size - 1, 0), (size / 2, size - 1), (3, size / 3)] {
                let unit = Vec2::new(column as f64 + 0.5, row as f64 + 0.5) / size as f64;
                let expected = region.point(&unit);
                let at = row * size + column;
                let found = Vec2::new(f64::from(planes[at]), f64::from(planes[size * size + at]));
                assert!((found - expected).norm() < 1e-2, "{side} {size} {angle}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_point_has_one_place_in_a_region() {
        let region = Region { centre: Vec2::new(12.0, -7.0), side: 33.0, angle: 0.7 };
        let unit = Vec2::new(0.2, 1.3);
        assert!((region.unit(&region.point(&unit)) - unit).norm() < 1e-12);
    }

    #[test]
    fn fine_stripes_become_grey_instead_of_aliasing() {
        let image = RgbImage::from_fn(1920, 1080, |x, y| Rgb([255 * ((x + y) % 2) as u8; 3]));
        let region = Region { centre: Vec2::new(900.0, 500.0), side: 811.0, angle: 0.4 };
        let planes = crop(&image, &region, 192, Border::Nearest, PLAIN);
        assert!(planes.iter().all(|v| (v - 127.5).abs() < 16.0));
    }

    #[test]
    fn beyond_the_border_is_what_was_asked_for() {
        let image = RgbImage::from_pixel(30, 20, Rgb([90, 90, 90]));
        let region = Region { centre: Vec2::new(-40.0, -50.0), side: 50.0, angle: 0.0 };
        assert!(crop(&image, &region, 8, Border::Black, PLAIN).iter().all(|&v| v == 0.0));
        assert!(crop(&image, &region, 8, Border::Nearest, PLAIN).iter().all(|&v| (v - 90.0).abs() < 1e-3));
    }

    #[test]
    fn a_letterboxed_picture_is_black_above_and_below() {
        let image = RgbImage::from_pixel(400, 200, Rgb([255, 255, 255]));
        let range = Range { black: -1.0, white: 1.0 };
        let planes = crop(&image, &Region::whole(&image), 100, Border::Black, range);
        let row = |r: usize| planes[r * 100 + 50];
        assert_eq!((row(0), row(99)), (-1.0, -1.0));
        assert!((row(27) - 1.0).abs() < 1e-5 && (row(72) - 1.0).abs() < 1e-5 && row(23) < -0.99 && row(76) < -0.99);
    }

    #[test]
    fn mirroring_twice_changes_nothing() {
        let planes: Vec<f32> = (0..48).map(|v| v as f32).collect();
        assert_eq!(mirrored(&mirrored(&planes, 4), 4), planes);
        assert_eq!(mirrored(&planes, 4)[..4], [3.0, 2.0, 1.0, 0.0]);
    }
}
