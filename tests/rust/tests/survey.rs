//! The quick look at a clip: what it measures on the synthetic person's film, whose turn is known, and what it says of bad ones.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{assets, clip, truth::Truth};
use facewright::{Assets, FaceOptions, FindingKind, ReasonKind, Survey, check_face, survey};
use geometry::Progress;
use image::{Rgb, RgbImage, imageops};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

static ASSETS: LazyLock<Assets> = LazyLock::new(|| Assets::load(&assets().unwrap()).unwrap());

fn surveyed(inputs: &[PathBuf], numbers: Option<&[usize]>) -> Survey {
    survey((inputs, numbers), &ASSETS, (None, &FaceOptions::default()), &Progress::new()).unwrap()
}

fn kinds(survey: &Survey) -> Vec<FindingKind> {
    survey.findings.iter().map(|finding| finding.kind).collect()
}

/// The synthetic person's frames, changed, in a folder.
fn changed(folder: &Path, change: impl Fn(RgbImage) -> RgbImage) -> Vec<PathBuf> {
    let of = |number: usize| {
        let frame = image::open(clip().join(format!("frames/frame_{number:02}.jpg"))).unwrap().into_rgb8();
        let path = folder.join(format!("{number:02}.png"));
        change(frame).save(&path).unwrap();
        path
    };
    (0..21).step_by(2).map(of).collect()
}

#[test]
fn a_good_film_has_no_findings_and_its_turn_is_the_true_one() {
    let found = surveyed(&[clip().join("frames")], None);
    assert_eq!((found.frames, found.looks.len(), (found.width, found.height)), (21, 21, (400, 300)));
    assert_eq!(kinds(&found), []);
    let truth = Truth::read();
    for (look, yaw) in found.looks.iter().zip(&truth.yaw_deg) {
        let face = look.face.as_ref().unwrap();
        // Landmarks see less of a turn than there is.
        assert!((face.yaw_deg - yaw).abs() < 8.0, "{}: {} instead of {yaw}", look.name, face.yaw_deg);
        assert!(face.roll_deg.abs() < 5.0, "{}: {}", look.name, face.roll_deg);
        let [left, top, width, height] = face.rectangle;
        assert!(width > 60 && height > 80 && left + width <= 400 && top + height <= 300);
        assert_eq!(look.thumbnail.dimensions(), (96, 72));
    }
    assert!(found.looks.iter().all(|look| look.usable == (look.reason_kind == ReasonKind::Yaw)));
}

#[test]
fn a_part_is_checked_without_another_look() {
    let found = surveyed(&[clip().join("frames")], None);
    let left = found.part(|number| number < 9);
    assert_eq!((left.frames, left.looks.len()), (9, 9));
    assert_eq!(kinds(&left), [FindingKind::OneSided]);
    assert!(left.findings[0].sentence.contains("to the left of the picture only: film it while it turns to the right"));
    assert_eq!(kinds(&found.part(|number| (8..11).contains(&number))), [FindingKind::TurnsLittle]);
    assert_eq!(found.part(|_| true), found);
}

#[test]
fn numbers_are_those_of_the_clip_and_the_survey_is_the_same_each_time() {
    let numbers: Vec<usize> = (1..20).step_by(3).collect();
    let found = surveyed(&[clip().join("frames")], Some(&numbers));
    assert_eq!(found.looks.iter().map(|look| look.number).collect::<Vec<_>>(), numbers);
    assert_eq!(found.looks[1].name, "frame_04");
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| surveyed(&[clip().join("frames")], Some(&numbers))), found);
}

#[test]
fn what_is_wrong_with_a_film_is_told_and_nothing_else() {
    type Change = fn(RgbImage) -> RgbImage;
    let dark: Change = |mut frame| {
        frame.iter_mut().for_each(|value| *value = (f64::from(*value) * 0.1) as u8);
        frame
    };
    let burnt: Change = |mut frame| {
        frame.iter_mut().for_each(|value| *value = (f64::from(*value) * 2.6).min(255.0) as u8);
        frame
    };
    let cases: [(Change, FindingKind); 4] = [
        (dark, FindingKind::Dark),
        (burnt, FindingKind::Clipped),
        (|frame| imageops::blur(&frame, 5.0), FindingKind::Blurred),
        (|frame| imageops::resize(&frame, 90, 68, imageops::FilterType::Triangle), FindingKind::Small),
    ];
    for (change, kind) in cases {
        let folder = tempfile::tempdir().unwrap();
        let found = surveyed(&changed(folder.path(), change), None);
        assert_eq!(kinds(&found), [kind], "{:?}", found.findings);
    }
}

#[test]
fn a_clip_without_a_face_is_told_as_a_reconstruction_would_tell_it() {
    let folder = tempfile::tempdir().unwrap();
    let empty = changed(folder.path(), |frame| RgbImage::from_pixel(frame.width(), frame.height(), Rgb([90, 120, 90])));
    let found = surveyed(&empty, None);
    assert_eq!(kinds(&found), [FindingKind::NoFace]);
    assert!(found.looks.iter().all(|look| !look.usable && look.reason_kind == ReasonKind::NoFace));
    let refused = check_face(&empty, 1337, &ASSETS.landmarker, &Progress::new()).unwrap_err().to_string();
    assert!(refused.starts_with("no face was found in any of the 1337 frames"), "{refused}");
    let sentence = &found.findings[0].sentence;
    assert_eq!(sentence.replace("11 frames", "1337 frames"), refused);
}

#[test]
fn a_face_among_pictures_without_one_is_found() {
    let mut pictures = vec![clip().join("no_face.jpg"); 5];
    pictures.push(clip().join("frames/frame_10.jpg"));
    check_face(&pictures, 6, &ASSETS.landmarker, &Progress::new()).unwrap();
}

#[test]
fn what_is_no_clip_is_refused() {
    let refused = |inputs: &[&str]| {
        let inputs: Vec<PathBuf> = inputs.iter().map(Into::into).collect();
        let options = FaceOptions::default();
        survey((&inputs, None), &ASSETS, (None, &options), &Progress::new()).unwrap_err().to_string()
    };
    assert!(refused(&["a.mp4", "b.mp4"]).contains("one video, one folder, or pictures"));
    assert!(refused(&["nowhere.mp4"]).contains("there is no such file"));
    assert!(refused(&["nowhere"]).contains("nowhere"));
}
