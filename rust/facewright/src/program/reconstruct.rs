//! `facewright reconstruct`.

use super::inputs::{camera, motion, open};
use super::summary::{Summary, listed};
use crate::{Assets, FacewrightError, Given, ReconstructOptions, Tracks, check_folder, reconstruct};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Reconstructs the head
#[derive(Clone, Debug, Args, Serialize)]
pub struct ReconstructCommand {
    /// Image files, a folder, or a video
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Calibrated camera; without it the focal length is estimated
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Tracks of the same frames to use instead of tracking
    #[arg(long, value_name = "FILE")]
    tracks: Option<PathBuf>,
    /// Motion of the same frames to use instead of solving for it
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// How it works.
    #[command(flatten)]
    pub options: ReconstructOptions,
    /// Result folder
    #[arg(short, long)]
    output: PathBuf,
}

impl ReconstructCommand {
    pub(super) fn run(&self, assets: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        let given = Given {
            camera: camera(self.camera.as_deref())?,
            tracks: self.tracks.as_deref().map(Tracks::read).transpose()?,
            motion: self.motion.as_deref().map(motion).transpose()?,
            ..Given::default()
        };
        check_folder(&self.output)?;
        let (frames, progress) = open(&self.frames, progress)?;
        let result = reconstruct(&frames, &Assets::load(assets)?, &given, &self.options, &progress)?;
        result.write(&self.output)?;
        let used = result.report.frames.iter().filter(|f| f.used).count();
        let warnings = listed(&result.report.warnings);
        let text = format!("{}: {used} of {} frames used{warnings}", self.output.display(), frames.len());
        Ok(Summary { text, json: json!(result.report) })
    }
}
