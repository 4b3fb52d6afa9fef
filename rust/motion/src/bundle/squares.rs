//! Derivatives of a block of observations, squared and weighted.
//!
//! With `y = R x` and `J` the derivative of the residual by the point in the camera frame, the derivatives by the pose are
//! `[-J [y]×  J]` and by the point `J R`: every block of the normal equations comes from `H = Jᵀ J`, `y` and `R`.

use super::block::{Column, Inputs, SIZE, Seen, ZERO};
use super::lanes::Lanes;
use geometry::Camera;
use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// Sums of an observation that its frame takes.
pub(super) const OF_FRAME: usize = 27;
/// Sums of an observation that its point takes.
pub(super) const OF_POINT: usize = 9;
/// What its frame's block against its point's is made of.
pub(super) const OF_SIGHT: usize = 12;
/// Unknowns of the camera, refined or not: the logarithm of the focal length, `k1`, `k2`, `cx`, `cy`.
pub(super) const CAMERA: usize = 5;
/// Sums of an observation against them: three each for the frame's shift, then three each for its turn.
pub(super) const FRAME_BY_CAMERA: usize = 6 * CAMERA;
/// The same for the point.
pub(super) const POINT_BY_CAMERA: usize = 3 * CAMERA;
/// Products of the camera's unknowns, a triangle of them …
pub(super) const CAMERA_TRIANGLE: usize = CAMERA * (CAMERA + 1) / 2;
/// … and all sums of an observation that the camera takes.
pub(super) const OF_CAMERA: usize = CAMERA_TRIANGLE + CAMERA;

/// Derivatives of the observations, squared and weighted.
pub(super) struct Squares {
    /// `H` (xx, xy, yy, xz, yz, zz), `[y]× H` column by column, `[y]× H [y]×ᵀ` as `H`, then the gradient, turn first.
    pub(super) of_frame: [Column; OF_FRAME],
    /// `Rᵀ H R` as `H`, then the gradient.
    pub(super) of_point: [Column; OF_POINT],
}

/// Derivatives against those by the camera's unknowns: `C` with a column for each; zero for what is not refined.
pub(super) struct CameraSquares {
    /// `Cᵀ J` row by row, then `y` × each row.
    pub(super) by_frame: [Column; FRAME_BY_CAMERA],
    /// `Cᵀ J R` row by row.
    pub(super) by_point: [Column; POINT_BY_CAMERA],
    /// The lower triangle of `Cᵀ C` row by row, then `Cᵀ r`.
    pub(super) own: [Column; OF_CAMERA],
}

/// Places of the lower triangle of a 3×3 matrix in the order in which it is kept.
pub(super) const TRIANGLE: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

/// `J` of a register of observations without its weight: two rows; the residual, and what both are made of.
struct Jacobian<S: Simd> {
    rows: [[Lanes<S>; 3]; 2],
    residual: [Lanes<S>; 2],
    weight: Lanes<S>,
    turned: [Lanes<S>; 3],
    /// `R`, column by column.
    rotation: [[Lanes<S>; 3]; 3],
    normalised: [Lanes<S>; 2],
    inverse_sigma: Lanes<S>,
}

impl<S: Simd> Jacobian<S> {
    #[inline(always)]
    fn new(simd: S, inputs: &Inputs, seen: &Seen, camera: &Camera, i: usize) -> Self {
        let Camera { fx, fy, k1, k2, k3, p1, p2, .. } = *camera;
        let [a, b, _] = load(simd, [&seen.normalised[0], &seen.normalised[1], &seen.weight], i);
        let r2 = a * a + b * b;
        let radial = Lanes::splat(simd, 1.0)
            + r2 * (Lanes::splat(simd, k1) + r2 * (Lanes::splat(simd, k2) + r2 * Lanes::splat(simd, k3)));
        let slope =
            Lanes::splat(simd, 2.0 * k1) + r2 * (Lanes::splat(simd, 4.0 * k2) + r2 * Lanes::splat(simd, 6.0 * k3));
        let by_a = radial + slope * a * a + Lanes::splat(simd, 2.0 * p1) * b + Lanes::splat(simd, 6.0 * p2) * a;
        let by_b = radial + slope * b * b + Lanes::splat(simd, 6.0 * p1) * b + Lanes::splat(simd, 2.0 * p2) * a;
        let mixed = slope * a * b + Lanes::splat(simd, 2.0 * p1) * a + Lanes::splat(simd, 2.0 * p2) * b;
        let inverse_sigma = Lanes::load(simd, &inputs.inverse_sigma, i);
        let scale = Lanes::load(simd, &seen.inverse_depth, i) * inverse_sigma;
        let (along, across) = (scale * Lanes::splat(simd, fx), scale * Lanes::splat(simd, fy));
        let (ua, ub, va, vb) = (along * by_a, along * mixed, across * mixed, across * by_b);
        let ([r, s, t], [u, v]) = (&seen.turned, &seen.residual);
        let [u, v, weight] = load(simd, [u, v, &seen.weight], i);
        let m = &inputs.rotation;
        Self {
            rows: [[ua, ub, -(ua * a + ub * b)], [va, vb, -(va * a + vb * b)]],
            residual: [u, v],
            weight,
            turned: load(simd, [r, s, t], i),
            rotation: [
                load(simd, [&m[0], &m[3], &m[6]], i),
                load(simd, [&m[1], &m[4], &m[7]], i),
                load(simd, [&m[2], &m[5], &m[8]], i),
            ],
            normalised: [a, b],
            inverse_sigma,
        }
    }
}

// Functions rather than closures from here on: a closure does not take over the processor's features and its calls stay calls.

#[inline(always)]
fn load<S: Simd>(simd: S, columns: [&Column; 3], i: usize) -> [Lanes<S>; 3] {
    [Lanes::load(simd, columns[0], i), Lanes::load(simd, columns[1], i), Lanes::load(simd, columns[2], i)]
}

#[inline(always)]
fn store<S: Simd>(values: [Lanes<S>; 3], columns: &mut [Column], i: usize) {
    values[0].store(&mut columns[0], i);
    values[1].store(&mut columns[1], i);
    values[2].store(&mut columns[2], i);
}

#[inline(always)]
fn scaled<S: Simd>(factor: Lanes<S>, v: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [factor * v[0], factor * v[1], factor * v[2]]
}

/// `a u + b v`.
#[inline(always)]
fn combined<S: Simd>((a, u): (Lanes<S>, [Lanes<S>; 3]), (b, v): (Lanes<S>, [Lanes<S>; 3])) -> [Lanes<S>; 3] {
    [a * u[0] + b * v[0], a * u[1] + b * v[1], a * u[2] + b * v[2]]
}

/// A matrix of rows times a vector.
#[inline(always)]
fn times<S: Simd>(rows: [[Lanes<S>; 3]; 3], v: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)]
}

/// The lower triangle of a matrix of rows.
#[inline(always)]
fn store_triangle<S: Simd>(rows: [[Lanes<S>; 3]; 3], columns: &mut [Column], i: usize) {
    store([rows[0][0], rows[1][0], rows[1][1]], &mut columns[..3], i);
    store(rows[2], &mut columns[3..6], i);
}

#[inline(always)]
pub(super) fn cross<T: Copy + Mul<Output = T> + Sub<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot<T: Copy + Mul<Output = T> + Add<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Squares {
    pub(super) fn new() -> Self {
        Self { of_frame: [ZERO; OF_FRAME], of_point: [ZERO; OF_POINT] }
    }

    /// Fills the sums, and what the frame's block against the point's is made of: `H R` column by column, then `y`.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(
        &mut self,
        simd: S,
        (inputs, seen): (&Inputs, &Seen),
        camera: &Camera,
        of_sight: &mut [Column; OF_SIGHT],
    ) {
        for i in 0..SIZE / S::F64_LANES {
            let jacobian = Jacobian::new(simd, inputs, seen, camera, i);
            let ([u, v], w, y, r) = (jacobian.rows, jacobian.weight, jacobian.turned, jacobian.rotation);
            let (wu, wv) = (scaled(w, u), scaled(w, v));
            let hessian =
                [combined((wu[0], u), (wv[0], v)), combined((wu[1], u), (wv[1], v)), combined((wu[2], u), (wv[2], v))];
            let gradient = combined((jacobian.residual[0], wu), (jacobian.residual[1], wv));
            // Columns of [y]× H; H is symmetric.
            let turned = [cross(y, hessian[0]), cross(y, hessian[1]), cross(y, hessian[2])];
            let twice = [
                cross(y, [turned[0][0], turned[1][0], turned[2][0]]),
                cross(y, [turned[0][1], turned[1][1], turned[2][1]]),
                cross(y, [turned[0][2], turned[1][2], turned[2][2]]),
            ];
            let product = [times(hessian, r[0]), times(hessian, r[1]), times(hessian, r[2])];
            store_triangle(hessian, &mut self.of_frame[..6], i);
            store_triangle(twice, &mut self.of_frame[15..21], i);
            for j in 0..3 {
                store(turned[j], &mut self.of_frame[6 + 3 * j..9 + 3 * j], i);
                store(product[j], &mut of_sight[3 * j..3 * j + 3], i);
            }
            store(cross(y, gradient), &mut self.of_frame[21..24], i);
            store(gradient, &mut self.of_frame[24..], i);
            store(y, &mut of_sight[9..], i);
            store_triangle(
                [times(product, r[0]), times(product, r[1]), times(product, r[2])],
                &mut self.of_point[..6],
                i,
            );
            store(times(r, gradient), &mut self.of_point[6..], i);
        }
    }
}

impl CameraSquares {
    pub(super) fn new() -> Self {
        Self { by_frame: [ZERO; FRAME_BY_CAMERA], by_point: [ZERO; POINT_BY_CAMERA], own: [ZERO; OF_CAMERA] }
    }

    #[inline(always)]
    pub(super) fn fill<S: Simd>(
        &mut self,
        simd: S,
        (inputs, seen): (&Inputs, &Seen),
        camera: &Camera,
        refined: &[usize],
    ) {
        let Camera { fx, fy, k1, k2, k3, p1, p2, .. } = *camera;
        let zero = Lanes::splat(simd, 0.0);
        for i in 0..SIZE / S::F64_LANES {
            let jacobian = Jacobian::new(simd, inputs, seen, camera, i);
            let ([u, v], [a, b], w) = (jacobian.rows, jacobian.normalised, jacobian.weight);
            let r2 = a * a + b * b;
            let radial = Lanes::splat(simd, 1.0)
                + r2 * (Lanes::splat(simd, k1) + r2 * (Lanes::splat(simd, k2) + r2 * Lanes::splat(simd, k3)));
            let factor = radial + Lanes::splat(simd, 2.0 * p1) * b + Lanes::splat(simd, 2.0 * p2) * a;
            let along = Lanes::splat(simd, fx) * jacobian.inverse_sigma;
            let across = Lanes::splat(simd, fy) * jacobian.inverse_sigma;
            let focal = [
                along * (a * factor + Lanes::splat(simd, p2) * r2),
                across * (b * factor + Lanes::splat(simd, p1) * r2),
            ];
            let k1 = [along * a * r2, across * b * r2];
            let (right, down) = ([jacobian.inverse_sigma, zero], [zero, jacobian.inverse_sigma]);
            let by_camera = [focal, k1, [k1[0] * r2, k1[1] * r2], right, down];
            for &k in refined {
                let c = by_camera[k];
                let weighted = [w * c[0], w * c[1]];
                let shift = combined((weighted[0], u), (weighted[1], v));
                store(shift, &mut self.by_frame[3 * k..3 * k + 3], i);
                store(cross(jacobian.turned, shift), &mut self.by_frame[3 * (CAMERA + k)..3 * (CAMERA + k) + 3], i);
                store(times(jacobian.rotation, shift), &mut self.by_point[3 * k..3 * k + 3], i);
                for (j, other) in by_camera.iter().enumerate().take(k + 1) {
                    let product = weighted[0] * other[0] + weighted[1] * other[1];
                    product.store(&mut self.own[k * (k + 1) / 2 + j], i);
                }
                let gradient = weighted[0] * jacobian.residual[0] + weighted[1] * jacobian.residual[1];
                gradient.store(&mut self.own[CAMERA_TRIANGLE + k], i);
            }
        }
    }
}
