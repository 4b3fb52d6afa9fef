//! How many frames a film holds, told by its file alone: nothing is decoded.

use super::picture::unreadable;
use super::video::{apart, file_argument, not_started};
use crate::FacewrightError;
use std::path::Path;
use std::process::{Command, Stdio};

/// Counts the packets of a film's pictures.
///
/// # Errors
/// [`FacewrightError::NoFfmpeg`]; [`FacewrightError::Read`] for what is no video.
pub(crate) fn film_length(video: &Path) -> Result<usize, FacewrightError> {
    if !video.is_file() {
        return Err(unreadable(video, &"there is no such file"));
    }
    let mut command = Command::new("ffmpeg");
    command.args(["-nostdin", "-hide_banner", "-loglevel", "error", "-i"]).arg(file_argument(video));
    command.args(["-map", "0:v:0", "-c", "copy", "-progress", "pipe:1", "-f", "null", "-"]).stdin(Stdio::null());
    apart(&mut command);
    let told = command.output().map_err(|e| not_started(video, &e))?;
    if !told.status.success() {
        return Err(unreadable(video, &String::from_utf8_lossy(&told.stderr).trim()));
    }
    counted(&String::from_utf8_lossy(&told.stdout)).ok_or_else(|| unreadable(video, &"it holds no picture"))
}

/// The last count that ffmpeg tells.
fn counted(told: &str) -> Option<usize> {
    let mut counts = told.lines().filter_map(|line| line.strip_prefix("frame=")?.trim().parse().ok());
    counts.next_back().filter(|&count| count > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_count_is_the_length() {
        assert_eq!(counted("frame=12\nfps=0.0\nframe= 1337\nprogress=end\n"), Some(1337));
        assert_eq!((counted("frame=0\nprogress=end\n"), counted("")), (None, None));
    }

    #[test]
    fn a_film_has_as_many_frames_as_were_written_and_a_text_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take:1.mp4");
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "color=gray:s=64x48:r=30:d=3"]);
        let made = command.args(["-c:v", "mpeg4"]).arg(file_argument(&path)).status();
        if !made.is_ok_and(|status| status.success()) {
            println!("skipped: there is no ffmpeg here");
            return;
        }
        assert_eq!(film_length(&path).unwrap(), 90);
        let text = folder.path().join("text.mp4");
        std::fs::write(&text, b"no film").unwrap();
        let said = film_length(&text).unwrap_err().to_string();
        assert!(said.contains("text.mp4 cannot be read"), "{said}");
    }
}
