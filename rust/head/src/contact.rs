//! Small corrections of a key that make surfaces meet or keep apart, spread smoothly over what the key moves.
//!
//! # Entry point
//! [`spread`]: the smoothest field of corrections with given values at some vertices, zero where the key moves nothing.

use crate::HeadError;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side, prelude::Solve};
use geometry::Vec3;

/// Weight of a wanted correction against smoothness.
const FIRMNESS: f64 = 1e4;
/// Corrections for the vertices of `region` (ascending): as smooth as the given `wanted` values allow (the least squared
/// Laplacian), the smaller where `reluctance` is larger, and zero outside the region.
///
/// # Errors
/// [`HeadError::Degenerate`] when the wanted values are no numbers.
pub fn spread(
    rings: &[Vec<u32>],
    region: &[u32],
    reluctance: &[f64],
    wanted: &[(u32, Vec3)],
) -> Result<Vec<Vec3>, HeadError> {
    let n = region.len();
    let slot = |v: u32| region.binary_search(&v).ok();
    let mut triplets = laplacian_squared(rings, region);
    let mut right = Mat::<f64>::zeros(n, 3);
    for (i, r) in reluctance.iter().enumerate() {
        triplets.push(Triplet::new(i, i, r + 1e-9));
    }
    for (v, value) in wanted {
        if let Some(i) = slot(*v) {
            triplets.push(Triplet::new(i, i, FIRMNESS));
            (0..3).for_each(|k| right[(i, k)] += FIRMNESS * value[k]);
        }
    }
    let degenerate = || HeadError::Degenerate { place: "eyes and mouth".to_owned() };
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &triplets).map_err(|_| degenerate())?;
    let solution = matrix.sp_cholesky(Side::Lower).map_err(|_| degenerate())?.solve(&right);
    let field: Vec<Vec3> = (0..n).map(|i| Vec3::from_fn(|k, _| solution[(i, k)])).collect();
    if field.iter().all(|d| d.iter().all(|x| x.is_finite())) { Ok(field) } else { Err(degenerate()) }
}

/// `LᵀL` over the region, where `L` takes each vertex of it and of its surroundings from its neighbours' mean.
fn laplacian_squared(rings: &[Vec<u32>], region: &[u32]) -> Vec<Triplet<usize, usize, f64>> {
    let mut rows: Vec<u32> = region.iter().flat_map(|&v| rings[v as usize].iter().copied().chain([v])).collect();
    rows.sort_unstable();
    rows.dedup();
    let mut triplets = Vec::new();
    for v in rows {
        let ring = &rings[v as usize];
        let share = -1.0 / ring.len().max(1) as f64;
        let entries = ring.iter().map(|&w| (w, share)).chain([(v, 1.0)]);
        let row: Vec<(usize, f64)> = entries.filter_map(|(w, x)| Some((region.binary_search(&w).ok()?, x))).collect();
        for &(i, x) in &row {
            triplets.extend(row.iter().map(|&(j, y)| Triplet::new(i, j, x * y)));
        }
    }
    triplets
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(side: u32) -> Vec<Vec<u32>> {
        let quads: Vec<[u32; 4]> = (0..side - 1)
            .flat_map(|j| (0..side - 1).map(move |i| [0, 1, side + 1, side].map(|k| j * side + i + k)))
            .collect();
        geometry::mesh::neighbours((side * side) as usize, &geometry::mesh::quad_edges(&quads))
    }

    #[test]
    fn a_wanted_value_is_met_and_fades_out_to_the_border_of_the_region() {
        let rings = grid(21);
        let inner = |v: &u32| (2..19).contains(&(v % 21)) && (2..19).contains(&(v / 21));
        let region: Vec<u32> = (0..441).filter(inner).collect();
        let middle = 10 * 21 + 10;
        let field = spread(&rings, &region, &vec![0.0; region.len()], &[(middle, Vec3::x())]).unwrap();
        let at = |v: u32| field[region.binary_search(&v).unwrap()].x;
        assert!((at(middle) - 1.0).abs() < 1e-3, "{}", at(middle));
        assert!(at(middle + 2) > at(middle + 4) && at(middle + 4) > at(middle + 6) && at(middle + 8).abs() < 0.1);
        assert!(field.iter().all(|d| d.y == 0.0));
    }

    #[test]
    fn nothing_wanted_moves_nothing() {
        let rings = grid(5);
        let field = spread(&rings, &[6, 7, 8], &[0.1; 3], &[(7, Vec3::zeros()), (0, Vec3::x())]).unwrap();
        assert!(field.iter().all(|d| *d == Vec3::zeros()));
    }

    #[test]
    fn rubbish_is_refused() {
        let rings = grid(3);
        assert!(spread(&rings, &[4], &[0.0], &[(4, Vec3::repeat(f64::NAN))]).is_err());
    }
}
