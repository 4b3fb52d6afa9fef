//! What is on the picture of a match, and where.

use super::*;
use drawing::{Colour, Format, Mark, Outline};
use image::Luma;

const FRAME: (u32, u32) = (352, 288);

fn frame(phase: u32) -> GrayImage {
    GrayImage::from_fn(FRAME.0, FRAME.1, |x, y| Luma([((x * 5 + y * 3 + phase) % 256) as u8]))
}

/// `count` points of a face that goes 12 pixels to the right; the third is moved, the fourth rejected, the fifth lost and the
/// sixth lost and found again.
fn pair(count: usize) -> MatchedPair {
    let columns = (count as f64).sqrt().ceil() as usize;
    let mut pair = MatchedPair { a: "a_0".into(), b: "b_1".into(), violations_before: 1, ..MatchedPair::default() };
    for i in 0..count {
        let pitch = 100.0 / columns as f64;
        let (u, v) = (120.0 + pitch * (i % columns) as f64, 90.0 + pitch * (i / columns) as f64);
        let b = [u + 12.0, v + 0.5];
        let (tracked, outcome) = match i {
            2 => (Some([b[0] - 7.0, b[1] + 3.0]), "moved: order"),
            3 => (Some(b), "rejected: order"),
            4 => (None, "rejected: not found"),
            5 => (None, "moved: not found"),
            _ => (Some(b), "kept"),
        };
        pair.points.push((u, v, b[0], b[1], u8::from(!outcome.starts_with("rejected"))));
        pair.tracked.push(tracked);
        pair.outcomes.push(outcome.to_owned());
    }
    pair
}

fn drawn(pair: &MatchedPair) -> Drawing {
    of_match(pair, &frame(0), &frame(90))
}

/// Corners of the four frames on the page, in the order drawn: before, after; first, second.
fn panels(drawing: &Drawing) -> Vec<(Area, Window)> {
    let panel = |mark: &Mark| match mark {
        Mark::Picture { pixels, from, size } => {
            let whole = Window { left: 0, top: 0, width: pixels.width(), height: pixels.height() };
            Some((Area { from: *from, size: *size }, whole))
        }
        _ => None,
    };
    drawing.marks.iter().filter_map(panel).collect()
}

fn numbers(drawing: &Drawing, content: &str) -> Vec<Vec2> {
    let place = |mark: &Mark| match mark {
        Mark::Text(text) if text.content == content => Some(text.at),
        _ => None,
    };
    drawing.marks.iter().filter_map(place).collect()
}

fn says(drawing: &Drawing, words: &str) -> bool {
    drawing.marks.iter().any(|mark| matches!(mark, Mark::Text(text) if text.content.contains(words)))
}

/// Lines of two points in the width and a colour of the vectors that lie in an area.
fn vectors(drawing: &Drawing, area: &Area, colour: Colour, width: f64) -> Vec<[Vec2; 2]> {
    let line = |mark: &Mark| match mark {
        Mark::Shape { outline: Outline::Lines { points, closed: false }, stroke: Some(stroke), .. } => {
            let is_one = points.len() == 2 && stroke.colour == colour && stroke.width == width;
            (is_one && points.iter().all(|p| area.contains(p))).then(|| [points[0], points[1]])
        }
        _ => None,
    };
    drawing.marks.iter().filter_map(line).collect()
}

#[test]
fn every_number_is_drawn_once_in_each_frame() {
    for count in [7, 66, 200] {
        let drawing = drawn(&pair(count));
        let panels = panels(&drawing);
        assert_eq!(panels.len(), 4);
        for number in 1..=count {
            let places = numbers(&drawing, &number.to_string());
            for (area, _) in &panels {
                assert_eq!(places.iter().filter(|at| area.contains(at)).count(), 1, "{number} of {count}");
            }
        }
    }
}

#[test]
fn vectors_lead_from_the_place_in_the_first_frame_to_the_one_in_the_second() {
    let pair = pair(30);
    let drawing = drawn(&pair);
    let panels = panels(&drawing);
    let sizes = Sizes::of(30);
    let window = {
        let places = points(&pair).into_iter().flat_map(|p| [Some(p.a), p.after]);
        Window::around(places.flatten(), FRAME, TALLEST / panels[0].0.size.x)
    };
    assert_eq!((window.width, window.height), (panels[0].1.width, panels[0].1.height));
    let place = |area: &Area, u: f64, v: f64| {
        let scale = area.size.x / f64::from(window.width);
        area.from + Vec2::new(u + 0.5 - f64::from(window.left), v + 0.5 - f64::from(window.top)) * scale
    };
    let of = |panel: usize, state: State| vectors(&drawing, &panels[panel].0, state.colour(), sizes.line);
    for first in [0, 2] {
        assert!(State::ALL.iter().all(|s| *s == State::Rejected || of(first, *s).is_empty()));
    }
    let kept: Vec<usize> = (0..30).filter(|i| !(2..6).contains(i)).collect();
    for second in [1, 3] {
        let (area, lines) = (&panels[second].0, of(second, State::Kept));
        assert_eq!(lines.len(), kept.len());
        for (&i, [from, to]) in kept.iter().zip(lines) {
            let (ua, va, ub, vb, _) = pair.points[i];
            assert!((from - place(area, ua, va)).norm() < 1e-9 && (to - place(area, ub, vb)).norm() < 1e-9, "{i}");
        }
    }
    let (before, after) = (of(1, State::Moved), of(3, State::Moved));
    assert_eq!((before.len(), after.len()), (1, 2), "one was lost before the correction");
    let [tracked, moved] = [pair.tracked[2].unwrap(), [pair.points[2].2, pair.points[2].3]];
    assert!((before[0][1] - place(&panels[1].0, tracked[0], tracked[1])).norm() < 1e-9);
    assert!((after[0][1] - place(&panels[3].0, moved[0], moved[1])).norm() < 1e-9);
}

#[test]
fn the_rows_say_how_many_matches_there_are() {
    let drawing = drawn(&pair(30));
    assert!(says(&drawing, "Before the correction: 28 matches, 1 order violation") && says(&drawing, "2 lost"));
    assert!(says(&drawing, "After the correction: 28 matches, 0 order violations"));
    assert!(says(&drawing, "2 moved, 1 rejected, 1 lost") && says(&drawing, "b_1, with vectors"));
}

#[test]
fn the_page_is_as_wide_as_a4_and_no_higher() {
    for count in [0, 1, 66, 200] {
        let drawing = drawn(&pair(count));
        assert!(drawing.size.x == WIDTH && drawing.size.y <= 297.0, "{:?}", drawing.size);
        for (area, _) in panels(&drawing) {
            assert!(area.to() <= drawing.size);
        }
    }
}

#[test]
fn points_outside_and_numbers_that_are_none_are_drawn_without_harm() {
    let mut pair = pair(12);
    pair.points[0].2 = 5000.0;
    pair.tracked[1] = Some([-800.0, 40.0]);
    pair.points[7].0 = -30.0;
    pair.points[8] = (f64::NAN, 3.0, 4.0, 5.0, 1);
    pair.points[9].2 = f64::NAN;
    pair.tracked.truncate(11);
    pair.outcomes.truncate(11);
    let drawing = drawn(&pair);
    let panels = panels(&drawing);
    for number in [1, 2, 8, 10, 12] {
        let places = numbers(&drawing, &number.to_string());
        assert!(panels.iter().all(|(area, _)| places.iter().any(|at| area.contains(at))), "{number}");
    }
    for mark in &drawing.marks {
        if let Mark::Shape { outline: Outline::Lines { points, .. }, .. } = mark {
            assert!(points.iter().all(|p| *p >= Vec2::zeros() && *p <= drawing.size), "{points:?}");
        }
    }
    for format in [Format::Svg, Format::Pdf, Format::Png] {
        let bytes = drawing.encode(format, 60.0).unwrap();
        assert!(!String::from_utf8_lossy(&bytes).contains("NaN"));
    }
}

#[test]
fn nothing_to_show_is_still_a_picture() {
    let empty = MatchedPair::default();
    assert_eq!(panels(&of_match(&empty, &frame(0), &frame(1))).len(), 4);
    let none = GrayImage::new(0, 0);
    let drawing = of_match(&pair(9), &none, &none);
    assert!(panels(&drawing).is_empty() && says(&drawing, "Before the correction"));
}
