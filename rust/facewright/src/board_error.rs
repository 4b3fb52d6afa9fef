//! Why there is no board to print.

use geometry::Board;

/// Least side of a square, mm: smaller ones no camera sees sharp.
pub const LEAST_MM: f64 = 3.0;

/// Why there is no board to print.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardPatternError {
    /// Too few corners, or squares too small.
    #[error(
        "a board needs at least 3x3 inner corners, or 2x2 squares with gaps between them, and squares of at least {LEAST_MM} mm; {board} of {} mm were asked for",
        (.board.square * 1e9).round() / 1e6
    )]
    Impossible {
        /// What was asked for.
        board: Board,
    },
    /// The board is larger than the page.
    #[error("the board needs {width_mm:.0} x {height_mm:.0} mm with its margins and does not fit on {page}: {}", advice(.fits))]
    DoesNotFit {
        /// The page asked for.
        page: String,
        /// Width needed.
        width_mm: f64,
        /// Height needed.
        height_mm: f64,
        /// The smallest page it fits on.
        fits: Option<String>,
    },
}

fn advice(fits: &Option<String>) -> String {
    match fits {
        Some(page) => format!("print on {page}, or use smaller squares"),
        None => "use smaller or fewer squares".to_owned(),
    }
}
