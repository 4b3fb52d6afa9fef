//! Points from poses and poses from points in turn, with bundles between.

use super::focal::focal_sigma_px;
use super::key_frames::key_frames;
use super::start::{pair_poses, standing_still};
use super::{PointTrack, Sequence, SequenceOptions};
use crate::MotionError;
use crate::bundle::{BundleReport, Fit, Observation, adjust, reject_outliers};
use crate::resect::{ResectOptions, resect, settle};
use crate::triangulate::triangulate_robust;
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use rayon::prelude::*;

/// Fewest known points from which a frame is placed.
const FEWEST_POINTS: usize = 8;
/// Poses from landmarks are off by several pixels: the first points are sought with the threshold widened by these factors.
const WIDENING: [f64; 3] = [8.0, 4.0, 2.0];
/// An initial pose that is off by more than this many standard deviations was fitted wrongly.
const CONTRADICTION: f64 = 4.0;
/// Observations farther off than this many robust standard deviations are rejected before the last bundle.
const REJECTION: f64 = 4.0;

/// Times of the last steps, in parts: three bundles, the last one, the poses of all other frames; what the focal length rests on.
const FINISHING: [f64; 3] = [50.0, 20.0, 30.0];
const FOCAL: f64 = 200.0;

/// A sighting with its undistorted coordinates.
pub(super) struct Seen {
    pub(super) frame: usize,
    pub(super) normalised: Vec2,
    pub(super) pixel: Vec2,
    sigma_px: f64,
}

/// What is known so far.
pub(super) struct Reconstruction<'a> {
    pub(super) options: &'a SequenceOptions,
    pub(super) camera: Camera,
    /// Sightings of each track, by frame.
    pub(super) sightings: Vec<Vec<Seen>>,
    /// Tracks that stand still while others move: they take no part.
    pub(super) still: Vec<bool>,
    /// Frames that the structure is solved from.
    pub(super) key: Vec<bool>,
    pub(super) poses: Vec<Option<Transform>>,
    failures: Vec<Option<MotionError>>,
    pub(super) points: Vec<Option<Vec3>>,
    /// Initial poses, less those that the tracks contradict.
    pub(super) anchors: Vec<Option<Transform>>,
    /// Whether principal point and `k1` are refined with the focal length. The initial poses hold nothing then: they were found with
    /// another principal point, which turns all of them.
    pub(super) is_lens_free: bool,
    /// Factor by which the observations' variances exceed those announced.
    pub(super) inflation: f64,
    /// The frame that defines the head frame where there are no anchors.
    pub(super) reference: usize,
}

impl<'a> Reconstruction<'a> {
    pub(super) fn new(tracks: &[PointTrack], camera: &Camera, options: &'a SequenceOptions) -> Self {
        let seen = |track: &PointTrack| {
            let mut seen: Vec<Seen> = track
                .observations
                .iter()
                .map(|o| {
                    let normalised = camera.normalise(&o.pixel);
                    Seen { frame: o.frame, normalised, pixel: o.pixel, sigma_px: o.sigma_px }
                })
                .collect();
            seen.sort_by_key(|s| s.frame);
            seen
        };
        Self {
            options,
            camera: *camera,
            sightings: tracks.par_iter().map(seen).collect(),
            still: standing_still(tracks, options.frames, options.threshold_px),
            key: key_frames(tracks, options.frames, options.initial_poses.as_deref(), options.key_frames),
            poses: vec![None; options.frames],
            failures: vec![None; options.frames],
            points: vec![None; tracks.len()],
            anchors: vec![None; options.frames],
            is_lens_free: options.lens_prior.is_some_and(|prior| !prior.is_centred(camera)),
            inflation: 1.0,
            reference: 0,
        }
    }

    /// The threshold in normalised units.
    pub(super) fn threshold(&self) -> f64 {
        self.options.threshold_px / self.camera.fx
    }

    /// Begins with poses that are off by some pixels: points under a wide threshold, a bundle, a narrower one. False, and
    /// nothing known, if the tracks contradict all but one of them. The initial poses hold on if they are not far off.
    pub(super) fn start_from_poses(
        &mut self,
        poses: &[Option<Transform>],
        initial: &[Option<Transform>],
        progress: &Progress,
    ) -> Result<bool, MotionError> {
        let farthest = CONTRADICTION * self.options.initial_sigma_rad;
        let is_near = |pose: &Transform, start: &Transform| pose.angle_to(start) < farthest;
        self.poses = poses.iter().zip(&self.key).map(|(pose, key)| pose.filter(|_| *key)).collect();
        let anchor = |(initial, start): (&Option<Transform>, &Option<Transform>)| {
            initial.filter(|pose| start.is_some_and(|start| is_near(pose, &start)))
        };
        if !self.is_lens_free {
            self.anchors = initial.iter().zip(&self.poses).map(anchor).collect();
        }
        for (widening, round) in WIDENING.into_iter().zip(progress.split_evenly(WIDENING.len())) {
            self.triangulate_all(widening);
            self.drop_contradicted_poses(widening);
            if self.poses.iter().flatten().count() < 2 {
                self.poses.fill(None);
                self.anchors.fill(None);
                self.points.fill(None);
                return Ok(false);
            }
            self.adjust(widening, 10, false, &round)?;
        }
        Ok(true)
    }

    /// A frame whose initial pose does not bring three of ten known points near their observations was fitted wrongly: it is
    /// placed anew later, and its pose no longer holds anything.
    fn drop_contradicted_poses(&mut self, widening: f64) {
        let known: Vec<usize> = self.known_points().iter().map(Vec::len).collect();
        let mut agree = vec![0; known.len()];
        self.observations(widening).iter().for_each(|o| agree[o.frame] += 1);
        for frame in (0..known.len()).filter(|&f| agree[f] < FEWEST_POINTS || 10 * agree[f] < 3 * known[f]) {
            (self.poses[frame], self.anchors[frame]) = (None, None);
        }
    }

    /// Begins with the pair of frames that shows the head best from two sides.
    pub(super) fn start_from_pair(&mut self, progress: &Progress) -> Result<(), MotionError> {
        let pair = self.initial_pair(progress)?;
        self.reference = pair.a;
        for (frame, pose) in pair_poses(&pair) {
            self.poses[frame] = Some(pose);
        }
        for (track, point) in pair.tracks.iter().zip(&pair.motion.points) {
            self.points[*track] = *point;
        }
        self.rescale();
        self.adjust(2.0, 10, false, progress)
    }

    /// Places frame after frame, those that see most known points first, until no frame can be added.
    pub(super) fn grow(&mut self, progress: &Progress) -> Result<(), MotionError> {
        loop {
            let placed = self.poses.iter().flatten().count();
            progress.step(placed, self.options.frames)?;
            if !self.place_next_frames(|key| key) {
                return Ok(());
            }
            self.triangulate_all(2.0);
            self.adjust(2.0, 6, false, &progress.uncounted())?;
        }
    }

    /// Places the wanted frames that see at least half as many known points as the best of them; whether any was placed.
    fn place_next_frames(&mut self, wanted: impl Fn(bool) -> bool) -> bool {
        let is_open = |frame: &usize| self.poses[*frame].is_none() && wanted(self.key[*frame]);
        let open: Vec<usize> = (0..self.poses.len()).filter(is_open).collect();
        let known = self.known_points();
        let best = open.iter().map(|&frame| known[frame].len()).max().unwrap_or(0);
        let next: Vec<usize> = open.into_iter().filter(|&frame| 2 * known[frame].len() >= best).collect();
        let placed: Vec<_> = next.par_iter().map(|&frame| (frame, self.place(frame, &known[frame]))).collect();
        let mut any = false;
        for (frame, result) in placed {
            match result {
                Ok(pose) => (self.poses[frame], self.failures[frame], any) = (Some(pose), None, true),
                Err(error) => self.failures[frame] = Some(error),
            }
        }
        any
    }

    /// The tracks with a point that each frame sees, and where.
    fn known_points(&self) -> Vec<Vec<(usize, Vec2)>> {
        let mut known = vec![Vec::new(); self.poses.len()];
        for (track, sightings) in self.sightings.iter().enumerate().filter(|(track, _)| self.points[*track].is_some()) {
            sightings.iter().for_each(|s| known[s.frame].push((track, s.normalised)));
        }
        known
    }

    fn place(&self, frame: usize, known: &[(usize, Vec2)]) -> Result<Transform, MotionError> {
        let seen: Vec<(Vec3, Vec2)> =
            known.iter().filter_map(|(track, at)| Some((self.points[*track]?, *at))).collect();
        let (points, normalised): (Vec<Vec3>, Vec<Vec2>) = seen.into_iter().unzip();
        let (expected, is_told) = self.expected(frame);
        let options = ResectOptions {
            threshold: 2.0 * self.threshold(),
            min_inliers: FEWEST_POINTS,
            initial_sigma_rad: is_told.then_some(self.options.initial_sigma_rad),
            seed: self.options.seed.wrapping_add(frame as u64),
            ..ResectOptions::default()
        };
        Ok(resect(&points, &normalised, expected, &options)?.cam_from_x)
    }

    /// The pose of the nearest frame, turned as the initial poses turn from there; and whether they do.
    fn expected(&self, frame: usize) -> (Option<Transform>, bool) {
        let posed = (0..self.poses.len()).filter_map(|f| Some((f, self.poses[f]?)));
        let Some((nearest, pose)) = posed.min_by_key(|(f, _)| f.abs_diff(frame)) else { return (None, false) };
        let initial = |f: usize| self.options.initial_poses.as_ref().and_then(|poses| poses[f]);
        match initial(nearest).zip(initial(frame)) {
            Some((from, to)) => (Some(to * from.inverse() * pose), true),
            None => (Some(pose), false),
        }
    }

    /// Triangulates every track that moves anew from all posed frames.
    fn triangulate_all(&mut self, widening: f64) {
        let threshold = widening * self.threshold();
        let locate = |(track, sightings): (usize, &Vec<Seen>)| {
            if self.still[track] {
                return None;
            }
            let rays: Vec<_> = sightings.iter().filter_map(|s| Some((self.poses[s.frame]?, s.normalised))).collect();
            let (found, _) = triangulate_robust(&rays, threshold)?;
            (found.angle_rad >= self.options.min_parallax_rad).then_some(found.point)
        };
        self.points = self.sightings.par_iter().enumerate().map(locate).collect();
    }

    /// Observations of posed frames within the widened threshold of their points.
    pub(super) fn observations(&self, widening: f64) -> Vec<Observation> {
        let limit = widening * self.options.threshold_px;
        let mut kept = Vec::new();
        for (point, sightings) in self.sightings.iter().enumerate() {
            let Some(place) = self.points[point] else { continue };
            for s in sightings {
                let projected = self.poses[s.frame].and_then(|pose| self.camera.project(&pose.apply(&place)));
                if projected.is_some_and(|pixel| (pixel - s.pixel).norm() < limit) {
                    kept.push(Observation { frame: s.frame, point, pixel: s.pixel, sigma_px: s.sigma_px });
                }
            }
        }
        kept
    }

    /// The last bundles over everything that agrees, and a last chance for frames without a pose.
    pub(super) fn finish(mut self, progress: &Progress) -> Result<Sequence, MotionError> {
        let refine_focal = self.options.refine_focal;
        let focal = if refine_focal && self.options.focal_sigma { FOCAL } else { 0.0 };
        let lens = if self.may_free_lens() { FINISHING[1] } else { 0.0 };
        let parts = [FINISHING[0], lens, FINISHING[1], focal, FINISHING[2]];
        let [narrowing, lens, last, focal, placing] = progress.split(&parts);
        for (widening, round) in [2.0, 1.0, 1.0].into_iter().zip(narrowing.split_evenly(3)) {
            self.triangulate_all(widening);
            self.weigh();
            self.adjust(widening, 20, refine_focal, &round)?;
        }
        if self.may_free_lens() {
            self.try_free_lens(&lens)?;
        }
        if self.place_next_frames(|key| key) {
            self.triangulate_all(1.0);
        }
        let mut bundle = self.bundle(1.0);
        let limit = reject_outliers(&mut bundle, REJECTION).limit;
        self.remove_weak(&mut bundle.observations);
        let mut report = adjust(&mut bundle, &self.bundle_options(30, refine_focal), &last)?;
        self.adopt(&bundle);
        let focal_sigma_px = match report.focal_sigma_px.filter(|_| self.options.focal_sigma) {
            Some(own) => {
                let own_px = own * (self.inflation / report.excess).sqrt();
                let options = self.bundle_options(30, true);
                let lens = self.options.lens_prior.filter(|_| !self.is_lens_free);
                // No film tells less than what is known before.
                let before = self.options.focal_prior.map_or(f64::INFINITY, |prior| prior.log_sigma * self.camera.fx);
                Some(focal_sigma_px(&bundle, &options, (own_px, lens), &focal)?.min(before))
            }
            None => None,
        };
        placing.step(0, 2)?;
        while self.place_next_frames(|key| !key) {}
        placing.step(1, 2)?;
        self.settle(limit);
        let mut observations = self.agreeing(limit);
        self.remove_weak(&mut observations);
        self.count(&observations, &mut report);
        Ok(self.sequence(observations, focal_sigma_px, report))
    }

    /// Places all frames alike, by the points alone: what was known of the key frames' poses has helped to find the points, but
    /// jitters. Observations beyond `limit` standard deviations hardly count.
    fn settle(&mut self, limit: f64) {
        let mut sigmas: Vec<f64> = self.sightings.iter().flatten().map(|s| s.sigma_px).collect();
        sigmas.sort_by(f64::total_cmp);
        let usual_px = sigmas.get(sigmas.len() / 2).copied().unwrap_or(0.0);
        let threshold = (limit * usual_px / self.camera.fx).min(2.0 * self.threshold());
        let options = ResectOptions { threshold, ..ResectOptions::default() };
        let (known, points) = (self.known_points(), &self.points);
        let settled = |(pose, seen): (&mut Option<Transform>, &Vec<(usize, Vec2)>)| {
            let (points, normalised): (Vec<Vec3>, Vec<Vec2>) =
                seen.iter().filter_map(|(track, at)| Some((points[*track]?, *at))).unzip();
            *pose = pose.map(|pose| settle(&points, &normalised, &pose, &options));
        };
        self.poses.par_iter_mut().zip(&known).for_each(settled);
    }

    /// Observations within the threshold and within `limit` standard deviations of their points.
    fn agreeing(&self, limit: f64) -> Vec<Observation> {
        let mut observations = self.observations(1.0);
        observations.retain(|o| self.distance_px(o) <= limit * o.sigma_px);
        observations
    }

    /// Distance of an observation from its point; infinite where there is none.
    fn distance_px(&self, o: &Observation) -> f64 {
        let at = self.poses[o.frame].zip(self.points[o.point]);
        let at = at.and_then(|(pose, point)| self.camera.project(&pose.apply(&point)));
        at.map_or(f64::INFINITY, |at| (at - o.pixel).norm())
    }

    /// Lets the report tell of all frames as they are now.
    fn count(&self, observations: &[Observation], report: &mut BundleReport) {
        report.frames.fill(Fit::default());
        report.points.fill(Fit::default());
        observations.iter().for_each(|o| report.count(o, self.distance_px(o).powi(2)));
    }

    /// Frames left with too few observations lose their pose, points seen fewer than twice their place.
    fn remove_weak(&mut self, observations: &mut Vec<Observation>) {
        let total: Vec<usize> = self.known_points().iter().map(Vec::len).collect();
        let mut in_frame = vec![0; self.poses.len()];
        observations.iter().for_each(|o| in_frame[o.frame] += 1);
        for frame in (0..self.poses.len()).filter(|&frame| in_frame[frame] < FEWEST_POINTS) {
            if self.poses[frame].take().is_some() {
                self.failures[frame] = Some(MotionError::NoPose { agree: in_frame[frame], total: total[frame] });
            }
        }
        observations.retain(|o| self.poses[o.frame].is_some());
        let mut of_point = vec![0; self.points.len()];
        observations.iter().for_each(|o| of_point[o.point] += 1);
        observations.retain(|o| of_point[o.point] >= 2);
        for (point, count) in self.points.iter_mut().zip(of_point) {
            *point = point.filter(|_| count >= 2);
        }
    }

    fn sequence(self, observations: Vec<Observation>, focal_sigma_px: Option<f64>, report: BundleReport) -> Sequence {
        let none = MotionError::TooFewPoints { found: 0, needed: FEWEST_POINTS };
        let anchored = self.is_anchored();
        let poses = self.poses.into_iter().zip(self.failures);
        Sequence {
            anchored,
            is_lens_free: self.is_lens_free,
            camera: self.camera,
            poses: poses.map(|(pose, failure)| pose.ok_or_else(|| failure.unwrap_or(none.clone()))).collect(),
            points: self.points,
            observations,
            focal_sigma_px,
            report,
        }
    }
}
