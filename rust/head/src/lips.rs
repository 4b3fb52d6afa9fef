//! Lips that touch at rest.
//!
//! The class and the free deformation move upper and lower lip apart by what the measurements err; a person who keeps the
//! mouth shut while filmed has lips that touch. [`close_lips`] brings the generic head's contact pairs together again and
//! lets the skin around follow smoothly.

use crate::contact::spread;
use crate::{GenericHead, HeadError};
use geometry::{Vec3, mesh};
use std::collections::BTreeMap;

/// Skin within this of the lips follows, metres on the generic head.
const REACH: f64 = 0.03;

/// Moves the skin of `positions` (all vertices) so that the lips touch as they do on the generic head.
///
/// # Errors
/// [`HeadError::Degenerate`] when the positions are no numbers.
pub fn close_lips(generic: &GenericHead, positions: &mut [Vec3]) -> Result<(), HeadError> {
    let wanted = corrections(generic, positions);
    if wanted.is_empty() {
        return Ok(());
    }
    let lips: Vec<Vec3> = wanted.iter().map(|(v, _)| generic.positions[*v as usize]).collect();
    let near = |v: &usize| lips.iter().any(|l| (generic.positions[*v] - l).norm() < REACH);
    let skin = generic.skin();
    let region: Vec<u32> = skin.vertices.clone().filter(near).map(|v| v as u32).collect();
    let edges = mesh::quad_edges(&generic.quads[skin.quads.clone()]);
    let rings = mesh::neighbours(generic.positions.len(), &edges);
    let field = spread(&rings, &region, &vec![0.0; region.len()], &wanted)?;
    for (v, d) in region.iter().zip(field) {
        positions[*v as usize] += d;
    }
    Ok(())
}

/// What each contact vertex must move, half of its pair's error; a vertex of several pairs takes their mean.
fn corrections(generic: &GenericHead, positions: &[Vec3]) -> Vec<(u32, Vec3)> {
    let mut sums: BTreeMap<u32, (Vec3, f64)> = BTreeMap::new();
    for &[upper, lower] in &generic.lip_contacts {
        let apart = |p: &[Vec3]| p[upper as usize] - p[lower as usize];
        let error = apart(positions) - apart(&generic.positions);
        for (vertex, share) in [(upper, -0.5), (lower, 0.5)] {
            let sum = sums.entry(vertex).or_insert((Vec3::zeros(), 0.0));
            *sum = (sum.0 + error * share, sum.1 + 1.0);
        }
    }
    sums.into_iter().map(|(v, (sum, n))| (v, sum / n)).collect()
}
