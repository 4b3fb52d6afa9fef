//! Mouths that are not at rest do not colour the lips: a grin would paint its teeth on lips that are closed.

use crate::faces::Clip;
use geometry::face_mesh::{LIPS_OUTER_LOWER, LIPS_OUTER_UPPER};
use geometry::{Transform, Vec2};
use image::GrayImage;
use vision::landmarks::{Face, fill_polygon};

/// Lips within this of where they rest are at rest, metres: half of what is an expression, and a third of a lip.
const AT_REST: f64 = 0.003;
/// The calmest views colour the lips whatever they do: one alone may be blurred or cut.
const CALMEST: usize = 3;
/// Skin around the lips goes with them: the lips' outline is widened about its middle by this factor.
const WIDENED: f64 = 1.35;

/// Of the chosen frames with their poses, those that are picked and whose mouth is not at rest, unless they are among the calmest.
pub fn restless(clip: &Clip, chosen: &[(usize, Transform)], picked: &[usize]) -> Vec<usize> {
    let lips = || LIPS_OUTER_UPPER.iter().chain(&LIPS_OUTER_LOWER);
    let away = |frame: usize| {
        let fitted = clip.landmark_fit.frames[frame].as_ref()?;
        let moved = clip.head.landmark_offsets(&clip.rest.from_rest(&fitted.expression));
        Some(lips().map(|&i| moved[i].norm()).fold(0.0, f64::max))
    };
    let mut by_calm: Vec<(f64, usize)> = picked.iter().filter_map(|&i| Some((away(chosen[i].0)?, i))).collect();
    by_calm.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    by_calm.into_iter().skip(CALMEST).filter(|(away, _)| *away > AT_REST).map(|(_, i)| i).collect()
}

/// Clears the mouth of a face in a mask of the part of its frame that begins at `corner`.
pub fn clear_mouth(mask: &mut GrayImage, face: &Face, corner: &Vec2) {
    let lips = LIPS_OUTER_UPPER.iter().chain(LIPS_OUTER_LOWER.iter().rev());
    let outline: Vec<Vec2> = lips.map(|&i| face.points[i].xy() - corner).collect();
    let middle = outline.iter().sum::<Vec2>() / outline.len() as f64;
    let outline: Vec<Vec2> = outline.iter().map(|p| middle + (p - middle) * WIDENED).collect();
    fill_polygon(mask, &outline, 0);
}
