//! The first poses, and the size: points that cameras saw together are where their rays meet.

use super::Rig;
use crate::MotionError;
use crate::triangulate::triangulate_robust;
use geometry::{Similarity, Transform, Vec2, Vec3};
use rayon::prelude::*;

/// Fewest points that place the model.
pub(super) const FEWEST_SHARED: usize = 12;
/// Rays of two cameras that part by less than this do not place a point, radians.
const LEAST_ANGLE_RAD: f64 = 0.02;
/// Two cameras' first rays pass each other within this many thresholds.
const WIDENING: f64 = 2.0;
/// Times that a fit is weighed anew.
const ROUNDS: usize = 5;

/// A point at one moment.
pub(super) struct Shared {
    pub(super) track: usize,
    /// Rig frame, metres.
    pub(super) place: Vec3,
    /// Angle between the rays, radians.
    pub(super) angle_rad: f64,
}

impl Rig<'_> {
    /// Places the model at each moment, and sizes it.
    pub(super) fn start(&mut self) -> Result<(), MotionError> {
        let all: Vec<Vec<Shared>> =
            (0..self.poses.len()).into_par_iter().map(|moment| self.shared(moment, &self.places)).collect();
        let found = all.iter().map(Vec::len).max().unwrap_or(0);
        let mut sizes: Vec<f64> = all.iter().filter_map(|shared| Some(self.fit(shared, 1.0, true)?.scale)).collect();
        sizes.sort_by(f64::total_cmp);
        let size = *sizes.get(sizes.len() / 2).ok_or(MotionError::FewShared { found, needed: FEWEST_SHARED })?;
        let pose = |(moment, shared): (usize, &Vec<Shared>)| {
            self.fit(shared, size, false).map(|fit| fit.rigid).or_else(|| self.initial(moment, size))
        };
        self.poses = all.iter().enumerate().map(pose).collect();
        Ok(())
    }

    /// Points that several cameras saw at a moment, by cameras at `places`.
    pub(super) fn shared(&self, moment: usize, places: &[Transform]) -> Vec<Shared> {
        let shared = |(track, sights): (usize, &Vec<super::Sight>)| {
            let now = sights.iter().filter(|s| self.moment(s.frame) == moment);
            let rays: Vec<(Transform, Vec2)> =
                now.map(|s| (places[s.frame / self.options.moments], s.normalised)).collect();
            let (found, _) = triangulate_robust(&rays, WIDENING * self.threshold())?;
            let tells = found.angle_rad >= LEAST_ANGLE_RAD;
            tells.then_some(Shared { track, place: found.point, angle_rad: found.angle_rad })
        };
        self.sights.iter().enumerate().filter_map(shared).collect()
    }

    /// The model, `size` times as large, laid on points, robustly; `None` for too few of them.
    fn fit(&self, shared: &[Shared], size: f64, with_scale: bool) -> Option<Similarity> {
        let on_model = shared.iter().filter_map(|s| Some((self.options.model[s.track]? * size, s.place)));
        let (from, to): (Vec<Vec3>, Vec<Vec3>) = on_model.unzip();
        if from.len() < FEWEST_SHARED {
            return None;
        }
        let mut fit = Similarity::fit(&from, &to, None, with_scale)?;
        for _ in 0..ROUNDS {
            let off: Vec<f64> = from.iter().zip(&to).map(|(a, b)| (fit.apply(a) - b).norm()).collect();
            let mut sorted = off.clone();
            sorted.sort_by(f64::total_cmp);
            let usual = (2.0 * sorted[sorted.len() / 2]).max(1e-9);
            let weights: Vec<f64> = off.iter().map(|off| 1.0 / (1.0 + (off / usual).powi(2)).powi(2)).collect();
            fit = Similarity::fit(&from, &to, Some(&weights), with_scale)?;
        }
        Some(fit)
    }

    /// The pose that the initial ones give a moment: that of the first camera which has one.
    fn initial(&self, moment: usize, size: f64) -> Option<Transform> {
        let pose = |(camera, place): (usize, &Transform)| {
            let known = self.options.initial_poses[camera * self.options.moments + moment]?;
            Some(place.inverse() * Transform::new(known.rotation, known.translation * size))
        };
        self.places.iter().enumerate().find_map(pose)
    }
}
