//! Matches and tracks on the film of `blend_fixtures/synthetic_person.blend`, judged by rays cast at the true head.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::truth::Truth;
use end_to_end::{assets, clip};
use facewright::{
    Assets, CalibrateOptions, FacewrightError, FrameSet, Given, MatchOptions, Method, ReasonKind, ReconstructOptions,
    Region, SourcedCamera, TrackClipOptions, Tracks, calibrate, match_pair, reconstruct, track,
};
use geometry::{Progress, Vec2};
use std::path::PathBuf;
use std::sync::LazyLock;

struct Film {
    assets: Assets,
    truth: Truth,
    camera: SourcedCamera,
    frames: FrameSet,
    tracks: Tracks,
}

static FILM: LazyLock<Film> = LazyLock::new(|| {
    let assets = Assets::load(&assets().unwrap()).unwrap();
    let progress = Progress::new();
    let boards = FrameSet::open(&[clip().join("board")], &progress).unwrap();
    let camera = calibrate(&boards, &CalibrateOptions::default(), &progress).unwrap().camera;
    let frames = FrameSet::open(&[clip().join("frames")], &progress).unwrap();
    let tracks = track(&frames, &assets, Some(&camera), None, &options(), &progress).unwrap();
    Film { assets, truth: Truth::read(), camera, frames, tracks }
});

fn options() -> TrackClipOptions {
    TrackClipOptions { points: 120, ..TrackClipOptions::default() }
}

/// Tracks of frames of the film by its camera.
fn tracked(frames: &FrameSet, options: &TrackClipOptions) -> Result<Tracks, FacewrightError> {
    track(frames, &FILM.assets, Some(&FILM.camera), None, options, &Progress::new())
}

fn frame(index: usize) -> PathBuf {
    FILM.frames.frames[index].path.clone()
}

fn matched(a: usize, b: usize, options: &MatchOptions) -> facewright::MatchedPair {
    let camera = Some(&FILM.camera);
    let matches = match_pair(&frame(a), &frame(b), camera, &FILM.assets, options, &Progress::new()).unwrap();
    matches.pairs[0].clone()
}

/// The frame turned by about so many degrees more than the first of a pair.
fn turned_by(a: usize, degrees: f64) -> usize {
    let yaw = &FILM.truth.yaw_deg;
    let off = |i: usize| (yaw[i] - yaw[a] - degrees).abs();
    (0..yaw.len()).min_by(|&i, &j| off(i).total_cmp(&off(j))).unwrap()
}

#[test]
fn matches_of_two_frames_are_within_a_pixel_and_those_kept_are_right() {
    let start = turned_by(0, 15.0);
    for (degrees, least) in [(6.0, 0.95), (11.0, 0.90), (16.0, 0.80)] {
        let pair = matched(start, turned_by(start, degrees), &MatchOptions::default());
        let errors: Vec<(f64, bool)> = pair
            .points
            .iter()
            .filter_map(|p| {
                let truth = FILM.truth.carried(start, turned_by(start, degrees), &Vec2::new(p.0, p.1))?;
                Some(((truth - Vec2::new(p.2, p.3)).norm(), p.4 == 1))
            })
            .collect();
        let part = |limit: f64, of: &[f64]| of.iter().filter(|e| **e <= limit).count() as f64 / of.len() as f64;
        let all: Vec<f64> = errors.iter().map(|e| e.0).collect();
        let kept: Vec<f64> = errors.iter().filter(|e| e.1).map(|e| e.0).collect();
        assert!(all.len() > 55, "{} points at {degrees}°", all.len());
        assert!(part(1.0, &all) >= least, "{degrees}°: {} within a pixel", part(1.0, &all));
        assert!(part(1.5, &kept) >= 0.98, "{degrees}°: {} of those kept", part(1.5, &kept));
    }
}

#[test]
fn the_correction_can_be_left_out_and_says_what_it_did() {
    let (a, b) = (turned_by(0, 15.0), turned_by(0, 27.0));
    let method = Method::Paper;
    let plain = matched(a, b, &MatchOptions { correct: false, method, ..MatchOptions::default() });
    let corrected = matched(a, b, &MatchOptions { method, ..MatchOptions::default() });
    assert!(plain.outcomes.iter().all(|outcome| !outcome.starts_with("moved")));
    assert_eq!(plain.tracked, corrected.tracked);
    assert_eq!(corrected.violations_after, 0);
    assert_eq!(corrected.points.len(), corrected.outcomes.len());
}

#[test]
fn tracks_stay_on_their_point_through_the_whole_turn() {
    let mut errors = Vec::new();
    for point in &FILM.tracks.tracks {
        let own = point.observations.iter().find(|o| o.frame == point.reference).unwrap();
        for o in point.observations.iter().filter(|o| o.frame != point.reference) {
            let truth = FILM.truth.carried(point.reference, o.frame, &own.pixel);
            errors.extend(truth.map(|truth| (truth - o.pixel).norm()));
        }
    }
    let within = |limit: f64| errors.iter().filter(|e| **e <= limit).count() as f64 / errors.len() as f64;
    assert!(errors.len() > 1000, "{} observations", errors.len());
    assert!(within(1.0) > 0.95 && within(1.5) > 0.98, "{} within 1, {} within 1.5 px", within(1.0), within(1.5));
    assert!(FILM.tracks.frames.iter().all(|f| f.used && f.points >= 60), "{:?}", FILM.tracks.frames);
    assert!(FILM.tracks.tracks.iter().any(|t| t.region == Region::Mouth));
}

#[test]
fn one_thread_and_two_give_the_same_tracks() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = pool.install(|| tracked(&FILM.frames, &options()).unwrap());
    assert_eq!(serde_json::to_string(&alone).unwrap(), serde_json::to_string(&FILM.tracks).unwrap());
}

#[test]
fn the_papers_tracker_follows_the_film_too() {
    let options = TrackClipOptions { method: Method::Paper, points: 66, ..options() };
    let tracks = tracked(&FILM.frames, &options).unwrap();
    assert!(tracks.tracks.len() > 30, "{}", tracks.tracks.len());
    assert!(tracks.tracks.iter().all(|t| t.reference == tracks.tracks[0].reference));
}

#[test]
fn a_face_that_leaves_ends_its_tracks_with_a_reason() {
    let mut inputs: Vec<PathBuf> = (0..6).map(frame).collect();
    let leaving = tempfile::tempdir().unwrap();
    let empty = leaving.path().join("gone.png");
    image::RgbImage::from_pixel(FILM.frames.width, FILM.frames.height, image::Rgb([90; 3])).save(&empty).unwrap();
    inputs.push(empty);
    let frames = FrameSet::open(&inputs, &Progress::new()).unwrap();
    let tracks = tracked(&frames, &options()).unwrap();
    assert_eq!((tracks.frames[6].used, tracks.frames[6].reason.as_str()), (false, "no face"));
    assert_eq!(tracks.frames[6].reason_kind, Some(ReasonKind::NoFace));
    assert!(tracks.frames[..6].iter().all(|frame| frame.reason_kind == Some(ReasonKind::Yaw)));
    assert!(tracks.tracks.iter().all(|t| t.gaps.last().is_some_and(|gap| gap.last == 6 && gap.reason == "no face")));
}

#[test]
fn a_head_is_reconstructed_from_given_tracks_and_not_from_those_of_another_clip() {
    let options = ReconstructOptions { texture_size: 256, ..ReconstructOptions::default() };
    let by = |tracks: Tracks| {
        let given = Given { camera: Some(FILM.camera), tracks: Some(tracks), ..Given::default() };
        reconstruct(&FILM.frames, &FILM.assets, &given, &options, &Progress::new())
    };
    let made = by(FILM.tracks.clone()).unwrap();
    assert!(made.report.points >= 60, "{} points", made.report.points);
    assert!(made.report.warnings.iter().all(|w| !w.contains("landmarks alone")), "{:?}", made.report.warnings);
    let mut other = FILM.tracks.clone();
    other.frames.swap(0, 1);
    let refused = by(other);
    assert!(refused.err().unwrap().to_string().starts_with("these tracks do not belong to this clip"));
}

#[test]
fn options_that_cannot_be_are_refused_before_the_work() {
    let refused = |options: TrackClipOptions| tracked(&FILM.frames, &options).unwrap_err().to_string();
    assert!(refused(TrackClipOptions { window: Some(8), ..options() }).contains("odd number"));
    assert!(refused(TrackClipOptions { points: 1, ..options() }).contains("8 to 5000"));
    let nowhere = TrackClipOptions { from: Some("elsewhere".to_owned()), ..options() };
    assert!(refused(nowhere).contains("is named elsewhere"));
}
