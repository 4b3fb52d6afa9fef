//! Deviations against truth, over many draws of the noise.

use super::*;
use nalgebra::Vector6;

fn options() -> BundleOptions {
    BundleOptions { loss: Loss::Squared, covariances: true, ..BundleOptions::default() }
}

/// The step from the true pose to the one found.
fn pose_error(found: &Transform, truth: &Transform) -> Vector6<f64> {
    let turn = (found.rotation * truth.rotation.inverse()).scaled_axis();
    let shift = found.translation - truth.translation;
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// Part of the errors within two standard deviations.
fn within_two(errors: &[(f64, f64)]) -> f64 {
    errors.iter().filter(|(error, sigma)| error.abs() <= 2.0 * sigma).count() as f64 / errors.len() as f64
}

#[test]
fn poses_and_points_lie_within_their_deviations_as_often_as_they_should() {
    let (mut poses, mut points, mut spread) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..30 {
        let scene = Scene::turning_head(&SceneOptions { frames: 16, points: 40, seed, ..SceneOptions::default() });
        // From the truth: what is held is true.
        let mut bundle = nudged(&scene, 0.3, 0.0, 0.0);
        let report = solve(&mut bundle, &options());
        let covariances = report.covariances.unwrap();
        for (frame, covariance) in covariances.poses.iter().enumerate().skip(1) {
            let error = pose_error(&bundle.poses[frame], &scene.cam_from_head[frame]);
            let free = (0..6).filter(|k| covariance[(*k, *k)] > 0.0);
            poses.extend(free.map(|k| (error[k], covariance[(k, k)].sqrt())));
        }
        for (point, covariance) in covariances.points.iter().enumerate() {
            let Some(covariance) = covariance else { continue };
            let error = bundle.points[point] - scene.points[point];
            points.extend((0..3).map(|k| (error[k], covariance[(k, k)].sqrt())));
            spread.push(error.dot(&(covariance.try_inverse().unwrap() * error)) / 3.0);
        }
    }
    let (poses, points) = (within_two(&poses), within_two(&points));
    let spread = spread.iter().sum::<f64>() / spread.len() as f64;
    println!("{poses:.3} of the poses, {points:.3} of the points, squared distance {spread:.3}");
    assert!((0.90..0.99).contains(&poses) && (0.90..0.99).contains(&points) && (0.7..1.3).contains(&spread));
}

#[test]
fn a_larger_noise_than_the_announced_one_raises_the_deviations() {
    let scene = Scene::turning_head(&SceneOptions { frames: 16, points: 40, ..SceneOptions::default() });
    let sigma = |announced: f64| {
        let covariances = solve(&mut nudged(&scene, announced, 0.0, 0.0), &options()).covariances.unwrap();
        covariances.poses[9][(3, 3)].sqrt()
    };
    let (right, low, high) = (sigma(0.3), sigma(0.1), sigma(0.6));
    assert!((low / right - 1.0).abs() < 0.05 && high > 1.8 * right, "{low} {right} {high}");
}

#[test]
fn a_points_covariance_contains_its_cameras() {
    let scene = Scene::turning_head(&SceneOptions { frames: 16, points: 40, ..SceneOptions::default() });
    let covariances = |options: &BundleOptions| solve(&mut nudged(&scene, 0.3, 0.0, 0.0), options).covariances.unwrap();
    let free = covariances(&options());
    let exact = covariances(&BundleOptions { fixed_frames: (0..16).collect(), ..options() });
    for (free, exact) in free.points.iter().zip(&exact.points) {
        let (Some(free), Some(exact)) = (free, exact) else { continue };
        assert!((free - exact * 0.9).symmetric_eigenvalues().min() > 0.0 && free.trace() > 1.2 * exact.trace());
    }
}

/// The bundle of a head that turns by an angle to either side, its camera refined.
fn with_camera(turn_deg: f64, camera: Camera, seed: u64, distortion: bool) -> (Camera, BundleReport) {
    let scene = Scene::turning_head(&SceneOptions {
        yaw_deg: (-turn_deg, turn_deg),
        frames: 16,
        points: 60,
        distance: 0.5,
        camera,
        seed,
        ..SceneOptions::default()
    });
    let mut bundle = nudged(&scene, 0.3, 0.003, 0.001);
    bundle.camera.fx *= 1.03;
    bundle.camera.fy *= 1.03;
    let options = BundleOptions { refine_focal: true, refine_distortion: distortion, ..options() };
    let report = solve(&mut bundle, &options);
    (bundle.camera, report)
}

#[test]
fn the_focal_length_lies_within_two_deviations_when_the_head_turns_by_30_degrees() {
    let trial = |seed: u64| {
        let (camera, report) = with_camera(30.0, Camera::centred(352, 288, 615.0), seed, false);
        (camera.fx - 615.0, report.focal_sigma_px.unwrap())
    };
    let errors: Vec<(f64, f64)> = (0..100).map(trial).collect();
    let part = within_two(&errors);
    println!("{part:.2} within two deviations of {:.2} px", errors[0].1);
    assert!((0.90..=0.99).contains(&part));
}

#[test]
fn a_narrow_turn_tells_less_of_the_focal_length() {
    let sigma = |turn: f64| with_camera(turn, Camera::centred(352, 288, 615.0), 0, false).1.focal_sigma_px.unwrap();
    let (wide, middle, narrow) = (sigma(45.0), sigma(15.0), sigma(6.0));
    println!("45 degrees: {wide:.2} px, 15 degrees: {middle:.2} px, 6 degrees: {narrow:.2} px");
    assert!(middle > 1.5 * wide && narrow > 1.5 * middle);
}

#[test]
fn distortion_lies_within_two_deviations() {
    let trial = |seed: u64| {
        let (camera, report) = with_camera(40.0, lens(), seed, true);
        let covariance = report.covariances.unwrap().camera;
        let of = |k: usize, error: f64| (error, covariance[(k, k)].sqrt());
        [of(0, camera.fx - 615.0), of(1, camera.k1 + 0.2), of(2, camera.k2 - 0.08)]
    };
    let errors: Vec<(f64, f64)> = (0..40).flat_map(trial).collect();
    let part = within_two(&errors);
    println!("{part:.3} within two deviations, k1 ± {:.4}", errors[1].1);
    assert!((0.90..=0.99).contains(&part));
}
