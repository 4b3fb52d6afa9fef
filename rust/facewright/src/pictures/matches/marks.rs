//! What became of a point, as a mark.

use drawing::style::{ACCENT, INK};
use drawing::{Colour, Drawing, Stroke};
use geometry::Vec2;

/// Points up to which marks and numbers are large.
const FEW: usize = 90;

/// What became of a point; each has its colour, which no common colour blindness takes for another's (Okabe and Ito 2008), and
/// its shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Found by the tracker and left there.
    Kept,
    /// Found elsewhere by the correction.
    Moved,
    /// Found by the tracker and not believed.
    Rejected,
    /// Not found.
    Lost,
}

impl State {
    /// In the order of the legend.
    pub const ALL: [Self; 4] = [Self::Kept, Self::Moved, Self::Rejected, Self::Lost];

    /// In the order drawn, from below to above.
    pub const UPWARDS: [Self; 4] = [Self::Lost, Self::Kept, Self::Moved, Self::Rejected];

    pub fn meaning(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Moved => "moved by the correction",
            Self::Rejected => "rejected",
            Self::Lost => "lost by the tracker",
        }
    }

    /// Of mark and vector.
    pub fn colour(self) -> Colour {
        match self {
            Self::Kept => Colour { rgb: [0, 114, 178], opacity: 1.0 },
            Self::Moved => Colour { rgb: [240, 228, 66], opacity: 1.0 },
            Self::Rejected => ACCENT,
            Self::Lost => INK,
        }
    }

    /// What sets mark and vector off from the picture.
    pub fn casing(self) -> Colour {
        if self == Self::Moved { INK } else { Colour::WHITE }
    }

    /// Of the number.
    pub fn ink(self) -> Colour {
        if self == Self::Rejected { ACCENT } else { INK }
    }

    /// Draws the mark about a point: disc, diamond, cross or open square.
    pub fn draw(self, drawing: &mut Drawing, at: Vec2, radius: f64) {
        let (colour, thin) = (self.colour(), 0.45 * radius);
        let corner = |x: f64, y: f64| at + radius * Vec2::new(x, y);
        let cased = [(self.casing(), 2.2 * thin), (colour, thin)];
        match self {
            Self::Kept => {
                drawing.disc(at, 1.35 * radius, Colour::WHITE);
                drawing.disc(at, radius, colour);
            }
            Self::Moved => {
                let r = 1.35;
                let diamond = [corner(0.0, -r), corner(r, 0.0), corner(0.0, r), corner(-r, 0.0)];
                drawing.polygon(&diamond, Some(colour), Some(Stroke { colour: INK, width: 0.3 * radius }));
            }
            Self::Rejected => {
                for (colour, width) in cased {
                    for (x, y) in [(1.0, 1.0), (1.0, -1.0)] {
                        drawing.line(&[corner(-x, -y), corner(x, y)], Stroke { colour, width });
                    }
                }
            }
            Self::Lost => {
                for (colour, width) in cased {
                    let square = [corner(-0.9, -0.9), corner(0.9, -0.9), corner(0.9, 0.9), corner(-0.9, 0.9)];
                    drawing.polygon(&square, None, Some(Stroke { colour, width }));
                }
            }
        }
    }
}

/// Sizes that become smaller where many points share the page, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Radius of a mark.
    pub mark: f64,
    /// Size of a number's font.
    pub number: f64,
    /// Width of a vector.
    pub line: f64,
}

impl Sizes {
    /// For a number of points.
    pub fn of(points: usize) -> Self {
        if points <= FEW {
            Self { mark: 0.7, number: 2.0, line: 0.3 }
        } else {
            Self { mark: 0.5, number: 1.6, line: 0.22 }
        }
    }
}
