//! The pixels that tell where a corner is: those along its edges, and a few plain ones that tell black and white.

use super::super::level::{Level, RowValues};
use super::Guess;
use super::lanes::{LANES, Lanes};
use super::model::{Samples, Shape};
use geometry::Vec2;
use std::ops::Range;

/// Weights reach zero at this part of the way to the next edge; less where that edge's blur would reach in.
const REACH: (f64, f64) = (0.6, 0.9);
/// Plain pixels further from an edge than this part of the way to the next one are left out: a mark may be printed there.
const PLAIN_REACH: f64 = 0.3;
/// About so many plain pixels are taken from one side of a window to the other.
const PLAIN_PIXELS: f64 = 8.0;

/// Where pixels are taken and what they weigh.
pub(super) struct Window {
    centre: Vec2,
    edges: [Edge; 2],
    pub(super) radius: f64,
    /// Half the width of the band around an edge in which grey values change.
    band: f64,
    /// Pixels nearer to the centre are left out.
    core: f64,
    /// Pixels further from both edges show black or white.
    clear: f64,
    shape: Shape,
    /// Sign of the angle from the first edge to the second.
    pub(super) side: f64,
}

struct Edge {
    along: Vec2,
    curvature: f64,
    /// Distance to the next edge parallel to it, and where weights end.
    next: f64,
    reach: f64,
}

impl Edge {
    /// Signed distances of offsets from the edge, positive to the side turned by +90° (x to y).
    #[inline(always)]
    fn distances(&self, offsets: &Samples) -> Lanes {
        let [tx, ty] = [self.along.x as f32, self.along.y as f32];
        let along = offsets.x * tx + offsets.y * ty;
        let across = offsets.y * tx - offsets.x * ty;
        across - along * along * (0.5 * self.curvature as f32)
    }

    /// Columns of the row at height `y` above the centre that may be within `band` of the edge.
    fn columns(&self, y: f64, band: f64, radius: f64) -> Range<f64> {
        let band = band + 0.5 * self.curvature.abs() * radius * radius;
        let across = self.along.x * y;
        if across.abs() > band + self.along.y.abs() * radius {
            return 0.0..0.0;
        }
        if self.along.y.abs() < 1e-9 {
            return -radius..radius;
        }
        let ends = [(across - band) / self.along.y, (across + band) / self.along.y];
        let low = ends[0].min(ends[1]).max(-radius);
        let high = ends[0].max(ends[1]).min(radius);
        low..high
    }
}

impl Window {
    /// `None` for steps that span no area.
    pub(super) fn new(guess: &Guess) -> Option<Self> {
        let [u, v] = guess.steps;
        let area = u.perp(&v).abs();
        if area.is_nan() || area <= 1.0 {
            return None;
        }
        let edge = |step: Vec2, angle: f64, curvature: f64| {
            let next = area / step.norm();
            let reach = next * (1.0 - (1.5 + 3.5 * guess.blur) / next).clamp(REACH.0, REACH.1);
            Edge { along: Vec2::new(angle.cos(), angle.sin()), curvature, next, reach }
        };
        // Blur rounds the corner of a single square in a way that two straight edges do not tell.
        let core = match guess.shape {
            Shape::Crossing => 0.0,
            Shape::Square => 0.5 + 1.5 * guess.blur,
        };
        Some(Self {
            centre: guess.position,
            edges: [0, 1].map(|k| edge(guess.steps[k], guess.angles[k], guess.curvatures[k])),
            radius: guess.radius.max(5.0 * guess.blur).min(REACH.1 * (u.norm() + v.norm())),
            band: 0.8 + 2.3 * guess.blur,
            core,
            clear: 0.5 + guess.blur,
            shape: guess.shape,
            side: u.perp(&v).signum(),
        })
    }

    /// The window's pixels of a level.
    pub(super) fn collect(&self, level: &Level) -> Pixels {
        let mut taken = Taken::with_capacity((10.0 * (self.band + 1.0) * self.radius) as usize);
        let stride = (2.0 * self.radius / PLAIN_PIXELS).ceil() as usize;
        for y in self.rows(level.height) {
            let above = y as f64 - self.centre.y;
            let row = level.row_values(y);
            let near = |edge: &Edge| self.pixels(edge.columns(above, self.band, self.radius), level.width);
            let (a, b) = (near(&self.edges[0]), near(&self.edges[1]));
            let (first, second) = if a.start <= b.start { (a, b) } else { (b, a) };
            let rest = second.start.max(first.end)..second.end.max(first.end);
            if y.is_multiple_of(stride) {
                let columns = self.pixels(-self.radius..self.radius, level.width);
                let plain = (columns.start.next_multiple_of(stride)..columns.end).step_by(stride);
                plain.filter(|x| !first.contains(x) && !rest.contains(x)).for_each(|x| taken.run(x..x + 1, y, &row));
            }
            taken.run(first, y, &row);
            taken.run(rest, y, &row);
        }
        let count = taken.x.len();
        // The last eight are filled up with pixels outside of the window.
        taken.x.resize(count.next_multiple_of(LANES), (self.centre.x + 2.0 * self.radius) as f32);
        taken.y.resize(taken.x.len(), 0.0);
        taken.values.resize(taken.x.len(), 0.0);
        let mut pixels = Pixels { samples: Vec::with_capacity(taken.x.len() / LANES), count, ..Pixels::default() };
        pulp::Arch::new().dispatch(Weigh { window: self, taken: &taken, pixels: &mut pixels });
        pixels
    }

    fn rows(&self, height: usize) -> Range<usize> {
        within(self.centre.y - self.radius, self.centre.y + self.radius, height)
    }

    /// Whole pixels of a range of columns around the centre.
    fn pixels(&self, columns: Range<f64>, width: usize) -> Range<usize> {
        within(self.centre.x + columns.start, self.centre.x + columns.end, width)
    }
}

/// Turns the positions of pixels into offsets from the centre and gives them their weights: 1 at the centre, falling smoothly to
/// 0 before the next edges.
struct Weigh<'a> {
    window: &'a Window,
    taken: &'a Taken,
    pixels: &'a mut Pixels,
}

impl pulp::NullaryFnOnce for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { window, taken, pixels } = self;
        let [e, f] = &window.edges;
        let [cx, cy] = [window.centre.x as f32, window.centre.y as f32];
        let (radius2, core2, clear) = (window.radius.powi(2) as f32, window.core.powi(2) as f32, window.clear as f32);
        let (e_reach, f_reach) = (1.0 / e.reach as f32, 1.0 / f.reach as f32);
        // A mark may be printed in the middle of a square.
        let (e_plain, f_plain) = ((PLAIN_REACH * e.next) as f32, (PLAIN_REACH * f.next) as f32);
        let (e_plain, f_plain) = (e_plain.max(window.band as f32), f_plain.max(window.band as f32));
        let is_square = window.shape == Shape::Square;
        let side = window.side as f32;
        // Beyond the corner of a single square there is nothing to learn, but something else may begin.
        let beyond = if is_square { -(window.band as f32) } else { f32::NEG_INFINITY };
        let mut sides = [[Lanes::default(); 2]; 2];
        let mut total = Lanes::default();
        let [xs, ys, values] = [&taken.x, &taken.y, &taken.values].map(|all| all.as_chunks::<LANES>().0);
        for ((x, y), value) in xs.iter().zip(ys).zip(values) {
            let (x, y, value) = (Lanes(*x) - cx, Lanes(*y) - cy, Lanes(*value));
            let mut sample = Samples { x, y, value, weight: Lanes::default() };
            let (first, second) = (e.distances(&sample), f.distances(&sample));
            let squared = sample.x * sample.x + sample.y * sample.y;
            for k in 0..LANES {
                let (p, q, r) = (first.0[k], second.0[k], squared.0[k]);
                let taper = |part: f32| (1.0 - part * part).max(0.0);
                let (a, b) = (p * e_reach, q * f_reach);
                let weight = taper(a * a) * taper(b * b) * taper(r / radius2);
                let near = (p.abs() <= e_plain) | (q.abs() <= f_plain);
                let is_used = (r >= core2) & near & (p * side >= beyond) & (-q * side >= beyond);
                let weight = if is_used { weight } else { 0.0 };
                sample.weight.0[k] = weight;
                total.0[k] += weight;
                let (above, below) = (p * side > 0.0, q * side < 0.0);
                let positive = if is_square { above & below } else { above == below };
                let clear_weight = if p.abs().min(q.abs()) > clear { weight } else { 0.0 };
                let (on, off) = if positive { (clear_weight, 0.0) } else { (0.0, clear_weight) };
                sides[0][0].0[k] += off * sample.value.0[k];
                sides[0][1].0[k] += off;
                sides[1][0].0[k] += on * sample.value.0[k];
                sides[1][1].0[k] += on;
            }
            pixels.samples.push(sample);
        }
        pixels.weight = total.sum();
        pixels.sides = sides.map(|pair| pair.map(Lanes::sum));
    }
}

/// Whole numbers from `low` to `high` within a picture's side.
fn within(low: f64, high: f64, size: usize) -> Range<usize> {
    let start = low.ceil().max(0.0) as usize;
    start..((high.floor().max(-1.0) + 1.0) as usize).min(size).max(start)
}

/// Pixels of a window.
#[derive(Default)]
pub(super) struct Pixels {
    pub(super) samples: Vec<Samples>,
    pub(super) count: usize,
    pub(super) weight: f64,
    /// Sums and numbers of grey values where the shape is negative and where it is positive.
    sides: [[f64; 2]; 2],
}

impl Pixels {
    /// Mean grey values where the shape is negative and where it is positive; not a number where there are no pixels.
    pub(super) fn grey(&self) -> [f64; 2] {
        self.sides.map(|[sum, count]| sum / count)
    }
}

/// Pixels as they are taken.
struct Taken {
    x: Vec<f32>,
    y: Vec<f32>,
    values: Vec<f32>,
}

impl Taken {
    fn with_capacity(count: usize) -> Self {
        let [x, y, values] = [0; 3].map(|_| Vec::with_capacity(count));
        Self { x, y, values }
    }

    /// Takes a part of a row.
    fn run(&mut self, columns: Range<usize>, y: usize, row: &RowValues) {
        if columns.is_empty() {
            return;
        }
        row.append(columns.clone(), &mut self.values);
        self.x.extend(columns.map(|x| x as f32));
        self.y.resize(self.x.len(), y as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_s_columns_hold_every_pixel_near_the_edge() {
        for (angle, curvature) in [(0.0, 0.0), (1e-9, 0.001), (0.4, -0.002), (1.57, 0.003), (-2.2, 0.0)] {
            let edge = Edge { along: Vec2::new(f64::cos(angle), f64::sin(angle)), curvature, next: 30.0, reach: 25.0 };
            for y in -20..=20 {
                let columns = edge.columns(f64::from(y), 2.0, 20.0);
                for x in -20..=20 {
                    let offset = Samples { x: Lanes::all(x as f32), y: Lanes::all(y as f32), ..Samples::default() };
                    let near = edge.distances(&offset).0[0].abs() <= 2.0;
                    let inside = (columns.start..=columns.end).contains(&f64::from(x));
                    assert!(inside || !near, "{angle} {x} {y}");
                }
            }
        }
    }
}
