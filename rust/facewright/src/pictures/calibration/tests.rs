//! What is on the picture, and that it stays on the page.

use super::*;
use crate::calibrate::SeenCorner;
use crate::{CameraSource, SourcedCamera};
use drawing::{Format, Mark, Outline, Stroke};
use geometry::{Camera, Vec3};
use motion::calibrate::CameraDeviations;
use nalgebra::Rotation3;

fn lens() -> Camera {
    Camera { fy: 698.0, cx: 315.0, cy: 243.0, k1: -0.2, k2: 0.05, ..Camera::centred(640, 480, 700.0) }
}

/// A number between −1 and 1 that depends on its arguments alone.
fn chance(a: usize, b: usize) -> f64 {
    let mixed = (a as u64 * 0x9e37_79b9_7f4a_7c15) ^ (b as u64 + 1).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed.wrapping_mul(0x94d0_49bb_1331_11eb) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// `count` pictures of a board; those whose numbers are `missing` show none, the one that is `bad` fits badly.
fn calibrated(count: usize, missing: &[usize], bad: Option<usize>) -> CalibratedCamera {
    let image = |k: usize| {
        let found = !missing.contains(&k);
        let turn = Rotation3::from_euler_angles(0.6 * chance(k, 0), 0.6 * chance(k, 1), 0.5 * chance(k, 2));
        let at = Vec3::new(-0.1 + 0.1 * chance(k, 3), -0.06 + 0.07 * chance(k, 4), 0.7 + 0.2 * chance(k, 5));
        let rms = if bad == Some(k) { 1.1 } else { 0.15 + 0.05 * chance(k, 6) };
        BoardImage {
            name: format!("IMG_{k:04}"),
            found,
            used: found,
            reason: (!found).then(|| "no grid of 9x6 corners was found: is the whole board in the picture?".to_owned()),
            rms_px: found.then_some(rms),
            worst_px: found.then_some(3.0 * rms),
            hold_out_rms_px: found.then_some(1.15 * rms),
            cam_from_board: found.then_some(Transform::new(turn, at)),
            ..BoardImage::default()
        }
    };
    CalibratedCamera {
        schema: crate::Schema,
        camera: SourcedCamera { camera: lens(), source: CameraSource::Board },
        rms_px: 0.18,
        hold_out_rms_px: Some(0.21),
        deviations: CameraDeviations {
            fx: 0.61,
            fy: 0.58,
            cx: 0.9,
            cy: 0.71,
            k1: 0.004,
            k2: 0.011,
            ..Default::default()
        },
        bend: None,
        boards: vec![board()],
        images: (0..count).map(image).collect(),
        warnings: vec![
            "only 3 pictures of the board: ten to twenty, tilted to all sides, give a better camera".to_owned(),
        ],
    }
}

fn board() -> Board {
    Board::checkerboard(9, 6, 0.0255)
}

/// With corners and their errors.
fn noisy(mut calibrated: CalibratedCamera) -> CalibratedCamera {
    for (k, image) in calibrated.images.iter_mut().enumerate() {
        let (Some(pose), Some(rms)) = (image.cam_from_board, image.rms_px) else { continue };
        let corner = |(i, p): (usize, Vec2)| {
            let projected = lens().project(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap();
            let error = Vec2::new(chance(k, 2 * i + 100), chance(k, 2 * i + 101)) * 1.2 * rms;
            SeenCorner(i, (projected + error).into(), error.into())
        };
        image.corners = board().points().into_iter().enumerate().map(corner).collect();
    }
    calibrated
}

fn only(calibrated: &CalibratedCamera) -> PicturedCamera<'_> {
    PicturedCamera { name: "", calibrated, camera_from_rig: Transform::identity() }
}

fn picture_of(calibrated: &CalibratedCamera) -> Drawing {
    picture(&PictureInput { cameras: &[only(calibrated)], board: board() })
}

fn count(drawing: &Drawing, of: impl Fn(&Outline, Option<Stroke>) -> bool) -> usize {
    let is = |mark: &&Mark| match mark {
        Mark::Shape { outline, stroke, .. } => of(outline, *stroke),
        Mark::Text(_) | Mark::Picture { .. } => false,
    };
    drawing.marks.iter().filter(is).count()
}

fn discs(drawing: &Drawing, of: f64) -> usize {
    count(drawing, |outline, _| matches!(outline, Outline::Circle { radius, .. } if *radius == of))
}

fn rectangles(drawing: &Drawing) -> usize {
    count(drawing, |outline, _| matches!(outline, Outline::Rectangle { .. }))
}

fn says(drawing: &Drawing, words: &str) -> bool {
    drawing.marks.iter().any(|mark| matches!(mark, Mark::Text(text) if text.content.contains(words)))
}

fn assert_on_page(drawing: &Drawing) {
    let inside = |p: &Vec2| p.iter().zip(&drawing.size).all(|(v, end)| (0.0..=*end).contains(v));
    for mark in &drawing.marks {
        let is_inside = match mark {
            Mark::Shape { outline: Outline::Rectangle { from, size }, .. } => inside(from) && inside(&(from + size)),
            Mark::Shape { outline: Outline::Circle { centre, .. }, .. } => inside(centre),
            Mark::Shape { outline: Outline::Lines { points, .. }, .. } => points.iter().all(inside),
            Mark::Picture { from, size, .. } => inside(from) && inside(&(from + size)),
            Mark::Text(text) => {
                let width = drawing::text_width(&text.content, text.size);
                let (before, after) = match text.anchor {
                    Anchor::Start => (0.0, width),
                    Anchor::Middle => (width / 2.0, width / 2.0),
                    Anchor::End => (width, 0.0),
                };
                inside(&(text.at - Vec2::x() * before)) && inside(&(text.at + Vec2::x() * after))
            }
        };
        assert!(is_inside, "{mark:?}");
    }
}

#[test]
fn every_board_corner_and_error_is_drawn() {
    let calibrated = noisy(calibrated(12, &[], None));
    let drawing = picture_of(&calibrated);
    assert_on_page(&drawing);
    assert_eq!(discs(&drawing, 0.45), 2 * 12, "the marks of the boards, from two sides");
    let corners = calibrated.images.iter().flat_map(|image| &image.corners);
    let inside = corners.filter(|c| (0.0..639.0).contains(&c.1[0]) && (0.0..479.0).contains(&c.1[1]));
    assert_eq!(discs(&drawing, 0.28), inside.count());
    assert_eq!(rectangles(&drawing), 12);
    assert_eq!(count(&drawing, |_, stroke| stroke.is_some_and(|s| s.width == 0.14)), discs(&drawing, 0.28));
    assert!(says(&drawing, "errors drawn") && says(&drawing, "± 0.61") && says(&drawing, "12 of 12 pictures"));
}

#[test]
fn without_corners_the_projected_ones_show_what_was_covered() {
    let calibrated = calibrated(5, &[], None);
    let drawing = picture_of(&calibrated);
    assert!(discs(&drawing, 0.28) > 200 && !says(&drawing, "errors drawn") && says(&drawing, "270 corners"));
}

#[test]
fn a_missing_board_and_a_bad_one_are_named() {
    let calibrated = calibrated(9, &[3], Some(6));
    let drawing = picture_of(&noisy(calibrated));
    assert_on_page(&drawing);
    assert_eq!((rectangles(&drawing), discs(&drawing, 0.45)), (8, 16));
    assert!(says(&drawing, "4 without a board: no grid of 9x6") && says(&drawing, "7 fits badly, 1.100 px"));
    assert!(says(&drawing, "IMG_0006") && says(&drawing, "8 of 9 pictures"));
}

#[test]
fn sixty_pictures_and_many_remarks_stay_on_the_page() {
    let mut calibrated = calibrated(60, &[1, 2, 30], Some(50));
    for (k, image) in calibrated.images.iter_mut().enumerate().skip(40) {
        image.name = format!("a_very_long_name_of_a_picture_that_somebody_gave_on_holiday_in_{k}");
        image.rms_px = Some(if k % 2 == 0 { 5.0 } else { 0.1 });
    }
    calibrated.warnings = vec![calibrated.warnings[0].repeat(4); 9];
    let drawing = picture_of(&noisy(calibrated));
    assert_on_page(&drawing);
    assert!(says(&drawing, "more like these") && says(&drawing, "… more in the camera's file"));
    assert_eq!(rectangles(&drawing), 57);
}

#[test]
fn a_rig_shows_all_its_cameras_and_each_board_once() {
    let (left, right) = (calibrated(8, &[2], None), calibrated(8, &[2, 5], None));
    let beside = Transform::new(Rotation3::from_euler_angles(0.0, 0.2, 0.0), Vec3::new(-0.15, 0.0, 0.02));
    let cameras = [
        PicturedCamera { name: "left", ..only(&left) },
        PicturedCamera { name: "right", camera_from_rig: beside, ..only(&right) },
    ];
    let drawing = picture(&PictureInput { cameras: &cameras, board: board() });
    assert_on_page(&drawing);
    assert_eq!((discs(&drawing, 0.45), rectangles(&drawing)), (2 * 7, 7 + 6));
    assert!(says(&drawing, "left: ") && says(&drawing, "right: "));
}

#[test]
fn separated_squares_and_impossible_numbers_are_drawn() {
    let mut calibrated = noisy(calibrated(4, &[0], None));
    calibrated.images[3].corners.clear();
    calibrated.deviations.fx = f64::NAN;
    calibrated.images[1].rms_px = Some(f64::NAN);
    calibrated.images[2].cam_from_board = Some(Transform::new(Rotation3::identity(), Vec3::repeat(f64::NAN)));
    let squares = Board::squares(3, 4, 0.03, 0.5);
    let drawing = picture(&PictureInput { cameras: &[only(&calibrated)], board: squares });
    assert_on_page(&drawing);
    for format in [Format::Svg, Format::Pdf, Format::Png] {
        let bytes = drawing.encode(format, 60.0).unwrap();
        assert!(!String::from_utf8_lossy(&bytes).contains("NaN"));
    }
    let empty = CalibratedCamera { images: Vec::new(), ..calibrated };
    assert_on_page(&picture(&PictureInput { cameras: &[only(&empty)], board: squares }));
}
