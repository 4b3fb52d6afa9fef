//! The pixels of what covers a face all the time: near mouth or eyes, and of its colour rather than of the skin's beside it.

use super::appearance::{BROW, CHEEKS, EYES, MOUTH, colours, middle, squared};
use super::{Appearance, COVERED};
use geometry::Vec2;
use geometry::face_mesh::EYE_CORNERS;
use image::{GrayImage, Luma, RgbImage};
use vision::landmarks::Face;

/// A mask reaches so far from below the nose, and glasses from the middle of an eye, in distances between the eyes.
const REACH: [f64; 2] = [1.7, 0.75];
/// Below the nose.
const SUBNASALE: usize = 2;
/// Pixels around a cover that are mixed with its colour.
const EDGE: i64 = 2;

/// One cover in one frame.
struct Cover {
    colour: [f64; 3],
    /// Squared distance of colours that are the cover's.
    alike: f64,
    middles: Vec<Vec2>,
    reach: f64,
}

impl Cover {
    fn of(picture: &RgbImage, face: &Face, (own, beside): (&[usize], &[usize]), place: (Vec<Vec2>, f64)) -> Self {
        let [colour, skin] = [own, beside].map(|places| middle(&colours(picture, face, places)));
        let (middles, reach) = place;
        Self { colour, alike: squared(&colour, &skin) / 4.0, middles, reach: reach * face.eye_distance() }
    }

    fn is_at(&self, pixel: &Vec2, colour: [u8; 3]) -> bool {
        self.middles.iter().any(|middle| (middle - pixel).norm() < self.reach)
            && squared(&self.colour, &colour.map(f64::from)) < self.alike
    }
}

/// 255 where the part of a picture that begins at `corner` and has the size shows no cover, 0 where it does; `None` where `usual`, what
/// the looks usually say, tells of none.
pub fn uncovered(
    picture: &RgbImage,
    face: &Face,
    usual: &Appearance,
    (corner, size): ([u32; 2], (u32, u32)),
) -> Option<GrayImage> {
    let at = |i: usize| face.points[i].xy();
    let mut covers = Vec::new();
    if usual.mouth_cover > COVERED.mouth_cover {
        covers.push(Cover::of(picture, face, (&MOUTH, &BROW), (vec![at(SUBNASALE)], REACH[0])));
    }
    if usual.eyes_cover > COVERED.eyes_cover {
        let eyes = EYE_CORNERS.map(|[a, b]| (at(a) + at(b)) / 2.0).to_vec();
        covers.push(Cover::of(picture, face, (&EYES, &CHEEKS), (eyes, REACH[1])));
    }
    (!covers.is_empty()).then(|| mask(picture, &covers, (corner, size)))
}

fn mask(picture: &RgbImage, covers: &[Cover], ([left, top], (width, height)): ([u32; 2], (u32, u32))) -> GrayImage {
    let mut mask = GrayImage::from_pixel(width, height, Luma([255]));
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let pixel = Vec2::new(f64::from(x + left), f64::from(y + top));
        let colour = picture.get_pixel(x + left, y + top).0;
        if covers.iter().any(|cover| cover.is_at(&pixel, colour)) {
            let around =
                |at: u32, size: u32| (i64::from(at) - EDGE).max(0)..(i64::from(at) + EDGE + 1).min(i64::from(size));
            for v in around(y, height) {
                around(x, width).for_each(|u| mask.put_pixel(u as u32, v as u32, Luma([0])));
            }
        }
    }
    mask
}
