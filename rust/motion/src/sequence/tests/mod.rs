mod lens;
mod skin;

use super::*;
use crate::bundle::{Bundle, BundleOptions, adjust};
use geometry::Similarity;
use nalgebra::{Rotation3, Vector6};
use synthetic::{Random, Scene, SceneOptions};

fn tracks(scene: &Scene) -> Vec<PointTrack> {
    let mut tracks = vec![PointTrack::default(); scene.points.len() + scene.background.len()];
    for o in &scene.observations {
        tracks[o.point].observations.push(Sighting { frame: o.frame, pixel: o.pixel, sigma_px: 0.3 });
    }
    tracks
}

fn options(scene: &Scene) -> SequenceOptions {
    SequenceOptions { frames: scene.cam_from_head.len(), ..SequenceOptions::default() }
}

fn solve(scene: &Scene, options: &SequenceOptions) -> Sequence {
    reconstruct_sequence(&tracks(scene), &scene.camera, options, &Progress::new()).unwrap()
}

/// Root mean square shape error (mm) after the best similarity, greatest rotation error (degrees), points placed.
fn errors(found: &Sequence, scene: &Scene) -> (f64, f64, usize) {
    let placed = |i: &usize| found.points[*i].is_some();
    let indices: Vec<usize> = (0..scene.points.len()).filter(placed).collect();
    let mine: Vec<Vec3> = indices.iter().map(|&i| found.points[i].unwrap()).collect();
    let truth: Vec<Vec3> = indices.iter().map(|&i| scene.points[i]).collect();
    let fit = Similarity::fit(&mine, &truth, None, true).unwrap();
    let sum: f64 = mine.iter().zip(&truth).map(|(m, t)| (fit.apply(m) - t).norm_squared()).sum();
    let turn = |(pose, truth): (&Result<Transform, MotionError>, &Transform)| {
        pose.as_ref().ok().map(|p| fit.move_pose(p).angle_to(truth).to_degrees())
    };
    let worst = found.poses.iter().zip(&scene.cam_from_head).filter_map(turn).fold(0.0, f64::max);
    (1e3 * (sum / mine.len() as f64).sqrt(), worst, mine.len())
}

/// The shape error of a bundle of the right observations, begun at the truth: what the noise allows.
fn ideal_mm(scene: &Scene) -> f64 {
    let right = scene.observations.iter().filter(|o| !o.outlier && o.point < scene.points.len());
    let observation =
        |o: &synthetic::Observation| Observation { frame: o.frame, point: o.point, pixel: o.pixel, sigma_px: 0.3 };
    let mut bundle = Bundle {
        camera: scene.camera,
        poses: scene.cam_from_head.clone(),
        points: scene.points.clone(),
        observations: right.map(observation).collect(),
    };
    adjust(&mut bundle, &BundleOptions::default(), &Progress::new()).unwrap();
    let fit = Similarity::fit(&bundle.points, &scene.points, None, true).unwrap();
    let sum: f64 = bundle.points.iter().zip(&scene.points).map(|(m, t)| (fit.apply(m) - t).norm_squared()).sum();
    1e3 * (sum / scene.points.len() as f64).sqrt()
}

fn scene(seed: u64) -> Scene {
    Scene::turning_head(&SceneOptions {
        points: 250,
        frames: 60,
        yaw_deg: (-45.0, 45.0),
        seed,
        ..SceneOptions::default()
    })
}

#[test]
fn poses_and_shape_from_tracks_alone() {
    for seed in 0..3 {
        let scene = scene(seed);
        let found = solve(&scene, &options(&scene));
        let (shape_mm, turn_deg, placed) = errors(&found, &scene);
        println!(
            "seed {seed}: {shape_mm:.3} mm, {turn_deg:.3} deg, {placed} points, {:.3} px, at best {:.3} mm",
            found.report.rms_px,
            ideal_mm(&scene)
        );
        assert!(found.poses.iter().all(Result::is_ok));
        assert!(shape_mm < 1.2 * ideal_mm(&scene) && turn_deg < 0.6 && placed > 230);
    }
}

#[test]
fn a_background_that_stands_still_and_wrong_tracks_do_not_vote() {
    let options_ = SceneOptions {
        points: 120,
        frames: 60,
        background: 240,
        outliers: 0.1,
        yaw_deg: (-30.0, 30.0),
        seed: 5,
        ..SceneOptions::default()
    };
    let scene = Scene::turning_head(&options_);
    let found = solve(&scene, &options(&scene));
    let (shape_mm, turn_deg, placed) = errors(&found, &scene);
    println!("{shape_mm:.3} mm (at best {:.3}), {turn_deg:.3} deg, {placed} points", ideal_mm(&scene));
    assert!(found.points[120..].iter().all(Option::is_none));
    assert!(shape_mm < 1.3 * ideal_mm(&scene) && turn_deg < 1.0 && placed > 110);
}

#[test]
fn rough_initial_poses_give_the_head_frame_and_the_scale() {
    let scene = scene(7);
    let mut random = Random::new(1);
    let mut rough = |pose: &Transform| {
        let mut step = |size: f64| random.normal() * size;
        let turn = [step(0.03), step(0.03), step(0.03)];
        Some(pose.retract(&Vector6::new(turn[0], turn[1], turn[2], step(0.004), step(0.004), step(0.012))))
    };
    let mut initial: Vec<_> = scene.cam_from_head.iter().map(&mut rough).collect();
    initial[20] = None;
    initial[33] = Some(Transform::new(Rotation3::new(Vec3::y()), Vec3::new(0.1, 0.0, 0.4)));
    let found = solve(&scene, &SequenceOptions { initial_poses: Some(initial), ..options(&scene) });
    let (shape_mm, turn_deg, placed) = errors(&found, &scene);
    println!("{shape_mm:.3} mm (at best {:.3}), {turn_deg:.3} deg, {placed} points", ideal_mm(&scene));
    assert!(found.poses.iter().all(Result::is_ok) && shape_mm < 1.2 * ideal_mm(&scene) && turn_deg < 0.6);
    assert!(found.anchored);
    let offset = |i: usize| (found.points[i].unwrap() - scene.points[i]).norm();
    let mean = (0..250).filter(|&i| found.points[i].is_some()).map(offset).sum::<f64>() / placed as f64;
    assert!(mean < 0.006, "{mean} m from the truth without any alignment");
}

#[test]
fn initial_poses_that_are_all_wrong_are_left_behind() {
    let scene = scene(4);
    let wrong = Transform::new(Rotation3::new(Vec3::y()), Vec3::new(0.1, 0.0, 0.4));
    let initial_poses = Some(vec![Some(wrong); 60]);
    let found = solve(&scene, &SequenceOptions { initial_poses, ..options(&scene) });
    assert!(!found.anchored && errors(&found, &scene).0 < 1.2 * ideal_mm(&scene));
}

#[test]
fn a_wrong_focal_length_is_refined() {
    let scene = scene(2);
    let guess = Camera { fx: 560.0, fy: 560.0, ..scene.camera };
    let focal_prior = Some(FocalPrior { focal_px: 560.0, log_sigma: 0.18 });
    let options = SequenceOptions { refine_focal: true, focal_prior, ..options(&scene) };
    let found = reconstruct_sequence(&tracks(&scene), &guess, &options, &Progress::new()).unwrap();
    let sigma = found.report.focal_sigma_px.unwrap();
    println!("{} ± {sigma}", found.camera.fx);
    assert!((found.camera.fx - 615.0).abs() < 4.0 * sigma.max(2.0));
}

#[test]
fn a_frame_without_tracks_says_why_it_has_no_pose() {
    let scene = scene(3);
    let mut tracks = tracks(&scene);
    tracks.iter_mut().for_each(|t| t.observations.retain(|o| o.frame != 40));
    let found = reconstruct_sequence(&tracks, &scene.camera, &options(&scene), &Progress::new()).unwrap();
    assert!(matches!(found.poses[40], Err(MotionError::TooFewPoints { .. })));
    assert_eq!(found.poses.iter().filter(|p| p.is_ok()).count(), 59);
}

#[test]
fn a_head_that_does_not_turn_and_empty_tracks_are_refused() {
    let still = SceneOptions { yaw_deg: (0.0, 0.5), wobble: 0.0, frames: 10, points: 80, ..SceneOptions::default() };
    let still = Scene::turning_head(&still);
    let solve = |tracks: &[PointTrack], frames| {
        reconstruct_sequence(
            tracks,
            &still.camera,
            &SequenceOptions { frames, ..SequenceOptions::default() },
            &Progress::new(),
        )
    };
    assert!(matches!(solve(&tracks(&still), 10), Err(MotionError::NoInitialPair { .. })));
    assert!(matches!(solve(&[], 10), Err(MotionError::NoInitialPair { .. })));
    assert!(matches!(solve(&tracks(&still), 5), Err(MotionError::BadIndex { .. })));
}

#[test]
#[ignore = "a measurement"]
fn time_for_120_frames() {
    for (points, background) in [(200, 0), (500, 100)] {
        let options_ = SceneOptions { points, background, outliers: 0.05, ..SceneOptions::default() };
        let scene = Scene::turning_head(&options_);
        let started = crate::two_view::processor_ms();
        let found = solve(&scene, &options(&scene));
        let ms = crate::two_view::processor_ms() - started;
        let (shape_mm, turn_deg, placed) = errors(&found, &scene);
        let best = ideal_mm(&scene);
        println!(
            "{points} points: {ms:.0} ms, {shape_mm:.3} mm (at best {best:.3}), {turn_deg:.3} deg, {placed} placed"
        );
    }
}

#[test]
fn frames_between_the_key_frames_are_placed_as_well_and_counted() {
    let scene = scene(4);
    let found = solve(&scene, &SequenceOptions { key_frames: 20, ..options(&scene) });
    let (shape_mm, turn_deg, placed) = errors(&found, &scene);
    // A third of the frames: as much less is known of the shape as the noise allows, and no more.
    let allowed_mm = 1.2 * 3.0_f64.sqrt() * ideal_mm(&scene);
    assert!(shape_mm < allowed_mm && turn_deg < 1.0 && placed > 240, "{shape_mm} mm, {turn_deg} deg, {placed} points");
    assert!(found.poses.iter().all(Result::is_ok));
    assert!(found.report.frames.iter().all(|frame| frame.observations > 50 && frame.rms_px < 0.6));
    let (of_frames, of_points) = (&found.report.frames, &found.report.points);
    let sum = |fits: &[crate::bundle::Fit]| fits.iter().map(|fit| fit.observations).sum::<usize>();
    assert_eq!((sum(of_frames), sum(of_points)), (found.observations.len(), found.observations.len()));
    assert!(
        of_points.iter().any(|point| point.observations > 20),
        "points are seen in more frames than the key frames"
    );
    let none = SequenceOptions { key_frames: 1, ..options(&scene) };
    assert!(reconstruct_sequence(&tracks(&scene), &scene.camera, &none, &Progress::new()).is_err());
}
