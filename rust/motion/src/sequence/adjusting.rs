//! Bundles over what is known so far.

use super::grow::Reconstruction;
use super::inflation::variance_inflation;
use crate::MotionError;
use crate::bundle::{Bundle, BundleOptions, FocalPrior, LensPrior, PointPrior, PosePrior, adjust};
use geometry::least_squares::Loss;
use geometry::{Progress, Transform, Vec3};
use rayon::prelude::*;

/// The loss of an observation, in its standard deviations.
const LOSS: Loss = Loss::Cauchy(3.0);
/// How many times farther from the middle than a lens puts it the principal point of a part of a picture may be.
const PART_OF_PICTURE: f64 = 25.0;
/// A bundle that others follow stops at a step that lowers the cost by less than this part of it: they begin where it ends.
const PASSING_COST: f64 = 1e-5;

impl Reconstruction<'_> {
    pub(super) fn bundle(&self, widening: f64) -> Bundle {
        Bundle {
            camera: self.camera,
            poses: self.poses.iter().map(|pose| pose.unwrap_or_else(Transform::identity)).collect(),
            points: self.points.iter().map(|point| point.unwrap_or_else(Vec3::zeros)).collect(),
            observations: self.observations(widening),
        }
    }

    /// Weighs the observations against the priors by how they fit now.
    pub(super) fn weigh(&mut self) {
        self.inflation = variance_inflation(&self.bundle(1.0), LOSS);
    }

    /// Observations keep their announced standard deviations, by which the loss knows them: the priors' are drawn in instead. Initial
    /// poses were found with another focal length, which turns them too: where that is refined, the points hold the frame of the head if
    /// they can.
    pub(super) fn bundle_options(&self, iterations: usize, refine_focal: bool) -> BundleOptions {
        let deviation = 1.0 / self.inflation.sqrt();
        let anchors = self.anchors.iter().enumerate().filter_map(|(frame, anchor)| Some((frame, (*anchor)?)));
        let pose_prior = |(frame, cam_from_head)| PosePrior {
            frame,
            cam_from_head,
            sigma_rad: deviation * self.options.initial_sigma_rad,
            sigma_m: self.options.initial_sigma_m,
        };
        let by_points = refine_focal && self.options.point_priors.len() >= 3;
        let pose_priors: Vec<PosePrior> = anchors.filter(|_| !by_points).map(pose_prior).collect();
        let point_prior = |prior: &PointPrior| PointPrior { information: prior.information * self.inflation, ..*prior };
        let is_placed = |prior: &&PointPrior| self.points.get(prior.point).is_some_and(Option::is_some);
        let focal_prior = |prior: FocalPrior| FocalPrior { log_sigma: deviation * prior.log_sigma, ..prior };
        let lens_prior = |prior: LensPrior| LensPrior {
            principal_sigma_px: deviation * PART_OF_PICTURE * prior.principal_sigma_px,
            k1_sigma: deviation * prior.k1_sigma,
            ..prior
        };
        BundleOptions {
            loss: LOSS,
            refine_focal,
            focal_prior: self.options.focal_prior.map(focal_prior),
            lens_prior: self.options.lens_prior.filter(|_| refine_focal && self.is_lens_free).map(lens_prior),
            fixed_frames: if self.is_anchored() { Vec::new() } else { vec![self.reference] },
            point_priors: self.options.point_priors.iter().filter(is_placed).map(point_prior).collect(),
            pose_priors,
            max_iterations: iterations,
            ..BundleOptions::default()
        }
    }

    pub(super) fn adjust(
        &mut self,
        widening: f64,
        iterations: usize,
        refine_focal: bool,
        progress: &Progress,
    ) -> Result<(), MotionError> {
        let mut bundle = self.bundle(widening);
        let options = BundleOptions { relative_cost: PASSING_COST, ..self.bundle_options(iterations, refine_focal) };
        adjust(&mut bundle, &options, progress)?;
        self.adopt(&bundle);
        Ok(())
    }

    /// Takes over a bundle's result.
    pub(super) fn adopt(&mut self, bundle: &Bundle) {
        for (pose, adjusted) in self.poses.iter_mut().zip(&bundle.poses) {
            *pose = pose.map(|_| *adjusted);
        }
        for (point, adjusted) in self.points.iter_mut().zip(&bundle.points) {
            *point = point.map(|_| *adjusted);
        }
        if self.camera != bundle.camera {
            self.camera = bundle.camera;
            let camera = bundle.camera;
            self.sightings.par_iter_mut().flatten().for_each(|s| s.normalised = camera.normalise(&s.pixel));
        }
        self.rescale();
    }

    /// Without anchors nothing holds the scale: the points' median depth in the reference frame is the distance asked for.
    pub(super) fn rescale(&mut self) {
        let Some(pose) = self.poses[self.reference].filter(|_| !self.is_anchored()) else { return };
        let mut depths: Vec<f64> = self.points.iter().flatten().map(|p| pose.apply(p).z).filter(|z| *z > 0.0).collect();
        depths.sort_by(f64::total_cmp);
        let Some(median) = depths.get(depths.len() / 2) else { return };
        let factor = self.options.distance_m / median;
        self.poses.iter_mut().flatten().for_each(|pose| pose.translation *= factor);
        self.points.iter_mut().flatten().for_each(|point| *point *= factor);
    }
}
