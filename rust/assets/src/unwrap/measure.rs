//! What a map is worth: how much of it is used, how evenly, and whether it folds or overlaps.

use super::Sheet;
use super::density::Places;
use geometry::{Vec2, Vec3, mesh};

/// Side of the raster and of the texture that the report speaks of, texels.
const SIZE: usize = 2048;

/// Figures of a map, for a texture of 2048².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapReport {
    /// Share of texel centres covered by skin.
    pub usage: f64,
    /// Texel centres covered by more than one quad.
    pub overlaps: usize,
    /// Corners of quads that turn the wrong way, or not at all.
    pub folds: usize,
    /// Ratio of the singular values on the face: median and 95th percentile by area.
    pub stretch: [f64; 2],
    /// Texels per millimetre, median by area: face, lids, lips, ears, rest of the skin.
    pub texels_per_mm: [f64; 5],
}

/// Measures a map.
pub(super) fn measure(sheet: &Sheet, uvs: &[[[f32; 2]; 4]], places: &Places) -> MapReport {
    let cover = raster(uvs);
    let mut samples: [Vec<(f64, f64)>; 5] = Default::default();
    let mut stretch = Vec::new();
    let mut folds = 0;
    for (quad, corners) in sheet.quads.iter().zip(uvs) {
        let uv = corners.map(|c| Vec2::new(f64::from(c[0]), f64::from(c[1])));
        let p = quad.map(|v| sheet.positions[v as usize]);
        folds += (0..4).filter(|&k| (uv[(k + 1) % 4] - uv[k]).perp(&(uv[(k + 2) % 4] - uv[k])) <= 0.0).count();
        let hidden = quad.iter().any(|&v| sheet.cavity[v as usize]);
        if hidden {
            continue;
        }
        for t in [[0, 1, 2], [0, 2, 3]] {
            let (area, [s1, s2]) = singular_values(t.map(|k| p[k]), t.map(|k| uv[k]));
            let centre = (p[t[0]] + p[t[1]] + p[t[2]]) / 3.0;
            let region = places.region(&centre);
            samples[region].push(((s1 * s2).sqrt() * SIZE as f64 / 1000.0, area));
            if region < 3 {
                stretch.push((s1 / s2.max(1e-12), area));
            }
        }
    }
    MapReport {
        usage: cover.iter().filter(|&&c| c > 0).count() as f64 / (SIZE * SIZE) as f64,
        overlaps: cover.iter().filter(|&&c| c > 1).count(),
        folds,
        stretch: [quantile(&mut stretch, 0.5), quantile(&mut stretch, 0.95)],
        texels_per_mm: samples.map(|mut s| quantile(&mut s, 0.5)),
    }
}

/// Surface area of a triangle and the singular values of its map to the plane, larger first.
fn singular_values(p: [Vec3; 3], uv: [Vec2; 3]) -> (f64, [f64; 2]) {
    let area = 0.5 * mesh::area_normal(&p, &[0, 1, 2]).norm();
    let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
    let length = e1.norm().max(1e-15);
    let (x, y) = (e1.dot(&e2) / length, 2.0 * area / length);
    let (f1, f2) = (uv[1] - uv[0], uv[2] - uv[0]);
    let du = f1 / length;
    let dv = (f2 - du * x) / y.max(1e-15);
    let (half, det) = ((du.norm_squared() + dv.norm_squared()) / 2.0, du.perp(&dv));
    let root = (half * half - det * det).max(0.0).sqrt();
    (area, [(half + root).sqrt(), (half - root).max(0.0).sqrt()])
}

/// Weighted quantile; zero of nothing.
fn quantile(samples: &mut [(f64, f64)], share: f64) -> f64 {
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let goal = share * samples.iter().map(|s| s.1).sum::<f64>();
    let mut sum = 0.0;
    let reached = samples.iter().find(|s| {
        sum += s.1;
        sum >= goal
    });
    reached.map_or(0.0, |s| s.0)
}

/// How many quads cover each texel centre.
fn raster(uvs: &[[[f32; 2]; 4]]) -> Vec<u8> {
    let mut cover = vec![0_u8; SIZE * SIZE];
    for corners in uvs {
        let q = corners.map(|c| Vec2::new(f64::from(c[0]), f64::from(c[1])) * SIZE as f64 - Vec2::new(0.5, 0.5));
        for t in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
            fill(&t, &mut cover);
        }
    }
    cover
}

/// Counts the texels strictly inside a triangle, so that shared edges are counted at most once.
fn fill(t: &[Vec2; 3], cover: &mut [u8]) {
    let bound = |k: usize| {
        let values = t.map(|p| p[k]);
        let low = values.iter().fold(f64::INFINITY, |m, &x| m.min(x)).ceil().max(0.0) as usize;
        let high = values.iter().fold(0.0_f64, |m, &x| m.max(x)).floor() as usize;
        low..=high.min(SIZE - 1)
    };
    for y in bound(1) {
        for x in bound(0) {
            let p = Vec2::new(x as f64, y as f64);
            if (0..3).all(|k| (t[(k + 1) % 3] - t[k]).perp(&(p - t[k])) > 0.0) {
                cover[y * SIZE + x] = cover[y * SIZE + x].saturating_add(1);
            }
        }
    }
}
