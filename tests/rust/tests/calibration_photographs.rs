//! Cameras from photographs of a real board, against those that BoofCV gives for them. Skipped where the photographs are
//! missing.

#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "the helpers of tests are tests too")]

use facewright::FrameSet;
use geometry::{Board, Camera, Progress};
use motion::calibrate::rig::{BoardSymmetry, RigCamera, calibrate_rig};
use motion::calibrate::{BoardView, CalibrateOptions, calibrate};
use std::path::{Path, PathBuf};
use vision::board::{BoardOptions, detect};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;

fn photographs(set: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let folder = root.join("shared/data/calibration").join(set);
    if !folder.is_dir() {
        eprintln!("skipped: {} is missing", folder.display());
        return None;
    }
    Some(folder)
}

/// The board of both sets: 4 × 6 inner corners, 30 mm apart.
fn seen(folder: &Path, name: &str) -> Option<BoardView> {
    let picture = image::open(folder.join(name)).unwrap().to_luma8();
    let board = Board::checkerboard(4, 6, 0.03);
    let found = detect(&picture, &[board], &BoardOptions::default()).ok()?;
    assert_eq!(found.corners.len(), 24, "{name}");
    Some(BoardView::whole(&board, found.corners.iter().map(|c| c.position).collect()))
}

fn assert_focal(camera: &Camera, (fx, fy): (f64, f64), percent: f64) {
    let error = (camera.fx / fx - 1.0).abs().max((camera.fy / fy - 1.0).abs());
    assert!(100.0 * error < percent, "{camera:?}");
}

#[test]
fn the_webcam_is_that_of_another_implementation() {
    let Some(folder) = photographs("sony-mono-chess") else { return };
    let views: Vec<BoardView> = (1..=13).filter_map(|k| seen(&folder, &format!("frame{k:02}.jpg"))).collect();
    assert_eq!(views.len(), 13);
    let found = calibrate(&views, WIDTH, HEIGHT, &CalibrateOptions::default()).unwrap();
    assert!(found.rms_px <= 0.154, "{}", found.rms_px);
    assert_focal(&found.camera, (701.0117, 698.6538), 0.1);
}

#[test]
fn the_stereo_cameras_stand_where_another_implementation_puts_them() {
    let Some(folder) = photographs("bumblebee2-stereo-chess") else { return };
    let camera = |side: &str| RigCamera {
        width: WIDTH,
        height: HEIGHT,
        views: (1..=11).map(|k| seen(&folder, &format!("{side}{k:02}.jpg"))).collect(),
    };
    let symmetry = BoardSymmetry::of(&Board::checkerboard(4, 6, 0.03));
    let found = calibrate_rig(&[camera("left"), camera("right")], &symmetry, &CalibrateOptions::default()).unwrap();
    assert_focal(&found.cameras[0].camera, (524.6142, 526.9202), 0.5);
    assert_focal(&found.cameras[1].camera, (526.4373, 528.6525), 0.5);
    let baseline = found.cameras[1].mount.baseline;
    assert!((baseline / 0.120_05 - 1.0).abs() < 0.005, "{baseline}");
    assert!(found.rms_px < 0.1, "{}", found.rms_px);
}

#[test]
fn separate_squares_on_curled_paper_give_the_webcam_too() {
    let Some(folder) = photographs("sony-mono-squares") else { return };
    let squares = Some(facewright::Grid { columns: 3, rows: 4 });
    let board = facewright::BoardOptions { squares, square_mm: 30.0, ..facewright::BoardOptions::default() };
    let options = facewright::CalibrateOptions { board, ..facewright::CalibrateOptions::default() };
    let progress = Progress::new();
    let found = facewright::calibrate(&FrameSet::open(&[folder], &progress).unwrap(), &options, &progress).unwrap();
    assert!(found.images.iter().all(|image| image.used));
    assert_focal(&found.camera.camera, (703.0800, 704.7902), 0.3);
    assert!(found.warnings.iter().any(|w| w.contains("the board bulges")), "{:?}", found.warnings);
}
