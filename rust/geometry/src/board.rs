//! The printed plane that calibrates a camera.

use crate::Vec2;
use serde::{Deserialize, Serialize};

/// What is printed on a board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Black and white squares that touch (paper, section 2.2).
    Checkerboard,
    /// Black squares apart from each other (Zhang 1999).
    Squares {
        /// White between two squares, parts of a square's side.
        gap: f64,
    },
}

/// A flat board of equal squares.
///
/// Its frame has the origin in the first corner, x along the rows, y from row to row, and z = 0. Corners are counted row by
/// row. The square left of and above the first corner of a checkerboard is black.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Board {
    /// What is printed.
    pub pattern: Pattern,
    /// Of a checkerboard the inner corners in a row, where four squares meet; otherwise the black squares in a row.
    pub columns: u32,
    /// Rows of them.
    pub rows: u32,
    /// Side of a square, metres.
    pub square: f64,
}

impl Board {
    /// Radius, parts of a square's side, of the white disc that may be printed in the first black square: the one between
    /// the first corner and its diagonal neighbour. It tells a board from the same board turned by half a turn.
    pub const MARK_RADIUS: f64 = 0.15;

    /// A checkerboard of `columns × rows` inner corners, its squares' side in metres.
    pub fn checkerboard(columns: u32, rows: u32, square: f64) -> Self {
        Self { pattern: Pattern::Checkerboard, columns, rows, square }
    }

    /// `columns × rows` black squares, their side in metres, `gap` of it between them.
    pub fn squares(columns: u32, rows: u32, square: f64, gap: f64) -> Self {
        Self { pattern: Pattern::Squares { gap }, columns, rows, square }
    }

    /// Corners in a row, and rows of corners.
    pub fn corners(&self) -> (usize, usize) {
        let each = match self.pattern {
            Pattern::Checkerboard => 1,
            Pattern::Squares { .. } => 2,
        };
        (each * self.columns as usize, each * self.rows as usize)
    }

    /// The corners in the board's frame, row by row, metres.
    pub fn points(&self) -> Vec<Vec2> {
        let (columns, rows) = self.corners();
        (0..rows).flat_map(|j| (0..columns).map(move |i| self.point(i, j))).collect()
    }

    /// The corner in a column and a row, metres.
    fn point(&self, column: usize, row: usize) -> Vec2 {
        let along = |k: usize| match self.pattern {
            Pattern::Checkerboard => k as f64,
            Pattern::Squares { gap } => (k / 2) as f64 * (1.0 + gap) + (k % 2) as f64,
        };
        Vec2::new(along(column), along(row)) * self.square
    }

    /// Width and height of the printed squares, metres.
    pub fn extent(&self) -> Vec2 {
        let (columns, rows) = self.corners();
        let edge = match self.pattern {
            Pattern::Checkerboard => 2.0 * self.square,
            Pattern::Squares { .. } => 0.0,
        };
        self.point(columns - 1, rows - 1).add_scalar(edge)
    }

    /// The point about which half a turn maps the corners onto each other, metres.
    pub fn centre(&self) -> Vec2 {
        let (columns, rows) = self.corners();
        self.point(columns - 1, rows - 1) / 2.0
    }

    /// Whether, without a mark, it looks the same after half a turn.
    pub fn is_symmetric(&self) -> bool {
        match self.pattern {
            Pattern::Checkerboard => (self.columns + self.rows).is_multiple_of(2),
            Pattern::Squares { .. } => true,
        }
    }
}

impl std::fmt::Display for Board {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = match self.pattern {
            Pattern::Checkerboard => "inner corners",
            Pattern::Squares { .. } => "squares",
        };
        write!(f, "{}x{} {what}", self.columns, self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_turn_maps_the_corners_onto_each_other() {
        for board in [Board::checkerboard(9, 6, 0.025), Board::squares(3, 4, 0.03, 0.5)] {
            let points = board.points();
            let (columns, rows) = board.corners();
            assert_eq!(points.len(), columns * rows);
            for (a, b) in points.iter().zip(points.iter().rev()) {
                assert!((2.0 * board.centre() - a - b).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn squares_lie_a_gap_apart() {
        let board = Board::squares(3, 4, 0.03, 0.5);
        let row: Vec<f64> = board.points()[..6].iter().map(|p| p.x / 0.015).collect();
        assert!(row.iter().zip([0.0, 2.0, 3.0, 5.0, 6.0, 8.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{row:?}");
        assert!((board.extent() - Vec2::new(0.12, 0.165)).norm() < 1e-12);
    }

    #[test]
    fn a_checkerboard_has_one_square_beyond_its_corners() {
        assert!((Board::checkerboard(9, 6, 0.0255).extent() - Vec2::new(0.255, 0.1785)).norm() < 1e-12);
        assert!(!Board::checkerboard(9, 6, 1.0).is_symmetric() && Board::checkerboard(8, 6, 1.0).is_symmetric());
    }
}
