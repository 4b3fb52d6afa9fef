//! The board that is filmed or printed, as it is asked for.

use crate::FacewrightError;
use clap::Args;
use geometry::Board;
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// Columns and rows, like `9x6`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "(u32, u32)", into = "(u32, u32)")]
pub struct Grid {
    /// In a row.
    pub columns: u32,
    /// Rows of them.
    pub rows: u32,
}

impl From<(u32, u32)> for Grid {
    fn from((columns, rows): (u32, u32)) -> Self {
        Self { columns, rows }
    }
}

impl From<Grid> for (u32, u32) {
    fn from(grid: Grid) -> Self {
        (grid.columns, grid.rows)
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.columns, self.rows)
    }
}

impl Grid {
    fn parse(text: &str) -> Option<Self> {
        let (columns, rows) = text.split_once(['x', 'X', '×', '*', ':'])?;
        Some(Self { columns: columns.trim().parse().ok()?, rows: rows.trim().parse().ok()? })
    }

    fn is_at_least(&self, least: u32) -> bool {
        self.columns.min(self.rows) >= least
    }
}

/// The board.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct BoardOptions {
    /// Inner corners of a checkerboard, columns x rows; several if any of several boards may be shown: 9x6,8x5
    #[arg(long, default_values_t = Self::default().inner, value_parser = inner, value_delimiter = ',')]
    #[serde(deserialize_with = "one_or_several")]
    pub inner: Vec<Grid>,
    /// Separate black squares instead of a checkerboard, columns x rows
    #[arg(long, value_parser = squares, conflicts_with = "inner")]
    pub squares: Option<Grid>,
    /// White gap between two separate squares, millimetres (default: the side of a square)
    #[arg(long, requires = "squares")]
    pub gap_mm: Option<f64>,
    /// Side of a square, millimetres
    #[arg(long, default_value_t = Self::default().square_mm)]
    pub square_mm: f64,
}

impl Default for BoardOptions {
    /// The paper's board.
    fn default() -> Self {
        Self { inner: vec![Grid { columns: 9, rows: 6 }], squares: None, gap_mm: None, square_mm: 25.5 }
    }
}

impl BoardOptions {
    /// The boards that a picture may show.
    pub fn boards(&self) -> Vec<Board> {
        let side = self.square_mm / 1000.0;
        if let Some(squares) = self.squares {
            let gap = self.gap_mm.map_or(1.0, |gap| gap / self.square_mm);
            return vec![Board::squares(squares.columns, squares.rows, side, gap)];
        }
        self.inner.iter().map(|inner| Board::checkerboard(inner.columns, inner.rows, side)).collect()
    }

    /// The only board, where just one will do.
    pub fn board(&self) -> Result<Board, FacewrightError> {
        let [board] = self.boards()[..] else {
            return Err(FacewrightError::Option { name: "the board", expected: "of a single size here" });
        };
        Ok(board)
    }

    /// Refuses boards that cannot be.
    ///
    /// # Errors
    /// [`FacewrightError::Option`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        let refused = |name, expected| Err(FacewrightError::Option { name, expected });
        let is_length = |mm: f64| mm > 0.0 && mm.is_finite();
        if !is_length(self.square_mm) {
            return refused("the board's square", "longer than 0 mm");
        }
        if self.gap_mm.is_some_and(|mm| !is_length(mm)) {
            return refused("the gap between two squares", "longer than 0 mm");
        }
        if self.squares.is_some_and(|squares| !squares.is_at_least(2)) {
            return refused("the number of separate squares", "at least 2x2");
        }
        if self.inner.is_empty() || !self.inner.iter().all(|inner| inner.is_at_least(3)) {
            return refused("the number of inner corners", "at least 3x3");
        }
        Ok(())
    }
}

fn inner(text: &str) -> Result<Grid, String> {
    let grid = Grid::parse(text).filter(|grid| grid.is_at_least(3));
    grid.ok_or_else(|| "two numbers of at least 3, like 9x6".to_owned())
}

fn squares(text: &str) -> Result<Grid, String> {
    let grid = Grid::parse(text).filter(|grid| grid.is_at_least(2));
    grid.ok_or_else(|| "two numbers of at least 2, like 3x4".to_owned())
}

/// One size alone stands for a list of one.
fn one_or_several<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Grid>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "columns and rows, or a list of them")]
    enum Sizes {
        One(Grid),
        Several(Vec<Grid>),
    }
    Ok(match Sizes::deserialize(from)? {
        Sizes::One(grid) => vec![grid],
        Sizes::Several(grids) => grids,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_columns_and_rows() {
        assert_eq!(inner("9x6"), Ok(Grid { columns: 9, rows: 6 }));
        for lenient in ["9X6", "9×6", "9 x 6", " 9x6 ", "9*6"] {
            assert_eq!(inner(lenient), inner("9x6"), "{lenient}");
        }
        assert!(["9", "9x", "2x6", "x6", "9x6x3"].iter().all(|wrong| inner(wrong).is_err()));
        assert!(squares("2x2").is_ok() && squares("1x4").is_err());
    }

    #[test]
    fn one_size_stands_for_a_list() {
        let read = |text: &str| serde_json::from_str::<BoardOptions>(text);
        assert_eq!(read(r#"{"inner": [8, 5]}"#).unwrap().inner, [Grid { columns: 8, rows: 5 }]);
        assert_eq!(read(r#"{"inner": [[8, 5], [9, 6]]}"#).unwrap().boards().len(), 2);
        assert_eq!(read("{}").unwrap(), BoardOptions::default());
        assert!(read(r#"{"inner": "8x5"}"#).is_err());
    }

    #[test]
    fn separate_squares_have_a_gap_of_their_side_unless_told() {
        let asked = |gap_mm| {
            let squares = Some(Grid { columns: 3, rows: 4 });
            BoardOptions { squares, gap_mm, square_mm: 30.0, ..BoardOptions::default() }
        };
        assert_eq!(asked(None).board().unwrap(), Board::squares(3, 4, 0.03, 1.0));
        assert_eq!(asked(Some(15.0)).board().unwrap(), Board::squares(3, 4, 0.03, 0.5));
        assert!(asked(Some(0.0)).validate().is_err());
    }
}
