//! Rigs with known cameras and places, in plain numbers.

use super::*;
use crate::calibrate::CalibrateError;
use crate::calibrate::tests::{PAPER, seen, turn};
use geometry::Mat3;
use synthetic::Random;

const SQUARE: f64 = 0.03;
/// Angles about x, y, z and translation of `camera_from_rig`.
const PLACES: [([f64; 3], [f64; 3]); 3] =
    [([0.0; 3], [0.0; 3]), ([0.01, -0.06, 0.02], [-0.12, 0.003, 0.008]), ([-0.05, 0.12, -0.03], [0.14, -0.02, 0.03])];

fn lens(camera: usize) -> [f64; 9] {
    let mut lens = PAPER;
    lens[0] += 11.0 * camera as f64;
    lens[2] -= 4.0 * camera as f64;
    lens[4] += 0.03 * camera as f64;
    lens
}

fn board() -> Board {
    Board::checkerboard(6, 4, SQUARE)
}

fn moved(angles: [f64; 3], place: [f64; 3], point: [f64; 3]) -> [f64; 3] {
    let rows = turn(angles);
    std::array::from_fn(|k| (0..3).map(|j| rows[k][j] * point[j]).sum::<f64>() + place[k])
}

/// What the first `cameras` of [`PLACES`] see at some moments.
fn rig(cameras: usize, moments: usize, sigma: f64, seed: u64) -> Vec<RigCamera> {
    let mut random = Random::new(seed);
    let mut all = vec![RigCamera { width: 640, height: 480, views: Vec::new() }; cameras];
    for m in 0..moments {
        let (side, tilt) = (m as f64 * 2.4, random.between(0.3, 0.6));
        let angles = [tilt * side.cos(), tilt * side.sin(), random.between(-0.5, 0.5)];
        let z = random.between(0.5, 0.8);
        let place = [random.between(-0.12, 0.12) * z, random.between(-0.12, 0.12) * z, z];
        for (c, camera) in all.iter_mut().enumerate() {
            let middle = board().centre();
            let pixel = |p: &Vec2| {
                let in_rig = moved(angles, place, [p.x - middle.x, p.y - middle.y, 0.0]);
                seen(lens(c), moved(PLACES[c].0, PLACES[c].1, in_rig)) + random.normal2(sigma)
            };
            let pixels = board().points().iter().map(pixel).collect();
            camera.views.push(Some(BoardView::whole(&board(), pixels)));
        }
    }
    all
}

/// Counts the board from its other end.
fn flip(camera: &mut RigCamera, moment: usize) {
    camera.views[moment].as_mut().unwrap().pixels.reverse();
}

fn solve(cameras: &[RigCamera], symmetry: &BoardSymmetry) -> Result<Rig, RigError> {
    calibrate_rig(cameras, symmetry, &CalibrateOptions::default())
}

/// Turn and translation by which a camera stands elsewhere than it should.
fn errors(rig: &Rig, camera: usize) -> (f64, f64) {
    let (angles, place) = PLACES[camera];
    let rows = turn(angles);
    let truth = Transform::from_matrix(&Mat3::from_fn(|i, j| rows[i][j]), Vector3::from(place));
    let found = rig.cameras[camera].mount.camera_from_rig;
    (found.angle_to(&truth), (found.translation - truth.translation).norm())
}

#[test]
fn perfect_pictures_give_the_rig_exactly() {
    let found = solve(&rig(3, 8, 0.0, 1), &BoardSymmetry::none()).unwrap();
    for camera in 0..3 {
        let (angle, way) = errors(&found, camera);
        assert!(angle < 1e-7 && way < 1e-7, "{angle} {way}");
        assert!((found.cameras[camera].camera.fx - lens(camera)[0]).abs() < 1e-3);
    }
    assert_eq!(found.cameras[0].mount.camera_from_rig, Transform::identity());
    assert!((found.cameras[1].mount.baseline - Vector3::from(PLACES[1].1).norm()).abs() < 1e-7);
    assert!(found.rms_px < 1e-5 && found.boards.iter().all(Option::is_some));
}

#[test]
fn pictures_counted_from_the_other_end_are_turned_round() {
    let mut cameras = rig(3, 9, 0.2, 2);
    let straight = solve(&cameras, &BoardSymmetry::none()).unwrap();
    for (camera, moment) in [(0, 1), (1, 0), (1, 4), (1, 5), (2, 1), (2, 7), (2, 8)] {
        flip(&mut cameras[camera], moment);
    }
    let found = solve(&cameras, &BoardSymmetry::of(&board())).unwrap();
    assert!(!found.warnings.iter().any(|w| matches!(w, RigWarning::LeftOut { .. } | RigWarning::AmbiguousTurn { .. })));
    assert!((found.rms_px - straight.rms_px).abs() < 1e-6, "{} {}", found.rms_px, straight.rms_px);
    for camera in 1..3 {
        let (a, b) = (found.cameras[camera].mount.camera_from_rig, straight.cameras[camera].mount.camera_from_rig);
        assert!(a.angle_to(&b) < 1e-6 && (a.translation - b.translation).norm() < 1e-6);
    }
}

#[test]
fn without_a_symmetry_a_picture_counted_from_the_other_end_is_left_out() {
    let mut cameras = rig(2, 9, 0.2, 3);
    flip(&mut cameras[1], 4);
    let found = solve(&cameras, &BoardSymmetry::none()).unwrap();
    let left_out = found.warnings.iter().filter(|w| matches!(w, RigWarning::LeftOut { moment: 4, .. }));
    assert_eq!(left_out.count(), 1);
    let ((angle, way), mounted) = (errors(&found, 1), &found.cameras[1]);
    let (turns, ways) =
        (Vector3::from(mounted.mount.rotation_deviations), Vector3::from(mounted.mount.translation_deviations));
    assert!(angle < 3.0 * turns.norm() && way < 3.0 * ways.norm(), "{angle} {way} {turns} {ways}");
    assert!(turns.norm() < 0.01 && ways.norm() < 0.004, "{turns} {ways}");
}

#[test]
fn cameras_connected_only_through_another_are_placed() {
    let mut cameras = rig(3, 16, 0.1, 4);
    // The third camera never sees the board together with the first one.
    for m in 0..16 {
        let blind = if m < 8 { 2 } else { 0 };
        cameras[blind].views[m] = None;
    }
    cameras[1].views[3] = None;
    let found = solve(&cameras, &BoardSymmetry::of(&board())).unwrap();
    let (angle, way) = errors(&found, 2);
    let mounted = &found.cameras[2];
    let (turns, ways) =
        (Vector3::from(mounted.mount.rotation_deviations), Vector3::from(mounted.mount.translation_deviations));
    assert!(angle < 3.0 * turns.norm() && way < 3.0 * ways.norm(), "{angle} {way} {turns} {ways}");
    assert!(ways.norm() < 0.005);
    assert!(mounted.views[3].is_none() && mounted.views[12].is_some() && found.boards[3].is_some());
}

#[test]
fn the_truth_is_as_near_as_the_deviations_say() {
    let (mut hits, runs) = ([0.0; 7], 60);
    for seed in 0..runs {
        let found = solve(&rig(2, 12, 0.2, 100 + seed), &BoardSymmetry::none()).unwrap();
        let mounted = &found.cameras[1];
        let rows = turn(PLACES[1].0);
        let truth = nalgebra::Rotation3::from_matrix(&Mat3::from_fn(|i, j| rows[i][j]));
        let angle = (mounted.mount.camera_from_rig.rotation * truth.inverse()).scaled_axis();
        let way = mounted.mount.camera_from_rig.translation - Vector3::from(PLACES[1].1);
        for k in 0..3 {
            hits[k] += f64::from(u8::from(angle[k].abs() < 2.0 * mounted.mount.rotation_deviations[k]));
            hits[3 + k] += f64::from(u8::from(way[k].abs() < 2.0 * mounted.mount.translation_deviations[k]));
        }
        let baseline = mounted.mount.baseline - Vector3::from(PLACES[1].1).norm();
        hits[6] += f64::from(u8::from(baseline.abs() < 2.0 * mounted.mount.baseline_deviation));
    }
    let percent = hits.map(|h| 100.0 * h / runs as f64);
    assert!(percent.iter().all(|p| *p >= 88.0), "{percent:?}");
    assert!(percent.iter().sum::<f64>() / 7.0 < 99.5, "{percent:?}");
}

#[test]
fn one_shared_moment_of_a_symmetric_board_is_a_guess_that_is_told() {
    let mut cameras = rig(2, 13, 0.1, 6);
    for m in 0..12 {
        cameras[m % 2].views[m] = None;
    }
    let found = solve(&cameras, &BoardSymmetry::of(&board())).unwrap();
    assert!(found.warnings.contains(&RigWarning::AmbiguousTurn { camera: 0, other: 1 }));
    assert!(found.warnings.contains(&RigWarning::FewMoments { camera: 0, other: 1, moments: 1 }));
    // The guess is the cameras that stand the same way up.
    assert!(errors(&found, 1).0 < 0.05);
}

#[test]
fn boards_know_their_turns() {
    let turns = |board: Board| BoardSymmetry::of(&board).turns;
    assert_eq!(turns(Board::checkerboard(9, 6, 0.02)), 1);
    assert_eq!(turns(Board::checkerboard(6, 4, 0.02)), 2);
    assert_eq!(turns(Board::checkerboard(7, 7, 0.02)), 2);
    assert_eq!(turns(Board::checkerboard(6, 6, 0.02)), 4);
    assert_eq!(turns(Board::squares(3, 4, 0.02, 1.0)), 2);
}

#[test]
fn wrong_input_is_refused_by_name() {
    let cameras = rig(3, 8, 0.1, 7);
    let symmetry = BoardSymmetry::none();
    assert_eq!(solve(&cameras[..1], &symmetry), Err(RigError::TooFewCameras { cameras: 1 }));
    let mut short = cameras.clone();
    short[1].views.pop();
    assert_eq!(solve(&short, &symmetry), Err(RigError::MomentCount { camera: 1, found: 7, expected: 8 }));
    let mut few = cameras.clone();
    few[2].views[2..].fill(None);
    let source = CalibrateError::TooFewViews { views: 2 };
    assert_eq!(solve(&few, &symmetry), Err(RigError::Camera { camera: 2, source }));
    let mut broken = cameras.clone();
    broken[1].views[0] = None;
    broken[1].views[5].as_mut().unwrap().pixels.pop();
    let source = CalibrateError::CornerCount { view: 5, found: 23, expected: 24 };
    assert_eq!(solve(&broken, &symmetry), Err(RigError::Camera { camera: 1, source }));
    let mut apart = cameras.clone();
    (0..4).for_each(|m| apart[2].views[m] = None);
    (4..8).for_each(|m| (0..2).for_each(|c| apart[c].views[m] = None));
    assert_eq!(solve(&apart, &symmetry), Err(RigError::Unconnected { camera: 2 }));
    let mut shuffled = cameras[..2].to_vec();
    shuffled[1].views.rotate_left(3);
    assert_eq!(solve(&shuffled, &symmetry), Err(RigError::Disagreement { camera: 0, other: 1, moments: 8 }));
    let turns = BoardSymmetry { turns: 0, ..symmetry };
    assert_eq!(solve(&cameras, &turns), Err(RigError::InvalidSymmetry { turns: 0 }));
}
