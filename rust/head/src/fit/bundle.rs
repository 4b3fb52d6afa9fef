//! Bundle adjustment of landmarks: one head, a pose and an expression for each frame.

use super::contour::ContourSighting;
use super::equations::{self, DenseRows, FrameSystem, LandmarkSums, SharedSystem, assemble, prior_cost};
use super::model::{LandmarkModel, LinearPoint};
use faer::{Mat, MatRef};
use geometry::least_squares::Loss;
use geometry::{Camera, Cancelled, Mat3, Progress, Transform, Vec2, Vec3, skew};
use nalgebra::{Matrix2x3, Vector6};
use rayon::prelude::*;

/// A landmark seen in a frame.
pub(crate) struct Sighting {
    /// Which of the model's landmarks.
    pub landmark: usize,
    pub pixel: Vec2,
    /// One over its variance, pixels.
    pub information: f64,
}

/// What is known of a frame.
pub(crate) struct FrameData {
    pub sightings: Vec<Sighting>,
    pub contour: Vec<ContourSighting>,
    /// How much of its evidence is its own, up to 1: near views repeat each other.
    pub weight: f64,
}

/// A frame's unknowns.
#[derive(Clone)]
pub(crate) struct FrameState {
    /// `cam_from_head` in the class's own unit.
    pub pose: Transform,
    /// What its expression adds to the shared one.
    pub expression: Vec<f64>,
}

/// All unknowns.
#[derive(Clone)]
pub(crate) struct State {
    pub coefficients: Vec<f64>,
    pub log_focal: f64,
    pub slips: Vec<f64>,
    pub frames: Vec<FrameState>,
}

/// The problem.
pub(crate) struct Bundle<'a> {
    pub camera: Camera,
    pub landmarks: &'a LandmarkModel,
    /// Index of the first expression coefficient.
    pub first_key: usize,
    pub frames: Vec<FrameData>,
    pub sigmas: Vec<f64>,
    pub slip_precision: &'a Mat<f64>,
    pub expression_sigma: f64,
    pub log_focal_sigma: f64,
    pub loss: Loss,
}

/// One frame's part of the equations.
struct FrameTerms {
    sums: LandmarkSums,
    rows: DenseRows,
    system: FrameSystem,
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

impl Bundle<'_> {
    /// Damped Gauss–Newton steps from a state.
    pub fn minimise(&self, mut state: State, iterations: usize, progress: &Progress) -> Result<State, Cancelled> {
        let mut damping = 1e-4;
        for _ in 0..iterations {
            progress.step(0, 1)?;
            let (shared, frames) = self.linearise(&state);
            let mut improved = None;
            while improved.is_none() && damping < 1e6 {
                let candidate = equations::step(&shared, &frames, damping).map(|s| self.retract(&state, &s.0, &s.1));
                improved = candidate.map(|c| (self.cost(&c), c)).filter(|(cost, _)| *cost < shared.cost);
                damping *= if improved.is_some() { 0.2 } else { 10.0 };
            }
            let Some((cost, next)) = improved else { break };
            state = next;
            if shared.cost - cost < 1e-4 * shared.cost {
                break;
            }
        }
        Ok(state)
    }

    /// Poses and expressions of single frames, the shared unknowns held.
    pub fn minimise_frames(&self, state: &State) -> Vec<FrameState> {
        let places = self.places(state);
        let camera = self.camera_at(state.log_focal);
        let solve = |(data, start): (&FrameData, &FrameState)| {
            let mut own = start.clone();
            for _ in 0..8 {
                let system = self.frame_terms(data, &own, &places, &camera, state).system;
                let Some(step) = system.step_alone() else { break };
                own = retract_frame(&own, &step);
                if step.norm_max() < 1e-6 {
                    break;
                }
            }
            own
        };
        self.frames.par_iter().zip(&state.frames).map(solve).collect()
    }

    /// Places of the landmarks, slips included.
    pub fn places(&self, state: &State) -> Vec<Vec3> {
        let slipped = |(l, landmark): (usize, &super::model::ModelLandmark)| {
            let [a, b] = &landmark.tangents;
            landmark.point.at(&state.coefficients) + a * state.slips[2 * l] + b * state.slips[2 * l + 1]
        };
        self.landmarks.points.iter().enumerate().map(slipped).collect()
    }

    /// The camera with its focal length scaled.
    pub fn camera_at(&self, log_focal: f64) -> Camera {
        let factor = log_focal.exp();
        Camera { fx: self.camera.fx * factor, fy: self.camera.fy * factor, ..self.camera }
    }

    /// Unweighted pixel errors of a frame's sightings, in their order.
    pub fn errors(&self, frame: usize, state: &State) -> Vec<f64> {
        let (places, camera) = (self.places(state), self.camera_at(state.log_focal));
        let (data, own) = (&self.frames[frame], &state.frames[frame]);
        let error = |s: &Sighting| {
            let place = places[s.landmark] + self.deviation(&self.landmarks.points[s.landmark].point, own);
            camera.project(&own.pose.apply(&place)).map_or(f64::INFINITY, |p| (p - s.pixel).norm())
        };
        data.sightings.iter().map(error).collect()
    }

    fn linearise(&self, state: &State) -> (SharedSystem, Vec<FrameSystem>) {
        let (places, camera) = (self.places(state), self.camera_at(state.log_focal));
        let pairs: Vec<_> = self.frames.iter().zip(&state.frames).collect();
        let terms: Vec<FrameTerms> =
            pairs.par_iter().map(|(data, own)| self.frame_terms(data, own, &places, &camera, state)).collect();
        let mut sums = LandmarkSums::zeros(places.len(), 1);
        let (mut rows, mut systems) = (DenseRows::default(), Vec::with_capacity(terms.len()));
        for frame in terms {
            sums.add(&frame.sums);
            rows.append(frame.rows);
            systems.push(frame.system);
        }
        let mut shared = assemble(self.landmarks, &sums, &rows);
        shared.add_priors(&state.coefficients, &self.sigmas, &state.slips, self.slip_precision);
        let focal = state.coefficients.len();
        shared.hessian[(focal, focal)] += self.log_focal_sigma.powi(-2);
        shared.gradient[(focal, 0)] += state.log_focal * self.log_focal_sigma.powi(-2);
        shared.cost += (state.log_focal / self.log_focal_sigma).powi(2);
        (shared, systems)
    }

    fn cost(&self, state: &State) -> f64 {
        let (places, camera) = (self.places(state), self.camera_at(state.log_focal));
        let frame = |(data, own): (&FrameData, &FrameState)| {
            let sighted = data.sightings.iter().map(|s| {
                let place = places[s.landmark] + self.deviation(&self.landmarks.points[s.landmark].point, own);
                let pixel = camera.project(&own.pose.apply(&place));
                pixel.map_or(f64::INFINITY, |p| self.loss.evaluate((p - s.pixel).norm_squared() * s.information).0)
            });
            let contour = data.contour.iter().map(|s| {
                let place = s.point.at(&state.coefficients) + self.deviation(&s.point, own);
                let pixel = camera.project(&own.pose.apply(&place));
                let across = |p: Vec2| self.loss.evaluate((s.normal.dot(&(p - s.pixel)) / s.sigma_px).powi(2)).0;
                pixel.map_or(f64::INFINITY, across)
            });
            let expression = own.expression.iter().map(|e| self.expression_loss(*e).0);
            data.weight * (sighted.sum::<f64>() + contour.sum::<f64>() + expression.sum::<f64>())
        };
        let data: Vec<f64> = self.frames.par_iter().zip(&state.frames).map(frame).collect();
        data.iter().sum::<f64>()
            + prior_cost(&state.coefficients, &self.sigmas, &state.slips, self.slip_precision)
            + (state.log_focal / self.log_focal_sigma).powi(2)
    }

    fn retract(&self, state: &State, shared: &Mat<f64>, frames: &[Mat<f64>]) -> State {
        let size = state.coefficients.len();
        let mut next = state.clone();
        next.coefficients.iter_mut().enumerate().for_each(|(k, x)| *x += shared[(k, 0)]);
        next.log_focal += shared[(size, 0)];
        next.slips.iter_mut().enumerate().for_each(|(i, s)| *s += shared[(size + 1 + i, 0)]);
        next.frames = state.frames.iter().zip(frames).map(|(own, step)| retract_frame(own, step)).collect();
        next
    }

    /// Robust, so that a blink or a word is taken for an expression and not for shape.
    fn expression_loss(&self, deviation: f64) -> (f64, f64) {
        Loss::Huber(1.0).evaluate((deviation / self.expression_sigma).powi(2))
    }

    fn deviation(&self, point: &LinearPoint, own: &FrameState) -> Vec3 {
        Vec3::from_fn(|axis, _| super::model::dot(&point.basis[axis][self.first_key..], &own.expression))
    }

    fn frame_terms(&self, data: &FrameData, own: &FrameState, places: &[Vec3], camera: &Camera, state: &State) -> FrameTerms {
        let (count, size, unknowns) = (places.len(), self.landmarks.basis.ncols(), 6 + own.expression.len());
        let mut sums = LandmarkSums::zeros(count, 1);
        let mut rows = DenseRows::default();
        let mut frame_by_place = Mat::<f64>::zeros(unknowns, 3 * count);
        let mut coupling = Mat::<f64>::zeros(unknowns, size + 1 + 2 * count);
        let mut stacked = Stack::new(unknowns);
        for s in &data.sightings {
            let point = &self.landmarks.points[s.landmark].point;
            let place = places[s.landmark] + self.deviation(point, own);
            let Some(prediction) = self.predict(camera, own, point, &place) else {
                sums.cost = f64::INFINITY;
                continue;
            };
            let residual = prediction.pixel - s.pixel;
            let (loss, robust) = self.loss.evaluate(residual.norm_squared() * s.information);
            let weight = robust * s.information * data.weight;
            sums.cost += loss * data.weight;
            add_sighting(&mut sums, s.landmark, &prediction, &residual, weight);
            for row in 0..2 {
                stacked.push(&prediction.by_frame[row], residual[row], weight);
                for (u, value) in prediction.by_frame[row].iter().enumerate() {
                    for axis in 0..3 {
                        frame_by_place[(u, 3 * s.landmark + axis)] += weight * value * prediction.by_place[(row, axis)];
                    }
                    coupling[(u, size)] += weight * value * prediction.by_log_focal[row];
                }
            }
        }
        coupling.submatrix_mut(0, 0, unknowns, size).copy_from(&frame_by_place * &self.landmarks.basis);
        self.couple_slips(&mut coupling, &frame_by_place);
        for s in &data.contour {
            self.add_contour(s, data, own, camera, state, &mut rows, &mut coupling, &mut stacked);
        }
        let (mut hessian, mut gradient) = stacked.normal_equations();
        for (k, e) in own.expression.iter().enumerate() {
            let (loss, robust) = self.expression_loss(*e);
            let information = robust * data.weight * self.expression_sigma.powi(-2);
            hessian[(6 + k, 6 + k)] += information;
            gradient[(6 + k, 0)] += information * e;
            sums.cost += loss * data.weight;
        }
        FrameTerms { sums, rows, system: FrameSystem { hessian, gradient, coupling } }
    }

    fn couple_slips(&self, coupling: &mut Mat<f64>, frame_by_place: &Mat<f64>) {
        let first = self.landmarks.basis.ncols() + 1;
        for (l, landmark) in self.landmarks.points.iter().enumerate() {
            for (i, tangent) in landmark.tangents.iter().enumerate() {
                for u in 0..coupling.nrows() {
                    coupling[(u, first + 2 * l + i)] =
                        (0..3).map(|axis| frame_by_place[(u, 3 * l + axis)] * tangent[axis]).sum();
                }
            }
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn add_contour(
        &self,
        s: &ContourSighting,
        data: &FrameData,
        own: &FrameState,
        camera: &Camera,
        state: &State,
        rows: &mut DenseRows,
        coupling: &mut Mat<f64>,
        stacked: &mut Stack,
    ) {
        let place = s.point.at(&state.coefficients) + self.deviation(&s.point, own);
        let Some(prediction) = self.predict(camera, own, &s.point, &place) else { return };
        let residual = s.normal.dot(&(prediction.pixel - s.pixel));
        let (loss, robust) = self.loss.evaluate((residual / s.sigma_px).powi(2));
        let weight = robust * data.weight * s.sigma_px.powi(-2);
        let by_coefficients = s.point.gradient(&(prediction.by_place.transpose() * s.normal));
        let by_focal = s.normal.dot(&prediction.by_log_focal);
        let [x, y] = &prediction.by_frame;
        let by_frame: Vec<f64> = x.iter().zip(y).map(|(x, y)| s.normal.x * x + s.normal.y * y).collect();
        for (u, value) in by_frame.iter().enumerate() {
            for (k, other) in by_coefficients.iter().chain([&by_focal]).enumerate() {
                coupling[(u, k)] += weight * value * other;
            }
        }
        rows.push(&by_coefficients, &[by_focal], residual, weight, loss * data.weight);
        stacked.push(&by_frame, residual, weight);
    }

    fn predict(&self, camera: &Camera, own: &FrameState, point: &LinearPoint, place: &Vec3) -> Option<Prediction> {
        let turned = own.pose.rotation * place;
        let (pixel, by) = camera.project_with_jacobian(&(turned + own.pose.translation))?;
        let by_place = by.point * own.pose.rotation.matrix();
        let by_turn = -by.point * skew(&turned);
        let row = |r: usize| {
            let along = Vec3::new(by_place[(r, 0)], by_place[(r, 1)], by_place[(r, 2)]);
            let pose = (0..3).map(|k| by_turn[(r, k)]).chain((0..3).map(|k| by.point[(r, k)]));
            let keys = (self.first_key..point.basis[0].len())
                .map(|k| along.x * point.basis[0][k] + along.y * point.basis[1][k] + along.z * point.basis[2][k]);
            pose.chain(keys).collect()
        };
        let by_log_focal = by.intrinsics.column(0) * camera.fx + by.intrinsics.column(1) * camera.fy;
        Some(Prediction { pixel, by_place, by_log_focal, by_frame: [row(0), row(1)] })
    }
}

fn add_sighting(sums: &mut LandmarkSums, l: usize, p: &Prediction, residual: &Vec2, weight: f64) {
    let by_place = &p.by_place;
    sums.place_hessian[l] += Mat3::from(by_place.transpose() * by_place) * weight;
    sums.place_gradient[l] += by_place.transpose() * residual * weight;
    let mixed = by_place.transpose() * p.by_log_focal * weight;
    (0..3).for_each(|axis| sums.extra_by_place[(0, 3 * l + axis)] += mixed[axis]);
    sums.extra_hessian[(0, 0)] += p.by_log_focal.norm_squared() * weight;
    sums.extra_gradient[(0, 0)] += p.by_log_focal.dot(residual) * weight;
}

fn retract_frame(own: &FrameState, step: &Mat<f64>) -> FrameState {
    let pose = own.pose.retract(&Vector6::from_fn(|i, _| step[(i, 0)]));
    let expression = own.expression.iter().enumerate().map(|(k, e)| e + step[(6 + k, 0)]).collect();
    FrameState { pose, expression }
}

/// Weighted rows of a frame's own unknowns.
struct Stack {
    width: usize,
    values: Vec<f64>,
    residuals: Vec<f64>,
}

impl Stack {
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
