//! A first flat embedding without folds: every inner vertex in the mean of its neighbours, the border on a rectangle.
//!
//! For a planar 3-connected graph with its border on a convex polygon all faces come out convex (Tutte, How to draw a
//! graph, 1963), so both diagonals of every quad are good.

use super::seams::Half;
use geometry::{Vec2, Vec3, mesh};

/// An axis-parallel rectangle of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Lower left corner.
    pub min: [f64; 2],
    /// Upper right corner.
    pub max: [f64; 2],
}

impl Rect {
    /// Its width times its height.
    pub fn area(&self) -> f64 {
        (self.max[0] - self.min[0]) * (self.max[1] - self.min[1])
    }

    /// Corners at the starts of the sides left (downwards), bottom, right and top.
    fn corners(&self) -> [Vec2; 4] {
        let ([l, b], [r, t]) = (self.min, self.max);
        [Vec2::new(l, t), Vec2::new(l, b), Vec2::new(r, b), Vec2::new(r, t)]
    }
}

/// Which coordinates of each vertex may move: sides slide along themselves, corners stay.
pub(super) fn freedom(half: &Half) -> Vec<[bool; 2]> {
    let mut free = vec![[true; 2]; half.vertices.len()];
    for (k, side) in half.sides.iter().enumerate() {
        for &v in side {
            free[v as usize][k % 2] = false;
        }
    }
    free
}

/// Tutte's embedding of a half island on its rectangle; sides are spaced by `density` times length.
pub(super) fn tutte(half: &Half, positions: &[Vec3], density: &[f64], rect: &Rect) -> Vec<Vec2> {
    let n = half.vertices.len();
    let mut uv = vec![Vec2::new((rect.min[0] + rect.max[0]) / 2.0, (rect.min[1] + rect.max[1]) / 2.0); n];
    let corners = rect.corners();
    let mut border = vec![false; n];
    for (k, side) in half.sides.iter().enumerate() {
        let step = |e: &[u32]| {
            let [a, b] = [e[0] as usize, e[1] as usize];
            (positions[a] - positions[b]).norm() * (density[a] + density[b])
        };
        let total: f64 = side.windows(2).map(step).sum();
        let mut along = 0.0;
        for (i, &v) in side.iter().enumerate() {
            if i > 0 {
                along += step(&side[i - 1..=i]) / total;
            }
            uv[v as usize] = corners[k] + (corners[(k + 1) % 4] - corners[k]) * along.min(1.0);
            border[v as usize] = true;
        }
    }
    let rings = mesh::neighbours(n, &half.edges());
    average(&rings, &border, &mut uv);
    uv
}

/// Solves "inner vertices in the mean of their neighbours" by conjugate gradients, preconditioned with the valence.
fn average(rings: &[Vec<u32>], border: &[bool], uv: &mut [Vec2]) {
    let apply = |x: &[Vec2]| -> Vec<Vec2> {
        let row = |(i, ring): (usize, &Vec<u32>)| match border[i] {
            true => Vec2::zeros(),
            false => ring.iter().fold(x[i] * ring.len() as f64, |sum, &j| sum - x[j as usize]),
        };
        rings.iter().enumerate().map(row).collect()
    };
    let scaled =
        |r: &[Vec2]| -> Vec<Vec2> { r.iter().zip(rings).map(|(r, ring)| r / ring.len().max(1) as f64).collect() };
    // The two coordinates are independent systems with one matrix: their inner products are kept apart.
    let dot = |a: &[Vec2], b: &[Vec2]| a.iter().zip(b).fold(Vec2::zeros(), |s, (a, b)| s + a.component_mul(b));
    let mut residual: Vec<Vec2> = apply(uv).iter().map(|r| -r).collect();
    let mut preconditioned = scaled(&residual);
    let mut direction = preconditioned.clone();
    let mut energy = dot(&residual, &preconditioned);
    let goal = energy * 1e-28;
    for _ in 0..10 * rings.len() {
        if energy.x <= goal.x && energy.y <= goal.y {
            break;
        }
        let image = apply(&direction);
        let curvature = dot(&direction, &image);
        let step = energy.zip_map(&curvature, |e, c| if c > 0.0 { e / c } else { 0.0 });
        for i in 0..uv.len() {
            uv[i] += direction[i].component_mul(&step);
            residual[i] -= image[i].component_mul(&step);
        }
        preconditioned = scaled(&residual);
        let next = dot(&residual, &preconditioned);
        let keep = next.zip_map(&energy, |n, e| if e > 0.0 { n / e } else { 0.0 });
        for (d, p) in direction.iter_mut().zip(&preconditioned) {
            *d = p + d.component_mul(&keep);
        }
        energy = next;
    }
}
