//! The board to print: exact in millimetres at 100 % print scale.
//!
//! # Entry points
//! - [`sheet`]: [`SheetOptions`] in, a [`Drawing`] out; its `write` makes SVG, PDF or PNG.
//!
//! # Conventions
//! The square left of and above the first inner corner of a checkerboard is black. In the first black square of
//! [`geometry::Board`]'s frame a white disc says which way up the board is. Around the board stays a white margin of at least
//! half a square. A ruler of 100 mm along each axis shows whether the printer kept the scale: printers stretch paper in one
//! direction more than in the other.

mod page;

pub use page::Page;

use crate::board_error::{BoardPatternError, LEAST_MM};
use crate::{BoardOptions, FacewrightError};
use clap::{ArgAction, Args};
use drawing::{Anchor, Colour, DPI, Drawing, Stroke, Text};
use geometry::{Board, Pattern, Vec2};
use page::BORDER_MM;
use serde::{Deserialize, Serialize};

/// Length of a ruler, mm.
const RULER_MM: f64 = 100.0;
/// Where the rulers' lines lie, mm from the page's edge: one with a line of text below it, the other without.
const RULERS_MM: (f64, f64) = (8.5, BORDER_MM);
/// Size of the text, mm.
const TEXT_MM: f64 = 2.8;

/// What is printed, and on what.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct SheetOptions {
    /// The board.
    #[command(flatten)]
    #[serde(flatten)]
    pub board: BoardOptions,
    /// Paper
    #[arg(long, value_enum, default_value_t = Self::default().page)]
    pub page: Page,
    /// Leave out the white disc that tells which way up the board is
    #[arg(long = "no-mark", action = ArgAction::SetFalse)]
    pub mark: bool,
    /// Resolution of a PNG, dots per inch
    #[arg(long, default_value_t = Self::default().dpi)]
    pub dpi: f64,
}

impl Default for SheetOptions {
    fn default() -> Self {
        Self { board: BoardOptions::default(), page: Page::A4, mark: true, dpi: DPI }
    }
}

impl SheetOptions {
    /// Refuses what cannot be.
    ///
    /// # Errors
    /// [`FacewrightError::Option`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        if !(self.dpi > 0.0 && self.dpi.is_finite()) {
            return Err(FacewrightError::Option { name: "the resolution", expected: "more than 0 dots per inch" });
        }
        self.board.validate()
    }
}

/// A length in metres as millimetres, without the rounding errors of metres.
fn millimetres(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}

fn side_mm(board: &Board) -> f64 {
    millimetres(board.square)
}

/// The board on its page.
///
/// # Examples
/// ```
/// use facewright::BoardOptions;
/// use facewright::pictures::board::{Page, SheetOptions, sheet};
///
/// let board = BoardOptions { inner: vec![(8, 5).into()], square_mm: 25.0, ..BoardOptions::default() };
/// let drawing = sheet(&SheetOptions { board, page: Page::A4, ..SheetOptions::default() })?;
/// let pdf = drawing.encode(drawing::Format::Pdf, 300.0)?;
/// assert!(pdf.starts_with(b"%PDF"));
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn sheet(options: &SheetOptions) -> Result<Drawing, FacewrightError> {
    options.validate()?;
    Ok(on_page(&options.board.board()?, options.page, options.mark)?)
}

/// A board on a page, turned as the board fits, with or without the disc that tells it from itself turned by half a turn.
fn on_page(board: &Board, page: Page, mark: bool) -> Result<Drawing, BoardPatternError> {
    if !is_possible(board) {
        return Err(BoardPatternError::Impossible { board: *board });
    }
    let (extent, side) = (board.extent().map(millimetres), side_mm(board));
    let Some(size) = page.around(extent, side / 2.0) else {
        let fits = Page::ALL.into_iter().find(|page| page.around(extent, side / 2.0).is_some());
        let needed = extent.add_scalar(2.0 * Page::margin(side / 2.0));
        let (page, fits) = (page.to_string(), fits.map(|page| page.to_string()));
        return Err(BoardPatternError::DoesNotFit { page, width_mm: needed.x, height_mm: needed.y, fits });
    };
    let corner = (size - extent) / 2.0;
    let mut drawing = Drawing::new(size);
    squares(board, side).for_each(|at| drawing.rectangle(corner + at, Vec2::repeat(side), Colour::BLACK));
    if mark {
        let middle = corner.add_scalar(origin(board, side) + side / 2.0);
        drawing.disc(middle, Board::MARK_RADIUS * side, Colour::WHITE);
    }
    let below = page::has_text_strip(corner.y);
    ruler(&mut drawing, Edge::Below, if below { RULERS_MM.0 } else { RULERS_MM.1 });
    ruler(&mut drawing, Edge::Right, if below { RULERS_MM.1 } else { RULERS_MM.0 });
    let edge = if below { Edge::Below } else { Edge::Right };
    let text = format!("{}. Print at 100 %: both rulers must measure 100 mm.", describe(board));
    drawing.text(edge.text(size, text, 0.0, BORDER_MM, Anchor::Middle));
    Ok(drawing)
}

/// Whether there is such a board at all.
fn is_possible(board: &Board) -> bool {
    let (least, gap) = match board.pattern {
        Pattern::Checkerboard => (3, 1.0),
        Pattern::Squares { gap } => (2, gap),
    };
    let is_gap = gap.is_finite() && millimetres(gap * board.square) > 0.0;
    board.columns.min(board.rows) >= least && board.square.is_finite() && side_mm(board) >= LEAST_MM && is_gap
}

/// What is printed, with its lengths.
pub fn describe(board: &Board) -> String {
    let side = side_mm(board);
    match board.pattern {
        Pattern::Checkerboard => format!("{board}, squares of {side} mm"),
        Pattern::Squares { gap } => format!("{board} of {side} mm, {} mm apart", millimetres(gap * board.square)),
    }
}

/// Where the origin of the board's frame lies, along both axes, from the corner of the print, mm.
fn origin(board: &Board, side: f64) -> f64 {
    match board.pattern {
        Pattern::Checkerboard => side,
        Pattern::Squares { .. } => 0.0,
    }
}

/// Top left corners of the black squares, row by row, from the corner of the print, mm.
fn squares(board: &Board, side: f64) -> impl Iterator<Item = Vec2> {
    let (pitch, columns, rows, checkered) = match board.pattern {
        Pattern::Checkerboard => (side, board.columns + 1, board.rows + 1, true),
        Pattern::Squares { gap } => (side + millimetres(gap * board.square), board.columns, board.rows, false),
    };
    let cells = (0..rows).flat_map(move |j| (0..columns).map(move |i| (i, j)));
    let black = cells.filter(move |(i, j)| !checkered || (i + j).is_multiple_of(2));
    black.map(move |(i, j)| pitch * Vec2::new(f64::from(i), f64::from(j)))
}

/// An edge of the page along which something is drawn.
#[derive(Clone, Copy)]
enum Edge {
    Below,
    Right,
}

impl Edge {
    /// A point of the page, `along` the edge from its middle (to the right, or upwards) and `above` it, mm.
    fn point(self, size: Vec2, along: f64, above: f64) -> Vec2 {
        match self {
            Self::Below => Vec2::new(size.x / 2.0 + along, size.y - above),
            Self::Right => Vec2::new(size.x - above, size.y / 2.0 - along),
        }
    }

    fn text(self, size: Vec2, content: String, along: f64, above: f64, anchor: Anchor) -> Text {
        let upwards = matches!(self, Self::Right);
        Text { upwards, ..Text::new(content, self.point(size, along, above), TEXT_MM).anchored(anchor) }
    }
}

/// A line of 100 mm along an edge with a tick each 10 mm.
fn ruler(drawing: &mut Drawing, edge: Edge, above: f64) {
    let (size, half) = (drawing.size, RULER_MM / 2.0);
    let stroke = Stroke { colour: Colour::BLACK, width: 0.2 };
    drawing.line(&[edge.point(size, -half, above), edge.point(size, half, above)], stroke);
    for k in 0..=10 {
        let along = 10.0 * f64::from(k) - half;
        let tick = if k % 5 == 0 { 2.5 } else { 1.5 };
        // The outermost edges of the first and the last tick are 100 mm apart.
        let along = along.clamp(-half + stroke.width / 2.0, half - stroke.width / 2.0);
        drawing.line(&[edge.point(size, along, above), edge.point(size, along, above + tick)], stroke);
    }
    drawing.text(edge.text(size, "0".to_owned(), -half - 1.0, above, Anchor::End));
    drawing.text(edge.text(size, "100 mm".to_owned(), half + 1.0, above, Anchor::Start));
}

#[cfg(test)]
mod tests;
