//! Matches of two frames in one picture (paper, Fig. 2): both frames side by side, before and after the correction, the
//! points numbered alike, in the second frame each with the vector from its place in the first.
//!
//! # Entry points
//! - [`of_match`]: a matched pair and its frames in, a [`Drawing`] out; its `write` makes SVG, PDF or PNG.
//!
//! # Conventions
//! Points are numbered from 1 in the order of the pair. Both frames are cut to the same pixels, so that a vector on the page is
//! one in pixels. What became of a point is told by colour and by shape. Lengths on the page are millimetres.

mod marks;
mod panel;
mod window;

use crate::MatchedPair;
use drawing::style::{Area, GREY, INK, LEADING, SMALL, TINY, title};
use drawing::{Anchor, Drawing, Stroke, Text, text_width};
use geometry::Vec2;
use image::GrayImage;
use marks::{Sizes, State};
use panel::{Panel, Shown};
use window::Window;

/// Width of the page, that of A4 upright.
const WIDTH: f64 = 210.0;
/// White along the page's edges.
const MARGIN: f64 = 10.0;
/// Distance between the two frames.
const GAP: f64 = 4.0;
/// Greatest height of a frame, with which all is no longer than A4.
const TALLEST: f64 = 114.0;
/// Where the rows begin.
const HEAD: f64 = 25.0;
/// Title of a row.
const ROW_TITLE: f64 = 6.2;
/// Distance between the rows.
const BETWEEN: f64 = 4.0;
/// Legend below the rows.
const LEGEND: f64 = 17.0;

/// The pair before and after its correction, 210 mm wide and no higher than A4. `a` and `b` are the frames it was matched in.
pub fn of_match(pair: &MatchedPair, a: &GrayImage, b: &GrayImage) -> Drawing {
    let points = points(pair);
    let width = (WIDTH - 2.0 * MARGIN - GAP) / 2.0;
    let places = points.iter().flat_map(|p| [Some(p.a), p.after]);
    let window = Window::around(places.flatten(), a.dimensions(), TALLEST / width);
    let height = width * window.height_by_width();
    let row = ROW_TITLE + height + BETWEEN;
    let mut drawing = Drawing::new(Vec2::new(WIDTH, (HEAD + 2.0 * row + LEGEND).ceil()));
    header(&mut drawing, pair, width);
    let sizes = Sizes::of(points.len());
    for (k, is_after) in [false, true].into_iter().enumerate() {
        let area = Area::new(MARGIN, HEAD + k as f64 * row, WIDTH - 2.0 * MARGIN, ROW_TITLE + height);
        let (heading, remark) = counts(pair, &points, is_after);
        title(&mut drawing, area, &heading, &remark);
        let frames = area.without(0.0, ROW_TITLE, 0.0, 0.0);
        for ((area, picture), is_second) in frames.columns(2, GAP).zip([a, b]).zip([false, true]) {
            let shown: Vec<Shown> = points.iter().map(|p| p.shown(is_second, is_after)).collect();
            Panel { area, window, sizes }.draw(&mut drawing, picture, &shown);
        }
    }
    legend(&mut drawing, HEAD + 2.0 * row, &sizes);
    drawing
}

/// A point of the first frame and what is known of it in the second one, pixels.
struct Point {
    number: usize,
    a: Vec2,
    /// Where the tracker had put it.
    before: Option<Vec2>,
    /// Where it is after the correction; none where it is left out.
    after: Option<Vec2>,
    /// Where it was last believed to be.
    last: Vec2,
    state: State,
}

impl Point {
    fn shown(&self, is_second: bool, is_after: bool) -> Shown {
        let state = if !is_after && self.before.is_none() { State::Lost } else { self.state };
        let b = if is_after { self.after } else { self.before };
        // One that is lost has no place in the second frame, one that is left out no vector.
        let left_out = if state == State::Lost { self.a } else { self.last };
        let at = if is_second { b.unwrap_or(left_out) } else { self.a };
        Shown { number: self.number, at, from: b.filter(|_| is_second).map(|_| self.a), state }
    }
}

/// The points whose place in the first frame is a place.
fn points(pair: &MatchedPair) -> Vec<Point> {
    let finite = |p: &Vec2| p.iter().all(|v| v.is_finite());
    let point = |(i, &(ua, va, ub, vb, kept)): (usize, &crate::track::pair::Match)| {
        let before = pair.tracked.get(i).copied().flatten().map(Vec2::from).filter(finite);
        let last = Some(Vec2::new(ub, vb)).filter(finite);
        let is_moved = pair.outcomes.get(i).is_some_and(|outcome| outcome.starts_with("moved"));
        let state = match (kept == 1, before) {
            (true, _) if is_moved => State::Moved,
            (true, _) => State::Kept,
            (false, Some(_)) => State::Rejected,
            (false, None) => State::Lost,
        };
        let a = Vec2::new(ua, va);
        let after = last.filter(|_| kept == 1);
        finite(&a).then(|| Point { number: i + 1, a, before, after, last: last.or(before).unwrap_or(a), state })
    };
    pair.points.iter().enumerate().filter_map(point).collect()
}

fn header(drawing: &mut Drawing, pair: &MatchedPair, width: f64) {
    drawing.text(Text::new("Matches between two frames", Vec2::new(MARGIN, 13.0), 5.0).coloured(INK));
    let points = format!("{} points, numbered alike in both", pair.points.len());
    let at = Vec2::new(WIDTH - MARGIN, 13.0);
    drawing.text(Text::new(points, at, SMALL).anchored(Anchor::End).coloured(GREY));
    let names = [pair.a.clone(), format!("{}, with vectors from the places in {}", pair.b, pair.a)];
    for (name, left) in names.into_iter().zip([MARGIN, MARGIN + width + GAP]) {
        let line = drawing::wrap(&name, SMALL, width).into_iter().next().unwrap_or_default();
        drawing.text(Text::new(line, Vec2::new(left, 20.5), SMALL).coloured(GREY));
    }
}

/// The title of a row, and the remark beside it.
fn counts(pair: &MatchedPair, points: &[Point], is_after: bool) -> (String, String) {
    let of = |state: State| points.iter().filter(|p| p.state == state).count();
    let (when, matches, violations) = if is_after {
        ("After", of(State::Kept) + of(State::Moved), pair.violations_after)
    } else {
        ("Before", points.iter().filter(|p| p.before.is_some()).count(), pair.violations_before)
    };
    let plural = if violations == 1 { "" } else { "s" };
    let heading = format!("{when} the correction: {matches} matches, {violations} order violation{plural}");
    let parts = if is_after {
        vec![(of(State::Moved), "moved"), (of(State::Rejected), "rejected"), (of(State::Lost), "lost")]
    } else {
        vec![(points.len() - matches, "lost")]
    };
    let parts: Vec<String> = parts.into_iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    (heading, parts.join(", "))
}

/// What the marks mean.
fn legend(drawing: &mut Drawing, top: f64, sizes: &Sizes) {
    let (base, lift) = (top + SMALL, Vec2::new(0.0, -0.36 * SMALL));
    let mut x = MARGIN;
    for state in State::ALL {
        state.draw(drawing, Vec2::new(x + 1.5, base) + lift, sizes.mark.max(0.7));
        drawing.text(Text::new(state.meaning(), Vec2::new(x + 4.0, base), SMALL).coloured(INK));
        x += 4.0 + text_width(state.meaning(), SMALL) + 6.0;
    }
    let line = [Vec2::new(x, base) + lift, Vec2::new(x + 7.0, base) + lift];
    drawing.line(&line, Stroke { colour: State::Kept.colour(), width: 0.3 });
    State::Kept.draw(drawing, line[1], sizes.mark.max(0.7));
    drawing.text(Text::new("from the place in the first frame", Vec2::new(x + 9.0, base), SMALL).coloured(INK));
    let notes = [
        "Before the correction too, the mark shows what became of the point; a lost one is drawn where it was in the first frame.",
        "Order violations: cross matches of the paper's method, flipped triangles of the default one.",
    ];
    for (k, note) in notes.into_iter().enumerate() {
        let at = Vec2::new(MARGIN, base + 5.0 + k as f64 * LEADING * TINY);
        drawing.text(Text::new(note, at, TINY).coloured(GREY));
    }
}

#[cfg(test)]
mod tests;
