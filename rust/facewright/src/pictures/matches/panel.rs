//! One frame with its points.

use super::marks::{Sizes, State};
use super::window::Window;
use drawing::labels::Labels;
use drawing::style::{Area, THIN};
use drawing::{Drawing, Stroke};
use geometry::Vec2;
use image::{GrayImage, imageops};

/// How much of a frame's contrast remains, so that what is drawn over it stands out.
const CONTRAST: f64 = 0.62;

/// A point as a panel shows it, pixels.
pub struct Shown {
    pub number: usize,
    pub at: Vec2,
    /// Where its vector begins.
    pub from: Option<Vec2>,
    pub state: State,
}

/// Where a frame is drawn, and which part of it.
pub struct Panel {
    pub area: Area,
    pub window: Window,
    pub sizes: Sizes,
}

impl Panel {
    /// Draws a frame, the vectors and marks, and each number once; what lies outside is cut off, its number at the edge.
    pub fn draw(&self, drawing: &mut Drawing, frame: &GrayImage, points: &[Shown]) {
        self.frame(drawing, frame);
        let mut labels = Labels::within(self.area.without(0.4, 0.4, 0.4, 0.4), self.sizes.number);
        // Those that deserve a look come last, over the others; what has no place here comes first.
        let order = State::UPWARDS.into_iter().flat_map(|state| points.iter().filter(move |p| p.state == state));
        let ordered: Vec<&Shown> = order.collect();
        let vectors: Vec<(State, [Vec2; 2])> = ordered.iter().filter_map(|p| self.vector(p)).collect();
        for (state, line) in &vectors {
            drawing.line(line, Stroke { colour: state.casing().with_opacity(0.7), width: 2.2 * self.sizes.line });
        }
        for (state, line) in vectors {
            drawing.line(&line, Stroke { colour: state.colour(), width: self.sizes.line });
            labels.avoid_line(line[0], line[1]);
        }
        for point in ordered {
            let at = self.place(&point.at);
            if self.area.contains(&at) {
                point.state.draw(drawing, at, self.sizes.mark);
                labels.avoid(at, 1.2 * self.sizes.mark);
            }
            let near = at.sup(&self.area.from).inf(&self.area.to());
            labels.want_around(point.number.to_string(), point.state.ink(), near, 1.3 * self.sizes.mark);
        }
        labels.draw(drawing);
    }

    /// The frame in pale greys, and an edge around it.
    fn frame(&self, drawing: &mut Drawing, frame: &GrayImage) {
        let Window { left, top, width, height } = self.window;
        let mut part = imageops::crop_imm(frame, left, top, width, height).to_image();
        part.iter_mut().for_each(|level| *level = 255 - (CONTRAST * f64::from(255 - *level)).round() as u8);
        let size = Vec2::new(f64::from(part.width()), f64::from(part.height())) * self.scale();
        drawing.picture(part, self.area.from, size);
        let [a, b] = [self.area.from, self.area.to()];
        drawing.polygon(&[a, Vec2::new(b.x, a.y), b, Vec2::new(a.x, b.y)], None, Some(THIN));
    }

    /// Millimetres per pixel.
    fn scale(&self) -> f64 {
        self.area.size.x / f64::from(self.window.width)
    }

    /// Where a pixel lies on the page.
    fn place(&self, pixel: &Vec2) -> Vec2 {
        let corner = Vec2::new(f64::from(self.window.left), f64::from(self.window.top));
        self.area.from + (pixel.add_scalar(0.5) - corner) * self.scale()
    }

    fn vector(&self, point: &Shown) -> Option<(State, [Vec2; 2])> {
        let line = [self.place(&point.from?), self.place(&point.at)];
        Some((point.state, self.area.cut(&line)?))
    }
}
