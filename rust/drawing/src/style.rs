//! Colours, sizes and places that all pictures share.

use super::{Anchor, Colour, Drawing, Stroke, Text};
use geometry::Vec2;

/// What is read first.
pub const INK: Colour = Colour::grey(45);
/// Explanations, axes.
pub const GREY: Colour = Colour::grey(115);
/// Dots and bars.
pub const MIDDLE: Colour = Colour::grey(165);
/// Grids.
pub const PALE: Colour = Colour::grey(222);
/// What deserves a look: vermilion, which no common colour blindness takes for grey (Okabe and Ito 2008).
pub const ACCENT: Colour = Colour { rgb: [213, 94, 0], opacity: 1.0 };

/// Size of titles, mm.
pub const TITLE: f64 = 3.4;
/// Size of text, mm.
pub const SMALL: f64 = 2.7;
/// Size of numbers along axes, mm.
pub const TINY: f64 = 2.2;
/// Distance of two lines of text, in sizes.
pub const LEADING: f64 = 1.4;

/// A hairline.
pub const HAIR: Stroke = Stroke { colour: PALE, width: 0.12 };
/// A thin line.
pub const THIN: Stroke = Stroke { colour: GREY, width: 0.15 };

/// A part of the page, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Top left corner.
    pub from: Vec2,
    /// Width and height.
    pub size: Vec2,
}

impl Area {
    /// From its corner and size, mm.
    pub fn new(left: f64, top: f64, width: f64, height: f64) -> Self {
        Self { from: Vec2::new(left, top), size: Vec2::new(width, height) }
    }

    /// Bottom right corner.
    pub fn to(&self) -> Vec2 {
        self.from + self.size
    }

    /// The same without a strip on each side.
    pub fn without(&self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self {
            from: self.from + Vec2::new(left, top),
            size: (self.size - Vec2::new(left + right, top + bottom)).sup(&Vec2::repeat(1.0)),
        }
    }

    /// Equal parts of it side by side, `gap` apart.
    pub fn columns(self, count: usize, gap: f64) -> impl Iterator<Item = Self> {
        let width = (self.size.x - gap * (count as f64 - 1.0)) / count as f64;
        (0..count).map(move |k| Self::new(self.from.x + k as f64 * (width + gap), self.from.y, width, self.size.y))
    }

    /// Equal parts of it below each other, `gap` apart.
    pub fn rows(self, count: usize, gap: f64) -> impl Iterator<Item = Self> {
        let height = (self.size.y - gap * (count as f64 - 1.0)) / count as f64;
        (0..count).map(move |k| Self::new(self.from.x, self.from.y + k as f64 * (height + gap), self.size.x, height))
    }

    /// Width and height scaled to fit into the area, centred in it.
    pub fn fit(&self, size: Vec2) -> Self {
        let size = size * self.size.component_div(&size).min();
        Self { from: self.from + (self.size - size) / 2.0, size }
    }

    /// Whether a point lies in it.
    pub fn contains(&self, point: &Vec2) -> bool {
        let (from, to) = (self.from, self.to());
        (from.x..=to.x).contains(&point.x) && (from.y..=to.y).contains(&point.y)
    }

    /// The part of a line that lies in it (Liang and Barsky 1984).
    pub fn cut(&self, line: &[Vec2; 2]) -> Option<[Vec2; 2]> {
        let ([from, to], way) = (line, line[1] - line[0]);
        let (mut begin, mut end) = (0.0f64, 1.0f64);
        for axis in 0..2 {
            let (low, high) = (self.from[axis] - from[axis], self.to()[axis] - from[axis]);
            if way[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / way[axis], high / way[axis]);
            begin = begin.max(a.min(b));
            end = end.min(a.max(b));
        }
        let at = |t: f64| if t == 1.0 { *to } else { from + t * way };
        (begin <= end).then(|| [at(begin), at(end)])
    }
}

/// Draws a title at the top of an area, and a remark to the right of it; what remains below them.
pub fn title(drawing: &mut Drawing, area: Area, content: &str, remark: &str) -> Area {
    drawing.text(Text::new(content, area.from + Vec2::new(0.0, TITLE), TITLE).coloured(INK));
    if !remark.is_empty() {
        let at = Vec2::new(area.to().x, area.from.y + TITLE);
        drawing.text(Text::new(remark, at, TINY).anchored(Anchor::End).coloured(GREY));
    }
    area.without(0.0, 1.8 * TITLE, 0.0, 0.0)
}

/// The 1, 2 or 5 times a power of ten that is nearest above a positive number.
pub fn round_up(number: f64) -> f64 {
    if !(number.is_finite() && number > 0.0) {
        return 1.0;
    }
    let power = 10f64.powf(number.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power).into_iter().find(|n| *n >= number * (1.0 - 1e-9)).unwrap_or(power)
}

/// A round number without the traces of binary fractions.
pub fn plain(number: f64) -> String {
    with_minus(format!("{}", (number * 1e9).round() / 1e9))
}

/// A number with a minus sign instead of a hyphen.
pub fn with_minus(number: String) -> String {
    number.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        let steps = [(0.0123, 0.02), (0.1, 0.1), (0.11, 0.2), (3.0, 5.0), (51.0, 100.0), (0.0, 1.0), (f64::NAN, 1.0)];
        for (number, step) in steps {
            assert!((round_up(number) - step).abs() < 1e-12, "{number}: {}", round_up(number));
        }
        assert_eq!(plain(3.0 * 0.1), "0.3");
    }

    #[test]
    fn parts_fill_an_area() {
        let area = Area::new(10.0, 20.0, 100.0, 50.0);
        let last = area.columns(3, 5.0).last().unwrap();
        assert!((last.to() - area.to()).norm() < 1e-12);
        let fitted = area.fit(Vec2::new(640.0, 480.0));
        assert!((fitted.size.y - 50.0).abs() < 1e-12 && (fitted.from.x + fitted.to().x - 120.0).abs() < 1e-12);
    }

    #[test]
    fn lines_are_cut_at_an_area() {
        let area = Area::new(0.0, 0.0, 10.0, 10.0);
        let cut = |a: (f64, f64), b: (f64, f64)| area.cut(&[Vec2::new(a.0, a.1), Vec2::new(b.0, b.1)]);
        assert_eq!(cut((2.0, 3.0), (4.0, 5.0)), Some([Vec2::new(2.0, 3.0), Vec2::new(4.0, 5.0)]));
        assert_eq!(cut((5.0, 5.0), (25.0, 5.0)), Some([Vec2::new(5.0, 5.0), Vec2::new(10.0, 5.0)]));
        assert_eq!(cut((-10.0, 5.0), (-1.0, 5.0)), None);
        assert_eq!(cut((5.0, -3.0), (5.0, -3.0)), None);
        assert_eq!(cut((-1.0, 12.0), (12.0, 25.0)), None);
    }
}
