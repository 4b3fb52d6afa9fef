//! One function per command: arguments in, library call, files out.

use super::{Arguments, BoardArguments, Command};
use facewright::board::{SheetOptions, sheet};
use facewright::calibration_picture::{PictureInput, PicturedCamera};
use facewright::drawing::Format;
use facewright::{
    Assets, CalibrateOptions, FacewrightError, FrameSet, MatchOptions, ReconstructOptions, SourcedCamera, calibrate,
    calibration_picture, check_folder, match_pair, overlay, reconstruct, write_json,
};
use geometry::{Progress, Transform};
use serde_json::{Value, json};
use std::path::Path;

/// What a command says when it is done.
pub struct Summary {
    text: String,
    json: Value,
}

impl Summary {
    /// Prints the sentence, or the JSON.
    #[expect(clippy::print_stdout, reason = "the program's own output")]
    pub fn print(&self, as_json: bool) {
        if as_json { println!("{}", self.json) } else { println!("{}", self.text) }
    }
}

/// Runs a command.
pub fn execute(arguments: &Arguments, progress: &Progress) -> Result<Summary, FacewrightError> {
    match &arguments.command {
        Command::Board { board, page, no_mark, dpi, output } => {
            let options = SheetOptions { page: (*page).into(), mark: !no_mark };
            sheet(&board.board(), &options)?.write(output, *dpi)?;
            let text = format!("{}: print at 100 % and check the rulers", output.display());
            Ok(Summary { text, json: json!({ "board": output }) })
        }
        Command::Calibrate { pictures, board, output, picture } => {
            run_calibrate(pictures, board, output, picture.as_deref(), progress)
        }
        Command::Match { a, b, camera, method, window, output } => {
            let options = MatchOptions { method: (*method).into(), window: *window, ..MatchOptions::default() };
            let camera = camera.as_deref().map(SourcedCamera::read).transpose()?;
            let assets = load_assets(arguments)?;
            let matches = match_pair(a, b, camera.as_ref(), &assets, &options, progress)?;
            write_json(output, &matches)?;
            let pair = &matches.pairs[0];
            let kept = pair.points.iter().filter(|p| p.4 == 1).count();
            let text = format!("{kept} of {} matches kept, in {}", pair.points.len(), output.display());
            Ok(Summary { text, json: json!(matches) })
        }
        Command::Reconstruct { frames, camera, method, texture_size, interocular_mm, output } => {
            let options = ReconstructOptions {
                method: (*method).into(),
                camera: camera.as_deref().map(SourcedCamera::read).transpose()?,
                texture_size: *texture_size,
                interocular: interocular_mm.map(|mm| mm / 1000.0),
            };
            check_folder(output)?;
            let frames = FrameSet::open(frames, progress)?;
            let result = reconstruct(&frames, &load_assets(arguments)?, &options, progress)?;
            result.write(output)?;
            let used = result.report.frames.iter().filter(|f| f.used).count();
            let warnings: String = result.report.warnings.iter().map(|w| format!("\nwarning: {w}")).collect();
            let text = format!("{}: {used} of {} frames used{warnings}", output.display(), frames.len());
            Ok(Summary { text, json: json!(result.report) })
        }
        Command::Overlay { result, frames, output } => {
            check_folder(output)?;
            let frames = FrameSet::open(frames, progress)?;
            let drawn = overlay(result, &frames, output, progress)?;
            let text = format!("{}: {} of {} frames drawn", output.display(), drawn.len(), frames.len());
            Ok(Summary { text, json: json!({ "drawn": drawn }) })
        }
    }
}

fn run_calibrate(
    pictures: &[std::path::PathBuf],
    board: &BoardArguments,
    output: &Path,
    picture: Option<&Path>,
    progress: &Progress,
) -> Result<Summary, FacewrightError> {
    // Another kind of picture is refused before the work, not after it.
    picture.map(Format::of).transpose()?;
    if board.squares.is_some() {
        return Err(FacewrightError::Option { name: "the board", expected: "a checkerboard" });
    }
    let options = CalibrateOptions { inner: board.inner, square: board.square_mm / 1000.0 };
    let calibrated = calibrate(&FrameSet::open(pictures, progress)?, &options, progress)?;
    if let Some(path) = picture {
        let only =
            PicturedCamera { name: "", calibrated: &calibrated, camera_from_rig: Transform::identity(), corners: &[] };
        let input = PictureInput { cameras: &[only], board: board.board() };
        calibration_picture::picture(&input).write(path, calibration_picture::DPI)?;
    }
    write_json(output, &calibrated)?;
    let camera = &calibrated.camera.camera;
    let warnings: String = calibrated.warnings.iter().map(|w| format!("\nwarning: {w}")).collect();
    let text = format!(
        "{} of {} boards, fx {:.2} fy {:.2} cx {:.2} cy {:.2} k1 {:.4} k2 {:.4}, reprojection {:.3} px, in {}{warnings}",
        calibrated.images.iter().filter(|i| i.found).count(),
        calibrated.images.len(),
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        camera.k1,
        camera.k2,
        calibrated.rms_px,
        output.display()
    );
    Ok(Summary { text, json: json!(calibrated) })
}

fn load_assets(arguments: &Arguments) -> Result<Assets, FacewrightError> {
    Assets::load(&arguments.assets.clone().unwrap_or_else(Assets::default_folder))
}
