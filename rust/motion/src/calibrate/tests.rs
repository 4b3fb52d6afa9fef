//! Boards with known cameras. The projection is written out anew, in plain numbers, so that it shares nothing with `Camera`.

use super::*;
use synthetic::Random;

const SQUARE: f64 = 0.0255;
/// `fx, fy, cx, cy, k1, k2, k3, p1, p2`.
pub(super) const PAPER: [f64; 9] = [702.0, 699.0, 308.4, 246.8, -0.25, 0.1, 0.0, 0.0, 0.0];
const FULL: [f64; 9] = [702.0, 699.0, 308.4, 246.8, -0.25, 0.1, 0.05, 1e-3, -2e-3];
const FLAT: [f64; 3] = [0.0; 3];

fn truth() -> Camera {
    Camera::centred(640, 480, 1.0).with_intrinsics(PAPER)
}

fn board() -> Vec<Vec2> {
    (0..54).map(|k| Vec2::new(f64::from(k % 9), f64::from(k / 9)) * SQUARE).collect()
}

/// The rows of the rotation by `angles` about x, then y, then z.
pub(super) fn turn([x, y, z]: [f64; 3]) -> [[f64; 3]; 3] {
    let ((sx, cx), (sy, cy), (sz, cz)) = (x.sin_cos(), y.sin_cos(), z.sin_cos());
    [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
}

/// Where a lens shows a point.
pub(super) fn seen([fx, fy, cx, cy, k1, k2, k3, p1, p2]: [f64; 9], point: [f64; 3]) -> Vec2 {
    let (x, y) = (point[0] / point[2], point[1] / point[2]);
    let r = x.hypot(y);
    let bend = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6);
    let across = x * bend + 2.0 * p1 * x * y + p2 * (r * r + 2.0 * x * x);
    let down = y * bend + p1 * (r * r + 2.0 * y * y) + 2.0 * p2 * x * y;
    Vec2::new(fx * across + cx, fy * down + cy)
}

/// Where a bent board turned by `angles` (radians about x, y, z) with its middle at `place` is seen.
fn picture(lens: [f64; 9], bend: [f64; 3], angles: [f64; 3], place: [f64; 3]) -> Vec<Vec2> {
    let rows = turn(angles);
    let pixel = |p: &Vec2| {
        let (x, y) = (p.x - 4.0 * SQUARE, p.y - 2.5 * SQUARE);
        let z = bend[0] * x * x + bend[1] * x * y + bend[2] * y * y;
        let along = |k: usize| rows[k][0] * x + rows[k][1] * y + rows[k][2] * z + place[k];
        seen(lens, [along(0), along(1), along(2)])
    };
    board().iter().map(pixel).collect()
}

fn view(angles: [f64; 3], place: [f64; 3], noise: &mut impl FnMut() -> Vec2) -> Vec<Vec2> {
    picture(PAPER, FLAT, angles, place).iter().map(|p| p + noise()).collect()
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

/// As [`views`], more at random. The corners of a picture err each by `sigma`, and together by a smooth field of `field`.
fn chance_views(lens: [f64; 9], bend: [f64; 3], count: usize, [sigma, field]: [f64; 2], seed: u64) -> Vec<Vec<Vec2>> {
    let mut random = Random::new(seed);
    (0..count)
        .map(|k| {
            let (side, tilt) = (k as f64 * 2.399 + random.between(-0.3, 0.3), random.between(0.25, 0.7));
            let angles = [tilt * side.cos(), tilt * side.sin(), random.between(-0.4, 0.4)];
            let z = random.between(0.42, 0.62);
            let place = [random.between(-0.18, 0.18) * z, random.between(-0.13, 0.13) * z, z];
            let weights: [Vec2; 5] = std::array::from_fn(|_| random.normal2(field));
            let shift = |p: &Vec2| {
                let (a, b) = (p.x / (4.0 * SQUARE) - 1.0, p.y / (2.5 * SQUARE) - 1.0);
                [a, b, a * a, b * b, a * b].iter().zip(weights).map(|(s, w)| w * *s).sum::<Vec2>()
            };
            let exact = picture(lens, bend, angles, place);
            exact.iter().zip(board()).map(|(pixel, p)| pixel + shift(&p) + random.normal2(sigma)).collect()
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

/// In how many of `runs` trials each number of the camera lies within two of its deviations from the truth, in per cent.
fn within_two_deviations(
    lens: [f64; 9],
    options: &CalibrateOptions,
    runs: u64,
    make: impl Fn(u64) -> Vec<Vec<Vec2>>,
) -> Vec<f64> {
    let mut hits = [0.0; 9];
    for seed in 0..runs {
        let found = run(&make(seed), options).unwrap();
        let d = found.deviations;
        let deviations = [d.fx, d.fy, d.cx, d.cy, d.k1, d.k2, d.k3, d.p1, d.p2];
        for (k, (number, deviation)) in found.camera.intrinsics().iter().zip(deviations).enumerate() {
            hits[k] += f64::from(u8::from((number - lens[k]).abs() <= 2.0 * deviation));
        }
    }
    let free = options.model().free();
    free.into_iter().map(|k| 100.0 * hits[k] / runs as f64).collect()
}

#[test]
fn the_truth_is_as_near_as_the_deviations_say() {
    let few = |seed: u64| chance_views(PAPER, FLAT, 12 + seed as usize % 3, [0.1 + 0.1 * (seed % 3) as f64, 0.0], seed);
    let found = within_two_deviations(PAPER, &CalibrateOptions::default(), 200, few);
    assert!(found.iter().all(|p| (90.0..=99.0).contains(p)), "{found:?}");
    let full = CalibrateOptions { distortion_terms: 3, tangential: true, ..CalibrateOptions::default() };
    let all = |seed: u64| chance_views(FULL, FLAT, 14, [0.2, 0.0], 1000 + seed);
    let found = within_two_deviations(FULL, &full, 200, all);
    assert!(found.len() == 9 && found.iter().all(|p| (90.0..=99.0).contains(p)), "{found:?}");
}

#[test]
fn corners_that_err_together_raise_the_deviations() {
    let together = |seed: u64| chance_views(PAPER, FLAT, 12, [0.1, 0.1], 300 + seed);
    let found = within_two_deviations(PAPER, &CalibrateOptions::default(), 200, together);
    assert!(found.iter().all(|p| (88.0..=99.0).contains(p)), "{found:?}");
    let found = run(&together(1), &CalibrateOptions::default()).unwrap();
    assert!(found.scatter.unwrap() > 1.5, "{:?}", found.scatter);
    let alone = run(&chance_views(PAPER, FLAT, 12, [0.1, 0.0], 1), &CalibrateOptions::default()).unwrap();
    assert!((0.7..1.3).contains(&alone.scatter.unwrap()), "{:?}", alone.scatter);
}

#[test]
fn a_bent_board_is_told_measured_and_can_be_allowed_for() {
    // A saddle: 0.53 mm between its highest and lowest corner.
    let bend = [0.03, -0.02, -0.02];
    let bent = |seed: u64| chance_views(PAPER, bend, 12, [0.1, 0.0], 500 + seed);
    let found = run(&bent(0), &CalibrateOptions::default()).unwrap();
    let told = found.warnings.iter().find(|w| matches!(w, CalibrateWarning::BentBoard { .. })).unwrap();
    assert!(told.to_string().contains("glue"), "{told}");
    let measured = found.bend.unwrap();
    let free = CalibrateOptions { bend: true, ..CalibrateOptions::default() };
    let solved = run(&bent(0), &free).unwrap();
    assert!((measured.bulge_mm - solved.bend.unwrap().bulge_mm).abs() < 0.1 * measured.bulge_mm);
    for (a, b) in solved.bend.unwrap().coefficients.iter().zip(bend) {
        assert!((a - b).abs() < 0.003, "{:?}", solved.bend);
    }
    assert!(!solved.warnings.iter().any(|w| matches!(w, CalibrateWarning::BentBoard { .. })));
    assert!(solved.rms_px < 0.9 * found.rms_px, "{} {} {measured:?}", solved.rms_px, found.rms_px);
    let within = within_two_deviations(PAPER, &free, 100, bent);
    assert!(within.iter().all(|p| (90.0..=100.0).contains(p)), "{within:?}");
    // Without allowing for it the deviations are large enough to hold its effect.
    let within = within_two_deviations(PAPER, &CalibrateOptions::default(), 100, bent);
    assert!(within.iter().all(|p| *p >= 90.0), "{within:?}");
}

#[test]
fn a_flat_board_is_not_called_bent() {
    for seed in 0..40 {
        let found = run(&chance_views(PAPER, FLAT, 12, [0.2, 0.0], 700 + seed), &CalibrateOptions::default()).unwrap();
        assert!(!found.warnings.iter().any(|w| matches!(w, CalibrateWarning::BentBoard { .. })), "{:?}", found.bend);
        assert!(!found.warnings.iter().any(|w| matches!(w, CalibrateWarning::Scattered { .. })), "{:?}", found.scatter);
    }
}

#[test]
fn residuals_are_those_of_the_noise() {
    for seed in 0..12 {
        let found = run(&views(12, 0.1, 100 + seed), &CalibrateOptions::default()).unwrap();
        assert!((found.sigma_px - 0.1).abs() < 0.01 && (found.rms_px - 0.138).abs() < 0.01, "{}", found.rms_px);
        let held_out = found.hold_out_rms_px.unwrap();
        assert!(held_out > found.rms_px && held_out < 1.1 * found.rms_px, "{held_out} {}", found.rms_px);
    }
}

#[test]
fn boards_seen_in_part_and_different_boards_give_the_camera() {
    let mut random = Random::new(8);
    let pictures: Vec<BoardView> = views(12, 0.1, 21)
        .into_iter()
        .enumerate()
        .map(|(k, pixels)| {
            // Another corner of the board is left out in each picture; the second board is counted from elsewhere.
            let (column, row) = (k % 4, k % 3);
            let shown = |i: &usize| i % 9 >= column && i % 9 < column + 5 && i / 9 >= row && i / 9 < row + 4;
            let origin = if k % 2 == 0 { Vec2::zeros() } else { Vec2::new(random.between(-1.0, 1.0), 0.3) };
            let points = board().iter().enumerate().filter(|(i, _)| shown(i)).map(|(_, p)| p + origin).collect();
            BoardView { points, pixels: pixels.iter().enumerate().filter(|(i, _)| shown(i)).map(|(_, p)| *p).collect() }
        })
        .collect();
    let found = calibrate(&pictures, 640, 480, &CalibrateOptions::default()).unwrap();
    let (c, d) = (found.camera, found.deviations);
    assert!((c.fx - PAPER[0]).abs() < 3.0 * d.fx && (c.cx - PAPER[2]).abs() < 3.0 * d.cx, "{c:?} {d:?}");
    assert!(d.fx < 4.0, "{d:?} {:?} {:?}", found.scatter, found.bend);
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
fn missing_tilts_and_parts_of_the_picture_are_named() {
    let mut random = Random::new(5);
    // Tilted so that the top or the bottom is nearer, and only in the left half of the picture.
    let shots: Vec<_> = (0..12)
        .map(|k| {
            let angles = [if k % 2 == 0 { 0.5 } else { -0.5 }, 0.02 * f64::from(k % 3), 0.0];
            let place = [-0.1, random.between(-0.08, 0.08), 0.5];
            view(angles, place, &mut || random.normal2(0.02))
        })
        .collect();
    let found = run(&shots, &CalibrateOptions::default()).unwrap();
    let tilts = found.warnings.iter().find_map(|w| match w {
        CalibrateWarning::SmallTilt { missing, .. } => Some(missing.clone()),
        _ => None,
    });
    assert_eq!(tilts.unwrap_or_default(), [Side::Left, Side::Right], "{:?}", found.warnings);
    let parts = found.warnings.iter().find_map(|w| match w {
        CalibrateWarning::SmallReach { missing, .. } => Some(missing.clone()),
        _ => None,
    });
    assert_eq!(parts.unwrap(), [PicturePart::TopRight, PicturePart::Right, PicturePart::BottomRight]);
}

#[test]
fn the_nearer_side_is_named_as_seen() {
    // Turned about y by a positive angle the right side, x > 0, goes to -sin: it comes nearer.
    let mut random = Random::new(6);
    let shots: Vec<_> = (0..10)
        .map(|k| {
            let angles = [0.3 * f64::from(k % 3 - 1), 0.1 + 0.02 * f64::from(k), 0.2];
            view(angles, [0.0, 0.0, 0.45], &mut || random.normal2(0.02))
        })
        .collect();
    let rows = turn([0.0, 0.3, 0.0]);
    assert!(rows[2][0] < 0.0);
    let found = run(&shots, &CalibrateOptions::default()).unwrap();
    let missing = found.warnings.iter().find_map(|w| match w {
        CalibrateWarning::SmallTilt { missing, .. } => Some(missing.clone()),
        _ => None,
    });
    assert_eq!(missing.unwrap(), [Side::Left]);
}

#[test]
fn one_camera_has_the_same_bytes_every_time() {
    let all = views(10, 0.2, 33);
    assert_eq!(run(&all, &CalibrateOptions::default()), run(&all, &CalibrateOptions::default()));
}

#[test]
fn bad_input_is_refused_with_its_picture() {
    let good = views(4, 0.1, 9);
    let default = CalibrateOptions::default();
    assert_eq!(run(&good[..2], &default), Err(CalibrateError::TooFewViews { views: 2 }));
    let mut short = good.clone();
    short[2].pop();
    assert_eq!(run(&short, &default), Err(CalibrateError::CornerCount { view: 2, found: 53, expected: 54 }));
    let few = BoardView { points: board()[..5].to_vec(), pixels: good[1][..5].to_vec() };
    let part = [BoardView { points: board(), pixels: good[0].clone() }, few.clone(), few];
    let error = calibrate(&part, 640, 480, &default);
    assert_eq!(error, Err(CalibrateError::TooFewCorners { view: 1, found: 5, needed: 6 }));
    let terms = CalibrateOptions { distortion_terms: 4, ..default };
    assert!(matches!(run(&good, &terms), Err(CalibrateError::InvalidInput { .. })));
    let mut line = good.clone();
    line[1] = (0..54).map(|k| Vec2::new(f64::from(k), 3.0)).collect();
    assert_eq!(run(&line, &default), Err(CalibrateError::FlatView { view: 1 }));
    let mut random = Random::new(1);
    let noise: Vec<Vec<Vec2>> = (0..5)
        .map(|_| (0..54).map(|_| Vec2::new(random.between(0.0, 640.0), random.between(0.0, 480.0))).collect())
        .collect();
    assert!(run(&noise, &default).is_err());
}
