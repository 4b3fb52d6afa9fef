//! Finds faces anywhere in a picture.
//!
//! The nets are single-shot detectors (BlazeFace, Bazarevsky et al. 2019): a fixed grid of anchors, and for each anchor
//! a score, a box and six key points relative to the anchor. Overlapping answers are merged by their scores.
//! Faces too small, too large or too tilted for the whole picture are searched in parts of it, in more than it, and in
//! the picture turned.

use super::LandmarkError;
use super::crop::{Border, Range, Region, crop};
use super::net::{Net, Threads};
use geometry::Vec2;
use image::RgbImage;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// A face as the detector sees it, roughly.
#[derive(Clone, Debug, PartialEq)]
pub struct DetectedFace {
    /// Centre of the face's square box, pixels.
    pub centre: Vec2,
    /// Edge of the box, from brows to chin, pixels.
    pub size: f64,
    /// Right eye, left eye, nose tip, mouth, right ear, left ear (the subject's sides), pixels.
    pub key_points: [Vec2; 6],
    /// How sure the detector is, 0 to 1.
    pub score: f64,
}

/// Scores below this are not faces.
const LEAST_SCORE: f64 = 0.5;
/// Boxes that overlap more than this (intersection over union) are the same face.
const SAME_FACE_OVERLAP: f64 = 0.3;
/// Parts of a picture smaller than this, pixels, show the net nothing new.
const SMALLEST_TILE: f64 = 256.0;
/// Numbers per anchor: box centre and size, six key points.
const NUMBERS_PER_ANCHOR: usize = 16;

impl DetectedFace {
    /// The square the landmark net wants to see: half as large again, upright by the eyes.
    pub(super) fn region(&self) -> Region {
        let eyes = self.key_points[1] - self.key_points[0];
        Region { centre: self.centre, side: 1.5 * self.size, angle: eyes.y.atan2(eyes.x) }
    }

    /// Intersection over union of the boxes.
    fn overlap(&self, other: &Self) -> f64 {
        let reach = (self.size + other.size) / 2.0;
        let shared = |axis: usize| {
            let apart = (self.centre[axis] - other.centre[axis]).abs();
            (reach - apart).clamp(0.0, self.size.min(other.size))
        };
        let both = shared(0) * shared(1);
        both / (self.size.powi(2) + other.size.powi(2) - both)
    }
}

/// One detector net and its anchors.
struct Detector {
    net: Net<2>,
    /// Anchor centres, 0 to 1 over the crop.
    anchors: Vec<Vec2>,
}

impl Detector {
    /// `grids`: cells along an edge and anchors per cell, in the order of the net's output.
    fn load(
        folder: &Path,
        name: &'static str,
        side: usize,
        grids: &[(usize, usize)],
        threads: &Threads,
    ) -> Result<Self, LandmarkError> {
        let mut anchors = Vec::new();
        for &(cells, repeats) in grids {
            let centre = |k: usize| (k as f64 + 0.5) / cells as f64;
            for cell in 0..cells * cells {
                anchors.extend(std::iter::repeat_n(Vec2::new(centre(cell % cells), centre(cell / cells)), repeats));
            }
        }
        Ok(Self { net: Net::load(folder, name, side, threads)?, anchors })
    }

    /// The faces in a region, largest first.
    fn detect(&self, image: &RgbImage, region: &Region) -> Result<Vec<DetectedFace>, LandmarkError> {
        let range = Range { black: -1.0, white: 1.0 };
        let [boxes, scores] = self.net.run(&crop(image, region, self.net.side(), Border::Black, range))?;
        self.net.expect_length(&boxes, NUMBERS_PER_ANCHOR * self.anchors.len())?;
        self.net.expect_length(&scores, self.anchors.len())?;
        let answers = self.anchors.iter().zip(boxes.chunks_exact(NUMBERS_PER_ANCHOR)).zip(&scores);
        let faces = answers.filter_map(|((anchor, numbers), &score)| {
            let score = sigmoid(f64::from(score));
            (score > LEAST_SCORE).then(|| self.decode(anchor, numbers, score, region))
        });
        let mut merged = merge(faces.filter(|face| face.size > 0.0).collect());
        merged.sort_by(|a, b| b.size.total_cmp(&a.size));
        Ok(merged)
    }

    /// The face an anchor speaks of, in picture coordinates.
    fn decode(&self, anchor: &Vec2, numbers: &[f32], score: f64, region: &Region) -> DetectedFace {
        let pair = |k: usize| Vec2::new(f64::from(numbers[2 * k]), f64::from(numbers[2 * k + 1]));
        let scale = 1.0 / self.net.side() as f64;
        let place = |k: usize| region.point(&(anchor + pair(k) * scale));
        DetectedFace {
            centre: place(0),
            size: pair(1).max() * scale * region.side,
            key_points: std::array::from_fn(|k| place(k + 2)),
            score,
        }
    }
}

/// The logistic function.
pub fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Merges answers about the same face: their mean weighted by score, with the best one's score.
fn merge(mut answers: Vec<DetectedFace>) -> Vec<DetectedFace> {
    answers.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut faces = Vec::new();
    while let Some(best) = answers.first().cloned() {
        let (same, others): (Vec<_>, Vec<_>) =
            answers.into_iter().partition(|a| *a == best || best.overlap(a) > SAME_FACE_OVERLAP);
        let total: f64 = same.iter().map(|a| a.score).sum();
        let mean = |of: &dyn Fn(&DetectedFace) -> Vec2| same.iter().map(|a| of(a) * a.score).sum::<Vec2>() / total;
        faces.push(DetectedFace {
            centre: mean(&|a| a.centre),
            size: same.iter().map(|a| a.size * a.score).sum::<f64>() / total,
            key_points: std::array::from_fn(|k| mean(&|a| a.key_points[k])),
            score: best.score,
        });
        answers = others;
    }
    faces
}

/// The detectors, and the places where they look.
pub struct FaceFinder {
    full_range: Detector,
    back_camera: Detector,
}

impl FaceFinder {
    /// Loads both nets.
    pub fn load(folder: &Path, threads: &Threads) -> Result<Self, LandmarkError> {
        Ok(Self {
            full_range: Detector::load(folder, "face_detection_full_range", 192, &[(48, 1)], threads)?,
            back_camera: Detector::load(folder, "face_detection_back", 256, &[(16, 2), (8, 6)], threads)?,
        })
    }

    /// How many of the attempts look at the whole picture.
    pub const WHOLE: usize = 2;

    /// The faces of one attempt after the other, lazily, each attempt's largest first.
    pub fn attempts<'a>(
        &'a self,
        image: &'a RgbImage,
    ) -> impl Iterator<Item = Result<Vec<DetectedFace>, LandmarkError>> + 'a {
        let whole = Region::whole(image);
        let first = [(&self.full_range, whole), (&self.back_camera, whole)];
        let rest = other_places(image).into_iter().map(|region| (&self.full_range, region));
        first.into_iter().chain(rest).map(move |(detector, region)| detector.detect(image, &region))
    }
}

/// Where to look when the whole picture shows no face: further away, turned, closer.
fn other_places(image: &RgbImage) -> Vec<Region> {
    let whole = Region::whole(image);
    let mut places = vec![Region { side: 1.6 * whole.side, ..whole }];
    let turns = [FRAC_PI_2, -FRAC_PI_2, PI];
    places.extend(turns.map(|angle| Region { angle, side: 1.2 * whole.side, ..whole }));
    let short = f64::from(image.width().min(image.height()));
    for side in [short, short / 2.0].into_iter().filter(|&side| side >= SMALLEST_TILE) {
        places.extend(tiles(image, side));
    }
    places
}

/// Squares of `side` that cover the picture, each overlapping its neighbours by at least a third.
fn tiles(image: &RgbImage, side: f64) -> Vec<Region> {
    let starts = |size: u32| {
        let slack = f64::from(size) - side;
        let steps = (slack / (side * 2.0 / 3.0)).ceil().max(0.0);
        (0..=steps as usize).map(move |k| if steps > 0.0 { slack * k as f64 / steps } else { slack / 2.0 })
    };
    let middle = Vec2::from_element((side - 1.0) / 2.0);
    starts(image.height())
        .flat_map(|y| starts(image.width()).map(move |x| Region { centre: Vec2::new(x, y) + middle, side, angle: 0.0 }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face(x: f64, y: f64, size: f64, score: f64) -> DetectedFace {
        let centre = Vec2::new(x, y);
        DetectedFace { centre, size, key_points: [centre; 6], score }
    }

    #[test]
    fn overlap_is_one_with_itself_and_zero_apart() {
        let a = face(50.0, 50.0, 20.0, 0.9);
        assert!((a.overlap(&a) - 1.0).abs() < 1e-12);
        assert_eq!(a.overlap(&face(80.0, 50.0, 20.0, 0.9)), 0.0);
        assert!((a.overlap(&face(60.0, 50.0, 20.0, 0.9)) - 1.0 / 3.0).abs() < 1e-12);
        assert!((a.overlap(&face(50.0, 50.0, 10.0, 0.9)) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn answers_about_one_face_are_averaged_by_score_and_others_kept() {
        let merged =
            merge(vec![face(10.0, 10.0, 20.0, 0.6), face(100.0, 10.0, 30.0, 0.7), face(12.0, 10.0, 20.0, 0.9)]);
        assert_eq!(merged.len(), 2);
        assert!((merged[0].centre.x - (12.0 * 0.9 + 10.0 * 0.6) / 1.5).abs() < 1e-12);
        assert_eq!((merged[0].score, merged[1].score), (0.9, 0.7));
    }

    #[test]
    fn tiles_cover_every_pixel() {
        let image = RgbImage::new(1920, 1080);
        let places = tiles(&image, 540.0);
        for (x, y) in [(0.0, 0.0), (1919.0, 1079.0), (1919.0, 0.0), (700.0, 533.0)] {
            let inside = |r: &Region| (Vec2::new(x, y) - r.centre).amax() <= 270.0;
            assert!(places.iter().any(inside));
        }
        assert_eq!(tiles(&RgbImage::new(300, 300), 300.0).len(), 1);
    }

    #[test]
    fn a_glance_costs_a_quarter_of_a_thorough_look_or_less() {
        for (width, height) in [(352, 288), (640, 480), (1920, 1080), (720, 1280)] {
            let thorough = FaceFinder::WHOLE + other_places(&RgbImage::new(width, height)).len();
            assert!((4 * FaceFinder::WHOLE..=40).contains(&thorough), "{width}x{height}: {thorough} places");
        }
    }

    #[test]
    fn the_region_follows_tilted_eyes() {
        let mut tilted = face(50.0, 50.0, 20.0, 1.0);
        tilted.key_points[0] = Vec2::new(45.0, 45.0);
        tilted.key_points[1] = Vec2::new(55.0, 55.0);
        assert!((tilted.region().angle - PI / 4.0).abs() < 1e-12);
    }
}
