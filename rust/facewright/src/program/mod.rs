//! Arguments, progress and exit codes of the `facewright` program; all work is the library's.
//!
//! JSON on standard output with `--json`, progress on standard error, exit 0 done, 1 a clear error, 2 usage.

mod calibrate;
mod commands;
mod watch;

use clap::{Args, Parser, Subcommand, ValueEnum};
use facewright::{Bend, KnownLength, Method, pictures::board::Page};
use geometry::Board;
use std::path::PathBuf;
use std::process::ExitCode;

/// From a filmed head to an animatable head.
#[derive(Parser)]
#[command(name = "facewright", version, about)]
struct Arguments {
    /// Print the result as JSON on standard output
    #[arg(long, global = true)]
    json: bool,
    /// No progress on standard error
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Folder of generic_head.safetensors.gz and nets/ (default: FACEWRIGHT_ASSETS, or beside the program)
    #[arg(long, global = true, value_name = "DIR")]
    assets: Option<PathBuf>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Writes a board to print, exact at 100 % print scale
    Board {
        #[command(flatten)]
        board: BoardArguments,
        /// Paper
        #[arg(long, value_enum, default_value = "a4")]
        page: PageArgument,
        /// Leave out the white disc that tells which way up the board is
        #[arg(long)]
        no_mark: bool,
        /// Resolution of a PNG, dots per inch
        #[arg(long, default_value_t = 300.0)]
        dpi: f64,
        /// SVG, PDF or PNG file to write
        #[arg(short, long, default_value = "board.svg")]
        output: PathBuf,
    },
    /// Calibrates a camera, or a rig of several, from pictures of a board
    Calibrate {
        /// Board pictures, folders of them, patterns like `left*.jpg`, or a video
        #[arg(required_unless_present = "rig")]
        pictures: Vec<PathBuf>,
        /// Cameras that saw the board at the same moments, each with its pictures: left=DIR right=DIR
        #[arg(long, num_args = 2.., value_name = "NAME=PICTURES", value_parser = named, conflicts_with = "pictures")]
        rig: Vec<(String, PathBuf)>,
        #[command(flatten)]
        board: BoardArguments,
        #[command(flatten)]
        lens: LensArguments,
        /// Camera file to write (default: camera.json, or rig.json)
        #[arg(short, long)]
        output: Option<PathBuf>,
        /// Picture of boards, corners and errors to write: SVG, PDF or PNG
        #[arg(long, value_name = "FILE")]
        picture: Option<PathBuf>,
    },
    /// Takes the lens distortion out of pictures
    Undistort {
        /// Image files, folders of them, or a video
        #[arg(required = true)]
        pictures: Vec<PathBuf>,
        /// Calibrated camera
        #[arg(long)]
        camera: PathBuf,
        /// Which part of the picture is kept
        #[arg(long, value_enum, default_value = "same-focal")]
        keep: KeepArgument,
        /// Folder to write PNG pictures and their camera.json to
        #[arg(short, long)]
        output: PathBuf,
    },
    /// Matches corners of the face between two frames
    Match {
        /// First frame
        a: PathBuf,
        /// Second frame
        b: PathBuf,
        /// Calibrated camera
        #[arg(long)]
        camera: Option<PathBuf>,
        /// Chain of steps
        #[arg(long, value_enum, default_value = "default")]
        method: MethodArgument,
        /// Corners at most
        #[arg(long, default_value_t = 66)]
        points: usize,
        /// Window of the tracker, pixels, odd (default: 7 for the paper's method, else in proportion to the face)
        #[arg(long)]
        window: Option<usize>,
        /// Pyramid levels of the tracker (default: 4 for the paper's method, else 2)
        #[arg(long)]
        levels: Option<usize>,
        /// Leave the matches as the tracker found them
        #[arg(long)]
        no_correction: bool,
        /// Matches file to write
        #[arg(short, long, default_value = "matches.json")]
        output: PathBuf,
        /// Picture of both frames with points and vectors before and after the correction to write: SVG, PDF or PNG
        #[arg(long, value_name = "FILE")]
        picture: Option<PathBuf>,
    },
    /// Tracks points of the face through a sequence
    Track {
        /// Image files in the order of time, a folder, or a video
        #[arg(required = true)]
        frames: Vec<PathBuf>,
        /// Calibrated camera; without it the focal length is estimated
        #[arg(long)]
        camera: Option<PathBuf>,
        /// Chain of steps
        #[arg(long, value_enum, default_value = "default")]
        method: MethodArgument,
        /// Points wanted at a time
        #[arg(long, default_value_t = 200)]
        points: usize,
        /// Window of the tracker, pixels, odd (default: 7 for the paper's method, else in proportion to the face)
        #[arg(long)]
        window: Option<usize>,
        /// Choose points in this frame only, by its name without extension
        #[arg(long, value_name = "FRAME")]
        from: Option<String>,
        /// Tracks file to write
        #[arg(short, long, default_value = "tracks.json")]
        output: PathBuf,
    },
    /// Solves for the head's pose in every frame and the places of its points
    Motion {
        /// Image files in the order of time, a folder, or a video
        #[arg(required_unless_present = "tracks", conflicts_with = "tracks")]
        frames: Vec<PathBuf>,
        /// Tracks of them, made before; with --rig of each of its cameras: left=FILE right=FILE
        #[arg(long, num_args = 1.., value_name = "FILE")]
        tracks: Vec<String>,
        /// Calibrated cameras that filmed the head at the same moments: their places give its size
        #[arg(long, requires = "tracks", conflicts_with_all = ["camera", "interocular_mm", "lengths"])]
        rig: Option<PathBuf>,
        /// Calibrated camera; without it the focal length is refined
        #[arg(long)]
        camera: Option<PathBuf>,
        /// Distance between the eyes' centres, millimetres, when it is known
        #[arg(long, value_name = "MM")]
        interocular_mm: Option<f64>,
        /// Length between two tracks that was measured on the head: numbers of the tracks and millimetres
        #[arg(long = "length", value_name = "A:B=MM", value_parser = length)]
        lengths: Vec<KnownLength>,
        /// Motion file to write
        #[arg(short, long, default_value = "motion.json")]
        output: PathBuf,
    },
    /// Reconstructs the head
    Reconstruct {
        /// Image files, a folder, or a video
        #[arg(required = true)]
        frames: Vec<PathBuf>,
        /// Calibrated camera; without it the focal length is estimated
        #[arg(long)]
        camera: Option<PathBuf>,
        /// Chain of steps
        #[arg(long, value_enum, default_value = "default")]
        method: MethodArgument,
        /// Width and height of the texture, pixels
        #[arg(long, default_value_t = 2048)]
        texture_size: u32,
        /// Distance between the eyes' centres, millimetres, when it is known
        #[arg(long, value_name = "MM")]
        interocular_mm: Option<f64>,
        /// Tracks of the same frames to use instead of tracking
        #[arg(long, value_name = "FILE")]
        tracks: Option<PathBuf>,
        /// Result folder
        #[arg(short, long)]
        output: PathBuf,
    },
    /// Draws a reconstructed head over its frames
    Overlay {
        /// Result folder of `reconstruct`
        result: PathBuf,
        /// The frames it was made from
        #[arg(required = true)]
        frames: Vec<PathBuf>,
        /// Folder to write to
        #[arg(short, long)]
        output: PathBuf,
    },
}

#[derive(Args)]
struct BoardArguments {
    /// Inner corners of a checkerboard, columns x rows; several for boards of which any may be shown: 9x6,8x5
    #[arg(long, default_value = "9x6", value_parser = inner, value_delimiter = ',')]
    inner: Vec<(u32, u32)>,
    /// Black squares apart from each other instead, columns x rows
    #[arg(long, value_parser = squares, conflicts_with = "inner")]
    squares: Option<(u32, u32)>,
    /// White between two such squares, millimetres (default: the side of a square)
    #[arg(long, requires = "squares")]
    gap_mm: Option<f64>,
    /// Side of a square, millimetres
    #[arg(long, default_value_t = 25.5)]
    square_mm: f64,
}

impl BoardArguments {
    fn boards(&self) -> Vec<Board> {
        let square = self.square_mm / 1000.0;
        match self.squares {
            Some((columns, rows)) => {
                let gap = self.gap_mm.map_or(1.0, |gap| gap / self.square_mm);
                vec![Board::squares(columns, rows, square, gap)]
            }
            None => self.inner.iter().map(|&(columns, rows)| Board::checkerboard(columns, rows, square)).collect(),
        }
    }
}

#[derive(Args)]
struct LensArguments {
    /// Radial distortion terms, 0 to 3
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(0..=3))]
    distortion_terms: u8,
    /// Solve for tangential distortion too
    #[arg(long)]
    tangential: bool,
    /// One focal length for both directions
    #[arg(long)]
    square_pixels: bool,
    /// When to solve for a board that is not flat
    #[arg(long, value_enum, default_value = "judged")]
    bend: BendArgument,
}

#[derive(Clone, Copy, ValueEnum)]
enum BendArgument {
    /// The board is taken to be flat
    Never,
    /// Where that predicts each picture better that was left out
    Judged,
    /// In any case
    Always,
}

impl From<BendArgument> for Bend {
    fn from(bend: BendArgument) -> Self {
        match bend {
            BendArgument::Never => Self::Never,
            BendArgument::Judged => Self::Judged,
            BendArgument::Always => Self::Always,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum KeepArgument {
    /// The same focal lengths and principal point
    SameFocal,
    /// Every pixel of the filmed picture, with empty corners
    AllPixels,
    /// The largest rectangle without empty pixels
    NoEmptyPixels,
}

impl From<KeepArgument> for geometry::Pinhole {
    fn from(keep: KeepArgument) -> Self {
        match keep {
            KeepArgument::SameFocal => Self::SameFocal,
            KeepArgument::AllPixels => Self::AllPixels,
            KeepArgument::NoEmptyPixels => Self::NoEmptyPixels,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum MethodArgument {
    Paper,
    Default,
}

#[derive(Clone, Copy, ValueEnum)]
enum PageArgument {
    A4,
    A3,
    Letter,
}

impl From<MethodArgument> for Method {
    fn from(method: MethodArgument) -> Self {
        match method {
            MethodArgument::Paper => Self::Paper,
            MethodArgument::Default => Self::Default,
        }
    }
}

impl From<PageArgument> for Page {
    fn from(page: PageArgument) -> Self {
        match page {
            PageArgument::A4 => Self::A4,
            PageArgument::A3 => Self::A3,
            PageArgument::Letter => Self::Letter,
        }
    }
}

fn inner(text: &str) -> Result<(u32, u32), String> {
    counts(text, 3).ok_or_else(|| "two numbers of at least 3, like 9x6".to_owned())
}

fn squares(text: &str) -> Result<(u32, u32), String> {
    counts(text, 2).ok_or_else(|| "two numbers of at least 2, like 3x4".to_owned())
}

fn counts(text: &str, least: u32) -> Option<(u32, u32)> {
    let (columns, rows) = text.split_once('x')?;
    let parsed = (columns.parse().ok()?, rows.parse().ok()?);
    (parsed.0 >= least && parsed.1 >= least).then_some(parsed)
}

fn length(text: &str) -> Result<KnownLength, String> {
    let parts = || {
        let (ends, mm) = text.split_once('=')?;
        let (from, to) = ends.split_once(':')?;
        let length = mm.parse::<f64>().ok().filter(|mm| *mm > 0.0)? / 1000.0;
        Some(KnownLength { from: from.parse().ok()?, to: to.parse().ok()?, length })
    };
    parts().ok_or_else(|| "two track numbers and millimetres, like 12:48=63.5".to_owned())
}

fn named(text: &str) -> Result<(String, PathBuf), String> {
    let parts = text.split_once('=').filter(|(name, path)| !name.is_empty() && !path.is_empty());
    parts.map(|(name, path)| (name.to_owned(), path.into())).ok_or_else(|| "NAME=PICTURES, like left=DIR".to_owned())
}

/// Runs the program.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let filter = tracing_subscriber::EnvFilter::try_from_env("FACEWRIGHT_LOG").unwrap_or_else(|_| "warn".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let watch = watch::Watch::start(!arguments.quiet);
    let outcome = commands::execute(&arguments, watch.progress());
    watch.stop();
    match outcome {
        Ok(summary) => {
            summary.print(arguments.json);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("facewright: {error}");
            ExitCode::FAILURE
        }
    }
}
