//! How well the motion of a head determines a focal length.
//!
//! The normal equations believe that errors are independent and that the lens is as the model says: neither is true of
//! tracks on a face, which err together with their neighbours in all frames, of an unknown lens, and of a head that points are
//! expected on. So the tracks are left out block by block of the face (delete-a-group jackknife: Shao and Tu 1995, section 2.3;
//! by blocks, as Künsch 1989 does with dependent errors), and what is not known of lens and head is tried out.

use crate::MotionError;
use crate::bundle::{Bundle, BundleOptions, LensPrior, PointPrior, adjust};
use geometry::{Camera, Progress};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Groups of tracks that are left out in turn.
const GROUPS: usize = 8;
/// Rows of groups from chin to brow; each has two, left and right.
const ROWS: usize = 4;
/// Bundles in all: a group less each, three other lenses, a deeper head.
const BUNDLES: usize = GROUPS + 4;
/// Steps that a start near the solution needs at most …
const STEPS: usize = 12;
/// … until one lowers the cost by less than this part of it: the focal length has then come to 2 % of its way, where eight groups tell a
/// standard deviation to 25 %.
const NEAR_COST: f64 = 1e-5;
/// Standard deviation of the relief of the head that points are expected on, as part of it: from front to back it may be
/// deeper or flatter as a whole. That of landmarks is off by 3, 7 and 16 % on three heads of known shape.
const RELIEF_SIGMA: f64 = 0.1;

/// Standard deviation of the focal length `fx` of an adjusted bundle, pixels; `own_px` is what its equations say, which
/// counts where the prior alone holds it, and `lens` what is known of a lens that they keep.
pub(super) fn focal_sigma_px(
    bundle: &Bundle,
    options: &BundleOptions,
    (own_px, lens): (f64, Option<LensPrior>),
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
    let groups = blocks(bundle);
    let without = |group: usize| {
        let mut rest = bundle.clone();
        rest.observations.retain(|o| groups[o.point] != Some(group));
        refined(&mut rest)
    };
    let jackknife: Vec<f64> = (0..GROUPS).into_par_iter().map(without).collect::<Result<_, _>>()?;
    let mean = jackknife.iter().sum::<f64>() / GROUPS as f64;
    let scatter: f64 = jackknife.iter().map(|focal| (focal - mean).powi(2)).sum();
    let with = |other: &Camera| refined(&mut Bundle { camera: *other, ..bundle.clone() });
    let others: Vec<f64> = other_lenses(&bundle.camera, lens).par_iter().map(with).collect::<Result<_, _>>()?;
    let lens: f64 = others.iter().map(|focal| (focal - bundle.camera.fx).powi(2)).sum();
    let deeper = BundleOptions { point_priors: deepened(&options.point_priors), ..options.clone() };
    let mut other = bundle.clone();
    adjust(&mut other, &deeper, &inside)?;
    let relief = (other.camera.fx - bundle.camera.fx).powi(2);
    Ok((scatter * (GROUPS - 1) as f64 / GROUPS as f64 + lens + relief + own_px * own_px).sqrt())
}

/// A lens that is off by a standard deviation in each of its numbers.
fn other_lenses(camera: &Camera, prior: Option<LensPrior>) -> Vec<Camera> {
    let off = |prior: LensPrior| {
        let shift = prior.principal_sigma_px;
        [
            Camera { cx: camera.cx + shift, ..*camera },
            Camera { cy: camera.cy + shift, ..*camera },
            Camera { k1: camera.k1 + prior.k1_sigma, ..*camera },
        ]
    };
    prior.map(off).into_iter().flatten().collect()
}

/// The block of the face that each observed point lies in: neighbours, which err together, are left out together. Halves along x, quarters
/// along y, each with as many observed points as the others; `None` for points that nothing is seen of.
fn blocks(bundle: &Bundle) -> Vec<Option<usize>> {
    let mut seen = vec![false; bundle.points.len()];
    bundle.observations.iter().for_each(|o| seen[o.point] = true);
    let mut blocks = vec![None; bundle.points.len()];
    let sorted = |mut points: Vec<usize>, axis: usize| {
        points.sort_by(|a, b| bundle.points[*a][axis].total_cmp(&bundle.points[*b][axis]));
        points
    };
    let all = sorted((0..seen.len()).filter(|&point| seen[point]).collect(), 1);
    for (row, points) in all.chunks(all.len().div_ceil(ROWS).max(1)).enumerate() {
        let points = sorted(points.to_vec(), 0);
        for (place, &point) in points.iter().enumerate() {
            blocks[point] = Some(GROUPS / ROWS * row + GROUPS / ROWS * place / points.len());
        }
    }
    blocks
}

/// Priors on a head that is deeper by [`RELIEF_SIGMA`] along z, out of the face.
fn deepened(priors: &[PointPrior]) -> Vec<PointPrior> {
    let middle = priors.iter().map(|prior| prior.position.z).sum::<f64>() / priors.len().max(1) as f64;
    let mut deepened = priors.to_vec();
    deepened.iter_mut().for_each(|prior| prior.position.z += RELIEF_SIGMA * (prior.position.z - middle));
    deepened
}
