//! What must hold in a `camera.json` with its pictures, and in a `rig.json`.

use super::{BoardImage, CalibratedCamera, CalibratedRig, MountedCamera};
use crate::formats::{Format, at_least_0, finite, once};
use geometry::{Board, Pattern};

impl Format for CalibratedCamera {
    const FILE: &'static str = "camera.json";
    const HOLDS: &'static str = "camera";
    const KEYS: &'static [&'static str] = &["width"];

    fn validate(&self) -> Result<(), String> {
        self.camera.camera.validate().map_err(|e| e.to_string())?;
        at_least_0(self.rms_px, || "its rms_px".to_owned())?;
        at_least_0(self.hold_out_rms_px, || "its hold_out_rms_px".to_owned())?;
        self.boards.iter().enumerate().try_for_each(|(k, board)| validate_board(k, board))?;
        self.images.iter().try_for_each(|image| validate_image(image, self.boards.len()))
    }
}

fn validate_board(number: usize, board: &Board) -> Result<(), String> {
    let gap = match board.pattern {
        Pattern::Checkerboard => 1.0,
        Pattern::Squares { gap } => gap,
    };
    let sides = [board.square, gap, f64::from(board.columns), f64::from(board.rows)];
    let possible = sides.iter().all(|side| *side > 0.0 && side.is_finite());
    if possible { Ok(()) } else { Err(format!("board number {number} has no squares")) }
}

fn validate_image(image: &BoardImage, boards: usize) -> Result<(), String> {
    let name = &image.name;
    if let Some(board) = image.board.filter(|board| *board >= boards) {
        return Err(format!("picture {name} shows board {board}, and there are {boards}"));
    }
    for (key, value) in
        [("rms_px", image.rms_px), ("worst_px", image.worst_px), ("hold_out_rms_px", image.hold_out_rms_px)]
    {
        at_least_0(value, || format!("the {key} of picture {name}"))?;
    }
    Ok(())
}

impl Format for CalibratedRig {
    const FILE: &'static str = "rig.json";
    const HOLDS: &'static str = "rig";
    const KEYS: &'static [&'static str] = &["cameras"];

    fn validate(&self) -> Result<(), String> {
        once(self.cameras.iter().map(|camera| camera.name.as_str()), "camera")?;
        at_least_0(self.rms_px, || "its rms_px".to_owned())?;
        at_least_0(self.hold_out_rms_px, || "its hold_out_rms_px".to_owned())?;
        self.cameras.iter().try_for_each(validate_mounted)
    }
}

fn validate_mounted(camera: &MountedCamera) -> Result<(), String> {
    let (name, mount) = (&camera.name, &camera.mount);
    camera.calibrated.validate().map_err(|reason| format!("camera {name}: {reason}"))?;
    mount.covariance.iter().try_for_each(|row| finite(row, || format!("the covariance of camera {name}")))?;
    for sigma in mount.rotation_deviations.iter().chain(&mount.translation_deviations) {
        at_least_0(*sigma, || format!("a standard deviation of camera {name}"))?;
    }
    at_least_0(mount.baseline, || format!("the baseline of camera {name}"))?;
    at_least_0(mount.baseline_deviation, || format!("the baseline_deviation of camera {name}"))
}
