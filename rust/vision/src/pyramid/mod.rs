//! Image pyramids: what corners and tracks are computed on.
//!
//! # Entry points
//! [`Pyramid::new`], or [`Pyramid::sharing`] without a copy of the picture, once per frame; [`Pyramid::levels`];
//! [`Level::sample`].
//!
//! # Conventions
//! Level 0 is the picture; each further level is half as wide and high, smoothed with the binomial `[1 4 6 4 1] / 16`
//! along both axes and taken at every second pixel, so that a position in level `l` is the position in the picture
//! divided by `2^l` (pixel centres at integers). Outside the frame the nearest pixel is repeated. Level 0 holds the
//! picture's bytes, the others 1/256 grey level as `u16`: level 1 is exact, the others lose nothing that matters, and a
//! frame needs 0.7 bytes per pixel beside the picture. Gradients are not kept: those who need them take them from the
//! window they have at hand.
//!
//! # Source
//! Burt and Adelson, "The Laplacian pyramid as a compact image code", 1983; the paper, section 2.3.

mod halve;
mod window;

use geometry::Vec2;
use halve::Halve;
use image::GrayImage;
use std::sync::Arc;
use window::CopyWindow;
pub(crate) use window::Stored;

/// Stored units per grey level in all levels but the finest.
const UNITS_PER_GREY: f32 = 256.0;
/// Units per grey level of windows read as words: differences of differences fit into sixteen bits.
pub(crate) const WORDS_PER_GREY: i16 = 64;
/// Stored units of the coarser levels per unit of words.
pub(crate) const FINE_PER_WORD: u16 = UNITS_PER_GREY as u16 / WORDS_PER_GREY as u16;
/// A level whose shorter side would fall below this is not built.
const SMALLEST_SIDE: usize = 12;

/// How a picture is read between its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// From 2×2 pixels; fast, blurs a little.
    #[default]
    Bilinear,
    /// Cubic convolution from 4×4 pixels (Keys 1981, a = −1/2): exact for quadratic pictures.
    Bicubic,
}

/// One picture of a pyramid.
#[derive(Clone, Debug)]
pub struct Level {
    width: usize,
    height: usize,
    pixels: Pixels,
}

/// Row by row.
#[derive(Clone, Debug)]
enum Pixels {
    /// The picture itself, grey levels.
    Picture(Arc<GrayImage>),
    /// Units of [`UNITS_PER_GREY`].
    Fine(Vec<u16>),
}

/// Pixels as they are stored, from one of them on, row by row.
pub(crate) enum View<'p> {
    /// Of the picture itself.
    Picture(&'p [u8]),
    /// Of a coarser level.
    Fine(&'p [u16]),
}

/// A picture at full, half, quarter … size. Immutable, so it may be shared between threads.
#[derive(Clone, Debug)]
pub struct Pyramid {
    picture: Arc<GrayImage>,
    levels: Vec<Level>,
}

impl Pyramid {
    /// Builds at most `levels` levels (at least one); stops early at a picture of about a dozen pixels.
    pub fn new(picture: &GrayImage, levels: usize) -> Self {
        Self::sharing(Arc::new(picture.clone()), levels)
    }

    /// The same, with the picture as level 0 instead of a copy of it.
    pub fn sharing(picture: Arc<GrayImage>, levels: usize) -> Self {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let mut finest = Level { width, height, pixels: Pixels::Picture(picture.clone()) };
        let mut built = Vec::with_capacity(levels.max(1));
        for _ in 1..levels {
            if finest.width.min(finest.height).div_ceil(2) < SMALLEST_SIDE {
                break;
            }
            let coarser = finest.halved();
            built.push(std::mem::replace(&mut finest, coarser));
        }
        built.push(finest);
        Self { picture, levels: built }
    }

    /// The levels, the picture itself first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The picture as a level.
    pub fn finest(&self) -> &Level {
        &self.levels[0]
    }

    /// The smallest level.
    pub fn coarsest(&self) -> &Level {
        &self.levels[self.levels.len() - 1]
    }

    /// The picture itself.
    pub fn picture(&self) -> &GrayImage {
        &self.picture
    }
}

impl Level {
    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Rounded to whole grey levels.
    pub fn picture(&self) -> GrayImage {
        let grey = |x: u32, y: u32| image::Luma([self.grey(x as usize, y as usize).round() as u8]);
        GrayImage::from_fn(self.width as u32, self.height as u32, grey)
    }

    /// Whether a position is at least `margin` pixels inside the outermost pixel centres; never true of NaN.
    pub fn contains(&self, at: &Vec2, margin: f64) -> bool {
        let inside = |x: f64, size: usize| x >= margin && x <= size as f64 - 1.0 - margin;
        inside(at.x, self.width) && inside(at.y, self.height)
    }

    /// Grey level of a pixel.
    fn grey(&self, x: usize, y: usize) -> f32 {
        let at = y * self.width + x;
        match &self.pixels {
            Pixels::Picture(picture) => picture.as_raw()[at].read(),
            Pixels::Fine(pixels) => pixels[at].read(),
        }
    }

    /// Grey level at a position between pixels; `None` outside the frame.
    pub fn sample(&self, at: &Vec2, interpolation: Interpolation) -> Option<f64> {
        if !self.contains(at, 0.0) {
            return None;
        }
        let (x, y) = (at.x.floor(), at.y.floor());
        let (wx, wy) = (weights(interpolation, at.x - x), weights(interpolation, at.y - y));
        let mut sum = 0.0;
        for (j, wy) in wy.iter().enumerate() {
            let y = clamped(y as isize + j as isize - 1, self.height);
            for (i, wx) in wx.iter().enumerate() {
                let x = clamped(x as isize + i as isize - 1, self.width);
                sum += wx * wy * f64::from(self.grey(x, y));
            }
        }
        Some(sum)
    }

    /// The pixels from `(left, top)` on, if `width × height` of them are within the frame.
    #[inline]
    pub(crate) fn view(&self, left: isize, top: isize, width: usize, height: usize) -> Option<View<'_>> {
        let within = |first: isize, count: usize, size: usize| first >= 0 && first as usize + count <= size;
        if !(within(left, width, self.width) && within(top, height, self.height)) {
            return None;
        }
        let first = top as usize * self.width + left as usize;
        Some(match &self.pixels {
            Pixels::Picture(picture) => View::Picture(&picture.as_raw()[first..]),
            Pixels::Fine(pixels) => View::Fine(&pixels[first..]),
        })
    }

    /// Copies the `width × height` pixels from `(left, top)` on, row by row, in grey levels or as words; pixels outside
    /// the frame repeat the nearest one inside.
    pub(crate) fn copy_window<O>(&self, left: isize, top: isize, width: usize, height: usize, out: &mut Vec<O>)
    where
        O: Copy + Default,
        u8: Stored<O>,
        u16: Stored<O>,
    {
        out.resize(width * height, O::default());
        let (size, out) = ((self.width, self.height), &mut out[..]);
        let arch = pulp::Arch::new();
        match &self.pixels {
            Pixels::Picture(picture) => {
                arch.dispatch(CopyWindow { pixels: picture.as_raw(), size, left, top, width, height, out });
            }
            Pixels::Fine(pixels) => arch.dispatch(CopyWindow { pixels, size, left, top, width, height, out }),
        }
    }

    /// The next coarser level.
    fn halved(&self) -> Self {
        let (width, arch) = (self.width, pulp::Arch::new());
        let pixels = match &self.pixels {
            Pixels::Picture(picture) => {
                arch.dispatch(Halve { pixels: &picture.as_raw()[..width * self.height], width })
            }
            Pixels::Fine(pixels) => arch.dispatch(Halve { pixels, width }),
        };
        Self { width: width.div_ceil(2), height: self.height.div_ceil(2), pixels: Pixels::Fine(pixels) }
    }
}

/// The index of the nearest pixel inside the frame.
fn clamped(index: isize, size: usize) -> usize {
    index.clamp(0, size as isize - 1) as usize
}

/// Weights of the pixels −1, 0, 1 and 2 beside a position `t` of the way from pixel 0 to pixel 1.
pub(crate) fn weights(interpolation: Interpolation, t: f64) -> [f64; 4] {
    match interpolation {
        Interpolation::Bilinear => [0.0, 1.0 - t, t, 0.0],
        Interpolation::Bicubic => {
            let (t2, t3) = (t * t, t * t * t);
            [-0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2.0 * t2 - 1.5 * t3, -0.5 * t2 + 0.5 * t3]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    fn ramp(width: u32, height: u32) -> GrayImage {
        GrayImage::from_fn(width, height, |x, y| Luma([(x + 2 * y) as u8]))
    }

    #[test]
    fn a_ramp_keeps_its_values_at_every_level() {
        let pyramid = Pyramid::new(&ramp(81, 60), 3);
        for (l, level) in pyramid.levels().iter().enumerate() {
            let (at, scale) = (Vec2::new(6.25, 5.5), f64::from(1 << l));
            for interpolation in [Interpolation::Bilinear, Interpolation::Bicubic] {
                let grey = level.sample(&at, interpolation).unwrap();
                assert!((grey - scale * (at.x + 2.0 * at.y)).abs() < 0.01, "level {l}: {grey}");
            }
        }
        assert_eq!(pyramid.levels()[1].width(), 41);
        assert_eq!(pyramid.levels()[2].height(), 15);
    }

    #[test]
    fn a_shared_picture_is_level_zero_itself() {
        let picture = Arc::new(ramp(50, 40));
        let shared = Pyramid::sharing(picture.clone(), 2);
        assert!(std::ptr::eq(shared.picture(), &*picture));
        let copied = Pyramid::new(&picture, 2);
        let windows = [&shared, &copied].map(|pyramid| {
            let mut window = Vec::<f32>::new();
            pyramid.levels()[1].copy_window(-3, -3, 30, 30, &mut window);
            window
        });
        assert_eq!(windows[0], windows[1]);
    }

    #[test]
    fn bicubic_is_exact_for_a_parabola() {
        let picture = GrayImage::from_fn(16, 16, |x, _| Luma([(x * x) as u8]));
        let pyramid = Pyramid::new(&picture, 1);
        let grey = pyramid.finest().sample(&Vec2::new(7.3, 4.0), Interpolation::Bicubic).unwrap();
        assert!((grey - 7.3 * 7.3).abs() < 1e-9);
    }

    #[test]
    fn no_level_is_smaller_than_a_dozen_pixels() {
        assert_eq!(Pyramid::new(&ramp(352, 288), 20).levels().len(), 5);
        assert_eq!(Pyramid::new(&ramp(3, 2), 4).levels().len(), 1);
    }

    #[test]
    fn outside_the_frame_there_is_no_grey_level() {
        let pyramid = Pyramid::new(&ramp(20, 20), 1);
        for at in [Vec2::new(-0.1, 3.0), Vec2::new(3.0, 19.1), Vec2::new(f64::NAN, 3.0)] {
            assert!(pyramid.finest().sample(&at, Interpolation::Bilinear).is_none());
        }
        assert!(pyramid.finest().sample(&Vec2::new(19.0, 19.0), Interpolation::Bicubic).is_some());
    }

    #[test]
    fn a_window_over_the_edge_repeats_the_edge() {
        let mut window = Vec::<f32>::new();
        Pyramid::new(&ramp(20, 20), 1).finest().copy_window(-2, 0, 4, 1, &mut window);
        assert_eq!(window, [0.0, 0.0, 0.0, 1.0]);
    }
}
