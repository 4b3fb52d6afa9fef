//! All corners over the camera's frame: where the picture was covered, and by how much they were missed.

use super::{Bounds, PictureInput, PicturedCamera};
use crate::calibrate::BoardImage;
use drawing::style::{ACCENT, Area, GREY, INK, MIDDLE, SMALL, THIN, plain, title};
use drawing::{Colour, Drawing, Stroke, Text};
use geometry::{Board, Transform, Vec2};

/// Length that nearly all residuals stay below, mm.
const LONGEST: f64 = 4.0;

/// One frame for each camera; where they end.
pub fn frames(drawing: &mut Drawing, area: Area, input: &PictureInput) -> f64 {
    let pictures: Vec<_> = input.cameras.iter().map(|camera| corners(camera, &input.board)).collect();
    let factors = input
        .cameras
        .iter()
        .zip(&pictures)
        .filter_map(|(camera, pictures)| exaggeration(camera, pictures, area.size.x));
    let factor = factors.min_by(f64::total_cmp);
    let remark = factor.map_or(String::new(), |factor| format!("errors drawn {} times as long", plain(factor)));
    let area = title(drawing, area, "Corners in the picture", &remark);
    let columns = if input.cameras.len() > 1 { 2 } else { 1 };
    let rows = input.cameras.len().div_ceil(columns).max(1);
    let parts = area.rows(rows, 2.0).flat_map(|row| row.columns(columns, 3.0));
    let mut end = area.from.y;
    for ((camera, pictures), part) in input.cameras.iter().zip(&pictures).zip(parts) {
        end = end.max(frame(drawing, part, camera, pictures, factor));
    }
    end
}

/// Draws a frame; where it ends.
fn frame(
    drawing: &mut Drawing,
    area: Area,
    camera: &PicturedCamera,
    pictures: &[Vec<SeenCorner>],
    factor: Option<f64>,
) -> f64 {
    let lens = &camera.calibrated.camera.camera;
    let size = Vec2::new(f64::from(lens.width), f64::from(lens.height));
    let mut page = area.without(0.0, 0.0, 0.0, 5.0).fit(size);
    page.from.y = area.from.y;
    let place = |pixel: &Vec2| page.from + (pixel.add_scalar(0.5)).component_div(&size).component_mul(&page.size);
    let bounds = Bounds::of(camera.calibrated);
    for (image, corners) in camera.calibrated.images.iter().zip(pictures) {
        let is_bad = bounds.is_bad(image);
        corners.iter().filter(|c| page_has(&size, &c.seen)).for_each(|c| {
            drawing.disc(place(&c.seen), 0.28, if is_bad { ACCENT } else { MIDDLE });
        });
        let Some(factor) = factor else { continue };
        let stroke = Stroke { colour: if is_bad { ACCENT } else { GREY }, width: 0.14 };
        for corner in corners.iter().filter(|c| page_has(&size, &c.seen)) {
            let (from, missed) = (place(&corner.seen), corner.seen - corner.projected);
            let to = place(&(corner.seen + factor * missed)).sup(&page.from).inf(&page.to());
            drawing.line(&[from, to], stroke);
        }
    }
    principal_point(drawing, place(&Vec2::new(lens.cx, lens.cy)), page);
    let [a, b] = [page.from, page.to()];
    drawing.polygon(&[a, Vec2::new(b.x, a.y), b, Vec2::new(a.x, b.y)], None, Some(THIN));
    let count: usize = pictures.iter().map(Vec::len).sum();
    let name = if camera.name.is_empty() { String::new() } else { format!("{}: ", camera.name) };
    drawing.text(Text::new(format!("{name}{count} corners"), Vec2::new(a.x, b.y + 3.6), SMALL).coloured(GREY));
    b.y + 3.6
}

fn page_has(size: &Vec2, pixel: &Vec2) -> bool {
    let inside = |v: f64, end: f64| (-0.5..=end - 0.5).contains(&v);
    inside(pixel.x, size.x) && inside(pixel.y, size.y)
}

/// A cross where the optical axis meets the picture.
fn principal_point(drawing: &mut Drawing, at: Vec2, page: Area) {
    if at >= page.from && at <= page.to() {
        for (colour, width) in [(Colour::WHITE, 0.9), (INK, 0.3)] {
            for arm in [Vec2::new(1.6, 0.0), Vec2::new(0.0, 1.6)] {
                drawing.line(&[at - arm, at + arm], Stroke { colour, width });
            }
        }
    }
}

/// A corner as it was seen, and where the calibrated camera puts it, pixels.
#[derive(Clone, Copy)]
struct SeenCorner {
    seen: Vec2,
    projected: Vec2,
}

/// The corners of each picture; where the file has none, the board's as the camera projects them.
fn corners(camera: &PicturedCamera, board: &Board) -> Vec<Vec<SeenCorner>> {
    let (calibrated, points) = (camera.calibrated, board.points());
    let project = |pose: &Transform, p: &Vec2| calibrated.camera.camera.project(&pose.apply(&p.push(0.0)));
    let without_any = calibrated.images.iter().all(|image| image.corners.is_empty());
    let image = |image: &BoardImage| -> Vec<SeenCorner> {
        let known = image.corners.iter().map(|&crate::SeenCorner(_, seen, error)| {
            let seen = Vec2::from(seen);
            SeenCorner { seen, projected: seen - Vec2::from(error) }
        });
        let pose = image.cam_from_board.filter(|_| without_any);
        let guessed = points.iter().filter_map(|p| project(&pose?, p));
        let all = known.chain(guessed.map(|pixel| SeenCorner { seen: pixel, projected: pixel }));
        all.filter(|c| c.seen.iter().chain(&c.projected).all(|v| v.is_finite())).collect()
    };
    calibrated.images.iter().map(image).collect()
}

/// The round factor with which 19 of 20 residuals are shorter than [`LONGEST`] in a frame `width` mm wide; `None` without
/// residuals.
fn exaggeration(camera: &PicturedCamera, pictures: &[Vec<SeenCorner>], width: f64) -> Option<f64> {
    let mm_per_pixel = width / f64::from(camera.calibrated.camera.camera.width);
    let mut lengths: Vec<f64> = pictures.iter().flatten().map(|c| (c.seen - c.projected).norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let long = *lengths.get(lengths.len() * 19 / 20)?;
    let factor = LONGEST / (long * mm_per_pixel);
    (long > 1e-9).then(|| {
        let power = 10f64.powf(factor.log10().floor());
        [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|f| *f <= factor).unwrap_or(power)
    })
}
