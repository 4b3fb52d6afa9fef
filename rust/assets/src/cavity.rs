//! How much of the world each place of the skin sees: the cavity mask and the ambient light.
//!
//! # Entry points
//! [`openness`], [`cavity`].
//!
//! Mouth bag, eye sockets and the insides of nostrils and ears are part of the one closed skin, but no camera sees them:
//! landmarks, points and texture must keep away from there.

use crate::bvh::Bvh;
use geometry::{Vec3, mesh};
use head::{Part, part};
use rayon::prelude::*;

/// A triangle that sees less than this part of its hemisphere is no outside.
const CAVITY_OPENNESS: f64 = 0.12;
/// Rays start this far above the skin, in parts of the head's breadth.
const LIFT: f64 = 1e-4;

/// The cosine-weighted share of the hemisphere that each skin triangle sees past skin, eyes, teeth and tongue, tried in
/// `count` directions over the whole sphere.
pub fn openness(positions: &[Vec3], quads: &[[u32; 4]], parts: &[Part], count: usize) -> Vec<f64> {
    let solid = parts.iter().filter(|p| p.name != part::LASHES).map(|p| p.quads.end).max().unwrap_or(0);
    let triangles = mesh::triangulate(&quads[..solid]);
    let tree = Bvh::new(positions, &triangles);
    let directions = sphere(count);
    let breadth = positions.iter().map(|p| p.x).fold(0.0, f64::max);
    let skin = 2 * parts[0].quads.end;
    triangles[..skin]
        .par_iter()
        .map(|triangle| {
            let normal = mesh::area_normal(positions, triangle).try_normalize(0.0).unwrap_or_else(Vec3::z);
            let origin = mesh::at_barycentric(positions, triangle, &[1.0 / 3.0; 3]) + normal * (LIFT * breadth);
            let (mut free, mut all) = (0.0, 0.0);
            for direction in directions.iter().filter(|d| d.dot(&normal) > 0.05) {
                let cosine = direction.dot(&normal);
                all += cosine;
                free += if tree.occluded(&origin, direction) { 0.0 } else { cosine };
            }
            free / all
        })
        .collect()
}

/// Skin vertices all of whose triangles are hidden; `openness` as from [`openness`], one entry per vertex of the head.
pub fn cavity(vertex_count: usize, quads: &[[u32; 4]], openness: &[f64]) -> Vec<bool> {
    let mut best = vec![f64::MAX; vertex_count];
    for (triangle, &open) in mesh::triangulate(&quads[..openness.len() / 2]).iter().zip(openness) {
        for &v in triangle {
            let seen = &mut best[v as usize];
            *seen = if *seen == f64::MAX { open } else { seen.max(open) };
        }
    }
    best.iter().map(|&open| open <= CAVITY_OPENNESS).collect()
}

/// Evenly spread unit vectors (a spiral of Fibonacci's angle), together with their mirror images in x.
pub fn sphere(count: usize) -> Vec<Vec3> {
    let angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / (count / 2) as f64;
        let (radius, turn) = ((1.0 - z * z).sqrt(), angle * i as f64);
        Vec3::new(radius * turn.cos(), radius * turn.sin(), z)
    };
    (0..count / 2).map(point).flat_map(|p| [p, Vec3::new(-p.x, p.y, p.z)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A deep box open at the top, and a plate far beside it; both are skin.
    fn well() -> (Vec<Vec3>, Vec<[u32; 4]>, Vec<Part>) {
        let mut positions: Vec<Vec3> = Vec::new();
        for z in [0.0, 4.0] {
            positions.extend([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|p| Vec3::new(p[0], p[1], z)));
        }
        positions.extend([[8.0, 0.0], [9.0, 0.0], [9.0, 1.0], [8.0, 1.0]].map(|p| Vec3::new(p[0], p[1], 4.0)));
        let mut quads: Vec<[u32; 4]> = (0..4).map(|k| [(k + 1) % 4, k, 4 + k, 4 + (k + 1) % 4]).collect();
        quads.extend([[0, 1, 2, 3], [8, 9, 10, 11]]);
        let skin = Part { name: part::SKIN.to_owned(), vertices: 0..12, quads: 0..6 };
        (positions, quads, vec![skin])
    }

    #[test]
    fn the_bottom_of_a_well_is_a_cavity_and_a_plate_is_not() {
        let (positions, quads, parts) = well();
        let open = openness(&positions, &quads, &parts, 240);
        assert!(open[8] < 0.1 && open[9] < 0.1 && open[10] > 0.99 && open[11] > 0.99, "{open:?}");
        assert!(open[..8].iter().all(|o| (0.001..0.5).contains(o)), "the walls see a little: {open:?}");
    }

    #[test]
    fn a_vertex_is_hidden_when_all_around_it_is() {
        let quads = [[0, 1, 4, 3], [1, 2, 5, 4]];
        let flags = cavity(7, &quads, &[0.05, 0.02, 0.4, 0.1]);
        assert_eq!(flags, [true, false, false, true, true, false, false]);
    }

    #[test]
    fn directions_are_balanced() {
        let sum: Vec3 = sphere(240).iter().sum();
        assert!(sum.norm() < 1.0, "{sum}");
    }
}
