//! A tree of boxes over triangles: what a ray meets first, and the closest point of a surface.
//!
//! # Entry points
//! [`Bvh::new`], [`Bvh::cast`], [`Bvh::occluded`], [`Bvh::closest`].

use geometry::{Vec3, mesh};

/// Triangles of a leaf.
const LEAF: usize = 4;

/// A tree over the triangles of a mesh.
pub struct Bvh {
    nodes: Vec<Node>,
    corners: Vec<[Vec3; 3]>,
    /// Number in the caller's list of each triangle, in tree order.
    order: Vec<u32>,
}

struct Node {
    low: Vec3,
    high: Vec3,
    /// First triangle of a leaf, or the right child; the left child follows its parent.
    start: u32,
    /// Triangles of a leaf, 0 for an inner node.
    count: u32,
}

/// A place on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Triangle, as numbered by the caller.
    pub triangle: usize,
    /// Barycentric weights.
    pub weights: [f64; 3],
    /// Distance along the ray, or from the point asked for.
    pub distance: f64,
}

impl Bvh {
    /// Builds the tree by halving along the longest axis.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corners = |t: &u32| triangles[*t as usize].map(|v| positions[v as usize]);
        let centres: Vec<Vec3> = (0..triangles.len() as u32).map(|t| corners(&t).iter().sum::<Vec3>() / 3.0).collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut tree = Self { nodes: Vec::new(), corners: Vec::new(), order: Vec::new() };
        if !order.is_empty() {
            tree.split(&mut order, 0, &centres, &corners);
        }
        tree.corners = order.iter().map(corners).collect();
        tree.order = order;
        tree
    }

    fn split(&mut self, order: &mut [u32], start: usize, centres: &[Vec3], corners: &impl Fn(&u32) -> [Vec3; 3]) {
        let points = || order.iter().flat_map(corners);
        let low = points().fold(Vec3::repeat(f64::MAX), |a, b| a.inf(&b));
        let high = points().fold(Vec3::repeat(f64::MIN), |a, b| a.sup(&b));
        let leaf = order.len() <= LEAF;
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, start: start as u32, count: if leaf { order.len() as u32 } else { 0 } });
        if leaf {
            return;
        }
        let axis = (high - low).imax();
        order.sort_by(|&a, &b| centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b)));
        let (left, right) = order.split_at_mut(order.len() / 2);
        self.split(left, start, centres, corners);
        self.nodes[node].start = self.nodes.len() as u32;
        self.split(right, start + left.len(), centres, corners);
    }

    /// Where every walk begins: the root, or nowhere.
    fn root(&self) -> Vec<usize> {
        if self.nodes.is_empty() { Vec::new() } else { vec![0] }
    }

    /// What a ray meets first of the triangles that face it; `direction` is of unit length.
    pub fn cast(&self, origin: &Vec3, direction: &Vec3) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.walk(origin, direction, |tree, range, reach| {
            for i in range {
                let [a, b, c] = &tree.corners[i];
                if (b - a).cross(&(c - a)).dot(direction) >= 0.0 {
                    continue;
                }
                if let Some((distance, weights)) = mesh::intersect_ray(origin, direction, &tree.corners[i])
                    && distance < *reach
                {
                    *reach = distance;
                    best = Some(Hit { triangle: tree.order[i] as usize, weights, distance });
                }
            }
            false
        });
        best
    }

    /// Whether a ray meets any triangle, from the front or the back.
    pub fn occluded(&self, origin: &Vec3, direction: &Vec3) -> bool {
        let mut met = false;
        self.walk(origin, direction, |tree, mut range, _| {
            met = range.any(|i| mesh::intersect_ray(origin, direction, &tree.corners[i]).is_some());
            met
        });
        met
    }

    /// Visits the leaves along a ray; the visitor shortens the reach and says whether to stop.
    fn walk(
        &self,
        origin: &Vec3,
        direction: &Vec3,
        mut visit: impl FnMut(&Self, std::ops::Range<usize>, &mut f64) -> bool,
    ) {
        let inverse = direction.map(|d| 1.0 / d);
        let (mut stack, mut reach) = (self.root(), f64::MAX);
        while let Some(i) = stack.pop() {
            let node = &self.nodes[i];
            let (a, b) = ((node.low - origin).component_mul(&inverse), (node.high - origin).component_mul(&inverse));
            let (near, far) = (a.inf(&b).max(), a.sup(&b).min());
            if near > far || far < 0.0 || near > reach {
                continue;
            }
            if node.count > 0 {
                let start = node.start as usize;
                if visit(self, start..start + node.count as usize, &mut reach) {
                    return;
                }
            } else {
                stack.extend([node.start as usize, i + 1]);
            }
        }
    }

    /// The closest point of the surface; `None` for a mesh without triangles.
    pub fn closest(&self, point: &Vec3) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut stack = self.root();
        while let Some(i) = stack.pop() {
            let node = &self.nodes[i];
            let gap = (point.sup(&node.low).inf(&node.high) - point).norm();
            if best.is_some_and(|b| gap >= b.distance) {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.start as usize, i + 1]);
                continue;
            }
            for k in node.start as usize..(node.start + node.count) as usize {
                let weights = mesh::closest_barycentric(point, &self.corners[k]);
                let found: Vec3 = (0..3).map(|c| self.corners[k][c] * weights[c]).sum();
                let distance = (found - point).norm();
                if best.is_none_or(|b| distance < b.distance) {
                    best = Some(Hit { triangle: self.order[k] as usize, weights, distance });
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn soup() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut random = Random::new(3, 0);
        let mut draw = |size: f64| Vec3::from_fn(|_, _| (random.uniform() - 0.5) * size);
        let mut positions = Vec::new();
        for _ in 0..200 {
            let centre = draw(2.0);
            positions.extend((0..3).map(|_| centre + draw(0.3)));
        }
        (positions, (0..200).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    }

    #[test]
    fn agrees_with_exhaustive_search() {
        let (positions, triangles) = soup();
        let tree = Bvh::new(&positions, &triangles);
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        let mut random = Random::new(4, 0);
        for _ in 0..300 {
            let origin = Vec3::from_fn(|_, _| random.normal(0.0, 1.5));
            let direction = -origin.normalize() + Vec3::from_fn(|_, _| random.normal(0.0, 0.2));
            let direction = direction.normalize();
            let hits = triangles.iter().filter_map(|t| mesh::intersect_ray(&origin, &direction, &corners(t)));
            assert_eq!(tree.occluded(&origin, &direction), hits.count() > 0);
            let front = triangles.iter().filter(|t| mesh::area_normal(&positions, t).dot(&direction) < 0.0);
            let first = front.filter_map(|t| mesh::intersect_ray(&origin, &direction, &corners(t)));
            let expected = first.map(|h| h.0).min_by(f64::total_cmp);
            assert_eq!(tree.cast(&origin, &direction).map(|h| h.distance), expected);
            let gap = |t: &[u32; 3]| {
                let w = mesh::closest_barycentric(&origin, &corners(t));
                (mesh::at_barycentric(&positions, t, &w) - origin).norm()
            };
            let nearest = triangles.iter().map(gap).fold(f64::MAX, f64::min);
            assert!((tree.closest(&origin).unwrap().distance - nearest).abs() < 1e-12);
        }
    }

    #[test]
    fn an_empty_mesh_has_no_closest_point() {
        let tree = Bvh::new(&[], &[]);
        assert!(tree.closest(&Vec3::zeros()).is_none() && tree.cast(&Vec3::zeros(), &Vec3::z()).is_none());
    }
}
