//! The program as people run it: as a user to whom only their home belongs, and on volumes of their own.

#![cfg(target_os = "linux")]
#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "the helpers of tests are tests too, and what is skipped is said"
)]

use end_to_end::{assets, clip, program};
use std::fs;
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::Path;
use std::process::{Command, Output};

/// Nobody in particular.
const USER: u32 = 65534;

/// Whether a command can be run here, as another user or in a name space of its own; says so where it cannot.
fn can(command: &mut Command) -> bool {
    let can = command.output().is_ok_and(|output| output.status.success());
    if !can {
        println!("skipped: {command:?} is not possible here");
    }
    can
}

/// The program, to be run by the other user.
fn by_the_user(program: &Path) -> Command {
    let mut command = Command::new("setpriv");
    command.args(["--reuid", "65534", "--regid", "65534", "--clear-groups"]).arg(program);
    command
}

/// The program where every user may run it.
fn copied(folder: &Path) -> std::path::PathBuf {
    let copy = folder.join("facewright");
    // By another process: a file that this one still had open for a test's child could not be run.
    assert!(Command::new("cp").arg(program().unwrap()).arg(&copy).status().unwrap().success());
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
    copy
}

fn board(command: &mut Command, output: &Path) -> Output {
    command.args(["board", "--inner", "9x6", "--square-mm", "25", "-q", "-o"]).arg(output).output().unwrap()
}

#[test]
fn a_user_writes_into_their_home_and_is_told_where_they_may_not() {
    let folder = tempfile::tempdir().unwrap();
    let (program, home) = (copied(folder.path()), folder.path().join("home"));
    if !can(by_the_user(&program).arg("--version")) {
        return;
    }
    fs::create_dir(&home).unwrap();
    chown(&home, Some(USER), Some(USER)).unwrap();
    let write = |output: &Path| board(&mut by_the_user(&program), output);
    for output in ["board.png", "new/folder/board.png"] {
        let output = home.join(output);
        let said = write(&output);
        assert!(said.status.success() && output.is_file(), "{said:?}");
    }
    let said = write(&folder.path().join("board.png"));
    let sentence = String::from_utf8(said.stderr).unwrap();
    assert!(!said.status.success() && sentence.contains("Permission denied"), "{sentence}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "the program and the home");
}

/// A folder with all that is in it, where every user may read it.
fn copied_folder(from: &Path, to: &Path) {
    assert!(Command::new("cp").arg("-rL").arg(from).arg(to).status().unwrap().success());
    assert!(Command::new("chmod").args(["-R", "a+rX"]).arg(to).status().unwrap().success());
}

#[test]
fn every_command_writes_into_a_home_and_reconstruct_into_the_home_itself() {
    let folder = tempfile::tempdir().unwrap();
    let (program, at) = (copied(folder.path()), |name: &str| folder.path().join(name));
    if !can(by_the_user(&program).arg("--version")) {
        return;
    }
    copied_folder(&assets().unwrap(), &at("assets"));
    copied_folder(&clip(), &at("clip"));
    fs::create_dir(at("home")).unwrap();
    chown(at("home"), Some(USER), Some(USER)).unwrap();
    let run = |command: &[&str], input: &str, output: &str, made: &str| {
        let mut line = by_the_user(&program);
        line.arg("-q").arg("--assets").arg(at("assets")).args(command).arg(at("clip").join(input));
        let said = line.arg("-o").arg(at("home").join(output)).env("TMPDIR", "/tmp").output().unwrap();
        assert!(said.status.success() && at("home").join(made).is_file(), "{command:?}: {said:?}");
    };
    let camera = at("home/camera.json").display().to_string();
    run(&["calibrate"], "board", "camera.json", "camera.json");
    run(&["undistort", "--camera", &camera], "frames", "straight", "straight/frame_00.png");
    run(&["track", "--camera", &camera], "frames", "tracks.json", "tracks.json");
    run(&["reconstruct", "--camera", &camera, "--texture-size", "64"], "frames", "", "head.glb");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4, "program, assets, clip and home");
    let staged =
        fs::read_dir(at("home")).unwrap().filter(|e| e.as_ref().unwrap().file_name().as_encoded_bytes()[0] == b'.');
    assert_eq!(staged.count(), 0, "nothing staged is left");
}

#[test]
fn a_full_temporary_folder_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let (program, volume) = (copied(folder.path()), folder.path().join("tmp"));
    fs::create_dir(&volume).unwrap();
    let film = folder.path().join("film.mkv");
    let source = "testsrc2=s=1280x720:r=10:d=3";
    let mut make = Command::new("ffmpeg");
    make.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", source, "-c:v", "mpeg4"]).arg(&film);
    if !can(Command::new("unshare").args(["--mount", "mount", "-t", "tmpfs", "none", "/mnt"])) || !can(&mut make) {
        return;
    }
    let script = "mount -t tmpfs -o size=2m none \"$1\" && TMPDIR=\"$1\" \"$2\" calibrate \"$3\" -q -o \"$3.json\"; rc=$?; \
        ls -A \"$1\"; exit $rc";
    let mut command = Command::new("unshare");
    command.args(["--mount", "sh", "-c", script, "sh"]).arg(&volume).arg(&program).arg(&film);
    let said = command.output().unwrap();
    let sentence = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.code() == Some(1) && said.stdout.is_empty(), "{said:?}");
    assert!(sentence.contains("do not fit into the temporary folder") && sentence.contains("set TMPDIR"), "{sentence}");
    assert_eq!(sentence.trim_end().lines().count(), 1, "{sentence}");
}

#[test]
fn undistorted_pictures_that_find_no_room_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (program, volume) = (copied(folder.path()), folder.path().join("out"));
    fs::create_dir(&volume).unwrap();
    if !can(Command::new("unshare").args(["--mount", "mount", "-t", "tmpfs", "none", "/mnt"])) {
        return;
    }
    let camera = folder.path().join("camera.json");
    let numbers = r#"{"width": 400, "height": 300, "fx": 500, "fy": 500, "cx": 199.5, "cy": 149.5, "k1": -0.1}"#;
    fs::write(&camera, numbers).unwrap();
    let script = "mount -t tmpfs -o size=500k none \"$1\" && \"$2\" undistort \"$3\" --camera \"$4\" -q -o \"$1/new\"; rc=$?; \
        ls -A \"$1\"; exit $rc";
    let mut command = Command::new("unshare");
    command.args(["--mount", "sh", "-c", script, "sh"]).arg(&volume).arg(&program);
    let said = command.arg(clip().join("frames")).arg(&camera).output().unwrap();
    assert!(said.status.code() == Some(1) && said.stdout.is_empty(), "{said:?}");
    assert!(String::from_utf8_lossy(&said.stderr).contains("No space left"), "{said:?}");
}

#[test]
fn the_root_of_a_volume_is_written_to_and_a_read_only_one_is_named() {
    if !can(Command::new("unshare").args(["--mount", "mount", "-t", "tmpfs", "none", "/mnt"])) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (program, volume) = (copied(folder.path()), folder.path().join("volume"));
    fs::create_dir(&volume).unwrap();
    let run = |options: &str| {
        let script = "mount -t tmpfs -o \"$1\" none \"$2\" && \"$3\" board --inner 9x6 --square-mm 25 -q -o \"$2/board.png\" >/dev/null; \
            rc=$?; ls -A \"$2\"; exit $rc";
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-c", script, "sh", options]).arg(&volume).arg(&program).output().unwrap()
    };
    let written = run("size=4m");
    assert_eq!(String::from_utf8_lossy(&written.stdout), "board.png\n", "{written:?}");
    let refused = run("ro");
    let sentence = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && sentence.contains("Read-only file system"), "{sentence}");
    let full = run("size=8k");
    assert!(!full.status.success() && full.stdout.is_empty(), "{full:?}");
    assert!(String::from_utf8_lossy(&full.stderr).contains("No space left"), "{full:?}");
}
