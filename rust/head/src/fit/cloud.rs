//! Second stage: points measured on the skin, and the better poses that came with them, give the shape.
//!
//! Distances of points to the skin's tangent planes (Chen and Medioni 1992) and landmarks in the frames are minimised over
//! shape, slips and the similarity between cloud and head, feet found anew in every step.

use super::equations::{self, DenseRows, LandmarkSums, SharedSystem, assemble, prior_cost};
use super::landmarks::{Context, view_weights};
use super::model::LinearPoint;
use super::{FitOptions, FrameObservation, HeadSize, LandmarkFit, size};
use crate::surface::SkinSurface;
use crate::{GenericHead, HeadError};
use faer::Mat;
use geometry::least_squares::Loss;
use geometry::{Camera, Mat3, Progress, Similarity, Transform, Vec3, skew};
use nalgebra::{Matrix2x3, Matrix3, SMatrix, Vector6};
use rayon::prelude::*;

/// A point on the person's skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// In the cloud's frame and unit.
    pub position: Vec3,
    /// Its covariance there.
    pub covariance: Mat3,
}

/// A frame whose camera is known in the cloud's frame.
#[derive(Clone, Copy, Debug)]
pub struct CloudFrame<'a> {
    /// The face in it.
    pub seen: &'a FrameObservation,
    /// `cam_from_cloud`, in the cloud's unit.
    pub pose: Transform,
    /// Its place in [`LandmarkFit::frames`].
    pub index: usize,
}

/// The head that fits landmarks and cloud.
#[derive(Clone, Debug)]
pub struct HeadFit {
    /// All vertices, head frame, metres: the face as filmed.
    pub positions: Vec<Vec3>,
    /// Coefficients of the identity class.
    pub coefficients: Vec<f64>,
    /// What all frames share of the expression keys, part of the shape.
    pub shared_expression: Vec<f64>,
    /// `head_from_cloud`, from the cloud's unit to metres; [`Similarity::move_pose`] takes its poses along.
    pub head_from_cloud: Similarity,
    /// Metres of the result per metre of the class.
    pub scale: f64,
    /// How far each landmark lies from its anchor, along the skin, metres; zero for the outline.
    pub slips: Vec<Vec3>,
    /// Distance of each cloud point to the skin, metres, positive outside; `None` for points beyond reach.
    pub distances: Vec<Option<f64>>,
    /// Median of their sizes, metres.
    pub median_distance: f64,
}

/// All unknowns. The head is in the class's unit.
#[derive(Clone)]
struct State {
    coefficients: Vec<f64>,
    cloud_from_head: Similarity,
    slips: Vec<f64>,
}

/// Fits the shape to landmarks and cloud, from the first stage's result.
///
/// # Errors
/// [`HeadError::Landmarks`] as for [`super::fit_landmarks`]; [`HeadError::NoFace`] when the frames have none in common with the first
/// stage or cannot place the cloud; [`HeadError::NoCloud`] when hardly a point comes near the head;
/// [`HeadError::NoSize`]; [`HeadError::Cancelled`].
pub fn fit_cloud(
    head: &GenericHead,
    camera: &Camera,
    frames: &[CloudFrame<'_>],
    cloud: &[CloudPoint],
    start: &LandmarkFit,
    options: &FitOptions,
    progress: &Progress,
) -> Result<HeadFit, HeadError> {
    progress.stage("fitting the head to the points")?;
    let seen: Vec<FrameObservation> = frames.iter().map(|f| f.seen.clone()).collect();
    let context = Context::new(head, *camera, &seen, options)?;
    let keys = context.shape.keys.iter().map(|&k| start.shared_expression[k]).collect();
    let fit =
        CloudFit { context, camera: *camera, frames, cloud, expressions: fitted_expressions(frames, start), keys };
    let mut state = fit.start(start)?;
    let mut damping = 1e-4;
    for iteration in 0..ITERATIONS {
        progress.step(iteration, ITERATIONS)?;
        let terms = fit.terms(&state, fit.reach(iteration));
        if terms.planes.len() < LEAST_POINTS {
            return Err(HeadError::NoCloud { near: terms.planes.len() });
        }
        let system = fit.linearise(&state, &terms);
        let mut improved = None;
        while improved.is_none() && damping < 1e4 {
            let candidate = equations::step(&system, &[], damping).map(|(step, _)| retract(&state, &step));
            improved = candidate.filter(|c| fit.cost(c, &terms) < system.cost);
            damping *= if improved.is_some() { 0.2 } else { 10.0 };
        }
        let Some(next) = improved else { break };
        state = next;
    }
    fit.report(&state)
}

/// Steps with new feet.
const ITERATIONS: usize = 10;
/// Fewer points than this are no cloud.
const LEAST_POINTS: usize = 30;

struct CloudFit<'a> {
    context: Context<'a>,
    camera: Camera,
    frames: &'a [CloudFrame<'a>],
    cloud: &'a [CloudPoint],
    /// Each frame's own expression, all keys.
    expressions: Vec<Vec<f64>>,
    /// What all frames share of the fitted keys, as the landmarks have it.
    keys: Vec<f64>,
}

/// A point and the plane it should lie in.
struct Plane {
    foot: LinearPoint,
    /// In the head frame.
    normal: Vec3,
    point: Vec3,
    covariance: Mat3,
    /// Variance of what the model cannot reach, class's unit.
    misfit: f64,
}

/// What one step takes as given.
struct Terms {
    planes: Vec<Plane>,
    sightings: Vec<Vec<super::bundle::Sighting>>,
    weights: Vec<f64>,
}

fn fitted_expressions(frames: &[CloudFrame<'_>], start: &LandmarkFit) -> Vec<Vec<f64>> {
    let of = |f: &CloudFrame| start.frames.get(f.index)?.as_ref().map(|own| own.expression.clone());
    frames.iter().map(|f| of(f).unwrap_or_else(|| vec![0.0; start.shared_expression.len()])).collect()
}

impl CloudFit<'_> {
    fn start(&self, start: &LandmarkFit) -> Result<State, HeadError> {
        let pose = |f: &CloudFrame| Some((start.frames.get(f.index)?.as_ref()?.pose, f.pose));
        let pairs: Vec<(Transform, Transform)> = self.frames.iter().filter_map(pose).collect();
        let mut cloud_from_head = Similarity::of_poses(&pairs).ok_or(HeadError::NoFace)?;
        cloud_from_head.scale *= start.scale;
        let coefficients: Vec<f64> = start.coefficients.iter().chain(&self.keys).copied().collect();
        let slips = self
            .context
            .landmarks
            .points
            .iter()
            .flat_map(|l| l.tangents.map(|t| t.dot(&start.slips[l.index]) / start.scale));
        Ok(State { coefficients, cloud_from_head, slips: slips.collect() })
    }

    /// Standard deviations of the coefficients about what they are expected to be.
    fn sigmas(&self) -> Vec<f64> {
        let mut sigmas = self.context.sigmas();
        sigmas[self.context.shape.identity..].fill(self.context.options.cloud_expression_sigma);
        sigmas
    }

    /// How far the coefficients are from what they are expected to be: the mean person, with the landmarks' expression.
    fn unexpected(&self, state: &State) -> Vec<f64> {
        let (identity, keys) = state.coefficients.split_at(self.context.shape.identity);
        identity.iter().copied().chain(keys.iter().zip(&self.keys).map(|(key, expected)| key - expected)).collect()
    }

    /// Wide at first, the option's in the end.
    fn reach(&self, iteration: usize) -> f64 {
        self.context.options.reach * if iteration < 2 { 1.5 } else { 1.0 }
    }

    /// Feet, visibilities and weights as a state sees them.
    fn terms(&self, state: &State, reach: f64) -> Terms {
        let context = &self.context;
        let positions = context.shape.positions(&state.coefficients);
        let surface = SkinSurface::new(context.head, &positions);
        let landmarks: Vec<Vec3> = context.landmarks.points.iter().map(|l| l.point.at(&state.coefficients)).collect();
        let head_from_cloud = state.cloud_from_head.inverse();
        let plane = |p: &CloudPoint| {
            let foot = surface.closest(&head_from_cloud.apply(&p.position), reach)?;
            let away =
                landmarks.iter().map(|l| (l - foot.position).norm_squared()).fold(f64::INFINITY, f64::min).sqrt();
            let misfit = context.options.misfit + context.options.misfit_growth * (away - NEAR).max(0.0);
            Some(Plane {
                foot: context.shape.point(&foot.triangle, &foot.weights),
                normal: foot.normal,
                point: p.position,
                covariance: p.covariance,
                misfit: misfit * misfit,
            })
        };
        let poses: Vec<Transform> = self.frames.iter().map(|f| head_from_cloud.move_pose(&f.pose)).collect();
        let sightings = self.frames.iter().zip(&poses).map(|(f, pose)| context.sightings(f.seen, pose)).collect();
        Terms {
            planes: self.cloud.par_iter().filter_map(plane).collect(),
            sightings,
            weights: view_weights(&poses, context.options.view_correlation),
        }
    }

    fn linearise(&self, state: &State, terms: &Terms) -> SharedSystem {
        let parts: Vec<LandmarkSums> =
            (0..self.frames.len()).into_par_iter().map(|f| self.frame_sums(f, state, terms)).collect();
        let mut sums = LandmarkSums::zeros(self.context.landmarks.points.len(), 7);
        parts.iter().for_each(|part| sums.add(part));
        let mut rows = DenseRows::default();
        for plane in &terms.planes {
            let (residual, sigma2, normal) = self.plane_residual(plane, state);
            let (loss, robust) = ROBUST.evaluate(residual * residual / sigma2);
            let by_place = -(state.cloud_from_head.rigid.rotation.inverse() * normal) * state.cloud_from_head.scale;
            let by_similarity = -(similarity_jacobian(&state.cloud_from_head, &plane.foot.at(&state.coefficients))
                .transpose()
                * normal);
            rows.push(&plane.foot.gradient(&by_place), by_similarity.as_slice(), residual, robust / sigma2, loss);
        }
        let mut system = assemble(&self.context.landmarks, &sums, &rows);
        system.add_priors(&self.unexpected(state), &self.sigmas(), &state.slips, &self.context.slip_precision);
        system
    }

    /// Distance to the plane in the cloud's unit, its variance, and the normal in the cloud's frame.
    fn plane_residual(&self, plane: &Plane, state: &State) -> (f64, f64, Vec3) {
        let normal = state.cloud_from_head.rigid.rotation * plane.normal;
        let residual = normal.dot(&(plane.point - state.cloud_from_head.apply(&plane.foot.at(&state.coefficients))));
        let variance = normal.dot(&(plane.covariance * normal)) + plane.misfit * state.cloud_from_head.scale.powi(2);
        (residual, variance, normal)
    }

    fn frame_sums(&self, frame: usize, state: &State, terms: &Terms) -> LandmarkSums {
        let mut sums = LandmarkSums::zeros(self.context.landmarks.points.len(), 7);
        let pose = &self.frames[frame].pose;
        for s in &terms.sightings[frame] {
            let place = self.place(frame, s.landmark, state);
            let point = pose.apply(&state.cloud_from_head.apply(&place));
            let Some((pixel, by)) = self.camera.project_with_jacobian(&point) else {
                sums.cost = f64::INFINITY;
                continue;
            };
            let residual = pixel - s.pixel;
            let (loss, robust) = self.loss().evaluate(residual.norm_squared() * s.information);
            let weight = robust * s.information * terms.weights[frame];
            let by_cloud: Matrix2x3<f64> = by.point * pose.rotation.matrix();
            let by_place = by_cloud * state.cloud_from_head.rigid.rotation.matrix() * state.cloud_from_head.scale;
            let by_similarity = by_cloud * similarity_jacobian(&state.cloud_from_head, &place);
            sums.cost += loss * terms.weights[frame];
            sums.place_hessian[s.landmark] += by_place.transpose() * by_place * weight;
            sums.place_gradient[s.landmark] += by_place.transpose() * residual * weight;
            let mixed = by_similarity.transpose() * by_place * weight;
            let (square, slope) =
                (by_similarity.transpose() * by_similarity * weight, by_similarity.transpose() * residual * weight);
            for e in 0..7 {
                (0..3).for_each(|axis| sums.extra_by_place[(e, 3 * s.landmark + axis)] += mixed[(e, axis)]);
                (0..7).for_each(|other| sums.extra_hessian[(e, other)] += square[(e, other)]);
                sums.extra_gradient[(e, 0)] += slope[e];
            }
        }
        sums
    }

    fn cost(&self, state: &State, terms: &Terms) -> f64 {
        let frame = |f: usize| {
            let sighted = terms.sightings[f].iter().map(|s| {
                let place = state.cloud_from_head.apply(&self.place(f, s.landmark, state));
                let pixel = self.camera.project(&self.frames[f].pose.apply(&place));
                pixel.map_or(f64::INFINITY, |p| self.loss().evaluate((p - s.pixel).norm_squared() * s.information).0)
            });
            terms.weights[f] * sighted.sum::<f64>()
        };
        let plane = |p: &Plane| {
            let (residual, variance, _) = self.plane_residual(p, state);
            ROBUST.evaluate(residual * residual / variance).0
        };
        let frames: Vec<f64> = (0..self.frames.len()).into_par_iter().map(frame).collect();
        frames.iter().sum::<f64>()
            + terms.planes.iter().map(plane).sum::<f64>()
            + prior_cost(&self.unexpected(state), &self.sigmas(), &state.slips, &self.context.slip_precision)
    }

    /// Where a landmark is in the head frame, slip and the frame's own expression included.
    fn place(&self, frame: usize, l: usize, state: &State) -> Vec3 {
        let landmark = &self.context.landmarks.points[l];
        let shape = &self.context.shape;
        let own = |axis: usize| {
            let row = &landmark.point.basis[axis][shape.identity..];
            row.iter().zip(&shape.keys).map(|(b, &k)| b * self.expressions[frame][k]).sum::<f64>()
        };
        let [a, b] = &landmark.tangents;
        let slip = a * state.slips[2 * l] + b * state.slips[2 * l + 1];
        landmark.point.at(&state.coefficients) + slip + Vec3::from_fn(|axis, _| own(axis))
    }

    fn loss(&self) -> Loss {
        Loss::Huber(self.context.options.robust_limit)
    }

    fn report(&self, state: &State) -> Result<HeadFit, HeadError> {
        let context = &self.context;
        let class_positions = context.shape.positions(&state.coefficients);
        let head_from_cloud = state.cloud_from_head.inverse();
        let poses: Vec<_> = self.frames.iter().map(|f| (f.seen, head_from_cloud.move_pose(&f.pose))).collect();
        let scale = match context.options.size {
            HeadSize::Cloud => head_from_cloud.scale.recip(),
            size => size::scale(context.head, &class_positions, &self.camera, &poses, &size)?,
        };
        let positions: Vec<Vec3> = class_positions.iter().map(|p| p * scale).collect();
        let rigid = Transform::new(head_from_cloud.rigid.rotation, head_from_cloud.rigid.translation * scale);
        let head_from_cloud = Similarity { scale: head_from_cloud.scale * scale, rigid };
        let surface = SkinSurface::new(context.head, &positions);
        let distance = |p: &CloudPoint| {
            let point = head_from_cloud.apply(&p.position);
            surface.closest(&point, context.options.reach).map(|foot| foot.normal.dot(&(point - foot.position)))
        };
        let distances: Vec<Option<f64>> = self.cloud.par_iter().map(distance).collect();
        let mut sizes: Vec<f64> = distances.iter().flatten().map(|d| d.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let (identity, shared) = state.coefficients.split_at(context.shape.identity);
        Ok(HeadFit {
            coefficients: identity.to_vec(),
            shared_expression: context.shape.all_keys(shared, context.head.keys.len()),
            head_from_cloud,
            scale,
            slips: context.slips(&state.slips, scale),
            median_distance: sizes.get(sizes.len() / 2).copied().ok_or(HeadError::NoCloud { near: 0 })?,
            distances,
            positions,
        })
    }
}

/// Distance from the nearest landmark within which the class knows the face, metres.
const NEAR: f64 = 0.02;
/// Points off the skin by more than this many standard deviations are taken for something else.
const ROBUST: Loss = Loss::Cauchy(2.5);

/// Derivative of a moved point by a step of the similarity: turn, shift and logarithm of scale, all after it.
fn similarity_jacobian(similarity: &Similarity, point: &Vec3) -> SMatrix<f64, 3, 7> {
    let turned = similarity.rigid.rotation * point * similarity.scale;
    let mut jacobian = SMatrix::<f64, 3, 7>::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-skew(&turned));
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    jacobian.set_column(6, &turned);
    jacobian
}

fn retract(state: &State, step: &Mat<f64>) -> State {
    let size = state.coefficients.len();
    let mut next = state.clone();
    next.coefficients.iter_mut().enumerate().for_each(|(k, x)| *x += step[(k, 0)]);
    next.slips.iter_mut().enumerate().for_each(|(i, s)| *s += step[(size + 7 + i, 0)]);
    next.cloud_from_head.rigid = state.cloud_from_head.rigid.retract(&Vector6::from_fn(|i, _| step[(size + i, 0)]));
    next.cloud_from_head.scale *= step[(size + 6, 0)].exp();
    next
}

#[cfg(test)]
mod tests {
    use super::super::fit_landmarks;
    use super::super::testing::{camera, chance, front_error, observe, person, toy_head, turn};
    use super::*;
    use nalgebra::Rotation3;

    /// Another frame and unit, as a bundle without metre has them.
    fn cloud_from_truth() -> Similarity {
        let rigid = Transform::new(Rotation3::new(Vec3::new(0.1, -0.3, 0.2)), Vec3::new(0.3, -0.1, 0.2));
        Similarity { scale: 3.7, rigid }
    }

    fn cloud(head: &GenericHead, truth: &[Vec3], noise: f64) -> Vec<CloudPoint> {
        let covariance = Mat3::identity() * (noise * cloud_from_truth().scale).powi(2);
        let front =
            head.triangles(head.skin()).into_iter().filter(|t| t.iter().all(|&i| head.positions[i as usize].z > -0.05));
        let point = |(n, t): (usize, [u32; 3])| {
            let seed = 10 * n as u64;
            let place = geometry::mesh::at_barycentric(truth, &t, &[0.3, 0.3, 0.4]);
            let outlier = if n % 15 == 0 { 0.008 } else { 0.0 };
            let error = Vec3::from_fn(|k, _| chance(seed + k as u64) * (1.7 * noise + outlier));
            CloudPoint { position: cloud_from_truth().apply(&(place + error)), covariance }
        };
        front.enumerate().map(point).collect()
    }

    fn fitted(head: &GenericHead, truth: &[Vec3], points: &[CloudPoint]) -> (LandmarkFit, Result<HeadFit, HeadError>) {
        let options = FitOptions {
            contour_error: f64::INFINITY,
            view_error: 0.0003,
            key_frames: 8,
            rounds: 2,
            ..FitOptions::default()
        };
        let poses = turn(8);
        let observe = |(f, p): (usize, &Transform)| observe(head, truth, p, 0.5, 0.0015, f as u64 + 1);
        let seen: Vec<FrameObservation> = poses.iter().enumerate().map(observe).collect();
        let first = fit_landmarks(head, &camera(), &seen, &options, &Progress::new()).unwrap();
        let frame = |(index, pose): (usize, &Transform)| CloudFrame {
            seen: &seen[index],
            pose: cloud_from_truth().move_pose(pose),
            index,
        };
        let frames: Vec<CloudFrame> = poses.iter().enumerate().map(frame).collect();
        let second = fit_cloud(head, &camera(), &frames, points, &first, &options, &Progress::new());
        (first, second)
    }

    #[test]
    fn points_in_another_frame_and_unit_improve_the_shape() {
        let head = toy_head();
        let truth = person(&head);
        let (first, second) = fitted(&head, &truth, &cloud(&head, &truth, 0.0004));
        let second = second.unwrap();
        let (before, after) =
            (front_error(&head, &first.positions, &truth), front_error(&head, &second.positions, &truth));
        assert!(after < 0.8 * before && second.median_distance < 0.0007, "{before} {after} {}", second.median_distance);
        let carried = crate::deform::refine(
            &head,
            &second,
            &cloud(&head, &truth, 0.0004),
            &crate::deform::DeformOptions::default(),
        );
        let carried = carried.unwrap();
        let there = |p: &Vec3| second.head_from_cloud.apply(&cloud_from_truth().apply(p));
        let truth_in_head: Vec<Vec3> = truth.iter().map(there).collect();
        let off = |positions: &[Vec3]| {
            let surface = SkinSurface::new(&head, positions);
            let distance = |&i: &usize| {
                (surface.closest(&truth_in_head[i], 0.02).unwrap().position - truth_in_head[i]).norm_squared()
            };
            head.skin()
                .vertices
                .clone()
                .filter(|&i| head.positions[i].z > -0.03)
                .collect::<Vec<_>>()
                .iter()
                .map(distance)
                .sum::<f64>()
        };
        let (carried_off, fitted_off) = (off(&carried.positions), off(&second.positions));
        // The toy person lies within what the class reaches: nothing is left to gain, and nothing may be spoilt.
        assert!(carried_off < 1.2 * fitted_off, "{carried_off} {fitted_off}");
        assert_eq!(carried.folded, 0);
    }

    #[test]
    fn a_cloud_in_metres_gives_the_head_its_own_size() {
        let head = toy_head();
        let large: Vec<Vec3> = person(&head).iter().map(|p| p * 1.1).collect();
        let options = FitOptions { contour_error: f64::INFINITY, size: HeadSize::Cloud, ..FitOptions::default() };
        let poses = turn(8);
        let seen: Vec<FrameObservation> =
            poses.iter().enumerate().map(|(f, p)| observe(&head, &large, p, 0.5, 0.0015, f as u64 + 1)).collect();
        let first = fit_landmarks(&head, &camera(), &seen, &options, &Progress::new()).unwrap();
        let frame = |(index, pose): (usize, &Transform)| CloudFrame { seen: &seen[index], pose: *pose, index };
        let frames: Vec<CloudFrame> = poses.iter().enumerate().map(frame).collect();
        let to_metres = cloud_from_truth().inverse();
        let points: Vec<CloudPoint> = cloud(&head, &large, 0.0004)
            .iter()
            .map(|p| CloudPoint { position: to_metres.apply(&p.position), covariance: Mat3::identity() * 1.6e-7 })
            .collect();
        let fit = fit_cloud(&head, &camera(), &frames, &points, &first, &options, &Progress::new()).unwrap();
        assert!((fit.head_from_cloud.scale - 1.0).abs() < 1e-9, "{}", fit.head_from_cloud.scale);
        let width = |positions: &[Vec3]| size::eye_centres(&head, positions).map(|[a, b]| (a - b).norm()).unwrap();
        let ratio = width(&fit.positions) / width(&large);
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }

    #[test]
    fn a_cloud_that_is_elsewhere_is_refused() {
        let head = toy_head();
        let truth = person(&head);
        let mut points = cloud(&head, &truth, 0.0004);
        points.iter_mut().for_each(|p| p.position += Vec3::new(2.0, 0.0, 0.0));
        assert!(matches!(fitted(&head, &truth, &points).1, Err(HeadError::NoCloud { .. })));
    }
}
