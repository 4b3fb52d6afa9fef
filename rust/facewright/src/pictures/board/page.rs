//! Pages to print on.

use clap::ValueEnum;
use geometry::Vec2;
use serde::{Deserialize, Serialize};

/// What printers leave blank along the edges of a page, mm.
pub const BORDER_MM: f64 = 5.0;
/// Least room between page edge and board for a ruler, mm.
const RULER_STRIP_MM: f64 = 10.0;
/// Least room between page edge and board for a ruler and a line of text, mm.
const TEXT_STRIP_MM: f64 = 13.5;

/// A page to print on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
pub enum Page {
    /// 297 × 210 mm.
    A4,
    /// 420 × 297 mm.
    A3,
    /// 279.4 × 215.9 mm.
    Letter,
}

impl Page {
    /// All pages, smallest first.
    pub const ALL: [Self; 3] = [Self::A4, Self::Letter, Self::A3];

    /// Long and short side, mm.
    pub fn sides_mm(self) -> (f64, f64) {
        match self {
            Self::A4 => (297.0, 210.0),
            Self::A3 => (420.0, 297.0),
            Self::Letter => (279.4, 215.9),
        }
    }

    /// The page's width and height in the orientation that has most room around a print of a width and a height; `None` if
    /// rulers, a line of text and a white margin have no room in it. All in mm.
    pub(super) fn around(self, print: Vec2, margin: f64) -> Option<Vec2> {
        let (long, short) = self.sides_mm();
        let room = |size: Vec2| (size - print) / 2.0;
        let (lying, standing) = (Vec2::new(long, short), Vec2::new(short, long));
        let size = if room(lying).min() >= room(standing).min() { lying } else { standing };
        (room(size).min() >= Self::margin(margin) && has_text_strip(room(size).max())).then_some(size)
    }

    /// The least room around a print that shall have a white margin, mm.
    pub(super) fn margin(white: f64) -> f64 {
        white.max(RULER_STRIP_MM)
    }
}

/// Whether room between page edge and board suffices for a ruler and a line of text, mm.
pub(super) fn has_text_strip(room: f64) -> bool {
    room >= TEXT_STRIP_MM
}

impl std::fmt::Display for Page {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::A4 => "A4",
            Self::A3 => "A3",
            Self::Letter => "Letter",
        })
    }
}

impl std::str::FromStr for Page {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let page = Self::ALL.into_iter().find(|page| page.to_string().eq_ignore_ascii_case(name));
        page.ok_or_else(|| format!("page is {name}, not A4, A3 or Letter"))
    }
}
