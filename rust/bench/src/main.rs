//! Benches: time and error of a feature, ours and the peer's, on the same inputs.
//!
//! `cargo x bench [WORD]` runs three steps per feature word:
//! - `bench inputs WORD FOLDER` writes what both sides read (`inputs.json`, pictures) and what neither may read
//!   (`truth.json`);
//! - `bench measure WORD FOLDER RESULT` writes our times and answers, `peers/WORD.py FOLDER RESULT` the peer's, in turn;
//! - `bench table WORD FOLDER RESULTS…` judges all answers by the same code and prints one table.
//!
//! The word `tables` is the paper's Tables 1 and 2, printed by `cargo x tables` beside the paper's own figures.
//!
//! Times are the processor's, one thread each, medians of several rounds, or of the turns where a round takes long: a busy
//! machine hardly changes them.
#![forbid(unsafe_code)]

mod bundle;
mod calibrate;
mod clock;
mod degraded;
mod dense;
mod feature;
mod files;
mod motion;
mod results;
mod scenes;
mod sequence;
mod shape;
mod table;
mod tables;
mod track;

use clap::{Parser, Subcommand, ValueEnum};
use feature::Feature;
use std::path::PathBuf;

#[derive(Parser)]
#[command(about = "Measures features of Facewright beside their peers; `cargo x bench` runs it")]
struct Arguments {
    #[command(subcommand)]
    step: Step,
}

#[derive(Subcommand)]
enum Step {
    /// Writes inputs and truth
    Inputs { word: Word, folder: PathBuf },
    /// Measures ours
    Measure { word: Word, folder: PathBuf, result: PathBuf },
    /// Judges all results and prints them side by side
    Table { word: Word, folder: PathBuf, results: Vec<PathBuf> },
}

#[derive(Clone, Copy, ValueEnum)]
enum Word {
    Calibrate,
    Track,
    Motion,
    Bundle,
    Sequence,
    Dense,
    Degraded,
    Tables,
}

impl Step {
    fn word(&self) -> Word {
        match self {
            Self::Inputs { word, .. } | Self::Measure { word, .. } | Self::Table { word, .. } => *word,
        }
    }

    fn run<F: Feature>(&self) -> anyhow::Result<()> {
        match self {
            Self::Inputs { folder, .. } => feature::write_inputs::<F>(folder),
            Self::Measure { folder, result, .. } => feature::measure::<F>(folder, result),
            Self::Table { folder, results, .. } => feature::print_table::<F>(folder, results),
        }
    }
}

fn main() -> anyhow::Result<()> {
    let step = Arguments::parse().step;
    match step.word() {
        Word::Degraded => match &step {
            Step::Inputs { folder, .. } => degraded::write(folder),
            Step::Measure { .. } => anyhow::bail!("`cargo x degraded` runs the program itself"),
            Step::Table { folder, .. } => degraded::print(folder),
        },
        Word::Tables => match &step {
            Step::Table { folder, results, .. } => tables::print(folder, results),
            step => step.run::<tables::Tables>(),
        },
        Word::Calibrate => step.run::<calibrate::Calibrate>(),
        Word::Track => step.run::<track::Track>(),
        Word::Motion => step.run::<motion::Motion>(),
        Word::Bundle => step.run::<bundle::BundleBench>(),
        Word::Sequence => step.run::<sequence::SequenceBench>(),
        Word::Dense => step.run::<dense::Dense>(),
    }
}
