//! `facewright faces`.

use super::inputs::{camera, check_output, open_clip};
use super::summary::Summary;
use crate::{Assets, FaceOptions, FacewrightError, find_faces_of};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Finds the face in a clip: the nets run on some frames, points place it in the others
#[derive(Clone, Debug, Args, Serialize)]
pub struct FacesCommand {
    /// Image files in temporal order, a folder, or a video
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Calibrated camera; without it the focal length is estimated
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Whose face it is.
    #[command(flatten)]
    options: FaceOptions,
    /// Faces file to write
    #[arg(short, long, default_value = "faces.json")]
    output: PathBuf,
}

impl FacesCommand {
    pub(super) fn run(&self, assets: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        let camera = camera(self.camera.as_deref())?;
        check_output(&self.output)?;
        let load = || Assets::load(assets);
        let (frames, assets, progress) = open_clip((&self.frames, None), None, load, progress)?;
        let faces = find_faces_of(&frames, &assets, camera.as_ref(), &self.options, &progress)?;
        faces.write(&self.output)?;
        let (looked, seen) = faces.counts();
        let text = format!(
            "a face in {seen} of the {looked} frames that the nets ran on, {} frames in all, in {}",
            frames.len(),
            self.output.display()
        );
        Ok(Summary { text, warnings: faces.warnings(), json: json!(faces) })
    }
}
