//! A calibration in one picture, on A4 across: where the boards were, where their corners, how well they fit, the numbers.
//!
//! # Entry points
//! - [`of_camera`] and [`of_rig`]: a calibration in, a [`Drawing`] out; its `write` makes SVG, PDF or PNG.
//!
//! # Conventions
//! Pictures are numbered from 1, everywhere alike. Greys throughout; the one colour is for what deserves a look: pictures
//! without a board, and those that fit more than [`BAD`] times worse than the median. Lengths on the page are millimetres.

mod bars;
mod frame;
mod numbers;
mod scene;
mod space;

use crate::calibrate::BoardImage;
use crate::pictures::board::describe;
use crate::{CalibratedCamera, CalibratedRig, MountedCamera};
pub use ::drawing::DPI;
use drawing::style::{Area, GREY, INK, SMALL};
use drawing::{Anchor, Drawing, Text};
use geometry::{Board, Transform, Vec2};
use scene::Scene;

/// How many times worse than the median picture one must fit to be pointed out.
pub const BAD: f64 = 2.0;

/// One of the cameras of a rig, or the only one.
#[derive(Clone, Copy, Debug)]
struct PicturedCamera<'a> {
    /// What to call it.
    name: &'a str,
    /// Its calibration. The k-th pictures of all cameras show the board in one place.
    calibrated: &'a CalibratedCamera,
    /// Where it is; the identity for the only camera.
    camera_from_rig: Transform,
}

impl<'a> PicturedCamera<'a> {
    fn of(mounted: &'a MountedCamera) -> Self {
        let MountedCamera { name, calibrated, mount } = mounted;
        Self { name, calibrated, camera_from_rig: mount.camera_from_rig }
    }
}

/// What is pictured.
#[derive(Clone, Copy, Debug)]
struct PictureInput<'a> {
    /// The cameras, the only one or those of a rig: up to four are readable.
    cameras: &'a [PicturedCamera<'a>],
    /// The board.
    board: Board,
}

/// The picture of one camera's calibration, 297 × 210 mm.
pub fn of_camera(calibrated: &CalibratedCamera) -> Drawing {
    let camera = PicturedCamera { name: "", calibrated, camera_from_rig: Transform::identity() };
    picture(&PictureInput { cameras: &[camera], board: board_shown(calibrated) })
}

/// The same of a rig's.
pub fn of_rig(rig: &CalibratedRig) -> Drawing {
    let cameras: Vec<PicturedCamera> = rig.cameras.iter().map(PicturedCamera::of).collect();
    picture(&PictureInput { cameras: &cameras, board: board_shown(&rig.cameras[0].calibrated) })
}

/// The board that most pictures show.
fn board_shown(calibrated: &CalibratedCamera) -> Board {
    let pictures = |k: &usize| calibrated.images.iter().filter(|image| image.board == Some(*k)).count();
    let most = (0..calibrated.boards.len()).max_by_key(|k| (pictures(k), std::cmp::Reverse(*k)));
    most.map_or_else(|| Board::checkerboard(9, 6, 0.0255), |k| calibrated.boards[k])
}

fn picture(input: &PictureInput) -> Drawing {
    let mut drawing = Drawing::new(Vec2::new(297.0, 210.0));
    header(&mut drawing, input);
    let scene = Scene::new(input);
    space::oblique(&mut drawing, Area::new(12.0, 24.0, 176.0, 106.0), &scene);
    let right = Area::new(196.0, 24.0, 89.0, 176.0);
    let below = frame::frames(&mut drawing, right.without(0.0, 0.0, 0.0, 76.0), input);
    bars::bars(&mut drawing, Area::new(12.0, 138.0, 112.0, 62.0), input);
    space::above(&mut drawing, Area::new(132.0, 138.0, 56.0, 62.0), &scene);
    numbers::numbers(&mut drawing, right.without(0.0, below + 8.0 - right.from.y, 0.0, 0.0), input);
    drawing
}

fn header(drawing: &mut Drawing, input: &PictureInput) {
    let heading = if input.cameras.len() > 1 { "Calibration of the cameras" } else { "Calibration of the camera" };
    drawing.text(Text::new(heading, Vec2::new(12.0, 15.0), 5.0).coloured(INK));
    let found = input.cameras.iter().flat_map(|c| &c.calibrated.images);
    let (found, all) = found.fold((0, 0), |(found, all), image| (found + usize::from(image.found), all + 1));
    let line = format!("{found} of {all} pictures, {}", describe(&input.board));
    drawing.text(Text::new(line, Vec2::new(285.0, 15.0), SMALL).anchored(Anchor::End).coloured(GREY));
}

/// The largest that a picture's error may be without being pointed out, pixels: of all corners, and held out.
struct Bounds {
    rms: f64,
    hold_out: f64,
}

impl Bounds {
    fn of(camera: &CalibratedCamera) -> Self {
        let bound = |error: fn(&BoardImage) -> Option<f64>| {
            let mut errors: Vec<f64> = camera.images.iter().filter_map(error).filter(|e| e.is_finite()).collect();
            errors.sort_by(f64::total_cmp);
            errors.get(errors.len() / 2).map_or(f64::INFINITY, |median| BAD * median)
        };
        Self { rms: bound(|i| i.rms_px), hold_out: bound(|i| i.hold_out_rms_px) }
    }

    fn is_bad(&self, image: &BoardImage) -> bool {
        let beyond = |error: Option<f64>, bound: f64| error.is_some_and(|e| e > bound);
        beyond(image.rms_px, self.rms) || beyond(image.hold_out_rms_px, self.hold_out)
    }
}

#[cfg(test)]
mod tests;
