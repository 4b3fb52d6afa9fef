//! First stage: landmarks of all frames give the shape, every pose and every expression.

use super::bundle::{Bundle, FrameData, FrameState, Sighting, State};
use super::contour::JawOutline;
use super::model::{LandmarkModel, ModelLandmark, ShapeModel};
use super::{FitOptions, FittedFrame, FrameObservation, LandmarkFit, pose, size, slip};
use crate::{GenericHead, HeadError};
use faer::Mat;
use geometry::least_squares::Loss;
use geometry::{Camera, Progress, Transform, Vec2, Vec3, median, mesh};
use rayon::prelude::*;

/// Fewer landmarks than this do not give a pose.
const LEAST_LANDMARKS: usize = 20;
/// Steps of each round.
const STEPS: usize = 4;
/// A frame with this many times the usual error shows something else than the head as it is.
const STRANGE: f64 = 1.4;
/// What a fixed focal length may move, relative: enough to keep the equations regular, too little to see.
const FIXED_FOCAL: f64 = 1e-7;

/// Fits shape, poses and expressions to the landmarks of all frames.
///
/// # Errors
/// [`HeadError::Landmarks`] when a frame's lists do not have the anchors' length, [`HeadError::NoFace`] when no frame shows
/// a face, [`HeadError::NoSize`] when the size cannot be found, [`HeadError::Cancelled`].
pub fn fit_landmarks(
    head: &GenericHead,
    camera: &Camera,
    frames: &[FrameObservation],
    options: &FitOptions,
    progress: &Progress,
) -> Result<LandmarkFit, HeadError> {
    progress.stage("fitting the head to the landmarks")?;
    let context = Context::new(head, *camera, frames, options)?;
    let poses = context.initial_poses();
    let seen: Vec<usize> = (0..frames.len()).filter(|&f| poses[f].is_some()).collect();
    let start: Vec<Transform> = poses.iter().flatten().copied().collect();
    if start.is_empty() {
        return Err(HeadError::NoFace);
    }
    let mut all = context.start(&start);
    let rounds = options.rounds.max(1);
    for round in 0..rounds {
        progress.step(round, rounds)?;
        let keys = context.key_frames(&seen, &all, round > 0);
        let chosen: Vec<usize> = keys.iter().map(|&k| seen[k]).collect();
        let state = State { frames: keys.iter().map(|&k| all.frames[k].clone()).collect(), ..all.clone() };
        let state = context.bundle(&chosen, &state).minimise(state, STEPS, progress)?;
        all = context.all_frames(&seen, &keys, all, state);
    }
    context.report(&seen, &all)
}

/// What the rounds share.
pub(super) struct Context<'a> {
    pub head: &'a GenericHead,
    pub camera: Camera,
    pub frames: &'a [FrameObservation],
    pub options: &'a FitOptions,
    pub shape: ShapeModel,
    pub landmarks: LandmarkModel,
    pub slip_precision: Mat<f64>,
    outline: JawOutline,
}

impl<'a> Context<'a> {
    pub fn new(
        head: &'a GenericHead,
        camera: Camera,
        frames: &'a [FrameObservation],
        options: &'a FitOptions,
    ) -> Result<Self, HeadError> {
        let wanted = head.anchors.len();
        for (frame, seen) in frames.iter().enumerate() {
            for found in [seen.landmarks.len(), seen.sigma_px.len()] {
                if found != wanted {
                    return Err(HeadError::Landmarks { frame, found, wanted });
                }
            }
        }
        let shape = ShapeModel::new(head);
        let normals = mesh::vertex_normals(&head.positions, &head.triangles(head.skin()));
        let landmarks = LandmarkModel::new(head, &shape, &normals);
        let slip_precision =
            slip::precision(&landmarks.points, options.slip_scale, options.slip_common, options.slip_length)
                .ok_or_else(|| HeadError::Format { reason: "two landmarks have one anchor or no spread".into() })?;
        Ok(Self { head, camera, frames, options, shape, landmarks, slip_precision, outline: JawOutline::new(head) })
    }

    /// Poses of the mean head in every frame that shows enough of it.
    fn initial_poses(&self) -> Vec<Option<Transform>> {
        let anchors = self.head.landmarks(&self.head.positions);
        let estimate = |seen: &FrameObservation| {
            let visible: Vec<&ModelLandmark> = self.visible(seen).collect();
            if visible.len() < LEAST_LANDMARKS {
                return None;
            }
            let pixels_per_metre = spread(visible.iter().map(|l| seen.landmarks[l.index]))
                / spread(visible.iter().map(|l| anchors[l.index].xy()));
            let sightings: Vec<pose::Sighting> = visible
                .iter()
                .map(|l| pose::Sighting {
                    point: anchors[l.index],
                    pixel: seen.landmarks[l.index],
                    sigma_px: seen.sigma_px[l.index].hypot((l.sigma + self.options.view_error) * pixels_per_metre),
                })
                .collect();
            pose::estimate(&self.camera, &sightings, seen.initial_pose)
        };
        self.frames.par_iter().map(estimate).collect()
    }

    fn visible(&self, seen: &'a FrameObservation) -> impl Iterator<Item = &ModelLandmark> {
        let known = |l: &&ModelLandmark| {
            let sigma = seen.sigma_px[l.index];
            sigma > 0.0 && sigma.is_finite() && seen.landmarks[l.index].iter().all(|x| x.is_finite())
        };
        self.landmarks.points.iter().filter(known)
    }

    fn start(&self, poses: &[Transform]) -> State {
        let frame = |pose: &Transform| FrameState { pose: *pose, expression: vec![0.0; self.shape.keys.len()] };
        State {
            coefficients: vec![0.0; self.shape.size()],
            log_focal: 0.0,
            slips: vec![0.0; 2 * self.landmarks.points.len()],
            frames: poses.iter().map(frame).collect(),
        }
    }

    /// The problem for chosen frames, with visibility and contours as the state sees them.
    fn bundle(&self, chosen: &[usize], state: &State) -> Bundle<'_> {
        let positions = self.shape.positions(&state.coefficients);
        let weights =
            view_weights(&state.frames.iter().map(|f| f.pose).collect::<Vec<_>>(), self.options.view_correlation);
        let data = |((&frame, own), weight): ((&usize, &FrameState), f64)| FrameData {
            sightings: self.sightings(&self.frames[frame], &own.pose),
            contour: self.contour(&self.frames[frame], &own.pose, &positions),
            weight,
        };
        let frames = chosen.par_iter().zip(&state.frames).zip(weights).map(data).collect();
        Bundle {
            camera: self.camera,
            landmarks: &self.landmarks,
            first_key: self.shape.identity,
            frames,
            sigmas: self.sigmas(),
            slip_precision: &self.slip_precision,
            expression_sigma: self.options.expression_sigma,
            log_focal_sigma: self.options.focal_sigma.max(FIXED_FOCAL),
            loss: Loss::Huber(self.options.robust_limit),
        }
    }

    /// Standard deviations of the shape's coefficients.
    pub fn sigmas(&self) -> Vec<f64> {
        let sigma = |k| {
            if k < self.shape.identity { self.options.identity_sigma } else { self.options.shared_expression_sigma }
        };
        (0..self.shape.size()).map(sigma).collect()
    }

    /// Landmarks that face the camera, with the net's jitter and view error as variance.
    pub fn sightings(&self, seen: &FrameObservation, pose: &Transform) -> Vec<Sighting> {
        let eye = pose.inverse().translation;
        let view_error = self.options.view_error * self.growth(pose);
        let known: std::collections::BTreeSet<usize> = self.visible(seen).map(|l| l.index).collect();
        let sighting = |(landmark, l): (usize, &ModelLandmark)| {
            if !known.contains(&l.index) {
                return None;
            }
            let facing = l.normal.dot(&(eye - l.point.mean).normalize());
            let trust = ((facing + 0.1) / 0.6).clamp(0.0, 1.0).powi(2);
            let view_px = view_error * self.camera.fx / pose.apply(&l.point.mean).z;
            let variance = seen.sigma_px[l.index].powi(2) + view_px * view_px;
            let information = trust / variance;
            (trust > 0.0).then(|| Sighting { landmark, pixel: seen.landmarks[l.index], information })
        };
        self.landmarks.points.iter().enumerate().filter_map(sighting).collect()
    }

    fn contour(
        &self,
        seen: &FrameObservation,
        pose: &Transform,
        positions: &[Vec3],
    ) -> Vec<super::contour::ContourSighting> {
        if !self.options.contour_error.is_finite() {
            return Vec::new();
        }
        let error = self.options.contour_error;
        self.outline.sightings(&self.shape, &self.camera, pose, positions, &seen.landmarks, error)
    }

    /// All frames that were seen, each fitted to the shape that the key frames gave.
    fn all_frames(&self, seen: &[usize], keys: &[usize], before: State, shared: State) -> State {
        let mut frames = before.frames;
        for (&key, own) in keys.iter().zip(&shared.frames) {
            frames[key] = own.clone();
        }
        let mut all = State { frames, ..shared };
        all.frames = self.bundle(seen, &all).minimise_frames(&all);
        all
    }

    /// Views for the shape, the trusted ones as soon as there is a shape to judge them by.
    fn key_frames(&self, seen: &[usize], all: &State, judge: bool) -> Vec<usize> {
        let poses: Vec<Transform> = all.frames.iter().map(|f| f.pose).collect();
        let trusted = if judge {
            self.trusted(&self.bundle(seen, all), all)
        } else {
            poses.iter().map(|p| turn(p) <= self.options.largest_turn).collect()
        };
        key_views(&poses, self.options.key_frames, &trusted)
    }

    /// Which frames the net can be believed in: turned little, and with no more error than is usual for the turn. A face
    /// turned too far is drawn as one turned less, which the error alone betrays.
    fn trusted(&self, bundle: &Bundle<'_>, all: &State) -> Vec<bool> {
        let strangeness = |frame: usize| {
            let error = root_mean_square(&bundle.errors(frame, all)) * all.frames[frame].pose.translation.z;
            error / self.growth(&all.frames[frame].pose)
        };
        let strange: Vec<f64> = (0..all.frames.len()).map(strangeness).collect();
        let usual = median(strange.iter().copied()).unwrap_or(f64::NAN);
        let little = |f: &FrameState| turn(&f.pose) <= self.options.largest_turn;
        all.frames.iter().zip(&strange).map(|(f, s)| little(f) && *s <= STRANGE * usual).collect()
    }

    /// How much larger than from the front the net's error is.
    fn growth(&self, pose: &Transform) -> f64 {
        1.0 + (turn(pose) / self.options.largest_turn).powi(2)
    }

    fn report(&self, seen: &[usize], state: &State) -> Result<LandmarkFit, HeadError> {
        let bundle = self.bundle(seen, state);
        let camera = bundle.camera_at(state.log_focal);
        let positions = self.shape.positions(&state.coefficients);
        let poses: Vec<_> = seen.iter().zip(&state.frames).map(|(&f, own)| (&self.frames[f], own.pose)).collect();
        let scale = size::scale(self.head, &positions, &camera, &poses, &self.options.size)?;
        let (identity, shared) = state.coefficients.split_at(self.shape.identity);
        let mut frames = vec![None; self.frames.len()];
        let trusted = self.trusted(&bundle, state);
        let mut errors = vec![Vec::new(); self.head.anchors.len()];
        for (i, (&frame, own)) in seen.iter().zip(&state.frames).enumerate() {
            let found = bundle.errors(i, state);
            for (s, e) in bundle.frames[i].sightings.iter().zip(&found) {
                errors[self.landmarks.points[s.landmark].index].push(*e);
            }
            let pose = Transform::new(own.pose.rotation, own.pose.translation * scale);
            let expression = self.shape.all_keys(&own.expression, self.head.keys.len());
            frames[frame] =
                Some(FittedFrame { pose, expression, rms_px: root_mean_square(&found), trusted: trusted[i] });
        }
        Ok(LandmarkFit {
            camera,
            coefficients: identity.to_vec(),
            shared_expression: self.shape.all_keys(shared, self.head.keys.len()),
            frames,
            scale,
            positions: positions.iter().map(|p| p * scale).collect(),
            slips: self.slips(&state.slips, scale),
            landmark_errors_px: errors.into_iter().map(|errors| median(errors).unwrap_or(f64::NAN)).collect(),
        })
    }

    /// Slips of all landmarks as vectors.
    pub fn slips(&self, slips: &[f64], scale: f64) -> Vec<Vec3> {
        let mut all = vec![Vec3::zeros(); self.head.anchors.len()];
        for (l, landmark) in self.landmarks.points.iter().enumerate() {
            let [a, b] = &landmark.tangents;
            all[landmark.index] = (a * slips[2 * l] + b * slips[2 * l + 1]) * scale;
        }
        all
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Middle value; not a number for none.
/// Root mean square distance from the mean.
fn spread(points: impl Iterator<Item = Vec2> + Clone) -> f64 {
    let count = points.clone().count().max(1) as f64;
    let mean = points.clone().sum::<Vec2>() / count;
    (points.map(|p| (p - mean).norm_squared()).sum::<f64>() / count).sqrt()
}

/// Angle between the direction of the face and that to the camera, radians.
fn turn(pose: &Transform) -> f64 {
    let towards = (pose.rotation.inverse() * -pose.translation).normalize();
    towards.z.clamp(-1.0, 1.0).acos()
}

/// Up to `limit` views, as different as possible, beginning with the middle one; ascending. Views that are not trusted are
/// taken only when there are no others.
fn key_views(poses: &[Transform], limit: usize, trusted: &[bool]) -> Vec<usize> {
    let believed: Vec<usize> = (0..poses.len()).filter(|&i| trusted[i]).collect();
    let mut free = if believed.is_empty() { (0..poses.len()).collect() } else { believed };
    let farthest = |a: &usize| free.iter().map(|&b| poses[*a].angle_to(&poses[b])).fold(0.0, f64::max);
    let Some(first) = free.iter().copied().min_by(|a, b| farthest(a).total_cmp(&farthest(b))) else { return free };
    let mut chosen = vec![first];
    let mut distance: Vec<f64> = poses.iter().map(|p| p.angle_to(&poses[first])).collect();
    while chosen.len() < limit {
        free.retain(|i| chosen.last() != Some(i));
        let Some(next) = free.iter().copied().max_by(|&a, &b| distance[a].total_cmp(&distance[b])) else { break };
        chosen.push(next);
        distance.iter_mut().zip(poses).for_each(|(d, p)| *d = d.min(p.angle_to(&poses[next])));
    }
    chosen.sort_unstable();
    chosen
}

/// One over the number of views that a view repeats, itself included.
pub(super) fn view_weights(poses: &[Transform], correlation: f64) -> Vec<f64> {
    let alike = |a: &Transform, b: &Transform| (-0.5 * (a.angle_to(b) / correlation).powi(2)).exp();
    poses.iter().map(|a| 1.0 / poses.iter().map(|b| alike(a, b)).sum::<f64>()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{camera, chance, front_error, observe, person, toy_head, turn as turning};
    use super::super::{HeadSize, size};
    use super::*;

    fn options() -> FitOptions {
        // The toy has no jaw, and its landmarks are exact in every view.
        FitOptions { contour_error: f64::INFINITY, view_error: 0.0003, key_frames: 10, ..FitOptions::default() }
    }

    fn observations(head: &GenericHead, positions: &[Vec3], jitter_px: f64, slip: f64) -> Vec<FrameObservation> {
        let poses = turning(14);
        poses.iter().enumerate().map(|(f, p)| observe(head, positions, p, jitter_px, slip, f as u64 + 1)).collect()
    }

    #[test]
    fn shape_and_poses_come_back_from_noisy_slipping_landmarks() {
        let (head, progress) = (toy_head(), Progress::new());
        let truth = person(&head);
        let fit =
            fit_landmarks(&head, &camera(), &observations(&head, &truth, 0.5, 0.001), &options(), &progress).unwrap();
        let (before, after) = (front_error(&head, &head.positions, &truth), front_error(&head, &fit.positions, &truth));
        assert!(after < 0.0015 && after < 0.35 * before, "{before} {after}");
        // Poses are known up to one motion of the head: compare the turns between frames.
        let poses = turning(14);
        let first = fit.frames[0].as_ref().unwrap().pose;
        for (pose, found) in poses.iter().zip(&fit.frames) {
            let found = found.as_ref().unwrap();
            let (a, b) = (pose.rotation * poses[0].rotation.inverse(), found.pose.rotation * first.rotation.inverse());
            let rigid = |rotation| Transform::new(rotation, Vec3::zeros());
            let error = rigid(a).angle_to(&rigid(b)).to_degrees();
            assert!(error < 1.0 && found.trusted && found.rms_px < 1.5, "{error} {}", found.rms_px);
        }
    }

    #[test]
    fn a_word_and_a_blink_are_expression_and_not_shape() {
        let (head, progress) = (toy_head(), Progress::new());
        let truth = person(&head);
        let mut seen = observations(&head, &truth, 0.2, 0.0);
        let mut speaking = truth.clone();
        head.keys[0].offsets.iter().for_each(|(i, d)| speaking[*i as usize] += d * 0.8);
        for f in [3, 9] {
            seen[f] = observe(&head, &speaking, &turning(14)[f], 0.2, 0.0, 40);
        }
        let fit = fit_landmarks(&head, &camera(), &seen, &options(), &progress).unwrap();
        let spoken = |f: usize| fit.frames[f].as_ref().unwrap().expression[0];
        assert!(spoken(3) > 0.55 && spoken(9) > 0.55, "{} {}", spoken(3), spoken(9));
        assert!((0..14).filter(|f| ![3, 9].contains(f)).all(|f| spoken(f).abs() < 0.15));
        assert!(front_error(&head, &fit.positions, &truth) < 0.0015);
        assert_eq!(fit.frames[0].as_ref().unwrap().expression[2], 0.0, "what no landmark sees is not fitted");
    }

    #[test]
    fn a_face_that_is_none_is_placed_but_not_trusted() {
        let (head, progress) = (toy_head(), Progress::new());
        let truth = person(&head);
        let mut seen = observations(&head, &truth, 0.3, 0.0);
        for (i, p) in seen[5].landmarks.iter_mut().enumerate() {
            *p += Vec2::new((0.05 * p.y).sin() * 8.0, chance(i as u64) * 6.0);
        }
        seen[8].sigma_px = vec![0.0; 468];
        let fit = fit_landmarks(&head, &camera(), &seen, &options(), &progress).unwrap();
        let trusted: Vec<bool> = fit.frames.iter().map(|f| f.as_ref().is_some_and(|f| f.trusted)).collect();
        assert!((0..14).all(|f| trusted[f] != [5, 8].contains(&f)), "{trusted:?}");
        assert!(fit.frames[8].is_none() && front_error(&head, &fit.positions, &truth) < 0.0015);
    }

    #[test]
    fn the_size_is_the_given_one() {
        let (head, progress) = (toy_head(), Progress::new());
        let seen = observations(&head, &person(&head), 0.3, 0.0);
        let fit = |size| fit_landmarks(&head, &camera(), &seen, &FitOptions { size, ..options() }, &progress);
        let wide = fit(HeadSize::Pupils(0.07)).unwrap();
        let eyes = size::eye_centres(&head, &wide.positions).unwrap();
        assert!(((eyes[0] - eyes[1]).norm() - 0.07).abs() < 1e-12);
        let long = fit(HeadSize::Landmarks { indices: [2, 460], metres: 0.2 }).unwrap();
        let landmarks = head.landmarks(&long.positions);
        assert!(((landmarks[2] - landmarks[460]).norm() - 0.2).abs() < 1e-12);
        let distance = |f: &LandmarkFit| f.frames[0].as_ref().unwrap().pose.translation.z / f.scale;
        assert!((distance(&wide) - distance(&long)).abs() < 1e-9, "the pictures do not know");
        assert!(matches!(fit(HeadSize::Landmarks { indices: [2, 2], metres: 0.2 }), Err(HeadError::NoSize)));
    }

    #[test]
    fn a_focal_length_from_exif_is_improved() {
        let (head, progress) = (toy_head(), Progress::new());
        let seen = observations(&head, &head.with_identity(&[0.5, -1.0, 0.8]), 0.05, 0.0);
        let guess = Camera { fx: 615.0 * 1.1, fy: 615.0 * 1.1, ..camera() };
        let options = FitOptions { focal_sigma: 0.15, slip_scale: 0.2, ..options() };
        let fit = fit_landmarks(&head, &guess, &seen, &options, &progress).unwrap();
        assert!((fit.camera.fx / 615.0 - 1.0).abs() < 0.04, "{}", fit.camera.fx);
    }

    #[test]
    fn equal_input_gives_equal_bytes_with_any_number_of_threads() {
        let (head, progress) = (toy_head(), Progress::new());
        let seen = observations(&head, &person(&head), 0.3, 0.0);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let options = FitOptions { rounds: 1, key_frames: 4, ..options() };
            pool.install(|| fit_landmarks(&head, &camera(), &seen, &options, &progress).unwrap().positions)
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn wrong_lists_no_face_and_a_stop_are_said() {
        let (head, progress) = (toy_head(), Progress::new());
        let mut seen = observations(&head, &head.positions, 0.3, 0.0);
        let fit = |seen: &[FrameObservation], p: &Progress| fit_landmarks(&head, &camera(), seen, &options(), p);
        assert!(matches!(fit(&[], &progress), Err(HeadError::NoFace)));
        let stopped = Progress::new();
        stopped.cancel();
        assert!(matches!(fit(&seen, &stopped), Err(HeadError::Cancelled(_))));
        seen[1].landmarks.pop();
        assert!(matches!(fit(&seen, &progress), Err(HeadError::Landmarks { frame: 1, found: 467, wanted: 468 })));
    }
}
