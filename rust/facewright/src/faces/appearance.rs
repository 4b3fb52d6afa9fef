//! What the pixels of a face say of its light, and of what covers it.
//!
//! Skin is never even: lips, folds and the sides of the nose make the lower half of a bare face vary by more than it differs, as a whole,
//! from the brow; lashes, irises and whites do so around the eyes. A mask and dark glasses are even in themselves and unlike the skin
//! beside them. How many times a region differs from that skin more than it varies in itself is its `cover`.
//!
//! Median over a film, for the mouth and for the eyes: james-cif 0.2 / 2.1, james-720 0.3 / 1.7, cap12 2.2 / 2.7 and cap13 2.2 / 3.0
//! (beard), wolf 0.4 / 1.7, ict-a-talk 2.1 / 2.4, ict-b-perform 2.1 / 4.5, the synthetic person 2.6 / 3.0; no single frame above
//! 2.8 / 5.4. Painted masks: more than 100; painted sunglasses: more than 150.

use super::median;
use geometry::Vec2;
use image::RgbImage;
use serde::{Deserialize, Serialize};
use vision::landmarks::Face;

/// Places of the brow, of the cheeks below the eyes, of all that a mask covers, and of eyes and lids: landmarks.
pub(super) const BROW: [usize; 9] = [151, 9, 108, 337, 69, 299, 67, 297, 10];
pub(super) const CHEEKS: [usize; 8] = [117, 346, 118, 347, 101, 330, 36, 266];
pub(super) const MOUTH: [usize; 17] = [4, 164, 0, 17, 199, 18, 200, 205, 425, 50, 187, 411, 57, 287, 194, 418, 175];
pub(super) const EYES: [usize; 50] = [
    33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246, 263, 249, 390, 373, 374, 380, 381,
    382, 362, 398, 384, 385, 386, 387, 388, 466, 27, 28, 29, 30, 23, 24, 22, 26, 110, 257, 258, 259, 260, 253, 254,
    252, 256, 339,
];
/// Half a side of the square that a place is the mean of, in distances between the eyes.
const PLACE: f64 = 0.04;
/// A channel from here up is clipped.
const CLIPPED: u8 = 253;
/// A region that varies by less than a grey level varies by one: no camera shows less.
const LEAST_SPREAD: f64 = 1.0;

/// What is covered in half of the looks is covered for good: 1.7 times the most that a good film has. A mask that light and folds make vary
/// by 20 grey levels still has 4.8 to 10, by 40 levels 3 to 6.
pub const COVERED: Appearance = Appearance { level: 0.0, clipped: 0.0, mouth_cover: 4.5, eyes_cover: 8.0 };

/// What the pixels of a face say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Appearance {
    /// Median grey level of the face, 0…255.
    pub level: f64,
    /// Part of the face whose brightest channel is clipped, 0…1.
    pub clipped: f64,
    /// Cover of mouth, nose and chin: so many times they differ from the brow more than they vary.
    pub mouth_cover: f64,
    /// Cover of the eyes, against the cheeks.
    pub eyes_cover: f64,
}

impl Appearance {
    /// Of a face in its picture.
    pub fn of(picture: &RgbImage, face: &Face) -> Self {
        let pixels: Vec<[u8; 3]> = face.points.iter().filter_map(|p| pixel(picture, &p.xy())).collect();
        let grey = pixels.iter().map(|p| 0.299 * f64::from(p[0]) + 0.587 * f64::from(p[1]) + 0.114 * f64::from(p[2]));
        let clipped = pixels.iter().filter(|p| p.iter().any(|&c| c >= CLIPPED)).count();
        let cover =
            |of: &[usize], beside: &[usize]| cover(&colours(picture, face, of), &colours(picture, face, beside));
        Self {
            level: median(grey),
            clipped: clipped as f64 / pixels.len().max(1) as f64,
            mouth_cover: cover(&MOUTH, &BROW),
            eyes_cover: cover(&EYES, &CHEEKS),
        }
    }

    /// The medians over looks; `None` where none tells.
    pub fn usual(looks: &[Self]) -> Option<Self> {
        let over = |of: fn(&Self) -> f64| median(looks.iter().map(of));
        let all = || Self {
            level: over(|look| look.level),
            clipped: over(|look| look.clipped),
            mouth_cover: over(|look| look.mouth_cover),
            eyes_cover: over(|look| look.eyes_cover),
        };
        (!looks.is_empty()).then(all)
    }

    /// The same in files: nobody reads more digits.
    pub fn rounded(self) -> Self {
        let round = |value: f64| (value * 1e4).round() / 1e4;
        Self {
            level: round(self.level),
            clipped: round(self.clipped),
            mouth_cover: round(self.mouth_cover),
            eyes_cover: round(self.eyes_cover),
        }
    }
}

fn pixel(picture: &RgbImage, at: &Vec2) -> Option<[u8; 3]> {
    let inside = at.x >= -0.5 && at.y >= -0.5;
    let (x, y) = (at.x.round().max(0.0) as u32, at.y.round().max(0.0) as u32);
    (inside && x < picture.width() && y < picture.height()).then(|| picture.get_pixel(x, y).0)
}

/// Mean colours around landmarks, where the picture has them.
pub(super) fn colours(picture: &RgbImage, face: &Face, landmarks: &[usize]) -> Vec<[f64; 3]> {
    let reach = (PLACE * face.eye_distance()).round().max(1.0) as i64;
    let offsets = || (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| Vec2::new(x as f64, y as f64)));
    let place = |&i: &usize| {
        let around: Vec<[u8; 3]> = offsets().filter_map(|d| pixel(picture, &(face.points[i].xy() + d))).collect();
        let mean = |c: usize| around.iter().map(|p| f64::from(p[c])).sum::<f64>() / around.len() as f64;
        (!around.is_empty()).then(|| [mean(0), mean(1), mean(2)])
    };
    landmarks.iter().filter_map(place).collect()
}

/// The median of each channel.
pub(super) fn middle(colours: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|c| median(colours.iter().map(|p| p[c])))
}

/// Squared distance of two colours.
pub(super) fn squared(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum()
}

fn cover(of: &[[f64; 3]], beside: &[[f64; 3]]) -> f64 {
    if of.is_empty() || beside.is_empty() {
        return 0.0;
    }
    let mean = [0, 1, 2].map(|c| of.iter().map(|p| p[c]).sum::<f64>() / of.len() as f64);
    let spread = (of.iter().map(|p| squared(p, &mean)).sum::<f64>() / of.len() as f64).sqrt();
    squared(&middle(of), &middle(beside)).sqrt() / spread.max(LEAST_SPREAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_even_and_unlike_the_skin_beside_it_is_a_cover() {
        let skin = [[170.0, 120.0, 100.0], [180.0, 128.0, 108.0], [175.0, 126.0, 104.0]];
        let bare = [[160.0, 105.0, 92.0], [140.0, 70.0, 70.0], [175.0, 124.0, 101.0]];
        let mask = [[121.0, 169.0, 200.0], [119.0, 170.0, 202.0], [124.0, 172.0, 199.0]];
        assert!(cover(&bare, &skin) < 2.0 && cover(&mask, &skin) > 20.0);
        assert_eq!((cover(&[], &skin), cover(&skin, &skin)), (0.0, 0.0));
    }
}
