//! `facewright motion`.

use super::inputs::{camera, check_output, faces, open};
use super::summary::Summary;
use crate::{
    Assets, CalibratedRig, FacewrightError, HeadMotion, MotionOptions, RigTracks, SourcedCamera, TRACK_STEPS,
    TrackClipOptions, Tracks, solve_motion, solve_motion_on_rig, track, write_json,
};
use clap::Args;
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Times of the steps where nothing is tracked yet, in parts: the frames are tracked, the motion is solved for.
const PARTS: [f64; 2] = [0.8, 0.2];

/// Solves for the head's pose in every frame and the positions of its points
#[derive(Clone, Debug, Args, Serialize)]
pub struct MotionCommand {
    /// Image files in temporal order, a folder, or a video
    #[arg(required_unless_present = "tracks", conflicts_with_all = ["tracks", "rig"])]
    frames: Vec<PathBuf>,
    /// Existing tracks of the frames; with --rig those of each camera: left=FILE right=FILE
    #[arg(long, num_args = 1.., value_name = "FILE")]
    tracks: Vec<String>,
    /// Calibrated cameras that filmed the head at the same moments: their positions give its size
    #[arg(long, requires = "tracks", conflicts_with_all = ["camera", "interocular_mm", "lengths"])]
    rig: Option<PathBuf>,
    /// Calibrated camera; without it the focal length is refined
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Faces already found in the same frames
    #[arg(long, value_name = "FILE", conflicts_with = "tracks")]
    faces: Option<PathBuf>,
    /// How it works.
    #[command(flatten)]
    pub options: MotionOptions,
    /// Motion file to write
    #[arg(short, long, default_value = "motion.json")]
    output: PathBuf,
}

impl MotionCommand {
    pub(super) fn run(&self, assets: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        let camera = camera(self.camera.as_deref())?;
        check_output(&self.output)?;
        let motion = match &self.rig {
            Some(rig) => {
                let rig = CalibratedRig::read(rig)?;
                solve_motion_on_rig(&self.of_rig()?, &rig, progress)?
            }
            None => {
                let (tracks, progress) = self.tracks(camera, assets, progress)?;
                solve_motion(&tracks, camera.as_ref(), &self.options, &progress)?
            }
        };
        write_json(&self.output, &motion)?;
        let (text, json) = (sentence(&motion, &self.output), json!(motion));
        Ok(Summary { text, warnings: motion.warnings, json })
    }

    /// The tracks that are given, or those of the frames, and what is left of the progress.
    fn tracks(
        &self,
        camera: Option<SourcedCamera>,
        assets: &Path,
        progress: &Progress,
    ) -> Result<(Tracks, Progress), FacewrightError> {
        match &self.tracks[..] {
            [file] => Ok((Tracks::read(Path::new(file))?, progress.clone())),
            [_, _, ..] => Err(FacewrightError::Option { name: "--tracks", expected: "one file without --rig" }),
            [] => {
                let [tracking, solving] = progress.split(&PARTS);
                let steps = 1 + TRACK_STEPS + 1;
                let (frames, tracking) = open(&self.frames, &tracking.as_step(1, steps))?;
                let faces = faces(self.faces.as_deref())?;
                let options = TrackClipOptions::default();
                Ok((
                    track(&frames, &Assets::load(assets)?, camera.as_ref(), faces.as_ref(), &options, &tracking)?,
                    solving.as_step(steps, steps),
                ))
            }
        }
    }

    /// The tracks of a rig's cameras from `NAME=FILE`.
    fn of_rig(&self) -> Result<Vec<RigTracks>, FacewrightError> {
        let read = |text: &String| {
            let (camera, file) = text
                .split_once('=')
                .ok_or(FacewrightError::Option { name: "--tracks", expected: "NAME=FILE with --rig" })?;
            Ok(RigTracks { camera: camera.to_owned(), tracks: Tracks::read(Path::new(file))? })
        };
        self.tracks.iter().map(read).collect()
    }
}

fn sentence(motion: &HeadMotion, output: &Path) -> String {
    let posed = motion.frames.iter().filter(|f| f.used).count();
    let rigid = motion.points.iter().filter(|p| !p.moves).count();
    let focal =
        motion.focal_sigma_px.map_or(String::new(), |s| format!(", focal {:.0} ± {s:.0} px", motion.camera.camera.fx));
    format!(
        "{posed} of {} frames posed, {rigid} points fixed and {} moving, {:.2} px{focal}, in {}",
        motion.frames.len(),
        motion.points.len() - rigid,
        motion.reprojection_rms_px,
        output.display()
    )
}
