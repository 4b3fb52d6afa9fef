//! What was filmed is never overwritten, and what is written has names of its own.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{clip, program};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// Two folders of frames with equal names, and a camera.
fn frames() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for side in ["left", "right"] {
        fs::create_dir(folder.path().join(side)).unwrap();
        for name in ["frame_00", "frame_01"] {
            let to = folder.path().join(side).join(format!("{name}.png"));
            image::open(clip().join(format!("frames/{name}.jpg"))).unwrap().save(to).unwrap();
        }
    }
    let numbers = r#"{"width": 400, "height": 300, "fx": 500, "fy": 500, "cx": 199.5, "cy": 149.5, "k1": -0.1}"#;
    fs::write(folder.path().join("camera.json"), numbers).unwrap();
    folder
}

fn undistort(frames: &[PathBuf], camera: &Path, output: &Path) -> Output {
    let mut command = Command::new(program().unwrap());
    command.args(["undistort", "-q"]).args(frames).arg("--camera").arg(camera).arg("-o").arg(output);
    command.output().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn equal_names_of_two_folders_become_distinct_ones() {
    let folder = frames();
    let at = |name: &str| folder.path().join(name);
    let said = undistort(&[at("left"), at("right")], &at("camera.json"), &at("out"));
    assert!(said.status.success(), "{said:?}");
    let expected =
        ["camera.json", "left_frame_00.png", "left_frame_01.png", "right_frame_00.png", "right_frame_01.png"];
    assert_eq!(names(&at("out")), expected);
}

#[test]
fn pictures_and_cameras_are_not_overwritten_by_what_is_made_of_them() {
    let folder = frames();
    let at = |name: &str| folder.path().join(name);
    let before = fs::read(at("left/frame_00.png")).unwrap();
    let camera = fs::read(at("camera.json")).unwrap();
    for (frames, output) in
        [(at("left"), at("left")), (at("left/frame_00.png"), at("right/../left")), (at("left"), at(""))]
    {
        let said = undistort(&[frames], &at("camera.json"), &output);
        let sentence = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(1), "{sentence}");
        assert!(sentence.contains("originals themselves, which are never overwritten"), "{sentence}");
    }
    assert_eq!(names(&at("left")), ["frame_00.png", "frame_01.png"]);
    assert_eq!((fs::read(at("left/frame_00.png")).unwrap(), fs::read(at("camera.json")).unwrap()), (before, camera));
}
