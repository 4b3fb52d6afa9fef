//! The motion between the two pictures of a stereo camera, from the pictures alone, against where its calibration puts the
//! cameras. Skipped where the photographs are missing.

#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "the helpers of tests are tests too")]

use geometry::{Board, Camera, Transform, Vec2};
use motion::calibrate::rig::{BoardSymmetry, RigCamera, calibrate_rig};
use motion::calibrate::{BoardView, CalibrateOptions};
use motion::two_view::{TwoView, TwoViewOptions, robust};
use std::path::{Path, PathBuf};
use vision::board::{BoardOptions, detect as detect_board};
use vision::corners::{CornerOptions, detect};
use vision::correct::{GeometricOptions, Known, Match, geometric};
use vision::pyramid::Pyramid;
use vision::track::{Status, TrackOptions, track};

/// Near things are displaced by a fifth of the picture's width: the coarsest level must bring that below a window.
const LEVELS: usize = 6;
/// Distance of a right match from its epipolar line, pixels.
const THRESHOLD_PX: f64 = 1.0;

fn photographs(set: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(set);
    if !folder.is_dir() {
        eprintln!("skipped: {} is missing", folder.display());
        return None;
    }
    Some(folder)
}

/// The two cameras and `right_from_left`, from photographs of a board of 4 × 6 inner corners, 30 mm apart.
fn rig(folder: &Path) -> ([Camera; 2], Transform) {
    let board = Board::checkerboard(4, 6, 0.03);
    let view = |side: &str, k: usize| {
        let picture = image::open(folder.join(format!("{side}{k:02}.jpg"))).unwrap().to_luma8();
        let found = detect_board(&picture, &[board], &BoardOptions::default()).ok()?;
        Some(BoardView::whole(&board, found.corners.iter().map(|c| c.position).collect()))
    };
    let camera = |side: &str| RigCamera { width: 640, height: 480, views: (1..=11).map(|k| view(side, k)).collect() };
    let symmetry = BoardSymmetry::of(&board);
    let found = calibrate_rig(&[camera("left"), camera("right")], &symmetry, &CalibrateOptions::default()).unwrap();
    ([0, 1].map(|k| found.cameras[k].camera), found.cameras[1].mount.camera_from_rig)
}

/// Corners of the left picture in the right one: tracked there and back, then held against their neighbours.
fn matches(left: &Path, right: &Path) -> Vec<Match> {
    let [left, right] = [left, right].map(|path| Pyramid::new(&image::open(path).unwrap().to_luma8(), LEVELS));
    let corners = CornerOptions { max_count: 1000, ..CornerOptions::default() };
    let corners: Vec<Vec2> = detect(&left, None, &corners).unwrap().iter().map(|corner| corner.position).collect();
    let options = TrackOptions { levels: LEVELS, min_ncc: Some(0.8), ..TrackOptions::default() };
    let tracked = track(&left, &right, &corners, None, &options).unwrap();
    let found = |(a, t): (&Vec2, &vision::track::Track)| {
        if t.status == Status::Found { Match { a: *a, b: t.position } } else { Match::missing(*a) }
    };
    let tracked: Vec<Match> = corners.iter().zip(&tracked).map(found).collect();
    let corrected = geometric(&left, &right, &tracked, &Known::default(), &GeometricOptions::default()).unwrap();
    corrected.usable().copied().collect()
}

fn motion(matches: &[Match], cameras: &[Camera; 2]) -> TwoView {
    let a: Vec<Vec2> = matches.iter().map(|m| cameras[0].normalise(&m.a)).collect();
    let b: Vec<Vec2> = matches.iter().map(|m| cameras[1].normalise(&m.b)).collect();
    robust(&a, &b, &TwoViewOptions { threshold: THRESHOLD_PX / cameras[0].fx, ..TwoViewOptions::default() }).unwrap()
}

#[test]
fn stereo_pictures_alone_tell_how_the_calibrated_cameras_stand() {
    let folders = (photographs("calibration/bumblebee2-stereo-chess"), photographs("sfm/stereo"));
    let (Some(boards), Some(pictures)) = folders else { return };
    let (cameras, right_from_left) = rig(&boards);
    let mut far = Vec::new();
    for name in ["chair01", "chair02", "garden01", "garden02", "lantern01"] {
        let [left, right] = ["left", "right"].map(|side| pictures.join(format!("{name}_{side}.jpg")));
        let matches = matches(&left, &right);
        let found = motion(&matches, &cameras);
        let turned = found.b_from_a.angle_to(&right_from_left).to_degrees();
        let aimed = found.b_from_a.translation.angle(&right_from_left.translation).to_degrees();
        let inliers = found.inliers.iter().filter(|i| **i).count();
        eprintln!(
            "{name}: rotation off by {turned:.3} deg (said {:.3}), direction by {aimed:.3} deg (said {:.3}), {inliers} of {} \
             matches, {:.2} px{}",
            found.rotation_sigma_rad.to_degrees(),
            found.direction_sigma_rad.to_degrees(),
            matches.len(),
            found.sigma * cameras[0].fx,
            if found.planar { ", planar" } else { "" },
        );
        if turned > 0.3 || aimed > 1.0 {
            far.push(name);
        }
    }
    assert!(far.is_empty(), "{far:?}");
}
