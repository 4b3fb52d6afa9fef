//! A drawing as PNG: every pixel the mean of what lies in it, the pixels' size in the `pHYs` chunk.

use super::{Colour, Drawing, Mark, Outline, Segment, font, scale::Weights};
use crate::DrawingError;
use geometry::Vec2;
use image::GrayImage;
use png::{BitDepth, ColorType, PixelDimensions, Unit};
use zeno::{Command, Join, Mask, Style};

/// Resolutions that make sense on paper, dots per inch.
const RESOLUTIONS: std::ops::RangeInclusive<f64> = 50.0..=600.0;

/// The file.
pub fn encode(drawing: &Drawing, dpi: f64) -> Result<Vec<u8>, DrawingError> {
    if !RESOLUTIONS.contains(&dpi) {
        return Err(DrawingError::Resolution { dpi });
    }
    // The file states whole pixels per metre: drawn with these, its size is exact.
    let per_metre = (dpi / 0.0254).round();
    let mut canvas = Canvas::new(drawing.size, per_metre / 1000.0);
    drawing.marks.iter().for_each(|mark| canvas.draw(mark));
    canvas.file(per_metre as u32)
}

struct Canvas {
    width: usize,
    height: usize,
    /// Pixels per millimetre.
    scale: f64,
    /// Red, green, blue.
    pixels: Vec<u8>,
    /// Coverage of the shape being drawn.
    mask: Vec<u8>,
}

impl Canvas {
    fn new(size: Vec2, scale: f64) -> Self {
        // Half a thousandth of a pixel more is rounding, not paper.
        let pixels = |mm: f64| (mm * scale - 5e-4).ceil() as usize;
        let (width, height) = (pixels(size.x), pixels(size.y));
        Self { width, height, scale, pixels: vec![255; 3 * width * height], mask: Vec::new() }
    }

    fn draw(&mut self, mark: &Mark) {
        match mark {
            Mark::Shape { outline, fill, stroke } => {
                let segments = outline.segments();
                match (fill, outline) {
                    (Some(fill), Outline::Rectangle { from, size }) => self.rectangle(from, size, *fill),
                    (Some(fill), _) => self.paint(&segments, None, *fill),
                    (None, _) => {}
                }
                if let Some(stroke) = stroke {
                    self.paint(&segments, Some(stroke.width), stroke.colour);
                }
            }
            Mark::Text(text) => {
                let glyphs = font::outlines(text);
                if text.rim > 0.0 {
                    self.paint(&glyphs, Some(2.0 * text.rim), Colour::WHITE);
                }
                self.paint(&glyphs, None, text.colour);
            }
            Mark::Picture { pixels, from, size } => self.picture(pixels, from, size),
        }
    }

    /// Lays a colour over what a path covers: its inside, or a line along it of a width in mm.
    fn paint(&mut self, segments: &[Segment], line: Option<f64>, colour: Colour) {
        let margin = line.map_or(1.0, |width| width * self.scale + 1.0);
        let Some((left, top, width, height)) = self.extent(segments, margin) else { return };
        let corner = Vec2::new(left as f64, top as f64);
        let place = |p: &Vec2| {
            let p = p * self.scale - corner;
            zeno::Point::new(p.x as f32, p.y as f32)
        };
        let path: Vec<Command> = segments.iter().map(|s| command(s, place)).collect();
        self.mask.clear();
        self.mask.resize(width * height, 0);
        let style = match line {
            Some(width) => {
                let width = (width * self.scale) as f32;
                Style::Stroke(zeno::Stroke { width, join: Join::Round, ..zeno::Stroke::default() })
            }
            None => Style::Fill(zeno::Fill::NonZero),
        };
        Mask::new(&path).size(width as u32, height as u32).style(style).render_into(&mut self.mask, None);
        for (row, covered) in self.mask.chunks_exact(width).enumerate() {
            let begin = 3 * ((top + row) * self.width + left);
            let pixels = self.pixels[begin..begin + 3 * width].chunks_exact_mut(3);
            let covered = pixels.zip(covered).filter(|(_, covered)| **covered > 0);
            covered.for_each(|(pixel, covered)| blend(pixel, colour, f64::from(*covered) / 255.0));
        }
    }

    /// Fills a rectangle, whose pixels' covered parts are exact: a path's are to a hundredth.
    fn rectangle(&mut self, from: &Vec2, size: &Vec2, colour: Colour) {
        let (low, high) = (from * self.scale, (from + size) * self.scale);
        for (y, rows) in covered(low.y, high.y, self.height) {
            for (x, columns) in covered(low.x, high.x, self.width) {
                let begin = 3 * (y * self.width + x);
                blend(&mut self.pixels[begin..begin + 3], colour, rows * columns);
            }
        }
    }

    /// Draws a picture, each pixel the mean of what lies in it where the picture is finer, else smooth between the picture's.
    fn picture(&mut self, picture: &GrayImage, from: &Vec2, size: &Vec2) {
        let (low, high) = (from * self.scale, (from + size) * self.scale);
        let columns: Vec<(usize, f64, Weights)> = covered(low.x, high.x, self.width)
            .map(|(x, part)| (x, part, Weights::new(x as f64, (low.x, high.x), picture.width() as usize)))
            .collect();
        for (y, part) in covered(low.y, high.y, self.height) {
            let rows = Weights::new(y as f64, (low.y, high.y), picture.height() as usize);
            // The rows' mean first: all the pixels of this row need it.
            let level = |u: usize| rows.mean(|v| f64::from(picture.get_pixel(u as u32, v as u32).0[0]));
            let means: Vec<f64> = (0..picture.width() as usize).map(level).collect();
            for (x, column, weights) in &columns {
                let grey = weights.mean(|u| means[u]).round().clamp(0.0, 255.0) as u8;
                let begin = 3 * (y * self.width + x);
                blend(&mut self.pixels[begin..begin + 3], Colour::grey(grey), part * column);
            }
        }
    }

    /// Left, top, width and height of the pixels that a path can cover; `None` beside the page.
    fn extent(&self, segments: &[Segment], margin: f64) -> Option<(usize, usize, usize, usize)> {
        let far = Vec2::from_element(f64::INFINITY);
        let (low, high) = segments.iter().fold((far, -far), |(low, high), segment| {
            let of = |low: Vec2, high: Vec2, p: &Vec2| (low.inf(p), high.sup(p));
            match segment {
                Segment::Move(p) | Segment::Line(p) => of(low, high, p),
                Segment::Cubic(a, b, p) => [a, b, p].into_iter().fold((low, high), |(l, h), p| of(l, h, p)),
                Segment::Close => (low, high),
            }
        });
        let (low, high) = (low * self.scale, high * self.scale);
        let from = |v: f64, end: usize| (v - margin).floor().clamp(0.0, end as f64) as usize;
        let to = |v: f64, end: usize| (v + margin).ceil().clamp(0.0, end as f64) as usize;
        let (left, right) = (from(low.x, self.width), to(high.x, self.width));
        let (top, bottom) = (from(low.y, self.height), to(high.y, self.height));
        (right > left && bottom > top).then(|| (left, top, right - left, bottom - top))
    }

    fn file(&self, per_metre: u32) -> Result<Vec<u8>, DrawingError> {
        let size = (self.width as u32, self.height as u32);
        if self.pixels.chunks_exact(3).all(|p| p[0] == p[1] && p[1] == p[2]) {
            let grey: Vec<u8> = self.pixels.iter().step_by(3).copied().collect();
            write(size, ColorType::Grayscale, Some(per_metre), &grey)
        } else {
            write(size, ColorType::Rgb, Some(per_metre), &self.pixels)
        }
    }
}

/// A picture as a PNG of its own.
pub fn picture(pixels: &GrayImage) -> Result<Vec<u8>, DrawingError> {
    write(pixels.dimensions(), ColorType::Grayscale, None, pixels)
}

fn write(
    (width, height): (u32, u32),
    colour: ColorType,
    per_metre: Option<u32>,
    pixels: &[u8],
) -> Result<Vec<u8>, DrawingError> {
    let failed = |e: png::EncodingError| DrawingError::Encoding { reason: e.to_string() };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_color(colour);
    encoder.set_pixel_dims(per_metre.map(|n| PixelDimensions { xppu: n, yppu: n, unit: Unit::Meter }));
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// The pixels below `end` that a range covers, and how much of each.
fn covered(low: f64, high: f64, end: usize) -> impl Iterator<Item = (usize, f64)> {
    let first = low.floor().clamp(0.0, end as f64) as usize;
    let last = high.ceil().clamp(0.0, end as f64) as usize;
    (first..last).map(move |i| (i, (high.min(i as f64 + 1.0) - low.max(i as f64)).max(0.0)))
}

fn command(segment: &Segment, place: impl Fn(&Vec2) -> zeno::Point) -> Command {
    match segment {
        Segment::Move(p) => Command::MoveTo(place(p)),
        Segment::Line(p) => Command::LineTo(place(p)),
        Segment::Cubic(a, b, p) => Command::CurveTo(place(a), place(b), place(p)),
        Segment::Close => Command::Close,
    }
}

/// Lays a colour over a part of a pixel.
fn blend(pixel: &mut [u8], colour: Colour, covered: f64) {
    let part = colour.opacity * covered;
    for (channel, new) in pixel.iter_mut().zip(colour.rgb) {
        let old = f64::from(*channel);
        *channel = (old + (f64::from(new) - old) * part).round() as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(drawing: &Drawing, scale: f64) -> Canvas {
        let mut canvas = Canvas::new(drawing.size, scale);
        drawing.marks.iter().for_each(|mark| canvas.draw(mark));
        canvas
    }

    /// The pixel of a canvas, red.
    fn at(canvas: &Canvas, x: usize, y: usize) -> f64 {
        f64::from(canvas.pixels[3 * (y * canvas.width + x)])
    }

    #[test]
    fn an_edge_within_a_pixel_is_as_grey_as_it_covers() {
        for k in 0..40 {
            let (left, top) = (2.0 + 0.37 * f64::from(k), 5.0 + 0.213 * f64::from(k));
            let (width, height) = (300.0 + 0.119 * f64::from(k), 200.0 + 0.291 * f64::from(k));
            let mut drawing = Drawing::new(Vec2::new(400.0, 300.0));
            drawing.rectangle(Vec2::new(left, top), Vec2::new(width, height), Colour::BLACK);
            let canvas = pixels(&drawing, 1.0);
            let inside = |from: f64, length: f64, i: usize| {
                let (low, high) = (from.max(i as f64), (from + length).min(i as f64 + 1.0));
                (high - low).max(0.0)
            };
            for y in [0, top as usize, 100, (top + height) as usize] {
                for x in [0, left as usize, left as usize + 1, 200, (left + width) as usize] {
                    let expected = 255.0 * (1.0 - inside(left, width, x) * inside(top, height, y));
                    let got = at(&canvas, x, y);
                    assert!((got - expected).abs() <= 0.5, "at {x},{y}: {got} instead of {expected}");
                }
            }
        }
    }

    #[test]
    fn a_disc_covers_its_area() {
        let mut drawing = Drawing::new(Vec2::new(40.0, 40.0));
        drawing.disc(Vec2::new(20.3, 19.8), 7.2, Colour::BLACK);
        let canvas = pixels(&drawing, 2.0);
        let black: f64 = canvas.pixels.iter().step_by(3).map(|p| 1.0 - f64::from(*p) / 255.0).sum::<f64>() / 4.0;
        assert!((black / (std::f64::consts::PI * 7.2 * 7.2) - 1.0).abs() < 0.01, "{black}");
    }

    #[test]
    fn what_lies_beside_the_page_is_left_out() {
        let mut drawing = Drawing::new(Vec2::new(20.0, 10.0));
        drawing.rectangle(Vec2::new(-5.0, -5.0), Vec2::new(10.0, 40.0), Colour::BLACK);
        drawing.disc(Vec2::new(300.0, 300.0), 3.0, Colour::BLACK);
        let canvas = pixels(&drawing, 1.0);
        assert_eq!((at(&canvas, 4, 9), at(&canvas, 5, 9)), (0.0, 255.0));
    }

    #[test]
    fn impossible_resolutions_are_refused() {
        for dpi in [0.0, 1e6, f64::NAN] {
            assert!(encode(&Drawing::new(Vec2::new(20.0, 10.0)), dpi).is_err());
        }
    }

    #[test]
    fn a_picture_keeps_its_size_place_and_brightness_at_any_scale() {
        let picture = GrayImage::from_fn(24, 16, |x, y| image::Luma([(40 + 7 * x + 3 * y) as u8]));
        for scale in [0.2, 0.7, 1.0, 3.3] {
            let mut drawing = Drawing::new(Vec2::new(40.0, 30.0));
            drawing.picture(picture.clone(), Vec2::new(5.0, 4.0), Vec2::new(24.0, 16.0));
            let canvas = pixels(&drawing, scale);
            let missing = |p: &u8| 255.0 - f64::from(*p);
            let sum: f64 = canvas.pixels.iter().step_by(3).map(missing).sum::<f64>() / (scale * scale);
            let expected: f64 = picture.iter().map(missing).sum();
            assert!((sum / expected - 1.0).abs() < 0.01, "{scale}: {sum} instead of {expected}");
            // A ramp stays the ramp in the picture's middle.
            let (x, y) = ((17.0 * scale) as usize, (12.0 * scale) as usize);
            let (u, v) = ((x as f64 + 0.5) / scale - 5.5, (y as f64 + 0.5) / scale - 4.5);
            let level = 40.0 + 7.0 * u + 3.0 * v;
            assert!((at(&canvas, x, y) - level).abs() < 1.0, "{scale}: {} instead of {level}", at(&canvas, x, y));
        }
    }

    #[test]
    fn at_its_own_scale_a_picture_is_copied() {
        let picture = GrayImage::from_fn(9, 7, |x, y| image::Luma([(x * 61 + y * 97) as u8]));
        let mut drawing = Drawing::new(Vec2::new(9.0, 7.0));
        drawing.picture(picture.clone(), Vec2::zeros(), Vec2::new(9.0, 7.0));
        let canvas = pixels(&drawing, 1.0);
        assert!(picture.iter().copied().eq(canvas.pixels.iter().step_by(3).copied()));
    }
}
