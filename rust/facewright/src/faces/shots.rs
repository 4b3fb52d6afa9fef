//! Cuts: a film whose pictures and faces change at once shows another scene, often another person.
//!
//! Two looks belong to different shots when neither the whole pictures nor the faces resemble each other. Looks that follow one another in
//! a film do: their pictures correlate by at least 0.71 (a woman who bows before the camera; all other good films 0.75 and more) or
//! their faces by at least 0.83. Pictures of different films correlate by at most 0.46, or are of the same man in the same chair; faces of
//! different people by at most 0.88.

use super::Faces;
use super::appearance::colours;
use geometry::face_mesh::LANDMARKS;
use image::{RgbImage, imageops};
use vision::landmarks::Face;

/// Size of the picture that is compared.
const PICTURE: [u32; 2] = [24, 18];
/// Every so many landmarks the faces' grey levels are compared.
const EVERY: usize = 3;
/// Pictures that correlate by less are of different scenes …
const PICTURES: f64 = 0.6;
/// … if their faces correlate by less than this too.
const FACES: f64 = 0.9;

/// Shots are those of a film, not photographs one by one, where the longest one is at least this part of it.
const LONGEST: f64 = 1.0 / 3.0;

/// What a look is compared by.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signature {
    picture: Vec<f64>,
    face: Vec<f64>,
}

impl Signature {
    /// Of a face in its picture.
    pub fn of(picture: &RgbImage, face: &Face) -> Self {
        let [width, height] = PICTURE;
        let small = imageops::thumbnail(picture, width, height);
        let places: Vec<usize> = (0..LANDMARKS).step_by(EVERY).collect();
        let grey = |c: &[f64; 3]| 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2];
        let colours = colours(picture, face, &places);
        // A face that leaves the picture has fewer colours, and nothing to compare them with.
        let face = if colours.len() == places.len() { colours.iter().map(grey).collect() } else { Vec::new() };
        Self { picture: imageops::grayscale(&small).pixels().map(|p| f64::from(p.0[0])).collect(), face }
    }

    /// Whether another look is of the same shot.
    fn resembles(&self, other: &Self) -> bool {
        let alike = |a: &[f64], b: &[f64], least: f64| correlation(a, b).is_none_or(|found| found >= least);
        alike(&self.picture, &other.picture, PICTURES) || alike(&self.face, &other.face, FACES)
    }
}

/// `None` where there is nothing to compare.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let n = a.len() as f64;
    if a.is_empty() || a.len() != b.len() {
        return None;
    }
    let [mean_a, mean_b] = [a, b].map(|values| values.iter().sum::<f64>() / n);
    let product =
        |x: &[f64], mx: f64, y: &[f64], my: f64| x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>();
    let scale = (product(a, mean_a, a, mean_a) * product(b, mean_b, b, mean_b)).sqrt();
    (scale > 0.0).then(|| product(a, mean_a, b, mean_b) / scale)
}

/// Looks that saw a face, each with the next one of another shot: `[last of one, first of the other]`.
fn cuts(faces: &Faces) -> Vec<[usize; 2]> {
    let seen: Vec<usize> = faces.looked().into_iter().filter(|&frame| faces.face(frame).is_some()).collect();
    let is_cut = |&[a, b]: &[usize; 2]| matches!((signature(faces, a), signature(faces, b)), (Some(a), Some(b)) if !a.resembles(b));
    seen.windows(2).map(|pair| [pair[0], pair[1]]).filter(is_cut).collect()
}

fn signature(faces: &Faces, frame: usize) -> Option<&Signature> {
    faces.look(frame)?.signature.as_ref()
}

/// Frames to look at before it is known where the cuts are: the middles of the gaps that hold one.
pub fn undecided(faces: &Faces) -> Vec<usize> {
    let middle = |[a, b]: [usize; 2]| {
        (a + 1..b).filter(|&f| faces.look(f).is_none()).min_by_key(|f| f.abs_diff(usize::midpoint(a, b)))
    };
    cuts(faces).into_iter().filter_map(middle).collect()
}

/// Leaves out what does not belong to the longest shot: those frames show no face, for the reason that they are of another shot.
pub fn leave_out_others(faces: &mut Faces) {
    let cuts = cuts(faces);
    if cuts.is_empty() {
        return;
    }
    let ends = cuts.iter().map(|[_, first]| *first).chain([faces.frames.len()]);
    let starts = [0].into_iter().chain(cuts.iter().map(|[_, first]| *first));
    let shots: Vec<std::ops::Range<usize>> = starts.zip(ends).map(|(start, end)| start..end).collect();
    // The first of those that are equally long.
    let Some(longest) = shots.iter().rev().max_by_key(|shot| shot.len()).cloned() else { return };
    if (longest.len() as f64) < LONGEST * faces.frames.len() as f64 {
        return;
    }
    let of_longest: Vec<Signature> = longest.clone().filter_map(|f| signature(faces, f).cloned()).collect();
    for shot in shots.into_iter().filter(|shot| *shot != longest) {
        let again =
            |f: usize| signature(faces, f).is_some_and(|own| of_longest.iter().any(|other| own.resembles(other)));
        if shot.clone().any(again) {
            continue;
        }
        for look in faces.frames[shot].iter_mut().filter_map(|frame| frame.look.as_mut()) {
            (look.face, look.other_shot) = (None, true);
        }
    }
}

/// The shots are known: looks are again what files have of them.
pub fn forget_signatures(faces: &mut Faces) {
    faces.frames.iter_mut().filter_map(|frame| frame.look.as_mut()).for_each(|look| look.signature = None);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize, step: f64, shift: f64) -> Vec<f64> {
        (0..n).map(|k| 100.0 + 50.0 * (k as f64 * step + shift).sin()).collect()
    }

    #[test]
    fn a_shot_goes_on_while_the_picture_or_the_face_stays() {
        let one = Signature { picture: wave(432, 0.3, 0.0), face: wave(156, 0.7, 0.0) };
        let elsewhere = Signature { picture: wave(432, 0.3, 1.6), ..one.clone() };
        let covered = Signature { face: wave(156, 0.7, 1.6), ..one.clone() };
        let other = Signature { face: wave(156, 0.7, 1.6), ..elsewhere.clone() };
        assert!(one.resembles(&elsewhere) && one.resembles(&covered) && !one.resembles(&other));
    }

    #[test]
    fn looks_that_tell_nothing_are_no_cut() {
        let blank = Signature { picture: vec![0.0; 432], face: Vec::new() };
        assert!(blank.resembles(&Signature { picture: wave(432, 0.3, 0.0), face: wave(156, 0.7, 0.0) }));
    }
}
