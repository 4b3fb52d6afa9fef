//! Growing a lattice over saddle points.
//!
//! A seed of four saddles around one square is extended cell by cell: a local homography of the cells already known
//! predicts the next one, and the saddle found there must have its edges along the lattice, and its bright and dark
//! sectors swapped against its neighbours', as on a checkerboard.

use super::lattice::{Cell, Lattice, Prediction};
use super::saddles::Saddle;
use geometry::{Pattern, Vec2};
use std::f64::consts::PI;

/// A prediction may miss by this part of the local spacing.
const PREDICTION_TOLERANCE: f64 = 0.3;
/// An edge may deviate from the lattice's direction by this angle, radians.
const DIRECTION_TOLERANCE: f64 = 0.45;
/// A seed's neighbour lies within this angle, radians, of the edge that leads to it.
const SEED_CONE: f64 = 0.26;
/// A seed's neighbour is at least this part as strong as the seed.
const SEED_STRENGTH: f64 = 0.2;
/// Neighbours of a square differ at most this much in distance.
const MAX_SIDE_RATIO: f64 = 5.0;

/// The largest lattice over `saddles`, grown from the strongest seeds; stops at the first that is `enough`.
pub(super) fn grow(saddles: &[Saddle], max_seeds: usize, enough: impl Fn(&Lattice) -> bool) -> Option<Lattice> {
    let mut used = vec![false; saddles.len()];
    let mut best: Option<Lattice> = None;
    for seed in 0..saddles.len().min(max_seeds) {
        if used[seed] {
            continue;
        }
        let Some(mut growth) = Growth::seeded(saddles, seed) else { continue };
        growth.extend();
        growth.taken.iter().zip(&mut used).for_each(|(taken, used)| *used |= taken);
        if enough(&growth.lattice) {
            return Some(growth.lattice);
        }
        if best.as_ref().is_none_or(|b| growth.lattice.cells.len() > b.cells.len()) {
            best = Some(growth.lattice);
        }
    }
    best
}

/// A lattice that grows over saddles.
struct Growth<'a> {
    saddles: &'a [Saddle],
    taken: Vec<bool>,
    lattice: Lattice,
    /// Which of a saddle's edges runs along the columns' axis in even cells.
    even_edge: usize,
}

impl<'a> Growth<'a> {
    /// The four saddles of a square that has its corner at `seed`.
    fn seeded(saddles: &'a [Saddle], seed: usize) -> Option<Self> {
        let origin = &saddles[seed];
        for (first, second) in [(0.0, 0.0), (PI, 0.0), (PI, PI), (0.0, PI)] {
            let Some(a) = seed_neighbour(saddles, origin, 0, first) else { continue };
            let Some(b) = seed_neighbour(saddles, origin, 1, second) else { continue };
            let (u, v) = (saddles[a].position - origin.position, saddles[b].position - origin.position);
            let ratio = u.norm() / v.norm();
            if !(1.0 / MAX_SIDE_RATIO..MAX_SIDE_RATIO).contains(&ratio) {
                continue;
            }
            let (even_edge, right, down) = if u.perp(&v) > 0.0 { (0, a, b) } else { (1, b, a) };
            let lattice = Lattice::new(Pattern::Checkerboard, even_edge == 1, []);
            let mut growth = Self { saddles, taken: vec![false; saddles.len()], lattice, even_edge };
            growth.add((0, 0), seed);
            growth.add((1, 0), right);
            growth.add((0, 1), down);
            if let Some(diagonal) = growth.find((1, 1)) {
                growth.add((1, 1), diagonal);
                return Some(growth);
            }
        }
        None
    }

    fn add(&mut self, cell: Cell, saddle: usize) {
        self.taken[saddle] = true;
        self.lattice.cells.insert(cell, self.saddles[saddle].position);
    }

    /// Adds cells next to known ones until none is found.
    fn extend(&mut self) {
        let mut frontier: Vec<Cell> = self.lattice.cells.keys().copied().collect();
        while !frontier.is_empty() {
            let mut added = Vec::new();
            for (i, j) in frontier {
                for next in [(i + 1, j), (i, j + 1), (i - 1, j), (i, j - 1)] {
                    if self.lattice.cells.contains_key(&next) {
                        continue;
                    }
                    if let Some(found) = self.find(next).filter(|&k| !self.taken[k]) {
                        self.add(next, found);
                        added.push(next);
                    }
                }
            }
            frontier = added;
        }
    }

    /// The saddle at `cell`, if there is one that fits its neighbours.
    fn find(&self, cell: Cell) -> Option<usize> {
        let Prediction { position, u, v } = self.lattice.predict(cell)?;
        let tolerance = PREDICTION_TOLERANCE * u.norm().min(v.norm());
        let nearest = self
            .saddles
            .iter()
            .enumerate()
            .map(|(k, s)| (k, (s.position - position).norm_squared()))
            .filter(|&(k, squared)| squared < tolerance * tolerance && self.is_aligned(&self.saddles[k], cell, &u, &v))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(nearest.0)
    }

    fn is_aligned(&self, saddle: &Saddle, (i, j): Cell, u: &Vec2, v: &Vec2) -> bool {
        let edge = if (i + j).rem_euclid(2) == 0 { self.even_edge } else { 1 - self.even_edge };
        let (along, across) = (direction(u), direction(v));
        let fit = line_angle(saddle.edges[edge], along).max(line_angle(saddle.edges[1 - edge], across));
        let swapped = line_angle(saddle.edges[1 - edge], along).max(line_angle(saddle.edges[edge], across));
        fit < DIRECTION_TOLERANCE && fit < swapped
    }
}

/// The nearest saddle along one of a saddle's edges (turned by `turn`) that has its sectors swapped.
fn seed_neighbour(saddles: &[Saddle], origin: &Saddle, edge: usize, turn: f64) -> Option<usize> {
    let angle = origin.edges[edge] + turn;
    let along = Vec2::new(angle.cos(), angle.sin());
    let cone = SEED_CONE.tan();
    let distance = |s: &Saddle| (s.position - origin.position).norm();
    let candidates = saddles.iter().enumerate().filter(|(_, s)| {
        let d = s.position - origin.position;
        let forward = along.dot(&d);
        forward > 2.0
            && along.perp(&d).abs() < cone * forward
            && s.strength > SEED_STRENGTH * origin.strength
            && line_angle(s.edges[1 - edge], angle) < DIRECTION_TOLERANCE
    });
    candidates.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1))).map(|(k, _)| k)
}

fn direction(v: &Vec2) -> f64 {
    v.y.atan2(v.x)
}

/// Angle between two lines, 0…π/2.
fn line_angle(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(PI);
    d.min(PI - d)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Saddles of a board of `columns × rows` seen by a strong homography, with strays around it.
    fn scene(columns: i32, rows: i32) -> Vec<Saddle> {
        let place = |i: f64, j: f64| {
            let w = 1.0 + 0.05 * i + 0.02 * j;
            Vec2::new(40.0 + 22.0 * i - 3.0 * j, 30.0 + 4.0 * i + 19.0 * j) / w
        };
        let mut saddles = Vec::new();
        for j in 0..rows {
            for i in 0..columns {
                let (x, y) = (f64::from(i), f64::from(j));
                let u = direction(&(place(x + 0.5, y) - place(x - 0.5, y)));
                let v = direction(&(place(x, y + 0.5) - place(x, y - 0.5)));
                let edges = if (i + j) % 2 == 0 { [v, u + PI] } else { [u, v] };
                saddles.push(Saddle { position: place(x, y), strength: 10.0, edges });
            }
        }
        for k in 0..40 {
            let t = f64::from(k);
            let position = Vec2::new(300.0 + 90.0 * (t * 1.7).sin(), 200.0 + 80.0 * (t * 2.9).cos());
            saddles.push(Saddle { position, strength: 12.0, edges: [t, t + 1.5] });
        }
        saddles.sort_by(|a, b| b.strength.total_cmp(&a.strength));
        saddles
    }

    #[test]
    fn grows_over_the_whole_board_among_strays() {
        let saddles = scene(9, 6);
        let lattice = grow(&saddles, 100, |l| l.cells.len() >= 54).unwrap();
        assert_eq!(lattice.cells.len(), 54);
        let (i, j) = *lattice.cells.keys().next().unwrap();
        let (last_i, last_j) = *lattice.cells.keys().next_back().unwrap();
        assert_eq!((last_i - i + 1) * (last_j - j + 1), 54);
        for (&(i, j), position) in &lattice.cells {
            let right = lattice.cells.get(&(i + 1, j)).map(|r| r - position);
            let down = lattice.cells.get(&(i, j + 1)).map(|d| d - position);
            assert!(right.zip(down).is_none_or(|(u, v)| u.perp(&v) > 0.0));
            assert_ne!(lattice.is_black_before((i, j)), lattice.is_black_before((i + 1, j)));
        }
    }

    #[test]
    fn no_squares_no_lattice() {
        let strays: Vec<Saddle> = scene(0, 0);
        assert!(grow(&strays, 100, |_| false).is_none_or(|l| l.cells.len() < 9));
    }
}
