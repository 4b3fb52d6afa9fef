//! Refinement of a motion on its five degrees of freedom: the paper's epipolar distances and Sampson's distance.
//!
//! Source: paper, section 2.5; Hartley and Zisserman, *Multiple View Geometry*, 11.4 and 11.6.

use super::essential_of;
use geometry::least_squares::Loss;
use geometry::{Mat3, Transform, Vec2, Vec3, skew};
use nalgebra::{Matrix3x2, Matrix5, Rotation3, SMatrix, SVector, Vector5};

/// Minimises the sum of squared distances between points and their epipolar lines, in both frames (the paper's refinement).
///
/// `a`, `b`: matches in normalised coordinates; `start`: `b_from_a`. The translation of the answer has length one.
pub fn refine_epipolar(a: &[Vec2], b: &[Vec2], start: &Transform) -> Transform {
    minimise(a, b, start, (50, 1e-10), epipolar_distances, |squared| (squared, 1.0))
}

/// [`refine_epipolar`] on the matches that lie near their epipolar lines, again and again as the lines move: what the paper's
/// local adjustment leaves of the mismatches is dropped.
pub fn refine_epipolar_trimmed(a: &[Vec2], b: &[Vec2], start: &Transform) -> Transform {
    let mut motion = *start;
    for _ in 0..TRIMMINGS {
        let essential = essential_of(&motion);
        let distances: Vec<f64> = a.iter().zip(b).map(|(a, b)| sampson_squared(&essential, a, b).sqrt()).collect();
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = TRIM_LIMIT * sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let near = |list: &[Vec2]| -> Vec<Vec2> {
            list.iter().zip(&distances).filter(|(_, d)| **d <= limit).map(|(p, _)| *p).collect()
        };
        motion = refine_epipolar(&near(a), &near(b), &motion);
    }
    motion
}

/// Times that the near matches are chosen anew.
const TRIMMINGS: usize = 8;
/// Farther than this many times the median is not near: 2.5 standard deviations of a normal distribution.
const TRIM_LIMIT: f64 = 2.5 * 1.4826;

/// Minimises a robust loss of Sampson's distances over `sigma`, their standard deviation in normalised units.
pub fn refine_sampson(a: &[Vec2], b: &[Vec2], start: &Transform, sigma: f64, loss: Loss) -> Transform {
    let s2 = sigma * sigma;
    minimise(a, b, start, (30, 1e-10), sampson_distance, |squared| {
        let (cost, weight) = loss.evaluate(squared / s2);
        (cost * s2, weight)
    })
}

/// Sampson's distance of a match from an essential matrix, squared: first-order distance to the nearest exact match.
pub(super) fn sampson_squared(essential: &Mat3, a: &Vec2, b: &Vec2) -> f64 {
    let e = essential;
    let line_x = e[(0, 0)] * a.x + e[(0, 1)] * a.y + e[(0, 2)];
    let line_y = e[(1, 0)] * a.x + e[(1, 1)] * a.y + e[(1, 2)];
    let line_z = e[(2, 0)] * a.x + e[(2, 1)] * a.y + e[(2, 2)];
    let back_x = e[(0, 0)] * b.x + e[(1, 0)] * b.y + e[(2, 0)];
    let back_y = e[(0, 1)] * b.x + e[(1, 1)] * b.y + e[(2, 1)];
    let n = b.x * line_x + b.y * line_y + line_z;
    n * n / (line_x * line_x + line_y * line_y + back_x * back_x + back_y * back_y).max(f64::MIN_POSITIVE)
}

/// A residual and its derivatives by the nine entries of the essential matrix, row by row.
type Residual = (f64, SVector<f64, 9>);

/// What both kinds of distance are made of, for one match.
struct Epipolar {
    /// `bᵀ E a`.
    algebraic: f64,
    /// Its derivatives: `b aᵀ`.
    outer: SVector<f64, 9>,
    /// The epipolar line in `b`: squared length of its normal and half its derivatives.
    line_b: (f64, SVector<f64, 9>),
    /// The same in `a`.
    line_a: (f64, SVector<f64, 9>),
}

impl Epipolar {
    fn new(e: &Mat3, a: &Vec2, b: &Vec2) -> Self {
        let (a, b) = (a.push(1.0), b.push(1.0));
        let (line_b, line_a) = (e * a, e.tr_mul(&b));
        let (p, q) = (&line_b, &line_a);
        #[rustfmt::skip]
        let by_line_b = SVector::from([p.x * a.x, p.x * a.y, p.x, p.y * a.x, p.y * a.y, p.y, 0.0, 0.0, 0.0]);
        #[rustfmt::skip]
        let by_line_a = SVector::from([q.x * b.x, q.y * b.x, 0.0, q.x * b.y, q.y * b.y, 0.0, q.x, q.y, 0.0]);
        #[rustfmt::skip]
        let outer = SVector::from([b.x * a.x, b.x * a.y, b.x, b.y * a.x, b.y * a.y, b.y, a.x, a.y, 1.0]);
        Self {
            algebraic: b.dot(&line_b),
            outer,
            line_b: (line_b.xy().norm_squared(), by_line_b),
            line_a: (line_a.xy().norm_squared(), by_line_a),
        }
    }

    /// The algebraic residual over the root of a squared length whose half derivatives are given.
    fn over_root(&self, squared: f64, half_derivatives: &SVector<f64, 9>) -> Residual {
        let inverse = 1.0 / squared.max(f64::MIN_POSITIVE);
        let root = inverse.sqrt();
        (self.algebraic * root, (self.outer - half_derivatives * (self.algebraic * inverse)) * root)
    }
}

fn epipolar_distances(pair: &Epipolar) -> [Option<Residual>; 2] {
    let (a, b) = (&pair.line_a, &pair.line_b);
    [Some(pair.over_root(b.0, &b.1)), Some(pair.over_root(a.0, &a.1))]
}

fn sampson_distance(pair: &Epipolar) -> [Option<Residual>; 2] {
    let (a, b) = (&pair.line_a, &pair.line_b);
    [Some(pair.over_root(a.0 + b.0, &(a.1 + b.1))), None]
}

/// Derivatives of the essential matrix's entries by a small rotation and a move of the translation on the sphere.
fn derivatives(pose: &Transform) -> SMatrix<f64, 5, 9> {
    let (rotation, t) = (pose.rotation.matrix(), skew(&pose.translation));
    let tangent = tangent_plane(&pose.translation);
    let by: [Mat3; 5] = std::array::from_fn(|k| match k {
        0..3 => t * skew(&Vec3::ith(k, 1.0)) * rotation,
        _ => skew(&tangent.column(k - 3).into()) * rotation,
    });
    SMatrix::from_fn(|k, entry| by[k][(entry / 3, entry % 3)])
}

/// Two unit vectors orthogonal to a direction and to each other.
pub(super) fn tangent_plane(direction: &Vec3) -> Matrix3x2<f64> {
    let first = direction.cross(&Vec3::ith(direction.iamin(), 1.0)).normalize();
    Matrix3x2::from_columns(&[first, direction.cross(&first).normalize()])
}

/// A motion after a small turn and a move of its translation in [`tangent_plane`].
pub(super) fn retract(pose: &Transform, step: &Vector5<f64>) -> Transform {
    let mut rotation = Rotation3::new(Vec3::new(step[0], step[1], step[2])) * pose.rotation;
    rotation.renormalize();
    let moved = pose.translation + tangent_plane(&pose.translation) * step.fixed_rows::<2>(3);
    Transform::new(rotation, moved.normalize())
}

/// Cost, `Jᵀ W J` and `Jᵀ W r` at a motion; `loss` gives cost and weight of a squared residual.
struct Equations {
    cost: f64,
    hessian: Matrix5<f64>,
    gradient: Vector5<f64>,
}

fn linearise(
    a: &[Vec2],
    b: &[Vec2],
    pose: &Transform,
    residuals: impl Fn(&Epipolar) -> [Option<Residual>; 2],
    loss: &impl Fn(f64) -> (f64, f64),
) -> Equations {
    let (essential, by_step) = (essential_of(pose), derivatives(pose));
    let mut sum = Equations { cost: 0.0, hessian: Matrix5::zeros(), gradient: Vector5::zeros() };
    for (a, b) in a.iter().zip(b) {
        for (r, j) in residuals(&Epipolar::new(&essential, a, b)).into_iter().flatten() {
            let (cost, weight) = loss(r * r);
            let j = by_step * j;
            sum.cost += cost;
            sum.hessian.syger(weight, &j, &j, 1.0);
            sum.gradient += j * (weight * r);
        }
    }
    sum.hessian.fill_upper_triangle_with_lower_triangle();
    sum
}

/// Levenberg–Marquardt with fixed-size equations.
fn minimise(
    a: &[Vec2],
    b: &[Vec2],
    start: &Transform,
    (iterations, tolerance): (usize, f64),
    residuals: impl Fn(&Epipolar) -> [Option<Residual>; 2] + Copy,
    loss: impl Fn(f64) -> (f64, f64),
) -> Transform {
    let mut pose = Transform::new(start.rotation, start.translation.normalize());
    let mut equations = linearise(a, b, &pose, residuals, &loss);
    let mut damping = 1e-4;
    for _ in 0..iterations {
        let mut damped = equations.hessian;
        (0..5).for_each(|k| damped[(k, k)] += damping * damped[(k, k)].max(1e-12));
        let Some(factor) = damped.cholesky() else { break };
        let candidate = retract(&pose, &-factor.solve(&equations.gradient));
        let next = linearise(a, b, &candidate, residuals, &loss);
        // Also false when the candidate is not finite.
        if next.cost < equations.cost {
            // A strongly damped step is small without being the last.
            let converged = damping < 1e-2 && equations.cost - next.cost <= tolerance * equations.cost;
            (pose, equations, damping) = (candidate, next, damping * 0.1);
            if converged {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e8 {
                break;
            }
        }
    }
    pose
}
