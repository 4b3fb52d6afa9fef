//! Projections and derivatives of a block of observations at once, in loops the compiler turns into vector instructions.
//!
//! With `y = R x` and `J` the derivative of the residual by the point in the camera frame, the derivatives by the pose are
//! `[-J [y]×  J]` and by the point `J R`: every block of the normal equations comes from `H = Jᵀ J`, `y` and `R`.

use super::State;
use super::layout::Sight;
use geometry::least_squares::Loss;
use geometry::{Camera, Vec3};

/// Observations in a block: several registers full, so that little is lost at its end.
pub(super) const SIZE: usize = 32;
/// A residual of an observation that has no pixel, standard deviations: no step may move a point behind the camera.
const NO_PIXEL: f64 = 1e4;
/// Nearer than this nothing is seen, metres; as in [`Camera::project`].
const NEAREST: f64 = 1e-9;

/// One number of each observation.
type Column = [f64; SIZE];

/// What is read of the observations: a column for each number.
pub(super) struct Inputs {
    /// `R`, row by row.
    rotation: [Column; 9],
    translation: [Column; 3],
    point: [Column; 3],
    pixel: [Column; 2],
    inverse_sigma: Column,
}

/// Where the points are seen.
pub(super) struct Seen {
    /// `R x`.
    turned: [Column; 3],
    /// `X/Z` and `Y/Z` in the camera frame.
    normalised: [Column; 2],
    inverse_depth: Column,
    /// Standard deviations.
    residual: [Column; 2],
    /// Their squared length.
    pub(super) squared: Column,
    /// Loss of the residual.
    pub(super) loss: Column,
    /// Its derivative.
    weight: Column,
    /// 1 where it is certain that the lens shows the point.
    sure: Column,
}

/// Sums of an observation that its frame takes.
pub(super) const OF_FRAME: usize = 27;
/// Sums of an observation that its point takes.
pub(super) const OF_POINT: usize = 9;
/// What its frame's block against its point's is made of.
pub(super) const OF_SIGHT: usize = 12;
/// Sums of an observation against the camera's three unknowns: nine for the frame's shift, nine for its turn.
pub(super) const FRAME_BY_CAMERA: usize = 18;
/// The same for the point.
pub(super) const POINT_BY_CAMERA: usize = 9;
/// Sums of an observation that the camera takes.
pub(super) const OF_CAMERA: usize = 9;

/// Derivatives of the observations, squared and weighted.
pub(super) struct Squares {
    /// `H` (xx, xy, yy, xz, yz, zz), `[y]× H` column by column, `[y]× H [y]×ᵀ` as `H`, then the gradient, turn first.
    pub(super) of_frame: [Column; OF_FRAME],
    /// `Rᵀ H R` as `H`, then the gradient.
    pub(super) of_point: [Column; OF_POINT],
    /// `H R` column by column, then `y`.
    pub(super) of_sight: [Column; OF_SIGHT],
}

/// Derivatives against those by logarithm of the focal length, `k1` and `k2`: `C` with three columns.
pub(super) struct CameraSquares {
    /// `Cᵀ J` row by row, then `y` × each row.
    pub(super) by_frame: [Column; FRAME_BY_CAMERA],
    /// `Cᵀ J R` row by row.
    pub(super) by_point: [Column; POINT_BY_CAMERA],
    /// `Cᵀ C` in the order of `H`, then `Cᵀ r`.
    pub(super) own: [Column; OF_CAMERA],
}

const ZERO: Column = [0.0; SIZE];

impl Inputs {
    pub(super) fn new() -> Self {
        Self {
            rotation: [ZERO; 9],
            translation: [ZERO; 3],
            point: [ZERO; 3],
            pixel: [ZERO; 2],
            inverse_sigma: [1.0; SIZE],
        }
    }

    /// Reads up to [`SIZE`] observations; columns beyond keep what they have.
    #[inline(always)]
    pub(super) fn gather(&mut self, sights: &[Sight], state: &State) {
        for (l, sight) in sights.iter().enumerate().take(SIZE) {
            let (pose, point) = (&state.poses[sight.frame], &state.points[sight.point]);
            let rotation = pose.rotation.matrix();
            for i in 0..3 {
                for j in 0..3 {
                    self.rotation[3 * i + j][l] = rotation[(i, j)];
                }
                self.translation[i][l] = pose.translation[i];
                self.point[i][l] = point[i];
            }
            self.pixel[0][l] = sight.pixel.x;
            self.pixel[1][l] = sight.pixel.y;
            self.inverse_sigma[l] = sight.inverse_sigma;
        }
    }
}

impl Seen {
    pub(super) fn new() -> Self {
        Self {
            turned: [ZERO; 3],
            normalised: [ZERO; 2],
            inverse_depth: ZERO,
            residual: [ZERO; 2],
            squared: ZERO,
            loss: ZERO,
            weight: ZERO,
            sure: ZERO,
        }
    }

    /// Projects the points and weighs the residuals.
    #[inline(always)]
    pub(super) fn project(&mut self, inputs: &Inputs, camera: &Camera, loss: Loss, count: usize) {
        self.project_all(inputs, camera);
        for l in 0..count {
            if self.sure[l] == 0.0 && !self.is_shown(inputs, camera, l) {
                self.squared[l] = NO_PIXEL * NO_PIXEL;
                (self.loss[l], self.weight[l]) = (loss.evaluate(self.squared[l]).0, 0.0);
            } else {
                (self.loss[l], self.weight[l]) = loss.evaluate(self.squared[l]);
            }
        }
    }

    fn is_shown(&self, inputs: &Inputs, camera: &Camera, l: usize) -> bool {
        let in_cam = Vec3::from_fn(|k, _| self.turned[k][l] + inputs.translation[k][l]);
        camera.project(&in_cam).is_some()
    }

    #[inline(always)]
    fn project_all(&mut self, inputs: &Inputs, camera: &Camera) {
        let Camera { fx, fy, cx, cy, k1, k2, k3, p1, p2, .. } = *camera;
        let tangential = 8.0 * (p1.abs() + p2.abs());
        for l in 0..SIZE {
            let (x, y, z) = (inputs.point[0][l], inputs.point[1][l], inputs.point[2][l]);
            let turn = |i: usize| {
                inputs.rotation[3 * i][l] * x + inputs.rotation[3 * i + 1][l] * y + inputs.rotation[3 * i + 2][l] * z
            };
            let turned = [turn(0), turn(1), turn(2)];
            let depth = turned[2] + inputs.translation[2][l];
            let inverse = if depth > NEAREST { 1.0 / depth } else { 0.0 };
            let a = (turned[0] + inputs.translation[0][l]) * inverse;
            let b = (turned[1] + inputs.translation[1][l]) * inverse;
            let r2 = a * a + b * b;
            let factor = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)) + 2.0 * (p1 * b + p2 * a);
            let u = (fx * (a * factor + p2 * r2) + cx - inputs.pixel[0][l]) * inputs.inverse_sigma[l];
            let v = (fy * (b * factor + p1 * r2) + cy - inputs.pixel[1][l]) * inputs.inverse_sigma[l];
            for k in 0..3 {
                self.turned[k][l] = turned[k];
            }
            self.normalised[0][l] = a;
            self.normalised[1][l] = b;
            self.inverse_depth[l] = inverse;
            self.residual[0][l] = u;
            self.residual[1][l] = v;
            self.squared[l] = u * u + v * v;
            // A bound of all terms' slopes: the lens cannot fold over where it is below one.
            let bend = r2 * (3.0 * k1.abs() + r2 * (5.0 * k2.abs() + r2 * (7.0 * k3.abs()))) + tangential * r2.sqrt();
            self.sure[l] = if depth > NEAREST && bend < 1.0 { 1.0 } else { 0.0 };
        }
    }
}

/// `J` of one observation without its weight: two rows; and the residual.
#[derive(Clone, Copy)]
struct Jacobian {
    rows: [[f64; 3]; 2],
    residual: [f64; 2],
    weight: f64,
}

impl Seen {
    #[inline(always)]
    fn jacobian(&self, inputs: &Inputs, camera: &Camera, l: usize) -> Jacobian {
        let Camera { fx, fy, k1, k2, k3, p1, p2, .. } = *camera;
        let (a, b) = (self.normalised[0][l], self.normalised[1][l]);
        let r2 = a * a + b * b;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3)));
        let by_a = radial + slope * a * a + 2.0 * p1 * b + 6.0 * p2 * a;
        let by_b = radial + slope * b * b + 6.0 * p1 * b + 2.0 * p2 * a;
        let mixed = slope * a * b + 2.0 * (p1 * a + p2 * b);
        let scale = self.inverse_depth[l] * inputs.inverse_sigma[l];
        let row = |focal: f64, first: f64, second: f64| {
            let (first, second) = (scale * focal * first, scale * focal * second);
            [first, second, -(first * a + second * b)]
        };
        Jacobian {
            rows: [row(fx, by_a, mixed), row(fy, mixed, by_b)],
            residual: [self.residual[0][l], self.residual[1][l]],
            weight: self.weight[l],
        }
    }
}

#[inline(always)]
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Places of the lower triangle of a 3×3 matrix in the order in which it is kept.
pub(super) const TRIANGLE: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

impl Squares {
    pub(super) fn new() -> Self {
        Self { of_frame: [ZERO; OF_FRAME], of_point: [ZERO; OF_POINT], of_sight: [ZERO; OF_SIGHT] }
    }

    #[inline(always)]
    pub(super) fn fill(&mut self, inputs: &Inputs, seen: &Seen, camera: &Camera) {
        for l in 0..SIZE {
            let Jacobian { rows, residual, weight } = seen.jacobian(inputs, camera, l);
            let square = |i: usize, j: usize| weight * (rows[0][i] * rows[0][j] + rows[1][i] * rows[1][j]);
            let hessian = [
                [square(0, 0), square(1, 0), square(2, 0)],
                [square(1, 0), square(1, 1), square(2, 1)],
                [square(2, 0), square(2, 1), square(2, 2)],
            ];
            let slope = |i: usize| weight * (rows[0][i] * residual[0] + rows[1][i] * residual[1]);
            let gradient = [slope(0), slope(1), slope(2)];
            let y = [seen.turned[0][l], seen.turned[1][l], seen.turned[2][l]];
            // Column j of [y]× H; H is symmetric.
            let turned = [cross(y, hessian[0]), cross(y, hessian[1]), cross(y, hessian[2])];
            let row = |i: usize| cross(y, [turned[0][i], turned[1][i], turned[2][i]]);
            let twice = [row(0), row(1), row(2)];
            let turn = cross(y, gradient);
            for (k, (i, j)) in TRIANGLE.into_iter().enumerate() {
                self.of_frame[k][l] = hessian[i][j];
                self.of_frame[15 + k][l] = twice[i][j];
            }
            let column = |j: usize| [inputs.rotation[j][l], inputs.rotation[3 + j][l], inputs.rotation[6 + j][l]];
            let columns = [column(0), column(1), column(2)];
            for j in 0..3 {
                let product = [dot(hessian[0], columns[j]), dot(hessian[1], columns[j]), dot(hessian[2], columns[j])];
                for i in 0..3 {
                    self.of_frame[6 + 3 * j + i][l] = turned[j][i];
                    self.of_sight[3 * j + i][l] = product[i];
                }
                self.of_frame[21 + j][l] = turn[j];
                self.of_frame[24 + j][l] = gradient[j];
                self.of_sight[9 + j][l] = y[j];
                self.of_point[6 + j][l] = dot(columns[j], gradient);
                for (k, (row, col)) in TRIANGLE.into_iter().enumerate() {
                    if col == j {
                        self.of_point[k][l] = dot(columns[row], product);
                    }
                }
            }
        }
    }
}

impl CameraSquares {
    pub(super) fn new() -> Self {
        Self { by_frame: [ZERO; FRAME_BY_CAMERA], by_point: [ZERO; POINT_BY_CAMERA], own: [ZERO; OF_CAMERA] }
    }

    #[inline(always)]
    pub(super) fn fill(&mut self, inputs: &Inputs, seen: &Seen, camera: &Camera) {
        let Camera { fx, fy, k1, k2, k3, p1, p2, .. } = *camera;
        for l in 0..SIZE {
            let Jacobian { rows, residual, weight } = seen.jacobian(inputs, camera, l);
            let (a, b) = (seen.normalised[0][l], seen.normalised[1][l]);
            let r2 = a * a + b * b;
            let factor = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)) + 2.0 * (p1 * b + p2 * a);
            let (along, across) = (fx * inputs.inverse_sigma[l], fy * inputs.inverse_sigma[l]);
            let by_camera = [
                [along * (a * factor + p2 * r2), across * (b * factor + p1 * r2)],
                [along * a * r2, across * b * r2],
                [along * a * r2 * r2, across * b * r2 * r2],
            ];
            let y = [seen.turned[0][l], seen.turned[1][l], seen.turned[2][l]];
            for (k, c) in by_camera.iter().enumerate() {
                let product = |i: usize| weight * (c[0] * rows[0][i] + c[1] * rows[1][i]);
                let shift = [product(0), product(1), product(2)];
                let turn = cross(y, shift);
                for j in 0..3 {
                    self.by_frame[3 * k + j][l] = shift[j];
                    self.by_frame[9 + 3 * k + j][l] = turn[j];
                    let column = [inputs.rotation[j][l], inputs.rotation[3 + j][l], inputs.rotation[6 + j][l]];
                    self.by_point[3 * k + j][l] = dot(shift, column);
                }
                self.own[6 + k][l] = weight * (c[0] * residual[0] + c[1] * residual[1]);
            }
            for (k, (i, j)) in TRIANGLE.into_iter().enumerate() {
                self.own[k][l] = weight * (by_camera[i][0] * by_camera[j][0] + by_camera[i][1] * by_camera[j][1]);
            }
        }
    }
}
