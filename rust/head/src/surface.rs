//! Closest points on the skin that can be seen, by a uniform grid over its triangles.

use crate::GenericHead;
use geometry::{Vec3, mesh};

/// Side of a cell, metres; about a triangle of the face.
const CELL: f64 = 0.006;

/// Where a point meets the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Vertices of the triangle.
    pub triangle: [u32; 3],
    /// Barycentric weights there.
    pub weights: [f64; 3],
    /// The place itself, head frame, metres.
    pub position: Vec3,
    /// Unit normal there, interpolated from the vertices.
    pub normal: Vec3,
}

/// The skin without mouth bag, sockets and nostrils, ready for queries.
pub struct SkinSurface<'a> {
    positions: &'a [Vec3],
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    origin: Vec3,
    size: [usize; 3],
    /// Triangles of each cell.
    cells: Vec<Vec<u32>>,
}

impl<'a> SkinSurface<'a> {
    /// Sorts the triangles of a head with these `positions` (all vertices) into cells.
    pub fn new(head: &GenericHead, positions: &'a [Vec3]) -> Self {
        let skin = head.triangles(head.skin());
        let normals = mesh::vertex_normals(positions, &skin);
        let visible = |t: &[u32; 3]| t.iter().any(|&i| !head.cavity[i as usize]);
        let triangles: Vec<[u32; 3]> = skin.into_iter().filter(visible).collect();
        let corners = || triangles.iter().flatten().map(|&i| positions[i as usize]);
        let low = corners().fold(Vec3::repeat(f64::INFINITY), |a, b| a.inf(&b));
        let high = corners().fold(Vec3::repeat(f64::NEG_INFINITY), |a, b| a.sup(&b));
        let extent = if triangles.is_empty() { Vec3::zeros() } else { high - low };
        let origin = if triangles.is_empty() { Vec3::zeros() } else { low };
        let size = [0, 1, 2].map(|k| (extent[k] / CELL) as usize + 1);
        let mut surface = Self { positions, normals, triangles, origin, size, cells: Vec::new() };
        surface.cells = vec![Vec::new(); size.iter().product()];
        for index in 0..surface.triangles.len() {
            let corners = surface.corners(index);
            let low = surface.cell_of(&corners[0].inf(&corners[1]).inf(&corners[2]));
            let high = surface.cell_of(&corners[0].sup(&corners[1]).sup(&corners[2]));
            surface.for_cells(low, high, |cells, cell| cells[cell].push(index as u32));
        }
        surface
    }

    /// The closest place within `reach` metres.
    pub fn closest(&self, point: &Vec3, reach: f64) -> Option<Foot> {
        let mut best: Option<(f64, usize, [f64; 3])> = None;
        let mut radius = CELL.min(reach);
        loop {
            let limit = Vec3::repeat(radius);
            let (low, high) = (self.cell_of(&(point - limit)), self.cell_of(&(point + limit)));
            self.visit(low, high, |index| {
                let corners = self.corners(index);
                let weights = mesh::closest_barycentric(point, &corners);
                let place = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
                let distance = (place - point).norm();
                if best.is_none_or(|(d, i, _)| (distance, index) < (d, i)) {
                    best = Some((distance, index, weights));
                }
            });
            let done = best.is_some_and(|(d, ..)| d <= radius);
            if done || radius >= reach {
                break;
            }
            radius = (2.0 * radius).min(reach);
        }
        best.filter(|(d, ..)| *d <= reach).map(|(_, index, weights)| self.foot(self.triangles[index], weights))
    }

    /// The place at barycentric weights of a triangle of the skin.
    pub fn foot(&self, triangle: [u32; 3], weights: [f64; 3]) -> Foot {
        let normal = mesh::at_barycentric(&self.normals, &triangle, &weights);
        Foot {
            triangle,
            weights,
            position: mesh::at_barycentric(self.positions, &triangle, &weights),
            normal: normal.try_normalize(1e-12).unwrap_or_else(Vec3::z),
        }
    }

    fn corners(&self, index: usize) -> [Vec3; 3] {
        self.triangles[index].map(|i| self.positions[i as usize])
    }

    fn cell_of(&self, point: &Vec3) -> [usize; 3] {
        [0, 1, 2].map(|k| (((point[k] - self.origin[k]) / CELL).max(0.0) as usize).min(self.size[k] - 1))
    }

    fn index(&self, x: usize, y: usize, z: usize) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    fn visit(&self, low: [usize; 3], high: [usize; 3], mut act: impl FnMut(usize)) {
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    self.cells[self.index(x, y, z)].iter().for_each(|&t| act(t as usize));
                }
            }
        }
    }

    fn for_cells(&mut self, low: [usize; 3], high: [usize; 3], mut act: impl FnMut(&mut [Vec<u32>], usize)) {
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let cell = self.index(x, y, z);
                    act(&mut self.cells, cell);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::testing::toy_head;

    #[test]
    fn grid_agrees_with_all_triangles() {
        let head = toy_head();
        let surface = SkinSurface::new(&head, &head.positions);
        for i in 0..200 {
            let a = f64::from(i);
            let point = Vec3::new((2.3 * a).sin(), (1.1 * a).cos(), (0.7 * a).sin()) * 0.11;
            let brute = (0..surface.triangles.len())
                .map(|t| {
                    let corners = surface.corners(t);
                    let w = mesh::closest_barycentric(&point, &corners);
                    (corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2] - point).norm()
                })
                .fold(f64::INFINITY, f64::min);
            match surface.closest(&point, 0.03) {
                Some(foot) => assert!(((foot.position - point).norm() - brute).abs() < 1e-12),
                None => assert!(brute > 0.03),
            }
        }
    }

    #[test]
    fn far_points_have_no_foot() {
        let head = toy_head();
        assert!(SkinSurface::new(&head, &head.positions).closest(&Vec3::new(1.0, 1.0, 1.0), 0.02).is_none());
    }
}
