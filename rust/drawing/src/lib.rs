//! Drawings in millimetres, and the kinds of file they are written as.
//!
//! # Entry points
//! - [`Drawing`]: marks on a white page, later ones over earlier ones.
//! - [`Format`]: SVG, PDF or PNG, by a file's extension; [`Drawing::encode`] makes the file's bytes.
//!
//! Nothing is written here: files are their caller's.
//!
//! # Conventions
//! x right, y down, origin in the page's top left corner. All three kinds have exactly the drawing's size. SVG keeps text as
//! text; PDF and PNG hold its outlines in Noto Sans, which is part of the program, and need no font of the machine. Pictures are
//! part of the file, with all their pixels in SVG and PDF.
#![forbid(unsafe_code)]

mod error;
mod font;
pub mod labels;
mod pdf;
mod png;
mod scale;
pub mod style;
mod svg;

use geometry::Vec2;
use image::GrayImage;
use std::path::Path;

pub use error::DrawingError;
pub use font::{text_width, wrap};

/// Resolution of pictures as PNG, dots per inch.
pub const DPI: f64 = 300.0;

/// A colour that may let through what is below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// sRGB.
    pub rgb: [u8; 3],
    /// 1 hides all below.
    pub opacity: f64,
}

impl Colour {
    /// Black.
    pub const BLACK: Self = Self::grey(0);
    /// White.
    pub const WHITE: Self = Self::grey(255);

    /// A grey, 0 black to 255 white.
    pub const fn grey(level: u8) -> Self {
        Self { rgb: [level; 3], opacity: 1.0 }
    }

    /// The same, with another opacity.
    pub const fn with_opacity(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }
}

/// How a line is drawn; its ends are cut off square, its corners round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub colour: Colour,
    /// Width, mm.
    pub width: f64,
}

/// The outline of a shape, mm.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// A rectangle along the axes.
    Rectangle {
        /// Top left corner.
        from: Vec2,
        /// Width and height.
        size: Vec2,
    },
    /// A circle.
    Circle {
        /// Its middle.
        centre: Vec2,
        /// Its radius.
        radius: f64,
    },
    /// Straight lines from point to point.
    Lines {
        /// The points.
        points: Vec<Vec2>,
        /// Whether the last is joined to the first.
        closed: bool,
    },
}

/// Where a text lies about its point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// The point is where it begins.
    #[default]
    Start,
    /// The point is its middle.
    Middle,
    /// The point is where it ends.
    End,
}

/// A line of text.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// What it says.
    pub content: String,
    /// A point of its base line, mm.
    pub at: Vec2,
    /// Size of the font, mm.
    pub size: f64,
    /// Where it lies about its point.
    pub anchor: Anchor,
    /// Its colour.
    pub colour: Colour,
    /// Whether it is read from below to above.
    pub upwards: bool,
    /// Width of a white rim that sets it off from what is below, mm.
    pub rim: f64,
}

impl Text {
    /// A black text to the right of a point.
    pub fn new(content: impl Into<String>, at: Vec2, size: f64) -> Self {
        let (anchor, colour) = (Anchor::Start, Colour::BLACK);
        Self { content: content.into(), at, size, anchor, colour, upwards: false, rim: 0.0 }
    }

    /// The same about its point.
    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same in a colour.
    pub fn coloured(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }
}

/// One thing drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A shape.
    Shape {
        /// Its outline.
        outline: Outline,
        /// What fills it.
        fill: Option<Colour>,
        /// What is drawn along its outline.
        stroke: Option<Stroke>,
    },
    /// A text.
    Text(Text),
    /// A picture of pixels, smooth between their middles.
    Picture {
        /// Its pixels, at least one.
        pixels: GrayImage,
        /// Top left corner of the first pixel.
        from: Vec2,
        /// Width and height.
        size: Vec2,
    },
}

/// Marks on a white page.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width and height, mm.
    pub size: Vec2,
    /// What is drawn, from below to above.
    pub marks: Vec<Mark>,
}

impl Drawing {
    /// An empty page, mm.
    pub fn new(size: Vec2) -> Self {
        Self { size, marks: Vec::new() }
    }

    /// Draws a filled rectangle.
    pub fn rectangle(&mut self, from: Vec2, size: Vec2, fill: Colour) {
        self.marks.push(Mark::Shape { outline: Outline::Rectangle { from, size }, fill: Some(fill), stroke: None });
    }

    /// Draws a filled disc.
    pub fn disc(&mut self, centre: Vec2, radius: f64, fill: Colour) {
        self.marks.push(Mark::Shape { outline: Outline::Circle { centre, radius }, fill: Some(fill), stroke: None });
    }

    /// Draws a line through points.
    pub fn line(&mut self, points: &[Vec2], stroke: Stroke) {
        let outline = Outline::Lines { points: points.to_vec(), closed: false };
        self.marks.push(Mark::Shape { outline, fill: None, stroke: Some(stroke) });
    }

    /// Draws a closed polygon.
    pub fn polygon(&mut self, points: &[Vec2], fill: Option<Colour>, stroke: Option<Stroke>) {
        let outline = Outline::Lines { points: points.to_vec(), closed: true };
        self.marks.push(Mark::Shape { outline, fill, stroke });
    }

    /// Draws a text.
    pub fn text(&mut self, text: Text) {
        self.marks.push(Mark::Text(text));
    }

    /// Draws a picture; one without pixels is left out.
    pub fn picture(&mut self, pixels: GrayImage, from: Vec2, size: Vec2) {
        if !pixels.is_empty() {
            self.marks.push(Mark::Picture { pixels, from, size });
        }
    }

    /// The bytes of a file; `dpi` is the resolution of a PNG.
    pub fn encode(&self, format: Format, dpi: f64) -> Result<Vec<u8>, DrawingError> {
        match format {
            Format::Svg => svg::encode(self).map(String::into_bytes),
            Format::Pdf => Ok(pdf::encode(self)),
            Format::Png => png::encode(self, dpi),
        }
    }
}

/// Kinds of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Scalable Vector Graphics.
    Svg,
    /// Portable Document Format.
    Pdf,
    /// Portable Network Graphics, with the physical size of its pixels.
    Png,
}

impl Format {
    /// The kind of file that a name's extension says.
    pub fn of(path: &Path) -> Result<Self, DrawingError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("pdf") => Ok(Self::Pdf),
            Some("png") => Ok(Self::Png),
            _ => Err(DrawingError::Format { path: path.to_owned() }),
        }
    }
}

/// A piece of an outline, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Segment {
    Move(Vec2),
    Line(Vec2),
    Cubic(Vec2, Vec2, Vec2),
    Close,
}

/// The length of a quarter circle's handles, in radii, with which a Bézier curve is nearest to it.
const HANDLE: f64 = 0.552_284_75;

impl Outline {
    fn segments(&self) -> Vec<Segment> {
        match self {
            Self::Rectangle { from, size } => {
                let corner = |x, y| from + Vec2::new(x, y).component_mul(size);
                polyline(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)], true)
            }
            Self::Circle { centre, radius } => circle(centre, *radius),
            Self::Lines { points, closed } => polyline(points, *closed),
        }
    }
}

fn polyline(points: &[Vec2], closed: bool) -> Vec<Segment> {
    let lines = points.iter().enumerate().map(|(i, p)| if i == 0 { Segment::Move(*p) } else { Segment::Line(*p) });
    lines.chain(closed.then_some(Segment::Close)).collect()
}

fn circle(centre: &Vec2, radius: f64) -> Vec<Segment> {
    let quarter = |k: usize| {
        let axis = [Vec2::x(), Vec2::y(), -Vec2::x(), -Vec2::y()];
        let (a, b) = (axis[k], axis[(k + 1) % 4]);
        Segment::Cubic(centre + radius * (a + HANDLE * b), centre + radius * (b + HANDLE * a), centre + radius * b)
    };
    let start = Segment::Move(centre + radius * Vec2::x());
    std::iter::once(start).chain((0..4).map(quarter)).chain([Segment::Close]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_says_the_kind() {
        assert_eq!(Format::of(Path::new("a/b.SVG")).unwrap(), Format::Svg);
        assert_eq!(Format::of(Path::new("b.pdf")).unwrap(), Format::Pdf);
        for name in ["board.jpg", "board", "svg"] {
            let error = Format::of(Path::new(name)).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(".svg, .pdf or .png"), "{error}");
        }
    }

    #[test]
    fn a_circle_of_curves_is_round() {
        let (centre, radius) = (Vec2::new(3.0, 4.0), 2.0);
        let mut at = centre + radius * Vec2::x();
        for segment in circle(&centre, radius) {
            if let Segment::Cubic(a, b, end) = segment {
                for t in [0.25f64, 0.5, 0.75] {
                    let u = 1.0 - t;
                    let p = u.powi(3) * at + 3.0 * u * u * t * a + 3.0 * u * t * t * b + t.powi(3) * end;
                    assert!(((p - centre).norm() - radius).abs() < 3e-4 * radius);
                }
                at = end;
            }
        }
    }
}
