//! A bar for each picture: the error of its corners, and the same with a camera that has not seen it.

use super::{Bounds, PictureInput, PicturedCamera};
use crate::calibrate::BoardImage;
use drawing::style::{ACCENT, Area, GREY, HAIR, INK, LEADING, MIDDLE, SMALL, THIN, TINY, plain, round_up, title};
use drawing::{Anchor, Drawing, Stroke, Text, text_width, wrap};
use geometry::Vec2;

/// Widest bar, mm.
const WIDEST: f64 = 5.0;
/// Least distance between two numbers below the bars, mm.
const APART: f64 = 4.0;
/// Lines of notes below a chart, at most.
const NOTES: usize = 5;

/// One chart for each camera.
pub fn bars(drawing: &mut Drawing, area: Area, input: &PictureInput) {
    let remark = "bar: its corners; line: hold-out error";
    let area = title(drawing, area, "Error of each picture, px", remark);
    let count = input.cameras.len().max(1);
    for (camera, part) in input.cameras.iter().zip(area.rows(count, 3.0)) {
        let room = (NOTES / count).max(1);
        let notes = notes(camera, part.size.x, room);
        let height = LEADING * SMALL * notes.len() as f64;
        chart(drawing, part.without(7.0, 0.0, 0.0, height + 4.5), camera);
        for (k, (note, is_bad)) in notes.into_iter().enumerate() {
            let at = Vec2::new(part.from.x, part.to().y - height + LEADING * SMALL * (k as f64 + 0.9));
            drawing.text(Text::new(note, at, SMALL).coloured(if is_bad { ACCENT } else { GREY }));
        }
    }
}

fn chart(drawing: &mut Drawing, area: Area, camera: &PicturedCamera) {
    let images = &camera.calibrated.images;
    let errors = images.iter().flat_map(|i| [i.rms_px, i.hold_out_rms_px]).flatten().filter(|e| e.is_finite());
    let largest = errors.fold(0.0, f64::max);
    let step = round_up(largest / 4.0);
    let top = step * (largest / step).ceil().max(1.0);
    let height = |error: f64| area.size.y * error / top;
    for k in 0..=(top / step).round() as usize {
        let y = area.to().y - height(k as f64 * step);
        drawing.line(&[Vec2::new(area.from.x, y), Vec2::new(area.to().x, y)], if k == 0 { THIN } else { HAIR });
        let at = Vec2::new(area.from.x - 1.0, y + 0.36 * TINY);
        drawing.text(Text::new(plain(k as f64 * step), at, TINY).anchored(Anchor::End).coloured(GREY));
    }
    let pitch = area.size.x / images.len().max(1) as f64;
    let bounds = Bounds::of(camera.calibrated);
    for (k, image) in images.iter().enumerate() {
        let foot = Vec2::new(area.from.x + (k as f64 + 0.5) * pitch, area.to().y);
        bar(drawing, foot, (0.7 * pitch).min(WIDEST), image, bounds.is_bad(image), height);
    }
    numbers(drawing, area, camera, pitch);
    let name = Text::new(camera.name, Vec2::new(area.to().x, area.from.y + 0.9 * SMALL), SMALL);
    drawing.text(Text { rim: 0.5, ..name.anchored(Anchor::End).coloured(INK) });
}

/// Numbers of pictures below their bars: first those that are pointed out, then as many others as have room.
fn numbers(drawing: &mut Drawing, area: Area, camera: &PicturedCamera, pitch: f64) {
    let (images, bounds) = (&camera.calibrated.images, Bounds::of(camera.calibrated));
    let mut taken: Vec<f64> = Vec::new();
    for is_first in [true, false] {
        for (k, image) in images.iter().enumerate() {
            let x = area.from.x + (k as f64 + 0.5) * pitch;
            let is_pointed_out = bounds.is_bad(image) || !image.found;
            let apart = if is_first { text_width("000", TINY) } else { APART };
            if is_pointed_out != is_first || taken.iter().any(|other| (x - other).abs() < apart) {
                continue;
            }
            taken.push(x);
            let text = Text::new((k + 1).to_string(), Vec2::new(x, area.to().y + 1.3 * TINY), TINY);
            drawing.text(text.anchored(Anchor::Middle).coloured(if is_first { ACCENT } else { GREY }));
        }
    }
}

fn bar(drawing: &mut Drawing, foot: Vec2, width: f64, image: &BoardImage, bad: bool, height: impl Fn(f64) -> f64) {
    let left = foot - Vec2::new(width / 2.0, 0.0);
    if let Some(rms) = image.rms_px.filter(|e| e.is_finite()) {
        let up = Vec2::new(0.0, height(rms));
        drawing.rectangle(left - up, Vec2::new(width, up.y), if bad { ACCENT } else { MIDDLE });
    }
    if let Some(held_out) = image.hold_out_rms_px.filter(|e| e.is_finite()) {
        let at = left - Vec2::new(0.1 * width, height(held_out));
        drawing.line(&[at, at + Vec2::new(1.2 * width, 0.0)], Stroke { colour: INK, width: 0.35 });
    }
}

/// What there is to say about single pictures, and whether it is about a bad fit; no more lines than there is room for.
fn notes(camera: &PicturedCamera, width: f64, room: usize) -> Vec<(String, bool)> {
    let bounds = Bounds::of(camera.calibrated);
    let mut notes: Vec<(String, bool)> = Vec::new();
    let mut missing: Vec<(&str, Vec<String>)> = Vec::new();
    for (k, image) in camera.calibrated.images.iter().enumerate() {
        let number = (k + 1).to_string();
        if let (true, Some(rms)) = (bounds.is_bad(image), image.rms_px) {
            let held_out = image.hold_out_rms_px.map_or(String::new(), |error| format!(", left out {error:.3} px"));
            notes.push((format!("{number} fits badly, {rms:.3} px{held_out}: {}", image.name), true));
        } else if !image.found {
            let reason = image.reason.as_deref().unwrap_or("no board found");
            match missing.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, numbers)) => numbers.push(number),
                None => missing.push((reason, vec![number])),
            }
        }
    }
    notes.extend(
        missing
            .into_iter()
            .map(|(reason, numbers)| (format!("{} without a board: {reason}", numbers.join(", ")), true)),
    );
    let rest = notes.len().saturating_sub(room);
    if rest > 0 {
        notes.truncate(room - 1);
        notes.push((format!("and {} more like these", rest + 1), false));
    }
    notes.into_iter().map(|(note, is_bad)| (shorten(note, width), is_bad)).collect()
}

/// A note's beginning that is no wider than `width` mm.
fn shorten(note: String, width: f64) -> String {
    if text_width(&note, SMALL) <= width {
        return note;
    }
    let begin = wrap(&note, SMALL, width - text_width("…", SMALL)).into_iter().next().unwrap_or_default();
    format!("{}…", begin.trim_end_matches([',', ':', ';', ' ']))
}
