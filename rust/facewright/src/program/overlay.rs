//! `facewright overlay`.

use super::inputs::open;
use super::summary::Summary;
use crate::{FacewrightError, check_folder, overlay};
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
    /// The frames it was made from
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Folder to write to
    #[arg(short, long)]
    output: PathBuf,
}

impl OverlayCommand {
    pub(super) fn run(&self, progress: &Progress) -> Result<Summary, FacewrightError> {
        check_folder(&self.output)?;
        let (frames, progress) = open(&self.frames, progress)?;
        let drawn = overlay(&self.result, &frames, &self.output, &progress)?;
        let text = format!("{}: {} of {} frames drawn", self.output.display(), drawn.len(), frames.len());
        Ok(Summary { text, json: json!({ "drawn": drawn }) })
    }
}
