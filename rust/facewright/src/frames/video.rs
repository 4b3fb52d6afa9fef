//! Videos, decoded by ffmpeg into pictures.

use super::unreadable;
use crate::FacewrightError;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// How a film's own frames are asked for, none dropped and none repeated: since ffmpeg 5.1, and before.
const EACH_FRAME: [&str; 2] = ["-fps_mode", "-vsync"];
/// Square pixels: what others mean is said beside the picture.
const SQUARE: &str = "scale=round(iw*sar):ih,setsar=1";

/// The frames of a video as PNG in a folder that lasts as long as it is held, numbered from `first` on.
pub(super) fn decode(video: &Path, first: usize) -> Result<TempDir, FacewrightError> {
    if !video.is_file() {
        return Err(unreadable(video, &"there is no such file"));
    }
    let folder = tempfile::tempdir().map_err(|e| unreadable(video, &e))?;
    let mut output = ffmpeg(video, first, EACH_FRAME[0], &folder)?;
    if !output.status.success() && said(&output).contains(&EACH_FRAME[0][1..]) {
        output = ffmpeg(video, first, EACH_FRAME[1], &folder)?;
    }
    if output.status.success() { Ok(folder) } else { Err(unreadable(video, &said(&output).trim())) }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn ffmpeg(video: &Path, first: usize, each_frame: &str, folder: &TempDir) -> Result<Output, FacewrightError> {
    // A colon in the name is not a protocol.
    let mut file = OsString::from("file:");
    file.push(video);
    let mut command = Command::new("ffmpeg");
    command.args(["-nostdin", "-loglevel", "error", "-i"]).arg(file).args(["-vf", SQUARE, each_frame, "passthrough"]);
    command.arg("-start_number").arg(first.to_string()).arg(folder.path().join("frame_%06d.png"));
    command.output().map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => FacewrightError::NoFfmpeg { path: video.to_owned() },
        _ => unreadable(video, &e),
    })
}

#[cfg(test)]
mod tests {
    use super::super::FrameSet;
    use super::*;
    use geometry::Progress;

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
