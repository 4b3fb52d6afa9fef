//! Growing a lattice over saddle points.
//!
//! A seed of four saddles around one square is extended cell by cell: a local homography of the cells already known
//! predicts the next one, and the saddle found there must have its edges along the lattice, and its bright and dark
//! sectors swapped against its neighbours', as on a checkerboard.

use super::saddles::Saddle;
use geometry::Vec2;
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;
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
/// Cells within this many steps tell where the next one is.
const PREDICTION_REACH: i32 = 3;

/// Column and row of a corner; negative before the seed.
pub(super) type Cell = (i32, i32);

/// Saddles in lattice order: right-handed, from columns to rows as from x to y of the picture.
pub(super) struct Lattice {
    /// Index of the saddle of each cell.
    pub(super) cells: BTreeMap<Cell, usize>,
    /// Which of a saddle's edges runs along the columns' axis in even cells.
    even_edge: usize,
}

/// The largest lattice over `saddles`, grown from the strongest seeds; stops at the first that has `enough`.
pub(super) fn grow(saddles: &[Saddle], max_seeds: usize, enough: impl Fn(&Lattice) -> bool) -> Option<Lattice> {
    let mut used = vec![false; saddles.len()];
    let mut best: Option<Lattice> = None;
    for seed in 0..saddles.len().min(max_seeds) {
        if used[seed] {
            continue;
        }
        let Some(mut lattice) = Lattice::seeded(saddles, seed) else { continue };
        lattice.extend(saddles);
        lattice.cells.values().for_each(|&i| used[i] = true);
        if enough(&lattice) {
            return Some(lattice);
        }
        if best.as_ref().is_none_or(|b| lattice.cells.len() > b.cells.len()) {
            best = Some(lattice);
        }
    }
    best
}

impl Lattice {
    /// Whether the square before `cell` in both directions is black.
    pub(super) fn is_black_before(&self, cell: Cell) -> bool {
        self.column_edge(cell) == 1
    }

    fn column_edge(&self, (i, j): Cell) -> usize {
        if (i + j).rem_euclid(2) == 0 { self.even_edge } else { 1 - self.even_edge }
    }

    /// The four saddles of a square that has its corner at `seed`.
    fn seeded(saddles: &[Saddle], seed: usize) -> Option<Self> {
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
            let mut lattice = Self { cells: BTreeMap::new(), even_edge };
            lattice.cells.extend([((0, 0), seed), ((1, 0), right), ((0, 1), down)]);
            if let Some(diagonal) = lattice.find(saddles, (1, 1)) {
                lattice.cells.insert((1, 1), diagonal);
                return Some(lattice);
            }
        }
        None
    }

    /// Adds cells next to known ones until none is found.
    fn extend(&mut self, saddles: &[Saddle]) {
        let mut taken = vec![false; saddles.len()];
        self.cells.values().for_each(|&i| taken[i] = true);
        let mut frontier: Vec<Cell> = self.cells.keys().copied().collect();
        while !frontier.is_empty() {
            let mut added = Vec::new();
            for (i, j) in frontier {
                for next in [(i + 1, j), (i, j + 1), (i - 1, j), (i, j - 1)] {
                    if self.cells.contains_key(&next) {
                        continue;
                    }
                    if let Some(found) = self.find(saddles, next).filter(|&k| !taken[k]) {
                        taken[found] = true;
                        self.cells.insert(next, found);
                        added.push(next);
                    }
                }
            }
            frontier = added;
        }
    }

    /// The saddle at `cell`, if there is one that fits its neighbours.
    fn find(&self, saddles: &[Saddle], cell: Cell) -> Option<usize> {
        let Prediction { position, u, v } = self.predict(saddles, cell)?;
        let tolerance = PREDICTION_TOLERANCE * u.norm().min(v.norm());
        let nearest = saddles
            .iter()
            .enumerate()
            .map(|(k, s)| (k, (s.position - position).norm()))
            .filter(|&(k, distance)| distance < tolerance && self.is_aligned(&saddles[k], cell, &u, &v))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(nearest.0)
    }

    fn is_aligned(&self, saddle: &Saddle, cell: Cell, u: &Vec2, v: &Vec2) -> bool {
        let edge = self.column_edge(cell);
        let (along, across) = (direction(u), direction(v));
        let fit = line_angle(saddle.edges[edge], along).max(line_angle(saddle.edges[1 - edge], across));
        let swapped = line_angle(saddle.edges[1 - edge], along).max(line_angle(saddle.edges[edge], across));
        fit < DIRECTION_TOLERANCE && fit < swapped
    }

    /// Where `cell` lies by the homography of the known cells around it, or by their affinity while they are few.
    pub(super) fn predict(&self, saddles: &[Saddle], (i, j): Cell) -> Option<Prediction> {
        let mut near: Vec<(Vec2, Vec2)> = Vec::with_capacity(48);
        let (mut columns, mut rows) = ((i32::MAX, i32::MIN), (i32::MAX, i32::MIN));
        for dj in -PREDICTION_REACH..=PREDICTION_REACH {
            for di in -PREDICTION_REACH..=PREDICTION_REACH {
                if let Some(&k) = self.cells.get(&(i + di, j + dj)) {
                    near.push((Vec2::new(f64::from(di), f64::from(dj)), saddles[k].position));
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
}

/// Where the origin of a local lattice lies, and one step along its columns' (`u`) and rows' (`v`) axes, pixels.
pub(super) struct Prediction {
    pub(super) position: Vec2,
    pub(super) u: Vec2,
    pub(super) v: Vec2,
}

impl Prediction {
    /// Least squares of `x (h₇ i + h₈ j + 1) = h₁ i + h₂ j + h₃`, the same for `y`, over cells `(i, j)`.
    fn by_homography(near: &[(Vec2, Vec2)]) -> Option<Self> {
        let centre = near.iter().map(|n| n.1).sum::<Vec2>() / near.len() as f64;
        let (mut normal, mut right) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
        for (cell, position) in near {
            let (i, j, p) = (cell.x, cell.y, position - centre);
            for (row, value) in [
                ([i, j, 1.0, 0.0, 0.0, 0.0, -p.x * i, -p.x * j], p.x),
                ([0.0, 0.0, 0.0, i, j, 1.0, -p.y * i, -p.y * j], p.y),
            ] {
                let row = SVector::<f64, 8>::from(row);
                normal += row * row.transpose();
                right += row * value;
            }
        }
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
        for (&(i, j), &k) in &lattice.cells {
            let right = lattice.cells.get(&(i + 1, j)).map(|&r| saddles[r].position - saddles[k].position);
            let down = lattice.cells.get(&(i, j + 1)).map(|&d| saddles[d].position - saddles[k].position);
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
