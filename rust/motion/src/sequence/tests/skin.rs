//! Skin that slides on the skull for seconds at a time, under a head that hardly turns: many frames that tell little.

use super::*;
use nalgebra::UnitVector3;

const FRAMES: usize = 120;
/// How far a point slides off and back, metres, and how long that takes, frames.
const SLIDE: (f64, f64) = (0.0012, 45.0);

/// A wave of its own for each of many numbers, between −1 and 1.
fn wave(random: &mut Random) -> impl Fn(usize) -> f64 + use<> {
    let (phase, pace) = (6.3 * random.uniform(), 1.0 + 0.3 * random.normal());
    move |frame: usize| (phase + pace * std::f64::consts::TAU * frame as f64 / SLIDE.1).sin()
}

/// A narrow turn as its tracks show it, each point sliding along the surface in its own time.
fn sliding() -> (Scene, Vec<PointTrack>) {
    let scene = Scene::turning_head(&SceneOptions {
        points: 120,
        frames: FRAMES,
        yaw_deg: (-9.0, 9.0),
        ..SceneOptions::default()
    });
    let mut random = Random::new(11);
    let slide = |normal: &Vec3| {
        let way = Vec3::new(random.normal(), random.normal(), random.normal()).cross(normal);
        (UnitVector3::new_normalize(way), wave(&mut random))
    };
    let slides: Vec<_> = scene.normals.iter().map(slide).collect();
    let mut tracks = vec![PointTrack::default(); scene.points.len()];
    for o in &scene.observations {
        let (way, wave) = &slides[o.point];
        let still = scene.cam_from_head[o.frame].apply(&scene.points[o.point]);
        let moved = scene.cam_from_head[o.frame].apply(&(scene.points[o.point] + way.scale(SLIDE.0 * wave(o.frame))));
        let shift = scene.camera.project(&moved).unwrap() - scene.camera.project(&still).unwrap();
        tracks[o.point].observations.push(Sighting { frame: o.frame, pixel: o.pixel + shift, sigma_px: 0.1 });
    }
    (scene, tracks)
}

/// Poses as landmarks give them: off by 2° and more, for many frames in the same way.
fn landmarks(scene: &Scene) -> Vec<Option<Transform>> {
    let mut random = Random::new(12);
    let waves: Vec<_> = (0..3).map(|_| wave(&mut random)).collect();
    let mut rough = |(frame, pose): (usize, &Transform)| {
        let mut turn = |axis: usize| 0.035 * waves[axis](frame) + 0.01 * random.normal();
        Some(pose.retract(&Vector6::new(turn(0), turn(1), turn(2), 0.0, 0.0, 0.0)))
    };
    scene.cam_from_head.iter().enumerate().map(&mut rough).collect()
}

/// A head that is known to 5 mm, another person's.
fn roughly_known(scene: &Scene) -> Vec<PointPrior> {
    let mut random = Random::new(13);
    let mut near = |(point, place): (usize, &Vec3)| {
        let off = Vec3::new(random.normal(), random.normal(), random.normal()) * 0.005;
        PointPrior::near(point, place + off, 0.006)
    };
    scene.points.iter().enumerate().map(&mut near).collect()
}

/// The greatest and the median rotation error beyond a turn that all frames share, degrees.
fn turn_errors_deg(found: &Sequence, scene: &Scene) -> (f64, f64) {
    let placed: Vec<usize> = (0..scene.points.len()).filter(|&i| found.points[i].is_some()).collect();
    let mine: Vec<Vec3> = placed.iter().map(|&i| found.points[i].unwrap()).collect();
    let truth: Vec<Vec3> = placed.iter().map(|&i| scene.points[i]).collect();
    let fit = Similarity::fit(&mine, &truth, None, true).unwrap();
    let error = |(pose, truth): (&Result<Transform, MotionError>, &Transform)| {
        fit.move_pose(pose.as_ref().unwrap()).angle_to(truth).to_degrees()
    };
    let mut errors: Vec<f64> = found.poses.iter().zip(&scene.cam_from_head).map(error).collect();
    errors.sort_by(f64::total_cmp);
    (errors[errors.len() - 1], errors[errors.len() / 2])
}

/// Median second difference of the rotations from frame to frame, degrees: the true turn is smooth.
fn shake_deg(found: &Sequence) -> f64 {
    let poses: Vec<Transform> = found.poses.iter().map(|pose| *pose.as_ref().unwrap()).collect();
    let step = |pair: &[Transform]| (pair[1].rotation * pair[0].rotation.inverse()).scaled_axis();
    let steps: Vec<Vec3> = poses.windows(2).map(step).collect();
    let mut second: Vec<f64> = steps.windows(2).map(|pair| (pair[1] - pair[0]).norm().to_degrees()).collect();
    second.sort_by(f64::total_cmp);
    second[second.len() / 2]
}

#[test]
fn skin_that_slides_does_not_outvote_what_is_known_of_head_and_camera() {
    let (scene, tracks) = sliding();
    let guess = Camera { fx: 560.0, fy: 560.0, ..scene.camera };
    let options = SequenceOptions {
        initial_poses: Some(landmarks(&scene)),
        initial_sigma_rad: 0.05,
        initial_sigma_m: 0.3,
        refine_focal: true,
        focal_prior: Some(FocalPrior { focal_px: 560.0, log_sigma: 0.4 }),
        point_priors: roughly_known(&scene),
        threshold_px: 2.5,
        ..options(&scene)
    };
    let found = reconstruct_sequence(&tracks, &guess, &options, &Progress::new()).unwrap();
    let (worst, usual) = turn_errors_deg(&found, &scene);
    let (focal, sigma) = (found.camera.fx, found.focal_sigma_px.unwrap());
    let shake = shake_deg(&found);
    println!("{worst:.2} deg at worst, {usual:.2} usually, shaking by {shake:.3}, focal {focal:.1} ± {sigma:.1}");
    assert!(found.poses.iter().all(Result::is_ok));
    assert!(worst < 1.4 && usual < 0.7, "{worst} deg at worst, {usual} usually");
    // The landmarks' own jitter is 0.6 degrees about each axis.
    assert!(shake < 0.45, "{shake} degrees");
    assert!((focal - 615.0).abs() < 2.0 * sigma, "{focal} ± {sigma}");
}
