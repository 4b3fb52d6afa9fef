//! How well the motion of a head determines a focal length.
//!
//! The normal equations believe that errors are independent and that the lens is as the model says: neither is true of
//! tracks on a face, which err together in all frames, of an unknown lens, and of a head that points are expected on. So
//! the tracks are left out group by group (delete-a-group jackknife: Shao and Tu 1995, section 2.3), and what is not known
//! of lens and head is tried out.

use crate::MotionError;
use crate::bundle::{Bundle, BundleOptions, PointPrior, adjust};
use geometry::{Camera, Progress};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Groups of tracks that are left out in turn.
const GROUPS: usize = 8;
/// Bundles in all: a group less each, three other lenses, a deeper head.
const BUNDLES: usize = GROUPS + 4;
/// Steps that a start near the solution needs at most …
const STEPS: usize = 12;
/// … until one lowers the cost by less than this part of it: the focal length has then come to 2 % of its way, where eight groups tell a
/// standard deviation to 25 %.
const NEAR_COST: f64 = 1e-5;
/// Standard deviation of the principal point of cameras about the middle of the picture, in picture widths.
const PRINCIPAL_POINT_SIGMA: f64 = 0.012;
/// Root mean square of the radial distortion `k1` of cameras: a compact one has 0.02, a webcam −0.25, a wide one −0.36
/// (BoofCV's calibration sets).
const DISTORTION_SIGMA: f64 = 0.2;

/// Standard deviation of the relief of the head that points are expected on, as part of it: from front to back it may be
/// deeper or flatter as a whole. That of landmarks is off by 3, 7 and 16 % on three heads of known shape.
const RELIEF_SIGMA: f64 = 0.1;

/// Standard deviation of the focal length `fx` of an adjusted bundle, pixels; `own_px` is what its equations say, which
/// counts where the prior alone holds it.
pub(super) fn focal_sigma_px(
    bundle: &Bundle,
    options: &BundleOptions,
    own_px: f64,
    progress: &Progress,
) -> Result<f64, MotionError> {
    let options =
        BundleOptions { max_iterations: STEPS, relative_cost: NEAR_COST, covariances: false, ..options.clone() };
    // The bundles run at the same time: those that are done are counted.
    let (done, inside) = (AtomicUsize::new(0), progress.uncounted());
    let refined = |varied: &mut Bundle| -> Result<f64, MotionError> {
        adjust(varied, &options, &inside)?;
        progress.step(1 + done.fetch_add(1, Ordering::Relaxed), BUNDLES)?;
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
    let deeper = BundleOptions { point_priors: deepened(&options.point_priors), ..options.clone() };
    let mut other = bundle.clone();
    adjust(&mut other, &deeper, &inside)?;
    let relief = (other.camera.fx - bundle.camera.fx).powi(2);
    Ok((scatter * (GROUPS - 1) as f64 / GROUPS as f64 + lens + relief + own_px * own_px).sqrt())
}

/// Priors on a head that is deeper by [`RELIEF_SIGMA`] along z, out of the face.
fn deepened(priors: &[PointPrior]) -> Vec<PointPrior> {
    let middle = priors.iter().map(|prior| prior.position.z).sum::<f64>() / priors.len().max(1) as f64;
    let mut deepened = priors.to_vec();
    deepened.iter_mut().for_each(|prior| prior.position.z += RELIEF_SIGMA * (prior.position.z - middle));
    deepened
}
