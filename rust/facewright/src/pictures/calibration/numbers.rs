//! The camera's numbers with their standard deviations, and what to distrust.

use super::{PictureInput, PicturedCamera};
use crate::CalibratedCamera;
use drawing::style::{ACCENT, Area, GREY, HAIR, INK, LEADING, SMALL, title, with_minus};
use drawing::{Anchor, Drawing, Text, wrap};
use geometry::Vec2;

/// Distance of two rows, mm.
const ROW: f64 = 4.3;

/// Widest column of numbers, mm.
const WIDEST: f64 = 32.0;
/// Part of the width that the rows' names take.
const NAMES: f64 = 0.4;

/// A table with a column for each camera, and everyone's warnings.
pub fn numbers(drawing: &mut Drawing, area: Area, input: &PictureInput) {
    let area = title(drawing, area, "Camera and standard deviations", "");
    let mut y = area.from.y;
    let columns: Vec<Area> =
        area.without(NAMES * area.size.x, 0.0, 0.0, 0.0).columns(input.cameras.len().max(1), 1.0).collect();
    if input.cameras.len() > 1 {
        for (camera, column) in input.cameras.iter().zip(&columns) {
            drawing.text(Text::new(camera.name, Vec2::new(middle(column), y + 0.7 * ROW), SMALL).coloured(INK));
        }
        y += ROW;
    }
    for (name, value) in ROWS {
        let base = y + 0.7 * ROW;
        drawing.text(Text::new(name, Vec2::new(area.from.x, base), SMALL).coloured(GREY));
        for (camera, column) in input.cameras.iter().zip(&columns) {
            let (value, deviation) = value(camera.calibrated);
            let at = Vec2::new(middle(column), base);
            drawing.text(Text::new(value, at, SMALL).anchored(Anchor::End).coloured(INK));
            drawing.text(Text::new(deviation, at + Vec2::new(0.8, 0.0), SMALL).coloured(GREY));
        }
        y += ROW;
        drawing.line(&[Vec2::new(area.from.x, y), Vec2::new(area.to().x, y)], HAIR);
    }
    warnings(drawing, area.without(0.0, y + 1.5 - area.from.y, 0.0, 0.0), input);
}

/// Where the values of a column end and their deviations begin.
fn middle(column: &Area) -> f64 {
    column.from.x + 0.55 * column.size.x.min(WIDEST)
}

fn warnings(drawing: &mut Drawing, area: Area, input: &PictureInput) {
    let of = |camera: &PicturedCamera| {
        let name = if camera.name.is_empty() { String::new() } else { format!("{}: ", camera.name) };
        camera.calibrated.warnings.iter().map(|w| format!("{name}{w}")).collect::<Vec<_>>()
    };
    let lines: Vec<String> = input.cameras.iter().flat_map(of).flat_map(|w| wrap(&w, SMALL, area.size.x)).collect();
    let room = (area.size.y / (LEADING * SMALL)) as usize;
    for (k, line) in lines.iter().take(room).enumerate() {
        let is_cut = k + 1 == room && lines.len() > room;
        let line = if is_cut { "… more in the camera's file" } else { line };
        let at = area.from + Vec2::new(0.0, LEADING * SMALL * (k as f64 + 1.0));
        drawing.text(Text::new(line, at, SMALL).coloured(ACCENT));
    }
}

/// A value and what stands behind it.
type Value = fn(&CalibratedCamera) -> (String, String);

/// The rows of the table.
const ROWS: [(&str, Value); 10] = [
    ("focal length fx, px", |c| with_deviation(c.camera.camera.fx, c.deviations.fx)),
    ("focal length fy, px", |c| with_deviation(c.camera.camera.fy, c.deviations.fy)),
    ("principal point cx, px", |c| with_deviation(c.camera.camera.cx, c.deviations.cx)),
    ("principal point cy, px", |c| with_deviation(c.camera.camera.cy, c.deviations.cy)),
    ("distortion k1", |c| with_deviation(c.camera.camera.k1, c.deviations.k1)),
    ("distortion k2", |c| with_deviation(c.camera.camera.k2, c.deviations.k2)),
    ("picture, px", |c| times(f64::from(c.camera.camera.width), f64::from(c.camera.camera.height), 0)),
    ("field of view, degrees", |c| {
        let angle = |size: u32, focal: f64| (2.0 * (0.5 * f64::from(size) / focal).atan()).to_degrees();
        let camera = &c.camera.camera;
        times(angle(camera.width, camera.fx), angle(camera.height, camera.fy), 1)
    }),
    ("error of all corners, px", |c| error(Some(c.rms_px))),
    ("hold-out error, px", |c| error(c.hold_out_rms_px)),
];

fn times(a: f64, b: f64, decimals: usize) -> (String, String) {
    (format!("{a:.decimals$}"), format!("× {b:.decimals$}"))
}

fn error(pixels: Option<f64>) -> (String, String) {
    let known = pixels.filter(|e| e.is_finite());
    (known.map_or("unknown".to_owned(), |e| format!("{e:.3}")), String::new())
}

/// A value to the second digit of its standard deviation, and that deviation.
fn with_deviation(value: f64, deviation: f64) -> (String, String) {
    if !(deviation.is_finite() && deviation > 0.0) {
        return (with_minus(format!("{value:.4}")), String::new());
    }
    let decimals = (1.0 - deviation.log10().floor()).clamp(0.0, 6.0) as usize;
    (with_minus(format!("{value:.decimals$}")), format!("± {deviation:.decimals$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_end_with_their_deviations_second_digit() {
        assert_eq!(with_deviation(615.3217, 0.412), ("615.32".to_owned(), "± 0.41".to_owned()));
        assert_eq!(with_deviation(1372.1, 13.4), ("1372".to_owned(), "± 13".to_owned()));
        assert_eq!(with_deviation(-0.18123, 0.0031), ("\u{2212}0.1812".to_owned(), "± 0.0031".to_owned()));
        assert_eq!(with_deviation(0.1, f64::NAN), ("0.1000".to_owned(), String::new()));
    }
}
