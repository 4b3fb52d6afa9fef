//! Numbers beside shapes, placed so that they hide each other, and what they stand beside, as little as possible.

use super::style::Area;
use super::{Anchor, Colour, Drawing, Stroke, Text, text_width};
use geometry::Vec2;

/// Width of the white rim of a number, sizes of the font.
const RIM: f64 = 0.17;
/// Times that all numbers choose, each knowing where the others are.
const TURNS: usize = 4;
/// Places around a point at each distance.
const AROUND: usize = 16;
/// Distances from a point's mark to its number, sizes of the font.
const AWAY: [f64; 4] = [0.25, 0.7, 1.3, 2.2];
/// A number that stands farther away than this has a line to its point, sizes of the font.
const NEAR: f64 = 0.5;
/// What a place costs that is one distance farther away, parts of a number's area.
const FARTHER: f64 = 0.12;
/// What a millimetre of a line costs that a number hides, mm².
const LINE: f64 = 0.25;
/// What a place costs that is not wholly within the area, mm².
const BESIDE: f64 = 1e3;
/// Rounding that does not put a place beside the area, mm.
const SLACK: f64 = 1e-9;

/// A place that a number can have.
#[derive(Clone, Copy)]
struct Place {
    middle: Vec2,
    /// What speaks against it before anything else is known.
    cost: f64,
    /// Where the line to what is numbered begins and ends.
    leader: Option<[Vec2; 2]>,
}

/// A number that wants one of some places.
struct Wish {
    content: String,
    colour: Colour,
    half: Vec2,
    places: Vec<Place>,
}

/// Numbers of one size to place; those wanted last choose first.
pub struct Labels {
    area: Area,
    size: f64,
    wishes: Vec<Wish>,
    /// Middles and half sizes of boxes that should stay visible.
    boxes: Vec<(Vec2, Vec2)>,
    /// Lines that should stay visible.
    lines: Vec<[Vec2; 2]>,
}

impl Labels {
    /// No numbers yet, of a size in mm; all will lie within an area.
    pub fn within(area: Area, size: f64) -> Self {
        Self { area, size, wishes: Vec::new(), boxes: Vec::new(), lines: Vec::new() }
    }

    /// Asks that a mark about a point stays visible, mm.
    pub fn avoid(&mut self, point: Vec2, radius: f64) {
        self.boxes.push((point, Vec2::repeat(radius)));
    }

    /// Asks that a line stays visible.
    pub fn avoid_line(&mut self, from: Vec2, to: Vec2) {
        self.lines.push([from, to]);
    }

    /// Asks for a number outside a corner of a shape, or in its middle.
    pub fn want(&mut self, content: String, colour: Colour, corners: &[Vec2]) {
        let middle = corners.iter().sum::<Vec2>() / corners.len() as f64;
        let mut places: Vec<Vec2> = corners
            .iter()
            .map(|corner| corner + (corner - middle).try_normalize(1e-9).unwrap_or_default() * 1.9)
            .collect();
        // The uppermost corner is where one looks first.
        places.sort_by(|a, b| a.y.total_cmp(&b.y));
        places.push(middle);
        let places = places.into_iter().map(|middle| Place { middle, cost: 0.0, leader: None }).collect();
        self.wish(content, colour, places);
    }

    /// Asks for a number around a point whose mark has a radius, mm.
    pub fn want_around(&mut self, content: String, colour: Colour, point: Vec2, radius: f64) {
        let half = self.half(&content);
        let mut places = Vec::with_capacity(AWAY.len() * AROUND);
        for (k, away) in AWAY.iter().enumerate() {
            for turn in 0..AROUND {
                // From the upper right around.
                let angle = std::f64::consts::TAU * (turn as f64 / AROUND as f64 - 0.125);
                let way = Vec2::new(angle.cos(), angle.sin());
                let distance = radius + away * self.size;
                // The box's nearest side is at that distance, whatever the direction.
                let middle = point + way * distance + half.component_mul(&Vec2::new(way.x, way.y).map(soften));
                let cost = half.x * half.y * 4.0 * FARTHER * (k as f64 + 0.02 * turn.min(AROUND - turn) as f64);
                let leader = (*away > NEAR).then(|| [point + way * radius, point + way * distance]);
                places.push(Place { middle: self.inside(middle, half), cost, leader });
            }
        }
        self.wish(content, colour, places);
    }

    fn wish(&mut self, content: String, colour: Colour, places: Vec<Place>) {
        let half = self.half(&content);
        self.wishes.push(Wish { content, colour, half, places });
    }

    /// Half the width and height of a number.
    fn half(&self, content: &str) -> Vec2 {
        Vec2::new(text_width(content, self.size), 0.8 * self.size) / 2.0
    }

    /// The nearest middle with which a box lies within the area.
    fn inside(&self, middle: Vec2, half: Vec2) -> Vec2 {
        middle.sup(&(self.area.from + half)).inf(&(self.area.to() - half))
    }

    /// Draws them, with lines to what they number where that is not near.
    pub fn draw(self, drawing: &mut Drawing) {
        let chosen = self.choose();
        let of = |(wish, chosen): (&Wish, Option<usize>)| Some(wish.places[chosen?]);
        let places: Vec<Option<Place>> = self.wishes.iter().zip(chosen).map(of).collect();
        for (wish, place) in self.wishes.iter().zip(&places) {
            if let Some([from, to]) = place.and_then(|place| place.leader) {
                drawing.line(&[from, to], Stroke { colour: wish.colour, width: 0.1 });
            }
        }
        for (wish, place) in self.wishes.into_iter().zip(places) {
            let Some(place) = place else { continue };
            let at = place.middle + Vec2::new(0.0, 0.36 * self.size);
            let text = Text::new(wish.content, at, self.size).anchored(Anchor::Middle).coloured(wish.colour);
            drawing.text(Text { rim: RIM * self.size, ..text });
        }
    }

    /// The place of each wish.
    fn choose(&self) -> Vec<Option<usize>> {
        let fixed: Vec<Vec<f64>> = self.wishes.iter().map(|wish| self.fixed_costs(wish)).collect();
        let mut chosen: Vec<Option<usize>> = vec![None; self.wishes.len()];
        for _ in 0..TURNS {
            for (i, wish) in self.wishes.iter().enumerate().rev() {
                let taken: Vec<(Vec2, Vec2)> = (0..chosen.len())
                    .filter(|j| *j != i)
                    .filter_map(|j| Some((self.wishes[j].places[chosen[j]?].middle, self.wishes[j].half)))
                    .collect();
                let cost = |k: &usize| {
                    let hidden = |(at, half): &(Vec2, Vec2)| overlap(wish.places[*k].middle - at, wish.half + half);
                    fixed[i][*k] + taken.iter().map(hidden).sum::<f64>()
                };
                let costs: Vec<f64> = (0..wish.places.len()).map(|k| cost(&k)).collect();
                chosen[i] = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]));
            }
        }
        chosen
    }

    /// What speaks against each place of a wish whatever the others choose.
    fn fixed_costs(&self, wish: &Wish) -> Vec<f64> {
        let cost = |place: &Place| {
            let (low, high) = (place.middle - wish.half, place.middle + wish.half);
            let beside = (self.area.from - low).sup(&(high - self.area.to()));
            let boxes: f64 = self.boxes.iter().map(|(at, half)| overlap(place.middle - at, wish.half + half)).sum();
            let own = Area { from: low, size: 2.0 * wish.half };
            let hidden = self.lines.iter().filter_map(|line| own.cut(line));
            let lines: f64 = hidden.map(|[a, b]| (b - a).norm()).sum();
            place.cost + 2.0 * boxes + LINE * lines + if beside.max() > SLACK { BESIDE } else { 0.0 }
        };
        wish.places.iter().map(cost).collect()
    }
}

/// A direction's share along an axis, to which a box's half size is moved away: whole where the direction is near the axis.
fn soften(share: f64) -> f64 {
    (1.4 * share).clamp(-1.0, 1.0)
}

/// Area that two boxes share, their middles `apart`, their half sizes together `reach`.
fn overlap(apart: Vec2, reach: Vec2) -> f64 {
    let shared = (reach - apart.abs()).sup(&Vec2::zeros());
    shared.x * shared.y
}

#[cfg(test)]
mod tests {
    use super::super::Mark;
    use super::super::style::INK;
    use super::*;

    fn places(drawing: &Drawing) -> Vec<Vec2> {
        let place = |mark: &Mark| if let Mark::Text(text) = mark { Some(text.at) } else { None };
        drawing.marks.iter().filter_map(place).collect()
    }

    #[test]
    fn numbers_of_stacked_shapes_lie_apart() {
        let mut labels = Labels::within(Area::new(0.0, 0.0, 100.0, 100.0), 3.0);
        let corners = [(40.0, 40.0), (60.0, 40.0), (60.0, 60.0), (40.0, 60.0)].map(|(x, y)| Vec2::new(x, y));
        (0..5).for_each(|k| labels.want(k.to_string(), INK, &corners));
        let mut drawing = Drawing::new(Vec2::new(100.0, 100.0));
        labels.draw(&mut drawing);
        let places = places(&drawing);
        assert_eq!(places.len(), 5);
        for (i, a) in places.iter().enumerate() {
            assert!(places[..i].iter().all(|b| (a - b).norm() > 3.0), "{places:?}");
        }
    }

    #[test]
    fn numbers_of_crowded_points_hide_neither_points_nor_each_other() {
        let (size, radius) = (1.8, 0.5);
        let mut labels = Labels::within(Area::new(0.0, 0.0, 60.0, 60.0), size);
        let points: Vec<Vec2> =
            (0..49).map(|k| Vec2::new(12.0 + 6.0 * f64::from(k % 7), 12.0 + 6.0 * f64::from(k / 7))).collect();
        for (k, point) in points.iter().enumerate() {
            labels.avoid(*point, radius);
            labels.want_around((k + 1).to_string(), INK, *point, radius);
        }
        let mut drawing = Drawing::new(Vec2::new(60.0, 60.0));
        labels.draw(&mut drawing);
        let middles: Vec<Vec2> = places(&drawing).iter().map(|at| at - Vec2::new(0.0, 0.36 * size)).collect();
        let half = |k: usize| Vec2::new(text_width(&(k + 1).to_string(), size), 0.8 * size) / 2.0;
        assert_eq!(middles.len(), points.len());
        for (k, middle) in middles.iter().enumerate() {
            let hides = |at: &Vec2, other: Vec2| overlap(middle - at, half(k) + other) > 1e-9;
            assert!(!points.iter().any(|at| hides(at, Vec2::repeat(radius))), "{} hides a point", k + 1);
            assert!(!(0..k).any(|j| hides(&middles[j], half(j))), "{} hides a number", k + 1);
        }
    }

    #[test]
    fn a_number_at_the_edge_lies_within_the_area() {
        let area = Area::new(10.0, 10.0, 20.0, 20.0);
        for point in [area.from, area.to(), Vec2::new(500.0, 15.0)] {
            let mut labels = Labels::within(area, 2.0);
            labels.want_around("128".to_owned(), INK, point, 0.5);
            let mut drawing = Drawing::new(Vec2::new(40.0, 40.0));
            labels.draw(&mut drawing);
            let middle = places(&drawing)[0] - Vec2::new(0.0, 0.72);
            let half = Vec2::new(text_width("128", 2.0) / 2.0 - 1e-6, 0.8 - 1e-6);
            assert!(middle - half >= area.from && middle + half <= area.to(), "{point:?}: {middle:?}");
        }
    }
}
