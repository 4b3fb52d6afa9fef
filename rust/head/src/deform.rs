//! The rest of the head follows where feature points are measured: affine plus radial basis functions (paper, eq. 8–10).
//!
//! # Entry points
//! - [`refine`]: a fitted head to its landmarks along the skin and to its cloud across it.
//! - [`carry`]: any features, the general case.
//!
//! Smoothing is Gaussian process regression: a feature's variance over the variance expected of displacements. Where many
//! features crowd, those nearest to one of the evenly spread centres are averaged first.

use crate::fit::{CloudPoint, HeadFit};
use crate::surface::{Foot, SkinSurface};
use crate::{GenericHead, HeadError};
use geometry::rbf::{Kernel, RbfOptions, RbfWarp};
use geometry::{Similarity, Spread, Vec3, median, mesh};
use rayon::prelude::*;

/// A place on the skin and where it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// Vertices of its triangle.
    pub triangle: [u32; 3],
    /// Barycentric weights there.
    pub weights: [f64; 3],
    /// Where it should be, head frame, metres.
    pub target: Vec3,
    /// Standard deviation of the target, metres.
    pub sigma: f64,
}

impl Feature {
    /// Where it is on a mesh.
    pub fn place(&self, positions: &[Vec3]) -> Vec3 {
        mesh::at_barycentric(positions, &self.triangle, &self.weights)
    }
}

/// How features move the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeformOptions {
    /// The radial function.
    pub kernel: Kernel,
    /// Displacements of this size are expected, metres: features with a larger standard deviation are followed little.
    pub expected: f64,
    /// At most this many centres.
    pub centres: usize,
    /// Features this many times farther from their neighbours' opinion than is usual are left out.
    pub outlier_limit: f64,
    /// Skin farther than this from every feature should stay, metres …
    pub rest_distance: f64,
    /// … to within this standard deviation, metres.
    pub rest_sigma: f64,
    /// What part of the landmarks' slips is the person's shape and not the net's habit, as a standard deviation, metres.
    pub slip_sigma: f64,
    /// Cloud points farther off than this are not skin, metres.
    pub reach: f64,
}

impl Default for DeformOptions {
    fn default() -> Self {
        Self {
            kernel: Kernel::Exponential { length: 0.064 },
            expected: 0.002,
            centres: 400,
            outlier_limit: 4.0,
            rest_distance: 0.05,
            rest_sigma: 0.004,
            slip_sigma: 0.001,
            reach: 0.006,
        }
    }
}

/// A carried head.
#[derive(Clone, Debug)]
pub struct Carried {
    /// All vertices, head frame, metres.
    pub positions: Vec<Vec3>,
    /// Features that were left out, as indices.
    pub outliers: Vec<usize>,
    /// Centres of the warp.
    pub centres: usize,
    /// How much stronger than asked the smoothing had to be so that no skin folds over; 1 when it was good at once.
    pub smoothing: f64,
    /// Triangles of the visible skin that fold over all the same.
    pub folded: usize,
}

/// Most often the smoothing is raised against folds.
const SMOOTHING_STEPS: u32 = 5;
/// By how much each time.
const SMOOTHING_FACTOR: f64 = 4.0;
/// Neighbours whose displacements a feature is compared with.
const NEIGHBOURS: usize = 10;
/// Averaging cannot make a centre better than this part of its best feature: neighbours err together.
const COMMON_ERROR: f64 = 0.5;

/// Moves features to their targets and everything else along.
///
/// # Errors
/// [`HeadError::Deform`] when fewer than four features are left or they do not span space.
pub fn carry(
    head: &GenericHead,
    positions: &[Vec3],
    features: &[Feature],
    options: &DeformOptions,
) -> Result<Carried, HeadError> {
    let places: Vec<Vec3> = features.iter().map(|f| f.place(positions)).collect();
    let moves: Vec<Vec3> = features.iter().zip(&places).map(|(f, p)| f.target - p).collect();
    let outliers = outliers(&places, &moves, features, options.outlier_limit);
    let kept: Vec<usize> = (0..features.len()).filter(|i| outliers.binary_search(i).is_err()).collect();
    let mut centres = average(&kept, &places, &moves, features, options.centres);
    if centres.len() < 4 {
        return Err(HeadError::Deform { features: kept.len() });
    }
    centres.extend(resting(head, positions, &places, options));
    let visible = head.outer_skin();
    let mut smoothing = 1.0;
    for step in 0.. {
        let moved = warp(&centres, smoothing, options)?.apply(positions);
        let folded = visible.iter().filter(|t| folds(t, positions, &moved)).count();
        if folded == 0 || step == SMOOTHING_STEPS {
            return Ok(Carried { positions: moved, outliers, centres: centres.len(), smoothing, folded });
        }
        smoothing *= SMOOTHING_FACTOR;
    }
    Err(HeadError::Deform { features: kept.len() })
}

/// Brings a fitted head to its measurements: first its landmarks along the skin, then the skin to the cloud.
///
/// # Errors
/// As for [`carry`].
pub fn refine(
    head: &GenericHead,
    fit: &HeadFit,
    cloud: &[CloudPoint],
    options: &DeformOptions,
) -> Result<Carried, HeadError> {
    let slid =
        carry(head, &fit.positions, &slip_features(head, &fit.positions, &fit.slips, options.slip_sigma), options)?;
    let features = cloud_features(head, &slid.positions, cloud, &fit.head_from_cloud, options.reach);
    carry(head, &slid.positions, &features, options)
}

/// Landmarks with the slips that the fit found for them; those without a slip are left out.
pub fn slip_features(head: &GenericHead, positions: &[Vec3], slips: &[Vec3], sigma: f64) -> Vec<Feature> {
    let feature = |(anchor, slip): (&crate::Anchor, &Vec3)| {
        let place = mesh::at_barycentric(positions, &anchor.triangle, &anchor.weights);
        Feature { triangle: anchor.triangle, weights: anchor.weights, target: place + slip, sigma }
    };
    head.anchors.iter().zip(slips).filter(|(_, s)| s.norm_squared() > 0.0).map(feature).collect()
}

/// The feet of cloud points within `reach` of the skin, with the points as their targets.
pub fn cloud_features(
    head: &GenericHead,
    positions: &[Vec3],
    cloud: &[CloudPoint],
    head_from_cloud: &Similarity,
    reach: f64,
) -> Vec<Feature> {
    let surface = SkinSurface::new(head, positions);
    let feature = |point: &CloudPoint| {
        let target = head_from_cloud.apply(&point.position);
        let Foot { triangle, weights, position, normal } = surface.closest(&target, reach)?;
        let in_cloud = head_from_cloud.rigid.rotation.inverse() * normal;
        let sigma = in_cloud.dot(&(point.covariance * in_cloud)).max(0.0).sqrt() * head_from_cloud.scale;
        // Only the distance from the skin was measured, not where along it the point belongs.
        let target = position + normal * normal.dot(&(target - position));
        Some(Feature { triangle, weights, target, sigma })
    };
    cloud.par_iter().filter_map(feature).collect()
}

/// A centre of the warp: place, displacement, variance.
type Centre = (Vec3, Vec3, f64);

fn warp(centres: &[Centre], smoothing: f64, options: &DeformOptions) -> Result<RbfWarp, HeadError> {
    let places: Vec<Vec3> = centres.iter().map(|c| c.0).collect();
    let moves: Vec<Vec3> = centres.iter().map(|c| c.1).collect();
    let variances: Vec<f64> = centres.iter().map(|c| c.2).collect();
    let rbf = RbfOptions { kernel: options.kernel, smoothing: smoothing / (options.expected * options.expected) };
    RbfWarp::fit(&places, &moves, Some(&variances), &rbf).map_err(|_| HeadError::Deform { features: centres.len() })
}

/// Whether a triangle's normal turns round.
fn folds(triangle: &[u32; 3], before: &[Vec3], after: &[Vec3]) -> bool {
    mesh::area_normal(before, triangle).dot(&mesh::area_normal(after, triangle)) <= 0.0
}

/// Features whose displacement differs from the median of their neighbours' by far more than is usual; ascending.
fn outliers(places: &[Vec3], moves: &[Vec3], features: &[Feature], limit: f64) -> Vec<usize> {
    let deviation = |i: usize| {
        if !features[i].sigma.is_finite() || !moves[i].iter().all(|x| x.is_finite()) {
            return f64::INFINITY;
        }
        let mut near: Vec<(f64, usize)> =
            (0..places.len()).filter(|&j| j != i).map(|j| ((places[j] - places[i]).norm_squared(), j)).collect();
        let count = NEIGHBOURS.min(near.len());
        if count == 0 {
            return 0.0;
        }
        near.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let opinion = Vec3::from_fn(|k, _| median(near[..count].iter().map(|(_, j)| moves[*j][k])).unwrap_or(0.0));
        (moves[i] - opinion).norm()
    };
    let deviations: Vec<f64> = (0..places.len()).into_par_iter().map(deviation).collect();
    let usual = median(deviations.iter().copied().filter(|d| d.is_finite())).unwrap_or(0.0);
    let beyond = |i: &usize| deviations[*i] > limit * usual.max(features[*i].sigma);
    (0..places.len()).filter(beyond).collect()
}

/// Evenly spread centres (farthest point sampling), each the weighted mean of the features that are closest to it.
fn average(kept: &[usize], places: &[Vec3], moves: &[Vec3], features: &[Feature], limit: usize) -> Vec<Centre> {
    let spread = Spread::over(&kept.iter().map(|&i| places[i]).collect::<Vec<_>>(), limit);
    let mut sums = vec![(Vec3::zeros(), Vec3::zeros(), 0.0, f64::INFINITY); spread.chosen.len()];
    for (&i, &centre) in kept.iter().zip(&spread.nearest) {
        let variance = features[i].sigma.powi(2).max(1e-12);
        let sum = &mut sums[centre];
        sum.0 += places[i] / variance;
        sum.1 += moves[i] / variance;
        sum.2 += 1.0 / variance;
        sum.3 = sum.3.min(variance);
    }
    let centre = |(place, step, information, best): (Vec3, Vec3, f64, f64)| {
        (place / information, step / information, (1.0 / information).max(COMMON_ERROR * COMMON_ERROR * best))
    };
    sums.into_iter().map(centre).collect()
}

/// Skin far from all features, spread as widely as the distance asked for, that should stay where it is.
fn resting(head: &GenericHead, positions: &[Vec3], places: &[Vec3], options: &DeformOptions) -> Vec<Centre> {
    let mut taken: Vec<Vec3> = places.to_vec();
    let mut centres = Vec::new();
    for i in head.skin().vertices.clone().filter(|&i| !head.cavity[i]) {
        if taken.iter().all(|p| (p - positions[i]).norm() > options.rest_distance) {
            taken.push(positions[i]);
            centres.push((positions[i], Vec3::zeros(), options.rest_sigma * options.rest_sigma));
        }
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::testing::{chance, toy_head};

    fn bend(p: &Vec3) -> Vec3 {
        Vec3::new(0.002 * (30.0 * p.y).sin(), 0.001, 0.0025 * (25.0 * p.x).cos())
    }

    /// Features on the front, every `step`-th anchor, their targets bent, with noise.
    fn features(head: &GenericHead, step: usize, noise: f64) -> Vec<Feature> {
        let anchors = head.anchors.iter().step_by(step).enumerate();
        let feature = |(i, a): (usize, &crate::Anchor)| {
            let place = mesh::at_barycentric(&head.positions, &a.triangle, &a.weights);
            let error = Vec3::from_fn(|k, _| 1.7 * noise * chance(7 * i as u64 + k as u64));
            Feature {
                triangle: a.triangle,
                weights: a.weights,
                target: place + bend(&place) + error,
                sigma: noise.max(1e-6),
            }
        };
        anchors.map(feature).collect()
    }

    /// Root mean square error of the moved anchors.
    fn error(head: &GenericHead, moved: &[Vec3]) -> f64 {
        let pairs = head.landmarks(&head.positions).into_iter().zip(head.landmarks(moved));
        let squares: Vec<f64> = pairs.map(|(a, b)| (a + bend(&a) - b).norm_squared()).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn skin_between_features_follows_them() {
        let head = toy_head();
        let carried = carry(&head, &head.positions, &features(&head, 3, 0.0), &DeformOptions::default()).unwrap();
        assert!(error(&head, &carried.positions) < 2e-4, "{}", error(&head, &carried.positions));
        assert!(carried.outliers.is_empty() && carried.folded == 0 && carried.smoothing == 1.0);
    }

    #[test]
    fn noise_is_smoothed_and_outliers_are_left_out() {
        let head = toy_head();
        let mut noisy = features(&head, 1, 0.001);
        for i in [30, 170, 300] {
            noisy[i].target += Vec3::new(0.0, 0.015, 0.01);
        }
        let carried = carry(&head, &head.positions, &noisy, &DeformOptions::default()).unwrap();
        assert!([30, 170, 300].iter().all(|i| carried.outliers.contains(i)) && carried.outliers.len() < 15);
        let raw = (0..468).filter(|i| ![30, 170, 300].contains(i)).map(|i| {
            let place = noisy[i].place(&head.positions);
            (noisy[i].target - place - bend(&place)).norm_squared()
        });
        let raw = (raw.sum::<f64>() / 465.0).sqrt();
        assert!(error(&head, &carried.positions) < 0.6 * raw, "{} {raw}", error(&head, &carried.positions));
    }

    #[test]
    fn crossing_targets_do_not_fold_the_skin() {
        let head = toy_head();
        let mut crossing = features(&head, 2, 0.0005);
        for (i, f) in crossing.iter_mut().enumerate() {
            f.target += Vec3::x() * if i % 2 == 0 { 0.02 } else { -0.02 };
        }
        let options = DeformOptions { outlier_limit: 100.0, ..DeformOptions::default() };
        let carried = carry(&head, &head.positions, &crossing, &options).unwrap();
        assert!(carried.folded == 0 && carried.smoothing > 1.0, "{} {}", carried.folded, carried.smoothing);
    }

    #[test]
    fn the_back_of_the_head_stays() {
        let head = toy_head();
        let carried = carry(&head, &head.positions, &features(&head, 2, 0.0005), &DeformOptions::default()).unwrap();
        let back = head.skin().vertices.clone().filter(|&i| head.positions[i].z < -0.16);
        let largest = back.map(|i| (carried.positions[i] - head.positions[i]).norm()).fold(0.0, f64::max);
        assert!(largest < 0.003, "{largest}");
    }

    #[test]
    fn too_few_features_are_refused() {
        let head = toy_head();
        let three = &features(&head, 100, 0.0)[..3];
        assert!(matches!(
            carry(&head, &head.positions, three, &DeformOptions::default()),
            Err(HeadError::Deform { .. })
        ));
    }
}
