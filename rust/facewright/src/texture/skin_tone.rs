//! The colours that the skin has in a frame, by which neck is told from collar and from the wall below it.
//!
//! Light makes skin brighter or darker, but hardly moves the logarithms of its red and blue relative to its green: those of the face are
//! one small cluster, which the neck shares and cloth mostly does not.

use geometry::face_mesh::FACE_OVAL;
use geometry::{Vec2, Vec3};
use image::{GrayImage, Rgb, RgbImage};
use nalgebra::{Matrix2, Vector2};
use std::ops::Range;
use vision::landmarks::{Face, MaskOptions, face_mask};

/// Where the oval has its top, and the chin.
const TOP: usize = 0;
const CHIN: usize = 18;
/// A collar reaches so far above the chin at the back of the neck, in heights of the oval.
const COLLAR: f64 = 0.12;
/// The face's outline is drawn in by this part before its colours are taken: hair and beard are at its edge.
const SHRINK: f64 = 0.25;
/// Fewest pixels that tell a face's colours …
const FEWEST: usize = 200;
/// … and about the number that is taken.
const TAKEN: usize = 4000;
/// Grey levels added to each channel, so that the noise of dark pixels does not look like colour.
const DARK: f64 = 8.0;
/// Least standard deviation of a face's colours that is believed, in logarithms: a neck is a little paler.
const LEAST_SPREAD: f64 = 0.04;
/// Colours further from the face's than so many standard deviations are left out of them …
const OUTLYING: f64 = 3.0;
/// … and than so many are no skin. (In frontal frames of 6 films, 97 % of the pixels below the chin are within 3.1; 97 % of a grey shirt
/// are beyond 3.7, of other clothes and walls beyond 8.)
const OTHER: f64 = 3.4;
/// The face's pixels are darker than this one but for this part of them …
const BRIGHTEST: f64 = 0.98;
/// … and what is brighter by this factor is no skin.
const GLARING: f64 = 1.2;
/// What is darker than the face's median by this factor is no skin, but hair or a gap: near black there is no colour to judge by. (Of the neck
/// below the chin 97 % are brighter than 0.29 of it; hair beside a neck has less than 0.05.)
const GLOOMY: f64 = 0.25;

/// All of the face.
const OVAL: MaskOptions = MaskOptions { exclude_eyes: false, exclude_mouth: false, shrink: 0.0 };

/// The colours of one face in one picture.
#[derive(Clone, Debug)]
pub struct SkinTone {
    mean: Vector2<f64>,
    /// Inverse of the covariance.
    precision: Matrix2<f64>,
    /// Levels of the largest channel of what may be skin.
    levels: Range<f64>,
}

impl SkinTone {
    /// Of the middle of a face, without eyes and mouth; `None` where too little of it is in the picture.
    pub fn of(picture: &RgbImage, face: &Face) -> Option<Self> {
        let options = MaskOptions { shrink: SHRINK, ..MaskOptions::default() };
        let mask = face_mask(face, picture.width(), picture.height(), &options);
        let seen: Vec<&Rgb<u8>> =
            picture.pixels().zip(mask.pixels()).filter(|(_, m)| m.0[0] != 0).map(|(pixel, _)| pixel).collect();
        let taken: Vec<&Rgb<u8>> = seen.iter().copied().step_by((seen.len() / TAKEN).max(1)).collect();
        if taken.len() < FEWEST {
            return None;
        }
        let mut levels: Vec<u8> = taken.iter().map(|pixel| largest(pixel)).collect();
        levels.sort_unstable();
        let level = |part: f64| f64::from(levels[(part * (levels.len() - 1) as f64) as usize]);
        let levels = GLOOMY * level(0.5)..GLARING * level(BRIGHTEST);
        let all: Vec<Vector2<f64>> = taken.iter().map(|pixel| chromaticity(pixel)).collect();
        let rough = Self::cluster(&all, levels.clone())?;
        let inner: Vec<Vector2<f64>> = all.into_iter().filter(|c| rough.distance(c) < OUTLYING).collect();
        Self::cluster(&inner, levels)
    }

    fn cluster(colours: &[Vector2<f64>], levels: Range<f64>) -> Option<Self> {
        let count = colours.len() as f64;
        let mean = colours.iter().sum::<Vector2<f64>>() / count;
        let spread = colours.iter().map(|c| (c - mean) * (c - mean).transpose()).sum::<Matrix2<f64>>() / count;
        let precision = (spread + Matrix2::identity() * LEAST_SPREAD.powi(2)).try_inverse()?;
        Some(Self { mean, precision, levels })
    }

    /// How far a colour is from the face's, standard deviations.
    fn distance(&self, colour: &Vector2<f64>) -> f64 {
        let off = colour - self.mean;
        off.dot(&(self.precision * off)).max(0.0).sqrt()
    }

    /// Whether a pixel may show this skin.
    pub fn is_skin(&self, pixel: &Rgb<u8>) -> bool {
        self.levels.contains(&f64::from(largest(pixel))) && self.distance(&chromaticity(pixel)) < OTHER
    }

    /// Clears what of a picture's mask lies below the face and is no skin: collar, shirt, and the wall where the neck ends. `corner` is the
    /// place of the picture's first pixel in the frame that the face was found in.
    pub fn clear_below_face(&self, mask: &mut GrayImage, picture: &RgbImage, face: &Face, corner: &Vec2) {
        let [top, chin] = [TOP, CHIN].map(|k| face.points[FACE_OVAL[k]].xy());
        let up = top - chin;
        let limit = COLLAR * up.norm_squared();
        let own = moved(face, corner);
        let oval = face_mask(&own, picture.width(), picture.height(), &OVAL);
        let is_below = |x: u32, y: u32| up.dot(&(Vec2::new(f64::from(x), f64::from(y)) + corner - chin)) < limit;
        for ((x, y, shown), (pixel, oval)) in mask.enumerate_pixels_mut().zip(picture.pixels().zip(oval.pixels())) {
            if shown.0[0] != 0 && oval.0[0] == 0 && is_below(x, y) && !self.is_skin(pixel) {
                shown.0[0] = 0;
            }
        }
    }
}

/// A face in a part of its frame.
fn moved(face: &Face, corner: &Vec2) -> Face {
    let mut face = face.clone();
    face.points.iter_mut().for_each(|point| *point -= Vec3::new(corner.x, corner.y, 0.0));
    face
}

fn largest(pixel: &Rgb<u8>) -> u8 {
    pixel.0.into_iter().max().unwrap_or(0)
}

/// Logarithms of red and blue relative to green.
fn chromaticity(pixel: &Rgb<u8>) -> Vector2<f64> {
    let [red, green, blue] = pixel.0.map(|level| (f64::from(level) + DARK).ln());
    Vector2::new(red - green, blue - green)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::face_mesh::LANDMARKS;
    use image::Luma;

    /// A picture of a round face of 120 pixels in a skin's colour, brighter to the right; and the face in it.
    fn portrait() -> (RgbImage, Face) {
        let centre = Vec2::new(100.0, 80.0);
        let around = |k: usize| {
            let angle = k as f64 / FACE_OVAL.len() as f64 * std::f64::consts::TAU;
            centre + Vec2::new(angle.sin(), -angle.cos()) * 60.0
        };
        let mut points = vec![Vec3::new(centre.x, centre.y, 0.0); LANDMARKS];
        for (k, &i) in FACE_OVAL.iter().enumerate() {
            points[i] = Vec3::new(around(k).x, around(k).y, 0.0);
        }
        let nothing = || vision::landmarks::Iris {
            centre: Vec2::zeros(),
            radius: 0.0,
            eye_contour: Vec::new(),
            openness: 0.0,
            visible: false,
        };
        let face =
            Face { points, score: 1.0, flip_disagreement_px: 0.0, irises: [nothing(), nothing()], faces_in_picture: 1 };
        (RgbImage::from_fn(200, 200, |x, y| skin(0.5 + f64::from(x) / 400.0, (x + 3 * y) % 7)), face)
    }

    fn skin(light: f64, grain: u32) -> Rgb<u8> {
        Rgb([205.0, 150.0, 120.0].map(|level: f64| (level * light) as u8 + grain as u8))
    }

    #[test]
    fn skin_in_shadow_is_skin_and_cloth_is_not() {
        let (picture, face) = portrait();
        let tone = SkinTone::of(&picture, &face).unwrap();
        for light in [0.3, 0.6, 0.95] {
            assert!(tone.is_skin(&skin(light, 3)), "{light}");
        }
        for cloth in [[230, 230, 225], [60, 60, 64], [150, 60, 150], [40, 90, 160], [250, 190, 150], [18, 13, 10]] {
            assert!(!tone.is_skin(&Rgb(cloth)), "{cloth:?}");
        }
    }

    #[test]
    fn only_what_is_below_the_face_is_judged() {
        let (mut picture, face) = portrait();
        let corner = Vec2::new(0.0, 0.0);
        // Hair, lips, and a collar that reaches above the chin at the back; the chin is at 140.
        for (columns, y) in [(0..200, 20), (90..110, 132), (0..200, 160), (0..40, 132)] {
            columns.for_each(|x| picture.put_pixel(x, y, Rgb([40, 90, 160])));
        }
        let mut mask = GrayImage::from_pixel(200, 200, Luma([255]));
        SkinTone::of(&picture, &face).unwrap().clear_below_face(&mut mask, &picture, &face, &corner);
        let at = |x: u32, y: u32| mask.get_pixel(x, y).0[0];
        assert_eq!([at(100, 20), at(100, 132), at(100, 150), at(100, 170)], [255; 4]);
        assert_eq!([at(100, 160), at(30, 132)], [0; 2]);
    }

    #[test]
    fn a_face_outside_the_picture_tells_no_colours() {
        let (picture, mut face) = portrait();
        face.points.iter_mut().for_each(|point| point.x += 400.0);
        assert!(SkinTone::of(&picture, &face).is_none());
    }
}
