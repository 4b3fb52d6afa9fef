//! Projections of a block of observations at once, in loops the compiler turns into vector instructions.

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
pub(super) type Column = [f64; SIZE];

/// What is read of the observations: a column for each number.
pub(super) struct Inputs {
    /// `R`, row by row.
    pub(super) rotation: [Column; 9],
    translation: [Column; 3],
    point: [Column; 3],
    pixel: [Column; 2],
    pub(super) inverse_sigma: Column,
}

/// Where the points are seen.
pub(super) struct Seen {
    /// `R x`.
    pub(super) turned: [Column; 3],
    /// `X/Z` and `Y/Z` in the camera frame.
    pub(super) normalised: [Column; 2],
    pub(super) inverse_depth: Column,
    /// Standard deviations.
    pub(super) residual: [Column; 2],
    /// Their squared length.
    pub(super) squared: Column,
    /// Loss of the residual.
    pub(super) loss: Column,
    /// Its derivative.
    pub(super) weight: Column,
    /// 1 where it is certain that the lens shows the point.
    sure: Column,
}

pub(super) const ZERO: Column = [0.0; SIZE];

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
            self.turned[0][l] = turned[0];
            self.turned[1][l] = turned[1];
            self.turned[2][l] = turned[2];
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
