//! What is held, and that it makes no difference to the shape.

use super::*;

fn scene() -> Scene {
    Scene::turning_head(&SceneOptions { frames: 14, points: 50, ..SceneOptions::default() })
}

#[test]
fn the_first_pose_and_one_coordinate_of_another_stay_to_the_bit() {
    let start = nudged(&scene(), 0.3, 0.01, 0.002);
    let mut bundle = start.clone();
    let held = solve(&mut bundle, &BundleOptions::default()).held;
    let scale = held.scale.unwrap();
    assert!(held.frame.is_none() && bundle.poses[0] == start.poses[0] && scale.frame != 0);
    let kept = |bundle: &Bundle| bundle.poses[scale.frame].translation[scale.axis];
    assert!(kept(&bundle) == kept(&start) && bundle.poses[scale.frame] != start.poses[scale.frame]);
}

#[test]
fn where_nothing_is_fixed_the_first_frame_that_sees_points_is_held() {
    let mut start = nudged(&scene(), 0.3, 0.01, 0.002);
    start.observations.retain(|o| o.frame > 1);
    let mut bundle = start.clone();
    let options = BundleOptions { fixed_frames: vec![0], ..BundleOptions::default() };
    let held = solve(&mut bundle, &options).held;
    assert!(held.frame == Some(2) && held.scale.is_some() && bundle.poses[2] == start.poses[2]);
    assert!(bundle.poses[1] == start.poses[1]);
}

#[test]
fn two_fixed_frames_or_priors_hold_the_scale_themselves() {
    let scene = scene();
    let held = |options: BundleOptions| solve(&mut nudged(&scene, 0.3, 0.01, 0.002), &options).held;
    let prior =
        |frame: usize| PosePrior { frame, cam_from_head: scene.cam_from_head[frame], sigma_rad: 0.01, sigma_m: 0.002 };
    let near = |point: usize| PointPrior::near(point, scene.points[point], 0.005);
    assert_eq!(held(BundleOptions { fixed_frames: vec![0, 9], ..BundleOptions::default() }), Held::default());
    let pose_priors = vec![prior(2), prior(8)];
    assert_eq!(held(BundleOptions { fixed_frames: vec![], pose_priors, ..BundleOptions::default() }), Held::default());
    let point_priors = (0..4).map(near).collect();
    assert_eq!(held(BundleOptions { fixed_frames: vec![], point_priors, ..BundleOptions::default() }), Held::default());
}

#[test]
fn a_free_gauge_finds_the_same_shape_and_has_no_covariances() {
    let scene = scene();
    let run = |gauge: Gauge, fixed_frames: Vec<usize>| {
        let mut bundle = nudged(&scene, 0.3, 0.01, 0.002);
        let options =
            BundleOptions { gauge, fixed_frames, covariances: true, relative_cost: 1e-12, ..BundleOptions::default() };
        let report = solve(&mut bundle, &options);
        (report.final_cost, shape_error_mm(&bundle, &scene), report.covariances.is_some())
    };
    let (held, free) = (run(Gauge::Held, vec![0]), run(Gauge::Free, vec![]));
    assert!((held.0 / free.0 - 1.0).abs() < 1e-8 && (held.1 - free.1).abs() < 1e-4, "{held:?} {free:?}");
    assert!(held.2 && !free.2);
}
