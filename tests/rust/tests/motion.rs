//! The motion of the filmed synthetic person from its tracks, and clips that have none.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::truth::Truth;
use end_to_end::{assets, clip};
use facewright::{
    Assets, CalibrateOptions, CameraSource, FacewrightError, FrameSet, HeadMotion, KnownLength, MotionOptions,
    PointObservation, PointTrack, ReasonKind, Region, SizeOptions, SourcedCamera, TrackClipOptions, Tracks, calibrate,
    solve_motion, track,
};
use geometry::mesh::closest_barycentric;
use geometry::{Camera, Progress, Similarity, Transform, Vec2, Vec3};
use nalgebra::Rotation3;
use std::path::Path;
use std::sync::LazyLock;

struct Film {
    truth: Truth,
    camera: SourcedCamera,
    tracks: Tracks,
}

static FILM: LazyLock<Film> = LazyLock::new(|| {
    let (assets, progress) = (Assets::load(&assets().unwrap()).unwrap(), Progress::new());
    let camera = calibrated(&clip());
    let frames = FrameSet::open(&[clip().join("frames")], &progress).unwrap();
    let tracks = track(&frames, &assets, Some(&camera), None, &TrackClipOptions::default(), &progress).unwrap();
    Film { truth: Truth::read(), camera, tracks }
});

fn calibrated(folder: &Path) -> SourcedCamera {
    let boards = FrameSet::open(&[folder.join("board")], &Progress::new()).unwrap();
    calibrate(&boards, &CalibrateOptions::default(), &Progress::new()).unwrap().camera
}

fn solved(tracks: &Tracks) -> HeadMotion {
    sized(tracks, SizeOptions::default()).unwrap()
}

/// The motion with what is known of the head's size.
fn sized(tracks: &Tracks, size: SizeOptions) -> Result<HeadMotion, FacewrightError> {
    solve_motion(tracks, None, &MotionOptions { size }, &Progress::new())
}

/// Takes the solved head to the true one, as the cameras stand: the size by their places, then all by places and axes.
fn true_from_solved(motion: &HeadMotion, truth: &[Transform]) -> Similarity {
    let posed = motion.frames.iter().zip(truth).filter_map(|(frame, truth)| Some((frame.cam_from_head?, *truth)));
    let (ours, theirs): (Vec<Transform>, Vec<Transform>) = posed.unzip();
    let fit = |reach: [f64; 2]| {
        let stand = |pose: &Transform, reach: f64| {
            [Vec3::zeros(), Vec3::x() * reach, Vec3::y() * reach].map(|p| pose.inverse().apply(&p))
        };
        let ours: Vec<_> = ours.iter().map(|pose| stand(pose, reach[0])).collect();
        let theirs: Vec<_> = theirs.iter().map(|pose| stand(pose, reach[1])).collect();
        Similarity::fit(ours.as_flattened(), theirs.as_flattened(), None, true).unwrap()
    };
    let places = fit([0.0, 0.0]);
    fit([0.7 / places.scale, 0.7])
}

/// Median errors of the rotations, degrees, and of the positions, as part of the distance.
fn pose_errors(motion: &HeadMotion, truth: &[Transform]) -> (f64, f64) {
    let to_truth = true_from_solved(motion, truth);
    let posed = motion.frames.iter().zip(truth).filter_map(|(frame, truth)| Some((frame.cam_from_head?, truth)));
    let (turns, shifts): (Vec<f64>, Vec<f64>) = posed
        .map(|(ours, truth)| {
            let moved = to_truth.move_pose(&ours);
            let off = (moved.translation - truth.translation).norm() / truth.translation.norm();
            (moved.angle_to(truth).to_degrees(), off)
        })
        .unzip();
    (median(turns), median(shifts))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Median distance of the fixed points from the true head, millimetres.
fn off_surface_mm(motion: &HeadMotion, truth: &Truth) -> f64 {
    let to_truth = true_from_solved(motion, &truth.poses);
    let distance = |point: &Vec3| {
        let of_triangle = |t: &[u32; 3]| {
            let corners = t.map(|i| truth.vertices[i as usize]);
            let w = closest_barycentric(point, &corners);
            (corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2] - point).norm()
        };
        truth.triangles.iter().map(of_triangle).fold(f64::INFINITY, f64::min)
    };
    let fixed = motion.points.iter().filter(|p| !p.moves);
    median(fixed.map(|p| 1000.0 * distance(&to_truth.apply(&p.position()))).collect())
}

#[test]
fn every_frame_of_the_film_is_posed_and_the_points_lie_on_the_head() {
    let motion = solved(&FILM.tracks);
    let (turn, shift) = pose_errors(&motion, &FILM.truth.poses);
    let off = off_surface_mm(&motion, &FILM.truth);
    let said = format!("{turn:.3} degrees, {:.3} %, {off:.3} mm, {:.3} px", 100.0 * shift, motion.reprojection_rms_px);
    eprintln!("film: {said}");
    assert!(motion.frames.iter().all(|frame| frame.used), "{said}");
    assert!(turn <= 0.3 && shift <= 0.005 && off <= 0.6 && motion.reprojection_rms_px <= 0.35, "{said}");
    assert_eq!(motion.focal_sigma_px, None);
    let certain = |frame: &facewright::FrameMotion| {
        frame.rotation_sigma_deg.is_some_and(|s| s > 0.005 && s < 0.3) && frame.translation_sigma_mm.is_some()
    };
    assert!(motion.frames.iter().all(certain), "{:?}", motion.frames);
}

/// The same tracks with a camera of which nothing is known.
fn estimated(mut tracks: Tracks) -> Tracks {
    let camera = Camera::centred(400, 300, 400.0);
    tracks.camera = SourcedCamera { camera, source: CameraSource::Estimated };
    tracks
}

#[test]
fn without_a_board_the_focal_length_is_within_what_is_said_of_it() {
    let motion = solved(&estimated(FILM.tracks.clone()));
    let (focal, sigma) = (motion.camera.camera.fx, motion.focal_sigma_px.unwrap());
    eprintln!("focal length {focal:.1} ± {sigma:.1} px, truly {:.1}", FILM.truth.camera.fx);
    assert!((focal / FILM.truth.camera.fx - 1.0).abs() < 0.06);
    // Most of it is what an unknown lens leaves open.
    assert!((focal - FILM.truth.camera.fx).abs() < 2.0 * sigma && sigma < 0.1 * focal);
}

/// The tracks of the frames that are turned by less than this, degrees.
fn narrowed(tracks: &Tracks, degrees: f64) -> Tracks {
    let mut tracks = tracks.clone();
    let narrow = |frame: usize| FILM.truth.yaw_deg[frame].abs() < degrees;
    for track in &mut tracks.tracks {
        track.observations.retain(|o| narrow(o.frame));
        track.reference = track.observations.first().map_or(0, |o| o.frame);
    }
    tracks.tracks.retain(|track| track.observations.len() > 2);
    (0..tracks.frames.len()).filter(|&k| !narrow(k)).for_each(|k| tracks.frames[k].cam_from_head = None);
    tracks
}

fn of_focal_length(motion: &HeadMotion) -> Option<&str> {
    motion.warnings.iter().map(String::as_str).find(|warning| warning.contains("focal length"))
}

#[test]
fn a_narrow_turn_says_that_it_hardly_knows_the_focal_length() {
    let motion = solved(&narrowed(&estimated(FILM.tracks.clone()), 5.0));
    let whole = solved(&estimated(FILM.tracks.clone()));
    let (focal, sigma) = (motion.camera.camera.fx, motion.focal_sigma_px.unwrap());
    eprintln!("narrow turn: {focal:.1} ± {sigma:.1} px");
    // A single film: three deviations.
    assert!((focal - FILM.truth.camera.fx).abs() < 3.0 * sigma);
    let (whole, said) = (whole.focal_sigma_px.unwrap(), of_focal_length(&motion).unwrap_or_default());
    assert!(sigma > 1.2 * whole && said.contains("poorly determined"), "{sigma} against {whole}: {said}");
}

/// Tracks that err by half a pixel each, as those of a soft film.
fn soft(mut tracks: Tracks) -> Tracks {
    for (k, track) in tracks.tracks.iter_mut().enumerate() {
        for o in &mut track.observations {
            let phase = 1.7 * k as f64 + 3.1 * o.frame as f64 + 0.37 * (k * k) as f64;
            o.pixel += 0.8 * Vec2::new(phase.sin(), (1.3 * phase + 1.0).cos());
            o.sigma_px = o.sigma_px.max(0.6);
        }
    }
    tracks
}

#[test]
fn a_turn_that_cannot_tell_the_focal_length_takes_what_cameras_have_and_says_so() {
    let whole = solved(&estimated(FILM.tracks.clone()));
    assert_eq!(of_focal_length(&whole), None, "a good film's turn tells it");
    let motion = solved(&soft(narrowed(&estimated(FILM.tracks.clone()), 5.0)));
    let (focal, sigma) = (motion.camera.camera.fx, motion.focal_sigma_px.unwrap());
    eprintln!("soft narrow turn: {focal:.1} ± {sigma:.1} px");
    // The points alone tell it less well than what cameras have, to 35 %.
    assert!(sigma > 0.247 * focal && (focal - FILM.truth.camera.fx).abs() < 2.0 * sigma, "{focal} ± {sigma}");
    let said = of_focal_length(&motion).unwrap_or_default();
    assert!(said.contains("mostly what cameras usually have") && said.contains("EXIF"), "{said}");
}

/// The same tracks with a focal length of which EXIF says that it is so many times the true one.
fn from_exif(mut tracks: Tracks, times: f64) -> Tracks {
    let camera = Camera::centred(400, 300, times * FILM.truth.camera.fx);
    tracks.camera = SourcedCamera { camera, source: CameraSource::Exif };
    tracks
}

#[test]
fn exif_helps_where_it_is_true() {
    let narrow = narrowed(&FILM.tracks, 5.0);
    let [told, untold] = [from_exif(narrow.clone(), 1.0), estimated(narrow)].map(|tracks| solved(&tracks));
    let off = |motion: &HeadMotion| (motion.camera.camera.fx / FILM.truth.camera.fx - 1.0).abs();
    eprintln!("narrow turn: {:.3} off with EXIF, {:.3} without", off(&told), off(&untold));
    assert!(off(&told) < 0.06 && off(&told) < off(&untold), "{} with, {} without", off(&told), off(&untold));
    assert!(told.focal_sigma_px.unwrap() < untold.focal_sigma_px.unwrap());
    assert_eq!(of_focal_length(&told), None);
    let whole = solved(&from_exif(FILM.tracks.clone(), 1.0));
    assert!(off(&whole) < 0.04 && of_focal_length(&whole).is_none(), "{} {:?}", off(&whole), whole.warnings);
}

#[test]
fn points_that_contradict_exif_decide_and_it_is_said() {
    let truth = FILM.truth.camera.fx;
    for times in [0.5, 1.5, 2.0] {
        let motion = solved(&from_exif(FILM.tracks.clone(), times));
        let (focal, sigma) = (motion.camera.camera.fx, motion.focal_sigma_px.unwrap());
        let said = of_focal_length(&motion).unwrap_or_default();
        eprintln!("EXIF {times} times: {focal:.1} ± {sigma:.1} px");
        assert!((focal / truth - 1.0).abs() < 0.06 && (focal - truth).abs() < 2.0 * sigma, "{focal} ± {sigma}");
        for number in [format!("{:.0} px", times * truth), format!("{focal:.0} ± {sigma:.0} px")] {
            assert!(said.starts_with("EXIF tells") && said.contains(&number), "no {number} in: {said}");
        }
    }
}

#[test]
fn a_narrow_turn_is_enough_to_contradict_exif() {
    let narrow = narrowed(&FILM.tracks, 5.0);
    for times in [0.5, 2.0, 3.0] {
        let motion = solved(&from_exif(narrow.clone(), times));
        let (focal, sigma) = (motion.camera.camera.fx, motion.focal_sigma_px.unwrap());
        eprintln!("narrow turn, EXIF {times} times: {focal:.1} ± {sigma:.1} px");
        assert!((focal - FILM.truth.camera.fx).abs() < 3.0 * sigma && sigma < 0.25 * focal, "{focal} ± {sigma}");
        assert!(motion.warnings.iter().any(|said| said.starts_with("EXIF tells")), "{:?}", motion.warnings);
    }
}

/// The film as a camera shows it that is turned aside, with the wide lens of a larger picture: what is filmed and from where stays.
fn aside(degrees: f64) -> (Tracks, Vec<Transform>, Camera) {
    let (mut tracks, wide) = (FILM.tracks.clone(), Camera::centred(1000, 600, FILM.truth.camera.fx));
    let turn = Transform::new(Rotation3::new(Vec3::y() * degrees.to_radians()), Vec3::zeros());
    for o in tracks.tracks.iter_mut().flat_map(|track| &mut track.observations) {
        o.pixel = wide.project(&turn.apply(&FILM.truth.camera.ray(&o.pixel))).unwrap();
    }
    tracks.frames.iter_mut().filter_map(|frame| frame.cam_from_head.as_mut()).for_each(|pose| *pose = turn * *pose);
    let guess = Camera::centred(wide.width, wide.height, 0.85 * f64::from(wide.width));
    tracks.camera = SourcedCamera { camera: guess, source: CameraSource::Estimated };
    (tracks, FILM.truth.poses.iter().map(|pose| turn * *pose).collect(), wide)
}

#[test]
fn a_head_far_from_the_axis_of_a_wide_lens_is_right_and_the_picture_a_whole_one() {
    for degrees in [20.0, -20.0] {
        let (tracks, truth, wide) = aside(degrees);
        let motion = solved(&tracks);
        let (focal, (turn, shift)) = (motion.camera.camera.fx, pose_errors(&motion, &truth));
        let said = format!("{focal:.1} px of {}, {turn:.3} degrees, {:.3} %", wide.fx, 100.0 * shift);
        eprintln!("{degrees}° aside: {said}");
        assert!((focal / wide.fx - 1.0).abs() < 0.08 && turn <= 0.3 && shift <= 0.005, "{said}");
        assert_eq!(motion.warnings, Vec::<String>::new());
    }
}

#[test]
fn a_length_that_was_measured_sets_the_size() {
    let motion = solved(&FILM.tracks);
    let fixed: Vec<_> = motion.points.iter().filter(|p| !p.moves).collect();
    let far = |p: &&&facewright::PointMotion| (p.position() - fixed[0].position()).norm();
    let other = fixed.iter().max_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
    let length = 1.1 * far(&other);
    let known = |from: usize| SizeOptions {
        lengths: vec![KnownLength { from, to: other.id, length }],
        ..SizeOptions::default()
    };
    let larger = sized(&FILM.tracks, known(fixed[0].id)).unwrap();
    let (before, after) = (motion.frames[3].cam_from_head.unwrap(), larger.frames[3].cam_from_head.unwrap());
    assert!((after.translation.z / before.translation.z - 1.1).abs() < 1e-6);
    assert!(larger.scale.relative_sigma < 0.02 && larger.scale.source.contains("given as"), "{:?}", larger.scale);
    let refused = sized(&FILM.tracks, known(100_000));
    assert!(refused.unwrap_err().to_string().contains("100000"));
}

#[test]
fn pupils_that_were_measured_set_the_size() {
    let interocular_mm = Some(1050.0 * FILM.tracks.interocular.unwrap());
    let usual = solved(&FILM.tracks);
    let larger = sized(&FILM.tracks, SizeOptions { interocular_mm, ..SizeOptions::default() }).unwrap();
    let depth = |motion: &HeadMotion| motion.frames[0].cam_from_head.unwrap().translation.z;
    assert!((depth(&larger) / depth(&usual) - 1.05).abs() < 1e-6);
    assert!(larger.scale.relative_sigma < usual.scale.relative_sigma);
}

/// The film's tracks with the mouth and a few points of the cheeks talking: up to four pixels down and up again.
fn talking() -> (Tracks, Vec<usize>) {
    let mut tracks = FILM.tracks.clone();
    let mut talk = Vec::new();
    for (k, track) in tracks.tracks.iter_mut().enumerate() {
        if track.observations.len() > 8 && (track.region == Region::Mouth || k % 9 == 0) {
            talk.push(track.id);
            for o in &mut track.observations {
                o.pixel.y += 4.0 * (0.9 * o.frame as f64).sin().max(0.0);
            }
        }
    }
    (tracks, talk)
}

#[test]
fn what_talks_is_found_and_does_not_move_the_head() {
    let (tracks, talk) = talking();
    let motion = solved(&tracks);
    let moves = |id: &&usize| motion.points.iter().find(|p| p.id == **id).is_none_or(|p| p.moves);
    let told = talk.iter().filter(moves).count();
    assert!(talk.len() >= 15 && told as f64 >= 0.9 * talk.len() as f64, "{told} of {} told", talk.len());
    let wrongly = motion.points.iter().filter(|p| p.moves && !talk.contains(&p.id)).count();
    assert!(
        10 * wrongly <= motion.points.len(),
        "{wrongly} of {} still points take part in nothing",
        motion.points.len()
    );
    let (turn, shift) = pose_errors(&motion, &FILM.truth.poses);
    assert!(turn <= 0.3 && shift <= 0.005, "{turn} degrees, {shift}");
}

#[test]
fn the_background_never_joins() {
    let mut tracks = FILM.tracks.clone();
    let first = 10_000;
    for k in 0..60 {
        let at = (7.0 + 6.5 * f64::from(k), if k % 2 == 0 { 11.0 } else { 280.0 });
        let observations = (0..tracks.frames.len()).map(|f| (f, at.0, at.1, 0.1).into()).collect();
        let (id, gaps) = (first + k as usize, Vec::new());
        tracks.tracks.push(PointTrack { id, reference: 0, region: Region::Skin, place: None, observations, gaps });
    }
    let motion = solved(&tracks);
    assert!(motion.points.iter().all(|p| p.id < first || p.moves), "a point that stands still is no point of the head");
    let (turn, shift) = pose_errors(&motion, &FILM.truth.poses);
    assert!(turn <= 0.3 && shift <= 0.005, "{turn} degrees, {shift}");
}

#[test]
fn one_thread_and_four_give_the_same_motion() {
    let (tracks, _) = talking();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut motion = pool.install(|| solved(&tracks));
        motion.timings_s.clear();
        serde_json::to_string(&motion).unwrap()
    };
    assert_eq!(with(1), with(4));
}

/// The film's tracks with the first frame's pose and places in every frame, grown by a factor for each frame.
fn frozen(growth: f64) -> Tracks {
    let mut tracks = FILM.tracks.clone();
    let (count, camera) = (tracks.frames.len(), tracks.camera.camera);
    let first = tracks.frames.iter().find_map(|frame| frame.cam_from_head).unwrap();
    let scale = |frame: usize| growth.powf(frame as f64 / (count - 1) as f64);
    for (k, frame) in tracks.frames.iter_mut().enumerate() {
        let mut pose = first;
        pose.translation.z /= scale(k);
        frame.cam_from_head = Some(pose);
    }
    for track in &mut tracks.tracks {
        let (seen, middle) = (track.observations[0], Vec2::new(camera.cx, camera.cy));
        let grown =
            |frame: usize| PointObservation { frame, pixel: middle + scale(frame) * (seen.pixel - middle), ..seen };
        track.observations = (0..count).map(grown).collect();
    }
    tracks
}

#[test]
fn a_still_head_a_zoom_and_a_film_without_a_face_get_their_sentences() {
    let refused = |tracks: &Tracks| sized(tracks, SizeOptions::default()).unwrap_err();
    assert!(matches!(refused(&frozen(1.0)), FacewrightError::NoRotation { degrees } if degrees < 1.0));
    let zoom = refused(&frozen(1.6));
    assert!(matches!(zoom, FacewrightError::OnlyZoom { .. }) && zoom.to_string().contains("grows by 60 %"), "{zoom}");
    let mut nobody = FILM.tracks.clone();
    nobody.frames.iter_mut().for_each(|frame| frame.cam_from_head = None);
    assert!(matches!(refused(&nobody), FacewrightError::NoFace { .. }));
    let mut other = FILM.tracks.clone();
    other.camera.camera.width = 640;
    let other = solve_motion(&other, Some(&FILM.camera), &MotionOptions::default(), &Progress::new()).unwrap_err();
    assert!(matches!(other, FacewrightError::OtherCamera { .. }));
    let tenfold = SizeOptions { interocular_mm: Some(620.0), ..SizeOptions::default() };
    let centimetres = sized(&FILM.tracks, tenfold).unwrap_err();
    assert!(matches!(centimetres, FacewrightError::Option { .. }));
}

#[test]
fn tracks_that_fit_no_head_are_refused_with_what_the_frames_lack() {
    let mut tracks = FILM.tracks.clone();
    for (k, track) in tracks.tracks.iter_mut().enumerate() {
        for o in &mut track.observations {
            o.pixel.x += 25.0 * (1.7 * k as f64 + 3.1 * o.frame as f64).sin();
            o.pixel.y += 25.0 * (2.9 * k as f64 + 1.3 * o.frame as f64).cos();
        }
    }
    let refused = sized(&tracks, SizeOptions::default());
    assert!(matches!(refused, Err(FacewrightError::TooFewUsable { .. } | FacewrightError::Motion(_))), "{refused:?}");
}

#[test]
fn a_frame_full_of_wrong_tracks_is_named_with_its_reason() {
    let mut tracks = FILM.tracks.clone();
    for (k, track) in tracks.tracks.iter_mut().enumerate() {
        for o in track.observations.iter_mut().filter(|o| o.frame == 9) {
            o.pixel.x += 25.0 * (1.7 * k as f64).sin();
            o.pixel.y += 25.0 * (2.9 * k as f64).cos();
        }
    }
    let motion = solved(&tracks);
    let frame = &motion.frames[9];
    assert!(!frame.used && frame.cam_from_head.is_none() && frame.reason.contains("covered"), "{}", frame.reason);
    let wrong_points = [ReasonKind::FewAgree, ReasonKind::Contradicted, ReasonKind::Unexplained];
    assert!(frame.reason_kind.is_some_and(|kind| wrong_points.contains(&kind)), "{:?}", frame.reason_kind);
    assert!(motion.warnings.iter().any(|w| w.contains(&frame.name)), "{:?}", motion.warnings);
    assert_eq!(motion.frames.iter().filter(|f| f.used).count(), motion.frames.len() - 1);
}

#[test]
fn a_scanned_head_is_posed_with_a_board_and_without() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/james-cif");
    if !folder.is_dir() {
        eprintln!("skipped: {} is missing", folder.display());
        return;
    }
    let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let frames = value["frames"].as_array().unwrap();
    let truth: Vec<Transform> =
        frames.iter().map(|f| serde_json::from_value(f["cam_from_head"].clone()).unwrap()).collect();
    let (assets, progress) = (Assets::load(&assets().unwrap()).unwrap(), Progress::new());
    let frames = FrameSet::open(&[folder.join("frames")], &progress).unwrap();
    for camera in [Some(calibrated(&folder)), None] {
        let options = TrackClipOptions::default();
        let motion = solved(&track(&frames, &assets, camera.as_ref(), None, &options, &progress).unwrap());
        let (turn, shift) = pose_errors(&motion, &truth);
        let (focal, sigma) = (motion.camera.camera.fx, motion.focal_sigma_px);
        let said = format!(
            "{turn:.3} degrees, {:.3} %, {:.3} px, focal length {focal:.1}, deviation {sigma:?}",
            100.0 * shift,
            motion.reprojection_rms_px
        );
        eprintln!("scan: {said}");
        assert!(motion.frames.iter().all(|frame| frame.used), "{said}");
        assert!(turn <= 0.3 && shift <= 0.005 && motion.reprojection_rms_px <= 0.35, "{said}");
        assert!((focal / 615.0 - 1.0).abs() <= 0.06, "{said}");
        assert!(sigma.is_none_or(|sigma| (focal - 615.0).abs() <= 2.0 * sigma), "{said}");
    }
}
