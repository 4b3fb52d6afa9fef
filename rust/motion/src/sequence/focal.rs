//! How well the motion of a head determines a focal length.
//!
//! The normal equations believe that errors are independent and that the lens is as the model says: neither is true of
//! tracks on a face, which err together in all frames, and of an unknown lens. So the tracks are left out group by group
//! (delete-a-group jackknife: Shao and Tu 1995, section 2.3), and what is not known of the lens is tried out.

use crate::MotionError;
use crate::bundle::{Bundle, BundleOptions, adjust};
use geometry::{Camera, Progress};
use rayon::prelude::*;

/// Groups of tracks that are left out in turn.
const GROUPS: usize = 8;
/// Steps that a start near the solution needs.
const STEPS: usize = 12;
/// Standard deviation of the principal point of cameras about the middle of the picture, in picture widths.
const PRINCIPAL_POINT_SIGMA: f64 = 0.012;
/// Standard deviation of the radial distortion `k1` of cameras about zero.
const DISTORTION_SIGMA: f64 = 0.1;

/// Standard deviation of the focal length `fx` of an adjusted bundle, pixels.
pub(super) fn focal_sigma_px(
    bundle: &Bundle,
    options: &BundleOptions,
    progress: &Progress,
) -> Result<f64, MotionError> {
    let options = BundleOptions { max_iterations: STEPS, covariances: false, ..options.clone() };
    let refined = |varied: &mut Bundle| -> Result<f64, MotionError> {
        adjust(varied, &options, progress)?;
        Ok(varied.camera.fx)
    };
    let without = |group: usize| {
        let mut rest = bundle.clone();
        rest.observations.retain(|o| o.point % GROUPS != group);
        refined(&mut rest)
    };
    let jackknife: Vec<f64> = (0..GROUPS).into_par_iter().map(without).collect::<Result<_, _>>()?;
    let mean = jackknife.iter().sum::<f64>() / GROUPS as f64;
    let scatter: f64 = jackknife.iter().map(|focal| (focal - mean).powi(2)).sum();
    let with = |vary: &fn(&mut Camera)| {
        let mut other = bundle.clone();
        vary(&mut other.camera);
        refined(&mut other)
    };
    let lenses: [fn(&mut Camera); 3] = [
        |camera| camera.cx += PRINCIPAL_POINT_SIGMA * f64::from(camera.width),
        |camera| camera.cy += PRINCIPAL_POINT_SIGMA * f64::from(camera.width),
        |camera| camera.k1 += DISTORTION_SIGMA,
    ];
    let others: Vec<f64> = lenses.par_iter().map(with).collect::<Result<_, _>>()?;
    let lens: f64 = others.iter().map(|focal| (focal - bundle.camera.fx).powi(2)).sum();
    Ok((scatter * (GROUPS - 1) as f64 / GROUPS as f64 + lens).sqrt())
}
