//! `facewright calibrate`, for one camera and for rigs.

use super::inputs::{check_output, open};
use super::summary::Summary;
use crate::pictures::calibration::{of_camera, of_rig};
use crate::{
    CalibrateOptions, CalibratedCamera, CalibratedRig, FacewrightError, FrameSet, RigInput, calibrate, calibrate_rig,
    write_drawing, write_json,
};
use clap::Args;
use drawing::{DPI, Format};
use geometry::Progress;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Times of the steps with a rig, in parts: the pictures are opened, then calibrated from.
const PARTS: [f64; 2] = [0.03, 0.97];

/// Calibrates a camera, or a rig of several, from pictures of a board
#[derive(Clone, Debug, Args, Serialize)]
pub struct CalibrateCommand {
    /// Board pictures, folders of them, patterns like `left*.jpg`, or a video
    #[arg(required_unless_present = "rig")]
    pictures: Vec<PathBuf>,
    /// Cameras that saw the board at the same moments, each with its pictures: left=DIR right=DIR
    #[arg(long, num_args = 2.., value_name = "NAME=PICTURES", value_parser = named, conflicts_with = "pictures")]
    rig: Vec<(String, PathBuf)>,
    /// The board and the lens.
    #[command(flatten)]
    pub options: CalibrateOptions,
    /// Camera file to write (default: camera.json, or rig.json)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Drawing to write of boards, corners and errors: SVG, PDF or PNG
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

impl CalibrateCommand {
    pub(super) fn run(&self, progress: &Progress) -> Result<Summary, FacewrightError> {
        // Another kind of picture is refused before the work, not after it.
        self.picture.as_deref().map(Format::of).transpose()?;
        let usual = if self.rig.is_empty() { "camera.json" } else { "rig.json" };
        let output = self.output.clone().unwrap_or_else(|| usual.into());
        check_output(&output)?;
        if self.rig.is_empty() { self.one(&output, progress) } else { self.several(&output, progress) }
    }

    fn one(&self, output: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        let (pictures, progress) = open(&self.pictures, progress)?;
        let calibrated = calibrate(&pictures, &self.options, &progress)?;
        self.picture.as_deref().map_or(Ok(()), |file| write_drawing(file, &of_camera(&calibrated), DPI))?;
        write_json(output, &calibrated)?;
        let text = format!("{}, in {}", numbers(&calibrated), output.display());
        let json = json!(calibrated);
        Ok(Summary { text, warnings: calibrated.warnings, json })
    }

    fn several(&self, output: &Path, progress: &Progress) -> Result<Summary, FacewrightError> {
        let [opening, working] = progress.split(&PARTS);
        let parts = opening.split_evenly(self.rig.len());
        let open = |((name, path), part): (&(String, PathBuf), &Progress)| {
            let pictures = FrameSet::open(std::slice::from_ref(path), part)?;
            Ok(RigInput { name: name.clone(), pictures })
        };
        let cameras: Vec<RigInput> = self.rig.iter().zip(&parts).map(open).collect::<Result<_, FacewrightError>>()?;
        let calibrated = calibrate_rig(&cameras, &self.options, &working)?;
        self.picture.as_deref().map_or(Ok(()), |file| write_drawing(file, &of_rig(&calibrated), DPI))?;
        write_json(output, &calibrated)?;
        let (text, json) = (sentence(&calibrated, output), json!(calibrated));
        Ok(Summary { text, warnings: calibrated.warnings, json })
    }
}

fn sentence(rig: &CalibratedRig, output: &Path) -> String {
    let baseline = |k: usize| match &rig.cameras[k].mount {
        _ if k == 0 => String::new(),
        mount => {
            format!(", {:.2} ± {:.2} mm from the first", 1000.0 * mount.baseline, 1000.0 * mount.baseline_deviation)
        }
    };
    let line =
        |(k, c): (usize, &crate::MountedCamera)| format!("{}: {}{}\n", c.name, numbers(&c.calibrated), baseline(k));
    let lines: String = rig.cameras.iter().enumerate().map(line).collect();
    format!("{lines}reprojection {:.3} px, in {}", rig.rms_px, output.display())
}

fn numbers(calibrated: &CalibratedCamera) -> String {
    let camera = &calibrated.camera.camera;
    let images = &calibrated.images;
    let found = images.iter().filter(|i| i.found).count();
    let used = images.iter().filter(|i| i.used).count();
    let some = if used < found { format!(", {used} used") } else { String::new() };
    format!(
        "{found} of {} boards{some}, fx {:.2} fy {:.2} cx {:.2} cy {:.2} k1 {:.4} k2 {:.4}, reprojection {:.3} px",
        images.len(),
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        camera.k1,
        camera.k2,
        calibrated.rms_px,
    )
}

fn named(text: &str) -> Result<(String, PathBuf), String> {
    let parts = text.split_once('=').filter(|(name, path)| !name.is_empty() && !path.is_empty());
    parts.map(|(name, path)| (name.to_owned(), path.into())).ok_or_else(|| "NAME=PICTURES, like left=DIR".to_owned())
}
