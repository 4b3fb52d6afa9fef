//! Scan conversion of triangles: a perspective depth buffer through a lens with distortion, and texels of an atlas.
//!
//! - [`project`]: vertices to pixels; [`fragments`]: nearest triangle, barycentric weights and depth per pixel;
//!   [`texels`]: triangle and barycentric weights per texel.
//! - Vertices are distorted exactly and edges drawn straight in between: with triangles of some millimetres the
//!   difference is far below a pixel.
//! - Pixel centres are at integers. Equal depths keep the triangle that comes first, so the result does not depend
//!   on the number of threads.

use geometry::{Camera, Transform, Vec2, Vec3};
use rayon::prelude::*;

/// [`Fragment::triangle`] where there is none.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Rows that one task of the scan conversion fills.
const BAND: usize = 16;

/// What covers the centre of a pixel or texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Index of the triangle, or [`NO_TRIANGLE`].
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third corner on the surface (perspective undone).
    pub barycentric: [f32; 2],
    /// Depth in the camera frame, metres; infinite where there is no triangle, 0 in an atlas.
    pub depth: f32,
}

impl Fragment {
    /// A pixel that nothing covers.
    pub const EMPTY: Self = Self { triangle: NO_TRIANGLE, barycentric: [0.0; 2], depth: f32::INFINITY };

    /// Weights of the three corners.
    pub fn weights(&self) -> [f32; 3] {
        let [b, c] = self.barycentric;
        [1.0 - b - c, b, c]
    }
}

/// A vertex in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureVertex {
    /// Pixel.
    pub pixel: Vec2,
    /// One over the depth in the camera frame, 1/metres.
    pub inverse_depth: f64,
}

/// A rectangle of a picture that may reach over its border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x: i32,
    /// First row.
    pub y: i32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Window {
    /// The part of the picture, `margin` pixels wider on each side than the picture itself, that holds all vertices
    /// with a margin of as many pixels; `None` when none is near.
    pub fn around(vertices: &[Option<PictureVertex>], camera: &Camera, margin: i32) -> Option<Self> {
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for vertex in vertices.iter().flatten() {
            for k in 0..2 {
                low[k] = low[k].min(vertex.pixel[k]);
                high[k] = high[k].max(vertex.pixel[k]);
            }
        }
        // Casting saturates, so far away vertices stay on the right side.
        let start = |k: usize| (low[k].floor() as i32).saturating_sub(margin).max(-margin);
        let end = |k: usize, size: u32| (high[k].ceil() as i32).saturating_add(margin).min(size as i32 - 1 + margin);
        let (x, y, right, bottom) = (start(0), start(1), end(0, camera.width), end(1, camera.height));
        let inside = right > x && bottom > y && low[0] <= high[0];
        inside.then(|| Self { x, y, width: (right - x + 1) as usize, height: (bottom - y + 1) as usize })
    }

    /// Grown to whole pixels of `n`×`n` samples, and no further left or up than the picture.
    pub fn aligned(self, n: u32) -> Self {
        let n = n as usize;
        let grow = |start: i32, length: usize| {
            let first = start.max(0) as usize / n * n;
            (first as i32, (start.max(0) as usize + length - first).div_ceil(n) * n)
        };
        let ((x, width), (y, height)) = (grow(self.x, self.width), grow(self.y, self.height));
        Self { x, y, width, height }
    }
}

/// The vertices in the picture of a camera; `None` where the lens has no pixel for one.
pub fn project(camera: &Camera, cam_from_head: &Transform, positions: &[Vec3]) -> Vec<Option<PictureVertex>> {
    let vertex = |p: &Vec3| {
        let p = cam_from_head.apply(p);
        camera.project(&p).map(|pixel| PictureVertex { pixel, inverse_depth: 1.0 / p.z })
    };
    positions.iter().map(vertex).collect()
}

/// The nearest triangle per pixel of a window, row by row. Triangles with a corner without pixel are left out.
pub fn fragments(vertices: &[Option<PictureVertex>], triangles: &[[u32; 3]], window: &Window) -> Vec<Fragment> {
    let mut pixels = vec![Fragment::EMPTY; window.width * window.height];
    draw_fragments(&mut pixels, vertices, triangles, window, 0);
    pixels
}

/// Draws more triangles over [`fragments`]; `first` is added to their indices.
pub fn draw_fragments(
    pixels: &mut [Fragment],
    vertices: &[Option<PictureVertex>],
    triangles: &[[u32; 3]],
    window: &Window,
    first: u32,
) {
    let origin = Vec2::new(f64::from(window.x), f64::from(window.y));
    let corner = |i: u32| vertices[i as usize].as_ref().map(|v| v.pixel - origin);
    let shapes: Vec<_> = triangles.iter().map(|t| Some([corner(t[0])?, corner(t[1])?, corner(t[2])?])).collect();
    scan(pixels, window.width, &shapes, |pixel, index, b| {
        let corners = triangles[index as usize].map(|i| vertices[i as usize].map_or(0.0, |v| v.inverse_depth));
        let inverse_depth = b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2];
        let depth = (1.0 / inverse_depth) as f32;
        if depth < pixel.depth {
            let barycentric = [1, 2].map(|k| (b[k] * corners[k] / inverse_depth) as f32);
            *pixel = Fragment { triangle: first + index, barycentric, depth };
        }
    });
}

/// The triangle of each texel of a `size`×`size` atlas, top row first; `uvs` have `v` up, one triple per triangle.
pub fn texels(uvs: &[[Vec2; 3]], size: usize) -> Vec<Fragment> {
    let mut pixels = vec![Fragment::EMPTY; size * size];
    let shapes: Vec<_> = uvs.iter().map(|corners| Some(corners.map(|uv| texel_of(&uv, size, size)))).collect();
    scan(&mut pixels, size, &shapes, |pixel, index, b| {
        if pixel.triangle == NO_TRIANGLE {
            *pixel = Fragment { triangle: index, barycentric: [b[1] as f32, b[2] as f32], depth: 0.0 };
        }
    });
    pixels
}

/// Where a texture coordinate lies in a texture, in texels from the centre of the top left one.
pub fn texel_of(uv: &Vec2, width: usize, height: usize) -> Vec2 {
    Vec2::new(uv.x * width as f64 - 0.5, (1.0 - uv.y) * height as f64 - 0.5)
}

/// Calls `visit(pixel, triangle, barycentric weights)` for each pixel centre inside each triangle, for every pixel in
/// the order of the triangles. Borders belong to both triangles they part.
fn scan<T: Send>(
    pixels: &mut [T],
    width: usize,
    shapes: &[Option<[Vec2; 3]>],
    visit: impl Fn(&mut T, u32, [f64; 3]) + Sync,
) {
    if pixels.is_empty() {
        return;
    }
    let bands = bin_by_rows(shapes, pixels.len() / width);
    pixels.par_chunks_mut(width * BAND).zip(&bands).enumerate().for_each(|(band, (pixels, indices))| {
        for &index in indices {
            if let Some(corners) = &shapes[index as usize] {
                scan_triangle(pixels, width, band * BAND, corners, |pixel, b| visit(pixel, index, b));
            }
        }
    });
}

/// The triangles that touch each band of rows, in ascending order.
fn bin_by_rows(shapes: &[Option<[Vec2; 3]>], height: usize) -> Vec<Vec<u32>> {
    let mut bands = vec![Vec::new(); height.div_ceil(BAND)];
    for (index, corners) in shapes.iter().enumerate() {
        let Some([a, b, c]) = corners else { continue };
        let (low, high) = (a.y.min(b.y).min(c.y).ceil().max(0.0), a.y.max(b.y).max(c.y).floor());
        if high >= low && low < height as f64 {
            let last = (high as usize).min(height - 1) / BAND;
            for band in &mut bands[low as usize / BAND..=last] {
                band.push(index as u32);
            }
        }
    }
    bands
}

/// Visits the pixels of one triangle in a band whose first row is `top`.
fn scan_triangle<T>(
    pixels: &mut [T],
    width: usize,
    top: usize,
    [a, b, c]: &[Vec2; 3],
    mut visit: impl FnMut(&mut T, [f64; 3]),
) {
    let (ab, ac) = (b - a, c - a);
    let area = ab.perp(&ac);
    if area.is_nan() || area.abs() <= 1e-12 {
        return;
    }
    let rows = pixels.len() / width;
    let range = |low: f64, high: f64, from: usize, count: usize| {
        let start = low.ceil().max(from as f64) as usize;
        let end = (high.floor() + 1.0).clamp(0.0, (from + count) as f64) as usize;
        start..end
    };
    let columns = range(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), 0, width);
    for y in range(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), top, rows) {
        let row = &mut pixels[(y - top) * width..(y - top + 1) * width];
        let dy = y as f64 - a.y;
        for x in columns.clone() {
            let dx = x as f64 - a.x;
            let weight_b = (dx * ac.y - dy * ac.x) / area;
            let weight_c = (ab.x * dy - ab.y * dx) / area;
            let weight_a = 1.0 - weight_b - weight_c;
            if weight_a.min(weight_b).min(weight_c) >= -1e-9 {
                visit(&mut row[x], [weight_a, weight_b, weight_c]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::mesh::intersect_ray;

    fn scene() -> (Camera, Vec<Vec3>, Vec<[u32; 3]>) {
        let positions = [[-0.1, -0.1, 0.5], [0.12, -0.08, 0.7], [0.0, 0.1, 0.9], [-0.1, 0.05, 0.6], [0.1, 0.05, 0.6]];
        let positions = positions.iter().map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        (Camera::centred(64, 48, 80.0), positions, vec![[0, 1, 2], [3, 4, 0]])
    }

    #[test]
    fn fragments_are_where_rays_meet_the_nearest_triangle() {
        let (camera, positions, triangles) = scene();
        let window = Window { x: 0, y: 0, width: 64, height: 48 };
        let drawn = fragments(&project(&camera, &Transform::identity(), &positions), &triangles, &window);
        for (i, fragment) in drawn.iter().enumerate() {
            let ray = camera.ray(&Vec2::new((i % 64) as f64, (i / 64) as f64));
            let hit = |t: &[u32; 3]| intersect_ray(&Vec3::zeros(), &ray, &t.map(|k| positions[k as usize]));
            let hits = triangles.iter().enumerate().filter_map(|(k, t)| hit(t).map(|h| (h.0, k, h.1)));
            match hits.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((distance, k, weights)) => {
                    assert_eq!(fragment.triangle as usize, k);
                    assert!((f64::from(fragment.depth) - distance * ray.z).abs() < 1e-6);
                    let differs =
                        fragment.weights().iter().zip(&weights).any(|(a, b)| (f64::from(*a) - b).abs() > 1e-5);
                    assert!(!differs);
                }
                None => assert_eq!(fragment.triangle, NO_TRIANGLE),
            }
        }
    }

    #[test]
    fn every_texel_of_a_split_square_has_a_triangle() {
        let uv = |x: f64, y: f64| Vec2::new(x, y);
        let square = [[uv(0.0, 0.0), uv(1.0, 0.0), uv(1.0, 1.0)], [uv(0.0, 0.0), uv(1.0, 1.0), uv(0.0, 1.0)]];
        let atlas = texels(&square, 37);
        assert!(atlas.iter().all(|t| t.triangle != NO_TRIANGLE));
        assert_eq!((atlas[36 * 37 + 36].triangle, atlas[0].triangle), (0, 1));
    }

    #[test]
    fn triangles_far_outside_or_without_area_draw_nothing() {
        let far = |x: f64| PictureVertex { pixel: Vec2::new(x, 1e12), inverse_depth: 1.0 };
        let vertices = [Some(far(0.0)), Some(far(-1e12)), Some(far(3.0)), None];
        let window = Window { x: -1, y: -1, width: 8, height: 8 };
        let drawn = fragments(&vertices, &[[0, 1, 2], [0, 0, 0], [0, 1, 3]], &window);
        assert!(drawn.iter().all(|f| *f == Fragment::EMPTY));
    }
}
