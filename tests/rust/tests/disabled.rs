//! An artist's disabled markers, in a reconstruction of the synthetic person's film from tracks.

use end_to_end::{assets, clip};
use facewright::{
    Assets, DisabledPoint, FrameSet, Given, ReconstructOptions, TrackClipOptions, Tracks, find_faces, reconstruct,
    track,
};
use geometry::{Progress, Vec2};

/// Distance of disabled places from each other, pixels: less than the tracker's window.
const APART: usize = 12;

/// Places all over the right half of the face in every frame, and beyond.
fn right_half(tracks: &Tracks) -> Vec<DisabledPoint> {
    let camera = tracks.camera.camera;
    let of_frame = |frame: usize| {
        let seen = tracks.tracks.iter().flat_map(|track| &track.observations).filter(|o| o.frame == frame);
        let (sum, count) = seen.fold((0.0, 0), |(sum, count), o| (sum + o.pixel.x, count + 1));
        let middle = (sum / f64::from(count)) as usize;
        let columns = (middle..camera.width as usize).step_by(APART);
        columns
            .flat_map(move |x| (0..camera.height as usize).step_by(APART).map(move |y| (x, y)))
            .map(move |(x, y)| DisabledPoint { frame, pixel: Vec2::new(x as f64, y as f64) })
    };
    (0..tracks.frames.len()).filter(|&frame| tracks.frames[frame].used).flat_map(of_frame).collect()
}

#[test]
fn where_markers_are_disabled_a_reconstruction_measures_nothing_of_its_own() {
    let (assets, progress) = (Assets::load(&assets().unwrap()).unwrap(), Progress::new());
    let frames = FrameSet::open(&[clip().join("frames")], &progress).unwrap();
    let faces = find_faces(&frames, &assets, None, &progress).unwrap();
    let of_faces = Given { faces: Some(faces), ..Given::default() };
    let tracks =
        track(&frames, &assets, None, of_faces.faces.as_ref(), &TrackClipOptions::default(), &progress).unwrap();
    let options = ReconstructOptions { texture_size: 256, ..ReconstructOptions::default() };
    let points = |tracks: Tracks| {
        let given = Given { tracks: Some(tracks), ..of_faces.clone() };
        reconstruct(&frames, &assets, &given, &options, &progress).unwrap().report.points
    };
    let all = points(tracks.clone());
    let spared = points(tracks.with_disabled(right_half(&tracks)).unwrap());
    println!("{all} points, {spared} beside the disabled ones");
    assert!(spared > 0 && 10 * spared < 7 * all, "{spared} of {all} points");
}
