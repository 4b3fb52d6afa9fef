//! Which points share a line, and which matches cross on it.

use super::super::Match;
use geometry::Vec2;

/// Points on either side along a line that bound a match and tell where it is expected.
const SIDE: usize = 2;

/// A point on the same line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbour {
    /// Which point.
    pub index: usize,
    /// Along which axis the line runs: 0 a row, 1 a column.
    pub axis: usize,
    /// How far along the axis it is, pixels of `a`.
    pub along: f64,
}

/// Lines through every point: along its row and along its column, as high and wide as the band. Two points share the
/// line along the axis on which they are farther apart: on the other one their order says nothing.
pub(super) struct Lines(Vec<Vec<Neighbour>>);

impl Lines {
    /// Lines through the points of `a`; one that is not finite is on none.
    pub fn new(matches: &[Match], band_px: f64) -> Self {
        let neighbour = |m: &Match, index: usize| {
            let apart = matches[index].a - m.a;
            let axis = usize::from(apart.x.abs() < apart.y.abs());
            let shared = apart[axis] != 0.0 && apart[1 - axis].abs() <= 0.5 * band_px;
            shared.then_some(Neighbour { index, axis, along: apart[axis] })
        };
        let of = |m: &Match| {
            let mut line: Vec<Neighbour> = (0..matches.len()).filter_map(|index| neighbour(m, index)).collect();
            line.sort_by(|m, n| m.along.abs().total_cmp(&n.along.abs()));
            line
        };
        Self(matches.iter().map(of).collect())
    }

    /// Everyone on the lines of a point, the nearest first.
    pub fn of(&self, i: usize) -> &[Neighbour] {
        &self.0[i]
    }

    /// The nearest on either side along both lines among those that `sound` accepts.
    pub fn nearest(&self, i: usize, sound: impl Fn(usize) -> bool) -> Vec<Neighbour> {
        let mut found = [0; 4];
        let mut take = |n: &&Neighbour| {
            let side = &mut found[2 * n.axis + usize::from(n.along > 0.0)];
            *side += usize::from(*side <= SIDE);
            *side <= SIDE
        };
        self.of(i).iter().filter(|n| sound(n.index)).filter(|n| take(n)).copied().collect()
    }
}

/// Whether `b` is on the other side of a neighbour than `a` is, or beside it.
pub(super) fn crosses(b: &Vec2, neighbour: &Neighbour, matches: &[Match]) -> bool {
    (matches[neighbour.index].b[neighbour.axis] - b[neighbour.axis]) * neighbour.along.signum() <= 0.0
}
