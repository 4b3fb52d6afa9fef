//! How far the edges of dark squares lie inside or outside of where they were printed.
//!
//! A tone curve, blooming and spreading ink move every edge of a square by about the same number of pixels towards its dark or
//! its bright side. Where four squares meet these shifts cancel; a single square looks smaller or larger. Since the ratio of side
//! and gap is known, the shift is found together with the homography of the board, and taken back.

use geometry::{Board, Vec2};
use nalgebra::{SMatrix, SVector};

/// Unknowns: the shift, eight of the homography, four of a cubic for each coordinate.
const N: usize = 17;

/// A corner: its number on the board, where it was measured, and the directions of its square's two sides, away from it.
#[derive(Clone, Copy)]
pub(super) struct SquareCorner {
    pub(super) index: usize,
    pub(super) position: Vec2,
    pub(super) sides: [Vec2; 2],
}

/// The edges' mean shift towards the inside of the squares, pixels; `None` where the corners do not tell.
pub(super) fn estimate(board: &Board, corners: &[SquareCorner]) -> Option<f64> {
    let points = board.points();
    let size = board.extent().norm();
    let centre = corners.iter().map(|c| c.position).sum::<Vec2>() / corners.len() as f64;
    let scale = corners.iter().map(|c| (c.position - centre).norm()).sum::<f64>() / corners.len() as f64;
    let (mut h, mut shift) = (SVector::<f64, 2>::zeros(), None);
    for _ in 0..3 {
        let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
        for corner in corners {
            let p = (points[corner.index] - board.centre()) / size;
            let q = (corner.position - centre) / scale;
            // Equations are multiplied by the depth, as known so far: that makes them linear.
            let depth = h.x * p.x + h.y * p.y + 1.0;
            let n = inward(&corner.sides) * (depth / scale);
            let cubic = SVector::from([p.x.powi(3), p.x * p.x * p.y, p.x * p.y * p.y, p.y.powi(3)]) * depth;
            for (axis, n, q) in [(0, n.x, q.x), (1, n.y, q.y)] {
                let mut row = SVector::<f64, N>::zeros();
                row[0] = n;
                row.fixed_rows_mut::<3>(1 + 3 * axis).copy_from(&p.push(1.0));
                row.fixed_rows_mut::<2>(7).copy_from(&(p * -q));
                row.fixed_rows_mut::<4>(9 + 4 * axis).copy_from(&cubic);
                normal += row * row.transpose() / (depth * depth);
                right += row * (q / (depth * depth));
            }
        }
        let solution = normal.cholesky()?.solve(&right);
        h = SVector::from([solution[7], solution[8]]);
        shift = Some(solution[0]);
    }
    shift
}

/// By how much a corner moves when both edges move inwards by one pixel.
pub(super) fn inward(sides: &[Vec2; 2]) -> Vec2 {
    let [u, v] = sides.map(|s| s.normalize());
    (u + v) / u.perp(&v).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_of_all_edges_is_found_under_a_homography() {
        let board = Board::squares(4, 3, 0.03, 0.7);
        let place = |p: &Vec2| {
            Vec2::new(900.0 * p.x - 120.0 * p.y + 200.0, 150.0 * p.x + 800.0 * p.y + 90.0)
                / (1.0 + 1.2 * p.x + 0.7 * p.y)
        };
        let points = board.points();
        let (columns, _) = board.corners();
        for shift in [0.3, -0.2, 0.0] {
            let corner = |index: usize| {
                let (i, j) = (index % columns, index / columns);
                let partner = |k: usize| if k.is_multiple_of(2) { 1_isize } else { -1 };
                let at = |i: usize, j: usize| place(&points[j * columns + i]);
                let here = at(i, j);
                let to_u = at(i.saturating_add_signed(partner(i)), j) - here;
                let to_v = at(i, j.saturating_add_signed(partner(j))) - here;
                let sides = [to_u, to_v];
                SquareCorner { index, position: here + inward(&sides) * shift, sides }
            };
            let corners: Vec<SquareCorner> = (0..points.len()).map(corner).collect();
            let found = estimate(&board, &corners).unwrap();
            assert!((found - shift).abs() < 0.01, "{found} {shift}");
        }
    }
}
