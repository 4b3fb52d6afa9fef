//! Faces in pictures: 468 points of the face mesh, and the irises.
//!
//! # Entry points
//! - [`FaceLandmarker::find`]: a single picture. [`FaceLandmarker::follow`]: the next frame of a video.
//! - [`FaceLandmarker::detect`]: only whether and where faces are.
//! - [`face_mask`]: the pixels of the face's skin.
//! - [`FaceLandmarker::person`]: the person around a face, and what is behind.
//!
//! # Conventions
//! Pixels, x right, y down, pixel centres at integers. "Left" and "right" are the subject's. The nets are Google's
//! MediaPipe nets, translated by the crate `assets`. The same picture gives the same bytes whatever the number of threads.

mod crop;
mod detector;
mod error;
mod iris;
mod mask;
mod mesh;
mod net;
mod person;
mod rounded;

pub use detector::DetectedFace;
pub use error::LandmarkError;
pub use iris::Iris;
pub use mask::{MaskOptions, face_mask, fill_polygon};
pub use person::PersonMask;

use crop::{Nearness, Region};
use detector::FaceFinder;
use geometry::Vec3;
use image::RgbImage;
use iris::IrisNet;
use mesh::{MeshNet, region_of};
use net::Threads;
use person::PersonNet;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Below this score a region does not show a face.
const LEAST_SCORE: f64 = 0.5;
/// Faces score above this, even half hidden; places that only resemble a face rarely do.
const CERTAIN_SCORE: f64 = 0.99;
/// Flip disagreement, in eye distances, of answers that are no guesses. (Turned by 60 degrees: 0.08.)
const CERTAIN_DISAGREEMENT: f64 = 0.12;
/// Looks to centre a face at most. A video needs one or two, a face the detector saw askew more.
const MOST_LOOKS: usize = 6;
/// A region this near the one before is centred.
const SETTLED: Nearness = Nearness { shift: 0.05, growth: 1.08, turn: 0.08 };
/// How far a followed face may move from frame to frame before we look for it anew.
const SAME_PERSON: Nearness = Nearness { shift: 0.4, growth: 1.6, turn: 1.0 };

/// A face: its points and irises. In files, places are rounded to a ten-thousandth of a pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Face {
    /// 468 points: `u, v` pixels, and the depth in the same scale, growing away from the camera.
    #[serde(with = "rounded")]
    pub points: Vec<Vec3>,
    /// How sure the net is that this is a face, 0 to 1.
    pub score: f64,
    /// Median distance between the net's answers for the picture and for its mirror image, pixels: a measure of the
    /// error the net makes in this picture.
    pub flip_disagreement_px: f64,
    /// The irises, `[subject's left, subject's right]`.
    pub irises: [Iris; 2],
    /// Faces the detector saw when it last ran on the whole picture.
    pub faces_in_picture: usize,
}

impl Face {
    /// Distance between the middles of the eyes (their corners' mean), pixels.
    pub fn eye_distance(&self) -> f64 {
        let middle = |ends: [usize; 2]| (self.points[ends[0]].xy() + self.points[ends[1]].xy()) / 2.0;
        let [left, right] = geometry::face_mesh::EYE_CORNERS.map(middle);
        (left - right).norm()
    }

    /// The face as it is read from a file: whoever goes on from one does what was done at first.
    pub fn rounded(mut self) -> Self {
        self.points.iter_mut().for_each(|point| *point = point.map(rounded::round));
        for iris in &mut self.irises {
            iris.centre = iris.centre.map(rounded::round);
            iris.eye_contour.iter_mut().for_each(|point| *point = point.map(rounded::round));
        }
        self
    }

    /// Whether all its numbers may be those of a face; a sentence where they may not.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn check(&self) -> Result<(), &'static str> {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if self.points.len() != geometry::face_mesh::LANDMARKS {
            return Err("the face does not have 468 points");
        }
        let contours = || self.irises.iter().flat_map(|iris| &iris.eye_contour);
        let is_sound = self.points.iter().all(|p| finite(p.as_slice()))
            && contours().all(|p| finite(p.as_slice()))
            && self.irises.iter().all(|iris| finite(iris.centre.as_slice()) && finite(&[iris.radius]));
        if is_sound { Ok(()) } else { Err("the face has numbers that are not finite") }
    }

    /// Whether this is a face beyond doubt.
    fn is_certain(&self) -> bool {
        self.score > CERTAIN_SCORE && self.flip_disagreement_px < CERTAIN_DISAGREEMENT * self.eye_distance()
    }

    /// Whether it is where the same person may be in the frame after `previous`.
    pub fn may_follow(&self, previous: &Self) -> bool {
        self.region().is_near(&previous.region(), SAME_PERSON)
    }

    /// The square around the face.
    fn region(&self) -> Region {
        region_of(&self.points)
    }
}

/// Finds faces. Loads the nets once; may be shared between threads.
pub struct FaceLandmarker {
    threads: Threads,
    finder: FaceFinder,
    mesh: MeshNet,
    iris: IrisNet,
    person: PersonNet,
}

impl FaceLandmarker {
    /// Loads the nets from a folder.
    ///
    /// # Errors
    /// [`LandmarkError`] when a net is missing or unusable.
    pub fn load(nets_dir: &Path) -> Result<Self, LandmarkError> {
        Self::load_on(nets_dir, Threads::new(None))
    }

    fn load_on(nets_dir: &Path, threads: Threads) -> Result<Self, LandmarkError> {
        Ok(Self {
            finder: FaceFinder::load(nets_dir, &threads)?,
            mesh: MeshNet::load(nets_dir, &threads)?,
            iris: IrisNet::load(nets_dir, &threads)?,
            person: PersonNet::load(nets_dir, &threads)?,
            threads,
        })
    }

    /// All faces found, largest first. Detector only: positions are rough and a few may be no faces.
    ///
    /// # Errors
    /// [`LandmarkError`] when the picture is empty or a net fails.
    pub fn detect(&self, image: &RgbImage) -> Result<Vec<DetectedFace>, LandmarkError> {
        check(image)?;
        self.threads.run(|| {
            let found = self.finder.attempts(image).find(|faces| !matches!(faces, Ok(faces) if faces.is_empty()));
            found.unwrap_or(Ok(Vec::new()))
        })
    }

    /// Whether there is a face that is neither small nor tilted far: a fraction of the work of [`FaceLandmarker::find`] where there is none.
    ///
    /// # Errors
    /// [`LandmarkError`] when the picture is empty or a net fails.
    pub fn glance(&self, image: &RgbImage) -> Result<bool, LandmarkError> {
        check(image)?;
        self.threads.run(|| {
            for detections in self.finder.attempts(image).take(FaceFinder::WHOLE) {
                for detection in detections? {
                    if self.look(image, detection.region(), 1)?.is_some() {
                        return Ok(true);
                    }
                }
            }
            Ok(false)
        })
    }

    /// The largest face of a picture; `None` when there is none.
    ///
    /// # Errors
    /// [`LandmarkError`] when the picture is empty or a net fails.
    pub fn find(&self, image: &RgbImage) -> Result<Option<Face>, LandmarkError> {
        check(image)?;
        self.threads.run(|| self.search(image, |_, _| true))
    }

    /// Every face of a picture, largest first.
    ///
    /// # Errors
    /// [`LandmarkError`] when the picture is empty or a net fails.
    pub fn find_all(&self, image: &RgbImage) -> Result<Vec<Face>, LandmarkError> {
        check(image)?;
        self.threads.run(|| {
            let found = self.finder.attempts(image).find(|faces| !matches!(faces, Ok(faces) if faces.is_empty()));
            let detections = found.unwrap_or(Ok(Vec::new()))?;
            let count = detections.len();
            let faces = detections.iter().map(|detection| self.look(image, detection.region(), count));
            let mut apart: Vec<Face> = Vec::new();
            for face in faces {
                // Two detections of one face end at the same place.
                let new =
                    face?.filter(|face| !apart.iter().any(|other| face.region().is_near(&other.region(), SAME_PERSON)));
                apart.extend(new);
            }
            Ok(apart)
        })
    }

    /// The same person's face in the next frame of a video; `None` when it is not there. Starts from where the face was
    /// and looks over the whole picture only when it is no longer there.
    ///
    /// # Errors
    /// [`LandmarkError`] when the picture is empty or a net fails.
    pub fn follow(&self, image: &RgbImage, previous: &Face) -> Result<Option<Face>, LandmarkError> {
        check(image)?;
        self.threads.run(|| {
            let near = |face: &Face| face.may_follow(previous);
            match self.look(image, previous.region(), previous.faces_in_picture)? {
                Some(face) if near(&face) && face.is_certain() => Ok(Some(face)),
                _ => self.search(image, |face, count| near(face) || (count <= 1 && previous.faces_in_picture <= 1)),
            }
        })
    }

    /// The person around a face of a picture.
    ///
    /// # Errors
    /// [`LandmarkError`] when the picture is empty or the net fails.
    pub fn person(&self, image: &RgbImage, face: &Face) -> Result<PersonMask, LandmarkError> {
        check(image)?;
        self.threads.run(|| self.person.mask(image, face))
    }

    /// The first face, in the detector's order, that is beyond doubt and that `wanted` (given the face and how many
    /// there are) accepts; failing that, the least doubtful one.
    fn search(&self, image: &RgbImage, wanted: impl Fn(&Face, usize) -> bool) -> Result<Option<Face>, LandmarkError> {
        let mut best: Option<Face> = None;
        for detections in self.finder.attempts(image) {
            let detections = detections?;
            for detection in &detections {
                let Some(face) = self.look(image, detection.region(), detections.len())? else { continue };
                if !wanted(&face, detections.len()) {
                    continue;
                }
                if face.is_certain() {
                    return Ok(Some(face));
                }
                if best.as_ref().is_none_or(|best| face.score > best.score) {
                    best = Some(face);
                }
            }
        }
        Ok(best)
    }

    /// The face in a region: quick looks until it is centred, a balanced one for the points, then the eyes.
    fn look(&self, image: &RgbImage, region: Region, faces_in_picture: usize) -> Result<Option<Face>, LandmarkError> {
        let Some(region) = self.settle(image, region)? else { return Ok(None) };
        let (pass, flip_disagreement_px) = self.mesh.balanced(image, &region)?;
        if pass.score < LEAST_SCORE {
            return Ok(None);
        }
        let irises = self.iris.both(image, &pass.points)?;
        Ok(Some(Face { points: pass.points, score: pass.score, flip_disagreement_px, irises, faces_in_picture }))
    }

    /// The region that centres the face and levels its eyes; `None` when the net sees no face on the way there.
    fn settle(&self, image: &RgbImage, mut region: Region) -> Result<Option<Region>, LandmarkError> {
        for _ in 0..MOST_LOOKS {
            let pass = self.mesh.quick(image, &region)?;
            if pass.score < LEAST_SCORE {
                return Ok(None);
            }
            let last = std::mem::replace(&mut region, region_of(&pass.points));
            if region.is_near(&last, SETTLED) {
                break;
            }
        }
        Ok(Some(region))
    }
}

fn check(image: &RgbImage) -> Result<(), LandmarkError> {
    if image.width() == 0 || image.height() == 0 { Err(LandmarkError::EmptyPicture) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use std::path::PathBuf;

    fn workspace() -> PathBuf {
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
    }

    /// The landmarker on a number of threads; `None`, with a sentence, before the nets are built.
    fn landmarker(threads: usize) -> Option<FaceLandmarker> {
        let nets = workspace().join("target/assets/nets");
        if !nets.is_dir() {
            println!("skipped: no nets in {}; `cargo x head` builds them", nets.display());
            return None;
        }
        Some(FaceLandmarker::load_on(&nets, Threads::new(Some(threads))).unwrap())
    }

    /// A frame of the turning head; `None`, with a sentence, where the shared data is absent.
    fn frame(name: &str) -> Option<RgbImage> {
        let path = workspace().join("../shared/data/james-cif/frames").join(name);
        if !path.is_file() {
            println!("skipped: {} is absent", path.display());
            return None;
        }
        Some(image::open(path).unwrap().to_rgb8())
    }

    fn noise(width: u32, height: u32) -> RgbImage {
        let mut state = 1u32;
        RgbImage::from_fn(width, height, |_, _| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            Rgb([(state >> 24) as u8, (state >> 16) as u8, (state >> 8) as u8])
        })
    }

    /// Median distance between the points of two faces, in eye distances.
    fn distance(a: &Face, b: &Face) -> f64 {
        let mut apart: Vec<f64> = a.points.iter().zip(&b.points).map(|(p, q)| (p - q).xy().norm()).collect();
        apart.sort_by(f64::total_cmp);
        apart[apart.len() / 2] / a.eye_distance()
    }

    #[test]
    fn a_missing_net_is_named_with_its_remedy() {
        let error = FaceLandmarker::load(Path::new("/nowhere")).err().unwrap().to_string();
        assert!(
            error.contains("face_detection_full_range.onnx") && error.contains("install Facewright again"),
            "{error}"
        );
    }

    #[test]
    fn noise_and_flat_pictures_have_no_face() {
        let Some(landmarker) = landmarker(2) else { return };
        for image in [noise(320, 240), RgbImage::new(64, 48), RgbImage::from_pixel(1, 1, Rgb([200; 3]))] {
            assert!(landmarker.find(&image).unwrap().is_none());
        }
        assert!(matches!(landmarker.find(&RgbImage::new(0, 0)), Err(LandmarkError::EmptyPicture)));
    }

    #[test]
    fn one_and_two_threads_give_the_same_bytes() {
        let (Some(one), Some(two), Some(image)) = (landmarker(1), landmarker(2), frame("frame_0030.jpg")) else {
            return;
        };
        assert_eq!(one.find(&image).unwrap().unwrap(), two.find(&image).unwrap().unwrap());
    }

    #[test]
    fn a_mirrored_picture_gives_mirrored_landmarks() {
        let (Some(landmarker), Some(image)) = (landmarker(2), frame("frame_0030.jpg")) else { return };
        let face = landmarker.find(&image).unwrap().unwrap();
        let mut other = landmarker.find(&image::imageops::flip_horizontal(&image)).unwrap().unwrap();
        let unflipped = |p: &Vec3| Vec3::new(f64::from(image.width() - 1) - p.x, p.y, p.z);
        other.points = geometry::face_mesh::MIRROR.map(|i| unflipped(&other.points[i])).to_vec();
        // The first look places the region, and it alone is not balanced: half a crop pixel remains.
        assert!(distance(&face, &other) < 0.02);
    }

    #[test]
    fn landmarks_turn_with_the_picture_even_upside_down() {
        let (Some(landmarker), Some(image)) = (landmarker(2), frame("frame_0030.jpg")) else { return };
        let face = landmarker.find(&image).unwrap().unwrap();
        let (width, height) = (f64::from(image.width() - 1), f64::from(image.height() - 1));
        type Turn = (RgbImage, fn(Vec3, f64, f64) -> Vec3);
        let turns: [Turn; 3] = [
            (image::imageops::rotate90(&image), |p, _, h| Vec3::new(h - p.y, p.x, p.z)),
            (image::imageops::rotate180(&image), |p, w, h| Vec3::new(w - p.x, h - p.y, p.z)),
            (image::imageops::rotate270(&image), |p, w, _| Vec3::new(p.y, w - p.x, p.z)),
        ];
        for (turned, place) in turns {
            let found = landmarker.find(&turned).unwrap().unwrap();
            let mut expected = face.clone();
            expected.points.iter_mut().for_each(|p| *p = place(*p, width, height));
            assert!(distance(&expected, &found) < 0.015);
        }
    }

    #[test]
    fn following_agrees_with_finding_anew() {
        let Some(landmarker) = landmarker(2) else { return };
        let (Some(first), Some(next)) = (frame("frame_0028.jpg"), frame("frame_0031.jpg")) else { return };
        let previous = landmarker.find(&first).unwrap().unwrap();
        let (followed, found) = (landmarker.follow(&next, &previous).unwrap(), landmarker.find(&next).unwrap());
        assert!(distance(&followed.unwrap(), &found.unwrap()) < 0.01);
    }

    #[test]
    fn of_two_people_the_one_before_is_followed() {
        let (Some(landmarker), Some(image)) = (landmarker(2), frame("frame_0030.jpg")) else { return };
        let mut pair = RgbImage::new(2 * image.width(), image.height());
        image::imageops::replace(&mut pair, &image, 0, 0);
        image::imageops::replace(&mut pair, &image, i64::from(image.width()), 0);
        let left = landmarker.find(&image).unwrap().unwrap();
        let mut right = left.clone();
        right.points.iter_mut().for_each(|p| p.x += f64::from(image.width()));
        for previous in [left, right] {
            let followed = landmarker.follow(&pair, &previous).unwrap().unwrap();
            assert!(distance(&followed, &previous) < 0.01);
        }
        assert_eq!(landmarker.find(&pair).unwrap().unwrap().faces_in_picture, 2);
    }

    #[test]
    fn the_mask_of_a_face_leaves_out_eyes_and_mouth() {
        let (Some(landmarker), Some(image)) = (landmarker(2), frame("frame_0030.jpg")) else { return };
        let face = landmarker.find(&image).unwrap().unwrap();
        let mask = face_mask(&face, image.width(), image.height(), &MaskOptions::default());
        let at = |p: Vec3| mask.get_pixel(p.x.round() as u32, p.y.round() as u32).0[0];
        assert_eq!((at(face.points[4]), at(face.points[151]), at(face.points[205])), (255, 255, 255));
        let iris = face.irises[0].centre;
        assert_eq!((at(Vec3::new(iris.x, iris.y, 0.0)), mask.get_pixel(0, 0).0[0]), (0, 0));
    }
}
