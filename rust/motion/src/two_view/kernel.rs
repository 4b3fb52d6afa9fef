//! Sampson's distances of all matches and their normal equations, in the processor's vectors: what consensus repeats.

use super::essential_of;
use super::refine::tangent_plane;
use geometry::{Mat3, Transform, Vec2, Vec3};
use nalgebra::{Matrix5, Vector5};
use pulp::{Arch, NullaryFnOnce};
use std::ops::{Add, Div, Mul, Sub};

/// Columns are filled up to a multiple of so many.
const LANES: usize = 4;
/// Keeps the filled-up places from dividing by zero.
const LEAST_SQUARED_NORMAL: f64 = 1e-30;

/// Matches by column: `a.x`, `a.y`, `b.x`, `b.y`, normalised units.
pub(super) struct Matches {
    columns: [Vec<f64>; 4],
    len: usize,
}

/// Weighted cost, `Jᵀ W J` and `Jᵀ W r` at a motion; the unknowns are a small rotation and a move of the translation in
/// [`tangent_plane`].
pub(super) struct Equations {
    pub(super) cost: f64,
    pub(super) hessian: Matrix5<f64>,
    pub(super) gradient: Vector5<f64>,
}

impl Matches {
    pub(super) fn new(a: &[Vec2], b: &[Vec2]) -> Self {
        let filled = a.len().next_multiple_of(LANES);
        let column = |values: &mut dyn Iterator<Item = f64>| {
            let mut column: Vec<f64> = Vec::with_capacity(filled);
            column.extend(values);
            column.resize(filled, 0.0);
            column
        };
        let columns = [
            column(&mut a.iter().map(|p| p.x)),
            column(&mut a.iter().map(|p| p.y)),
            column(&mut b.iter().map(|p| p.x)),
            column(&mut b.iter().map(|p| p.y)),
        ];
        Self { columns, len: a.len() }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Squared distances from an essential matrix, in place of what `squares` held.
    pub(super) fn squares(&self, essential: &Mat3, squares: &mut Vec<f64>) {
        squares.resize(self.columns[0].len(), 0.0);
        Arch::new().dispatch(Squares { matches: self, essential, squares });
        squares.truncate(self.len);
    }

    /// The normal equations of `sum of weight · squared distance`; one weight per match.
    pub(super) fn equations(&self, pose: &Transform, weights: &[f64]) -> Equations {
        let mut filled = weights.to_vec();
        filled.resize(self.columns[0].len(), 0.0);
        Arch::new().dispatch(Normal { matches: self, pose, weights: &filled })
    }
}

/// As many numbers as the processor works on at once. Plain loops, which the compiler turns into its instructions; the order of
/// all sums is the same on every processor.
#[derive(Clone, Copy)]
struct Lanes([f64; LANES]);

macro_rules! lane_by_lane {
    ($operator:ident, $method:ident, $symbol:tt) => {
        impl $operator for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for k in 0..LANES {
                    self.0[k] $symbol other.0[k];
                }
                self
            }
        }
    };
}
lane_by_lane!(Add, add, +=);
lane_by_lane!(Sub, sub, -=);
lane_by_lane!(Mul, mul, *=);
lane_by_lane!(Div, div, /=);

impl Lanes {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn at(column: &[f64; LANES]) -> Self {
        Self(*column)
    }

    #[inline(always)]
    fn root(mut self) -> Self {
        for k in 0..LANES {
            self.0[k] = self.0[k].sqrt();
        }
        self
    }

    #[inline(always)]
    fn at_least(mut self, least: f64) -> Self {
        for k in 0..LANES {
            self.0[k] = if self.0[k] > least { self.0[k] } else { least };
        }
        self
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        (self.0[0] + self.0[2]) + (self.0[1] + self.0[3])
    }
}

type Lanes3 = [Lanes; 3];

#[inline(always)]
fn dot(p: &Lanes3, q: &Lanes3) -> Lanes {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

#[inline(always)]
fn cross(p: &Lanes3, q: &Lanes3) -> Lanes3 {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// `p s - q r`.
#[inline(always)]
fn difference(p: &Lanes3, s: Lanes, q: &Lanes3, r: Lanes) -> Lanes3 {
    [p[0] * s - q[0] * r, p[1] * s - q[1] * r, p[2] * s - q[2] * r]
}

struct Squares<'a> {
    matches: &'a Matches,
    essential: &'a Mat3,
    squares: &'a mut [f64],
}

impl NullaryFnOnce for Squares<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let [ax, ay, bx, by] = self.matches.columns.each_ref().map(|column| column.as_chunks::<LANES>().0);
        let e: [Lanes3; 3] = std::array::from_fn(|i| std::array::from_fn(|j| Lanes::splat(self.essential[(i, j)])));
        let out = self.squares.as_chunks_mut::<LANES>().0;
        for ((((ax, ay), bx), by), out) in ax.iter().zip(ay).zip(bx).zip(by).zip(out) {
            let (ax, ay, bx, by) = (Lanes::at(ax), Lanes::at(ay), Lanes::at(bx), Lanes::at(by));
            let line_x = e[0][0] * ax + e[0][1] * ay + e[0][2];
            let line_y = e[1][0] * ax + e[1][1] * ay + e[1][2];
            let line_z = e[2][0] * ax + e[2][1] * ay + e[2][2];
            let back_x = e[0][0] * bx + e[1][0] * by + e[2][0];
            let back_y = e[0][1] * bx + e[1][1] * by + e[2][1];
            let n = bx * line_x + by * line_y + line_z;
            let d = line_x * line_x + line_y * line_y + back_x * back_x + back_y * back_y;
            *out = (n * n / d.at_least(LEAST_SQUARED_NORMAL)).0;
        }
    }
}

struct Normal<'a> {
    matches: &'a Matches,
    pose: &'a Transform,
    weights: &'a [f64],
}

impl NullaryFnOnce for Normal<'_> {
    type Output = Equations;

    #[inline(always)]
    fn call(self) -> Equations {
        let [ax, ay, bx, by] = self.matches.columns.each_ref().map(|column| column.as_chunks::<LANES>().0);
        let weights = self.weights.as_chunks::<LANES>().0;
        let vector = |v: &Vec3| [Lanes::splat(v.x), Lanes::splat(v.y), Lanes::splat(v.z)];
        let rotation = self.pose.rotation.matrix();
        let tangent = tangent_plane(&self.pose.translation);
        let frame = Frame {
            rows: std::array::from_fn(|i| std::array::from_fn(|j| Lanes::splat(rotation[(i, j)]))),
            t: vector(&self.pose.translation),
            tangent: std::array::from_fn(|k| vector(&tangent.column(k).into())),
        };
        let zero = Lanes::splat(0.0);
        let (mut cost, mut gradient, mut products) = (zero, [zero; 5], [[zero; 5]; 5]);
        for ((((ax, ay), bx), by), weight) in ax.iter().zip(ay).zip(bx).zip(by).zip(weights) {
            let (residual, row) = frame.residual(Lanes::at(ax), Lanes::at(ay), Lanes::at(bx), Lanes::at(by));
            let weight = Lanes::at(weight);
            let weighted = weight * residual;
            cost = cost + weighted * residual;
            for i in 0..5 {
                gradient[i] = gradient[i] + row[i] * weighted;
                let part = row[i] * weight;
                for (product, other) in products[i].iter_mut().zip(&row).take(i + 1) {
                    *product = *product + part * *other;
                }
            }
        }
        Equations {
            cost: cost.sum(),
            hessian: Matrix5::from_fn(|i, j| products[i.max(j)][i.min(j)].sum()),
            gradient: Vector5::from_fn(|i, _| gradient[i].sum()),
        }
    }
}

/// A motion, spread over the lanes.
struct Frame {
    rows: [Lanes3; 3],
    t: Lanes3,
    tangent: [Lanes3; 2],
}

impl Frame {
    /// Distance and its derivatives by the five unknowns.
    ///
    /// With `p = R a` the line in `b` is `t × p`, that in `a` is `Rᵀ m` with `m = b × t`, and `n = b · (t × p)`. The distance
    /// is `n / √d`, `d` the squared lengths of both normals.
    #[inline(always)]
    fn residual(&self, ax: Lanes, ay: Lanes, bx: Lanes, by: Lanes) -> (Lanes, [Lanes; 5]) {
        let (r, t, one) = (&self.rows, &self.t, Lanes::splat(1.0));
        let b = [bx, by, one];
        let p = [
            r[0][0] * ax + r[0][1] * ay + r[0][2],
            r[1][0] * ax + r[1][1] * ay + r[1][2],
            r[2][0] * ax + r[2][1] * ay + r[2][2],
        ];
        let (line, m) = (cross(t, &p), cross(&b, t));
        let back_x = r[0][0] * m[0] + r[1][0] * m[1] + r[2][0] * m[2];
        let back_y = r[0][1] * m[0] + r[1][1] * m[1] + r[2][1] * m[2];
        let n = dot(&b, &line);
        let d = line[0] * line[0] + line[1] * line[1] + back_x * back_x + back_y * back_y;
        let inverse = one / d.at_least(LEAST_SQUARED_NORMAL);
        let (root, ratio) = (inverse.root(), n * inverse);
        // Half the derivative of d is (line.x, line.y, 0) · d(line) + q · R d(back), with q the other normal in frame `b`.
        let q = [
            r[0][0] * back_x + r[0][1] * back_y,
            r[1][0] * back_x + r[1][1] * back_y,
            r[2][0] * back_x + r[2][1] * back_y,
        ];
        // This takes n's derivative and the line's part of d's together.
        let c = [bx - ratio * line[0], by - ratio * line[1], one];
        let turned = difference(&c, dot(t, &p), t, dot(&c, &p));
        let (turned_back, moved, moved_back) = (cross(&q, &m), cross(&p, &c), cross(&q, &b));
        let by_move = difference(&moved, one, &moved_back, ratio);
        let row = [
            (turned[0] - ratio * turned_back[0]) * root,
            (turned[1] - ratio * turned_back[1]) * root,
            (turned[2] - ratio * turned_back[2]) * root,
            dot(&self.tangent[0], &by_move) * root,
            dot(&self.tangent[1], &by_move) * root,
        ];
        (n * root, row)
    }
}

/// Squared distances from a motion.
pub(super) fn squares_of(matches: &Matches, pose: &Transform) -> Vec<f64> {
    let mut squares = Vec::new();
    matches.squares(&essential_of(pose), &mut squares);
    squares
}

#[cfg(test)]
mod tests {
    use super::super::refine::sampson_squared;
    use super::*;
    use crate::two_view::refine::retract;
    use nalgebra::Rotation3;
    use synthetic::Random;

    fn example(n: usize) -> (Vec<Vec2>, Vec<Vec2>, Transform) {
        let mut random = Random::new(3);
        let a: Vec<Vec2> = (0..n).map(|_| random.normal2(0.2)).collect();
        let b = a.iter().map(|p| p + random.normal2(0.02)).collect();
        let pose = Transform::new(Rotation3::new(Vec3::new(0.1, -0.3, 0.05)), Vec3::new(0.8, 0.1, -0.3).normalize());
        (a, b, pose)
    }

    #[test]
    fn squares_are_those_of_single_matches_whatever_their_number() {
        for n in [0, 1, 7, 8, 9, 66] {
            let (a, b, pose) = example(n);
            let found = squares_of(&Matches::new(&a, &b), &pose);
            assert_eq!(found.len(), n);
            for (found, (a, b)) in found.iter().zip(a.iter().zip(&b)) {
                let truth = sampson_squared(&essential_of(&pose), a, b);
                assert!((found - truth).abs() < 1e-12 * (1e-3 + truth));
            }
        }
    }

    #[test]
    fn equations_are_those_of_differences() {
        let (a, b, pose) = example(13);
        let weights: Vec<f64> = (0..13).map(|i| 0.1 * f64::from(i)).collect();
        let found = Matches::new(&a, &b).equations(&pose, &weights);
        let residuals = |pose: &Transform| -> Vec<f64> {
            let essential = essential_of(pose);
            let sign = |a: &Vec2, b: &Vec2| b.push(1.0).dot(&(essential * a.push(1.0))).signum();
            a.iter().zip(&b).map(|(a, b)| sign(a, b) * sampson_squared(&essential, a, b).sqrt()).collect()
        };
        let step = 1e-6;
        let columns: Vec<Vec<f64>> = (0..5)
            .map(|k| {
                let [less, more] = [-step, step].map(|s| residuals(&retract(&pose, &(Vector5::ith(k, 1.0) * s))));
                less.iter().zip(&more).map(|(l, m)| (m - l) / (2.0 * step)).collect()
            })
            .collect();
        let r = residuals(&pose);
        let sum = |p: &[f64], q: &[f64]| -> f64 { weights.iter().zip(p).zip(q).map(|((w, p), q)| w * p * q).sum() };
        assert!((found.cost - sum(&r, &r)).abs() < 1e-12);
        for i in 0..5 {
            assert!((found.gradient[i] - sum(&columns[i], &r)).abs() < 1e-7);
            for j in 0..5 {
                assert!((found.hessian[(i, j)] - sum(&columns[i], &columns[j])).abs() < 1e-6);
            }
        }
    }
}
