//! Videos, decoded by ffmpeg into pictures.

use super::picture::unreadable;
use crate::FacewrightError;
use geometry::{Cancelled, Progress};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tempfile::TempDir;

/// How a film's own frames are asked for, none dropped and none repeated: since ffmpeg 5.1, and before.
const EACH_FRAME: [&str; 2] = ["-fps_mode", "-vsync"];
/// Square pixels: what others mean is said beside the picture.
const SQUARE: &str = "scale=round(iw*sar):ih,setsar=1";
/// How often it is looked whether ffmpeg is done, or is to stop.
const LOOK: Duration = Duration::from_millis(20);

/// The frames of a video as PNG in a folder that lasts as long as it is held, numbered from `first` on. The folder is gone, and
/// ffmpeg ended, where the work is cancelled.
pub(super) fn decode(video: &Path, first: usize, progress: &Progress) -> Result<TempDir, FacewrightError> {
    if !video.is_file() {
        return Err(unreadable(video, &"there is no such file"));
    }
    let folder = tempfile::tempdir().map_err(|e| no_temporary(&e.to_string()))?;
    let mut end = run(&mut ffmpeg(video, first, EACH_FRAME[0], &folder), video, progress)?;
    if !end.status.success() && end.complaints.contains(&EACH_FRAME[0][1..]) {
        end = run(&mut ffmpeg(video, first, EACH_FRAME[1], &folder), video, progress)?;
    }
    if end.complaints.contains(FULL) {
        return Err(FacewrightError::TemporaryFull {
            path: video.to_owned(),
            folder: std::env::temp_dir(),
            variable: VARIABLE,
        });
    }
    if end.status.success() { Ok(folder) } else { Err(unreadable(video, &end.complaints.trim())) }
}

/// What ffmpeg says of a volume without room, whatever the system's language.
const FULL: &str = "No space left on device";
/// What tells programs another temporary folder.
const VARIABLE: &str = if cfg!(windows) { "TEMP" } else { "TMPDIR" };

fn no_temporary(reason: &str) -> FacewrightError {
    FacewrightError::NoTemporary { folder: std::env::temp_dir(), reason: reason.to_owned(), variable: VARIABLE }
}

fn ffmpeg(video: &Path, first: usize, each_frame: &str, folder: &TempDir) -> Command {
    // A colon in the name is not a protocol.
    let mut file = OsString::from("file:");
    file.push(video);
    let mut command = Command::new("ffmpeg");
    // The film's duration is a piece of information, and each line tells of what kind it is.
    command.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "level+info", "-progress", "pipe:1", "-i"]);
    command.arg(file).args(["-vf", SQUARE, each_frame, "passthrough", "-start_number"]).arg(first.to_string());
    command.arg(folder.path().join("frame_%06d.png"));
    command
}

/// How ffmpeg ended.
struct End {
    status: ExitStatus,
    /// Its errors, a line each.
    complaints: String,
}

/// Runs ffmpeg to its end, or ends it.
fn run(command: &mut Command, video: &Path, progress: &Progress) -> Result<End, FacewrightError> {
    // Ctrl-C in a terminal goes to a whole group: it is for us to say what was cancelled.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => FacewrightError::NoFfmpeg { path: video.to_owned() },
        _ => unreadable(video, &e),
    })?;
    let (told, said) = (child.stdout.take(), child.stderr.take());
    let (length_us, done_us) = (AtomicU64::new(0), AtomicU64::new(0));
    std::thread::scope(|scope| {
        let listening = scope.spawn(|| said.map_or_else(String::new, |said| complaints(said, &length_us)));
        scope.spawn(|| told.map_or((), |told| follow(told, &done_us)));
        let status = wait(&mut child, || {
            let [done, length] = [&done_us, &length_us].map(|us| us.load(Ordering::Relaxed) as usize);
            // A film that does not tell its length is nowhere until its end.
            progress.step(if length == 0 { 0 } else { done }, length)
        });
        let complaints = listening.join().unwrap_or_default();
        status.and_then(|status| Ok(End { status: status.map_err(|e| unreadable(video, &e))?, complaints }))
    })
}

/// Waits for a child as long as it may go on; then it is ended.
fn wait(
    child: &mut Child,
    may_go_on: impl Fn() -> Result<(), Cancelled>,
) -> Result<std::io::Result<ExitStatus>, FacewrightError> {
    loop {
        if let Err(cancelled) = may_go_on() {
            // One that has ended by itself needs no end; waiting leaves nothing of it.
            let _ = child.kill();
            let _ = child.wait();
            return Err(cancelled.into());
        }
        match child.try_wait() {
            Ok(Some(status)) => return may_go_on().map(|()| Ok(status)).map_err(Into::into),
            Ok(None) => std::thread::sleep(LOOK),
            Err(error) => return Ok(Err(error)),
        }
    }
}

/// The errors among what ffmpeg says, as it ends; on the way the length of the film.
fn complaints(said: impl Read, length_us: &AtomicU64) -> String {
    let mut complaints = String::new();
    for line in BufReader::new(said).split(b'\n').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line);
        if let Some((_, error)) = line.split_once("[error] ").or_else(|| line.split_once("[fatal] ")) {
            complaints = complaints + error.trim_end() + "\n";
        } else if let Some((_, rest)) = line.split_once("Duration: ") {
            let length = rest.split([',', ' ']).next().and_then(microseconds);
            length.into_iter().for_each(|length| length_us.store(length, Ordering::Relaxed));
        }
    }
    complaints
}

/// How far ffmpeg is, as it says it.
fn follow(told: impl Read, done_us: &AtomicU64) {
    for line in BufReader::new(told).lines().map_while(Result::ok) {
        let done = line.strip_prefix("out_time=").and_then(microseconds);
        done.into_iter().for_each(|done| done_us.store(done, Ordering::Relaxed));
    }
}

/// A time as ffmpeg writes it, `00:01:02.50`.
fn microseconds(text: &str) -> Option<u64> {
    let seconds = text.trim().split(':').try_fold(0.0, |sum: f64, part| Some(60.0 * sum + part.parse::<f64>().ok()?));
    seconds.filter(|seconds| *seconds >= 0.0).map(|seconds| (seconds * 1e6) as u64)
}

#[cfg(test)]
mod tests {
    use super::super::FrameSet;
    use super::*;

    /// A film of five grey frames of 64×48, or nothing where there is no ffmpeg.
    fn film(path: &Path, aspect: &str) -> Option<()> {
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "color=gray:s=64x48:r=5:d=1"]);
        let mut file = OsString::from("file:");
        file.push(path);
        let made = command.args(["-vf", &format!("setsar={aspect}"), "-c:v", "mpeg4"]).arg(file).status();
        let made = made.ok().filter(std::process::ExitStatus::success);
        if made.is_none() {
            println!("skipped: there is no ffmpeg here");
        }
        made.map(drop)
    }

    #[test]
    fn pixels_become_square_and_a_colon_is_no_protocol() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take:1.mp4");
        let Some(()) = film(&path, "2/1") else { return };
        let frames = FrameSet::open(&[path], &Progress::new()).unwrap();
        assert_eq!((frames.len(), frames.width, frames.height), (5, 128, 48));
        assert!(frames.load(4).is_ok());
    }

    #[test]
    fn films_of_every_kind_that_cameras_and_phones_write_are_decoded() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("a.mp4");
        let Some(()) = film(&first, "1/1") else { return };
        for (name, codec) in [
            ("a.MTS", "mpeg2video"),
            ("a.m2ts", "mpeg2video"),
            ("a.ts", "mpeg2video"),
            ("a.mpg", "mpeg2video"),
            ("a.wmv", "wmv2"),
            ("a.3gp", "mpeg4"),
            ("a.flv", "flv1"),
            ("a.gif", "gif"),
            ("a.avi", "mjpeg"),
            ("a.MKV", "mpeg4"),
        ] {
            let path = folder.path().join(name);
            let mut command = Command::new("ffmpeg");
            command.args(["-nostdin", "-loglevel", "error", "-i"]).arg(&first).args(["-r", "25", "-c:v", codec]);
            if !command.arg(&path).status().unwrap().success() {
                println!("skipped: this ffmpeg writes no {name}");
                continue;
            }
            let frames = FrameSet::open(&[path], &Progress::new()).unwrap();
            assert!((frames.width, frames.height) == (64, 48) && frames.len() >= 5, "{name}: {}", frames.len());
        }
    }

    #[test]
    fn decoding_moves_the_bar_and_stops_when_it_is_cancelled() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.mp4");
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "testsrc2=s=640x360:r=50:d=12"]);
        let made =
            command.args(["-c:v", "mpeg4", "-q:v", "31"]).arg(&path).status().is_ok_and(|status| status.success());
        if !made {
            println!("skipped: there is no ffmpeg here");
            return;
        }
        let progress = Progress::new();
        std::thread::scope(|scope| {
            let decoding = scope.spawn(|| decode(&path, 0, &progress));
            while progress.snapshot().fraction < 0.02 {
                assert!(!decoding.is_finished(), "it ended before the bar moved");
                std::thread::sleep(LOOK);
            }
            assert!(progress.snapshot().fraction < 0.9, "the bar leapt");
            progress.cancel();
            let outcome = decoding.join().unwrap();
            assert!(matches!(outcome, Err(FacewrightError::Cancelled(_))), "{outcome:?}");
        });
    }

    #[test]
    fn what_ffmpeg_says_is_told_apart() {
        let length = AtomicU64::new(0);
        let said = b"Input #0, avi, from 'a':\n[info]   Duration: 00:01:02.50, start: 0.000000\n[mpeg4 @ 0x5] [error] header damaged\n";
        assert_eq!(complaints(&said[..], &length), "header damaged\n");
        assert_eq!(length.load(Ordering::Relaxed), 62_500_000);
        assert_eq!(complaints(&b"[info]   Duration: N/A, start: 0\n"[..], &length), "");
        assert_eq!(length.load(Ordering::Relaxed), 62_500_000);
        follow(&b"frame=3\nout_time=00:00:01.000000\nout_time=N/A\n"[..], &length);
        assert_eq!(length.load(Ordering::Relaxed), 1_000_000);
    }

    #[test]
    fn two_videos_follow_one_another() {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["a.mp4", "b.mov"].map(|name| folder.path().join(name));
        for path in &paths {
            let Some(()) = film(path, "1/1") else { return };
        }
        let frames = FrameSet::open(&paths, &Progress::new()).unwrap();
        let names: Vec<&str> = frames.frames.iter().map(|frame| frame.name.as_str()).collect();
        assert_eq!((names.len(), names[4], names[5], names[9]), (10, "frame_000004", "frame_000005", "frame_000009"));
        assert!((0..10).all(|i| frames.load(i).is_ok()));
    }
}
