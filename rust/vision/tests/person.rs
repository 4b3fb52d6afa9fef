//! The person in a frame of the synthetic clip, as the built nets tell it.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use geometry::Vec2;
use image::RgbImage;
use std::path::{Path, PathBuf};
use vision::landmarks::{Face, FaceLandmarker};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The nets, a frame and its face; `None`, with a sentence, before the nets are built.
fn looked() -> Option<(FaceLandmarker, RgbImage, Face)> {
    let nets = workspace().join("target/assets/nets");
    if !nets.is_dir() {
        eprintln!("skipped: no nets in {}; `cargo x head` builds them", nets.display());
        return None;
    }
    let landmarker = FaceLandmarker::load(&nets).unwrap();
    let picture = image::open(workspace().join("tests/data/clip/frames/frame_10.jpg")).unwrap().into_rgb8();
    let face = landmarker.find(&picture).unwrap().unwrap();
    Some((landmarker, picture, face))
}

#[test]
fn the_person_holds_the_face_and_ends_before_the_wall() {
    let Some((landmarker, picture, face)) = looked() else { return };
    let person = landmarker.person(&picture, &face).unwrap();
    let outside = face.points.iter().filter(|point| person.distance(&point.xy()).unwrap() < 0.0).count();
    assert!(outside < face.points.len() / 50, "{outside} of the face's points are outside of the person");
    let middle = face.points.iter().map(|point| point.xy()).sum::<Vec2>() / face.points.len() as f64;
    for side in [-1.0, 1.0] {
        let beside = middle + Vec2::new(side * 2.2 * face.eye_distance(), 0.0);
        assert!(person.probability(&beside).unwrap() < 0.2, "{beside}");
    }
}

#[test]
fn the_person_turns_with_the_picture() {
    let Some((landmarker, picture, face)) = looked() else { return };
    let turned = image::imageops::rotate90(&picture);
    let found = landmarker.find(&turned).unwrap().unwrap();
    let (person, other) = (landmarker.person(&picture, &face).unwrap(), landmarker.person(&turned, &found).unwrap());
    let height = f64::from(picture.height() - 1);
    let is_apart = |pixel: &Vec2| {
        let (here, there) = (person.probability(pixel), other.probability(&Vec2::new(height - pixel.y, pixel.x)));
        here.zip(there).is_some_and(|(here, there)| (here - there).abs() > 0.5)
    };
    let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
    let apart = pixels.filter(|&(x, y)| is_apart(&Vec2::new(f64::from(x), f64::from(y)))).count();
    assert!(apart < picture.as_raw().len() / 3 / 100, "{apart} pixels");
}

#[test]
fn a_frame_asked_twice_gives_the_same_person() {
    let Some((landmarker, picture, face)) = looked() else { return };
    assert_eq!(landmarker.person(&picture, &face).unwrap(), landmarker.person(&picture, &face).unwrap());
}
