//! Boards with known cameras; corners by an independent projection, with noise.

use super::*;
use geometry::Vec3;
use nalgebra::Rotation3;
use synthetic::Random;

const SQUARE: f64 = 0.0255;

fn truth() -> Camera {
    Camera { fy: 699.0, cx: 308.4, cy: 246.8, k1: -0.25, k2: 0.1, ..Camera::centred(640, 480, 702.0) }
}

fn board() -> Vec<Vec2> {
    (0..54).map(|k| Vec2::new(f64::from(k % 9), f64::from(k / 9)) * SQUARE).collect()
}

/// Where a board turned by `angles` (radians about x, y, z) with its middle at `place` is seen.
fn view(angles: [f64; 3], place: [f64; 3], noise: &mut impl FnMut() -> Vec2) -> Vec<Vec2> {
    let camera = truth();
    let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
    let middle = Vec3::new(4.0, 2.5, 0.0) * SQUARE;
    let pixel = |p: &Vec2| {
        let q = rotation * (p.push(0.0) - middle) + Vec3::from(place);
        let (x, y) = (q.x / q.z, q.y / q.z);
        let r = x.hypot(y);
        let bend = 1.0 + camera.k1 * r.powi(2) + camera.k2 * r.powi(4);
        Vec2::new(camera.fx * x * bend + camera.cx, camera.fy * y * bend + camera.cy)
    };
    board().iter().map(|p| pixel(p) + noise()).collect()
}

/// `count` boards tilted to all sides and spread over the picture.
fn views(count: usize, sigma: f64, seed: u64) -> Vec<Vec<Vec2>> {
    let mut random = Random::new(seed);
    (0..count)
        .map(|k| {
            let t = k as f64 * 2.4;
            let angles = [0.55 * t.cos(), 0.55 * t.sin(), random.between(-0.4, 0.4)];
            let place = [random.between(-0.07, 0.07), random.between(-0.05, 0.05), random.between(0.42, 0.6)];
            view(angles, place, &mut || random.normal2(sigma))
        })
        .collect()
}

fn run(views: &[Vec<Vec2>], options: &CalibrateOptions) -> Result<Calibration, CalibrateError> {
    let views: Vec<BoardView> = views.iter().map(|v| BoardView { points: board(), pixels: v.clone() }).collect();
    calibrate(&views, 640, 480, options)
}

#[test]
fn recovers_the_camera_exactly_from_three_perfect_boards() {
    let found = run(&views(3, 0.0, 1), &CalibrateOptions::default()).unwrap();
    let (c, t) = (found.camera, truth());
    assert!((c.fx - t.fx).abs() < 1e-5 && (c.cy - t.cy).abs() < 1e-5, "{c:?}");
    assert!((c.k1 - t.k1).abs() < 1e-7 && (c.k2 - t.k2).abs() < 1e-6, "{c:?}");
    assert!(found.rms_px < 1e-6);
    assert!(found.warnings.contains(&CalibrateWarning::FewViews { views: 3 }));
}

#[test]
fn noise_moves_the_camera_by_its_stated_deviations() {
    let (mut squares, mut runs) = ([0.0; 6], 0.0);
    for seed in 0..12 {
        let found = run(&views(12, 0.1, 100 + seed), &CalibrateOptions::default()).unwrap();
        let (c, t, d) = (found.camera, truth(), found.deviations);
        let errors = [
            (c.fx - t.fx) / d.fx,
            (c.fy - t.fy) / d.fy,
            (c.cx - t.cx) / d.cx,
            (c.cy - t.cy) / d.cy,
            (c.k1 - t.k1) / d.k1,
            (c.k2 - t.k2) / d.k2,
        ];
        squares.iter_mut().zip(errors).for_each(|(s, e)| *s += e * e);
        runs += 1.0;
        assert!((found.sigma_px - 0.1).abs() < 0.02 && (found.rms_px - 0.138).abs() < 0.02, "{}", found.rms_px);
        let held_out = found.hold_out_rms_px.unwrap();
        assert!(held_out > found.rms_px && held_out < 1.2 * found.rms_px, "{held_out} {}", found.rms_px);
    }
    let mean = squares.iter().sum::<f64>() / (6.0 * runs);
    assert!((0.4..2.0).contains(&mean), "errors are {squares:?} / {runs} variances");
}

#[test]
fn hold_out_agrees_with_leaving_the_board_out() {
    let (all, plain) = (views(8, 0.2, 5), CalibrateOptions { loss: Loss::Squared, ..CalibrateOptions::default() });
    let found = run(&all, &plain).unwrap();
    for left_out in 0..3 {
        let mut others = all.clone();
        let view = others.remove(left_out);
        let camera = run(&others, &plain).unwrap().camera;
        let exact = resected_rms(&view, &camera, &found.views[left_out].cam_from_board);
        let cheap = found.views[left_out].hold_out_rms_px.unwrap();
        assert!((exact - cheap).abs() < 0.02 * exact, "{exact} {cheap}");
    }
}

/// Root mean square distance at the best pose of one board before a given camera, by Gauss–Newton from `start`.
fn resected_rms(view: &[Vec2], camera: &Camera, start: &Transform) -> f64 {
    let mut pose = *start;
    for _ in 0..10 {
        let (mut normal, mut right) = (nalgebra::Matrix6::zeros(), nalgebra::Vector6::zeros());
        for (point, pixel) in board().iter().zip(view) {
            let turned = pose.rotation * point.push(0.0);
            let (place, by) = camera.project_with_jacobian(&(turned + pose.translation)).unwrap();
            let mut row = nalgebra::Matrix2x6::zeros();
            row.fixed_columns_mut::<3>(0).copy_from(&(-by.point * geometry::skew(&turned)));
            row.fixed_columns_mut::<3>(3).copy_from(&by.point);
            normal += row.tr_mul(&row);
            right += row.tr_mul(&(place - pixel));
        }
        pose = pose.retract(&-normal.cholesky().unwrap().solve(&right));
    }
    let error = |(p, q): (&Vec2, &Vec2)| (camera.project(&pose.apply(&p.push(0.0))).unwrap() - q).norm_squared();
    (board().iter().zip(view).map(error).sum::<f64>() / view.len() as f64).sqrt()
}

#[test]
fn square_pixels_and_fewer_terms_stay_as_asked() {
    let options = CalibrateOptions { square_pixels: true, distortion_terms: 1, ..CalibrateOptions::default() };
    let found = run(&views(8, 0.1, 3), &options).unwrap();
    assert_eq!(found.camera.fx, found.camera.fy);
    assert_eq!((found.camera.k2, found.deviations.k2), (0.0, 0.0));
}

#[test]
fn wrong_corners_hardly_move_a_robust_calibration() {
    let mut spoilt = views(10, 0.1, 7);
    for (k, view) in spoilt.iter_mut().enumerate() {
        view[(7 * k) % 54] += Vec2::new(6.0, -4.0);
        view[(11 * k + 3) % 54] += Vec2::new(-5.0, 7.0);
    }
    let robust = run(&spoilt, &CalibrateOptions::default()).unwrap();
    let plain = run(&spoilt, &CalibrateOptions { loss: Loss::Squared, ..CalibrateOptions::default() }).unwrap();
    let error = |c: &Calibration| (c.camera.fx - truth().fx).abs() / truth().fx;
    assert!(error(&robust) < 0.002, "{}", error(&robust));
    assert!(robust.sigma_px < 0.15 && plain.rms_px > 1.0);
}

#[test]
fn parallel_boards_are_refused() {
    let mut random = Random::new(2);
    let parallel: Vec<_> = (0..6)
        .map(|k| {
            let place = [0.01 * f64::from(k) - 0.03, 0.0, 0.45 + 0.03 * f64::from(k)];
            view([0.0, 0.0, 0.1 * f64::from(k)], place, &mut || random.normal2(0.1))
        })
        .collect();
    assert_eq!(run(&parallel, &CalibrateOptions::default()), Err(CalibrateError::Degenerate));
}

#[test]
fn little_tilt_is_warned_of() {
    let mut random = Random::new(4);
    let flat: Vec<_> = (0..12)
        .map(|k| {
            let t = f64::from(k);
            view([0.12 * t.cos(), 0.12 * t.sin(), 0.3], [0.0, 0.0, 0.45], &mut || random.normal2(0.02))
        })
        .collect();
    let found = run(&flat, &CalibrateOptions::default()).unwrap();
    assert!(found.warnings.iter().any(|w| matches!(w, CalibrateWarning::SmallTilt { .. })), "{:?}", found.warnings);
}

#[test]
fn bad_input_is_refused_with_its_picture() {
    let good = views(4, 0.1, 9);
    let default = CalibrateOptions::default();
    assert_eq!(run(&good[..2], &default), Err(CalibrateError::TooFewViews { views: 2 }));
    let mut short = good.clone();
    short[2].pop();
    assert_eq!(run(&short, &default), Err(CalibrateError::CornerCount { view: 2, found: 53, expected: 54 }));
    let mut line = good.clone();
    line[1] = (0..54).map(|k| Vec2::new(f64::from(k), 3.0)).collect();
    assert_eq!(run(&line, &default), Err(CalibrateError::FlatView { view: 1 }));
    let mut random = Random::new(1);
    let noise: Vec<Vec<Vec2>> = (0..5)
        .map(|_| (0..54).map(|_| Vec2::new(random.between(0.0, 640.0), random.between(0.0, 480.0))).collect())
        .collect();
    assert!(run(&noise, &default).is_err());
}
