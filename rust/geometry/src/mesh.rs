//! Polygon meshes as plain arrays.

use crate::Vec3;
use std::collections::BTreeMap;

/// Splits quads `[a, b, c, d]` into triangles `[a, b, c]`, `[a, c, d]`, in order: triangles `2i` and `2i + 1` of quad `i`.
pub fn triangulate(quads: &[[u32; 4]]) -> Vec<[u32; 3]> {
    quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// Twice the area times the unit normal of a triangle (right-handed winding).
pub fn area_normal(positions: &[Vec3], triangle: &[u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|i| positions[i as usize]);
    (b - a).cross(&(c - a))
}

/// Unit vertex normals, weighted by triangle area; zero where no triangle meets.
pub fn vertex_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); positions.len()];
    for triangle in triangles {
        let normal = area_normal(positions, triangle);
        for &i in triangle {
            normals[i as usize] += normal;
        }
    }
    normals.iter().map(|n| n.try_normalize(1e-300).unwrap_or_else(Vec3::zeros)).collect()
}

/// The undirected edges of quads, each once, sorted.
pub fn quad_edges(quads: &[[u32; 4]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> =
        quads.iter().flat_map(|q| (0..4).map(move |k| [q[k].min(q[(k + 1) % 4]), q[k].max(q[(k + 1) % 4])])).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Neighbours of each vertex along the given edges, in edge order.
pub fn neighbours(vertex_count: usize, edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut rings = vec![Vec::new(); vertex_count];
    for &[a, b] in edges {
        rings[a as usize].push(b);
        rings[b as usize].push(a);
    }
    rings
}

/// Edges that belong to one quad only.
pub fn border_edges(quads: &[[u32; 4]]) -> Vec<[u32; 2]> {
    let mut count: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for q in quads {
        for k in 0..4 {
            let (a, b) = (q[k], q[(k + 1) % 4]);
            *count.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    count.into_iter().filter(|&(_, n)| n == 1).map(|(edge, _)| edge).collect()
}

/// The point at barycentric weights of a triangle.
pub fn at_barycentric(positions: &[Vec3], triangle: &[u32; 3], weights: &[f64; 3]) -> Vec3 {
    (0..3).fold(Vec3::zeros(), |sum, k| sum + positions[triangle[k] as usize] * weights[k])
}

/// Barycentric weights of the point of a triangle that is closest to `point` (Ericson, Real-Time Collision
/// Detection, section 5.1.5).
pub fn closest_barycentric(point: &Vec3, corners: &[Vec3; 3]) -> [f64; 3] {
    let [a, b, c] = corners;
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    [va / sum, vb / sum, vc / sum]
}

/// Where a ray meets a triangle from its front or back: distance along `direction` and barycentric weights
/// (Möller–Trumbore).
pub fn intersect_ray(origin: &Vec3, direction: &Vec3, corners: &[Vec3; 3]) -> Option<(f64, [f64; 3])> {
    let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let p = direction.cross(&e2);
    let det = e1.dot(&p);
    if det.abs() < 1e-18 {
        return None;
    }
    let s = origin - corners[0];
    let u = s.dot(&p) / det;
    let q = s.cross(&e1);
    let v = direction.dot(&q) / det;
    let t = e2.dot(&q) / det;
    (u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 && t > 0.0).then_some((t, [1.0 - u - v, u, v]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> [Vec3; 3] {
        [Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0)]
    }

    #[test]
    fn closest_point_lies_inside_on_edges_and_on_corners() {
        assert_eq!(closest_barycentric(&Vec3::new(-1.0, -1.0, 3.0), &corners()), [1.0, 0.0, 0.0]);
        let edge = closest_barycentric(&Vec3::new(1.0, 1.0, -2.0), &corners());
        assert!((edge[1] - 0.5).abs() < 1e-12 && edge[0].abs() < 1e-12);
        let inside = closest_barycentric(&Vec3::new(0.25, 0.25, 5.0), &corners());
        assert!((inside[0] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_ray_meets_the_triangle_at_its_distance() {
        let (t, w) = intersect_ray(&Vec3::new(0.2, 0.3, 2.0), &Vec3::new(0.0, 0.0, -1.0), &corners()).unwrap();
        assert!((t - 2.0).abs() < 1e-12 && (w[1] - 0.2).abs() < 1e-12 && (w[2] - 0.3).abs() < 1e-12);
        assert!(intersect_ray(&Vec3::new(2.0, 0.3, 2.0), &Vec3::new(0.0, 0.0, -1.0), &corners()).is_none());
    }

    #[test]
    fn normals_point_out_of_a_counter_clockwise_quad() {
        let positions: Vec<Vec3> =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect();
        let normals = vertex_normals(&positions, &triangulate(&[[0, 1, 2, 3]]));
        assert!(normals.iter().all(|n| (n - Vec3::z()).norm() < 1e-12));
        assert_eq!(border_edges(&[[0, 1, 2, 3]]).len(), 4);
        assert_eq!(quad_edges(&[[0, 1, 2, 3], [1, 4, 5, 2]]).len(), 7);
    }
}
