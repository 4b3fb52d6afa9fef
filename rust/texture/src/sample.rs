//! One view as the atlas sees it: for every texel its pixel, how good the view is there, and the picture's colour.
//!
//! A texel's score is `(cosine of the viewing angle)^power × pixels per metre² × sharpness × permission × trust`.

use crate::atlas::{BakeOptions, Occluder, Surface, View};
use crate::plane::{Plane, Stretched, Texel};
use crate::shading::Shading;
use crate::visibility::{Margin, Visibility};
use geometry::{Transform, Vec3};
use image::RgbImage;
use raster::{Fragment, NO_TRIANGLE, PictureVertex, project};
use rayon::prelude::*;

/// A vertex of the surface in one view, ready for perspective-correct interpolation.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Corner {
    /// One over the depth, 1/metres; zero without pixel.
    inverse_depth: f32,
    /// Pixel times inverse depth.
    pixel: [f32; 2],
    /// Score but for the trust; zero where the surface looks away.
    score: f32,
    /// What the colour is multiplied with.
    gain: [f32; 3],
}

impl Corner {
    pub(crate) fn new(vertex: &Option<PictureVertex>, score: f64) -> Self {
        let Some(v) = vertex else { return Self::default() };
        let pixel = [0, 1].map(|k| (v.pixel[k] * v.inverse_depth) as f32);
        Self { inverse_depth: v.inverse_depth as f32, pixel, score: score as f32, gain: [1.0; 3] }
    }
}

/// Pixel and depth of a texel.
pub(crate) fn locate(corners: &[&Corner; 3], weights: &[f32; 3]) -> ([f32; 2], f32) {
    let [a, b, c] = corners;
    let mix = |a: f32, b: f32, c: f32| weights[0] * a + weights[1] * b + weights[2] * c;
    let depth = 1.0 / mix(a.inverse_depth, b.inverse_depth, c.inverse_depth);
    let pixel = |k: usize| mix(a.pixel[k], b.pixel[k], c.pixel[k]) * depth;
    ([pixel(0), pixel(1)], depth)
}

/// The bilinear colour of a picture; coordinates are held inside it.
pub(crate) fn bilinear(picture: &RgbImage, u: f32, v: f32) -> [f32; 3] {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let (u, v) = (u.clamp(0.0, (width - 1) as f32), v.clamp(0.0, (height - 1) as f32));
    let (x, y) = (u as usize, v as usize);
    let (fx, fy) = (u - x as f32, v - y as f32);
    let (right, down) = (if x + 1 < width { 3 } else { 0 }, if y + 1 < height { 3 * width } else { 0 });
    let bytes = picture.as_raw();
    let at = 3 * (y * width + x);
    let channel = |k: usize| {
        let i = at + k;
        let top = f32::from(bytes[i]) * (1.0 - fx) + f32::from(bytes[i + right]) * fx;
        let bottom = f32::from(bytes[i + down]) * (1.0 - fx) + f32::from(bytes[i + down + right]) * fx;
        top * (1.0 - fy) + bottom * fy
    };
    [channel(0), channel(1), channel(2)]
}

/// A view with what hides the surface in it.
pub(crate) struct Sight<'a> {
    picture: &'a RgbImage,
    triangles: &'a [[u32; 3]],
    cam_from_head: Transform,
    visibility: Visibility,
    corners: Vec<Corner>,
    /// Per triangle whether any of it can be seen.
    facing: Vec<bool>,
}

impl<'a> Sight<'a> {
    /// `None` when the view shows nothing of the surface. `normals` are unit vertex normals in the head frame.
    pub(crate) fn new(
        surface: &Surface<'a>,
        normals: &[Vec3],
        occluders: &[Occluder],
        view: &View<'a>,
        options: &BakeOptions,
    ) -> Option<Self> {
        let vertices = project(&view.camera, &view.cam_from_head, surface.positions);
        let before: Vec<_> =
            occluders.iter().map(|o| project(&view.camera, &view.cam_from_head, o.positions)).collect();
        let before: Vec<_> = before.iter().zip(occluders).map(|(v, o)| (&v[..], o.triangles)).collect();
        let margin = Margin { pixels: options.margin_px, metres: options.margin, feather: options.feather };
        let visibility = Visibility::new((&vertices, surface.triangles), &before, &view.camera, view.mask, &margin)?;
        let score = |i: usize| {
            let eye = -view.cam_from_head.apply(&surface.positions[i]);
            let cosine = (view.cam_from_head.rotation * normals[i]).dot(&eye) / eye.norm().max(1e-9);
            let slack = options.max_angle.cos();
            let facing = ((cosine - slack) / (1.0 - slack)).max(0.0).powf(options.angle_power);
            let density = view.camera.fx * view.camera.fy / (eye.z * eye.z);
            facing * density * view.sharpness * surface.weight.map_or(1.0, |w| w[i].clamp(0.0, 1.0))
        };
        let corners: Vec<_> = vertices.iter().enumerate().map(|(i, v)| Corner::new(v, score(i))).collect();
        let faces_us = |t: &[u32; 3]| {
            let corners = t.map(|i| &corners[i as usize]);
            corners.iter().all(|c| c.inverse_depth > 0.0) && corners.iter().any(|c| c.score > 0.0)
        };
        let facing: Vec<bool> = surface.triangles.iter().map(faces_us).collect();
        facing.contains(&true).then_some(Self {
            picture: view.image,
            triangles: surface.triangles,
            cam_from_head: view.cam_from_head,
            visibility,
            corners,
            facing,
        })
    }

    /// `cam_from_head` of the view.
    pub(crate) fn pose(&self) -> &Transform {
        &self.cam_from_head
    }

    /// Turns the view's colours into those of the texture: takes the shading and the view's log-gain out.
    pub(crate) fn correct(&mut self, normals: &[Vec3], shading: &Shading, log_gain: &[f64; 3]) {
        for (corner, normal) in self.corners.iter_mut().zip(normals) {
            let shade = shading.log_gain(normal, &self.cam_from_head);
            corner.gain = [0, 1, 2].map(|k| (-shade[k] - log_gain[k]).exp() as f32);
        }
    }

    /// Colours and scores of all texels.
    pub(crate) fn sample(&self, map: &Plane<Fragment>) -> Plane<Texel> {
        let mut atlas = Plane::new(map.width, map.height, [0.0; 4]);
        self.sample_into(&mut atlas, map, None);
        atlas
    }

    /// [`Sight::sample`] into an atlas of the map's size, every texel of which is overwritten; `consistency` is
    /// multiplied into the scores.
    pub(crate) fn sample_into(
        &self,
        atlas: &mut Plane<Texel>,
        map: &Plane<Fragment>,
        consistency: Option<&Plane<f32>>,
    ) {
        let (width, height) = (map.width, map.height);
        let consistency = consistency.map(|plane| Stretched::new(plane, width, height));
        atlas.data.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            let scale = consistency.as_ref().map(|plane| plane.row(y));
            for (x, (texel, fragment)) in row.iter_mut().zip(map.row(y)).enumerate() {
                *texel = [0.0; 4];
                if fragment.triangle == NO_TRIANGLE || !self.facing[fragment.triangle as usize] {
                    continue;
                }
                let Some(sampled) = self.texel(fragment) else { continue };
                *texel = sampled;
                texel[3] *= scale.as_ref().map_or(1.0, |row| row.at(x));
            }
        });
    }

    fn texel(&self, fragment: &Fragment) -> Option<Texel> {
        let corners = self.triangles[fragment.triangle as usize].map(|i| &self.corners[i as usize]);
        let weights = fragment.weights();
        let mix = |a: f32, b: f32, c: f32| weights[0] * a + weights[1] * b + weights[2] * c;
        let score = mix(corners[0].score, corners[1].score, corners[2].score);
        if score <= 0.0 {
            return None;
        }
        let ([u, v], depth) = locate(&corners, &weights);
        let trust = self.visibility.trust(u, v, depth);
        if trust <= 0.0 {
            return None;
        }
        let colour = bilinear(self.picture, u, v);
        let lit = |k: usize| colour[k] * mix(corners[0].gain[k], corners[1].gain[k], corners[2].gain[k]);
        Some([lit(0), lit(1), lit(2), score * trust])
    }
}
