//! What does not colour the lips: mouths that are not at rest, for a grin would paint its teeth on lips that are closed, and mouths that
//! something crosses.
//!
//! Lips are redder than the skin beside them. Where a finger lies before them it takes that from both lips at once, in neighbouring
//! columns; light takes it from one lip, a camera's noise from a column here and there.

use crate::faces::Clip;
use geometry::face_mesh::{LIPS_INNER_LOWER, LIPS_INNER_UPPER, LIPS_OUTER_LOWER, LIPS_OUTER_UPPER};
use geometry::{Vec2, median};
use image::{GrayImage, RgbImage};
use std::ops::Range;
use vision::landmarks::{Face, fill_polygon};

/// Lips within this of where they rest are at rest, metres: a third of a lip.
const AT_REST: f64 = 0.003;
/// So many of the calmest views colour the lips even if they are not at rest, for one alone may be blurred or cut: the calmest whatever
/// it does, the others …
const CALMEST: usize = 3;
/// … unless their lips are so far from where they rest, metres: that is an expression.
const EXPRESSION: f64 = 0.006;
/// Skin around the lips goes with them: the lips' outline is widened about its middle by this factor.
const WIDENED: f64 = 1.35;

/// The landmarks along a lip that are looked at: those in its corners lie as much on skin as on the lip.
const COLUMNS: Range<usize> = 2..9;
const COUNT: usize = COLUMNS.end - COLUMNS.start;
/// A lip is looked at half way from its inner to its outer edge …
const ON_LIP: f64 = 0.5;
/// … and the skin beside it on the same way, beyond the outer edge.
const BESIDE: f64 = 1.8;
/// Colours are means over a disc of this radius, in distances of the eyes: a third of a lip.
const LOOKED_AT: f64 = 0.043;
/// A column is crossed where it keeps less than this part of what most columns of its lip differ from the skin by, or of what itself does in
/// most views: it is nearer to the skin than to the lip.
const KEPT: f64 = 0.5;
/// So many neighbouring columns of both lips are a finger: it is as wide as a quarter of a mouth. (Both lips at once
/// take a webcam's noise for fingers in 10 to 20 of 100 frames, and faces turned by more than 50 degrees in a third of them, which leaves
/// enough others; one lip alone would in 9 of 10.)
const FINGER: usize = 2;

/// How much redder than the skin beside them the upper and the lower lip are, by columns.
pub type Contrast = [[f64; COUNT]; 2];

/// Of picked frames, each with what [`contrast`] tells of its mouth, those whose mouth does not colour the lips; positions in `picked`.
pub fn unusable(clip: &Clip, picked: &[(usize, Option<Contrast>)]) -> Vec<usize> {
    let lips = || LIPS_OUTER_UPPER.iter().chain(&LIPS_OUTER_LOWER);
    let away = |frame: usize| {
        let fitted = clip.landmark_fit.frames[frame].as_ref()?;
        let moved = clip.head.landmark_offsets(&clip.rest.from_rest(&fitted.expression));
        Some(lips().map(|&i| moved[i].norm()).fold(0.0, f64::max))
    };
    let contrasts: Vec<Option<Contrast>> = picked.iter().map(|(_, contrast)| *contrast).collect();
    let mouth =
        |(&(frame, _), crossed): (&(usize, _), bool)| Mouth { away: away(frame).unwrap_or(f64::INFINITY), crossed };
    let mouths: Vec<Mouth> = picked.iter().zip(crossed(&contrasts)).map(mouth).collect();
    unlike_at_rest(&mouths)
}

/// How a mouth is seen in a frame.
struct Mouth {
    /// How far a point of the lips is at most from where it rests, metres; infinitely where that is not known.
    away: f64,
    crossed: bool,
}

/// Those that are crossed, unless all are, and those of the others whose lips are too far from where they rest.
fn unlike_at_rest(mouths: &[Mouth]) -> Vec<usize> {
    // Lips as pale as the skin, under a moustache for one, cannot be told from a finger.
    let tells = mouths.iter().any(|mouth| !mouth.crossed);
    let (crossed, mut free): (Vec<usize>, Vec<usize>) = (0..mouths.len()).partition(|&i| tells && mouths[i].crossed);
    free.sort_by(|&a, &b| mouths[a].away.total_cmp(&mouths[b].away));
    let at_most = |rank: usize| match rank {
        0 => f64::INFINITY,
        _ if rank < CALMEST => EXPRESSION,
        _ => AT_REST,
    };
    let restless = free.into_iter().enumerate().filter(|&(rank, i)| mouths[i].away > at_most(rank)).map(|(_, i)| i);
    crossed.into_iter().chain(restless).collect()
}

/// In which views something of the skin's colour lies across both lips.
fn crossed(views: &[Option<Contrast>]) -> Vec<bool> {
    let usual = |lip: usize, column: usize| median(views.iter().flatten().map(|c| c[lip][column])).unwrap_or(0.0);
    let usual: Contrast = [0, 1].map(|lip| std::array::from_fn(|column| usual(lip, column)));
    let is_covered = |lip: usize, contrast: &Contrast| {
        let own = median(contrast[lip]).unwrap_or(0.0);
        let is_pale = |(kept, usual): (&f64, &f64)| *kept < KEPT * own.max(*usual);
        let pale: Vec<bool> = contrast[lip].iter().zip(&usual[lip]).map(is_pale).collect();
        pale.windows(FINGER).any(|neighbours| neighbours.iter().all(|&pale| pale))
    };
    views.iter().map(|view| view.as_ref().is_some_and(|c| is_covered(0, c) && is_covered(1, c))).collect()
}

/// Of a face in the part of its frame that begins at `corner`; `None` where its mouth is not in that.
pub fn contrast(image: &RgbImage, face: &Face, corner: &Vec2) -> Option<Contrast> {
    let radius = LOOKED_AT * face.eye_distance();
    let of_lip = |inner: &[usize; 11], outer: &[usize; 11]| {
        let at = |column: usize, way: f64| {
            let [from, to] = [inner, outer].map(|edge| face.points[edge[column]].xy());
            redness(image, &(from + (to - from) * way - corner), radius)
        };
        let skin = median(COLUMNS.filter_map(|column| at(column, BESIDE)))?;
        let differences: Option<Vec<f64>> = COLUMNS.map(|column| Some(at(column, ON_LIP)? - skin)).collect();
        differences?.try_into().ok()
    };
    Some([of_lip(&LIPS_INNER_UPPER, &LIPS_OUTER_UPPER)?, of_lip(&LIPS_INNER_LOWER, &LIPS_OUTER_LOWER)?])
}

/// The part of red in the light of a disc, as far as it is in the picture; dark gaps, whose colour is noise, count little.
fn redness(image: &RgbImage, middle: &Vec2, radius: f64) -> Option<f64> {
    let [across, down] = [0, 1].map(|k| {
        let size = f64::from([image.width(), image.height()][k]);
        let first = (middle[k] - radius).round().max(0.0) as u32;
        first..((middle[k] + radius).round() + 1.0).clamp(0.0, size) as u32
    });
    let places = down.flat_map(|y| across.clone().map(move |x| (x, y)));
    let within = places.filter(|&(x, y)| (Vec2::new(f64::from(x), f64::from(y)) - middle).norm() <= radius.max(1.0));
    let light = within.fold([0.0; 3], |light, (x, y)| {
        let pixel = image.get_pixel(x, y).0;
        [0, 1, 2].map(|c| light[c] + f64::from(pixel[c]))
    });
    let sum: f64 = light.iter().sum();
    (sum > 0.0).then(|| light[0] / sum)
}

/// Clears the mouth of a face in a mask of the part of its frame that begins at `corner`.
pub fn clear_mouth(mask: &mut GrayImage, face: &Face, corner: &Vec2) {
    let lips = LIPS_OUTER_UPPER.iter().chain(LIPS_OUTER_LOWER.iter().rev());
    let outline: Vec<Vec2> = lips.map(|&i| face.points[i].xy() - corner).collect();
    let middle = outline.iter().sum::<Vec2>() / outline.len() as f64;
    let outline: Vec<Vec2> = outline.iter().map(|p| middle + (p - middle) * WIDENED).collect();
    fill_polygon(mask, &outline, 0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec3;
    use geometry::face_mesh::{EYE_CORNERS, LANDMARKS};
    use image::Rgb;
    use synthetic::Random;
    use vision::landmarks::Iris;

    const SKIN: [f64; 3] = [190.0, 140.0, 118.0];
    const LIPS: [f64; 3] = [160.0, 96.0, 88.0];

    /// A face whose mouth is 80 pixels wide, its corners at (60, 80) and (140, 80), and whose eyes are 100 pixels apart.
    fn face() -> Face {
        let mut points = vec![Vec3::new(100.0, 30.0, 0.0); LANDMARKS];
        let edges =
            [(LIPS_OUTER_UPPER, -12.0), (LIPS_INNER_UPPER, -0.5), (LIPS_OUTER_LOWER, 14.0), (LIPS_INNER_LOWER, 0.5)];
        for (edge, height) in edges {
            for (k, &i) in edge.iter().enumerate() {
                let across = k as f64 / 5.0 - 1.0;
                points[i] = Vec3::new(100.0 + 40.0 * across, 80.0 + height * (1.0 - across * across), 0.0);
            }
        }
        for (corners, x) in EYE_CORNERS.iter().zip([150.0, 50.0]) {
            corners.iter().for_each(|&i| points[i] = Vec3::new(x, 20.0, 0.0));
        }
        let unseen =
            || Iris { centre: Vec2::zeros(), radius: 0.0, eye_contour: Vec::new(), openness: 0.0, visible: false };
        Face { points, score: 1.0, flip_disagreement_px: 0.0, irises: [unseen(), unseen()], faces_in_picture: 1 }
    }

    /// Its mouth in a light from the left, with something of a colour before it in a part of the picture, and noise.
    fn portrait(lips: [f64; 3], before: impl Fn(f64, f64) -> Option<[f64; 3]>) -> RgbImage {
        let mut random = Random::new(7);
        let mut is_lip = GrayImage::new(200, 140);
        for [inner, outer] in [[LIPS_INNER_UPPER, LIPS_OUTER_UPPER], [LIPS_INNER_LOWER, LIPS_OUTER_LOWER]] {
            let outline: Vec<Vec2> = outer.iter().chain(inner.iter().rev()).map(|&i| face().points[i].xy()).collect();
            fill_polygon(&mut is_lip, &outline, 255);
        }
        RgbImage::from_fn(200, 140, |x, y| {
            let own = if is_lip.get_pixel(x, y).0[0] > 0 { lips } else { SKIN };
            let colour = before(f64::from(x), f64::from(y)).unwrap_or(own);
            let light = 1.1 - f64::from(x) / 400.0;
            Rgb(colour.map(|level| (level * light + 3.0 * random.normal()).clamp(0.0, 255.0) as u8))
        })
    }

    fn finger(x: f64, y: f64) -> bool {
        (x - 90.0 + (y - 80.0) * 0.3).abs() < 11.0
    }

    fn seen(picture: &RgbImage) -> Option<Contrast> {
        contrast(picture, &face(), &Vec2::zeros())
    }

    fn is_crossed(picture: &RgbImage) -> bool {
        crossed(&[seen(picture)]) == [true]
    }

    #[test]
    fn a_finger_across_both_lips_is_seen() {
        assert!(is_crossed(&portrait(LIPS, |x, y| finger(x, y).then_some([196.0, 148.0, 126.0]))));
        // Another one beside it, with a dark gap between them.
        let hand = |x: f64, y: f64| {
            let gap = finger(x + 16.0, y).then_some([4.0, 1.0, 0.0]);
            finger(x, y).then_some(SKIN).or(gap).or(finger(x + 30.0, y).then_some(SKIN))
        };
        assert!(is_crossed(&portrait(LIPS, hand)));
    }

    #[test]
    fn free_lips_a_finger_at_the_chin_and_a_beard_are_not_crossed() {
        assert!(!is_crossed(&portrait(LIPS, |_, _| None)));
        assert!(!is_crossed(&portrait(LIPS, |x, y| (y > 81.0 && finger(x, y)).then_some(SKIN))));
        assert!(!is_crossed(&portrait(LIPS, |_, y| (!(67.0..95.0).contains(&y)).then_some([60.0, 50.0, 45.0]))));
        // Lips of dark skin.
        assert!(!is_crossed(
            &portrait([88.0, 50.0, 48.0], |_, y| (!(67.0..95.0).contains(&y)).then_some([92.0, 60.0, 48.0]))
        ));
    }

    #[test]
    fn a_finger_redder_than_the_skin_is_seen_beside_other_views() {
        let red = portrait(LIPS, |x, y| finger(x, y).then_some([190.0, 132.0, 112.0]));
        let free = portrait(LIPS, |_, _| None);
        assert_eq!(crossed(&[seen(&free), seen(&red), None, seen(&free)]), [false, true, false, false]);
    }

    #[test]
    fn a_part_of_the_frame_tells_the_same_and_one_without_the_mouth_nothing() {
        let picture = portrait(LIPS, |_, _| None);
        let part = image::imageops::crop_imm(&picture, 30, 40, 140, 90).to_image();
        assert_eq!(contrast(&part, &face(), &Vec2::new(30.0, 40.0)), seen(&picture));
        assert_eq!(contrast(&part, &face(), &Vec2::new(900.0, 40.0)), None);
    }

    #[test]
    fn crossed_mouths_go_and_the_calmest_of_the_others_stay() {
        let mouths = |of: &[(f64, bool)]| -> Vec<Mouth> {
            of.iter().map(|&(millimetres, crossed)| Mouth { away: 1e-3 * millimetres, crossed }).collect()
        };
        let seen = [(0.5, true), (8.0, false), (4.4, false), (14.0, false), (1.0, true)];
        assert_eq!(unlike_at_rest(&mouths(&seen)), [0, 4, 1, 3]);
        assert_eq!(unlike_at_rest(&mouths(&[(1.0, false), (5.0, false), (4.0, false), (5.5, false)])), [3]);
        assert_eq!(unlike_at_rest(&mouths(&[(1.0, true), (2.0, true)])), Vec::<usize>::new());
        assert_eq!(unlike_at_rest(&[]), Vec::<usize>::new());
    }
}
