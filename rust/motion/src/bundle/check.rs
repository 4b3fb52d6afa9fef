//! Refuses tables that do not fit together and numbers that make no sense.

use super::{Bundle, BundleOptions};
use crate::MotionError;
use geometry::least_squares::Loss;

/// Sine of the angle between two rays of a point above which it has depth.
const LEAST_PARALLAX: f64 = 1e-7;

pub(super) fn check(bundle: &Bundle, options: &BundleOptions) -> Result<(), MotionError> {
    observations(bundle)?;
    bundle.camera.intrinsics().into_iter().try_for_each(|value| finite("a number of the camera", value))?;
    positive("the focal length", bundle.camera.fx.min(bundle.camera.fy))?;
    for &frame in &options.fixed_frames {
        index("list of fixed frames", "frame", frame, bundle.poses.len())?;
    }
    for prior in &options.point_priors {
        index("table of point priors", "point", prior.point, bundle.points.len())?;
        positive("a point prior's information", prior.information.trace())?;
        prior.information.iter().try_for_each(|&value| finite("a point prior's information", value))?;
        prior.position.iter().try_for_each(|&value| finite("a point prior's position", value))?;
    }
    for prior in &options.pose_priors {
        index("table of pose priors", "frame", prior.frame, bundle.poses.len())?;
        positive("a pose prior's standard deviation", prior.sigma_rad)?;
        positive("a pose prior's standard deviation", prior.sigma_m)?;
        prior.cam_from_head.rows().into_iter().flatten().try_for_each(|value| finite("a pose prior", value))?;
    }
    if let Some(prior) = options.focal_prior {
        positive("the focal prior", prior.focal_px)?;
        positive("the focal prior's standard deviation", prior.log_sigma)?;
    }
    if let Some(prior) = options.lens_prior {
        positive("the principal point's standard deviation", prior.principal_sigma_px)?;
        positive("the standard deviation of k1", prior.k1_sigma)?;
        let expected = [prior.principal_px.x, prior.principal_px.y, prior.k1];
        expected.into_iter().try_for_each(|value| finite("the lens prior", value))?;
    }
    if let Loss::Huber(limit) | Loss::Cauchy(limit) = options.loss {
        positive("the loss's limit", limit)?;
    }
    parallax(bundle, options)
}

fn observations(bundle: &Bundle) -> Result<(), MotionError> {
    let (mut frames, mut points) = (vec![false; bundle.poses.len()], vec![false; bundle.points.len()]);
    for o in &bundle.observations {
        index("observation table", "frame", o.frame, frames.len())?;
        index("observation table", "point", o.point, points.len())?;
        positive("an observation's standard deviation", o.sigma_px)?;
        o.pixel.iter().try_for_each(|&value| finite("an observed pixel", value))?;
        (frames[o.frame], points[o.point]) = (true, true);
    }
    for (point, _) in bundle.points.iter().zip(points).filter(|(_, seen)| *seen) {
        point.iter().try_for_each(|&value| finite("a point that is seen", value))?;
    }
    for (pose, _) in bundle.poses.iter().zip(frames).filter(|(_, seen)| *seen) {
        let mut numbers = pose.rotation.matrix().iter().chain(pose.translation.iter());
        numbers.try_for_each(|&value| finite("the pose of a frame that sees points", value))?;
    }
    Ok(())
}

/// Refuses cameras that all stand in one place: without priors nothing tells a depth.
fn parallax(bundle: &Bundle, options: &BundleOptions) -> Result<(), MotionError> {
    if !options.point_priors.is_empty() {
        return Ok(());
    }
    let mut first = vec![None; bundle.points.len()];
    let mut total = 0;
    for o in &bundle.observations {
        let ray = (bundle.points[o.point] - bundle.poses[o.frame].inverse().translation).normalize();
        match first[o.point] {
            None => first[o.point] = Some(ray),
            Some(other) if ray.cross(&other).norm() > LEAST_PARALLAX => return Ok(()),
            Some(_) => total += 1,
        }
    }
    if total == 0 { Ok(()) } else { Err(MotionError::NoDepth { observations: bundle.observations.len() }) }
}

fn index(table: &'static str, kind: &'static str, index: usize, count: usize) -> Result<(), MotionError> {
    if index < count { Ok(()) } else { Err(MotionError::BadIndex { table, kind, index, count }) }
}

fn positive(name: &'static str, value: f64) -> Result<(), MotionError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(MotionError::BadNumber { name, value }) }
}

fn finite(name: &'static str, value: f64) -> Result<(), MotionError> {
    if value.is_finite() { Ok(()) } else { Err(MotionError::BadNumber { name, value }) }
}
