//! What the nets see in a frame: the face that is followed, and how sharp it is.

use super::Faces;
use super::appearance::Appearance;
use super::shots::Signature;
use crate::patches::octave;
use crate::{FacewrightError, FrameSet};
use geometry::Progress;
use image::{GrayImage, RgbImage, imageops};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};
use vision::landmarks::{Face, FaceLandmarker};

/// Looks that one task takes one after the other: fixed, so that the result does not depend on the threads.
pub(super) const CHUNK: usize = 12;
/// Side of the square to which a face is resized before its sharpness is measured, pixels.
const SHARPNESS_SIZE: u32 = 96;

/// One frame, looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// The face that is followed: at first the largest one; `null` when it is not there.
    pub face: Option<Face>,
    /// Whether another face had become the largest.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rival: bool,
    /// Whether the frame is of another shot than the longest one, whose face is followed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub other_shot: bool,
    /// What the face's pixels say of light and cover; `None` without a face, and in older files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub appearance: Option<Appearance>,
    /// What it is compared with other looks by, until the shots are known.
    #[serde(skip)]
    pub(super) signature: Option<Signature>,
    /// Mean squared Laplacian of the face at a fixed size, relative to its contrast; compare within a clip.
    pub sharpness: f64,
}

/// Looks at frames, ascending, that nobody has looked at. The first looks begin with the largest face, or with that of `known`, a face in
/// some of the frames.
pub fn look_at(
    faces: &mut Faces,
    (wanted, known): (&[usize], &[(usize, Face)]),
    frames: &FrameSet,
    landmarker: &FaceLandmarker,
    progress: &Progress,
) -> Result<(), FacewrightError> {
    let eyes = Eyes { frames, landmarker, known, progress, done: AtomicUsize::new(0), total: wanted.len() };
    let is_first = faces.looked().is_empty();
    for film in frames.films() {
        let wanted: Vec<usize> = wanted.iter().copied().filter(|frame| film.contains(frame)).collect();
        let looks = if is_first { eyes.first(&wanted)? } else { eyes.further(faces, &wanted)? };
        wanted.iter().zip(looks).for_each(|(&frame, look)| faces.frames[frame].look = Some(look));
    }
    Ok(())
}

/// What a look takes.
struct Eyes<'a> {
    frames: &'a FrameSet,
    landmarker: &'a FaceLandmarker,
    /// The face that is followed, in some frames.
    known: &'a [(usize, Face)],
    progress: &'a Progress,
    done: AtomicUsize,
    total: usize,
}

impl Eyes<'_> {
    /// One look: for the same face as before, if there was one.
    fn look(&self, frame: usize, before: Option<&Face>, rival: bool) -> Result<Look, FacewrightError> {
        self.progress.step(self.done.fetch_add(1, Ordering::Relaxed).min(self.total), self.total)?;
        let picture = self.frames.picture(frame)?;
        let face = match before {
            Some(before) => self.landmarker.follow(&picture, before)?,
            None => self.landmarker.find(&picture)?,
        };
        let face = face.map(Face::rounded);
        if let Some(face) = &face {
            self.frames.keep_pyramid(frame, &picture, octave(face.eye_distance()));
        }
        let sharpness = face.as_ref().map_or(0.0, |face| sharpness(&picture, face));
        let appearance = face.as_ref().map(|face| Appearance::of(&picture, face).rounded());
        let signature = face.as_ref().map(|face| Signature::of(&picture, face));
        Ok(Look { face, rival, other_shot: false, appearance, signature, sharpness })
    }

    /// The first looks. Tasks begin with the largest face; where that is not the one that the task before ended with, its frames
    /// are looked at again, for that one.
    fn first(&self, wanted: &[usize]) -> Result<Vec<Look>, FacewrightError> {
        let chunk = |frames: &[usize], before: Option<&Face>| -> Result<Vec<Look>, FacewrightError> {
            let mut looks: Vec<Look> = Vec::with_capacity(frames.len());
            for &frame in frames {
                let last = looks.last().map_or(before, |look| look.face.as_ref());
                looks.push(self.look(frame, last, before.is_some() && self.known.is_empty())?);
            }
            Ok(looks)
        };
        let nearest =
            |frame: usize| self.known.iter().min_by_key(|(other, _)| other.abs_diff(frame)).map(|(_, face)| face);
        let begin = |frames: &[usize]| chunk(frames, frames.first().and_then(|&frame| nearest(frame)));
        let chunks: Result<Vec<_>, _> = wanted.par_chunks(CHUNK).map(begin).collect();
        let mut chunks = chunks?;
        for k in 1..chunks.len() {
            let ends = (chunks[k - 1].last(), chunks[k].first());
            let (Some(before), Some(after)) =
                (ends.0.and_then(|look| look.face.clone()), ends.1.and_then(|look| look.face.as_ref()))
            else {
                continue;
            };
            if after.faces_in_picture > 1 && !after.may_follow(&before) {
                let frames = &wanted[k * CHUNK..wanted.len().min((k + 1) * CHUNK)];
                chunks[k] = chunk(frames, Some(&before))?;
            }
        }
        Ok(chunks.into_iter().flatten().collect())
    }

    /// Looks between others: for the face of the nearest look that saw it.
    fn further(&self, faces: &Faces, wanted: &[usize]) -> Result<Vec<Look>, FacewrightError> {
        let seen: Vec<usize> = faces.looked().into_iter().filter(|&frame| faces.face(frame).is_some()).collect();
        let look = |&frame: &usize| {
            let of_film = seen.iter().filter(|&&other| self.frames.is_one_film(other, frame));
            let nearest = of_film.min_by_key(|&&other| other.abs_diff(frame));
            self.look(frame, nearest.and_then(|&other| faces.face(other)), false)
        };
        wanted.par_iter().map(look).collect()
    }
}

/// The rectangle around a face's landmarks, within a picture of this width and height: `[x, y, width, height]`.
pub(crate) fn face_box(face: &Face, (width, height): (u32, u32)) -> [u32; 4] {
    let range = |k: usize, size: u32| {
        let values = || face.points.iter().map(|p| p[k]);
        let low = values().fold(f64::MAX, f64::min).clamp(0.0, f64::from(size) - 1.0);
        let high = values().fold(f64::MIN, f64::max).clamp(0.0, f64::from(size) - 1.0);
        (low as u32, (high - low) as u32 + 1)
    };
    let ((x, width), (y, height)) = (range(0, width), range(1, height));
    [x, y, width, height]
}

fn sharpness(picture: &RgbImage, face: &Face) -> f64 {
    let [x, y, width, height] = face_box(face, picture.dimensions());
    let crop = imageops::grayscale(&imageops::crop_imm(picture, x, y, width, height).to_image());
    let small = imageops::resize(&crop, SHARPNESS_SIZE, SHARPNESS_SIZE, imageops::FilterType::Triangle);
    laplacian_energy(&small)
}

fn laplacian_energy(picture: &GrayImage) -> f64 {
    let (width, height) = picture.dimensions();
    let at = |x: u32, y: u32| f64::from(picture.get_pixel(x, y).0[0]);
    let (mut energy, mut sum, mut squares, mut n) = (0.0, 0.0, 0.0, 0.0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let centre = at(x, y);
            let laplacian = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1) - 4.0 * centre;
            energy += laplacian * laplacian;
            sum += centre;
            squares += centre * centre;
            n += 1.0;
        }
    }
    let variance = squares / n - (sum / n).powi(2);
    energy / n / variance.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_lowers_the_sharpness_and_exposure_does_not() {
        // A shape and its fine grain: blur takes the grain and leaves the shape.
        let wave = |x: u32, y: u32, f: f64| (f64::from(x) * f).sin() * (f64::from(y) * 0.8 * f).cos();
        let pattern = |x: u32, y: u32| 70.0 + 40.0 * wave(x, y, 0.1) + 20.0 * wave(x, y, 1.1);
        let sharp = GrayImage::from_fn(96, 96, |x, y| image::Luma([pattern(x, y) as u8]));
        let bright = GrayImage::from_fn(96, 96, |x, y| image::Luma([(pattern(x, y) * 1.6) as u8]));
        let blurred = imageops::blur(&sharp, 2.0);
        assert!(laplacian_energy(&blurred) < 0.5 * laplacian_energy(&sharp));
        assert!((laplacian_energy(&bright) / laplacian_energy(&sharp) - 1.0).abs() < 0.1);
    }
}
