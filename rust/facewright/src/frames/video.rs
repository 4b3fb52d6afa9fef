//! Videos, decoded by ffmpeg: its pictures come through a pipe, and no file of them is written.

use super::decoded::Decoded;
use super::picture::unreadable;
use crate::FacewrightError;
use geometry::{Cancelled, Progress};
use image::RgbImage;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// How a film's own frames are asked for, none dropped and none repeated: since ffmpeg 5.1, and before.
const EACH_FRAME: [&str; 2] = ["-fps_mode", "-vsync"];
/// Square pixels: what others mean is said beside the picture.
const SQUARE: &str = "scale=round(iw*sar):ih,setsar=1";
/// A frame of each number, as Blender counts them: at the film's usual rate from its first picture on, each the last picture that has
/// begun by then, where a clock that ticks too slowly for the rate is rounded. `fps` alone would take the nearest.
const NUMBERED: &str = "setpts=ceil((PTS-STARTPTS-0.5)*TB*FRAME_RATE)/(TB*FRAME_RATE),fps=source_fps";
/// Lets ffmpeg say each frame that it has decoded, also of those that are not wanted.
const TOLD: &str = "metadata=add:key=decoded:value=1,metadata=print:key=decoded";
/// How often it is looked whether ffmpeg is done, or is to stop.
const LOOK: Duration = Duration::from_millis(20);

/// Which frames of a film are wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wanted<'n> {
    /// Each that the file holds.
    All,
    /// Those of these numbers, ascending and counted from 0 as Blender counts them: a film whose frames do not come at a steady rate is
    /// brought to one.
    Numbers(&'n [usize]),
    /// Every so many of those that the file holds, from the first on.
    Every(usize),
}

impl Wanted<'_> {
    /// What ffmpeg does with the frames.
    fn filters(self) -> String {
        match self {
            Self::All => format!("{TOLD},{SQUARE}"),
            Self::Every(step) => format!("{TOLD},select='not(mod(n,{step}))',{SQUARE}"),
            Self::Numbers(numbers) => {
                format!("{NUMBERED},{TOLD},select='{}',{SQUARE}", any_of(&progressions(numbers)))
            }
        }
    }
}

/// Numbers as ffmpeg's expressions, each of a stretch of them in equal steps.
fn progressions(numbers: &[usize]) -> Vec<String> {
    let (mut stretches, mut rest) = (Vec::new(), numbers);
    while let [first, ..] = rest {
        let step = rest.get(1).map_or(1, |second| second - first);
        let count = 1 + rest.windows(2).take_while(|two| two[1] - two[0] == step).count();
        stretches.push(format!("between(n,{first},{})*not(mod(n-{first},{step}))", rest[count - 1]));
        rest = &rest[count..];
    }
    stretches
}

/// The sum of expressions, of which ffmpeg takes a hundred in one bracket at most.
fn any_of(all: &[String]) -> String {
    match all {
        [] => "0".to_owned(),
        [one] => one.clone(),
        _ => {
            let (first, second) = all.split_at(all.len() / 2);
            format!("({}+{})", any_of(first), any_of(second))
        }
    }
}

/// The frames of a video. ffmpeg has ended, and nothing is left of it, where the work is cancelled.
///
/// Numbers beyond the end of a film show its last frame, as they do in Blender: what a file says of its length may count its sound.
pub(super) fn decode(video: &Path, wanted: Wanted, progress: &Progress) -> Result<Vec<Decoded>, FacewrightError> {
    let mut frames = super::decoded::Writer::new()?;
    let keep = |picture: RgbImage| frames.push(&picture, video).map(ControlFlow::Continue);
    stream(video, wanted, progress, keep)?;
    let mut frames = frames.finish(video)?;
    if let Wanted::Numbers(numbers) = wanted {
        let Some(last) = frames.last().cloned() else {
            let first = numbers.first().copied().unwrap_or_default();
            return Err(unreadable(video, &format!("it ends before frame {first}, counted from 0")));
        };
        frames.resize(numbers.len(), last);
    }
    Ok(frames)
}

/// Width and height of a video's frames, upright and of square pixels.
///
/// # Errors
/// [`FacewrightError::NoFfmpeg`]; [`FacewrightError::Read`] for what is no video.
pub fn video_size(video: &Path, progress: &Progress) -> Result<(u32, u32), FacewrightError> {
    let mut size = None;
    stream(video, Wanted::All, progress, |picture| {
        size = Some(picture.dimensions());
        Ok(ControlFlow::Break(()))
    })?;
    size.ok_or_else(|| unreadable(video, &"it holds no picture"))
}

/// Shows the frames of a video one after the other, until one of them is enough; gives how many were decoded for that, the others among
/// them.
///
/// # Errors
/// [`FacewrightError::NoFfmpeg`]; [`FacewrightError::Read`] for what is no video; [`FacewrightError::Cancelled`]; those of `see`.
pub(crate) fn stream(
    video: &Path,
    wanted: Wanted,
    progress: &Progress,
    mut see: impl FnMut(RgbImage) -> Result<ControlFlow<()>, FacewrightError> + Send,
) -> Result<usize, FacewrightError> {
    if !video.is_file() {
        return Err(unreadable(video, &"there is no such file"));
    }
    let mut run = |each_frame| run(&mut ffmpeg(video, wanted, each_frame), (video, wanted), progress, &mut see);
    let mut end = run(EACH_FRAME[0])?;
    if end.complaints.contains(&EACH_FRAME[0][1..]) && !end.is_good {
        end = run(EACH_FRAME[1])?;
    }
    if end.is_good { Ok(end.decoded) } else { Err(unreadable(video, &end.complaints.trim())) }
}

/// A file as ffmpeg takes it: a colon in the name is not a protocol.
pub(super) fn file_argument(video: &Path) -> OsString {
    let mut file = OsString::from("file:");
    file.push(video);
    file
}

fn ffmpeg(video: &Path, wanted: Wanted, each_frame: &str) -> Command {
    let mut command = Command::new("ffmpeg");
    // The film's duration is a piece of information, and each line tells of what kind it is.
    command.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "level+info", "-i"]).arg(file_argument(video));
    command.args(["-vf", &wanted.filters(), each_frame, "passthrough"]);
    if let Wanted::Numbers(numbers) = wanted {
        command.arg("-frames:v").arg(numbers.len().to_string());
    }
    command.args(["-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "pipe:1"]);
    command
}

/// How ffmpeg ended.
struct End {
    /// By itself and well, or because it was enough.
    is_good: bool,
    /// Its errors, a line each.
    complaints: String,
    /// How many frames were decoded.
    decoded: usize,
}

/// How far ffmpeg is, as it says it.
#[derive(Default)]
struct Told {
    length_us: AtomicU64,
    done_us: AtomicU64,
    frames: AtomicU64,
}

impl Told {
    /// Moves the bar.
    fn step(&self, wanted: Wanted, progress: &Progress) -> Result<(), Cancelled> {
        let [length, done, frames] =
            [&self.length_us, &self.done_us, &self.frames].map(|told| told.load(Ordering::Relaxed) as usize);
        match wanted {
            Wanted::Numbers(numbers) => progress.step(frames, numbers.last().map_or(1, |last| last + 1)),
            // A film that does not tell its length is nowhere until its end.
            Wanted::All | Wanted::Every(_) => progress.step(if length == 0 { 0 } else { done }, length),
        }
    }

    /// The errors among what ffmpeg says, as it ends; on the way the length of the film, and how far it is.
    fn listen(&self, said: impl Read) -> String {
        let mut complaints = String::new();
        for line in BufReader::new(said).split(b'\n').map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line);
            if let Some((_, error)) = line.split_once("[error] ").or_else(|| line.split_once("[fatal] ")) {
                complaints = complaints + error.trim_end() + "\n";
            } else if let Some((_, rest)) = line.split_once("Duration: ") {
                store(&self.length_us, rest.split([',', ' ']).next().and_then(microseconds));
            } else if let Some((_, rest)) = line.split_once("[info] frame:") {
                store(
                    &self.frames,
                    rest.split(' ').next().and_then(|number| number.parse().ok()).map(|number: u64| number + 1),
                );
                store(&self.done_us, rest.split_once("pts_time:").and_then(|(_, time)| microseconds(time)));
            }
        }
        complaints
    }
}

fn store(place: &AtomicU64, value: Option<u64>) {
    value.into_iter().for_each(|value| place.store(value, Ordering::Relaxed));
}

/// A time as ffmpeg writes it, `00:01:02.50` or `62.5`.
fn microseconds(text: &str) -> Option<u64> {
    let seconds = text.trim().split(':').try_fold(0.0, |sum: f64, part| Some(60.0 * sum + part.parse::<f64>().ok()?));
    seconds.filter(|seconds| *seconds >= 0.0).map(|seconds| (seconds * 1e6) as u64)
}

/// Sets a program apart from what started this one.
pub(super) fn apart(command: &mut Command) {
    // Ctrl-C in a terminal goes to a whole group: it is for us to say what was cancelled.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    // Blender is no program of a console, and none is to open for ffmpeg.
    #[cfg(windows)]
    std::os::windows::process::CommandExt::creation_flags(command, 0x0800_0000);
}

/// Why ffmpeg was not started for a video.
pub(super) fn not_started(video: &Path, error: &std::io::Error) -> FacewrightError {
    match error.kind() {
        std::io::ErrorKind::NotFound => FacewrightError::NoFfmpeg { path: video.to_owned() },
        _ => unreadable(video, error),
    }
}

/// Runs ffmpeg to its end, or ends it.
fn run(
    command: &mut Command,
    (video, wanted): (&Path, Wanted),
    progress: &Progress,
    see: &mut (impl FnMut(RgbImage) -> Result<ControlFlow<()>, FacewrightError> + Send),
) -> Result<End, FacewrightError> {
    apart(command);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|e| not_started(video, &e))?;
    let (shown, said) = (child.stdout.take(), child.stderr.take());
    let (told, is_enough) = (Told::default(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let listening = scope.spawn(|| said.map_or_else(String::new, |said| told.listen(said)));
        let seeing = scope.spawn(|| {
            let seen = shown.map_or(Ok(ControlFlow::Continue(())), |shown| pictures(shown, see));
            is_enough.store(!matches!(seen, Ok(ControlFlow::Continue(()))), Ordering::Relaxed);
            seen
        });
        let status = wait(&mut child, &is_enough, || told.step(wanted, progress));
        let complaints = listening.join().unwrap_or_default();
        let seen = seeing.join();
        let is_good = status?.map_err(|e| unreadable(video, &e))?.success();
        let seen = seen.unwrap_or(Ok(ControlFlow::Continue(())))?;
        let decoded = told.frames.load(Ordering::Relaxed) as usize;
        Ok(End { is_good: is_good || seen.is_break(), complaints, decoded })
    })
}

/// Waits for a child as long as it may go on; then, or when it has shown enough, it is ended.
fn wait(
    child: &mut Child,
    is_enough: &AtomicBool,
    may_go_on: impl Fn() -> Result<(), Cancelled>,
) -> Result<std::io::Result<ExitStatus>, FacewrightError> {
    loop {
        let outcome = may_go_on();
        if outcome.is_err() || is_enough.load(Ordering::Relaxed) {
            // One that has ended by itself needs no end; waiting leaves nothing of it.
            let _ = child.kill();
            let status = child.wait();
            return outcome.map(|()| status).map_err(Into::into);
        }
        match child.try_wait() {
            Ok(Some(status)) => return may_go_on().map(|()| Ok(status)).map_err(Into::into),
            Ok(None) => std::thread::sleep(LOOK),
            Err(error) => return Ok(Err(error)),
        }
    }
}

/// Shows the pictures of a pipe, each a PPM, until it ends or one is enough.
fn pictures(
    pipe: impl Read,
    see: &mut impl FnMut(RgbImage) -> Result<ControlFlow<()>, FacewrightError>,
) -> Result<ControlFlow<()>, FacewrightError> {
    let mut pipe = BufReader::new(pipe);
    // How ffmpeg ended says why a picture is not whole.
    while let Some(picture) = picture(&mut pipe) {
        if see(picture)?.is_break() {
            return Ok(ControlFlow::Break(()));
        }
    }
    Ok(ControlFlow::Continue(()))
}

/// The next picture of a pipe: `P6`, width, height and 255, each followed by one white space, then the bytes.
fn picture(pipe: &mut impl BufRead) -> Option<RgbImage> {
    let mut word = || -> Option<String> {
        let mut word = Vec::new();
        loop {
            let mut byte = [0];
            pipe.read_exact(&mut byte).ok()?;
            if byte[0].is_ascii_whitespace() {
                return String::from_utf8(word).ok();
            }
            word.push(byte[0]);
        }
    };
    let [kind, width, height, most] = [word()?, word()?, word()?, word()?];
    let (width, height): (u32, u32) = (width.parse().ok()?, height.parse().ok()?);
    if kind != "P6" || most != "255" {
        return None;
    }
    let mut bytes = vec![0; 3 * width as usize * height as usize];
    pipe.read_exact(&mut bytes).ok()?;
    RgbImage::from_raw(width, height, bytes)
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
            let decoding = scope.spawn(|| decode(&path, Wanted::All, &progress));
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
        let told = Told::default();
        let said = b"Input #0, avi, from 'a':\n[info]   Duration: 00:01:02.50, start: 0.000000\n[mpeg4 @ 0x5] [error] header damaged\n";
        assert_eq!(told.listen(&said[..]), "header damaged\n");
        assert_eq!(told.length_us.load(Ordering::Relaxed), 62_500_000);
        assert_eq!(told.listen(&b"[info]   Duration: N/A, start: 0\n"[..]), "");
        assert_eq!(told.length_us.load(Ordering::Relaxed), 62_500_000);
        told.listen(
            &b"[Parsed_metadata_1 @ 0x5] [info] frame:7    pts:20 pts_time:1.25\n[info] frame:x pts_time:N/A\n"[..],
        );
        assert_eq!((told.frames.load(Ordering::Relaxed), told.done_us.load(Ordering::Relaxed)), (8, 1_250_000));
    }

    /// A film whose k-th frame of three seconds is of the level 30 + 2 k.
    fn levels(path: &Path, filters: &str) -> Option<()> {
        let source = format!("color=black:s=32x32:r=30:d=3,geq=lum='30+2*N':cb=128:cr=128{filters}");
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", &source, EACH_FRAME[0], "passthrough"]);
        let made = command.args(["-c:v", "mpeg4", "-q:v", "1", "-enc_time_base", "1:3000"]).arg(path).status();
        let made = made.ok().filter(std::process::ExitStatus::success);
        if made.is_none() {
            println!("skipped: there is no ffmpeg here that makes such a film");
        }
        made.map(drop)
    }

    /// Which frames of the film they are.
    fn shown(path: &Path, numbers: &[usize]) -> Vec<(String, i32)> {
        let frames = FrameSet::open_numbers(&[path.to_owned()], Some(numbers), &Progress::new()).unwrap();
        let which = |i: usize| {
            let level = f64::from(frames.load(i).unwrap().get_pixel(16, 16)[1]) * 219.0 / 255.0 + 16.0;
            ((level - 30.0) / 2.0).round() as i32
        };
        (0..frames.len()).map(|i| (frames.frames[i].name.clone(), which(i))).collect()
    }

    #[test]
    fn numbers_are_of_the_steady_rate_and_name_the_frames() {
        let folder = tempfile::tempdir().unwrap();
        let steady = folder.path().join("steady.mp4");
        let Some(()) = levels(&steady, "") else { return };
        let expected = |pairs: &[(usize, i32)]| -> Vec<(String, i32)> {
            pairs.iter().map(|(number, which)| (format!("frame_{number:06}"), *which)).collect()
        };
        assert_eq!(
            shown(&steady, &[0, 1, 2, 48, 66, 89]),
            expected(&[(0, 0), (1, 1), (2, 2), (48, 48), (66, 66), (89, 89)])
        );
        assert_eq!(
            shown(&steady, &[88, 89, 90, 97]),
            expected(&[(88, 88), (89, 89), (90, 89), (97, 89)]),
            "the last stays"
        );
        // From the 20th on, three of seven are left out, and what is left comes a little late.
        let unsteady = folder.path().join("unsteady.mp4");
        let Some(()) =
            levels(&unsteady, ",select='lt(mod(n\\,7)\\,4)+lt(n\\,20)',settb=1/3000,setpts='PTS+30*gt(N,0)'")
        else {
            return;
        };
        let late =
            [(0, 0), (1, 0), (2, 1), (20, 19), (21, 19), (22, 21), (25, 24), (26, 24), (28, 24), (29, 28), (60, 59)];
        assert_eq!(shown(&unsteady, &late.map(|(number, _)| number)), expected(&late));
    }

    #[test]
    fn any_number_of_stretches_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mp4");
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-loglevel", "error", "-f", "lavfi"]);
        let made = command.args(["-i", "color=gray:s=16x16:r=30:d=60", "-c:v", "mpeg4"]).arg(&path).status();
        if !made.is_ok_and(|status| status.success()) {
            println!("skipped: there is no ffmpeg here");
            return;
        }
        let uneven: Vec<usize> = (0..300).map(|k| k * 5 + k % 3 * k % 2).collect();
        assert_eq!(progressions(&[3, 4, 5, 9, 15, 21, 40]).len(), 3);
        assert_eq!(decode(&path, Wanted::Numbers(&uneven), &Progress::new()).unwrap().len(), 300);
        let beyond = decode(&path, Wanted::Numbers(&[1800, 1801]), &Progress::new()).unwrap_err().to_string();
        assert!(beyond.contains("it ends before frame 1800"), "{beyond}");
    }

    #[test]
    fn numbers_of_nothing_in_particular_are_refused() {
        let open = |inputs: &[&str], numbers: &[usize]| {
            let inputs: Vec<_> = inputs.iter().map(Into::into).collect();
            FrameSet::open_numbers(&inputs, Some(numbers), &Progress::new()).unwrap_err().to_string()
        };
        for (inputs, numbers) in
            [(&["a.mp4", "b.mp4"][..], &[0, 1][..]), (&["a.mp4"], &[]), (&["a.mp4"], &[1, 1]), (&["a.mp4"], &[2, 1])]
        {
            let said = open(inputs, numbers);
            assert!(said.contains("numbers of the frames must be one or more, ascending"), "{said}");
        }
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
