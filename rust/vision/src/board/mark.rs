//! The printed mark that tells a board from the same board turned by half a turn.

use super::level::Level;
use geometry::{Board, Vec2};

/// Sides of a square, pixels, below which a mark can't be told from noise and blur.
const MIN_SIDE: f64 = 10.0;
/// Difference of white and black, grey levels, below which nothing is said.
const MIN_CONTRAST: f64 = 12.0;
/// A mark is at least this part of the way from black to white; what is no mark at most [`MAX_PLAIN`].
const MIN_MARK: f64 = 0.35;
const MAX_PLAIN: f64 = 0.2;

/// Whether the black square with these corners, in turn, has the white disc of [`Board::MARK_RADIUS`] in its middle; `None`
/// where that can't be seen.
pub(super) fn is_there(level: &Level, corners: [Option<Vec2>; 4]) -> Option<bool> {
    let [Some(a), Some(b), Some(c), Some(d)] = corners else { return None };
    let (u, v) = ((b - a + c - d) / 2.0, (d - a + c - b) / 2.0);
    let inside = [a, b, c, d].iter().all(|p| level.contains(p, 0.5 * (u.norm() + v.norm())));
    if !inside || u.norm().min(v.norm()) < MIN_SIDE {
        return None;
    }
    let middle = (a + b + c + d) / 4.0;
    let mean = |radius: f64, from: Vec2| {
        let around = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];
        let at = |(x, y): (f64, f64)| level.interpolate(&(from + (u * x + v * y) * radius));
        around.map(at).iter().sum::<f64>() / 4.0
    };
    let disc = mean(0.4 * Board::MARK_RADIUS, middle);
    let black = mean(0.33, middle);
    // Beyond each side there is white.
    let white = mean(0.75, middle);
    if white - black < MIN_CONTRAST {
        return None;
    }
    let part = (disc - black) / (white - black);
    if part > MIN_MARK { Some(true) } else { (part < MAX_PLAIN).then_some(false) }
}
