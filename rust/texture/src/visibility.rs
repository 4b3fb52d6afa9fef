//! Which part of a picture shows the surface, and how far from anything else.
//!
//! A point counts as seen where it is no deeper than the depth buffer, and the less the closer its pixel lies to a
//! silhouette, an occluder, a masked pixel or the border of the picture: a model is never exact there, and a single
//! pixel of wall on a cheek is worse than a cheek seen by one view less.

use geometry::Camera;
use image::GrayImage;
use raster::{Fragment, PictureVertex, Window, draw_fragments};

/// How much deeper than the depth buffer a seen point may be, metres.
const DEPTH_TOLERANCE: f32 = 0.002;
/// A step in depth between neighbouring pixels is an edge when larger than this, metres …
const EDGE_STEP: f32 = 0.006;
/// … and than this many times the size of a pixel on the surface, so that a slanted cheek is none.
const EDGE_SLOPE: f32 = 6.0;

/// Distances from an edge within which pixels are not or less trusted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Margin {
    /// Nothing is taken closer than this, pixels …
    pub(crate) pixels: f64,
    /// … plus this, metres on the surface.
    pub(crate) metres: f64,
    /// From there trust grows over this distance, metres on the surface.
    pub(crate) feather: f64,
}

/// Triangles in a picture.
pub(crate) type PictureMesh<'a> = (&'a [Option<PictureVertex>], &'a [[u32; 3]]);

/// Depth and trust of the pixels around the head in one view.
pub(crate) struct Visibility {
    window: Window,
    depth: Vec<f32>,
    /// 0…1 per pixel of the window.
    trust: Vec<f32>,
}

impl Visibility {
    /// Of a view of a surface and what may stand before it; `None` when no pixel shows the surface.
    pub(crate) fn new(
        surface: PictureMesh,
        occluders: &[PictureMesh],
        camera: &Camera,
        mask: Option<&GrayImage>,
        margin: &Margin,
    ) -> Option<Self> {
        let window = Window::around(surface.0, camera, 2)?;
        let mut pixels = vec![Fragment::EMPTY; window.width * window.height];
        let mut first = 0;
        for (vertices, triangles) in std::iter::once(&surface).chain(occluders) {
            draw_fragments(&mut pixels, vertices, triangles, &window, first);
            first += triangles.len() as u32;
        }
        let own = surface.1.len() as u32;
        let depths: Vec<f32> = pixels.iter().filter(|p| p.triangle < own).map(|p| p.depth).collect();
        let nearest = depths.iter().copied().fold(f32::INFINITY, f32::min);
        if !nearest.is_finite() {
            return None;
        }
        let pixels_per_metre = (camera.fx * camera.fy).sqrt() / f64::from(nearest);
        let mut distance = blocked(&pixels, own, &window, camera, mask);
        chamfer(&mut distance, window.width);
        let start = (margin.pixels + margin.metres * pixels_per_metre) as f32;
        let length = (margin.feather * pixels_per_metre).max(1e-3) as f32;
        let trust = distance.iter().map(|d| smoothstep((d - start) / length)).collect();
        Some(Self { window, depth: pixels.iter().map(|p| p.depth).collect(), trust })
    }

    /// How far a point at a pixel and depth is to be trusted, 0 (hidden) … 1.
    pub(crate) fn trust(&self, u: f32, v: f32, depth: f32) -> f32 {
        let (x, y) = (u - self.window.x as f32, v - self.window.y as f32);
        if !(x >= 0.0 && y >= 0.0 && x < (self.window.width - 1) as f32 && y < (self.window.height - 1) as f32) {
            return 0.0;
        }
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = (x - column as f32, y - row as f32);
        let i = row * self.window.width + column;
        let mix = |p: &[f32]| {
            let j = i + self.window.width;
            (p[i] * (1.0 - fx) + p[i + 1] * fx) * (1.0 - fy) + (p[j] * (1.0 - fx) + p[j + 1] * fx) * fy
        };
        let trust = mix(&self.trust);
        if trust > 0.0 && depth <= mix(&self.depth) + DEPTH_TOLERANCE { trust } else { 0.0 }
    }
}

/// Zero at pixels that are no good: not of the surface, masked, outside the picture or at a step in depth; a large
/// number elsewhere.
fn blocked(pixels: &[Fragment], own: u32, window: &Window, camera: &Camera, mask: Option<&GrayImage>) -> Vec<f32> {
    let (width, focal) = (window.width, (camera.fx * camera.fy).sqrt() as f32);
    let mut distance = vec![f32::MAX; pixels.len()];
    let is_step = |a: f32, b: f32| (a - b).abs() > EDGE_STEP.max(EDGE_SLOPE * a.min(b) / focal);
    for (i, pixel) in pixels.iter().enumerate() {
        let (column, row) = (i % width, i / width);
        let (x, y) = (column as i32 + window.x, row as i32 + window.y);
        let outside = x < 0 || y < 0 || x >= camera.width as i32 || y >= camera.height as i32;
        let masked = !outside && mask.is_some_and(|m| m.get_pixel(x as u32, y as u32)[0] == 0);
        if outside || masked || pixel.triangle >= own {
            distance[i] = 0.0;
        }
        for j in [(column + 1 < width).then_some(i + 1), (row + 1 < window.height).then_some(i + width)] {
            // Nothing is infinitely deep; its border is blocked as it is, and the pixel before it is one away.
            let Some(j) = j.filter(|&j| pixel.triangle != u32::MAX && pixels[j].triangle != u32::MAX) else { continue };
            if is_step(pixel.depth, pixels[j].depth) {
                distance[i] = 0.0;
                distance[j] = 0.0;
            }
        }
    }
    distance
}

/// Distance to the nearest zero, pixels, by two passes over the eight neighbours (Borgefors 1986; at most 8 % long).
fn chamfer(distance: &mut [f32], width: usize) {
    const DIAGONAL: f32 = std::f32::consts::SQRT_2;
    let height = distance.len() / width;
    for pass in 0..2 {
        let at = |x: usize, y: usize| if pass == 0 { y * width + x } else { (height - 1 - y) * width + width - 1 - x };
        for y in 0..height {
            for x in 0..width {
                let mut d = distance[at(x, y)];
                if x > 0 {
                    d = d.min(distance[at(x - 1, y)] + 1.0);
                }
                if y > 0 {
                    d = d.min(distance[at(x, y - 1)] + 1.0);
                    if x > 0 {
                        d = d.min(distance[at(x - 1, y - 1)] + DIAGONAL);
                    }
                    if x + 1 < width {
                        d = d.min(distance[at(x + 1, y - 1)] + DIAGONAL);
                    }
                }
                distance[at(x, y)] = d;
            }
        }
    }
}

/// The cubic from 0 at 0 to 1 at 1 with flat ends.
pub(crate) fn smoothstep(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Transform, Vec3};
    use raster::project;

    const MARGIN: Margin = Margin { pixels: 2.0, metres: 0.0, feather: 0.05 };

    fn square(half: f64, depth: f64) -> Vec<Vec3> {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .iter()
            .map(|p| Vec3::new(p[0] * half, p[1] * half, depth))
            .collect()
    }

    fn seen(occluder: Option<f64>, mask: Option<&GrayImage>) -> Option<Visibility> {
        let camera = Camera::centred(101, 101, 100.0);
        let picture = |positions: &[Vec3]| project(&camera, &Transform::identity(), positions);
        let triangles = [[0, 2, 1], [0, 3, 2]];
        let wall = picture(&square(0.3, 1.0));
        let before: Vec<_> = occluder.iter().map(|half| picture(&square(*half, 0.5))).collect();
        let occluders: Vec<PictureMesh> = before.iter().map(|v| (&v[..], &triangles[..])).collect();
        Visibility::new((&wall, &triangles), &occluders, &camera, mask, &MARGIN)
    }

    #[test]
    fn trust_falls_to_zero_before_the_silhouette() {
        let seen = seen(None, None).unwrap();
        assert_eq!(seen.trust(50.0, 50.0, 1.0), 1.0);
        assert!((0.1..0.9).contains(&seen.trust(75.0, 50.0, 1.0)));
        assert_eq!(seen.trust(79.5, 50.0, 1.0), 0.0);
        assert_eq!(seen.trust(50.0, 50.0, 1.01), 0.0);
        assert_eq!(seen.trust(-70.0, f32::NAN, 1.0), 0.0);
    }

    #[test]
    fn an_occluder_and_a_mask_hide_what_is_near_them() {
        let behind = seen(Some(0.05), None).unwrap();
        assert_eq!(behind.trust(50.0, 50.0, 1.0), 0.0);
        assert_eq!(behind.trust(61.5, 50.0, 1.0), 0.0);
        assert!(behind.trust(66.0, 50.0, 1.0) > 0.3);
        let mask = GrayImage::from_fn(101, 101, |x, _| image::Luma([if x < 50 { 0 } else { 255 }]));
        let masked = seen(None, Some(&mask)).unwrap();
        assert_eq!(masked.trust(51.0, 50.0, 1.0), 0.0);
        assert_eq!(masked.trust(61.0, 50.0, 1.0), 1.0);
    }
}
