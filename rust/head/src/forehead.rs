//! Foreheads without a hollow.
//!
//! Few corners lie on the smooth skin of a forehead and many on its hair line; what is drawn through them sinks in between. From the ridge of
//! the brows to the crown a forehead is round or flat, except where the generic one is hollow too.
//!
//! # Entry point
//! [`fill_forehead`]

use crate::GenericHead;
use geometry::face_mesh::BROWS_UPPER;
use geometry::{Vec3, mesh, smooth_step};

/// The forehead begins so far above the brows and all of it counts from there on, metres on the generic head …
const BROWS: (f64, f64) = (0.004, 0.010);
/// … it ends in the crown …
const CROWN: (f64, f64) = (0.085, 0.105);
/// … and at the temples, where heads are hollow, metres from the middle …
const TEMPLES: (f64, f64) = (0.058, 0.045);
/// … and in front of the ears.
const BEHIND: (f64, f64) = (-0.06, -0.04);
/// Rounds: a hollow as wide as a forehead, some ten rows of vertices, is filled after the square of its rows.
const ROUNDS: usize = 1000;
/// What is left of a hollow, metres: a rounding error of what artists see.
const FLAT: f64 = 2e-6;

/// Fills what is hollow from the brows to the crown, along the way up, in `positions` (all vertices, metres).
pub fn fill_forehead(generic: &GenericHead, positions: &mut [Vec3]) {
    let columns = columns(generic);
    let allowed: Vec<f64> = columns.iter().map(|c| c.sag(&generic.positions, &c.normal).max(0.0)).collect();
    let normals = mesh::vertex_normals(positions, &generic.triangles(generic.skin()));
    for _ in 0..ROUNDS {
        let steps: Vec<f64> = columns
            .iter()
            .zip(&allowed)
            .map(|(c, allowed)| c.share * (c.sag(positions, &normals[c.vertex]) - allowed).max(0.0))
            .collect();
        if steps.iter().all(|step| *step < FLAT) {
            break;
        }
        columns.iter().zip(&steps).for_each(|(c, step)| positions[c.vertex] += normals[c.vertex] * *step);
    }
}

/// A vertex of the forehead with its neighbours above and below.
struct Column {
    vertex: usize,
    above: usize,
    below: usize,
    /// Part of the way from `below` to `above` at which it lies.
    at: f64,
    normal: Vec3,
    share: f64,
}

impl Column {
    /// How far the skin lies below the chord of its neighbours, metres along a normal.
    fn sag(&self, positions: &[Vec3], normal: &Vec3) -> f64 {
        let chord = positions[self.below].lerp(&positions[self.above], self.at);
        normal.dot(&(chord - positions[self.vertex]))
    }
}

fn columns(generic: &GenericHead) -> Vec<Column> {
    let place = &generic.positions;
    let brows = BROWS_UPPER.iter().flatten().filter_map(|&i| generic.anchors.get(i));
    let brows = brows.map(|a| mesh::at_barycentric(place, &a.triangle, &a.weights).y).fold(f64::MIN, f64::max);
    let normals = mesh::vertex_normals(place, &generic.triangles(generic.skin()));
    let edges = mesh::quad_edges(&generic.quads[generic.skin().quads.clone()]);
    let rings = mesh::neighbours(place.len(), &edges);
    let share = |p: &Vec3| {
        smooth_step(BROWS.0, BROWS.1, p.y - brows)
            * smooth_step(CROWN.1, CROWN.0, p.y)
            * smooth_step(TEMPLES.0, TEMPLES.1, p.x.abs())
            * smooth_step(BEHIND.0, BEHIND.1, p.z)
    };
    let column = |vertex: usize| {
        let (p, ring) = (&place[vertex], &rings[vertex]);
        let share = share(p);
        // The neighbours that go most nearly straight up and down.
        let rise = |&n: &u32| {
            let way = place[n as usize] - p;
            way.y / way.norm()
        };
        let above = *ring.iter().max_by(|a, b| rise(a).total_cmp(&rise(b)))? as usize;
        let below = *ring.iter().min_by(|a, b| rise(a).total_cmp(&rise(b)))? as usize;
        let (up, down) = ((place[above] - p).norm(), (p - place[below]).norm());
        let is_forehead = share > 0.0 && !generic.cavity[vertex] && above != below;
        is_forehead.then(|| Column { vertex, above, below, at: down / (up + down), normal: normals[vertex], share })
    };
    generic.skin().vertices.clone().filter_map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{asset, person};

    /// A forehead dented by `depth` metres.
    fn dented(positions: &[Vec3], depth: f64) -> Vec<Vec3> {
        let dent = |p: &Vec3| depth * (-((p.y - 0.045) / 0.012).powi(2)).exp() * smooth_step(0.07, 0.02, p.x.abs());
        let front = |p: &Vec3| smooth_step(-0.05, -0.02, p.z);
        positions.iter().map(|p| p - Vec3::z() * (dent(p) * front(p))).collect()
    }

    fn deepest_sag(generic: &GenericHead, positions: &[Vec3]) -> f64 {
        let columns = columns(generic);
        let sag = |c: &Column| {
            let allowed = c.sag(&generic.positions, &c.normal).max(0.0);
            c.share.floor() * (c.sag(positions, &c.normal) - allowed)
        };
        columns.iter().map(sag).fold(f64::MIN, f64::max)
    }

    #[test]
    fn a_dent_is_filled_and_no_more_than_that() {
        let Some(generic) = asset() else { return };
        let mut head = dented(&generic.positions, 0.006);
        let before = head.clone();
        assert!(deepest_sag(&generic, &before) > 1e-3);
        fill_forehead(&generic, &mut head);
        assert!(deepest_sag(&generic, &head) < 2e-4, "{}", deepest_sag(&generic, &head));
        let off = head.iter().zip(&generic.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 0.0035, "{off}");
        assert!(head.iter().zip(&before).all(|(a, b)| a == b || a.z > b.z - 1e-4));
    }

    #[test]
    fn round_foreheads_are_left_alone() {
        let Some(generic) = asset() else { return };
        let mut head = generic.positions.clone();
        fill_forehead(&generic, &mut head);
        assert_eq!(head, generic.positions);
        for seed in 0..4 {
            let before = person(&generic, seed, 1.0, 0.0);
            let mut filled = before.clone();
            fill_forehead(&generic, &mut filled);
            let moved = filled.iter().zip(&before).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(moved < 0.0015, "seed {seed}: {moved}");
        }
    }
}
