//! Numbers beside shapes, placed so that they hide each other as little as possible.

use super::style::{ACCENT, Area, INK};
use crate::drawing::{Anchor, Drawing, Text, text_width};
use geometry::Vec2;

/// A number that wants a place at one of the corners of its shape.
struct Wish {
    content: String,
    is_bad: bool,
    places: Vec<Vec2>,
}

/// Numbers to place, those of far shapes first.
pub struct Labels {
    area: Area,
    wishes: Vec<Wish>,
}

impl Labels {
    /// No numbers yet; all will lie within an area.
    pub fn within(area: Area) -> Self {
        Self { area, wishes: Vec::new() }
    }

    /// Asks for a number outside a corner of a shape, or in its middle.
    pub fn want(&mut self, content: String, is_bad: bool, corners: &[Vec2]) {
        let middle = corners.iter().sum::<Vec2>() / corners.len() as f64;
        let mut places: Vec<Vec2> = corners
            .iter()
            .map(|corner| corner + (corner - middle).try_normalize(1e-9).unwrap_or_default() * 1.9)
            .collect();
        // The uppermost corner is where one looks first.
        places.sort_by(|a, b| a.y.total_cmp(&b.y));
        places.push(middle);
        self.wishes.push(Wish { content, is_bad, places });
    }

    /// Draws them in a size, mm; the nearest shapes choose first.
    pub fn draw(self, drawing: &mut Drawing, size: f64) {
        let mut taken: Vec<(Vec2, Vec2)> = Vec::new();
        for wish in self.wishes.into_iter().rev() {
            let half = Vec2::new(text_width(&wish.content, size), 0.8 * size) / 2.0;
            let hidden = |place: &Vec2| {
                let covered: f64 = taken.iter().map(|(at, other)| overlap(place - at, half + other)).sum();
                let (low, high) = (place - half, place + half);
                let is_beside = low < self.area.from || high > self.area.to();
                covered + if is_beside { 1e3 } else { 0.0 }
            };
            let Some(at) = wish.places.iter().copied().min_by(|a, b| hidden(a).total_cmp(&hidden(b))) else { continue };
            taken.push((at, half));
            let text = Text::new(wish.content, at + Vec2::new(0.0, 0.36 * size), size).anchored(Anchor::Middle);
            let colour = if wish.is_bad { ACCENT } else { INK };
            drawing.text(Text { rim: 0.45, ..text.coloured(colour) });
        }
    }
}

/// Area that two boxes share, their middles `apart`, their half sizes together `reach`.
fn overlap(apart: Vec2, reach: Vec2) -> f64 {
    let shared = (reach - apart.abs()).sup(&Vec2::zeros());
    shared.x * shared.y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::Mark;

    #[test]
    fn numbers_of_stacked_shapes_lie_apart() {
        let mut labels = Labels::within(Area::new(0.0, 0.0, 100.0, 100.0));
        let corners = [(40.0, 40.0), (60.0, 40.0), (60.0, 60.0), (40.0, 60.0)].map(|(x, y)| Vec2::new(x, y));
        (0..5).for_each(|k| labels.want(k.to_string(), false, &corners));
        let mut drawing = Drawing::new(Vec2::new(100.0, 100.0));
        labels.draw(&mut drawing, 3.0);
        let places: Vec<Vec2> = drawing
            .marks
            .iter()
            .filter_map(|m| match m {
                Mark::Text(text) => Some(text.at),
                Mark::Shape { .. } => None,
            })
            .collect();
        assert_eq!(places.len(), 5);
        for (i, a) in places.iter().enumerate() {
            assert!(places[..i].iter().all(|b| (a - b).norm() > 3.0), "{places:?}");
        }
    }
}
