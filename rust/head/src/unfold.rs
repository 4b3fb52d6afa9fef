//! Skin without a triangle turned over.
//!
//! # Entry point
//! [`unfold`]: where a triangle of the visible skin shows its back, its corners take the place that their neighbours give them on the
//! generic head (Laplacian coordinates, Sorkine 2004), until none does.

use crate::GenericHead;
use geometry::{Similarity, Vec3, mesh};
use std::collections::BTreeSet;

/// A triangle turned against the generic one by more than this is as good as turned over, cosine: 84 degrees.
const LEAST_COSINE: f64 = 0.1;
/// Most often that corners are moved: folds of the size of an eye are smooth by then.
const ROUNDS: usize = 40;

/// Unfolds the visible skin of `positions` (all vertices, metres); the number of triangles that are turned over all the same.
pub fn unfold(generic: &GenericHead, positions: &mut [Vec3]) -> usize {
    let triangles = generic.outer_skin();
    let Some(form) = placed(generic, positions) else { return triangles.len() };
    let edges: BTreeSet<[u32; 2]> =
        triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])).collect();
    let edges: Vec<[u32; 2]> = edges.into_iter().collect();
    let rings = mesh::neighbours(generic.positions.len(), &edges);
    let mut folded = BTreeSet::new();
    for _ in 0..ROUNDS {
        let back = |t: &&[u32; 3]| {
            let (wanted, found) = (mesh::area_normal(&form, t), mesh::area_normal(positions, t));
            wanted.dot(&found) < LEAST_COSINE * wanted.norm() * found.norm()
        };
        folded = triangles.iter().filter(back).flatten().copied().collect();
        if folded.is_empty() {
            break;
        }
        let place = |v: usize| {
            let ring = &rings[v];
            let sum: Vec3 = ring.iter().map(|&n| positions[n as usize] + form[v] - form[n as usize]).sum();
            sum / ring.len().max(1) as f64
        };
        let moved: Vec<(usize, Vec3)> = folded.iter().map(|&v| (v as usize, place(v as usize))).collect();
        moved.into_iter().for_each(|(v, place)| positions[v] = place);
    }
    folded.len()
}

/// The generic head laid onto a person's.
fn placed(generic: &GenericHead, positions: &[Vec3]) -> Option<Vec<Vec3>> {
    let skin: Vec<usize> = generic.skin().vertices.clone().filter(|&v| !generic.cavity[v]).collect();
    let pick = |of: &[Vec3]| skin.iter().map(|&v| of[v]).collect::<Vec<_>>();
    let fit = Similarity::fit(&pick(&generic.positions), &pick(positions), None, true)?;
    Some(generic.positions.iter().map(|p| fit.apply(p)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::testing::toy_head;
    use crate::testing::{asset, person};

    #[test]
    fn turned_triangles_are_turned_back_and_the_rest_stays() {
        let head = toy_head();
        let mut folded: Vec<Vec3> = head.positions.iter().map(|p| p * 1.1).collect();
        let front = (0..folded.len()).max_by(|&a, &b| head.positions[a].z.total_cmp(&head.positions[b].z)).unwrap();
        let far = folded[front] + Vec3::new(0.03, 0.02, 0.0);
        folded[front] = far;
        let before = folded.clone();
        assert_eq!(unfold(&head, &mut folded), 0);
        assert!((folded[front] - head.positions[front] * 1.1).norm() < 0.004);
        let moved = (0..folded.len()).filter(|&v| folded[v] != before[v]).count();
        assert!(moved < 40, "{moved} of {}", folded.len());
    }

    #[test]
    fn a_person_without_folds_is_left_alone() {
        let Some(generic) = asset() else { return };
        let mut head = person(&generic, 3, 0.8, 0.0);
        let before = head.clone();
        assert_eq!(unfold(&generic, &mut head), 0);
        let moved = head.iter().zip(&before).filter(|(a, b)| a != b).count();
        assert!(moved < 30, "{moved}");
    }
}
