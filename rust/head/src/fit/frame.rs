//! One frame's part of the bundle's equations.

use super::bundle::{Bundle, FrameData, FrameState, Sighting};
use super::contour::ContourSighting;
use super::equations::{DenseRows, FrameSystem, LandmarkSums};
use super::model::LinearPoint;
use faer::{Mat, MatRef};
use geometry::{Camera, Vec2, Vec3, skew};
use nalgebra::Matrix2x3;

/// A frame at a state of the bundle.
pub(crate) struct View<'a> {
    pub bundle: &'a Bundle<'a>,
    pub camera: &'a Camera,
    /// Places of the landmarks, slips included, the frame's own expression not.
    pub places: &'a [Vec3],
    pub coefficients: &'a [f64],
    pub data: &'a FrameData,
    pub own: &'a FrameState,
}

/// What a frame adds to the shared equations, and its own.
pub(crate) struct FrameTerms {
    pub sums: LandmarkSums,
    pub rows: DenseRows,
    pub system: FrameSystem,
}

/// A pixel with its derivatives.
struct Prediction {
    pixel: Vec2,
    /// By the point's place in the head frame.
    by_place: Matrix2x3<f64>,
    by_log_focal: Vec2,
    /// By the frame's unknowns, two rows.
    by_frame: [Vec<f64>; 2],
}

/// What is summed up over a frame's sightings.
struct Sums {
    shared: LandmarkSums,
    rows: DenseRows,
    /// Mixed Hessian of the frame's unknowns and the landmarks' places.
    frame_by_place: Mat<f64>,
    /// Mixed Hessian of the frame's and all shared unknowns.
    coupling: Mat<f64>,
    own: OwnRows,
}

impl View<'_> {
    /// Linearises the frame; what concerns shared unknowns only when `coupled`.
    pub fn terms(&self, coupled: bool) -> FrameTerms {
        let landmarks = self.bundle.landmarks;
        let (count, size, unknowns) = (self.places.len(), landmarks.basis.ncols(), 6 + self.own.expression.len());
        let shared = if coupled { (3 * count, size + 1 + 2 * count) } else { (0, 0) };
        let mut sums = Sums {
            shared: LandmarkSums::zeros(if coupled { count } else { 0 }, 1),
            rows: DenseRows::default(),
            frame_by_place: Mat::zeros(unknowns, shared.0),
            coupling: Mat::zeros(unknowns, shared.1),
            own: OwnRows::new(unknowns),
        };
        for sighting in &self.data.sightings {
            self.add_landmark(sighting, coupled, &mut sums);
        }
        if coupled {
            sums.coupling.submatrix_mut(0, 0, unknowns, size).copy_from(&sums.frame_by_place * &landmarks.basis);
            self.couple_slips(&mut sums);
        }
        for sighting in &self.data.contour {
            self.add_contour(sighting, coupled, &mut sums);
        }
        let (mut hessian, mut gradient) = sums.own.normal_equations();
        for (k, e) in self.own.expression.iter().enumerate() {
            let (loss, robust) = self.bundle.expression_loss(*e);
            let information = robust * self.data.weight * self.bundle.expression_sigma.powi(-2);
            hessian[(6 + k, 6 + k)] += information;
            gradient[(6 + k, 0)] += information * e;
            sums.shared.cost += loss * self.data.weight;
        }
        let system = FrameSystem { hessian, gradient, coupling: sums.coupling };
        FrameTerms { sums: sums.shared, rows: sums.rows, system }
    }

    fn add_landmark(&self, s: &Sighting, coupled: bool, sums: &mut Sums) {
        let point = &self.bundle.landmarks.points[s.landmark].point;
        let place = self.places[s.landmark] + self.bundle.deviation(point, self.own);
        let Some(prediction) = self.predict(point, &place) else {
            sums.shared.cost = f64::INFINITY;
            return;
        };
        let residual = prediction.pixel - s.pixel;
        let (loss, robust) = self.bundle.loss.evaluate(residual.norm_squared() * s.information);
        let weight = robust * s.information * self.data.weight;
        sums.shared.cost += loss * self.data.weight;
        for row in 0..2 {
            sums.own.push(&prediction.by_frame[row], residual[row], weight);
        }
        if coupled {
            add_shared(&mut sums.shared, s.landmark, &prediction, &residual, weight);
            self.couple(s.landmark, &prediction, weight, sums);
        }
    }

    /// Mixed parts of the Hessian with the landmark's place and the focal length.
    fn couple(&self, l: usize, prediction: &Prediction, weight: f64, sums: &mut Sums) {
        let focal = self.coefficients.len();
        for u in 0..sums.coupling.nrows() {
            let (x, y) = (weight * prediction.by_frame[0][u], weight * prediction.by_frame[1][u]);
            for axis in 0..3 {
                sums.frame_by_place[(u, 3 * l + axis)] +=
                    x * prediction.by_place[(0, axis)] + y * prediction.by_place[(1, axis)];
            }
            sums.coupling[(u, focal)] += x * prediction.by_log_focal.x + y * prediction.by_log_focal.y;
        }
    }

    fn couple_slips(&self, sums: &mut Sums) {
        let first = self.coefficients.len() + 1;
        for (l, landmark) in self.bundle.landmarks.points.iter().enumerate() {
            for (i, tangent) in landmark.tangents.iter().enumerate() {
                for u in 0..sums.coupling.nrows() {
                    sums.coupling[(u, first + 2 * l + i)] =
                        (0..3).map(|axis| sums.frame_by_place[(u, 3 * l + axis)] * tangent[axis]).sum();
                }
            }
        }
    }

    fn add_contour(&self, s: &ContourSighting, coupled: bool, sums: &mut Sums) {
        let place = s.point.at(self.coefficients) + self.bundle.deviation(&s.point, self.own);
        let Some(prediction) = self.predict(&s.point, &place) else {
            sums.shared.cost = f64::INFINITY;
            return;
        };
        let residual = s.normal.dot(&(prediction.pixel - s.pixel));
        let (loss, robust) = self.bundle.loss.evaluate((residual / s.sigma_px).powi(2));
        let weight = robust * self.data.weight * s.sigma_px.powi(-2);
        let [x, y] = &prediction.by_frame;
        let by_frame: Vec<f64> = x.iter().zip(y).map(|(x, y)| s.normal.x * x + s.normal.y * y).collect();
        sums.own.push(&by_frame, residual, weight);
        if !coupled {
            return;
        }
        let by_coefficients = s.point.gradient(&(prediction.by_place.transpose() * s.normal));
        let by_focal = s.normal.dot(&prediction.by_log_focal);
        for (u, value) in by_frame.iter().enumerate() {
            for (k, other) in by_coefficients.iter().chain([&by_focal]).enumerate() {
                sums.coupling[(u, k)] += weight * value * other;
            }
        }
        sums.rows.push(&by_coefficients, &[by_focal], residual, weight, loss * self.data.weight);
    }

    fn predict(&self, point: &LinearPoint, place: &Vec3) -> Option<Prediction> {
        let pose = &self.own.pose;
        let turned = pose.rotation * place;
        let (pixel, by) = self.camera.project_with_jacobian(&(turned + pose.translation))?;
        let by_place = by.point * pose.rotation.matrix();
        let by_turn = -by.point * skew(&turned);
        let [x, y, z] = &point.basis;
        let row = |r: usize| {
            let pose = (0..3).map(|k| by_turn[(r, k)]).chain((0..3).map(|k| by.point[(r, k)]));
            let along = [by_place[(r, 0)], by_place[(r, 1)], by_place[(r, 2)]];
            let keys = (self.bundle.first_key..x.len()).map(|k| along[0] * x[k] + along[1] * y[k] + along[2] * z[k]);
            pose.chain(keys).collect()
        };
        let by_log_focal = by.intrinsics.column(0) * self.camera.fx + by.intrinsics.column(1) * self.camera.fy;
        Some(Prediction { pixel, by_place, by_log_focal, by_frame: [row(0), row(1)] })
    }
}

fn add_shared(sums: &mut LandmarkSums, l: usize, p: &Prediction, residual: &Vec2, weight: f64) {
    let by_place = &p.by_place;
    sums.place_hessian[l] += by_place.transpose() * by_place * weight;
    sums.place_gradient[l] += by_place.transpose() * residual * weight;
    let mixed = by_place.transpose() * p.by_log_focal * weight;
    (0..3).for_each(|axis| sums.extra_by_place[(0, 3 * l + axis)] += mixed[axis]);
    sums.extra_hessian[(0, 0)] += p.by_log_focal.norm_squared() * weight;
    sums.extra_gradient[(0, 0)] += p.by_log_focal.dot(residual) * weight;
}

/// Weighted rows of a frame's own unknowns.
struct OwnRows {
    width: usize,
    values: Vec<f64>,
    residuals: Vec<f64>,
}

impl OwnRows {
    fn new(width: usize) -> Self {
        Self { width, values: Vec::new(), residuals: Vec::new() }
    }

    fn push(&mut self, row: &[f64], residual: f64, weight: f64) {
        let root = weight.sqrt();
        self.values.extend(row.iter().map(|v| v * root));
        self.residuals.push(residual * root);
    }

    fn normal_equations(&self) -> (Mat<f64>, Mat<f64>) {
        let rows = MatRef::from_row_major_slice(&self.values, self.residuals.len(), self.width);
        let right = MatRef::from_column_major_slice(&self.residuals, self.residuals.len(), 1);
        (rows.transpose() * rows, rows.transpose() * right)
    }
}
