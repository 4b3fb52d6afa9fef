//! Sub-pixel corners by fitting a model of blurred edges to the grey values.
//!
//! Gauss–Newton with step halving on the [`model`], over the pixels of a [`window`].

mod lanes;
mod model;
mod window;

use super::level::Level;
use geometry::Vec2;
pub(super) use model::Shape;
use model::{Equations, Model, N, Unknowns};
use window::{Pixels, Window};

const MAX_HALVINGS: usize = 6;
/// Narrowest blur, pixels: below it the derivative by the blur vanishes.
const MIN_BLUR: f64 = 0.1;

/// What is known about a corner before the fit, in pixels of the level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    pub(super) shape: Shape,
    pub(super) position: Vec2,
    /// Along the two edges, as far as the next edge parallel to the other one; the shorter to either side.
    pub(super) steps: [Vec2; 2],
    /// Directions of the edges, radians.
    pub(super) angles: [f64; 2],
    /// Curvature of the edges along the two steps, per pixel; positive bends towards the step turned by +90° (x to y).
    pub(super) curvatures: [f64; 2],
    /// Standard deviation of the edges' blur, pixels.
    pub(super) blur: f64,
    /// Radius of the window, pixels; larger for strong blur, smaller where the next edges are near.
    pub(super) radius: f64,
}

/// A fitted corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) position: Vec2,
    /// Standard deviation of the position along one axis, pixels, from the fit's residual.
    pub(super) sigma: f64,
    pub(super) blur: f64,
    /// White minus black, grey levels; negative where the square of [`Shape::Square`] is the darker side.
    pub(super) contrast: f64,
    /// Root of the weighted mean square residual, grey levels.
    pub(super) residual: f64,
}

/// When a fit ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// After this many steps.
    pub(super) max_steps: usize,
    /// With the first step shorter than this, pixels; the error left is about its square.
    pub(super) last_step: f64,
}

/// A corner being fitted.
pub(super) struct Fit {
    window: Window,
    pixels: Pixels,
    guess: Guess,
    state: Unknowns,
}

impl Fit {
    /// Takes the pixels around `guess`. `None` where too little of the window is in the picture.
    pub(super) fn new(level: &Level, guess: &Guess) -> Option<Self> {
        let window = Window::new(guess)?;
        let pixels = window.collect(level);
        let [negative, positive] = pixels.grey();
        if pixels.count <= 3 * N || (negative + positive).is_nan() {
            return None;
        }
        let [u, v] = guess.angles;
        let grey = [(positive + negative) / 2.0, (positive - negative) / 2.0];
        let state = Unknowns::from([0.0, 0.0, u, v, guess.blur.max(MIN_BLUR), grey[0], grey[1], 0.0, 0.0]);
        Some(Self { window, pixels, guess: *guess, state })
    }

    /// Gauss–Newton with step halving from the present state. `None` where the fit leaves the window.
    pub(super) fn run(&mut self, effort: &Effort) -> Option<Corner> {
        let mut equations = self.linearise(&self.state);
        for _ in 0..effort.max_steps {
            let mut step = -equations.normal.cholesky()?.solve(&equations.gradient);
            if step.fixed_rows::<2>(0).norm() < effort.last_step {
                // The last step is too short to be checked; the linear model tells what it gains.
                equations.cost += equations.gradient.dot(&step);
                self.state = limited(self.state + step);
                break;
            }
            let mut next = None;
            for _ in 0..MAX_HALVINGS {
                let candidate = limited(self.state + step);
                let there = self.linearise(&candidate);
                if there.cost <= equations.cost {
                    next = Some((candidate, there));
                    break;
                }
                step /= 2.0;
            }
            let Some(better) = next else { break };
            (self.state, equations) = better;
        }
        self.corner(&equations)
    }

    fn linearise(&self, state: &Unknowns) -> Equations {
        Model::new(self.guess.shape, self.guess.curvatures, self.window.side, state).linearise(&self.pixels.samples)
    }

    fn corner(&self, equations: &Equations) -> Option<Corner> {
        let shift = Vec2::new(self.state[0], self.state[1]);
        let inverse = equations.normal.cholesky()?.inverse();
        let weight = self.pixels.weight;
        let mean_square = equations.cost / weight;
        let freedom = (weight - N as f64).max(1.0) / weight;
        let sigma = (mean_square / freedom * (inverse[(0, 0)] + inverse[(1, 1)]) / 2.0).sqrt();
        (shift.norm() < 0.7 * self.window.radius && sigma.is_finite()).then(|| Corner {
            position: self.guess.position + shift,
            sigma,
            blur: self.state[4],
            contrast: 2.0 * self.state[6],
            residual: mean_square.sqrt(),
        })
    }
}

fn limited(mut state: Unknowns) -> Unknowns {
    state[4] = state[4].max(MIN_BLUR);
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_picture_has_no_corner_of_any_contrast() {
        let level = Level::from_values(40, 40, vec![90.0; 1600]);
        let steps = [Vec2::new(14.0, 3.0), Vec2::new(-4.0, 11.0)];
        for shape in [Shape::Crossing, Shape::Square] {
            let position = Vec2::new(20.0, 18.0);
            let angles = steps.map(|s: Vec2| s.y.atan2(s.x));
            let guess = Guess { shape, position, steps, angles, curvatures: [0.004, -0.003], blur: 0.7, radius: 12.0 };
            let found = Fit::new(&level, &guess).and_then(|mut f| f.run(&Effort { max_steps: 12, last_step: 0.01 }));
            assert!(found.is_none_or(|c| c.contrast.abs() < 1.0), "{found:?}");
        }
    }
}
