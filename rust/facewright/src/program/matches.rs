//! `facewright match`.

use super::inputs::{camera, check_output};
use super::summary::Summary;
use crate::pictures::matches::of_match;
use crate::{Assets, FacewrightError, FrameSet, MatchOptions, MatchedPair, match_pair, write_drawing, write_json};
use clap::Args;
use drawing::{DPI, Format};
use geometry::Progress;
use image::imageops;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Splits a progress into matching and, where that is wanted, drawing.
pub fn match_steps(progress: &Progress, is_drawn: bool) -> [Progress; 2] {
    progress.split(&[0.8, if is_drawn { 0.2 } else { 0.0 }])
}

/// Matches corners of the face between two frames
#[derive(Clone, Debug, Args, Serialize)]
pub struct MatchCommand {
    /// First frame
    a: PathBuf,
    /// Second frame
    b: PathBuf,
    /// Calibrated camera
    #[arg(long)]
    camera: Option<PathBuf>,
    /// How it works.
    #[command(flatten)]
    pub options: MatchOptions,
    /// Matches file to write
    #[arg(short, long, default_value = "matches.json")]
    output: PathBuf,
    /// Drawing to write of both frames with their points and vectors, before and after the correction: SVG, PDF or PNG
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

impl MatchCommand {
    pub(super) fn run(&self, assets: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        // Another kind of picture is refused before the work, not after it.
        self.picture.as_deref().map(Format::of).transpose()?;
        check_output(&self.output)?;
        let camera = camera(self.camera.as_deref())?;
        let assets = Assets::load(assets)?;
        let [matching, drawing] = match_steps(progress, self.picture.is_some());
        let matches = match_pair(&self.a, &self.b, camera.as_ref(), &assets, &self.options, &matching)?;
        let pair = &matches.pairs[0];
        self.picture.as_deref().map_or(Ok(()), |file| draw_match(pair, &self.a, &self.b, file, &drawing))?;
        write_json(&self.output, &matches)?;
        let kept = pair.kept().count();
        let text = format!("{kept} of {} matches kept, in {}", pair.points.len(), self.output.display());
        Ok(Summary { text, warnings: Vec::new(), json: json!(matches) })
    }
}

/// Writes the picture of a pair.
pub fn draw_match(
    pair: &MatchedPair,
    a: &Path,
    b: &Path,
    file: &Path,
    progress: &Progress,
) -> Result<(), FacewrightError> {
    let frames = FrameSet::open(&[a.to_owned(), b.to_owned()], progress)?;
    let grey = |i: usize| frames.load(i).map(|picture| imageops::grayscale(&picture));
    write_drawing(file, &of_match(pair, &grey(0)?, &grey(1)?), DPI)
}
