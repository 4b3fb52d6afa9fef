//! Sub-pixel corners by fitting a model of a blurred crossing to the grey values.
//!
//! Around a corner the grey value is `(a + b p(d₁) p(d₂)) (1 + g·x)`: two edges with signed distances `d₁, d₂`, each with
//! the profile `p` of a step blurred by a Gaussian and integrated over a pixel, black and white by `a` and `b`, and light
//! that changes linearly. Lens distortion bends the edges; their curvature is known from the neighbouring corners and kept
//! fixed. Gauss–Newton with step halving, weights falling smoothly to zero before the next edges of the board.

use super::plane::Plane;
use geometry::Vec2;
use nalgebra::{Rotation2, SMatrix, SVector};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_PI};

/// Unknowns: centre (2), angles of the two edges (2), blur, a, b, g (2).
const N: usize = 9;
type Unknowns = SVector<f64, N>;

const MAX_ITERATIONS: usize = 12;
const MAX_HALVINGS: usize = 6;
/// Narrowest blur, pixels: below it the derivative by the blur vanishes.
const MIN_BLUR: f64 = 0.1;
/// Weights reach zero at this part of the way to the next corner; less where its edges' blur would reach in.
const WINDOW: (f64, f64) = (0.6, 0.85);
/// Of the plain pixels away from the edges, which only tell the grey values, one in this many rows and columns is used.
const PLAIN_STRIDE: usize = 3;

/// What is known about a corner before the fit, in pixels of the level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    pub(super) position: Vec2,
    /// One step along the columns' and the rows' axis of the board: the shorter to either side.
    pub(super) steps: [Vec2; 2],
    /// Curvature of the edges along the two axes, per pixel; positive bends towards the axis turned by +90° (x to y).
    pub(super) curvatures: [f64; 2],
    /// Standard deviation of the edges' blur, pixels.
    pub(super) blur: f64,
}

/// A fitted corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) position: Vec2,
    /// Standard deviation of the position along one axis, pixels, from the fit's residual.
    pub(super) sigma: f64,
    pub(super) blur: f64,
    /// White minus black, grey levels.
    pub(super) contrast: f64,
    /// Root of the weighted mean square residual, grey levels.
    pub(super) residual: f64,
}

/// How far a fit looks and how exactly it ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Largest radius of the window, pixels.
    pub(super) max_radius: f64,
    /// The fit ends with the first step shorter than this, pixels; the error left is about its square.
    pub(super) last_step: f64,
}

/// Fits the corner near `guess`. `None` where too little of the window is in the picture or the fit leaves the window.
pub(super) fn fit(level: &Plane, guess: &Guess, effort: &Effort) -> Option<Corner> {
    let window = Window::new(level, guess, effort.max_radius)?;
    let mut state = window.start(guess)?;
    let mut equations = window.linearise(&state, guess);
    for _ in 0..MAX_ITERATIONS {
        let mut step = -equations.normal.cholesky()?.solve(&equations.gradient);
        if step.fixed_rows::<2>(0).norm() < effort.last_step {
            return window.corner(&(state + step), &equations);
        }
        let mut next = None;
        for _ in 0..MAX_HALVINGS {
            let mut candidate = state + step;
            candidate[4] = candidate[4].max(MIN_BLUR);
            let there = window.linearise(&candidate, guess);
            if there.cost <= equations.cost {
                next = Some((candidate, there));
                break;
            }
            step /= 2.0;
        }
        let Some(better) = next else { break };
        (state, equations) = better;
    }
    window.corner(&state, &equations)
}

/// Cost `Σ w r²`, `Jᵀ W J` and `Jᵀ W r`.
struct Equations {
    cost: f64,
    normal: SMatrix<f64, N, N>,
    gradient: Unknowns,
}

/// The pixels of a fit and their weights.
struct Window {
    centre: Vec2,
    radius: f64,
    /// Offset from the centre, grey value, weight.
    samples: Vec<(Vec2, f64, f64)>,
    weight: f64,
}

impl Window {
    fn new(level: &Plane, guess: &Guess, max_radius: f64) -> Option<Self> {
        let [u, v] = guess.steps;
        let area = u.perp(&v).abs();
        let radius = max_radius.min(WINDOW.1 * (u.norm() + v.norm()));
        let reach = |next: f64| (1.0 - (1.5 + 3.5 * guess.blur) / next).clamp(WINDOW.0, WINDOW.1);
        let (to_v, to_u) = (area / v.norm(), area / u.norm());
        let (across_u, across_v) = (u.normalize(), v.normalize());
        let band = 2.0 + 4.0 * guess.blur;
        let range = |centre: f64, size: usize| {
            let low = (centre - radius).ceil().max(0.0) as usize;
            low..((centre + radius).floor().max(-1.0) + 1.0).min(size as f64) as usize
        };
        let (mut samples, mut weight) = (Vec::new(), 0.0);
        for y in range(guess.position.y, level.height) {
            let row = level.row(y);
            for x in range(guess.position.x, level.width) {
                let d = Vec2::new(x as f64, y as f64) - guess.position;
                let (from_u, from_v) = (across_u.perp(&d), across_v.perp(&d));
                let plain = from_u.abs() > band && from_v.abs() > band;
                if plain && !(x.is_multiple_of(PLAIN_STRIDE) && y.is_multiple_of(PLAIN_STRIDE)) {
                    continue;
                }
                let taper = |part: f64| 1.0 - part.powi(4);
                let tapers =
                    [from_v / (to_v * reach(to_v)), from_u / (to_u * reach(to_u)), d.norm() / radius].map(taper);
                if tapers.iter().all(|&t| t > 0.0) {
                    let w = tapers.iter().product();
                    samples.push((d, f64::from(row[x]), w));
                    weight += w;
                }
            }
        }
        (area > 1.0 && samples.len() > 2 * N).then_some(Self { centre: guess.position, radius, samples, weight })
    }

    /// Edges along the steps; grey values of black and white by linear least squares.
    fn start(&self, guess: &Guess) -> Option<Unknowns> {
        let angle = |s: &Vec2| s.y.atan2(s.x);
        let [u, v] = &guess.steps;
        let mut state = Unknowns::zeros();
        state.fixed_rows_mut::<5>(0).copy_from_slice(&[0.0, 0.0, angle(u), angle(v), guess.blur.max(MIN_BLUR)]);
        let (mut n, mut r) = (SMatrix::<f64, 2, 2>::zeros(), SVector::<f64, 2>::zeros());
        let edges = Edges::new(&state, guess);
        for (d, value, w) in &self.samples {
            let row = SVector::<f64, 2>::new(1.0, edges.shape(d));
            n += row * row.transpose() * *w;
            r += row * (*w * value);
        }
        let grey = n.cholesky()?.solve(&r);
        (state[5], state[6]) = (grey[0], grey[1]);
        Some(state)
    }

    fn linearise(&self, state: &Unknowns, guess: &Guess) -> Equations {
        let edges = Edges::new(state, guess);
        let (a, b, g) = (state[5], state[6], Vec2::new(state[7], state[8]));
        let (mut cost, mut normal, mut gradient) = (0.0, [[0.0; N]; N], [0.0; N]);
        for (d, value, w) in &self.samples {
            let (shape, by_edges) = edges.shape_with_derivatives(d);
            let (light, paper) = (1.0 + g.dot(d), a + b * shape);
            let residual = paper * light - value;
            cost += w * residual * residual;
            let gain = b * light;
            #[rustfmt::skip]
            let j = [
                gain * by_edges[0], gain * by_edges[1], gain * by_edges[2], gain * by_edges[3], gain * by_edges[4],
                light, shape * light, paper * d.x, paper * d.y,
            ];
            // Away from the edges only the grey values have derivatives.
            let first = if by_edges == [0.0; 5] { 5 } else { 0 };
            for k in first..N {
                let wj = w * j[k];
                gradient[k] += wj * residual;
                for (sum, j) in normal[k].iter_mut().zip(&j) {
                    *sum += wj * j;
                }
            }
        }
        Equations { cost, normal: SMatrix::from_fn(|k, l| normal[k.max(l)][k.min(l)]), gradient: gradient.into() }
    }

    fn corner(&self, state: &Unknowns, equations: &Equations) -> Option<Corner> {
        let shift = Vec2::new(state[0], state[1]);
        let inverse = equations.normal.cholesky()?.inverse();
        let mean_square = equations.cost / self.weight;
        let freedom = (self.weight - N as f64).max(1.0) / self.weight;
        let sigma = (mean_square / freedom * (inverse[(0, 0)] + inverse[(1, 1)]) / 2.0).sqrt();
        let inside = shift.norm() < 0.7 * self.radius && sigma.is_finite();
        let contrast = 2.0 * state[6].abs();
        inside.then(|| Corner {
            position: self.centre + shift,
            sigma,
            blur: state[4],
            contrast,
            residual: mean_square.sqrt(),
        })
    }
}

/// The two edges at one state of the unknowns.
struct Edges {
    centre: Vec2,
    along: [Vec2; 2],
    curvatures: [f64; 2],
    blur: f64,
}

impl Edges {
    fn new(state: &Unknowns, guess: &Guess) -> Self {
        let along = [state[2], state[3]].map(|angle| Rotation2::new(angle) * Vec2::x());
        Self { centre: Vec2::new(state[0], state[1]), along, curvatures: guess.curvatures, blur: state[4] }
    }

    /// Signed distance from an edge at an offset, and its derivatives by the centre and by the edge's angle.
    fn distance(&self, edge: usize, offset: &Vec2) -> (f64, Vec2, f64) {
        let (t, d) = (self.along[edge], offset - self.centre);
        let (along, across) = (t.dot(&d), t.perp(&d));
        let bend = self.curvatures[edge] * along;
        let by_centre = Vec2::new(t.y, -t.x) + t * bend;
        (across - 0.5 * bend * along, by_centre, -along - bend * across)
    }

    fn shape(&self, offset: &Vec2) -> f64 {
        profile(self.distance(0, offset).0, self.blur)[0] * profile(self.distance(1, offset).0, self.blur)[0]
    }

    /// The product of the profiles and its derivatives by centre, angles and blur.
    fn shape_with_derivatives(&self, offset: &Vec2) -> (f64, [f64; 5]) {
        let (d0, c0, a0) = self.distance(0, offset);
        let (d1, c1, a1) = self.distance(1, offset);
        let [p0, slope0, blur0] = profile(d0, self.blur);
        let [p1, slope1, blur1] = profile(d1, self.blur);
        let (s0, s1) = (slope0 * p1, p0 * slope1);
        let by_centre = c0 * s0 + c1 * s1;
        (p0 * p1, [by_centre.x, by_centre.y, a0 * s0, a1 * s1, blur0 * p1 + p0 * blur1])
    }
}

/// A step from −1 to 1 at zero, blurred by a Gaussian and averaged over one pixel; its derivatives by distance and blur.
fn profile(distance: f64, blur: f64) -> [f64; 3] {
    if distance.abs() > 4.5 * blur + 0.5 {
        return [distance.signum(), 0.0, 0.0];
    }
    let scale = FRAC_1_SQRT_2 / blur;
    let ends = [distance - 0.5, distance + 0.5].map(|x| (x, erf_and_gauss(x * scale)));
    let root = FRAC_2_PI.sqrt();
    let integral = |(x, (erf, gauss)): (f64, (f64, f64))| x * erf + blur * root * gauss;
    let [(_, low), (_, high)] = ends;
    [integral(ends[1]) - integral(ends[0]), high.0 - low.0, root * (high.1 - low.1)]
}

/// `erf(x)` within 1.5e-7 (Abramowitz and Stegun, 7.1.26) and `exp(−x²)`.
fn erf_and_gauss(x: f64) -> (f64, f64) {
    let gauss = (-x * x).exp();
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let series =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    ((1.0 - series * gauss).copysign(x), gauss)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guess() -> Guess {
        let steps = [Vec2::new(14.0, 3.0), Vec2::new(-4.0, 11.0)];
        Guess { position: Vec2::new(20.0, 18.0), steps, curvatures: [0.004, -0.003], blur: 0.7 }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let state = Unknowns::from([0.3, -0.2, 0.25, 1.9, 0.8, 120.0, 60.0, 0.01, -0.004]);
        let (offset, h) = (Vec2::new(1.2, 0.7), 1e-3);
        let (_, analytic) = Edges::new(&state, &guess()).shape_with_derivatives(&offset);
        for k in 0..5 {
            let at = |h: f64| {
                let mut s = state;
                s[k] += h;
                Edges::new(&s, &guess()).shape(&offset)
            };
            let numeric = (at(h) - at(-h)) / (2.0 * h);
            // The series for erf is good to 1.5e-7, so differences of it are good to that over h.
            assert!((numeric - analytic[k]).abs() < 1e-3, "unknown {k}: {numeric} {}", analytic[k]);
        }
    }

    #[test]
    fn profile_runs_from_minus_one_to_one() {
        for blur in [0.1, 0.5, 2.0] {
            assert!(profile(0.0, blur)[0].abs() < 1e-9);
            assert!((profile(20.0, blur)[0] - 1.0).abs() < 1e-6 && (profile(-20.0, blur)[0] + 1.0).abs() < 1e-6);
            assert!(profile(0.3, blur)[0] > 0.0);
        }
    }

    #[test]
    fn a_flat_picture_has_no_corner_of_any_contrast() {
        let level = Plane { width: 40, height: 40, pixels: vec![90.0; 1600] };
        assert!(fit(&level, &guess(), &Effort { max_radius: 10.0, last_step: 0.01 }).is_none_or(|c| c.contrast < 1.0));
    }
}
