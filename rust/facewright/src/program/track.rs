//! `facewright track`.

use super::inputs::{camera, check_output, faces, open_clip};
use super::summary::Summary;
use crate::{Assets, FacewrightError, TRACK_STEPS, TrackClipOptions, track, write_json};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Tracks points of the face through a clip
#[derive(Clone, Debug, Args, Serialize)]
pub struct TrackCommand {
    /// Image files in temporal order, a folder, or a video
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Calibrated camera; without it the focal length is estimated
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Faces already found in the same frames
    #[arg(long, value_name = "FILE")]
    faces: Option<PathBuf>,
    /// How it works.
    #[command(flatten)]
    pub options: TrackClipOptions,
    /// Tracks file to write
    #[arg(short, long, default_value = "tracks.json")]
    output: PathBuf,
}

impl TrackCommand {
    pub(super) fn run(&self, assets: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        let (camera, faces) = (camera(self.camera.as_deref())?, faces(self.faces.as_deref())?);
        check_output(&self.output)?;
        let load = || Assets::load(assets);
        let progress = progress.as_step(1, 1 + TRACK_STEPS);
        let (frames, assets, progress) = open_clip((&self.frames, None), faces.as_ref(), load, &progress)?;
        let tracks = track(&frames, &assets, camera.as_ref(), faces.as_ref(), &self.options, &progress)?;
        write_json(&self.output, &tracks)?;
        let used = tracks.frames.iter().filter(|f| f.used).count();
        let text = format!(
            "{} points in {used} of {} frames, in {}",
            tracks.tracks.len(),
            frames.len(),
            self.output.display()
        );
        let json = json!(tracks);
        Ok(Summary { text, warnings: tracks.warnings, json })
    }
}
