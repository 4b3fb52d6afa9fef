//! Frames that the texture was not made of, held against the head drawn over them.

use crate::FacewrightError;
use crate::faces::{Clip, median};
use crate::head::Measured;
use crate::texture::Skin;
use geometry::{Camera, Vec2};
use head::GenericHead;
use image::{GrayImage, RgbImage, RgbaImage, imageops};
use rayon::prelude::*;
use texture::{DrawOptions, Layer, Painter, Surface};
use vision::landmarks::{Face, MaskOptions, face_mask};

/// Distance between the eyes at which they are, pixels: wrinkles and brows count, pores and noise do not.
pub(super) const EYES_PX: f64 = 48.0;
/// Skin this near the outline is left out, as part of its distance from the middle of the face: there it turns away.
const OUTLINE: f64 = 0.12;
/// Fewer pixels than this tell nothing.
const FEWEST: usize = 400;

/// How well the head, drawn with its texture, correlates with frames that the texture was not made of, −1…1: the median over them; `None`
/// where the texture was made of all good frames.
pub fn correlation(clip: &Clip, measured: &Measured, skin: &Skin) -> Result<Option<f64>, FacewrightError> {
    let frames = held_out(clip, measured, skin);
    if frames.is_empty() {
        return Ok(None);
    }
    let shown = Shown::new(clip.head);
    let compare = |&frame: &usize| shown.compare(clip, measured, skin, frame);
    let all: Result<Vec<_>, FacewrightError> = frames.par_iter().map(compare).collect();
    let found: Vec<f64> = all?.into_iter().flatten().collect();
    Ok((!found.is_empty()).then(|| median(found.into_iter())))
}

/// Frames with a face, a pose of their points, and a quiet face, which no texel was taken from.
fn held_out(clip: &Clip, measured: &Measured, skin: &Skin) -> Vec<usize> {
    let name = |frame: usize| &clip.faces.frames[frame].name;
    let is_quiet = |frame: usize| match &measured.chosen.verdicts[frame] {
        Ok(_) => true,
        Err(reason) => matches!(reason.kind(), crate::ReasonKind::Alike | crate::ReasonKind::Enough),
    };
    let all: Vec<usize> = (0..clip.frames.len())
        .filter(|&f| clip.faces.face(f).is_some() && measured.frames[f].pose.is_some() && is_quiet(f))
        .filter(|&f| !skin.report.gains.contains_key(name(f)))
        .collect();
    super::spread(&all)
}

/// The skin as the painter takes it.
struct Shown {
    triangles: Vec<[u32; 3]>,
    uvs: Vec<[Vec2; 3]>,
}

impl Shown {
    fn new(head: &GenericHead) -> Self {
        let skin = head.skin();
        Self { triangles: head.triangles(skin), uvs: head.triangle_uvs(skin) }
    }

    fn compare(
        &self,
        clip: &Clip,
        measured: &Measured,
        skin: &Skin,
        frame: usize,
    ) -> Result<Option<f64>, FacewrightError> {
        let (Some(face), Some(pose)) = (clip.faces.face(frame), measured.frames[frame].pose) else { return Ok(None) };
        let factor = (EYES_PX / face.eye_distance().max(1.0)).min(1.0);
        let camera = measured.camera.resized(factor);
        let surface = Surface::drawn(&measured.positions, &self.triangles, &self.uvs);
        let painter = Painter::new(&[Layer { surface, texture: &skin.texture }])?;
        let options = DrawOptions { shading: skin.report.shading.as_ref(), ..DrawOptions::default() };
        let drawn = painter.draw(&camera, &pose, &options)?;
        let picture = clip.frames.picture(frame)?;
        Ok(compare(&picture, &drawn, &resized(face, factor), &camera))
    }
}

/// A face in a resized picture.
fn resized(face: &Face, factor: f64) -> Face {
    let mut face = face.clone();
    let move_to = |x: &mut f64| *x = (*x + 0.5) * factor - 0.5;
    face.points.iter_mut().for_each(|p| p.iter_mut().take(2).for_each(move_to));
    face.irises.iter_mut().flat_map(|iris| &mut iris.eye_contour).for_each(|p| p.iter_mut().for_each(move_to));
    face
}

/// The correlation of both pictures' grey levels on the skin that both show.
fn compare(picture: &RgbImage, drawn: &RgbaImage, face: &Face, camera: &Camera) -> Option<f64> {
    let (width, height) = (camera.width, camera.height);
    let grey = imageops::resize(&imageops::grayscale(picture), width, height, imageops::FilterType::Triangle);
    let options = MaskOptions { shrink: OUTLINE, ..MaskOptions::default() };
    let mask = face_mask(face, width, height, &options);
    let luma: GrayImage = imageops::grayscale(drawn);
    let pixels = mask.pixels().zip(drawn.pixels()).zip(grey.pixels().zip(luma.pixels()));
    let both = pixels.filter(|((mask, drawn), _)| mask.0[0] == 255 && drawn.0[3] == 255);
    let pairs: Vec<[f64; 2]> = both.map(|(_, (a, b))| [f64::from(a.0[0]), f64::from(b.0[0])]).collect();
    (pairs.len() >= FEWEST).then(|| correlate(&pairs))
}

fn correlate(pairs: &[[f64; 2]]) -> f64 {
    let n = pairs.len() as f64;
    let mean = |k: usize| pairs.iter().map(|p| p[k]).sum::<f64>() / n;
    let means = [mean(0), mean(1)];
    let product = |i: usize, j: usize| pairs.iter().map(|p| (p[i] - means[i]) * (p[j] - means[j])).sum::<f64>();
    product(0, 1) / (product(0, 0) * product(1, 1)).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_and_contrast_do_not_count_and_another_picture_does() {
        let wave = |k: usize, shift: f64| (k as f64 * 0.4 + shift).sin();
        let same: Vec<[f64; 2]> = (0..600).map(|k| [wave(k, 0.0), 40.0 + 3.0 * wave(k, 0.0)]).collect();
        let other: Vec<[f64; 2]> = (0..600).map(|k| [wave(k, 0.0), wave(k, 1.57)]).collect();
        assert!(correlate(&same) > 0.999 && correlate(&other).abs() < 0.1);
    }
}
