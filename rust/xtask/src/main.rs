//! `cargo x …`: every task of the project, on a fresh machine too.
//!
//! Only Rust, Python 3.11, git and npm are taken for granted. Whatever else a task needs is installed from its registry,
//! at a pinned version, into `target/`.

mod addon;
mod bench;
mod bench_reconstruct;
mod check;
mod compile;
mod cross;
mod degraded;
mod demo;
mod environment;
mod fetch;
mod fuzz;
mod generic_head;
mod gltf;
mod gui;
mod manual;
mod run;
mod tables;
mod test;
mod wheel;

use addon::Library;
use clap::{Parser, Subcommand};
use std::path::PathBuf;

#[derive(Parser)]
#[command(name = "cargo x", about = "Facewright's tasks")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Builds everything, reconstructs the demo clip in Blender, saves .blend, .glb, report and pictures
    Demo {
        /// Your own clip or folder of frames
        #[arg(long)]
        clip: Option<PathBuf>,
        /// First and last frame of the clip, e.g. 480-660
        #[arg(long)]
        frames: Option<String>,
        /// Where to put the results
        #[arg(short, long, default_value = "target/demo")]
        out: PathBuf,
    },
    /// Runs every test
    Test {
        /// Also in a real Blender window; needs root
        #[arg(long)]
        gui: bool,
    },
    /// Formatting, lints, documentation, types, layers, licences
    Check,
    /// Licences and sources of all crates, and what is known against them (fetches the advisories)
    Deny,
    /// Time and error of our features beside their peers'
    Bench {
        /// One feature; all without it
        #[arg(value_parser = bench::WORDS)]
        word: Option<String>,
        /// Another build of the program, measured in turn with this one (reconstruct)
        #[arg(long, value_name = "PROGRAM")]
        before: Option<PathBuf>,
    },
    /// What motion blur, exposure, compression, interlacing, jumps, reflections and noise do to the tracks of a film
    Degraded {
        /// Chain of steps
        #[arg(long, default_value = "default", value_parser = ["default", "paper"])]
        method: String,
    },
    /// The paper's tables of matching accuracy, ours and OpenCV's beside them
    Tables {
        /// Where to write them as JSON
        #[arg(long)]
        json: Option<PathBuf>,
    },
    /// Builds the generic head and the landmark nets into target/assets
    Head,
    /// Builds the validated extension zip into target/addon, to be handed to others
    Addon {
        /// Instead of compiling the library, take all wheels of this folder: a zip for each of their platforms
        #[arg(long)]
        wheels: Option<PathBuf>,
    },
    /// Type-checks the library for Windows, macOS and both kinds of Linux
    Cross,
    /// Builds the manual's pages into target/manual
    Manual {
        /// Take its pictures anew first, in a real Blender window; needs root
        #[arg(long)]
        pictures: bool,
    },
    /// Rebuilds blend_fixtures/*.blend from their scripts
    Fixtures,
    /// Files broken at random, for minutes: no panic, no hang, no memory that only a number in the file asks for
    Fuzz {
        /// For how long
        #[arg(long, default_value_t = 10)]
        minutes: u64,
        /// Where the random numbers begin; a new place without it
        #[arg(long)]
        seed: Option<u64>,
    },
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().task {
        Task::Demo { clip, frames, out } => demo::demo(clip.as_deref(), frames.as_deref(), &out),
        Task::Test { gui } => test::test(gui),
        Task::Check => check::check(),
        Task::Deny => check::advisories(),
        Task::Bench { word, before } => bench::bench(word.as_deref(), before.as_deref()),
        Task::Degraded { method } => degraded::degraded(&method),
        Task::Tables { json } => tables::tables(json.as_deref()),
        Task::Head => generic_head::build().map(drop),
        Task::Addon { wheels } => {
            addon::bundle(&wheels.as_deref().map_or(Library::Portable, Library::Wheels)).map(drop)
        }
        Task::Cross => cross::cross(),
        Task::Manual { pictures } => manual::manual(pictures),
        Task::Fixtures => test::fixtures(),
        Task::Fuzz { minutes, seed } => fuzz::fuzz(minutes, seed),
    }
}
