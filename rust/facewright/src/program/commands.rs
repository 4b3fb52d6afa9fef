//! One function per command: arguments in, library call, files out.

use super::{Arguments, Command};
use drawing::{DPI, Format};
use facewright::pictures::board::{SheetOptions, sheet};
use facewright::pictures::matches::of_match;
use facewright::{
    Assets, CalibratedRig, FacewrightError, FrameSet, Given, HeadMotion, MatchOptions, MatchedPair, MotionOptions,
    ReconstructOptions, RigTracks, SizeOptions, SourcedCamera, TrackClipOptions, Tracks, check_folder, match_pair,
    overlay, reconstruct, solve_motion, solve_motion_on_rig, track, write_drawing, write_json,
};
use geometry::Progress;
use image::imageops;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What a command says when it is done.
pub struct Summary {
    pub text: String,
    pub json: Value,
}

impl Summary {
    /// Prints the sentence, or the JSON.
    #[expect(clippy::print_stdout, reason = "the program's own output")]
    pub fn print(&self, as_json: bool) {
        if as_json { println!("{}", self.json) } else { println!("{}", self.text) }
    }
}

/// Runs a command.
pub fn execute(arguments: &Arguments, progress: &Progress) -> Result<Summary, FacewrightError> {
    match &arguments.command {
        Command::Board { board, page, no_mark, dpi, output } => {
            let options = SheetOptions { page: (*page).into(), mark: !no_mark };
            let [board] = board.boards()[..] else {
                return Err(FacewrightError::Option { name: "--inner", expected: "one size for a board to print" });
            };
            write_drawing(output, &sheet(&board, &options)?, *dpi)?;
            let text = format!("{}: print at 100 % and check the rulers", output.display());
            Ok(Summary { text, json: json!({ "board": output }) })
        }
        Command::Calibrate { .. } | Command::Undistort { .. } => {
            super::calibrate::execute(&arguments.command, progress)
        }
        Command::Match { a, b, camera, method, points, window, levels, no_correction, output, picture } => {
            // Another kind of picture is refused before the work, not after it.
            picture.as_deref().map(Format::of).transpose()?;
            check_output(output)?;
            let options = MatchOptions {
                method: (*method).into(),
                points: *points,
                window: *window,
                levels: *levels,
                correct: !no_correction,
                ..MatchOptions::default()
            };
            let camera = camera.as_deref().map(SourcedCamera::read).transpose()?;
            let assets = load_assets(arguments)?;
            let matches = match_pair(a, b, camera.as_ref(), &assets, &options, progress)?;
            let pair = &matches.pairs[0];
            picture.as_deref().map_or(Ok(()), |file| draw_match(pair, [a, b], file, progress))?;
            write_json(output, &matches)?;
            let kept = pair.kept().count();
            let text = format!("{kept} of {} matches kept, in {}", pair.points.len(), output.display());
            Ok(Summary { text, json: json!(matches) })
        }
        Command::Track { frames, camera, method, points, window, from, output } => {
            let options =
                TrackClipOptions { method: (*method).into(), points: *points, window: *window, from: from.clone() };
            let given = Given { camera: camera.as_deref().map(SourcedCamera::read).transpose()?, ..Given::default() };
            check_output(output)?;
            let frames = FrameSet::open(frames, progress)?;
            let tracks = track(&frames, &load_assets(arguments)?, &given, &options, progress)?;
            write_json(output, &tracks)?;
            let used = tracks.frames.iter().filter(|f| f.used).count();
            let count = tracks.tracks.len();
            let warnings = warnings_text(&tracks.warnings);
            let text =
                format!("{count} points in {used} of {} frames, in {}{warnings}", frames.len(), output.display());
            Ok(Summary { text, json: json!(tracks) })
        }
        Command::Motion { tracks, rig: Some(rig), output, .. } => {
            check_output(output)?;
            let motion = solve_motion_on_rig(&rig_tracks(tracks)?, &read_rig(rig)?, progress)?;
            write_json(output, &motion)?;
            Ok(Summary { text: motion_text(&motion, output), json: json!(motion) })
        }
        Command::Motion { frames, tracks, rig: None, camera, interocular_mm, lengths, output } => {
            let camera = camera.as_deref().map(SourcedCamera::read).transpose()?;
            check_output(output)?;
            let tracks = match &tracks[..] {
                [file] => Tracks::read(Path::new(file))?,
                [_, _, ..] => {
                    return Err(FacewrightError::Option { name: "--tracks", expected: "one file without --rig" });
                }
                [] => {
                    let given = Given { camera, ..Given::default() };
                    let frames = FrameSet::open(frames, progress)?;
                    track(&frames, &load_assets(arguments)?, &given, &TrackClipOptions::default(), progress)?
                }
            };
            let size = SizeOptions { interocular_mm: *interocular_mm, lengths: lengths.clone() };
            let motion = solve_motion(&tracks, camera.as_ref(), &MotionOptions { size }, progress)?;
            write_json(output, &motion)?;
            Ok(Summary { text: motion_text(&motion, output), json: json!(motion) })
        }
        Command::Reconstruct { frames, camera, method, texture_size, interocular_mm, tracks, output } => {
            let options = ReconstructOptions {
                method: (*method).into(),
                texture_size: *texture_size,
                size: SizeOptions { interocular_mm: *interocular_mm, lengths: Vec::new() },
            };
            let given = Given {
                camera: camera.as_deref().map(SourcedCamera::read).transpose()?,
                tracks: tracks.as_deref().map(Tracks::read).transpose()?,
                ..Given::default()
            };
            check_folder(output)?;
            let frames = FrameSet::open(frames, progress)?;
            let result = reconstruct(&frames, &load_assets(arguments)?, &given, &options, progress)?;
            result.write(output)?;
            let used = result.report.frames.iter().filter(|f| f.used).count();
            let warnings = warnings_text(&result.report.warnings);
            let text = format!("{}: {used} of {} frames used{warnings}", output.display(), frames.len());
            Ok(Summary { text, json: json!(result.report) })
        }
        Command::Overlay { result, frames, output } => {
            check_folder(output)?;
            let frames = FrameSet::open(frames, progress)?;
            let drawn = overlay(result, &frames, output, progress)?;
            let text = format!("{}: {} of {} frames drawn", output.display(), drawn.len(), frames.len());
            Ok(Summary { text, json: json!({ "drawn": drawn }) })
        }
    }
}

fn warnings_text(warnings: &[String]) -> String {
    warnings.iter().map(|warning| format!("\nwarning: {warning}")).collect()
}

fn motion_text(motion: &HeadMotion, output: &Path) -> String {
    let posed = motion.frames.iter().filter(|f| f.used).count();
    let rigid = motion.points.iter().filter(|p| !p.moves).count();
    let focal =
        motion.focal_sigma_px.map_or(String::new(), |s| format!(", focal {:.0} ± {s:.0} px", motion.camera.camera.fx));
    let warnings = warnings_text(&motion.warnings);
    format!(
        "{posed} of {} frames posed, {rigid} points fixed and {} moving, {:.2} px{focal}, in {}{warnings}",
        motion.frames.len(),
        motion.points.len() - rigid,
        motion.reprojection_rms_px,
        output.display()
    )
}

fn draw_match(
    pair: &MatchedPair,
    frames: [&PathBuf; 2],
    file: &Path,
    progress: &Progress,
) -> Result<(), FacewrightError> {
    let frames = FrameSet::open(&frames.map(PathBuf::clone), progress)?;
    let grey = |i: usize| frames.load(i).map(|picture| imageops::grayscale(&picture));
    write_drawing(file, &of_match(pair, &grey(0)?, &grey(1)?), DPI)
}

/// Refuses a file that cannot be written before the work, not after it.
fn check_output(file: &Path) -> Result<(), FacewrightError> {
    check_folder(file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}

/// The tracks of a rig's cameras from `NAME=FILE`.
fn rig_tracks(named: &[String]) -> Result<Vec<RigTracks>, FacewrightError> {
    let read = |text: &String| {
        let (camera, file) = text
            .split_once('=')
            .ok_or(FacewrightError::Option { name: "--tracks", expected: "NAME=FILE with --rig" })?;
        Ok(RigTracks { camera: camera.to_owned(), tracks: Tracks::read(Path::new(file))? })
    };
    named.iter().map(read).collect()
}

fn read_rig(file: &Path) -> Result<CalibratedRig, FacewrightError> {
    let read = |e: std::io::Error| FacewrightError::Read { path: file.to_owned(), reason: e.to_string() };
    CalibratedRig::parse(&std::fs::read_to_string(file).map_err(read)?)
}

fn load_assets(arguments: &Arguments) -> Result<Assets, FacewrightError> {
    Assets::load(&arguments.assets.clone().unwrap_or_else(Assets::default_folder))
}
