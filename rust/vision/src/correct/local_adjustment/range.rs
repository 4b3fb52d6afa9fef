//! In which range a match may lie, as its neighbours on its lines tell.

use super::super::Match;
use super::lines::Neighbour;
use geometry::Vec2;

/// Fewer neighbours than this tell nothing about a match.
const FEWEST: usize = 2;

/// Where a match may be.
pub(super) struct Range {
    /// The neighbours' shift: the median along each axis, near neighbours weigh more.
    pub shift: Vec2,
    /// How far from it the match may be along either axis, pixels.
    pub reach: f64,
}

impl Range {
    /// Around the shift of the neighbours, wider where they are farther away; `None` without any.
    pub fn settle(u: &Vec2, near: &[Neighbour], matches: &[Match], slack_px: f64, gradient: f64) -> Option<Self> {
        if near.is_empty() {
            return None;
        }
        let distance = |n: &Neighbour| (matches[n.index].a - u).norm();
        let median = |value: &dyn Fn(&Neighbour) -> f64, weight: &dyn Fn(&Neighbour) -> f64| {
            weighted_median(near.iter().map(|n| (value(n), weight(n))).collect())
        };
        let closeness = |n: &Neighbour| 1.0 / distance(n).max(1.0);
        let shift = |axis: usize| median(&|n| matches[n.index].b[axis] - matches[n.index].a[axis], &closeness);
        Some(Self { shift: Vec2::new(shift(0), shift(1)), reach: slack_px + gradient * median(&distance, &|_| 1.0) })
    }
}

/// Which part of the neighbours contradicts a match: its shift and theirs differ by more than `slack_px`, and `gradient`
/// of their distance beyond it. None of fewer than [`FEWEST`].
pub(super) fn contradictions(m: &Match, near: &[Neighbour], matches: &[Match], slack_px: f64, gradient: f64) -> f64 {
    let contradicts = |n: &&Neighbour| {
        let other = &matches[n.index];
        ((other.b - other.a) - (m.b - m.a)).norm() > slack_px + gradient * (other.a - m.a).norm()
    };
    let count = near.iter().filter(contradicts).count();
    if near.len() < FEWEST { 0.0 } else { count as f64 / near.len() as f64 }
}

/// The value with half of the weight on either side; zero of nothing.
fn weighted_median(mut values: Vec<(f64, f64)>) -> f64 {
    values.sort_by(|x, y| x.0.total_cmp(&y.0));
    let half = 0.5 * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    let middle = values.iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    middle.map_or(0.0, |(value, _)| *value)
}
