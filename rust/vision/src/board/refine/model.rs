//! The grey values around a corner as a model with derivatives.
//!
//! The grey value is `(a + b s) (1 + g·x)`: black and white by `a` and `b`, light that changes linearly by `g`, and the
//! shape `s` between −1 and 1 made of two edges. Each edge has the profile `p` of a step blurred by a Gaussian and integrated
//! over a pixel, at the signed distance from the edge: `s = p₁ p₂` where four squares meet, `2 q₁ q₂ − 1` with
//! `q = (1 + p) / 2` at the corner of a single square. Lens distortion bends edges; their curvature is given.

use super::lanes::{Lanes, erf_and_gauss};
use nalgebra::{SMatrix, SVector};
use std::f32::consts::FRAC_1_SQRT_2;

/// Unknowns: centre (2), angles of the two edges (2), blur, a, b, g (2).
pub(super) const N: usize = 9;
pub(super) type Unknowns = SVector<f64, N>;

/// √(2/π).
const GAUSS_SCALE: f32 = 0.797_884_6;

/// What meets in a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::board) enum Shape {
    /// Four squares.
    Crossing,
    /// The corner of one square, which lies in the positive quarter of the two steps.
    Square,
}

/// Pixels of a window, eight together: offsets from its middle, grey values, weights (0 where there is none).
#[derive(Clone, Copy, Default)]
pub(super) struct Samples {
    pub(super) x: Lanes,
    pub(super) y: Lanes,
    pub(super) value: Lanes,
    pub(super) weight: Lanes,
}

/// Cost `Σ w r²`, `Jᵀ W J` and `Jᵀ W r`.
pub(super) struct Equations {
    pub(super) cost: f64,
    pub(super) normal: SMatrix<f64, N, N>,
    pub(super) gradient: Unknowns,
}

/// The two edges at one state of the unknowns.
#[derive(Clone, Copy)]
pub(super) struct Model {
    shape: Shape,
    centre: [f32; 2],
    along: [[f32; 2]; 2],
    curvatures: [f32; 2],
    /// Which side of each edge counts as positive.
    sides: [f32; 2],
    blur: f32,
    grey: [f32; 4],
}

impl Model {
    /// `side`: the sign of the angle from the first edge to the second.
    pub(super) fn new(shape: Shape, curvatures: [f64; 2], side: f64, state: &Unknowns) -> Self {
        let along = [state[2], state[3]].map(|angle: f64| [angle.cos() as f32, angle.sin() as f32]);
        Self {
            shape,
            centre: [state[0] as f32, state[1] as f32],
            along,
            curvatures: curvatures.map(|c| c as f32),
            sides: [side as f32, -side as f32],
            blur: state[4] as f32,
            grey: [5, 6, 7, 8].map(|k| state[k] as f32),
        }
    }

    /// The sums of a Gauss–Newton step over all samples.
    pub(super) fn linearise(&self, samples: &[Samples]) -> Equations {
        let mut sums = Sums {
            cost: Lanes::default(),
            normal: [Lanes::default(); N * (N + 1) / 2],
            gradient: [Lanes::default(); N],
        };
        pulp::Arch::new().dispatch(Accumulate { model: self, samples, sums: &mut sums });
        let mut normal = SMatrix::zeros();
        for row in 0..N {
            for column in 0..=row {
                let sum = sums.normal[row * (row + 1) / 2 + column].sum();
                (normal[(row, column)], normal[(column, row)]) = (sum, sum);
            }
        }
        Equations { cost: sums.cost.sum(), normal, gradient: Unknowns::from(sums.gradient.map(Lanes::sum)) }
    }

    /// Two samples together: half as many sums are read and written.
    #[inline(always)]
    fn accumulate<const FUSED: bool>(&self, samples: &[Samples], sums: &mut Sums) {
        let (pairs, single) = samples.as_chunks::<2>();
        let last = [single.first().copied().unwrap_or_default(), Samples::default()];
        for [a, b] in pairs.iter().chain([&last]) {
            let (a, b) = (self.terms::<FUSED>(a), self.terms::<FUSED>(b));
            sums.cost = (a.weight * a.residual).times_plus::<FUSED>(a.residual, sums.cost);
            sums.cost = (b.weight * b.residual).times_plus::<FUSED>(b.residual, sums.cost);
            let mut k = 0;
            for row in 0..N {
                let (p, q) = (a.weight * a.jacobian[row], b.weight * b.jacobian[row]);
                let gradient = p.times_plus::<FUSED>(a.residual, sums.gradient[row]);
                sums.gradient[row] = q.times_plus::<FUSED>(b.residual, gradient);
                for column in 0..=row {
                    let sum = p.times_plus::<FUSED>(a.jacobian[column], sums.normal[k]);
                    sums.normal[k] = q.times_plus::<FUSED>(b.jacobian[column], sum);
                    k += 1;
                }
            }
        }
    }

    #[inline(always)]
    fn terms<const FUSED: bool>(&self, sample: &Samples) -> Terms {
        let [a, b, gx, gy] = self.grey;
        let (shape, by_edges) = self.shape::<FUSED>(sample);
        let light = sample.x * gx + sample.y * gy + 1.0;
        let paper = shape * b + a;
        let gain = light * b;
        let jacobian = [
            gain * by_edges[0],
            gain * by_edges[1],
            gain * by_edges[2],
            gain * by_edges[3],
            gain * by_edges[4],
            light,
            shape * light,
            paper * sample.x,
            paper * sample.y,
        ];
        Terms { jacobian, residual: paper * light - sample.value, weight: sample.weight }
    }

    /// The shape and its derivatives by centre, angles and blur.
    #[inline(always)]
    fn shape<const FUSED: bool>(&self, sample: &Samples) -> (Lanes, [Lanes; 5]) {
        let dx = sample.x - self.centre[0];
        let dy = sample.y - self.centre[1];
        let (first, second) = (self.edge::<FUSED>(0, dx, dy), self.edge::<FUSED>(1, dx, dy));
        let (shape, of_first, of_second) = match self.shape {
            Shape::Crossing => (first.profile * second.profile, second.profile, first.profile),
            Shape::Square => {
                let (p, q) = (first.profile * 0.5 + 0.5, second.profile * 0.5 + 0.5);
                (p * q * 2.0 - 1.0, q, p)
            }
        };
        let (s0, s1) = (first.by_distance * of_first, second.by_distance * of_second);
        let derivatives = [
            s0 * first.by_centre[0] + s1 * second.by_centre[0],
            s0 * first.by_centre[1] + s1 * second.by_centre[1],
            s0 * first.by_angle,
            s1 * second.by_angle,
            first.by_blur * of_first + second.by_blur * of_second,
        ];
        (shape, derivatives)
    }

    /// An edge's profile at offsets from the centre; derivatives of its distance and of its profile.
    #[inline(always)]
    fn edge<const FUSED: bool>(&self, k: usize, dx: Lanes, dy: Lanes) -> Edge {
        let ([tx, ty], side) = (self.along[k], self.sides[k]);
        let along = dx * tx + dy * ty;
        let across = dy * tx - dx * ty;
        let bend = along * self.curvatures[k];
        let distance = (across - bend * along * 0.5) * side;
        let (profile, by_distance, by_blur) = profile::<FUSED>(distance, self.blur);
        Edge {
            profile,
            by_distance,
            by_blur,
            by_centre: [(bend * tx + ty) * side, (bend * ty - tx) * side],
            by_angle: -(along + bend * across) * side,
        }
    }
}

/// [`Model::accumulate`] for the widest vectors of the machine.
struct Accumulate<'a> {
    model: &'a Model,
    samples: &'a [Samples],
    sums: &'a mut Sums,
}

impl pulp::WithSimd for Accumulate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        // Without such an instruction, fused multiplication is a slow function.
        if S::IS_SCALAR {
            self.model.accumulate::<false>(self.samples, self.sums);
        } else {
            self.model.accumulate::<true>(self.samples, self.sums);
        }
    }
}

/// What eight pixels add to the sums.
struct Terms {
    jacobian: [Lanes; N],
    residual: Lanes,
    weight: Lanes,
}

struct Sums {
    cost: Lanes,
    /// The lower triangle, row by row.
    normal: [Lanes; N * (N + 1) / 2],
    gradient: [Lanes; N],
}

struct Edge {
    profile: Lanes,
    by_distance: Lanes,
    by_blur: Lanes,
    by_centre: [Lanes; 2],
    by_angle: Lanes,
}

/// A step from −1 to 1 at zero, blurred by a Gaussian and averaged over one pixel; its derivatives by distance and blur.
#[inline(always)]
fn profile<const FUSED: bool>(distance: Lanes, blur: f32) -> (Lanes, Lanes, Lanes) {
    let total = (blur * blur + 1.0 / 12.0).sqrt();
    let (profile, gauss) = erf_and_gauss::<FUSED>(distance * (FRAC_1_SQRT_2 / total));
    let by_distance = gauss * (GAUSS_SCALE / total);
    (profile, by_distance, -(distance * by_distance) * (blur / (total * total)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(x: f32, y: f32) -> Samples {
        Samples { x: Lanes::all(x), y: Lanes::all(y), value: Lanes::all(0.0), weight: Lanes::all(1.0) }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let state = Unknowns::from([0.3, -0.2, 0.25, 1.9, 0.8, 120.0, 60.0, 0.01, -0.004]);
        for shape in [Shape::Crossing, Shape::Square] {
            let model = |state: &Unknowns| Model::new(shape, [0.004, -0.003], 1.0, state);
            let (_, analytic) = model(&state).shape::<false>(&sample(1.2, 0.7));
            for k in 0..5 {
                let at = |h: f64| {
                    let mut s = state;
                    s[k] += h;
                    model(&s).shape::<false>(&sample(1.2, 0.7)).0.0[0]
                };
                let numeric = (at(1e-2) - at(-1e-2)) / 2e-2;
                assert!((numeric - analytic[k].0[0]).abs() < 2e-3, "{shape:?} {k}: {numeric} {}", analytic[k].0[0]);
            }
        }
    }

    #[test]
    fn profile_runs_from_minus_one_to_one() {
        for blur in [0.1, 0.5, 2.0] {
            let at = |distance| profile::<true>(Lanes::all(distance), blur).0.0[0];
            assert!(at(0.0).abs() < 1e-6);
            assert!((at(20.0) - 1.0).abs() < 1e-5 && (at(-20.0) + 1.0).abs() < 1e-5);
            assert!(at(0.3) > 0.0);
        }
    }

    #[test]
    fn one_square_is_bright_in_one_quarter_only() {
        let state = Unknowns::from([0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.5, 0.0, 1.0, 0.0, 0.0]);
        let at = |shape, x, y| Model::new(shape, [0.0; 2], 1.0, &state).shape::<false>(&sample(x, y)).0.0[0].round();
        let quarters = [(5.0, 5.0), (-5.0, 5.0), (-5.0, -5.0), (5.0, -5.0)];
        assert_eq!(quarters.map(|(x, y)| at(Shape::Square, x, y)), [1.0, -1.0, -1.0, -1.0]);
        assert_eq!(quarters.map(|(x, y)| at(Shape::Crossing, x, y)), [1.0, -1.0, 1.0, -1.0]);
    }
}
