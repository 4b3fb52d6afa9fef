use super::*;
use nalgebra::Rotation3;
use synthetic::{Random, Scene, SceneOptions};

mod equations;
mod gauge;
mod robust;
mod uncertainty;

/// The truth of a scene as a bundle, then poses and points nudged.
fn nudged(scene: &Scene, sigma_px: f64, turn: f64, shift: f64) -> Bundle {
    let mut random = Random::new(99);
    let mut step = |size: f64| Vec3::new(random.normal(), random.normal(), random.normal()) * size;
    let observations = scene.observations.iter().filter(|o| o.point < scene.points.len());
    Bundle {
        camera: scene.camera,
        poses: scene
            .cam_from_head
            .iter()
            .enumerate()
            .map(|(i, pose)| match i {
                0 => *pose,
                _ => Transform::new(Rotation3::new(step(turn)) * pose.rotation, pose.translation + step(shift)),
            })
            .collect(),
        points: scene.points.iter().map(|p| p + step(shift)).collect(),
        observations: observations
            .map(|o| Observation { frame: o.frame, point: o.point, pixel: o.pixel, sigma_px })
            .collect(),
    }
}

/// Root mean square distance of the points from the truth after the best similarity, millimetres.
fn shape_error_mm(bundle: &Bundle, scene: &Scene) -> f64 {
    let mut seen = vec![0; scene.points.len()];
    bundle.observations.iter().for_each(|o| seen[o.point] += 1);
    let (found, truth): (Vec<Vec3>, Vec<Vec3>) =
        (0..seen.len()).filter(|&i| seen[i] >= 2).map(|i| (bundle.points[i], scene.points[i])).unzip();
    let fit = geometry::Similarity::fit(&found, &truth, None, true).unwrap();
    let sum: f64 = found.iter().zip(&truth).map(|(f, t)| (fit.apply(f) - t).norm_squared()).sum();
    1e3 * (sum / found.len() as f64).sqrt()
}

fn solve(bundle: &mut Bundle, options: &BundleOptions) -> BundleReport {
    adjust(bundle, options, &Progress::new()).unwrap()
}

fn lens() -> Camera {
    Camera { k1: -0.2, k2: 0.08, ..Camera::centred(352, 288, 615.0) }
}

#[test]
fn exact_observations_bring_back_the_exact_shape() {
    let scene =
        Scene::turning_head(&SceneOptions { noise_px: 0.0, frames: 25, camera: lens(), ..SceneOptions::default() });
    let mut bundle = nudged(&scene, 0.3, 0.02, 0.003);
    let report = solve(&mut bundle, &BundleOptions { relative_cost: 1e-14, ..BundleOptions::default() });
    assert!(report.rms_px < 1e-5 && report.iterations <= 20, "{} px, {} steps", report.rms_px, report.iterations);
    assert!(shape_error_mm(&bundle, &scene) < 1e-3);
}

#[test]
fn noise_of_03_px_over_120_frames_leaves_the_documented_error() {
    let scene = Scene::turning_head(&SceneOptions { points: 200, min_facing: -1.0, ..SceneOptions::default() });
    let mut bundle = nudged(&scene, 0.3, 0.01, 0.003);
    let report = solve(&mut bundle, &BundleOptions::default());
    let error = shape_error_mm(&bundle, &scene);
    println!("{error:.4} mm, {} steps, {:.3} px", report.iterations, report.rms_px);
    // Two coordinates of 0.3 px each.
    assert!((report.rms_px - 0.3 * 2.0_f64.sqrt()).abs() < 0.01);
    assert!(error < 0.08 && report.converged && report.iterations <= 8);
    let announced = report.point_sigma.iter().map(|s| s * s).sum::<f64>() / 200.0;
    assert!((0.02..0.08).contains(&(announced.sqrt() * 1e3)));
}

#[test]
fn focal_length_is_recovered_and_its_deviation_is_honest() {
    let mut misses = Vec::new();
    for seed in 0..6 {
        let scene = Scene::turning_head(&SceneOptions { points: 150, seed, ..SceneOptions::default() });
        let mut bundle = nudged(&scene, 0.3, 0.01, 0.003);
        bundle.camera.fx *= 1.1;
        bundle.camera.fy *= 1.1;
        let report = solve(&mut bundle, &BundleOptions { refine_focal: true, ..BundleOptions::default() });
        let sigma = report.focal_sigma_px.unwrap();
        println!("focal {:.2} ± {sigma:.2}", bundle.camera.fx);
        assert!(report.converged && (bundle.camera.fx - bundle.camera.fy).abs() < 1e-9);
        misses.push((bundle.camera.fx - 615.0) / sigma);
    }
    let spread = (misses.iter().map(|m| m * m).sum::<f64>() / 6.0).sqrt();
    assert!((0.3..2.0).contains(&spread), "{misses:?}");
}

#[test]
fn a_focal_prior_outweighs_a_few_frames() {
    let options = SceneOptions { frames: 3, yaw_deg: (-4.0, 4.0), points: 40, ..SceneOptions::default() };
    let scene = Scene::turning_head(&options);
    let mut bundle = nudged(&scene, 0.3, 0.005, 0.001);
    let focal_prior = Some(FocalPrior { focal_px: 640.0, log_sigma: 0.0015 });
    let report = solve(&mut bundle, &BundleOptions { refine_focal: true, focal_prior, ..BundleOptions::default() });
    assert!((bundle.camera.fx - 640.0).abs() < 3.0 && report.focal_sigma_px.unwrap() < 1.5);
}

#[test]
fn distortion_is_refined_with_the_focal_length() {
    let scene = Scene::turning_head(&SceneOptions {
        points: 300,
        camera: lens(),
        distance: 0.45,
        noise_px: 0.1,
        ..SceneOptions::default()
    });
    let mut bundle = nudged(&scene, 0.1, 0.005, 0.002);
    (bundle.camera.k1, bundle.camera.k2) = (0.0, 0.0);
    let options = BundleOptions { refine_focal: true, refine_distortion: true, ..BundleOptions::default() };
    let report = solve(&mut bundle, &options);
    let lens_error =
        |c: &Camera, r: f64| (c.distort(&Vec2::new(r, 0.0)).x - scene.camera.distort(&Vec2::new(r, 0.0)).x).abs();
    assert!(report.rms_px < 0.16 && lens_error(&bundle.camera, 0.25) < 1.5, "{:?}", bundle.camera);
}

#[test]
fn wrong_observations_are_rejected_and_the_shape_survives() {
    let scene =
        Scene::turning_head(&SceneOptions { points: 150, outliers: 0.15, frames: 40, ..SceneOptions::default() });
    let mut bundle = nudged(&scene, 0.3, 0.01, 0.002);
    let options = BundleOptions { loss: Loss::Cauchy(2.0), ..BundleOptions::default() };
    solve(&mut bundle, &options);
    let before = bundle.observations.len();
    let rejection = reject_outliers(&mut bundle, 4.0);
    solve(&mut bundle, &options);
    let wrong = scene.observations.iter().filter(|o| o.outlier).count();
    assert!(rejection.observations > wrong * 9 / 10 && rejection.observations < wrong + before / 100);
    let mut ideal = nudged(&scene, 0.3, 0.0, 0.0);
    let mut right = scene.observations.iter().map(|o| !o.outlier);
    ideal.observations.retain(|_| right.next().unwrap());
    solve(&mut ideal, &options);
    let (found, best) = (shape_error_mm(&bundle, &scene), shape_error_mm(&ideal, &scene));
    assert!((0.8..1.4).contains(&rejection.noise) && found < 1.2 * best, "{found} mm, at best {best} mm");
}

#[test]
fn priors_hold_what_two_frames_two_degrees_apart_cannot() {
    let options = SceneOptions { frames: 2, yaw_deg: (-1.0, 1.0), points: 60, ..SceneOptions::default() };
    let scene = Scene::turning_head(&options);
    let depth_error = |prior: bool| {
        let mut bundle = nudged(&scene, 0.3, 0.0, 0.002);
        let near = |i: usize| PointPrior::near(i, scene.points[i] + Vec3::new(0.002, 0.0, -0.002), 0.005);
        let point_priors = if prior { (0..60).map(near).collect() } else { Vec::new() };
        solve(&mut bundle, &BundleOptions { point_priors, ..BundleOptions::default() });
        shape_error_mm(&bundle, &scene)
    };
    let (with, without) = (depth_error(true), depth_error(false));
    assert!(with < 5.0 && without > 2.0 * with, "{with} mm with, {without} mm without");
}

#[test]
fn pose_priors_replace_a_fixed_frame() {
    let scene = Scene::turning_head(&SceneOptions { frames: 12, ..SceneOptions::default() });
    let mut bundle = nudged(&scene, 0.3, 0.01, 0.002);
    let prior =
        |frame: usize| PosePrior { frame, cam_from_head: scene.cam_from_head[frame], sigma_rad: 0.01, sigma_m: 0.002 };
    let options =
        BundleOptions { fixed_frames: vec![], pose_priors: (0..12).map(prior).collect(), ..BundleOptions::default() };
    solve(&mut bundle, &options);
    for (found, truth) in bundle.poses.iter().zip(&scene.cam_from_head) {
        assert!(found.angle_to(truth) < 0.01 && (found.translation - truth.translation).norm() < 0.004);
    }
}

#[test]
fn the_same_bits_with_one_thread_and_with_four() {
    let scene =
        Scene::turning_head(&SceneOptions { points: 150, frames: 30, background: 0, ..SceneOptions::default() });
    let run = |threads: usize| {
        let mut bundle = nudged(&scene, 0.3, 0.01, 0.002);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&mut bundle, &BundleOptions { refine_focal: true, ..BundleOptions::default() }));
        (bundle.poses, bundle.points, bundle.camera)
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn nonsense_is_refused_and_nothing_changes() {
    let scene = Scene::turning_head(&SceneOptions { frames: 4, ..SceneOptions::default() });
    let clean = nudged(&scene, 0.3, 0.01, 0.002);
    let fails = |spoil: &dyn Fn(&mut Bundle)| {
        let mut bundle = clean.clone();
        spoil(&mut bundle);
        let before = bundle.points.clone();
        let error = adjust(&mut bundle, &BundleOptions::default(), &Progress::new()).unwrap_err();
        assert!(bundle.points == before);
        error
    };
    assert!(matches!(fails(&|b| b.observations[0].frame = 4), MotionError::BadIndex { kind: "frame", index: 4, .. }));
    assert!(matches!(fails(&|b| b.observations[0].sigma_px = 0.0), MotionError::BadNumber { .. }));
    assert!(matches!(fails(&|b| b.observations[0].pixel.x = f64::NAN), MotionError::BadNumber { .. }));
    assert!(matches!(fails(&|b| b.observations.truncate(5)), MotionError::Underdetermined { .. }));
    let (mut bundle, cancelled) = (clean.clone(), Progress::new());
    cancelled.cancel();
    assert!(matches!(adjust(&mut bundle, &BundleOptions::default(), &cancelled), Err(MotionError::Cancelled(_))));
}

#[test]
#[ignore = "a measurement"]
fn time_per_step() {
    for (frames, points, repeats) in [(24, 66, 100), (120, 66, 20), (60, 300, 20), (120, 500, 5)] {
        let scene = Scene::turning_head(&SceneOptions { frames, points, min_facing: -1.0, ..SceneOptions::default() });
        let start = nudged(&scene, 0.3, 0.01, 0.003);
        let (before, mut steps) = (crate::two_view::processor_ms(), 0);
        for _ in 0..repeats {
            steps += solve(&mut start.clone(), &BundleOptions::default()).iterations;
        }
        let ms = (crate::two_view::processor_ms() - before) / steps as f64;
        println!("{frames} x {points}: {ms:.2} ms of one core per step, {} steps", steps / repeats);
    }
}
