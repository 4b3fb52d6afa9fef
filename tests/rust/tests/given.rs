//! What one command wrote gives another the same head; and large frames give what small ones do. On the film of
//! `blend_fixtures/synthetic_person.blend`.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::truth::Truth;
use end_to_end::{assets, clip};
use facewright::{
    Assets, CalibrateOptions, Faces, FrameSet, Given, HeadMotion, MotionOptions, ReconstructOptions, SourcedCamera,
    TrackClipOptions, Tracks, calibrate, find_faces, reconstruct, solve_motion, track,
};
use geometry::{Camera, Progress, Vec2, Vec3};
use image::imageops::{FilterType, resize};
use std::path::Path;
use std::sync::LazyLock;

struct Film {
    assets: Assets,
    camera: SourcedCamera,
    frames: FrameSet,
}

static FILM: LazyLock<Film> = LazyLock::new(|| {
    let open = |folder: &str| FrameSet::open(&[clip().join(folder)], &Progress::new()).unwrap();
    let camera = calibrate(&open("board"), &CalibrateOptions::default(), &Progress::new()).unwrap().camera;
    Film { assets: Assets::load(&assets().unwrap()).unwrap(), camera, frames: open("frames") }
});

fn with_camera() -> Given {
    Given { camera: Some(FILM.camera), ..Given::default() }
}

fn head(given: Given) -> Vec<Vec3> {
    let options = ReconstructOptions { texture_size: 256, ..ReconstructOptions::default() };
    reconstruct(&FILM.frames, &FILM.assets, &given, &options, &Progress::new()).unwrap().positions
}

#[test]
fn the_files_of_faces_track_and_motion_each_give_the_head_that_the_frames_give() {
    let (folder, progress) = (tempfile::tempdir().unwrap(), Progress::new());
    let path = |name: &str| folder.path().join(name);
    let faces = find_faces(&FILM.frames, &FILM.assets, Some(&FILM.camera), &progress).unwrap();
    faces.write(&path("faces.json")).unwrap();
    let options = TrackClipOptions::default();
    let tracks = track(&FILM.frames, &FILM.assets, Some(&FILM.camera), None, &options, &progress).unwrap();
    tracks.write(&path("tracks.json")).unwrap();
    let motion = solve_motion(&tracks, None, &MotionOptions::default(), &progress).unwrap();
    motion.write(&path("motion.json")).unwrap();
    let given = [
        Given { faces: Some(Faces::read(&path("faces.json")).unwrap()), ..with_camera() },
        Given { tracks: Some(Tracks::read(&path("tracks.json")).unwrap()), ..with_camera() },
        Given { motion: Some(HeadMotion::read(&path("motion.json")).unwrap()), ..with_camera() },
    ];
    let own = head(with_camera());
    for (what, given) in ["faces", "tracks", "motion"].into_iter().zip(given) {
        let farthest = head(given).iter().zip(&own).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(farthest < 1e-5, "{what}: {} mm", 1000.0 * farthest);
    }
}

/// Every fourth frame, enlarged and as soft as that makes it.
fn enlarged(folder: &Path, factor: u32) -> FrameSet {
    for i in (0..FILM.frames.len()).step_by(4) {
        let picture = FILM.frames.load(i).unwrap();
        let large = resize(&picture, factor * picture.width(), factor * picture.height(), FilterType::CatmullRom);
        large.save(folder.join(format!("{}.png", FILM.frames.frames[i].name))).unwrap();
    }
    FrameSet::open(&[folder.to_owned()], &Progress::new()).unwrap()
}

/// Tracks of every fourth frame at a size: how many, and how far they are from the truth, in pixels of the film.
fn errors(factor: u32) -> (usize, Vec<f64>) {
    let folder = tempfile::tempdir().unwrap();
    let frames = enlarged(folder.path(), factor);
    let camera: Camera = FILM.camera.camera.resized(f64::from(factor));
    let (camera, options) = (SourcedCamera { camera, ..FILM.camera }, TrackClipOptions::default());
    let tracks = track(&frames, &FILM.assets, Some(&camera), None, &options, &Progress::new()).unwrap();
    let (truth, half) = (Truth::read(), Vec2::repeat(0.5));
    let small = |pixel: &Vec2| (pixel + half) / f64::from(factor) - half;
    let of_track = |t: &facewright::PointTrack| {
        let own = t.observations.iter().find(|o| o.frame == t.reference).unwrap();
        let error = |o: &facewright::PointObservation| {
            let there = truth.carried(4 * t.reference, 4 * o.frame, &small(&own.pixel))?;
            Some((there - small(&o.pixel)).norm())
        };
        t.observations.iter().filter(|o| o.frame != t.reference).filter_map(error).collect::<Vec<_>>()
    };
    (tracks.tracks.len(), tracks.tracks.iter().flat_map(of_track).collect())
}

#[test]
fn a_soft_film_of_a_large_face_is_tracked_like_the_small_one_it_was_made_of() {
    let median = |errors: &mut Vec<f64>| {
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    let ((few, mut small), (many, mut large)) = (errors(1), errors(4));
    assert!(many * 3 >= few * 2, "{many} points instead of {few}");
    assert!(large.len() * 3 >= small.len() * 2, "{} observations instead of {}", large.len(), small.len());
    let (small, large) = (median(&mut small), median(&mut large));
    assert!(large < 1.5 * small, "{large} px instead of {small}");
}
