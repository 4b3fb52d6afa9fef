//! `facewright survey`.

use super::inputs::camera;
use super::summary::Summary;
use crate::{Assets, FaceOptions, FacewrightError, survey};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Looks at some frames of a clip and says whether a head can be made of it: how far it turns, and what is missing
#[derive(Clone, Debug, Args, Serialize)]
pub struct SurveyCommand {
    /// Image files in temporal order, a folder, or a video
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Calibrated camera; without it the focal length is estimated
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Whose face it is.
    #[command(flatten)]
    options: FaceOptions,
}

impl SurveyCommand {
    pub(super) fn run(&self, assets: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        let camera = camera(self.camera.as_deref())?;
        let found = survey((&self.frames, None), &Assets::load(assets)?, (camera.as_ref(), &self.options), progress)?;
        let length = format!("{} frames of {}x{}", found.frames, found.width, found.height);
        let text = [vec![length], found.summary.clone()].concat().join("; ");
        let warnings = found.findings.iter().map(|finding| finding.sentence.clone()).collect();
        Ok(Summary { text, warnings, json: json!(found) })
    }
}
