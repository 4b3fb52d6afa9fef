//! From the printed board to the camera: the program's own board file, photographed by a computed camera, calibrates it.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{clip, program};
use geometry::{Camera, Transform, Vec2, Vec3};
use image::GrayImage;
use nalgebra::Rotation3;
use rayon::prelude::*;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// Resolution of the board's file, pixels per metre.
const PRINT: f64 = 200.0 / 0.0254;
/// Samples per pixel along each axis.
const SAMPLES: usize = 3;

fn facewright(arguments: &[&str]) -> Output {
    Command::new(program().unwrap()).arg("--quiet").args(arguments).output().unwrap()
}

fn succeed(arguments: &[&str]) {
    let output = facewright(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// Width and height of a photograph, pixels.
const SIZE: [u32; 2] = [640, 480];

/// The sheet lies in the plane z = 0 of its own frame, its top left corner at the origin; `ray` is what a pixel looks along.
fn photograph(sheet: &GrayImage, ray: impl Fn(&Vec2) -> Vec3 + Sync, cam_from_sheet: &Transform) -> GrayImage {
    let sheet_from_cam = cam_from_sheet.inverse();
    let [width, height] = SIZE;
    let light = |u: f64, v: f64| {
        let direction = sheet_from_cam.rotation * ray(&Vec2::new(u, v));
        if direction.z * sheet_from_cam.translation.z >= 0.0 {
            return 90.0;
        }
        let hit = sheet_from_cam.translation - direction * (sheet_from_cam.translation.z / direction.z);
        let (x, y) = (hit.x * PRINT - 0.5, hit.y * PRINT - 0.5);
        let inside = x >= 0.0 && y >= 0.0 && x < f64::from(sheet.width() - 1) && y < f64::from(sheet.height() - 1);
        if !inside {
            return 90.0;
        }
        let (a, b) = (x.fract(), y.fract());
        let at = |dx: u32, dy: u32| f64::from(sheet.get_pixel(x as u32 + dx, y as u32 + dy)[0]);
        let line = |dy: u32| (1.0 - a) * at(0, dy) + a * at(1, dy);
        30.0 + 0.75 * ((1.0 - b) * line(0) + b * line(1))
    };
    let pixel = |k: usize| {
        let (x, y) = (k % width as usize, k / width as usize);
        let offset = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
        let all = (0..SAMPLES * SAMPLES).map(|s| light(x as f64 + offset(s % SAMPLES), y as f64 + offset(s / SAMPLES)));
        (all.sum::<f64>() / (SAMPLES * SAMPLES) as f64).round() as u8
    };
    let pixels: Vec<u8> = (0..(width * height) as usize).into_par_iter().map(pixel).collect();
    GrayImage::from_raw(width, height, pixels).unwrap()
}

fn lens() -> Camera {
    Camera { fy: 519.0, cx: 322.5, cy: 236.0, k1: -0.15, k2: 0.05, ..Camera::centred(SIZE[0], SIZE[1], 520.0) }
}

/// Where the sheet, `size` metres, is before the camera in the k-th photograph.
fn pose(k: usize, size: Vec2) -> Transform {
    let turn = k as f64 * 2.4;
    let rotation =
        Rotation3::new(Vec3::new(turn.cos(), turn.sin(), 0.0) * 0.5) * Rotation3::new(Vec3::z() * (0.1 * turn.sin()));
    let place = Vec3::new(0.02 * (1.7 * turn).cos(), 0.015 * (2.9 * turn).sin(), 0.42);
    Transform::new(rotation, place - rotation * Vec3::new(size.x / 2.0, size.y / 2.0, 0.0))
}

/// Prints a board, photographs it `count` times by each camera, which are `camera_from_first` of each other, into folders of
/// their names.
fn photographs(folder: &TempDir, board: &[&str], count: usize, cameras: &[(&str, Transform)]) {
    let file = folder.path().join("board.png");
    let file = file.to_str().unwrap();
    succeed(&[&["board", "--dpi", "200", "-o", file], board].concat());
    let sheet = image::open(file).unwrap().to_luma8();
    let size = Vec2::new(f64::from(sheet.width()), f64::from(sheet.height())) / PRINT;
    for (name, camera_from_first) in cameras {
        std::fs::create_dir(folder.path().join(name)).unwrap();
        for k in 0..count {
            let seen = photograph(&sheet, |pixel| lens().ray(pixel), &(*camera_from_first * pose(k, size)));
            seen.save(folder.path().join(name).join(format!("photo_{k:02}.png"))).unwrap();
        }
    }
}

fn assert_near(camera: &Value, percent: f64) {
    for (name, truth) in [("fx", lens().fx), ("fy", lens().fy)] {
        let error = 100.0 * (camera[name].as_f64().unwrap() / truth - 1.0).abs();
        assert!(error < percent, "{name}: {error} %");
    }
}

#[test]
fn the_printed_board_calibrates_the_camera_that_photographs_it() {
    for (board, percent) in [
        (&["--inner", "9x6"][..], 0.05),
        (&["--inner", "8x6", "--square-mm", "22"], 0.05),
        (&["--squares", "4x3", "--square-mm", "28", "--gap-mm", "20"], 0.2),
    ] {
        let folder = tempfile::tempdir().unwrap();
        photographs(&folder, board, 9, &[("photos", Transform::identity())]);
        let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let (photos, camera, picture) = (at("photos"), at("camera.json"), at("report.svg"));
        let calibrated = facewright(&[&["calibrate", &photos, "-o", &camera, "--picture", &picture], board].concat());
        let said = String::from_utf8_lossy(&calibrated.stderr);
        assert!(calibrated.status.success() && !said.contains("the lens") && !said.contains("bulges"), "{said}");
        let found = read(Path::new(&camera));
        assert_near(&found, percent);
        let images = found["images"].as_array().unwrap();
        assert!(images.len() == 9 && images.iter().all(|image| image["used"] == true), "{board:?}");
        assert!(found["rms_px"].as_f64().unwrap() < 0.1, "{board:?}: {}", found["rms_px"]);
        assert!(std::fs::read_to_string(picture).unwrap().contains("9 of 9 pictures"));
    }
}

/// A fisheye: a pixel's distance from the middle is the angle to the axis, 300 px a radian.
fn fisheye(pixel: &Vec2) -> Vec3 {
    let outwards = pixel - Vec2::new(319.5, 239.5);
    let angle = outwards.norm() / 300.0;
    let side = outwards.normalize() * angle.sin();
    Vec3::new(side.x, side.y, angle.cos())
}

#[test]
fn photographs_of_a_fisheye_are_said_to_be_such_and_their_board_not_to_be_bent() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    succeed(&["board", "--dpi", "200", "-o", &at("board.png")]);
    let sheet = image::open(at("board.png")).unwrap().to_luma8();
    let size = Vec2::new(f64::from(sheet.width()), f64::from(sheet.height())) / PRINT;
    std::fs::create_dir(at("photos")).unwrap();
    for k in 0..9 {
        let mut pose = pose(k, size);
        pose.translation += Vec3::new([-0.16, 0.0, 0.16][k % 3], [-0.09, 0.0, 0.09][k / 3], -0.14);
        photograph(&sheet, fisheye, &pose).save(at(&format!("photos/photo_{k}.png"))).unwrap();
    }
    let calibrated = facewright(&["calibrate", &at("photos"), "-o", &at("camera.json")]);
    let said = String::from_utf8_lossy(&calibrated.stderr);
    assert!(calibrated.status.success(), "{said}");
    assert!(said.contains("the lens does not follow the model") && !said.contains("bulges"), "{said}");
}

#[test]
fn of_several_sizes_the_one_shown_is_used() {
    let folder = tempfile::tempdir().unwrap();
    let camera = folder.path().join("camera.json");
    let boards = clip().join("board");
    succeed(&["calibrate", boards.to_str().unwrap(), "--inner", "8x5,9x6,12x13", "-o", camera.to_str().unwrap()]);
    let images = read(&camera)["images"].as_array().unwrap().clone();
    assert!(images.iter().all(|image| image["board"] == 1 && image["corners"].as_array().unwrap().len() == 54));
}

#[test]
fn two_cameras_are_placed_by_a_board_that_looks_the_same_after_half_a_turn() {
    let beside = Transform::new(Rotation3::from_euler_angles(0.0, 0.1, 0.02), Vec3::new(-0.08, 0.004, 0.003));
    let cameras = [("left", Transform::identity()), ("right", beside)];
    for mark in [&[][..], &["--no-mark"]] {
        let folder = tempfile::tempdir().unwrap();
        let board = ["--inner", "8x6", "--square-mm", "20"];
        photographs(&folder, &[&board[..], mark].concat(), 8, &cameras);
        // One camera missed two moments.
        for k in [2, 5] {
            std::fs::remove_file(folder.path().join(format!("right/photo_{k:02}.png"))).unwrap();
        }
        let [left, right] = ["left", "right"].map(|name| format!("{name}={}", folder.path().join(name).display()));
        let rig = folder.path().join("rig.json");
        succeed(&[&["calibrate", "--rig", &left, &right, "-o", rig.to_str().unwrap()], &board[..]].concat());
        let found = read(&rig);
        let second = &found["cameras"][1];
        assert_near(second, 0.1);
        let placed: Transform = serde_json::from_value(second["camera_from_rig"].clone()).unwrap();
        let off = placed * beside.inverse();
        assert!(off.rotation.angle() < 1e-3 && off.translation.norm() < 1e-4, "{off:?}");
        let deviation = second["baseline_deviation"].as_f64().unwrap();
        let baseline = second["baseline"].as_f64().unwrap();
        assert!(
            (baseline - beside.inverse().translation.norm()).abs() < 4.0 * deviation + 2e-5,
            "{baseline} ± {deviation}"
        );
        assert_eq!(second["images"].as_array().unwrap().iter().filter(|image| image["used"] == true).count(), 6);
    }
}

#[test]
fn cameras_of_a_rig_need_pictures_of_the_same_moments() {
    let folder = tempfile::tempdir().unwrap();
    let boards = clip().join("board");
    let all = format!("a={}", boards.display());
    let one = format!("b={}", boards.join("board_0.png").display());
    let output = folder.path().join("rig.json");
    let refused = facewright(&["calibrate", "--rig", &all, &one, "-o", output.to_str().unwrap()]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.lines().count() == 1 && !output.exists(), "{said}");
}

#[test]
fn pictures_without_distortion_come_with_their_camera() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (boards, camera, straight) = (clip().join("board"), at("camera.json"), at("straight"));
    let boards = boards.to_str().unwrap();
    succeed(&["calibrate", boards, "-o", &camera]);
    succeed(&["undistort", boards, "--camera", &camera, "--keep", "all-pixels", "-o", &straight]);
    // The pinhole camera calibrates itself from its pictures.
    succeed(&["calibrate", &straight, "-o", &at("again.json"), "--distortion-terms", "0"]);
    let (pinhole, again) = (read(Path::new(&at("straight/camera.json"))), read(Path::new(&at("again.json"))));
    assert_eq!(pinhole["k1"], 0.0);
    for name in ["fx", "fy"] {
        let ratio = again[name].as_f64().unwrap() / pinhole[name].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 2e-3, "{name}: {ratio}");
    }
}
