//! The mesh divided once, on whose vertices is measured: vertices, middles of edges, middles of quads.

use geometry::{Mat3, Vec3, mesh};
use nalgebra::{Matrix3x2, Vector2};

/// Skin bends no more than the wing of a nose, one over metres.
const SHARPEST: f64 = 250.0;

/// Places on quads, each a mixture of their corners.
pub(crate) struct Fine {
    /// Up to four vertices of the mesh and their weights.
    pub(crate) stencils: Vec<([u32; 4], [f64; 4])>,
    /// Neighbouring places.
    pub(crate) rings: Vec<Vec<u32>>,
    /// Quads of the places, four of each quad of the mesh, and their corners' places in it: quad, (u, v) of each corner.
    pub(crate) quads: Vec<[u32; 4]>,
}

impl Fine {
    /// Of a mesh of so many vertices: they come first, then one place for each edge and each quad.
    pub(crate) fn of(vertices: usize, quads: &[[u32; 4]]) -> Self {
        let edges = mesh::quad_edges(quads);
        let alone = (0..vertices as u32).map(|v| ([v; 4], [1.0, 0.0, 0.0, 0.0]));
        let halves = edges.iter().map(|&[a, b]| ([a, b, a, a], [0.5, 0.5, 0.0, 0.0]));
        let middles = quads.iter().map(|q| (*q, [0.25; 4]));
        let stencils: Vec<_> = alone.chain(halves).chain(middles).collect();
        let edge = |a: u32, b: u32| {
            let found = edges.binary_search(&[a.min(b), a.max(b)]).unwrap_or_default();
            (vertices + found) as u32
        };
        let divide = |(i, q): (usize, &[u32; 4])| {
            let middle = (vertices + edges.len() + i) as u32;
            (0..4).map(|k| [q[k], edge(q[k], q[(k + 1) % 4]), middle, edge(q[(k + 3) % 4], q[k])]).collect::<Vec<_>>()
        };
        let divided: Vec<[u32; 4]> = quads.iter().enumerate().flat_map(divide).collect();
        let rings = mesh::neighbours(stencils.len(), &mesh::quad_edges(&divided));
        Self { stencils, rings, quads: divided }
    }

    /// What the vertices have, at all places.
    pub(crate) fn spread<T: std::iter::Sum + std::ops::Mul<f64, Output = T> + Copy>(&self, values: &[T]) -> Vec<T> {
        let mix = |(corners, weights): &([u32; 4], [f64; 4])| {
            corners.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(&c, &w)| values[c as usize] * w).sum()
        };
        self.stencils.iter().map(mix).collect()
    }
}

/// How a surface bends at each vertex: `dn = -K dx`, a tensor in the head frame, from the normals of its neighbours.
pub(crate) fn curvatures(positions: &[Vec3], normals: &[Vec3], rings: &[Vec<u32>]) -> Vec<Mat3> {
    let tensor = |v: usize| {
        let axes = tangents(&normals[v]);
        // Least squares for the three numbers of a symmetric matrix.
        let (mut left, mut right) = (Mat3::identity() * 1e-12, Vec3::zeros());
        for &j in &rings[v] {
            let step = axes.transpose() * (positions[j as usize] - positions[v]);
            let turn = axes.transpose() * (normals[j as usize] - normals[v]);
            for (row, turned) in [(Vec3::new(step.x, step.y, 0.0), turn.x), (Vec3::new(0.0, step.x, step.y), turn.y)] {
                left += row * row.transpose();
                right -= row * turned;
            }
        }
        let k = left.try_inverse().map_or_else(Vec3::zeros, |inverse| inverse * right);
        let k = k.map(|x| x.clamp(-SHARPEST, SHARPEST));
        axes * nalgebra::Matrix2::new(k.x, k.y, k.y, k.z) * axes.transpose()
    };
    (0..positions.len()).map(tensor).collect()
}

/// Two directions at right angles to a normal and to each other.
pub(crate) fn tangents(normal: &Vec3) -> Matrix3x2<f64> {
    let least = normal.iamin();
    let first = normal.cross(&Vec3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 }));
    let first = first.try_normalize(1e-12).unwrap_or_else(Vec3::x);
    Matrix3x2::from_columns(&[first, normal.cross(&first)])
}

/// The height of a surface over its tangent plane.
pub(crate) fn height(curvature: &nalgebra::Matrix2<f64>, at: &Vector2<f64>) -> f64 {
    // The normal of z = ½ xᵀ K x is (-K x, 1).
    0.5 * at.dot(&(curvature * at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_quads_of_each_have_their_corners_where_they_should() {
        let positions = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|p| Vec3::new(p[0], p[1], 0.0));
        let fine = Fine::of(4, &[[0, 1, 2, 3]]);
        let places = fine.spread(&positions);
        assert_eq!((places.len(), fine.quads.len()), (9, 4));
        for quad in &fine.quads {
            let [a, b, c, d] = quad.map(|v| places[v as usize]);
            assert!(((b - a).cross(&(d - a)).z - 0.25).abs() < 1e-12 && (c - b - d + a).norm() < 1e-12);
        }
    }

    #[test]
    fn a_ball_bends_by_one_over_its_radius() {
        let radius = 0.05;
        let ring = |k: usize| Vec3::new(0.06 * (k as f64).cos(), 0.06 * (k as f64).sin(), 1.0).normalize();
        let normals: Vec<Vec3> = std::iter::once(Vec3::z()).chain((0..6).map(ring)).collect();
        let positions: Vec<Vec3> = normals.iter().map(|n| n * radius).collect();
        let mut rings = vec![Vec::new(); 7];
        rings[0] = (1..7).collect();
        let bend = curvatures(&positions, &normals, &rings)[0];
        let axes = tangents(&normals[0]);
        let plane = axes.transpose() * bend * axes;
        // Outward normals spread: the surface falls away from its tangent plane.
        assert!((plane + nalgebra::Matrix2::identity() / radius).norm() < 0.2, "{plane}");
        assert!(height(&plane, &Vector2::new(0.01, 0.0)) < 0.0);
    }
}
