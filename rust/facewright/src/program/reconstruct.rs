//! `facewright reconstruct`.

use super::inputs::{camera, faces, motion, open_clip, open_films};
use super::summary::Summary;
use crate::{
    Assets, CalibratedRig, FacewrightError, Given, ReconstructOptions, Reconstruction, Tracks, check_folder,
    reconstruct, reconstruct_on_rig, reconstruct_steps,
};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Reconstructs the head in a clip
#[derive(Clone, Debug, Args, Serialize)]
pub struct ReconstructCommand {
    /// Image files, a folder, or a video; with --rig those of each camera: left=FRAMES right=FRAMES
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Calibrated cameras that filmed the head at the same moments, or took one photograph each: their positions give its poses and size
    #[arg(long, value_name = "FILE", conflicts_with_all = ["camera", "faces", "tracks", "motion", "interocular_mm", "lengths"])]
    rig: Option<PathBuf>,
    /// Calibrated camera; without it the focal length is estimated
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Faces already found in the same frames
    #[arg(long, value_name = "FILE")]
    faces: Option<PathBuf>,
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
        let result = match &self.rig {
            Some(rig) => self.on_rig(rig, assets, progress)?,
            None => self.of_one(assets, progress)?,
        };
        result.write(&self.output)?;
        let frames = &result.report.frames;
        let used = frames.iter().filter(|f| f.used).count();
        let text = format!("{}: {used} of {} frames used", self.output.display(), frames.len());
        let json = json!(result.report);
        Ok(Summary { text, warnings: result.report.warnings, json })
    }

    fn of_one(&self, assets: &Path, progress: &Progress) -> Result<Reconstruction, FacewrightError> {
        let given = Given {
            camera: camera(self.camera.as_deref())?,
            tracks: self.tracks.as_deref().map(Tracks::read).transpose()?,
            motion: self.motion.as_deref().map(motion).transpose()?,
            faces: faces(self.faces.as_deref())?,
        };
        check_folder(&self.output)?;
        let load = || Assets::load(assets);
        let progress = progress.as_step(1, 1 + reconstruct_steps(&given, self.options.method));
        let (frames, assets, progress) = open_clip((&self.frames, None), given.faces.as_ref(), load, &progress)?;
        reconstruct(&frames, &assets, &given, &self.options, &progress)
    }

    fn on_rig(&self, rig: &Path, assets: &Path, progress: &Progress) -> Result<Reconstruction, FacewrightError> {
        let rig = CalibratedRig::read(rig)?;
        check_folder(&self.output)?;
        let steps = 1 + reconstruct_steps(&Given::default(), self.options.method);
        let (films, progress) = open_films(&self.frames, &progress.as_step(1, steps))?;
        reconstruct_on_rig(&films, &rig, &Assets::load(assets)?, &self.options, &progress)
    }
}
