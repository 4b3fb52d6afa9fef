//! The part of the frames that is shown.

use geometry::Vec2;

/// Room around the points, parts of their extent.
const ROOM: f64 = 0.09;
/// Least extent of a window, pixels.
const LEAST: f64 = 48.0;
/// Least height of a window, widths.
const FLATTEST: f64 = 0.6;
/// Where a window would be a larger part of the frame, the whole frame is shown.
const MOST: f64 = 0.6;

/// Pixels of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    pub left: u32,
    pub top: u32,
    pub width: u32,
    pub height: u32,
}

impl Window {
    /// Around points of a frame, no higher than `tallest` widths where the frame is wide enough; those outside do not count.
    pub fn around(points: impl Iterator<Item = Vec2>, frame: (u32, u32), tallest: f64) -> Self {
        let whole = Self { left: 0, top: 0, width: frame.0.max(1), height: frame.1.max(1) };
        let end = Vec2::new(f64::from(whole.width), f64::from(whole.height));
        let inside = |p: &Vec2| (0.0..end.x).contains(&p.x) && (0.0..end.y).contains(&p.y);
        let far = Vec2::repeat(f64::INFINITY);
        let (low, high) = points.filter(inside).fold((far, -far), |(l, h), p| (l.inf(&p), h.sup(&p)));
        if low.x > high.x {
            return whole;
        }
        let mut size = (high - low).add_scalar(1.0 + 2.0 * ROOM * (high - low).max()).sup(&Vec2::repeat(LEAST));
        size.y = size.y.max(FLATTEST * size.x);
        size.x = size.x.max(size.y / tallest);
        size = size.inf(&end);
        if size.x * size.y > MOST * end.x * end.y {
            return whole;
        }
        let size = size.map(f64::ceil);
        let from = ((low + high - size).add_scalar(1.0) / 2.0).map(f64::floor).sup(&Vec2::zeros()).inf(&(end - size));
        let [left, top, width, height] = [from.x, from.y, size.x, size.y].map(|v| v as u32);
        Self { left, top, width, height }
    }

    /// How many times its width its height is.
    pub fn height_by_width(&self) -> f64 {
        f64::from(self.height) / f64::from(self.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(points: &[(f64, f64)]) -> Window {
        Window::around(points.iter().map(|&(x, y)| Vec2::new(x, y)), (352, 288), 1.25)
    }

    #[test]
    fn a_face_is_cut_out_with_room_around_it() {
        let Window { left, top, width, height } = around(&[(150.0, 90.0), (230.0, 200.0), (190.0, 140.0)]);
        assert!(left < 148 && top < 82 && left + width > 232 && top + height > 208);
        assert!(width < 110 && height < 140, "{width}x{height}");
    }

    #[test]
    fn points_all_over_the_frame_show_all_of_it() {
        let whole = Window { left: 0, top: 0, width: 352, height: 288 };
        assert_eq!(around(&[(20.0, 20.0), (330.0, 270.0)]), whole);
        assert_eq!(around(&[]), whole);
        assert_eq!(around(&[(-5.0, 20.0), (f64::NAN, 3.0)]), whole);
    }

    #[test]
    fn a_window_lies_within_the_frame() {
        for corner in [(0.0, 0.0), (351.0, 0.0), (351.0, 287.0), (0.0, 287.0)] {
            let w = around(&[corner, (corner.0 - 3.0, corner.1 + 2.0)]);
            assert!(w.left + w.width <= 352 && w.top + w.height <= 288 && w.width >= 48, "{w:?}");
        }
        let sliver = Window::around([Vec2::new(3.0, 500.0)].into_iter(), (8, 1000), 1.25);
        assert!(sliver.width == 8 && sliver.left == 0, "{sliver:?}");
    }
}
