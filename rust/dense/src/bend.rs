//! Displacements of a mesh that agree with measurements and bend as little as they can.

use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side, prelude::Solve};
use geometry::Vec3;

/// Edge for which a bend's standard deviation is given, metres.
const EDGE: f64 = 0.004;
/// Rounds of weighing measurements by how far they are off.
const ROUNDS: usize = 3;
/// Measurements farther off than this many standard deviations count little.
const FAR: f64 = 2.5;

/// A measured displacement: of a mixture of vertices, with its standard deviation, metres.
pub(crate) struct Datum {
    pub(crate) stencil: ([u32; 4], [f64; 4]),
    pub(crate) value: f64,
    pub(crate) sigma: f64,
}

/// How displacements behave where nothing is measured.
pub(crate) struct Stiffness {
    /// Standard deviation of a vertex from the mean of its neighbours, for edges of 4 mm, metres.
    pub(crate) bend: f64,
    /// Standard deviation from zero, of each vertex, metres.
    pub(crate) rest: Vec<f64>,
}

/// The displacement of each vertex; `None` where positions are no numbers. Robust: data that disagree with their neighbours lose weight,
/// which is returned for each, 0…1.
pub(crate) fn solve(
    positions: &[Vec3],
    rings: &[Vec<u32>],
    data: &[Datum],
    stiffness: &Stiffness,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let prior = bending(positions, rings, stiffness);
    let mut trust = vec![1.0; data.len()];
    let mut found = vec![0.0; positions.len()];
    for _ in 0..ROUNDS {
        found = once(&prior, positions.len(), data, &trust)?;
        for (trust, datum) in trust.iter_mut().zip(data) {
            let off = (value_at(&datum.stencil, &found) - datum.value) / (FAR * datum.sigma);
            *trust = 1.0 / (1.0 + off * off).powi(2);
        }
    }
    Some((found, trust))
}

pub(crate) fn value_at((corners, weights): &([u32; 4], [f64; 4]), of: &[f64]) -> f64 {
    corners.iter().zip(weights).map(|(&c, w)| of[c as usize] * w).sum()
}

/// A term of the lower triangle of a matrix.
type Term = Triplet<usize, usize, f64>;

/// The prior's matrix, some of its elements in several terms.
fn bending(positions: &[Vec3], rings: &[Vec<u32>], stiffness: &Stiffness) -> Vec<Term> {
    let mut terms = Vec::with_capacity(20 * positions.len());
    for (v, ring) in rings.iter().enumerate() {
        terms.push(Triplet::new(v, v, stiffness.rest[v].powi(-2)));
        if ring.is_empty() {
            continue;
        }
        let count = ring.len() as f64;
        let edge = ring.iter().map(|&j| (positions[j as usize] - positions[v]).norm()).sum::<f64>() / count;
        let weight = (EDGE / (edge.max(1e-5) * stiffness.bend)).powi(2);
        let row: Vec<(usize, f64)> =
            std::iter::once((v, 1.0)).chain(ring.iter().map(|&j| (j as usize, -1.0 / count))).collect();
        for &(i, a) in &row {
            terms.extend(row.iter().filter(|(j, _)| *j <= i).map(|&(j, b)| Triplet::new(i, j, weight * a * b)));
        }
    }
    terms
}

fn once(prior: &[Term], count: usize, data: &[Datum], trust: &[f64]) -> Option<Vec<f64>> {
    let mut triplets = prior.to_vec();
    let mut right = Mat::<f64>::zeros(count, 1);
    for (datum, trust) in data.iter().zip(trust) {
        let weight = trust / (datum.sigma * datum.sigma);
        let (corners, weights) = &datum.stencil;
        let terms = || corners.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(&c, &w)| (c as usize, w));
        for (i, a) in terms() {
            right[(i, 0)] += weight * a * datum.value;
            triplets.extend(terms().filter(|(j, _)| *j <= i).map(|(j, b)| Triplet::new(i, j, weight * a * b)));
        }
    }
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &triplets).ok()?;
    let solution = matrix.sp_cholesky(Side::Lower).ok()?.solve(&right);
    let found: Vec<f64> = (0..count).map(|i| solution[(i, 0)]).collect();
    found.iter().all(|x| x.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::mesh;

    const SIDE: u32 = 21;

    fn sheet() -> (Vec<Vec3>, Vec<Vec<u32>>) {
        let positions: Vec<Vec3> =
            (0..SIDE * SIDE).map(|i| Vec3::new(f64::from(i % SIDE), f64::from(i / SIDE), 0.0) * 0.004).collect();
        let cell = |i: u32| [i, i + 1, i + SIDE + 1, i + SIDE];
        let quads: Vec<[u32; 4]> = (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE < SIDE - 1).map(cell).collect();
        (positions.clone(), mesh::neighbours(positions.len(), &mesh::quad_edges(&quads)))
    }

    fn stiffness(count: usize) -> Stiffness {
        Stiffness { bend: 1e-4, rest: vec![0.003; count] }
    }

    fn datum(v: u32, value: f64) -> Datum {
        Datum { stencil: ([v; 4], [1.0, 0.0, 0.0, 0.0]), value, sigma: 1e-4 }
    }

    #[test]
    fn a_bump_is_followed_and_one_wild_measurement_is_not() {
        let (positions, rings) = sheet();
        let bump = |p: &Vec3| 4e-4 * (-((p - Vec3::new(0.04, 0.04, 0.0)).norm() / 0.012).powi(2)).exp();
        let mut data: Vec<Datum> = positions.iter().zip(0..).map(|(p, v)| datum(v, bump(p))).collect();
        data[10 * SIDE as usize + 4].value += 0.002;
        let (found, trust) = solve(&positions, &rings, &data, &stiffness(positions.len())).unwrap();
        let worst = positions.iter().zip(&found).map(|(p, f)| (f - bump(p)).abs()).fold(0.0, f64::max);
        assert!(worst < 5e-5, "{worst}");
        assert!(trust[10 * SIDE as usize + 4] < 0.01 && trust[0] > 0.8);
    }

    #[test]
    fn what_is_not_measured_continues_and_comes_to_rest() {
        let (positions, rings) = sheet();
        let left = (0..SIDE * SIDE).filter(|i| i % SIDE < 8);
        let data: Vec<Datum> = left.map(|v| datum(v, 3e-4)).collect();
        let (found, _) = solve(&positions, &rings, &data, &stiffness(positions.len())).unwrap();
        let middle = |column: u32| found[(10 * SIDE + column) as usize];
        assert!((1e-4..3e-4).contains(&middle(9)) && middle(20).abs() < 5e-5, "{} {}", middle(9), middle(20));
    }

    #[test]
    fn nothing_measured_moves_nothing() {
        let (positions, rings) = sheet();
        let (found, _) = solve(&positions, &rings, &[], &stiffness(positions.len())).unwrap();
        assert!(found.iter().all(|f| *f == 0.0));
    }
}
