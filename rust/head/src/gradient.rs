//! Deformation transfer: what a key does to each triangle of one head, done to the triangles of another.
//!
//! # Entry points
//! - [`GradientTransfer::new`]: rest frames of the generic head's skin.
//! - [`GradientTransfer::carry`]: one key's offsets for the person.
//!
//! After Sumner and Popović (Deformation Transfer for Triangle Meshes, 2004): a key's displacement gradient on a generic
//! triangle is applied to the person's edges, and offsets are found that have these differences along all edges. A jaw
//! that turns rigidly thus turns the person's jaw rigidly, whatever its shape. Two things are added: pairs of vertices
//! that touch keep together, and over long ways the offsets keep to given ones.

use crate::HeadError;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side, prelude::Solve};
use geometry::{Mat3, Vec3, mesh};

/// Way over which gradients count more than given offsets, metres.
const WAY: f64 = 0.04;
/// Triangles flatter than this (twice their area over their longest side squared) have no gradient to speak of.
const FLAT: f64 = 0.02;
/// Weight of a pair that touches, against an edge.
const TOUCH: f64 = 2.0;
const OUTSIDE: u32 = u32::MAX;

/// Rest frames of the generic head's skin.
pub struct GradientTransfer<'a> {
    generic: &'a [Vec3],
    basis: &'a [Vec3],
    /// Triangles that have a gradient, with the inverse of their rest frames.
    triangles: Vec<([u32; 3], Mat3)>,
    /// Their edges, with the number of triangles at each.
    edges: Vec<([u32; 2], f64)>,
    /// Squared lengths of the edges round each vertex, summed: how far a vertex is from the others.
    spacing: Vec<f64>,
    /// Pairs that touch.
    pairs: &'a [[u32; 2]],
}

impl<'a> GradientTransfer<'a> {
    /// From generic to person (`basis`): `quads` of the skin, whose vertices come first, and pairs of vertices that touch.
    pub fn new(generic: &'a [Vec3], basis: &'a [Vec3], quads: &[[u32; 4]], pairs: &'a [[u32; 2]]) -> Self {
        let corners = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d], [b, c, d], [b, d, a]]);
        let triangles: Vec<([u32; 3], Mat3)> =
            corners.filter_map(|t| Some((t, frame(t.map(|v| generic[v as usize]))?.try_inverse()?))).collect();
        let mut sides: Vec<[u32; 2]> = triangles.iter().flat_map(|(t, _)| edges(t)).collect();
        sides.iter_mut().for_each(|e| e.sort_unstable());
        sides.sort_unstable();
        let edges: Vec<([u32; 2], f64)> =
            sides.chunk_by(|a, b| a == b).map(|same| (same[0], same.len() as f64)).collect();
        let mut spacing = vec![0.0; generic.len()];
        for ([a, b], count) in &edges {
            let square = (generic[*a as usize] - generic[*b as usize]).norm_squared() * count;
            spacing[*a as usize] += square;
            spacing[*b as usize] += square;
        }
        Self { generic, basis, triangles, edges, spacing, pairs }
    }

    /// Offsets for the person's `region` (ascending vertices of the skin: all that the key moves there) from the generic
    /// offsets; `near` are the offsets to keep to over long ways, `linear` takes a difference of two touching vertices.
    ///
    /// # Errors
    /// [`HeadError::Degenerate`] when positions are no numbers.
    pub fn carry(
        &self,
        region: &[u32],
        offsets: &[Vec3],
        near: &[Vec3],
        linear: impl Fn(u32) -> Mat3,
    ) -> Result<Vec<Vec3>, HeadError> {
        let mut slots = vec![OUTSIDE; self.generic.len()];
        region.iter().enumerate().for_each(|(i, &v)| slots[v as usize] = i as u32);
        let given = |v: usize| if slots[v] == OUTSIDE { Vec3::zeros() } else { offsets[slots[v] as usize] };
        let slots_of = |e: &[u32; 2]| e.map(|v| slots[v as usize]);
        let mut system = System::new(region.len());
        for (edge, count) in &self.edges {
            system.join(slots_of(edge), *count);
        }
        for (t, inverse) in self.triangles.iter().filter(|(t, _)| t.iter().any(|&v| slots[v as usize] != OUTSIDE)) {
            let gradient = self.gradient(t, inverse, &given);
            for e in edges(t) {
                let [a, b] = e.map(|v| self.basis[v as usize]);
                system.want(slots_of(&e), gradient * (a - b));
            }
        }
        for pair in self.pairs {
            let [a, b] = pair.map(|v| given(v as usize));
            system.join(slots_of(pair), TOUCH);
            system.want(slots_of(pair), linear(pair[0]) * (a - b) * TOUCH);
        }
        for (i, (v, offset)) in region.iter().zip(near).enumerate() {
            let weight = self.spacing[*v as usize] / (WAY * WAY) + 1e-9;
            system.join([i as u32, OUTSIDE], weight);
            system.want([i as u32, OUTSIDE], offset * weight);
        }
        system.solve()
    }

    /// Displacement gradient of a key on a generic triangle.
    fn gradient(&self, t: &[u32; 3], inverse: &Mat3, given: &impl Fn(usize) -> Vec3) -> Mat3 {
        let moved = t.map(|v| self.generic[v as usize] + given(v as usize));
        // Flattened by the key: its old normal will do.
        let after = frame(moved).unwrap_or_else(|| {
            let (a, b) = (moved[1] - moved[0], moved[2] - moved[0]);
            let rest = t.map(|v| self.generic[v as usize]);
            Mat3::from_columns(&[a, b, normal(&rest)])
        });
        after * inverse - Mat3::identity()
    }
}

fn edges(t: &[u32; 3]) -> [[u32; 2]; 3] {
    [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]
}

/// Two sides of a triangle and its normal, as long as the root of its area; `None` for a sliver.
fn frame(p: [Vec3; 3]) -> Option<Mat3> {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    let longest = a.norm_squared().max(b.norm_squared()).max((b - a).norm_squared());
    (a.cross(&b).norm() > FLAT * longest).then(|| Mat3::from_columns(&[a, b, normal(&p)]))
}

fn normal(p: &[Vec3; 3]) -> Vec3 {
    let doubled = mesh::area_normal(p, &[0, 1, 2]);
    doubled / doubled.norm().sqrt().max(1e-30)
}

/// Normal equations of wanted differences between unknowns; those outside are zero.
struct System {
    triplets: Vec<Triplet<usize, usize, f64>>,
    right: Mat<f64>,
}

impl System {
    fn new(n: usize) -> Self {
        Self { triplets: Vec::with_capacity(16 * n), right: Mat::zeros(n, 3) }
    }

    /// Weight of a difference.
    fn join(&mut self, slots: [u32; 2], weight: f64) {
        let inside = slots.map(|s| (s != OUTSIDE).then_some(s as usize));
        self.triplets.extend(inside.into_iter().flatten().map(|i| Triplet::new(i, i, weight)));
        if let [Some(i), Some(j)] = inside {
            self.triplets.push(Triplet::new(i.max(j), i.min(j), -weight));
        }
    }

    /// What a difference should be, times its weight.
    fn want(&mut self, slots: [u32; 2], wanted: Vec3) {
        for (slot, sign) in slots.into_iter().zip([1.0, -1.0]).filter(|(slot, _)| *slot != OUTSIDE) {
            (0..3).for_each(|k| self.right[(slot as usize, k)] += wanted[k] * sign);
        }
    }

    /// Lower triangles only are filled in.
    fn solve(self) -> Result<Vec<Vec3>, HeadError> {
        let n = self.right.nrows();
        let degenerate = || HeadError::Degenerate { place: "skin".to_owned() };
        let matrix =
            SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &self.triplets).map_err(|_| degenerate())?;
        let solution = matrix.sp_cholesky(Side::Lower).map_err(|_| degenerate())?.solve(&self.right);
        let field: Vec<Vec3> = (0..n).map(|i| Vec3::from_fn(|k, _| solution[(i, k)])).collect();
        if field.iter().all(|d| d.iter().all(|x| x.is_finite())) { Ok(field) } else { Err(degenerate()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// A wavy strip of 30 × 6 quads, 3 mm each, and a wider, bumpier one.
    fn strips() -> (Vec<Vec3>, Vec<Vec3>, Vec<[u32; 4]>) {
        let place = |i: u32, j: u32, width: f64, wave: f64| {
            Vec3::new(f64::from(i) * 0.003, f64::from(j) * width, wave * (f64::from(i) * 0.4).sin())
        };
        let cells = || (0..31_u32).flat_map(|i| (0..7_u32).map(move |j| (i, j)));
        let quads = (0..30_u32).flat_map(|i| (0..6_u32).map(move |j| [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]]));
        (
            cells().map(|(i, j)| place(i, j, 0.003, 0.002)).collect(),
            cells().map(|(i, j)| place(i, j, 0.004, 0.004)).collect(),
            quads.map(|q| q.map(|[i, j]| i * 7 + j)).collect(),
        )
    }

    /// The far half turned by 0.4 about its near edge.
    fn hinge(points: &[Vec3]) -> (Vec<u32>, Vec<Vec3>) {
        let turn = Rotation3::from_axis_angle(&Vec3::y_axis(), -0.4);
        let region: Vec<u32> = (0..points.len() as u32).filter(|v| v / 7 > 15).collect();
        let pivot = Vec3::new(0.045, 0.0, 0.0);
        let offsets =
            region.iter().map(|&v| turn * (points[v as usize] - pivot) - (points[v as usize] - pivot)).collect();
        (region, offsets)
    }

    #[test]
    fn the_same_head_gets_the_same_offsets() {
        let (generic, _, quads) = strips();
        let (region, offsets) = hinge(&generic);
        let transfer = GradientTransfer::new(&generic, &generic, &quads, &[]);
        let carried = transfer.carry(&region, &offsets, &offsets, |_| Mat3::identity()).unwrap();
        assert!(carried.iter().zip(&offsets).all(|(a, b)| (a - b).norm() < 1e-11));
    }

    #[test]
    fn what_turns_rigidly_turns_another_shape_rigidly() {
        let (generic, person, quads) = strips();
        let (region, offsets) = hinge(&generic);
        let transfer = GradientTransfer::new(&generic, &person, &quads, &[]);
        let stretched: Vec<Vec3> = offsets.iter().map(|d| Vec3::new(d.x, d.y * 4.0 / 3.0, d.z * 1.5)).collect();
        let carried = transfer.carry(&region, &offsets, &stretched, |_| Mat3::identity()).unwrap();
        let mut worst: f64 = 0.0;
        for pair in (0..region.len()).collect::<Vec<_>>().windows(8).map(|w| [w[0], w[7]]) {
            let rest = person[region[pair[0]] as usize] - person[region[pair[1]] as usize];
            let moved = rest + carried[pair[0]] - carried[pair[1]];
            worst = worst.max((moved.norm() / rest.norm() - 1.0).abs());
        }
        assert!(worst < 0.12, "{worst}");
    }
}
