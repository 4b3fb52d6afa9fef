//! Which vertex lies on the other side of the head.
//!
//! # Entry points
//! [`mirror_map`], [`reflect`].
//!
//! The base mesh is symmetric to the last digit, so that a vertex's partner is the vertex at its reflection. Where lips or
//! cards touch, several vertices share that place: the quads decide.

use anyhow::bail;
use geometry::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// The vertex on the other side, for every vertex of a symmetric mesh (plane x = 0).
///
/// # Errors
/// When a vertex has no partner within `tolerance` (unit of the positions), or the quads are not symmetric.
pub fn mirror_map(positions: &[Vec3], quads: &[[u32; 4]], tolerance: f64) -> anyhow::Result<Vec<u32>> {
    let cell = |p: &Vec3| [p.x, p.y, p.z].map(|x| (x / tolerance).floor() as i64);
    let mut grid: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    for (i, p) in positions.iter().enumerate() {
        grid.entry(cell(p)).or_default().push(i as u32);
    }
    let mut mirror = Vec::with_capacity(positions.len());
    for (i, p) in positions.iter().enumerate() {
        let target = flip(p);
        let home = cell(&target);
        let around = (0..27).map(|k| [home[0] + k % 3 - 1, home[1] + k / 3 % 3 - 1, home[2] + k / 9 - 1]);
        let candidates = around.filter_map(|c| grid.get(&c)).flatten();
        let distance = |j: &u32| (positions[*j as usize] - target).norm();
        match candidates.min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b))) {
            Some(&j) if distance(&j) <= tolerance => mirror.push(j),
            _ => bail!("vertex {i} of the base mesh has no mirror image"),
        }
    }
    check(&mirror, quads)?;
    Ok(mirror)
}

fn check(mirror: &[u32], quads: &[[u32; 4]]) -> anyhow::Result<()> {
    if let Some(i) = (0..mirror.len()).find(|&i| mirror[mirror[i] as usize] as usize != i) {
        bail!("the mirror image of vertex {i}'s mirror image is another vertex");
    }
    let sorted = |mut q: [u32; 4]| {
        q.sort_unstable();
        q
    };
    let all: BTreeSet<[u32; 4]> = quads.iter().map(|q| sorted(*q)).collect();
    if !quads.iter().all(|q| all.contains(&sorted(q.map(|v| mirror[v as usize])))) {
        bail!("the quads of the base mesh are not symmetric");
    }
    Ok(())
}

/// A point's mirror image.
pub fn flip(p: &Vec3) -> Vec3 {
    Vec3::new(-p.x, p.y, p.z)
}

/// The mirror image of a whole head, with the vertices in their usual order.
pub fn reflect(positions: &[Vec3], mirror: &[u32]) -> Vec<Vec3> {
    mirror.iter().map(|&j| flip(&positions[j as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symmetric_strip_maps_onto_itself() {
        let positions: Vec<Vec3> = [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [-1.0, 1.0], [0.0, 1.0], [1.0, 1.0]]
            .map(|p| Vec3::new(p[0], p[1], 0.3))
            .to_vec();
        let quads = [[0, 1, 4, 3], [1, 2, 5, 4]];
        let mirror = mirror_map(&positions, &quads, 1e-3).unwrap();
        assert_eq!(mirror, [2, 1, 0, 5, 4, 3]);
        assert_eq!(reflect(&positions, &mirror), positions);
        assert!(mirror_map(&positions, &quads[..1], 1e-3).is_err(), "one quad without its image");
        assert!(mirror_map(&positions[..5], &[], 1e-3).is_err(), "one vertex without its image");
    }
}
