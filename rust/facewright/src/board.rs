//! The printable checkerboard: an SVG in millimetres, exact at 100 % print scale.
//!
//! # Entry points
//! - [`board_svg`]: number of inner corners, square size and page in, the document out.
//!
//! # Conventions
//! The square left of and above the first inner corner is black. Around the board stays a white margin of at least half a
//! square. Along the side with most room a ruler of 100 mm shows whether the printer kept the scale.

use svg::Document;
use svg::node::element::{Group, Path, Rectangle, Text};

/// Length of the ruler, mm.
const RULER_MM: f64 = 100.0;
/// Least room between page edge and board for ruler and text, mm.
const STRIP_MM: f64 = 15.0;
/// What printers leave blank along the edges of a page, mm.
const BORDER_MM: f64 = 5.0;
/// White margin around the board, parts of a square.
const MARGIN_SQUARES: f64 = 0.5;

/// A page to print on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// Why there is no board to print.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardPatternError {
    /// Too few corners, or squares of no size.
    #[error(
        "a board needs at least 3x3 inner corners and squares of a positive size; {columns}x{rows} of {square_mm} mm were asked for"
    )]
    Impossible {
        /// Inner corners in a row.
        columns: u32,
        /// Rows of inner corners.
        rows: u32,
        /// Side of a square.
        square_mm: f64,
    },
    /// The board is larger than the page.
    #[error("the board needs {width_mm:.0} x {height_mm:.0} mm with its margins and does not fit on {page}: {}", advice(.fits))]
    DoesNotFit {
        /// The page asked for.
        page: Page,
        /// Width needed.
        width_mm: f64,
        /// Height needed.
        height_mm: f64,
        /// The smallest page it fits on.
        fits: Option<Page>,
    },
}

fn advice(fits: &Option<Page>) -> String {
    match fits {
        Some(page) => format!("print on {page}, or take smaller squares"),
        None => "take smaller or fewer squares".to_owned(),
    }
}

/// A board of `inner` corners (columns, rows) as an SVG document of the page's size, turned as the board fits.
pub fn board_svg(inner: (u32, u32), square_mm: f64, page: Page) -> Result<String, BoardPatternError> {
    let (columns, rows) = inner;
    if columns.min(rows) < 3 || !(square_mm.is_finite() && square_mm > 0.0) {
        return Err(BoardPatternError::Impossible { columns, rows, square_mm });
    }
    let board = (f64::from(columns + 1) * square_mm, f64::from(rows + 1) * square_mm);
    let margin = BORDER_MM.max(MARGIN_SQUARES * square_mm);
    let Some((width, height)) = oriented(page, board, margin) else {
        let fits = Page::ALL.into_iter().find(|&p| oriented(p, board, margin).is_some());
        let (width_mm, height_mm) = (board.0 + 2.0 * margin, board.1 + 2.0 * margin);
        return Err(BoardPatternError::DoesNotFit { page, width_mm, height_mm, fits });
    };
    let (left, top) = ((width - board.0) / 2.0, (height - board.1) / 2.0);
    let text = format!(
        "{columns} x {rows} inner corners, squares of {square_mm} mm. Print at 100 %: the ruler must measure 100 mm."
    );
    let place = if left > top {
        format!("translate({width} {}) rotate(-90)", height / 2.0)
    } else {
        format!("translate({} {height})", width / 2.0)
    };
    let document = Document::new()
        .set("width", format!("{width}mm"))
        .set("height", format!("{height}mm"))
        .set("viewBox", (0, 0, width, height))
        .add(Rectangle::new().set("width", width).set("height", height).set("fill", "white"))
        .add(squares(inner, square_mm, (left, top)))
        .add(Group::new().set("transform", place).add(ruler()).add(label(text)));
    Ok(document.to_string())
}

/// The page's width and height in the orientation that has room for the board, its margin and the strip.
fn oriented(page: Page, board: (f64, f64), margin: f64) -> Option<(f64, f64)> {
    let (long, short) = page.sides_mm();
    [(long, short), (short, long)].into_iter().find(|(width, height)| {
        let room = ((width - board.0) / 2.0, (height - board.1) / 2.0);
        room.0.min(room.1) >= margin && room.0.max(room.1) >= STRIP_MM
    })
}

/// The black squares, from the one before the first inner corner.
fn squares((columns, rows): (u32, u32), side: f64, (left, top): (f64, f64)) -> Group {
    let cells = (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j)));
    cells.filter(|(i, j)| (i + j) % 2 == 0).fold(Group::new().set("fill", "black"), |group, (i, j)| {
        let square = Rectangle::new()
            .set("x", left + f64::from(i) * side)
            .set("y", top + f64::from(j) * side)
            .set("width", side)
            .set("height", side);
        group.add(square)
    })
}

/// A line of 100 mm with a tick each 10 mm, above the middle of a page edge at the origin.
fn ruler() -> Path {
    let tick = |k: u32| {
        let length = if k.is_multiple_of(5) { 2.5 } else { 1.5 };
        format!("M{} -8.5v-{length}", 10.0 * f64::from(k) - RULER_MM / 2.0)
    };
    let ticks: String = (0..=10).map(tick).collect();
    Path::new()
        .set("d", format!("M{} -8.5h{RULER_MM}{ticks}", -RULER_MM / 2.0))
        .set("stroke", "black")
        .set("stroke-width", 0.2)
        .set("fill", "none")
}

/// A line of text between the page edge and the ruler.
fn label(text: String) -> Text {
    Text::new(text)
        .set("y", -BORDER_MM)
        .set("font-family", "sans-serif")
        .set("font-size", 2.8)
        .set("text-anchor", "middle")
}

#[cfg(test)]
mod tests {
    use super::*;
    use svg::parser::Event;

    /// Attributes `x, y, width, height` of all rectangles but the background.
    fn rectangles(document: &str) -> Vec<[f64; 4]> {
        let number = |a: &svg::node::Attributes, k: &str| a.get(k).and_then(|v| v.parse::<f64>().ok());
        svg::read(document)
            .unwrap()
            .filter_map(|event| match event {
                Event::Tag("rect", _, a) => {
                    Some([number(&a, "x")?, number(&a, "y")?, number(&a, "width")?, number(&a, "height")?])
                }
                _ => None,
            })
            .collect()
    }

    #[test]
    fn squares_are_exact_centred_and_begin_with_black() {
        let document = board_svg((9, 6), 25.5, Page::A4).unwrap();
        assert!(document.contains("width=\"297mm\"") && document.contains("height=\"210mm\""));
        assert!(document.contains("viewBox=\"0 0 297 210\""));
        let squares = rectangles(&document);
        assert_eq!(squares.len(), 35);
        assert!(squares.iter().all(|s| s[2] == 25.5 && s[3] == 25.5));
        assert_eq!((squares[0][0], squares[0][1]), ((297.0 - 255.0) / 2.0, (210.0 - 178.5) / 2.0));
        let right = squares.iter().map(|s| s[0] + s[2]).fold(0.0, f64::max);
        assert!((right - (297.0 + 255.0) / 2.0).abs() < 1e-9);
    }

    #[test]
    fn ruler_and_text_state_the_scale() {
        let document = board_svg((6, 8), 22.0, Page::Letter).unwrap();
        assert!(document.contains("h100M") && document.contains("6 x 8 inner corners, squares of 22 mm"));
        assert!(document.contains("width=\"215.9mm\""), "a tall board turns the page");
    }

    #[test]
    fn a_board_too_large_names_the_page_it_fits() {
        let error = board_svg((9, 6), 35.0, Page::A4).unwrap_err();
        assert!(matches!(error, BoardPatternError::DoesNotFit { fits: Some(Page::A3), .. }));
        assert!(error.to_string().contains("print on A3"), "{error}");
        let error = board_svg((9, 6), 80.0, Page::A3).unwrap_err();
        assert!(error.to_string().contains("smaller or fewer squares"), "{error}");
    }

    #[test]
    fn impossible_boards_are_refused() {
        for (inner, side) in [((2, 6), 25.0), ((9, 6), 0.0), ((9, 6), f64::NAN)] {
            assert!(matches!(board_svg(inner, side, Page::A4), Err(BoardPatternError::Impossible { .. })));
        }
    }
}
