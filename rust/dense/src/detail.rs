//! What the mesh cannot hold of the measured surface: heights over the smooth surface that its subdivision tends to (Catmull and Clark
//! 1978), as maps over texture coordinates.

use crate::bend::{Datum, Stiffness, solve};
use crate::fine::Fine;
use geometry::{Vec2, Vec3, mesh};
use nalgebra::Matrix2;
use raster::{NO_TRIANGLE, texels};

/// Heights bend by this against their neighbours, for edges of 4 mm, metres: what windows of a few millimetres can tell.
const BEND: f64 = 6e-5;
/// Where measured, heights are this large, metres …
const LARGE: f64 = 5e-4;
/// … and elsewhere none.
const NONE: f64 = 2e-5;
/// Heights beyond this are no skin's, metres.
const HIGHEST: f64 = 0.002;

/// Heights of the surface over the limit of the mesh's subdivision, along its normals.
#[derive(Clone, Debug, PartialEq)]
pub struct Detail {
    /// Metres; vertices of the mesh come first, then the middles of its edges and of its quads.
    pub heights: Vec<f64>,
    /// Where these places are without their heights.
    pub places: Vec<Vec3>,
    /// Four quads of each of the mesh, which begin at its corners.
    pub quads: Vec<[u32; 4]>,
}

/// Heights and slopes at texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    /// Side, texels.
    pub size: usize,
    /// Heights, metres, top row first; 0 where there is no surface.
    pub heights: Vec<f32>,
    /// Unit normals in tangent space: x along u, y along v (up), z out of the surface.
    pub normals: Vec<[f32; 3]>,
}

/// A measured point of the surface, at a place, with its standard deviation, metres.
pub(crate) struct Target {
    pub(crate) place: usize,
    pub(crate) point: Vec3,
    pub(crate) sigma: f64,
}

impl Detail {
    /// Of measured points over a mesh's final positions.
    pub(crate) fn of(positions: &[Vec3], quads: &[[u32; 4]], fine: &Fine, targets: &[Target]) -> Self {
        let places = limit(&subdivided(positions, quads), fine);
        let normals = mesh::vertex_normals(&places, &mesh::triangulate(&fine.quads));
        let mut rest = vec![NONE; places.len()];
        let datum = |target: &Target| {
            let Target { place, point, sigma } = *target;
            let value = normals[place].dot(&(point - places[place])).clamp(-HIGHEST, HIGHEST);
            Datum { stencil: ([place as u32; 4], [1.0, 0.0, 0.0, 0.0]), value, sigma }
        };
        let data: Vec<Datum> = targets.iter().map(datum).collect();
        targets.iter().for_each(|target| rest[target.place] = LARGE);
        let stiffness = Stiffness { bend: BEND, rest };
        let heights = solve(&places, &fine.rings, &data, &stiffness).map_or_else(|| vec![0.0; places.len()], |s| s.0);
        Self { heights, places, quads: fine.quads.clone() }
    }

    /// As maps of so many texels along a side; `uvs` are those of the mesh's quads, in their order, `v` up.
    pub fn maps(&self, uvs: &[[[f32; 2]; 4]], size: usize) -> Maps {
        let (mut triangles, mut corners) = (Vec::new(), Vec::new());
        for (quad, uv) in self.quads.iter().zip(uvs.iter().flat_map(divided)) {
            for k in [[0, 1, 2], [0, 2, 3]] {
                triangles.push(k.map(|k| quad[k] as usize));
                corners.push(k.map(|k| uv[k]));
            }
        }
        let slopes = self.slopes(&triangles, &corners);
        let mut maps = Maps { size, heights: vec![0.0; size * size], normals: vec![[0.0, 0.0, 1.0]; size * size] };
        for (i, texel) in texels(&corners, size).iter().enumerate().filter(|(_, t)| t.triangle != NO_TRIANGLE) {
            let triangle = triangles[texel.triangle as usize];
            let weights = texel.weights().map(f64::from);
            let mix = |of: &dyn Fn(usize) -> f64| (0..3).map(|k| weights[k] * of(triangle[k])).sum::<f64>();
            maps.heights[i] = mix(&|v| self.heights[v]) as f32;
            let normal = Vec3::new(-mix(&|v| slopes[v].x), -mix(&|v| slopes[v].y), 1.0).normalize();
            maps.normals[i] = [normal.x as f32, normal.y as f32, normal.z as f32];
        }
        maps
    }

    /// Slopes of the heights along u and v, metres per metre, at each place: the mean of the triangles around it.
    fn slopes(&self, triangles: &[[usize; 3]], uvs: &[[Vec2; 3]]) -> Vec<Vec2> {
        let mut sums = vec![(Vec2::zeros(), 0.0); self.places.len()];
        for (triangle, uv) in triangles.iter().zip(uvs) {
            let [a, b, c] = triangle.map(|v| self.places[v]);
            let steps = Matrix2::from_columns(&[uv[1] - uv[0], uv[2] - uv[0]]);
            let Some(inverse) = steps.try_inverse() else { continue };
            let [along_u, along_v] =
                [0, 1].map(|k| ((b - a) * inverse[(0, k)] + (c - a) * inverse[(1, k)]).norm().max(1e-9));
            let [ha, hb, hc] = triangle.map(|v| self.heights[v]);
            let by_uv = inverse.transpose() * Vec2::new(hb - ha, hc - ha);
            let (slope, area) = (Vec2::new(by_uv.x / along_u, by_uv.y / along_v), (b - a).cross(&(c - a)).norm());
            for &v in triangle {
                sums[v].0 += slope * area;
                sums[v].1 += area;
            }
        }
        sums.into_iter().map(|(sum, area)| sum / area.max(1e-18)).collect()
    }
}

/// Texture coordinates of the four quads that a quad is divided into.
fn divided(uv: &[[f32; 2]; 4]) -> [[Vec2; 4]; 4] {
    let corner: [Vec2; 4] = uv.map(|uv| Vec2::new(f64::from(uv[0]), f64::from(uv[1])));
    let middle = corner.iter().sum::<Vec2>() / 4.0;
    let half = |k: usize| (corner[k % 4] + corner[(k + 1) % 4]) / 2.0;
    [0, 1, 2, 3].map(|k| [corner[k], half(k), middle, half(k + 3)])
}

/// Catmull's and Clark's subdivision: vertices, edges, quads, in this order.
fn subdivided(positions: &[Vec3], quads: &[[u32; 4]]) -> Vec<Vec3> {
    let edges = mesh::quad_edges(quads);
    let middles: Vec<Vec3> =
        quads.iter().map(|q| q.iter().map(|&v| positions[v as usize]).sum::<Vec3>() / 4.0).collect();
    let mut beside = vec![(Vec3::zeros(), 0_u32); edges.len()];
    let mut around = vec![(Vec3::zeros(), 0_u32); positions.len()];
    for (q, middle) in quads.iter().zip(&middles) {
        for k in 0..4 {
            let (a, b) = (q[k], q[(k + 1) % 4]);
            if let Ok(e) = edges.binary_search(&[a.min(b), a.max(b)]) {
                beside[e] = (beside[e].0 + middle, beside[e].1 + 1);
            }
            around[a as usize] = (around[a as usize].0 + middle, around[a as usize].1 + 1);
        }
    }
    let halves: Vec<Vec3> = edges.iter().map(|e| (positions[e[0] as usize] + positions[e[1] as usize]) / 2.0).collect();
    let (mut ring, mut is_border) = (vec![Vec3::zeros(); positions.len()], vec![false; positions.len()]);
    for ((edge, half), (_, sides)) in edges.iter().zip(&halves).zip(&beside) {
        for &v in edge {
            ring[v as usize] += half;
            is_border[v as usize] |= *sides < 2;
        }
    }
    let vertex = |v: usize| {
        let (middles, quads) = around[v];
        if is_border[v] || quads < 3 {
            return positions[v];
        }
        let n = f64::from(quads);
        (middles / n + ring[v] * (2.0 / n) + positions[v] * (n - 3.0)) / n
    };
    let edge = |e: usize| match beside[e] {
        (middles, 2) => halves[e] / 2.0 + middles / 4.0,
        _ => halves[e],
    };
    (0..positions.len()).map(vertex).chain((0..edges.len()).map(edge)).chain(middles.iter().copied()).collect()
}

/// Where the vertices of a subdivided mesh end when it is subdivided for ever.
fn limit(places: &[Vec3], fine: &Fine) -> Vec<Vec3> {
    let mut opposite = vec![(Vec3::zeros(), 0_usize); places.len()];
    for quad in &fine.quads {
        for k in 0..4 {
            let of = &mut opposite[quad[k] as usize];
            *of = (of.0 + places[quad[(k + 2) % 4] as usize], of.1 + 1);
        }
    }
    let place = |v: usize| {
        let (ring, (corners, quads)) = (&fine.rings[v], opposite[v]);
        if ring.len() != quads || quads < 3 {
            return places[v];
        }
        let (n, edges) = (quads as f64, ring.iter().map(|&j| places[j as usize]).sum::<Vec3>());
        (places[v] * (n * n) + edges * 4.0 + corners) / (n * (n + 5.0))
    };
    (0..places.len()).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use synthetic::Skin;

    const SIDE: u32 = 13;

    fn uvs(count: u32) -> Vec<[[f32; 2]; 4]> {
        let cells = count - 1;
        let at = |i: u32, j: u32| [i as f32 / cells as f32, j as f32 / cells as f32];
        (0..cells * cells)
            .map(|k| (k % cells, k / cells))
            .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            .collect()
    }

    #[test]
    fn a_subdivided_ball_tends_to_one_that_is_a_little_smaller() {
        let (positions, quads) = Skin::ball(SIDE, 0.004);
        let fine = Fine::of(positions.len(), &quads);
        let detail = Detail::of(&positions, &quads, &fine, &[]);
        let middle = (SIDE / 2 * SIDE + SIDE / 2) as usize;
        let radius = detail.places[middle].norm();
        assert!((0.0598..0.06).contains(&radius), "{radius}");
        assert!(detail.heights.iter().all(|h| *h == 0.0));
    }

    #[test]
    fn measured_heights_are_in_the_map_and_the_rest_is_flat() {
        let (positions, quads) = Skin::ball(SIDE, 0.004);
        let fine = Fine::of(positions.len(), &quads);
        let flat = Detail::of(&positions, &quads, &fine, &[]);
        let bump = |p: &Vec3| 2e-4 * (-(p - Vec3::new(0.0, 0.0, 0.06)).norm_squared() / 0.006_f64.powi(2)).exp();
        let inside = |p: &Vec3| (p - Vec3::new(0.0, 0.0, 0.06)).norm() < 0.014;
        let target = |(place, p): (usize, &Vec3)| {
            inside(p).then(|| Target { place, point: p + p.normalize() * bump(p), sigma: 2e-5 })
        };
        let targets: Vec<Target> = flat.places.iter().enumerate().filter_map(target).collect();
        let maps = Detail::of(&positions, &quads, &fine, &targets).maps(&uvs(SIDE), 96);
        let at = |x: usize, y: usize| f64::from(maps.heights[y * 96 + x]);
        assert!((at(48, 48) - 2e-4).abs() < 4e-5 && at(3, 3).abs() < 1e-5, "{} {}", at(48, 48), at(3, 3));
        // Right of the bump's top the surface falls along u, its normal leans that way.
        let slope = |x: usize, y: usize| maps.normals[y * 96 + x];
        assert!(slope(56, 48)[0] > 0.01 && slope(40, 48)[0] < -0.01 && slope(48, 40)[1] > 0.01);
        assert!(slope(3, 3)[2] > 0.9999);
    }
}
