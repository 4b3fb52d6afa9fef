//! Textures of the finished shape: the skin's atlas from the chosen frames, and the eyes' picture from the irises.
//! What is behind the person ([`Clip::person`]) and the clothes below the chin ([`skin_tone`]) never colour skin.

mod cuts;
mod mouth;
pub mod paper_eyes;
mod skin_tone;

use crate::faces::Clip;
use crate::head::Measured;
use crate::head::regions::covered_skin;
use crate::{FacewrightError, Method, TextureReport};
use cuts::{Cuts, cuts};
use geometry::{Progress, Transform, Vec2, Vec3};
use head::{GenericHead, part};
use image::{Rgba, RgbaImage, imageops};
use std::f64::consts::FRAC_PI_2;
use texture::iris::{EyeColours, EyeView, LIMBUS_ANGLE, measure, paint};
use texture::{BakeOptions, Baked, Occluder, Surface, View, bake, choose_views};

/// Frames that the texture is made of.
const VIEWS: usize = 16;
/// Side of one eye's picture, pixels.
const EYE_SIZE: u32 = 512;
/// Where the head's eye map has the equator of an eyeball, in halves of one eye's picture.
const EYE_EQUATOR: f64 = 0.768;
/// An average brown eye, for people who never open theirs in the clip.
const UNSEEN_IRIS: [f64; 3] = [74.0, 52.0, 38.0];
const UNSEEN_WHITE: [f64; 3] = [205.0, 196.0, 190.0];

/// Skin and eyes.
pub struct Skin {
    /// The skin's texture.
    pub texture: RgbaImage,
    /// Both eyes, the subject's right one in the left half.
    pub eyes: RgbaImage,
    /// How it was made.
    pub report: TextureReport,
    /// What the artist should know.
    pub warnings: Vec<String>,
}

/// Times of the steps, in parts: the skin's atlas, the eyes.
const PARTS: [f64; 2] = [90.0, 10.0];

/// Makes the textures, `size` pixels wide and high.
pub fn make_textures(
    clip: &Clip,
    measured: &Measured,
    size: u32,
    method: Method,
    progress: &Progress,
) -> Result<Skin, FacewrightError> {
    let [baking, of_eyes] = progress.split(&PARTS);
    let chosen = measured.chosen_poses();
    let poses: Vec<Transform> = chosen.iter().map(|(_, pose)| *pose).collect();
    let sharpness: Vec<f64> =
        chosen.iter().map(|(frame, _)| clip.faces.look(*frame).map_or(0.0, |look| look.sharpness)).collect();
    let picked = choose_views(&poses, &sharpness, VIEWS);
    let cuts = cuts(clip, measured, &chosen, &picked, method)?;
    let view = |&i: &usize| {
        let cut = cuts[i].head.as_ref()?;
        let (image, camera) = (&cut.image, cut.camera(&measured.camera));
        Some(View { image, camera, cam_from_head: poses[i], mask: cut.skin.as_ref(), sharpness: sharpness[i] })
    };
    let views: Vec<View> = picked.iter().filter_map(view).collect();
    let options = BakeOptions {
        size,
        method: match method {
            Method::Paper => texture::Method::Paper,
            Method::Default => texture::Method::Default,
        },
        ..BakeOptions::default()
    };
    let covered = covered_skin(clip.head, clip.faces.appearance());
    let baked = bake_skin((clip.head, &covered), &measured.positions, &views, &options, &baking)?;
    of_eyes.stage("texture: eyes")?;
    let (eyes, mut warnings) = make_eyes(&cuts, skin_colour(&baked.texture));
    warnings.extend(baked.warnings.iter().map(ToString::to_string));
    let used = picked.iter().zip(&baked.views).filter(|(_, v)| v.used);
    let gains = used.map(|(&i, v)| (clip.faces.frames[chosen[i].0].name.clone(), v.gain)).collect();
    let report = TextureReport { size, seen: baked.coverage, shading: baked.shading.clone(), gains };
    Ok(Skin { texture: baked.texture, eyes, report, warnings })
}

fn bake_skin(
    (head, covered): (&GenericHead, &[bool]),
    positions: &[Vec3],
    views: &[View],
    options: &BakeOptions,
    progress: &Progress,
) -> Result<Baked, FacewrightError> {
    let skin = head.skin();
    let triangles = head.triangles(skin);
    let uvs = head.triangle_uvs(skin);
    let is_seen = |v: usize| !head.cavity[v] && !covered.get(v).copied().unwrap_or(false);
    let weight: Vec<f64> = (0..head.cavity.len()).map(|v| if is_seen(v) { 1.0 } else { 0.0 }).collect();
    let surface =
        Surface { positions, triangles: &triangles, uvs: &uvs, weight: Some(&weight), mirror: Some(&head.mirror) };
    // Eyeballs stand before the sockets; teeth and tongue lie behind closed lips.
    let eyes: Vec<Vec<[u32; 3]>> =
        [part::EYE_LEFT, part::EYE_RIGHT].iter().filter_map(|n| head.part(n)).map(|p| head.triangles(p)).collect();
    let occluders: Vec<Occluder> = eyes.iter().map(|triangles| Occluder { positions, triangles }).collect();
    Ok(bake(&surface, &occluders, views, options, progress)?)
}

/// Both eyes side by side as the head's eye map wants them; an eye that no frame shows takes the other's colours.
fn make_eyes(cuts: &[Cuts], skin: Option<[f64; 3]>) -> (RgbaImage, Vec<String>) {
    let unshaded = |eye: EyeColours| skin.map_or(eye.clone(), |s| eye.unshaded(s));
    let [left, right] = [0, 1].map(|side| measure(&eye_views(cuts, side)).map(unshaded));
    let mut warnings = Vec::new();
    if left.is_none() && right.is_none() {
        warnings.push("no frame shows the irises: the eyes got an average colour".to_owned());
    }
    let usual = EyeColours::plain(UNSEEN_IRIS, UNSEEN_WHITE);
    let left_colours = left.as_ref().or(right.as_ref()).unwrap_or(&usual);
    let right_colours = right.as_ref().or(left.as_ref()).unwrap_or(&usual);
    (both_eyes(right_colours, left_colours), warnings)
}

/// The colour of the skin as the frames showed it: the upper quartile of each channel, because hair, beard and lips are darker.
fn skin_colour(texture: &RgbaImage) -> Option<[f64; 3]> {
    let seen: Vec<[u8; 3]> =
        texture.pixels().step_by(61).filter(|p| p.0[3] == 255).map(|p| [p.0[0], p.0[1], p.0[2]]).collect();
    let quartile = |c: usize| {
        let mut values: Vec<u8> = seen.iter().map(|p| p[c]).collect();
        values.sort_unstable();
        values.get(3 * values.len() / 4).map(|&v| f64::from(v))
    };
    Some([quartile(0)?, quartile(1)?, quartile(2)?])
}

/// The subject's right eye in the left half.
fn both_eyes(right: &EyeColours, left: &EyeColours) -> RgbaImage {
    let mut picture = RgbaImage::new(2 * EYE_SIZE, EYE_SIZE);
    for (colours, x) in [(right, 0), (left, i64::from(EYE_SIZE))] {
        imageops::replace(&mut picture, &paint(colours, EYE_SIZE, EYE_EQUATOR), x, 0);
    }
    picture
}

/// Where both eyes' picture shows a place: `side` 0 is the subject's left, `across` the way from the gaze in radii of the iris.
pub fn eye_uv(side: usize, across: &Vec2) -> [f32; 2] {
    let place = across * (LIMBUS_ANGLE / FRAC_PI_2 * EYE_EQUATOR / 2.0);
    let middle = [0.75, 0.25][side];
    [(middle + place.x / 2.0) as f32, (0.5 + place.y) as f32]
}

fn eye_views(cuts: &[Cuts], side: usize) -> Vec<EyeView<'_>> {
    let seen = cuts.iter().filter_map(|cuts| cuts.eyes[side].as_ref());
    seen.map(|(cut, iris)| EyeView {
        image: &cut.image,
        centre: iris.centre,
        radius: iris.radius,
        opening: &iris.eye_contour,
    })
    .collect()
}

/// Plain textures for a head without frames: skin and eyes.
pub fn plain() -> (RgbaImage, RgbaImage) {
    let colours = EyeColours::plain(UNSEEN_IRIS, UNSEEN_WHITE);
    let skin = RgbaImage::from_pixel(16, 16, Rgba([198, 156, 134, 255]));
    (skin, both_eyes(&colours, &colours))
}
