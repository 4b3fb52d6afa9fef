//! Wrong observations and observations that tell nothing.

use super::*;

#[test]
fn robust_losses_bear_wrong_observations() {
    let options = SceneOptions { points: 100, outliers: 0.1, frames: 30, ..SceneOptions::default() };
    let scene = Scene::turning_head(&options);
    let error = |loss: Loss| {
        let mut bundle = nudged(&scene, 0.3, 0.005, 0.002);
        let report = solve(&mut bundle, &BundleOptions { loss, ..BundleOptions::default() });
        assert!(report.converged || loss == Loss::Squared, "{loss:?} {} steps", report.iterations);
        shape_error_mm(&bundle, &scene)
    };
    let (squared, huber, cauchy) = (error(Loss::Squared), error(Loss::Huber(2.0)), error(Loss::Cauchy(2.0)));
    println!("squared {squared:.3} mm, Huber {huber:.3} mm, Cauchy {cauchy:.3} mm");
    assert!(huber < 0.15 * squared && cauchy < huber);
}

#[test]
fn points_seen_once_and_frames_that_see_two_points_stay() {
    let scene = Scene::turning_head(&SceneOptions { frames: 10, points: 40, ..SceneOptions::default() });
    let mut start = nudged(&scene, 0.3, 0.005, 0.002);
    start.observations.retain(|o| (o.point != 7 || o.frame == 4) && (o.frame != 5 || [8, 9].contains(&o.point)));
    let mut bundle = start.clone();
    let report = solve(&mut bundle, &BundleOptions { covariances: true, ..BundleOptions::default() });
    assert!(bundle.points[7] == start.points[7] && bundle.poses[5] == start.poses[5]);
    assert!(report.points[7] == Fit::default() && report.frames[5] == Fit::default());
    let covariances = report.covariances.unwrap();
    assert!(covariances.points[7].is_none() && covariances.points[8].is_some());
}

#[test]
fn cameras_in_one_place_tell_no_depth() {
    let scene = Scene::turning_head(&SceneOptions { frames: 6, ..SceneOptions::default() });
    let mut bundle = nudged(&scene, 0.3, 0.0, 0.0);
    bundle.poses = vec![bundle.poses[0]; 6];
    let before = bundle.points.clone();
    let error = adjust(&mut bundle, &BundleOptions::default(), &Progress::new()).unwrap_err();
    assert!(matches!(error, MotionError::NoDepth { .. }) && bundle.points == before);
}

#[test]
fn a_pose_or_a_point_that_is_no_number_is_refused() {
    let scene = Scene::turning_head(&SceneOptions { frames: 6, ..SceneOptions::default() });
    let clean = nudged(&scene, 0.3, 0.0, 0.0);
    let seen = clean.observations[0];
    let refused = |spoil: &dyn Fn(&mut Bundle)| {
        let mut bundle = clean.clone();
        spoil(&mut bundle);
        let error = adjust(&mut bundle, &BundleOptions::default(), &Progress::new()).unwrap_err();
        matches!(error, MotionError::BadNumber { .. })
    };
    assert!(refused(&|b| b.poses[seen.frame].translation.x = f64::NAN));
    assert!(refused(&|b| b.points[seen.point].z = f64::INFINITY));
    assert!(refused(&|b| b.camera.k1 = f64::NAN));
    // What nobody sees may be anything.
    let mut bundle = clean.clone();
    bundle.points.push(Vec3::repeat(f64::NAN));
    solve(&mut bundle, &BundleOptions::default());
}

#[test]
fn the_order_of_the_observations_makes_no_difference() {
    let scene = Scene::turning_head(&SceneOptions { frames: 20, points: 150, ..SceneOptions::default() });
    let (mut bundle, mut reversed) = (nudged(&scene, 0.3, 0.01, 0.002), nudged(&scene, 0.3, 0.01, 0.002));
    reversed.observations.reverse();
    solve(&mut bundle, &BundleOptions::default());
    solve(&mut reversed, &BundleOptions::default());
    assert!(bundle.poses == reversed.poses && bundle.points == reversed.points);
}

#[test]
fn covariances_have_the_same_bits_with_one_thread_and_with_three() {
    let scene = Scene::turning_head(&SceneOptions { frames: 30, points: 300, ..SceneOptions::default() });
    let run = |threads: usize| {
        let mut bundle = nudged(&scene, 0.3, 0.01, 0.002);
        let options = BundleOptions { covariances: true, refine_distortion: true, ..BundleOptions::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let report = pool.install(|| solve(&mut bundle, &options));
        (bundle.poses, bundle.points, report.covariances.unwrap())
    };
    assert!(run(1) == run(3));
}
