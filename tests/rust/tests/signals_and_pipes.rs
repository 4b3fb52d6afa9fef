//! The program in a shell: signals end it at once and leave nothing, what it prints may find no reader, and the ffmpeg that it finds may be
//! of any age.

#![cfg(unix)]
#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "the helpers of tests are tests too, and what is skipped is said"
)]

use end_to_end::{clip, program};
use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Long enough for a busy machine to end a program, and far from what the film takes.
const AT_ONCE: Duration = Duration::from_secs(5);

/// A film that takes far more than a moment to be decoded, or nothing where there is no ffmpeg.
fn long_film(path: &Path) -> Option<()> {
    let source = "testsrc2=s=1280x720:r=30:d=30";
    let mut make = Command::new("ffmpeg");
    make.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", source, "-c:v", "mpeg4", "-q:v", "31"]);
    let made = make.arg(path).status().is_ok_and(|status| status.success());
    if !made {
        println!("skipped: there is no ffmpeg here");
    }
    made.then_some(())
}

/// Whether an ffmpeg runs whose arguments name a path.
fn is_at_work_on(path: &Path) -> bool {
    let list = Command::new("ps").args(["-eo", "args"]).output().unwrap();
    String::from_utf8_lossy(&list.stdout)
        .lines()
        .any(|line| line.contains("ffmpeg") && line.contains(path.to_str().unwrap()))
}

#[test]
fn a_signal_while_a_video_is_decoded_ends_it_at_once_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (film, temporary) = (folder.path().join("film.mp4"), folder.path().join("tmp"));
    let Some(()) = long_film(&film) else { return };
    fs::create_dir(&temporary).unwrap();
    for signal in ["-INT", "-TERM"] {
        let mut command = Command::new(program().unwrap());
        command.args(["calibrate", "-q"]).arg(&film).arg("-o").arg(folder.path().join("camera.json"));
        let mut child = command.env("TMPDIR", &temporary).stderr(Stdio::piped()).spawn().unwrap();
        while !is_at_work_on(&film) {
            assert!(child.try_wait().unwrap().is_none(), "it ended before a film was decoded");
            std::thread::sleep(Duration::from_millis(20));
        }
        let asked = Instant::now();
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let said = child.wait_with_output().unwrap();
        assert!(asked.elapsed() < AT_ONCE, "{signal} took {:?}", asked.elapsed());
        assert_eq!(String::from_utf8_lossy(&said.stderr), "facewright: cancelled\n");
        assert_eq!(said.status.code(), Some(1));
        assert_eq!(fs::read_dir(&temporary).unwrap().count(), 0, "frames were left");
        assert!(!is_at_work_on(&film), "ffmpeg was left");
    }
    assert!(!folder.path().join("camera.json").exists());
}

/// Writes the boards one after the other into a file, as ffmpeg writes pictures into a pipe.
fn boards_in_one(file: &Path) {
    let mut all = Vec::new();
    let mut boards: Vec<_> = fs::read_dir(clip().join("board")).unwrap().map(|entry| entry.unwrap().path()).collect();
    boards.sort();
    for board in boards.iter().filter(|path| path.extension().is_some_and(|e| e == "png")) {
        let picture = image::open(board).unwrap().into_rgb8();
        all.extend(format!("P6\n{} {}\n255\n", picture.width(), picture.height()).into_bytes());
        all.extend(picture.into_raw());
    }
    fs::write(file, all).unwrap();
}

/// An ffmpeg that knows one of the options that ask for each frame, and complains of others as ffmpeg does; its films show the boards.
fn ffmpeg_that_knows(option: &str, folder: &Path) {
    let boards = folder.join("boards");
    boards_in_one(&boards);
    let script = format!(
        r#"#!/bin/sh
for word in "$@"; do
    case "$word" in
    {option}) known=yes ;;
    -fps_mode | -vsync) echo "[error] Unrecognized option '${{word#-}}'." >&2; exit 1 ;;
    esac
done
test "$known" || exit 1
exec /bin/cat '{boards}'
"#,
        boards = boards.display()
    );
    let [text, path] = ["text", "ffmpeg"].map(|name| folder.join(name));
    fs::write(&text, script).unwrap();
    fs::set_permissions(&text, fs::Permissions::from_mode(0o755)).unwrap();
    // By another process: a file that this one still had open for a test's child could not be run.
    assert!(Command::new("cp").args([&text, &path]).status().unwrap().success());
}

#[test]
fn an_ffmpeg_before_and_after_the_change_of_its_option_is_asked_for_each_frame() {
    let folder = tempfile::tempdir().unwrap();
    let film = folder.path().join("film.mp4");
    fs::write(&film, "not looked at").unwrap();
    // As of ffmpeg 4, of 5.1 to 7, and of none.
    for (option, calibrates) in [("-vsync", true), ("-fps_mode", true), ("-neither", false)] {
        ffmpeg_that_knows(option, folder.path());
        let mut command = Command::new(program().unwrap());
        command.args(["calibrate", "-q", "--json"]).arg(&film).arg("-o").arg(folder.path().join("camera.json"));
        let said = command.env("PATH", folder.path()).output().unwrap();
        let sentence = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.success(), calibrates, "{option}: {sentence}");
        assert!(calibrates || sentence.contains("film.mp4 cannot be read"), "{option}: {sentence}");
    }
}

#[test]
fn a_relative_path_with_a_colon_is_no_protocol() {
    let folder = tempfile::tempdir().unwrap();
    let mut make = Command::new("ffmpeg");
    make.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "color=gray:s=64x48:r=5:d=1", "-c:v", "mpeg4"]);
    if !make.arg(folder.path().join("film.mp4")).status().is_ok_and(|status| status.success()) {
        println!("skipped: there is no ffmpeg here");
        return;
    }
    for name in ["take:1.mp4", "12:30.mp4"] {
        fs::copy(folder.path().join("film.mp4"), folder.path().join(name)).unwrap();
        let mut command = Command::new(program().unwrap());
        let said = command.args(["calibrate", "-q", name, "-o", "camera.json"]).current_dir(&folder).output().unwrap();
        let sentence = String::from_utf8_lossy(&said.stderr);
        assert!(sentence.contains("the board was found in 0 of 5 pictures"), "{sentence}");
    }
}

/// Commands that print, as they are and as JSON.
fn printing(folder: &Path) -> Vec<Vec<String>> {
    let board = folder.join("board.svg").display().to_string();
    let camera = folder.join("camera.json").display().to_string();
    let boards = clip().join("board").display().to_string();
    let commands: [&[&str]; 5] = [
        &["board", "-q", "-o", &board],
        &["board", "-q", "--json", "-o", &board],
        &["calibrate", "-q", "--json", &boards, "-o", &camera],
        &["--help"],
        &["--version"],
    ];
    commands.map(|command| command.iter().map(|word| (*word).to_owned()).collect()).into()
}

#[test]
fn a_closed_pipe_ends_what_is_printed_quietly() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in printing(folder.path()) {
        let mut command = Command::new(program().unwrap());
        let command = command.args(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stdout.take());
        let said = child.wait_with_output().unwrap();
        assert!(said.status.success() && said.stderr.is_empty(), "{arguments:?}: {said:?}");
    }
    assert!(folder.path().join("camera.json").exists());
}

#[test]
#[cfg(target_os = "linux")]
fn what_cannot_be_printed_is_one_clear_error() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in printing(folder.path()) {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let said = Command::new(program().unwrap()).args(&arguments).stdout(full).output().unwrap();
        let sentence = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(1), "{arguments:?}: {sentence}");
        assert!(sentence.starts_with("facewright: standard output cannot be written to: No space left"), "{sentence}");
        assert_eq!(sentence.lines().count(), 1, "{sentence}");
    }
}
