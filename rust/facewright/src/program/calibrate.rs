//! The commands about cameras: `calibrate`, alone and for rigs, and `undistort`.

use super::commands::Summary;
use super::{BoardArguments, Command, LensArguments};
use drawing::{DPI, Format};
use facewright::pictures::calibration::{of_camera, of_rig};
use facewright::{
    CalibrateOptions, CalibratedCamera, FacewrightError, FrameSet, RigInput, SourcedCamera, calibrate, calibrate_rig,
    check_folder, undistort, write_drawing, write_json,
};
use geometry::Progress;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Runs `calibrate` or `undistort`.
pub fn execute(command: &Command, progress: &Progress) -> Result<Summary, FacewrightError> {
    match command {
        Command::Calibrate { pictures, rig, board, lens, output, picture } => {
            // Another kind of picture is refused before the work, not after it.
            picture.as_deref().map(Format::of).transpose()?;
            let options = options(board, lens);
            let file = |name: &str| output.clone().unwrap_or_else(|| name.into());
            if rig.is_empty() {
                one(pictures, &options, &file("camera.json"), picture.as_deref(), progress)
            } else {
                several(rig, &options, &file("rig.json"), picture.as_deref(), progress)
            }
        }
        Command::Undistort { pictures, camera, keep, output } => {
            check_folder(output)?;
            let camera = SourcedCamera::read(camera)?;
            let frames = FrameSet::open(pictures, progress)?;
            let pinhole = undistort(&frames, &camera, (*keep).into(), output, progress)?;
            let text = format!("{} pictures without distortion in {}", frames.len(), output.display());
            Ok(Summary { text, json: json!(pinhole) })
        }
        _ => Err(FacewrightError::Option { name: "the command", expected: "calibrate or undistort" }),
    }
}

fn options(board: &BoardArguments, lens: &LensArguments) -> CalibrateOptions {
    CalibrateOptions {
        boards: board.boards(),
        square_pixels: lens.square_pixels,
        distortion_terms: usize::from(lens.distortion_terms),
        tangential: lens.tangential,
        bend: lens.bend.into(),
    }
}

fn one(
    pictures: &[PathBuf],
    options: &CalibrateOptions,
    output: &Path,
    drawn: Option<&Path>,
    progress: &Progress,
) -> Result<Summary, FacewrightError> {
    let calibrated = calibrate(&FrameSet::open(pictures, progress)?, options, progress)?;
    drawn.map_or(Ok(()), |file| write_drawing(file, &of_camera(&calibrated), DPI))?;
    write_json(output, &calibrated)?;
    let text = format!("{}, in {}{}", numbers(&calibrated), output.display(), listed(&calibrated.warnings));
    Ok(Summary { text, json: json!(calibrated) })
}

fn several(
    rig: &[(String, PathBuf)],
    options: &CalibrateOptions,
    output: &Path,
    drawn: Option<&Path>,
    progress: &Progress,
) -> Result<Summary, FacewrightError> {
    let open = |(name, path): &(String, PathBuf)| {
        let pictures = FrameSet::open(std::slice::from_ref(path), progress)?;
        Ok(RigInput { name: name.clone(), pictures })
    };
    let cameras: Vec<RigInput> = rig.iter().map(open).collect::<Result<_, FacewrightError>>()?;
    let calibrated = calibrate_rig(&cameras, options, progress)?;
    let each = calibrated.cameras.iter();
    drawn.map_or(Ok(()), |file| write_drawing(file, &of_rig(&calibrated), DPI))?;
    write_json(output, &calibrated)?;
    let baseline = |k: usize| match &calibrated.cameras[k] {
        _ if k == 0 => String::new(),
        c => {
            format!(", {:.2} ± {:.2} mm from the first", 1000.0 * c.mount.baseline, 1000.0 * c.mount.baseline_deviation)
        }
    };
    let lines: String =
        each.enumerate().map(|(k, c)| format!("{}: {}{}\n", c.name, numbers(&c.calibrated), baseline(k))).collect();
    let text = format!(
        "{lines}reprojection {:.3} px, in {}{}",
        calibrated.rms_px,
        output.display(),
        listed(&calibrated.warnings)
    );
    Ok(Summary { text, json: json!(calibrated) })
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

fn listed(warnings: &[String]) -> String {
    warnings.iter().map(|w| format!("\nwarning: {w}")).collect()
}
