//! Draws textured meshes through a camera, to be laid over a frame.
//!
//! [`draw`] for one picture, [`Painter`] for many. Each pixel is the mean of several samples, each filtered from the two
//! nearest levels of the texture's pyramid; alpha is the share of the pixel that is covered. With a [`Shading`] the
//! texture is lit as in the frame.

use crate::atlas::{Surface, validate_surface};
use crate::error::TextureError;
use crate::sample::bilinear;
use crate::shading::Shading;
use geometry::mesh::vertex_normals;
use geometry::{Camera, Transform, Vec2, Vec3};
use image::{RgbImage, RgbaImage};
use raster::{Fragment, NO_TRIANGLE, PictureVertex, Window, draw_fragments, project, texel_of};
use rayon::prelude::*;

/// A mesh with its texture.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// The mesh; weight and mirror are not used.
    pub surface: Surface<'a>,
    /// Its texture, any size; alpha is not used.
    pub texture: &'a RgbaImage,
}

/// How [`draw`] lights and samples.
#[derive(Clone, Copy, Debug)]
pub struct DrawOptions<'a> {
    /// Light the texture as the frame is lit; without it the texture is drawn as it is.
    pub shading: Option<&'a Shading>,
    /// Brightness of the frame per channel, as [`crate::ViewReport::gain`].
    pub gain: [f64; 3],
    /// Samples per pixel along each axis, 1…8.
    pub supersampling: u32,
}

impl Default for DrawOptions<'_> {
    fn default() -> Self {
        Self { shading: None, gain: [1.0; 3], supersampling: 2 }
    }
}

/// Draws the layers once; see [`Painter`].
pub fn draw(
    layers: &[Layer],
    camera: &Camera,
    cam_from_head: &Transform,
    options: &DrawOptions,
) -> Result<RgbaImage, TextureError> {
    Painter::new(layers)?.draw(camera, cam_from_head, options)
}

/// Layers ready to be drawn many times.
pub struct Painter<'a> {
    layers: Vec<Prepared<'a>>,
}

struct Prepared<'a> {
    surface: Surface<'a>,
    normals: Vec<Vec3>,
    /// Texture and its halvings.
    levels: Vec<RgbImage>,
    /// Number of the layer's first triangle among all.
    first: u32,
}

/// A layer in one picture.
struct Posed<'a> {
    layer: &'a Prepared<'a>,
    vertices: Vec<Option<PictureVertex>>,
    /// What the texture is multiplied with at each vertex.
    gains: Vec<[f32; 3]>,
}

impl<'a> Painter<'a> {
    /// Checks the layers and builds the pyramids of their textures.
    pub fn new(layers: &[Layer<'a>]) -> Result<Self, TextureError> {
        let mut first = 0;
        let mut prepared = Vec::with_capacity(layers.len());
        for layer in layers {
            validate_surface(&layer.surface)?;
            if layer.texture.is_empty() {
                return Err(TextureError::NoTexels);
            }
            let normals = vertex_normals(layer.surface.positions, layer.surface.triangles);
            prepared.push(Prepared { surface: layer.surface, normals, levels: halvings(layer.texture), first });
            first += layer.surface.triangles.len() as u32;
        }
        Ok(Self { layers: prepared })
    }

    /// The layers as a camera sees them: sRGB, size of the camera, straight alpha, transparent where nothing is.
    pub fn draw(
        &self,
        camera: &Camera,
        cam_from_head: &Transform,
        options: &DrawOptions,
    ) -> Result<RgbaImage, TextureError> {
        camera.validate()?;
        let n = options.supersampling;
        if !(1..=8).contains(&n) {
            let (name, value, range) = ("the supersampling", f64::from(n), "1 to 8");
            return Err(TextureError::Option { name, value, range });
        }
        let fine = camera.resized(f64::from(n));
        let posed: Vec<_> = self.layers.iter().map(|l| l.pose(&fine, cam_from_head, options)).collect();
        let all: Vec<_> = posed.iter().flat_map(|p| p.vertices.iter().copied()).collect();
        let mut picture = RgbaImage::new(camera.width, camera.height);
        let Some(window) = Window::around(&all, &fine, 0).map(|w| w.aligned(n)) else { return Ok(picture) };
        let mut fragments = vec![Fragment::EMPTY; window.width * window.height];
        for p in &posed {
            draw_fragments(&mut fragments, &p.vertices, p.layer.surface.triangles, &window, p.layer.first);
        }
        let triangles: Vec<(usize, f32)> = posed.iter().enumerate().flat_map(|(k, p)| p.levels_of_detail(k)).collect();
        let n = n as usize;
        let (left, top) = (window.x as usize / n, window.y as usize / n);
        let row_bytes = 4 * camera.width as usize;
        picture.par_chunks_exact_mut(row_bytes).skip(top).zip(fragments.par_chunks(window.width * n)).for_each(
            |(row, samples)| {
                for (x, pixel) in row.chunks_exact_mut(4).skip(left).take(window.width / n).enumerate() {
                    let square = (0..n).flat_map(|j| &samples[j * window.width + x * n..][..n]);
                    pixel.copy_from_slice(&mean_colour(square, &posed, &triangles, n * n));
                }
            },
        );
        Ok(picture)
    }
}

/// Mean of the samples of one pixel.
fn mean_colour<'f>(
    samples: impl Iterator<Item = &'f Fragment>,
    posed: &[Posed],
    triangles: &[(usize, f32)],
    count: usize,
) -> [u8; 4] {
    let (mut sum, mut covered) = ([0.0f32; 3], 0);
    for fragment in samples.filter(|f| f.triangle != NO_TRIANGLE) {
        let (layer, detail) = triangles[fragment.triangle as usize];
        let colour = posed[layer].colour(fragment, detail);
        (0..3).for_each(|k| sum[k] += colour[k].min(255.0));
        covered += 1;
    }
    if covered == 0 {
        return [0; 4];
    }
    let [r, g, b] = sum.map(|s| (s / covered as f32).round() as u8);
    [r, g, b, (255.0 * covered as f32 / count as f32).round() as u8]
}

impl<'a> Prepared<'a> {
    fn pose(&'a self, camera: &Camera, cam_from_head: &Transform, options: &DrawOptions) -> Posed<'a> {
        let gain = |normal: &Vec3| {
            let shade = options.shading.map_or([0.0; 3], |s| s.log_gain(normal, cam_from_head));
            [0, 1, 2].map(|k| (shade[k].exp() * options.gain[k]) as f32)
        };
        let vertices = project(camera, cam_from_head, self.surface.positions);
        Posed { layer: self, vertices, gains: self.normals.iter().map(gain).collect() }
    }

    /// The texture at a coordinate and a level of its pyramid, linear in all three.
    fn texture_at(&self, uv: &Vec2, detail: f32) -> [f32; 3] {
        let detail = detail.clamp(0.0, (self.levels.len() - 1) as f32);
        let at = |level: usize| {
            let texture = &self.levels[level];
            let place = texel_of(uv, texture.width() as usize, texture.height() as usize);
            bilinear(texture, place.x as f32, place.y as f32)
        };
        let (fine, part) = (detail as usize, detail.fract());
        if part == 0.0 {
            return at(fine);
        }
        let (a, b) = (at(fine), at(fine + 1));
        [0, 1, 2].map(|k| a[k] * (1.0 - part) + b[k] * part)
    }
}

impl Posed<'_> {
    /// Per triangle the layer's number and the level of the pyramid whose texels are as large as the samples.
    fn levels_of_detail(&self, layer: usize) -> impl Iterator<Item = (usize, f32)> {
        let surface = &self.layer.surface;
        let size = self.layer.levels[0].dimensions();
        surface.triangles.iter().zip(surface.uvs).map(move |(triangle, uvs)| {
            let area = |[a, b, c]: [Vec2; 3]| (b - a).perp(&(c - a)).abs();
            let texels = area(*uvs) * f64::from(size.0) * f64::from(size.1);
            let corner = |i: u32| self.vertices[i as usize].map(|v| v.pixel);
            let detail = match triangle.map(corner) {
                [Some(a), Some(b), Some(c)] => 0.5 * (texels / area([a, b, c]).max(1e-3)).max(1e-9).log2(),
                _ => 0.0,
            };
            (layer, detail as f32)
        })
    }

    fn colour(&self, fragment: &Fragment, detail: f32) -> [f32; 3] {
        let index = (fragment.triangle - self.layer.first) as usize;
        let (triangle, uvs) = (&self.layer.surface.triangles[index], &self.layer.surface.uvs[index]);
        let weights = fragment.weights();
        let uv = (0..3).fold(Vec2::zeros(), |sum, k| sum + uvs[k] * f64::from(weights[k]));
        let colour = self.layer.texture_at(&uv, detail);
        let gain = |c: usize| (0..3).map(|k| weights[k] * self.gains[triangle[k] as usize][c]).sum::<f32>();
        [0, 1, 2].map(|c| colour[c] * gain(c))
    }
}

/// The texture without alpha, halved until it is one texel wide or high.
fn halvings(texture: &RgbaImage) -> Vec<RgbImage> {
    let colours = texture.pixels().flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut levels = vec![RgbImage::from_raw(texture.width(), texture.height(), colours).unwrap_or_default()];
    while let Some(last) = levels.last().filter(|l| l.width() > 1 && l.height() > 1) {
        let half = RgbImage::from_fn(last.width() / 2, last.height() / 2, |x, y| {
            let mean = |k: usize| {
                let at = |i: u32, j: u32| u32::from(last.get_pixel(2 * x + i, 2 * y + j)[k]);
                ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8
            };
            image::Rgb([mean(0), mean(1), mean(2)])
        });
        levels.push(half);
    }
    levels
}
