//! Corners in lattice order, and where the next one must be.

use super::level::Level;
use geometry::{Board, Mat3, Pattern, Vec2};
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;

/// Cells within this many steps tell where the next one is.
const PREDICTION_REACH: i32 = 3;

/// Column and row of a corner; negative before the seed.
pub(super) type Cell = (i32, i32);

/// Corners in lattice order: right-handed, from columns to rows as from x to y of the picture.
pub(super) struct Lattice {
    /// Position of each cell, pixels of the level.
    pub(super) cells: BTreeMap<Cell, Vec2>,
    pattern: Pattern,
    /// Of a checkerboard: whether the square before an even cell in both directions is black.
    black_before_even: bool,
}

/// Where a cell lies, and one step along the columns' (`u`) and rows' (`v`) axes, pixels.
pub(super) struct Prediction {
    pub(super) position: Vec2,
    pub(super) u: Vec2,
    pub(super) v: Vec2,
}

impl Lattice {
    pub(super) fn new(
        pattern: Pattern,
        black_before_even: bool,
        cells: impl IntoIterator<Item = (Cell, Vec2)>,
    ) -> Self {
        Self { cells: cells.into_iter().collect(), pattern, black_before_even }
    }

    /// Whether the square before `cell` in both directions is black; squares that stand apart are black after even cells.
    pub(super) fn is_black_before(&self, (i, j): Cell) -> bool {
        match self.pattern {
            Pattern::Checkerboard => (i + j).rem_euclid(2) == i32::from(!self.black_before_even),
            Pattern::Squares { .. } => i.rem_euclid(2) == 1 && j.rem_euclid(2) == 1,
        }
    }

    /// Whether it was grown as a board's pattern is.
    pub(super) fn could_show(&self, board: &Board) -> bool {
        board.pattern == self.pattern
    }

    /// Whether a square of the pattern has its first corner in an even cell only.
    pub(super) fn is_paired(&self) -> bool {
        matches!(self.pattern, Pattern::Squares { .. })
    }

    /// A cell's place along an axis, squares.
    fn coordinate(&self, k: i32) -> f64 {
        match self.pattern {
            Pattern::Checkerboard => f64::from(k),
            Pattern::Squares { gap } => f64::from(k.div_euclid(2)) * (1.0 + gap) + f64::from(k.rem_euclid(2)),
        }
    }

    /// Where `cell` lies by the homography of the known cells around it, or by their affinity while they are few.
    pub(super) fn predict(&self, (i, j): Cell) -> Option<Prediction> {
        let mut near: Vec<(Vec2, Vec2)> = Vec::with_capacity(48);
        let (mut columns, mut rows) = ((i32::MAX, i32::MIN), (i32::MAX, i32::MIN));
        let origin = Vec2::new(self.coordinate(i), self.coordinate(j));
        for dj in -PREDICTION_REACH..=PREDICTION_REACH {
            for di in -PREDICTION_REACH..=PREDICTION_REACH {
                if let Some(position) = self.cells.get(&(i + di, j + dj)) {
                    near.push((Vec2::new(self.coordinate(i + di), self.coordinate(j + dj)) - origin, *position));
                    columns = (columns.0.min(di), columns.1.max(di));
                    rows = (rows.0.min(dj), rows.1.max(dj));
                }
            }
        }
        let spans = |steps: i32| columns.1 - columns.0 >= steps && rows.1 - rows.0 >= steps;
        let by_homography = if near.len() >= 6 && spans(2) { Prediction::by_homography(&near) } else { None };
        let few = near.len() < 3 || !spans(1);
        by_homography.or_else(|| if few { None } else { Prediction::by_affinity(&near) })
    }

    /// Whether most of a line of cells, none of them known, are inside a level and far enough from its border to be found.
    pub(super) fn is_inside(&self, cells: impl Iterator<Item = Cell>, level: &Level) -> bool {
        let margin = super::saddles::MARGIN as f64 + 2.0;
        let sign = |inside: bool| if inside { 1 } else { -1 };
        cells.filter_map(|c| self.predict(c)).map(|p| sign(level.contains(&p.position, margin))).sum::<i32>() > 0
    }

    /// Grey values of the two quarters along the diagonal of a cell's steps, less those of the other two; `None` at the border.
    pub(super) fn crossing(&self, cell: Cell, level: &Level) -> Option<f64> {
        /// Where in a quarter the grey value is taken, parts of a step.
        const QUARTER: f64 = 0.35;
        let Prediction { position, u, v } = self.predict(cell)?;
        let at = |i: f64, j: f64| {
            let place = position + (u * i + v * j) * QUARTER;
            level.contains(&place, 1.0).then(|| level.interpolate(&place))
        };
        Some((at(1.0, 1.0)? + at(-1.0, -1.0)? - at(1.0, -1.0)? - at(-1.0, 1.0)?) / 2.0)
    }
}

impl Prediction {
    /// Least squares of `x (h₇ i + h₈ j + 1) = h₁ i + h₂ j + h₃`, the same for `y`, over cells `(i, j)`.
    fn by_homography(near: &[(Vec2, Vec2)]) -> Option<Self> {
        let centre = near.iter().map(|n| n.1).sum::<Vec2>() / near.len() as f64;
        // Sums of products of (i, j, 1), of them with the position, and of both.
        let (mut cells, mut by_x, mut by_y) = (Mat3::zeros(), Mat3::zeros(), Mat3::zeros());
        let mut by_square = Mat3::zeros();
        for (cell, position) in near {
            let (c, p) = (cell.push(1.0), position - centre);
            let products = c * c.transpose();
            cells += products;
            by_x -= products * p.x;
            by_y -= products * p.y;
            by_square += products * p.norm_squared();
        }
        let mut normal = SMatrix::<f64, 8, 8>::zeros();
        normal.fixed_view_mut::<3, 3>(0, 0).copy_from(&cells);
        normal.fixed_view_mut::<3, 3>(3, 3).copy_from(&cells);
        for (row, sums) in [(0, &by_x), (3, &by_y)] {
            normal.fixed_view_mut::<3, 2>(row, 6).copy_from(&sums.fixed_columns::<2>(0));
            normal.fixed_view_mut::<2, 3>(6, row).copy_from(&sums.fixed_rows::<2>(0));
        }
        normal.fixed_view_mut::<2, 2>(6, 6).copy_from(&by_square.fixed_view::<2, 2>(0, 0));
        let mut right = SVector::<f64, 8>::zeros();
        right.fixed_rows_mut::<3>(0).copy_from(&-by_x.column(2));
        right.fixed_rows_mut::<3>(3).copy_from(&-by_y.column(2));
        right.fixed_rows_mut::<2>(6).copy_from(&-by_square.fixed_view::<2, 1>(0, 2));
        let h = normal.cholesky()?.solve(&right);
        let position = Vec2::new(h[2], h[5]);
        let u = Vec2::new(h[0], h[3]) - position * h[6];
        let v = Vec2::new(h[1], h[4]) - position * h[7];
        // The horizon must stay away from the cells it was fitted to.
        let in_front = near.iter().all(|(c, _)| h[6] * c.x + h[7] * c.y + 1.0 > 0.2);
        (in_front && u.perp(&v) > 0.0).then(|| Self { position: position + centre, u, v })
    }

    fn by_affinity(near: &[(Vec2, Vec2)]) -> Option<Self> {
        let (mut normal, mut right) = (SMatrix::<f64, 3, 3>::zeros(), SMatrix::<f64, 3, 2>::zeros());
        for (cell, position) in near {
            let row = SVector::<f64, 3>::new(cell.x, cell.y, 1.0);
            normal += row * row.transpose();
            right += row * position.transpose();
        }
        let a = normal.cholesky()?.solve(&right);
        let axis = |k: usize| Vec2::new(a[(k, 0)], a[(k, 1)]);
        (axis(0).perp(&axis(1)) > 0.0).then(|| Self { position: axis(2), u: axis(0), v: axis(1) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells of `pattern` seen by a strong homography.
    fn seen(pattern: Pattern, cells: impl Iterator<Item = Cell>) -> Lattice {
        let place = Lattice::new(pattern, true, []);
        let at = |(i, j): Cell| {
            let (x, y) = (place.coordinate(i), place.coordinate(j));
            Vec2::new(40.0 + 22.0 * x - 3.0 * y, 30.0 + 4.0 * x + 19.0 * y) / (1.0 + 0.05 * x + 0.02 * y)
        };
        Lattice::new(pattern, true, cells.map(|c| (c, at(c))))
    }

    #[test]
    fn a_cell_is_predicted_where_it_is() {
        for pattern in [Pattern::Checkerboard, Pattern::Squares { gap: 0.6 }] {
            let all = |missing: Option<Cell>| {
                let cells = (0..6).flat_map(|j| (0..6).map(move |i| (i, j)));
                seen(pattern, cells.filter(move |&c| Some(c) != missing))
            };
            for cell in [(0, 0), (5, 3), (2, 2)] {
                let predicted = all(Some(cell)).predict(cell).map(|p| p.position);
                assert!(predicted.is_some_and(|p| (p - all(None).cells[&cell]).norm() < 1e-6), "{pattern:?} {cell:?}");
            }
        }
    }

    #[test]
    fn two_cells_tell_nothing() {
        assert!(seen(Pattern::Checkerboard, [(0, 0), (1, 0)].into_iter()).predict((0, 1)).is_none());
    }
}
