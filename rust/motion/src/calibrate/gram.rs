//! The normal equations of one picture of a board, summed over its corners.

use super::Model;
use super::solve::Weighting;
use geometry::{Camera, Transform, Vec2};
use nalgebra::{Matrix6, Vector6};

/// Rows of one corner, which are added side by side.
const LANES: usize = 2;
/// Corners whose rows are gathered before they are multiplied.
const CORNERS: usize = 4;
/// Unknowns of a pose.
const POSE: usize = 6;

/// The board's shape: heights `a x² + b x y + c y²` about its middle, along its z, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shape {
    /// Where the heights are zero, metres.
    pub(super) middle: Vec2,
    /// `a, b, c`, per metre.
    pub(super) bend: [f64; 3],
}

impl Shape {
    /// What `a, b, c` are multiplied with.
    pub(super) fn squares(&self, point: &Vec2) -> [f64; 3] {
        let d = point - self.middle;
        [d.x * d.x, d.x * d.y, d.y * d.y]
    }

    pub(super) fn height(&self, point: &Vec2) -> f64 {
        self.squares(point).iter().zip(self.bend).map(|(s, b)| s * b).sum()
    }
}

/// `Σ rowᵀ row` over both axes of all corners, rows being the derivatives by lens, bend and pose, and the residual.
///
/// Lens columns are those of [`geometry::CameraJacobian`], the first six of them when no more are free.
pub(super) struct Gram {
    /// Sum of the losses.
    pub(super) cost: f64,
    /// Columns before those of the pose.
    lens: usize,
    values: Vec<f64>,
}

impl Gram {
    /// Sums one picture; `None` where a corner has no pixel.
    pub(super) fn of(
        (points, pixels): (&[Vec2], &[Vec2]),
        (camera, pose, shape): (&Camera, &Transform, &Shape),
        model: &Model,
        weighting: Weighting,
    ) -> Option<Self> {
        let data = Data { points, pixels, camera, pose, shape, square_pixels: model.square_pixels, weighting };
        match model.columns() {
            6 => data.sum::<6, 13>(),
            9 => data.sum::<9, 16>(),
            _ => data.sum::<12, 19>(),
        }
    }

    pub(super) fn at(&self, row: usize, column: usize) -> f64 {
        self.values[row * (self.lens + POSE + 1) + column]
    }

    /// The products of the pose's columns.
    pub(super) fn pose(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.at(self.lens + i, self.lens + j))
    }

    /// The products of one column and those of the pose.
    pub(super) fn by_pose(&self, column: usize) -> Vector6<f64> {
        Vector6::from_fn(|j, _| self.at(column, self.lens + j))
    }

    /// The products of one column and the residuals.
    pub(super) fn gradient(&self, column: usize) -> f64 {
        self.at(column, self.lens + POSE)
    }

    /// The products of the pose's columns and the residuals.
    pub(super) fn pose_gradient(&self) -> Vector6<f64> {
        Vector6::from_fn(|j, _| self.gradient(self.lens + j))
    }
}

struct Data<'a> {
    points: &'a [Vec2],
    pixels: &'a [Vec2],
    camera: &'a Camera,
    pose: &'a Transform,
    shape: &'a Shape,
    square_pixels: bool,
    weighting: Weighting,
}

impl Data<'_> {
    /// `L` columns of lens and bend, `C = L + 7` in all.
    fn sum<const L: usize, const C: usize>(&self) -> Option<Gram> {
        let (mut sums, mut cost) = ([[[0.0; LANES]; C]; C], 0.0);
        for (points, pixels) in self.points.chunks(CORNERS).zip(self.pixels.chunks(CORNERS)) {
            // Rows that are left over stay zero.
            let mut columns = [[[0.0; LANES]; CORNERS]; C];
            for (k, (point, pixel)) in points.iter().zip(pixels).enumerate() {
                let (loss, rows) = self.rows::<L, C>(point, pixel)?;
                cost += loss;
                for (column, axes) in columns.iter_mut().zip(rows[0].iter().zip(&rows[1])) {
                    column[k] = [*axes.0, *axes.1];
                }
            }
            add_products(&mut sums, &columns);
        }
        let value = |k: usize| sums[(k / C).min(k % C)][(k / C).max(k % C)].iter().sum();
        Some(Gram { cost, lens: L, values: (0..C * C).map(value).collect() })
    }

    /// The loss of one corner, and its weighted row for each axis.
    #[inline(always)]
    fn rows<const L: usize, const C: usize>(&self, point: &Vec2, pixel: &Vec2) -> Option<(f64, [[f64; C]; 2])> {
        let turned = self.pose.rotation * point.push(self.shape.height(point));
        let (projected, by) = self.camera.project_with_jacobian(&(turned + self.pose.translation))?;
        let residual = projected - pixel;
        let (loss, root) = self.weighting.of(residual.norm_squared());
        let mut rows = [[0.0; C]; 2];
        for (axis, row) in rows.iter_mut().enumerate() {
            for (k, value) in row.iter_mut().enumerate().take(L.min(9)) {
                *value = root * by.intrinsics[(axis, k)];
            }
            if self.square_pixels {
                row[0] += row[1];
                row[1] = 0.0;
            }
            let by_point = by.point.row(axis).transpose() * root;
            if L > 9 {
                let by_height = by_point.dot(&self.pose.rotation.matrix().column(2));
                row[9..12].copy_from_slice(&self.shape.squares(point).map(|s| s * by_height));
            }
            let by_turn = turned.cross(&by_point);
            row[L..L + 3].copy_from_slice(by_turn.as_slice());
            row[L + 3..L + 6].copy_from_slice(by_point.as_slice());
            row[L + 6] = root * residual[axis];
        }
        Some((loss, rows))
    }
}

/// Adds the products of the columns on and above the diagonal.
#[inline(always)]
fn add_products<const C: usize>(sums: &mut [[[f64; LANES]; C]; C], columns: &[[[f64; LANES]; CORNERS]; C]) {
    for (i, (a, sums)) in columns.iter().zip(sums).enumerate() {
        for (b, sum) in columns[i..].iter().zip(&mut sums[i..]) {
            for (a, b) in a.iter().zip(b) {
                sum[0] += a[0] * b[0];
                sum[1] += a[1] * b[1];
            }
        }
    }
}
