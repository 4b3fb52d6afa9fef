//! The command line of the `facewright` program: one file a command, its options those of the library.
//!
//! # Entry points
//! - [`main`]: the program. [`run`]: the same from arguments, for other programs; [`parse`] only reads them.
//! - [`help_markdown`] makes `docs/cli.md`.
//!
//! JSON on standard output with `--json`, warnings and progress on standard error, exit 0 done, 1 a clear error, 2 usage.

mod board;
mod calibrate;
mod faces;
mod inputs;
mod markdown;
mod matches;
mod motion;
mod overlay;
mod reconstruct;
mod summary;
mod survey;
mod track;
mod undistort;
mod watch;

pub use board::BoardCommand;
pub use calibrate::CalibrateCommand;
pub use faces::FacesCommand;
pub use inputs::{check_output, motion as read_motion, open as open_frames, open_clip, open_films, open_numbers};
pub use markdown::help_markdown;
pub use matches::{MatchCommand, draw_match, match_steps};
pub use motion::MotionCommand;
pub use overlay::OverlayCommand;
pub use reconstruct::ReconstructCommand;
pub use summary::Summary;
pub use survey::SurveyCommand;
pub use track::TrackCommand;
pub use undistort::UndistortCommand;

use crate::{Assets, FacewrightError};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use geometry::Progress;
use serde::Serialize;
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// From a filmed head to an animatable head.
#[derive(Clone, Debug, Parser)]
#[command(name = "facewright", version)]
pub struct Arguments {
    /// Print the result as JSON on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// No progress on standard error: only warnings and errors
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Folder of generic_head.safetensors.gz and nets/ (default: FACEWRIGHT_ASSETS, or beside the program)
    #[arg(long, global = true, value_name = "DIR")]
    pub assets: Option<PathBuf>,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// A command with its files and options. As JSON it is an object with the command's word.
#[derive(Clone, Debug, Subcommand, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Command {
    /// Writes a board to print, exact at 100 % print scale
    Board(BoardCommand),
    /// Calibrates a camera, or a rig of several, from pictures of a board
    Calibrate(CalibrateCommand),
    /// Removes the lens distortion from pictures
    Undistort(UndistortCommand),
    /// Matches corners of the face between two frames
    Match(MatchCommand),
    /// Finds the face in the frames of a clip
    Faces(FacesCommand),
    /// Says whether a head can be made of a clip
    Survey(SurveyCommand),
    /// Tracks points of the face through a clip
    Track(TrackCommand),
    /// Solves for the head's pose in every frame and the positions of its points
    Motion(MotionCommand),
    /// Reconstructs the head in a clip
    Reconstruct(ReconstructCommand),
    /// Draws a reconstructed head over its frames
    Overlay(OverlayCommand),
}

impl Arguments {
    /// Does what is asked for.
    pub fn execute(&self, progress: &Progress) -> Result<Summary, FacewrightError> {
        let assets = self.assets.clone().unwrap_or_else(Assets::default_folder);
        match &self.command {
            Command::Board(command) => command.run(),
            Command::Calibrate(command) => command.run(progress),
            Command::Undistort(command) => command.run(progress),
            Command::Match(command) => command.run(&assets, progress),
            Command::Faces(command) => command.run(&assets, progress),
            Command::Survey(command) => command.run(&assets, progress),
            Command::Track(command) => command.run(&assets, progress),
            Command::Motion(command) => command.run(&assets, progress),
            Command::Reconstruct(command) => command.run(&assets, progress),
            Command::Overlay(command) => command.run(progress),
        }
    }
}

/// Reads arguments without the program's name, which is `program` in what is said of them.
///
/// # Errors
/// What is wrong with them; also where help or the version was asked for: `exit_code` tells.
pub fn parse(program: &str, arguments: impl IntoIterator<Item = OsString>) -> Result<Arguments, clap::Error> {
    let command = Arguments::command().bin_name(program);
    let all = std::iter::once(OsString::from(program)).chain(arguments);
    let mut matches = command.try_get_matches_from(all)?;
    Arguments::from_arg_matches_mut(&mut matches)
}

/// Does what arguments ask for and says how it went; the exit code.
pub fn run(program: &str, arguments: impl IntoIterator<Item = OsString>, progress: &Progress) -> u8 {
    let arguments = match parse(program, arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            let code = u8::try_from(error.exit_code()).unwrap_or(2);
            return printed(error.print(), code);
        }
    };
    let watch = watch::Watch::start(progress, !arguments.quiet);
    let outcome = arguments.execute(progress);
    watch.stop();
    match outcome {
        Ok(summary) => {
            let code = printed(summary.print(arguments.json, &mut std::io::stdout().lock()), 0);
            // Where nothing can be printed there is nobody to warn.
            let _ = summary.warn(&mut std::io::stderr().lock());
            code
        }
        Err(error) => {
            complain(&error);
            1
        }
    }
}

/// The exit code of what was to be printed. One who closed the pipe has read enough.
fn printed(outcome: std::io::Result<()>, code: u8) -> u8 {
    match outcome {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            complain(&format_args!("standard output cannot be written to: {error}"));
            code.max(1)
        }
        _ => code,
    }
}

fn complain(sentence: &dyn std::fmt::Display) {
    // Where nothing can be printed there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "facewright: {sentence}");
}

/// The program; Ctrl-C cancels what runs.
pub fn main() -> ExitCode {
    let filter = tracing_subscriber::EnvFilter::try_from_env("FACEWRIGHT_LOG").unwrap_or_else(|_| "warn".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let progress = Progress::new();
    let cancelled = progress.clone();
    if let Err(error) = ctrlc::set_handler(move || cancelled.cancel()) {
        tracing::warn!("Ctrl-C will not stop cleanly: {error}");
    }
    ExitCode::from(run("facewright", std::env::args_os().skip(1), &progress))
}

#[cfg(test)]
mod tests;
