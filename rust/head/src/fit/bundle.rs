//! Bundle adjustment of landmarks: one head, a pose and an expression for each frame.

use super::contour::ContourSighting;
use super::equations::{self, DenseRows, FrameSystem, LandmarkSums, SharedSystem, assemble, prior_cost};
use super::frame::{FrameTerms, View};
use super::model::{LandmarkModel, LinearPoint, ModelLandmark, dot};
use faer::Mat;
use geometry::least_squares::Loss;
use geometry::{Camera, Cancelled, Progress, Transform, Vec2, Vec3};
use nalgebra::Vector6;
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
            for _ in 0..4 {
                let view = View {
                    bundle: self,
                    camera: &camera,
                    places: &places,
                    coefficients: &state.coefficients,
                    data,
                    own: &own,
                };
                let Some(step) = view.terms(false).system.step_alone() else { break };
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
        let slipped = |(l, landmark): (usize, &ModelLandmark)| {
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
        let coefficients = &state.coefficients;
        let view =
            |(data, own)| View { bundle: self, camera: &camera, places: &places, coefficients, data, own }.terms(true);
        let terms: Vec<FrameTerms> = self.frames.par_iter().zip(&state.frames).map(view).collect();
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
    pub fn expression_loss(&self, deviation: f64) -> (f64, f64) {
        Loss::Huber(1.0).evaluate((deviation / self.expression_sigma).powi(2))
    }

    /// What a frame's own expression adds to a point.
    pub fn deviation(&self, point: &LinearPoint, own: &FrameState) -> Vec3 {
        Vec3::from_fn(|axis, _| dot(&point.basis[axis][self.first_key..], &own.expression))
    }
}

fn retract_frame(own: &FrameState, step: &Mat<f64>) -> FrameState {
    let pose = own.pose.retract(&Vector6::from_fn(|i, _| step[(i, 0)]));
    let expression = own.expression.iter().enumerate().map(|(k, e)| e + step[(6 + k, 0)]).collect();
    FrameState { pose, expression }
}
