//! The last adjustment, the moments that took no part in it, and what is said of all.

use super::{REJECTION, Rig, RigSequence, Sight, WIDENING};
use crate::MotionError;
use crate::bundle::{BundleReport, Fit, Held, Observation};
use crate::resect::{ResectOptions, resect};
use crate::sequence::Sequence;
use geometry::{Progress, Transform, Vec2, Vec3};
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

/// Steps of the last adjustment.
const STEPS: usize = 20;
/// Fewest known points from which a moment is placed.
const FEWEST_POINTS: usize = 8;
/// What the tracker may be off in all points alike, pixels.
const TRACKER_BIAS_PX: f64 = 0.05;

impl Rig<'_> {
    /// The result.
    pub(super) fn finish(mut self, progress: &Progress) -> Result<RigSequence, MotionError> {
        self.triangulate_all(1.0);
        let mut observations = self.observations(1.0, true);
        self.adjust(&observations, STEPS);
        let limit = self.limit(&observations);
        let near = |rig: &Self, o: &Observation| rig.distance(o) <= limit * o.sigma_px;
        observations.retain(|o| near(&self, o));
        progress.step(WIDENING.len() + 1, WIDENING.len() + 2)?;
        let adjusted = self.adjust(&observations, STEPS);
        self.place_others();
        let mut all = self.observations(1.0, false);
        all.retain(|o| near(&self, o));
        self.forget_unseen(&all);
        let size_sigma = self.size_sigma(&adjusted.places)?;
        let report = self.report(&all, &adjusted);
        Ok(RigSequence { sequence: self.sequence(all, report), size_sigma })
    }

    fn distance(&self, o: &Observation) -> f64 {
        let sight = Sight { frame: o.frame, normalised: Vec2::zeros(), pixel: o.pixel, sigma_px: o.sigma_px };
        self.distance_px(o.point, &sight)
    }

    /// Distance beyond which an observation is wrong, in its standard deviations.
    fn limit(&self, observations: &[Observation]) -> f64 {
        let mut off: Vec<f64> = observations.iter().map(|o| self.distance(o) / o.sigma_px).collect();
        off.sort_by(f64::total_cmp);
        REJECTION * (off.get(off.len() / 2).copied().unwrap_or(0.0) / 1.177).max(0.5)
    }

    /// Places the moments that the structure was not solved from, each by the camera that sees most of it.
    fn place_others(&mut self) {
        let place = |moment: usize| {
            if self.key[moment] && self.poses[moment].is_some() {
                return self.poses[moment];
            }
            let frames = (0..self.places.len()).map(|camera| camera * self.options.moments + moment);
            let seen = frames.map(|frame| (frame, self.known_points(frame))).max_by_key(|(_, known)| known.len())?;
            self.resected(seen.0, &seen.1)
        };
        self.poses = (0..self.poses.len()).into_par_iter().map(place).collect();
    }

    /// The points that a frame sees, and where.
    fn known_points(&self, frame: usize) -> Vec<(Vec3, Vec2)> {
        let known = |(track, sights): (usize, &Vec<Sight>)| {
            let sight = sights.iter().find(|s| s.frame == frame)?;
            Some((self.points[track]?, sight.normalised))
        };
        self.sights.iter().enumerate().filter_map(known).collect()
    }

    fn resected(&self, frame: usize, known: &[(Vec3, Vec2)]) -> Option<Transform> {
        let (points, normalised): (Vec<Vec3>, Vec<Vec2>) = known.iter().copied().unzip();
        let options = ResectOptions {
            threshold: 2.0 * self.threshold(),
            min_inliers: FEWEST_POINTS,
            seed: frame as u64,
            ..ResectOptions::default()
        };
        let found = resect(&points, &normalised, self.pose(frame), &options).ok()?;
        Some(self.place(frame).inverse() * found.cam_from_x)
    }

    /// Takes the place of points, and the pose of moments, that hardly anything agrees with.
    fn forget_unseen(&mut self, observations: &[Observation]) {
        let (mut at_moment, mut of_point) = (vec![0; self.poses.len()], vec![0; self.points.len()]);
        for o in observations {
            at_moment[o.frame % self.options.moments] += 1;
            of_point[o.point] += 1;
        }
        self.poses.iter_mut().zip(at_moment).for_each(|(pose, n)| *pose = pose.filter(|_| n >= FEWEST_POINTS));
        self.points.iter_mut().zip(of_point).for_each(|(point, n)| *point = point.filter(|_| n >= 2));
    }

    /// Standard deviation of the size: by steps of the cameras' poses, each a standard deviation long, and by the tracker.
    fn size_sigma(&self, covariances: &[Matrix6<f64>]) -> Result<f64, MotionError> {
        let all = (0..self.poses.len()).into_par_iter().map(|moment| (moment, self.shared(moment, &self.places).len()));
        let best = all.max_by_key(|(moment, count)| (*count, usize::MAX - moment)).map_or(0, |(moment, _)| moment);
        let still = self.shared(best, &self.places);
        let mut angles: Vec<f64> = still.iter().map(|shared| shared.angle_rad).collect();
        angles.sort_by(f64::total_cmp);
        let angle = *angles.get(angles.len() / 2).ok_or(MotionError::FewShared { found: 0, needed: 1 })?;
        let spread = |shared: &[super::start::Shared]| {
            let mean = shared.iter().map(|s| s.place).sum::<Vec3>() / shared.len().max(1) as f64;
            shared.iter().map(|s| (s.place - mean).norm_squared()).sum::<f64>().sqrt()
        };
        let mut variance = (TRACKER_BIAS_PX / self.camera.fx / angle).powi(2);
        for (camera, covariance) in covariances.iter().enumerate() {
            for step in deviations(covariance) {
                let mut places = self.places.clone();
                places[camera] = places[camera].retract(&step);
                let moved = self.shared(best, &places);
                if moved.len() == still.len() {
                    variance += (spread(&moved) / spread(&still) - 1.0).powi(2);
                }
            }
        }
        Ok(variance.sqrt())
    }

    fn report(&self, observations: &[Observation], adjusted: &super::adjust::Adjusted) -> BundleReport {
        let deviation = |covariance: &Option<geometry::Mat3>| {
            covariance.map_or(f64::INFINITY, |c| (c.trace() / 3.0 * adjusted.excess).sqrt())
        };
        let frames = self.options.places.len() * self.options.moments;
        let mut report = BundleReport {
            initial_cost: adjusted.cost,
            final_cost: adjusted.cost,
            iterations: STEPS,
            rejected_steps: 0,
            converged: true,
            rms_px: 0.0,
            excess: adjusted.excess,
            frames: vec![Fit::default(); frames],
            points: vec![Fit::default(); self.points.len()],
            point_sigma: adjusted.points.iter().map(deviation).collect(),
            held: Held::default(),
            focal_sigma_px: None,
            covariances: None,
        };
        observations.iter().for_each(|o| report.count(o, self.distance(o).powi(2)));
        report
    }

    fn sequence(self, observations: Vec<Observation>, report: BundleReport) -> Sequence {
        let frames = 0..self.options.places.len() * self.options.moments;
        let none = |frame: usize| {
            let (agree, total) = (report.frames[frame].observations, self.known_points(frame).len());
            MotionError::NoPose { agree, total }
        };
        let poses = frames.map(|frame| self.pose(frame).ok_or_else(|| none(frame))).collect();
        Sequence {
            is_lens_free: false,
            anchored: true,
            camera: self.camera,
            poses,
            points: self.points,
            observations,
            focal_sigma_px: None,
            report,
        }
    }
}

/// Independent steps, each a standard deviation long.
fn deviations(covariance: &Matrix6<f64>) -> Vec<Vector6<f64>> {
    let eigen = covariance.symmetric_eigen();
    (0..6).map(|k| eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt()).collect()
}
