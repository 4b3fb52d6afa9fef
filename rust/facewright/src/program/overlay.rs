//! `facewright overlay`.

use super::inputs::{is_of_rig, open, open_films};
use super::summary::Summary;
use crate::{FacewrightError, check_folder, overlay, overlay_on_rig};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// Draws a reconstructed head over its frames
#[derive(Clone, Debug, Args, Serialize)]
pub struct OverlayCommand {
    /// Result folder of `reconstruct`
    result: PathBuf,
    /// The frames it was made from; with a rig those of any of its cameras: left=FRAMES right=FRAMES
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Folder to write to
    #[arg(short, long)]
    output: PathBuf,
}

impl OverlayCommand {
    pub(super) fn run(&self, progress: &Progress) -> Result<Summary, FacewrightError> {
        check_folder(&self.output)?;
        let (drawn, count) = if is_of_rig(&self.frames) {
            let (films, progress) = open_films(&self.frames, progress)?;
            let count = films.iter().map(|film| film.frames.len()).sum();
            (overlay_on_rig(&self.result, &films, &self.output, &progress)?, count)
        } else {
            let (frames, progress) = open(&self.frames, progress)?;
            (overlay(&self.result, &frames, &self.output, &progress)?, frames.len())
        };
        let text = format!("{}: {} of {count} frames drawn", self.output.display(), drawn.len());
        Ok(Summary { text, warnings: Vec::new(), json: json!({ "drawn": drawn }) })
    }
}
