//! Which pixels around a head show the person, with hair and clothes, and which show what is behind.
//!
//! Google's selfie segmentation looks at a square around the head: 256 × 256 cells, a few pixels each, with a probability.

use super::crop::{Region, crop};
use super::mesh::NET_INPUT;
use super::net::{Net, Threads};
use super::{Face, LandmarkError};
use geometry::Vec2;
use image::{GrayImage, Luma, RgbImage};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Landmarks at the top of the face's oval and at the chin.
const TOP: usize = 10;
const CHIN: usize = 152;
/// Edge of the square in terms of the distance between them: it holds hair as high as a face, and shoulders. (On 9 pictures of
/// 1280 × 720 with a known outline the median error is 1.0 pixel, the 90th percentile 6.4; 1.2 and 7 in a square larger by an eighth,
/// 1.5 and 28 in one smaller by a quarter.)
const REGION_PER_FACE: f64 = 3.2;
/// From this probability on a cell shows the person.
const PERSON: f32 = 0.5;

/// Width of the rim that is not trusted, pixels …
const RIM_PX: f64 = 3.0;
/// … and cells.
const RIM_CELLS: f64 = 1.5;

/// How likely the pixels around a head show a person.
#[derive(Clone, Debug, PartialEq)]
pub struct PersonMask {
    region: Region,
    side: usize,
    /// Probability of each cell, row by row.
    probability: Vec<f32>,
    /// Distance of each cell's centre from the outline, pixels, positive within the person.
    distance: Vec<f32>,
}

impl PersonMask {
    /// Of the cells of a square, `side` × `side` of them, row by row.
    fn new(region: Region, side: usize, probability: Vec<f32>) -> Self {
        let distance = distances(&probability, side, region.side / side as f64);
        Self { region, side, probability, distance }
    }

    /// How likely a pixel shows the person, 0 to 1; `None` beyond what the net looked at.
    pub fn probability(&self, pixel: &Vec2) -> Option<f64> {
        self.at(pixel, &self.probability)
    }

    /// How far a pixel lies within the person's outline, pixels, negative outside; `None` beyond what the net looked at. Exact
    /// near the outline, up to 8 % too long far from it; infinite where there is no outline.
    pub fn distance(&self, pixel: &Vec2) -> Option<f64> {
        self.at(pixel, &self.distance)
    }

    /// How far within the outline a pixel is to be trusted to show the person, pixels: three times the outline's median error, and no
    /// less than a cell and a half.
    pub fn rim(&self) -> f64 {
        (RIM_CELLS * self.region.side / self.side as f64).max(RIM_PX)
    }

    /// Clears what of a mask of the frame, or of a part of it, is not at least `margin` frame pixels within the person. What the net did
    /// not look at stays. `pixel` is the frame's pixel of one of the mask.
    pub fn clear_outside(&self, mask: &mut GrayImage, margin: f64, pixel: impl Fn(&Vec2) -> Vec2) {
        for (x, y, Luma([value])) in mask.enumerate_pixels_mut().filter(|(_, _, pixel)| pixel.0[0] != 0) {
            let distance = self.distance(&pixel(&Vec2::new(f64::from(x), f64::from(y))));
            if distance.is_some_and(|distance| distance < margin) {
                *value = 0;
            }
        }
    }

    /// The bilinear value of cells at a pixel.
    fn at(&self, pixel: &Vec2, cells: &[f32]) -> Option<f64> {
        let unit = self.region.unit(pixel);
        if !(0.0..=1.0).contains(&unit.x) || !(0.0..=1.0).contains(&unit.y) {
            return None;
        }
        let last = self.side - 1;
        let place = |unit: f64| {
            let at = (unit * self.side as f64 - 0.5).clamp(0.0, last as f64);
            let first = (at as usize).min(last - 1);
            (first, (at - first as f64) as f32)
        };
        let ((column, right), (row, down)) = (place(unit.x), place(unit.y));
        let i = row * self.side + column;
        // Between equals nothing is mixed: they may be infinite.
        let mix = |a: f32, b: f32, t: f32| if a == b { a } else { a + (b - a) * t };
        let above = mix(cells[i], cells[i + 1], right);
        Some(f64::from(mix(above, mix(cells[i + self.side], cells[i + self.side + 1], right), down)))
    }
}

/// The square around a head. The net has seen people upright: it is turned by quarters, as pictures are that lie on their side.
fn region_of(face: &Face) -> Region {
    let [top, chin] = [TOP, CHIN].map(|i| face.points[i].xy());
    let (up, middle) = (top - chin, face.points.iter().map(|p| p.xy()).sum::<Vec2>() / face.points.len() as f64);
    let quarters = (up.x.atan2(-up.y) / FRAC_PI_2).round();
    Region { centre: middle, side: (REGION_PER_FACE * up.norm()).max(1.0), angle: quarters * FRAC_PI_2 }
}

/// The person net.
pub struct PersonNet(Net<1>);

impl PersonNet {
    /// Loads the net.
    pub fn load(folder: &Path, threads: &Threads) -> Result<Self, LandmarkError> {
        Ok(Self(Net::load(folder, "selfie_segmentation", 256, threads)?))
    }

    /// The person around a face.
    pub fn mask(&self, image: &RgbImage, face: &Face) -> Result<PersonMask, LandmarkError> {
        let (region, side, (border, range)) = (region_of(face), self.0.side(), NET_INPUT);
        let [probability] = self.0.run(&crop(image, &region, side, border, range))?;
        self.0.expect_length(&probability, side * side)?;
        Ok(PersonMask::new(region, side, probability))
    }
}

/// Distances of cells from the outline, where the probability passes [`PERSON`] between neighbours; `size` is a cell's edge.
fn distances(probability: &[f32], side: usize, size: f64) -> Vec<f32> {
    let is_person = |i: usize| probability[i] >= PERSON;
    let mut nearest = vec![f32::INFINITY; probability.len()];
    let crossing = |i: usize, j: usize| (probability[i] - PERSON) / (probability[i] - probability[j]);
    for i in 0..probability.len() {
        let neighbours = [((i + 1) % side != 0).then_some(i + 1), (i + side < probability.len()).then_some(i + side)];
        for j in neighbours.into_iter().flatten().filter(|&j| is_person(i) != is_person(j)) {
            let t = crossing(i, j);
            nearest[i] = nearest[i].min(t);
            nearest[j] = nearest[j].min(1.0 - t);
        }
    }
    chamfer(&mut nearest, side);
    let signed = |(i, d): (usize, f32)| d * size as f32 * if is_person(i) { 1.0 } else { -1.0 };
    nearest.into_iter().enumerate().map(signed).collect()
}

/// Hands the smallest distances on to the eight neighbours, forward and backward (Borgefors 1986).
fn chamfer(nearest: &mut [f32], side: usize) {
    const DIAGONAL: f32 = std::f32::consts::SQRT_2;
    let last = nearest.len().saturating_sub(1);
    for pass in 0..2 {
        let at = |i: usize| if pass == 0 { i } else { last - i };
        for i in 0..nearest.len() {
            let column = i % side;
            let mut d = nearest[at(i)];
            if column > 0 {
                d = d.min(nearest[at(i - 1)] + 1.0);
            }
            if i >= side {
                d = d.min(nearest[at(i - side)] + 1.0);
                if column > 0 {
                    d = d.min(nearest[at(i - side - 1)] + DIAGONAL);
                }
                if column + 1 < side {
                    d = d.min(nearest[at(i - side + 1)] + DIAGONAL);
                }
            }
            nearest[at(i)] = d;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 64;

    /// The probability that a net gives beside a straight outline: cells whose unit coordinate `x` is beyond `edge` show the person.
    fn beside(region: Region, edge: f64) -> PersonMask {
        let cell = |i: usize| {
            let x = ((i % SIDE) as f64 + 0.5) / SIDE as f64;
            (0.5 + (x - edge) * SIDE as f64 / 3.0).clamp(0.0, 1.0) as f32
        };
        PersonMask::new(region, SIDE, (0..SIDE * SIDE).map(cell).collect())
    }

    #[test]
    fn distances_from_a_straight_outline_are_exact_between_the_cells() {
        let region = Region { centre: Vec2::new(200.0, 150.0), side: 160.0, angle: 0.0 };
        let mask = beside(region, 0.37);
        let outline = region.point(&Vec2::new(0.37, 0.5)).x;
        for pixel in [[180.0, 150.0], [183.3, 99.0], [240.0, 140.7], [130.0, 190.2]] {
            let found = mask.distance(&Vec2::from(pixel)).unwrap();
            assert!((found - (pixel[0] - outline)).abs() < 1e-3, "{pixel:?}: {found}");
        }
        assert!((mask.probability(&Vec2::new(outline, 150.0)).unwrap() - 0.5).abs() < 1e-4);
    }

    #[test]
    fn beyond_the_square_nothing_is_said_and_nothing_is_left_out() {
        let region = Region { centre: Vec2::new(20.0, 20.0), side: 20.0, angle: 0.0 };
        let mask = beside(region, 0.5);
        assert_eq!((mask.probability(&Vec2::new(9.9, 20.0)), mask.distance(&Vec2::new(20.0, 31.0))), (None, None));
        let mut within = GrayImage::from_pixel(40, 40, Luma([255]));
        mask.clear_outside(&mut within, 3.0, |pixel| *pixel);
        let at = |x: u32, y: u32| within.get_pixel(x, y).0[0];
        assert_eq!([at(5, 20), at(15, 20), at(22, 20), at(24, 20), at(35, 20)], [255, 0, 0, 255, 255]);
    }

    #[test]
    fn a_mask_without_an_outline_is_endless() {
        let region = Region { centre: Vec2::zeros(), side: 10.0, angle: 0.0 };
        let mask = |p: f32| PersonMask::new(region, SIDE, vec![p; SIDE * SIDE]);
        assert_eq!(mask(0.9).distance(&Vec2::new(1.0, 2.0)), Some(f64::INFINITY));
        assert_eq!(mask(0.1).distance(&Vec2::new(1.0, 2.0)), Some(f64::NEG_INFINITY));
    }

    #[test]
    fn a_square_turned_by_a_quarter_has_its_cells_turned() {
        let region = Region { centre: Vec2::new(50.0, 50.0), side: 40.0, angle: FRAC_PI_2 };
        // Its x axis is the picture's y axis.
        let mask = beside(region, 0.5);
        assert!(mask.distance(&Vec2::new(40.0, 58.0)).unwrap() > 7.9);
        assert!(mask.distance(&Vec2::new(40.0, 42.0)).unwrap() < -7.9);
    }
}
