//! `facewright undistort`.

use super::inputs::open;
use super::summary::Summary;
use crate::{FacewrightError, SourcedCamera, UndistortOptions, check_folder, undistort};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// Removes the lens distortion from pictures
#[derive(Clone, Debug, Args, Serialize)]
pub struct UndistortCommand {
    /// Image files, folders of them, or a video
    #[arg(required = true)]
    pictures: Vec<PathBuf>,
    /// Calibrated camera
    #[arg(long)]
    camera: PathBuf,
    /// How it works.
    #[command(flatten)]
    pub options: UndistortOptions,
    /// Folder to write PNG pictures and their camera.json to
    #[arg(short, long)]
    output: PathBuf,
}

impl UndistortCommand {
    pub(super) fn run(&self, progress: &Progress) -> Result<Summary, FacewrightError> {
        check_folder(&self.output)?;
        let own = self.output.join("camera.json").canonicalize().ok();
        if own.is_some() && own == self.camera.canonicalize().ok() {
            return Err(FacewrightError::OwnFolder { folder: self.output.clone() });
        }
        let camera = SourcedCamera::read(&self.camera)?;
        let (frames, progress) = open(&self.pictures, progress)?;
        let pinhole = undistort(&frames, &camera, &self.options, &self.output, &progress)?;
        let text = format!("{} pictures without distortion in {}", frames.len(), self.output.display());
        Ok(Summary { text, warnings: Vec::new(), json: json!(pinhole) })
    }
}
