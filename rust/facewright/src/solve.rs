//! From tracks to refined poses and a cloud of skin points: essential matrices throw out what moves against the head,
//! then one bundle over the chosen frames.

use crate::FacewrightError;
use crate::track::FaceTrack;
use geometry::least_squares::Loss;
use geometry::{Camera, Mat3, Progress, Transform, Vec2};
use head::fit::CloudPoint;
use motion::bundle::{Bundle, BundleOptions, FocalPrior, Observation, PointPrior, adjust};
use motion::two_view::{TwoViewOptions, robust};
use std::collections::BTreeMap;

/// How the structure is solved.
#[derive(Clone, Debug)]
pub struct SolveOptions {
    /// A match must lie within this of its epipolar line to vote for a motion, pixels.
    pub epipolar_px: f64,
    /// Frames turned by less than this against a track's reference are not checked by an essential matrix, degrees.
    pub min_turn_deg: f64,
    /// Standard deviation of the landmark fit's surface under a point, metres.
    pub surface_sigma: f64,
    /// Relative standard deviation of the focal length; 0 keeps it.
    pub focal_sigma: f64,
    /// Observations farther off than this after the first bundle are dropped, standard deviations.
    pub outlier: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { epipolar_px: 1.0, min_turn_deg: 6.0, surface_sigma: 0.006, focal_sigma: 0.0, outlier: 4.0 }
    }
}

/// Poses and points in one frame, which is the head's as far as it was known.
#[derive(Clone, Debug)]
pub struct Structure {
    /// The camera, refined where that was asked for.
    pub camera: Camera,
    /// Pose of every chosen frame, `cam_from_cloud`.
    pub poses: Vec<Transform>,
    /// Points of the skin.
    pub cloud: Vec<CloudPoint>,
    /// Root mean square reprojection error per chosen frame, pixels; `None` without points.
    pub rms_px: Vec<Option<f64>>,
    /// Part of the matches that essential matrices agreed with.
    pub agreement: f64,
}

/// Solves for poses and points. `poses` are the landmark fit's, one per chosen frame.
pub fn solve(
    tracks: &[FaceTrack],
    poses: &[Transform],
    camera: &Camera,
    options: &SolveOptions,
    progress: &Progress,
) -> Result<Structure, FacewrightError> {
    progress.stage("motion")?;
    let (kept, agreement) = epipolar_vote(tracks, poses, camera, options, progress)?;
    let mut problem = Bundle {
        camera: *camera,
        poses: poses.to_vec(),
        points: kept.iter().map(|(t, _)| tracks[*t].point).collect(),
        observations: observations(&kept),
    };
    let bundle_options = BundleOptions {
        fixed_frames: Vec::new(),
        loss: Loss::Huber(2.0),
        focal_prior: (options.focal_sigma > 0.0)
            .then_some(FocalPrior { focal_px: camera.fx, sigma_px: options.focal_sigma * camera.fx }),
        refine_focal: options.focal_sigma > 0.0,
        point_priors: priors(&kept, tracks, options.surface_sigma),
        ..BundleOptions::default()
    };
    adjust(&mut problem, &bundle_options, progress)?;
    drop_outliers(&mut problem, options.outlier);
    adjust(&mut problem, &bundle_options, progress)?;
    Ok(structure(problem, agreement))
}

type Kept = Vec<(usize, Vec<(usize, Vec2, f64)>)>;

/// Each reference frame against each other frame: matches that no single motion of the head explains lose their
/// observation. Frames turned too little against each other cannot tell and keep theirs.
fn epipolar_vote(
    tracks: &[FaceTrack],
    poses: &[Transform],
    camera: &Camera,
    options: &SolveOptions,
    progress: &Progress,
) -> Result<(Kept, f64), FacewrightError> {
    let mut pairs: BTreeMap<(usize, usize), Vec<(usize, usize)>> = BTreeMap::new();
    for (t, track) in tracks.iter().enumerate() {
        for (o, observation) in track.observations.iter().enumerate() {
            if observation.0 != track.reference {
                pairs.entry((track.reference, observation.0)).or_default().push((t, o));
            }
        }
    }
    let two_view = TwoViewOptions { threshold: options.epipolar_px / camera.fx, ..TwoViewOptions::default() };
    let mut rejected: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let (mut agreed, mut asked) = (0, 0);
    let total = pairs.len();
    for (done, ((reference, frame), matches)) in pairs.into_iter().enumerate() {
        progress.step(done, total)?;
        if poses[reference].angle_to(&poses[frame]).to_degrees() < options.min_turn_deg {
            continue;
        }
        let normalised = |pixel: &Vec2| camera.normalise(pixel);
        let a: Vec<Vec2> = matches.iter().map(|&(t, _)| normalised(&tracks[t].reference_pixel)).collect();
        let b: Vec<Vec2> = matches.iter().map(|&(t, o)| normalised(&tracks[t].observations[o].1)).collect();
        // Where the two frames alone cannot tell a motion, the bundle's robust loss decides.
        let Ok(motion) = robust(&a, &b, &two_view) else { continue };
        for (&(t, o), inlier) in matches.iter().zip(motion.inliers) {
            asked += 1;
            if inlier { agreed += 1 } else { rejected.entry(t).or_default().push(o) }
        }
    }
    let none = Vec::new();
    let kept = (0..tracks.len()).filter_map(|t| {
        let out = rejected.get(&t).unwrap_or(&none);
        let all = tracks[t].observations.iter().enumerate();
        let left: Vec<_> = all.filter(|(o, _)| !out.contains(o)).map(|(_, seen)| *seen).collect();
        (left.len() >= 3).then_some((t, left))
    });
    Ok((kept.collect(), f64::from(agreed) / f64::from(asked).max(1.0)))
}

fn observations(kept: &Kept) -> Vec<Observation> {
    let numbered = kept.iter().enumerate();
    numbered
        .flat_map(|(point, (_, seen))| {
            seen.iter().map(move |&(frame, pixel, sigma_px)| Observation { frame, point, pixel, sigma_px })
        })
        .collect()
}

/// Every point is softly tied to the surface of the landmark fit: what a narrow turn leaves open stays plausible.
fn priors(kept: &Kept, tracks: &[FaceTrack], sigma: f64) -> Vec<PointPrior> {
    let numbered = kept.iter().enumerate();
    numbered.map(|(point, (track, _))| PointPrior::near(point, tracks[*track].point, sigma)).collect()
}

fn residual(problem: &Bundle, seen: &Observation) -> Option<f64> {
    let point = problem.poses[seen.frame].apply(&problem.points[seen.point]);
    Some((problem.camera.project(&point)? - seen.pixel).norm())
}

/// Drops observations far off their point, by the clip's own spread.
fn drop_outliers(problem: &mut Bundle, limit: f64) {
    let scaled: Vec<Option<f64>> =
        problem.observations.iter().map(|o| residual(problem, o).map(|r| r / o.sigma_px)).collect();
    let spread = crate::select::median(scaled.iter().flatten().copied()) / 1.1774;
    let keep = |r: &Option<f64>| r.is_some_and(|r| r < limit * spread.max(0.5));
    let mut scaled = scaled.iter();
    problem.observations.retain(|_| scaled.next().is_some_and(keep));
}

fn structure(problem: Bundle, agreement: f64) -> Structure {
    let mut information = vec![Mat3::zeros(); problem.points.len()];
    let mut seen = vec![0_usize; problem.points.len()];
    let mut squares: Vec<(f64, usize)> = vec![(0.0, 0); problem.poses.len()];
    let (mut chi2, mut count) = (0.0, 0.0);
    for o in &problem.observations {
        let pose = &problem.poses[o.frame];
        let Some((pixel, jacobian)) = problem.camera.project_with_jacobian(&pose.apply(&problem.points[o.point]))
        else {
            continue;
        };
        let by_point = jacobian.point * pose.rotation.matrix() / o.sigma_px;
        information[o.point] += by_point.transpose() * by_point;
        seen[o.point] += 1;
        let error = (pixel - o.pixel).norm_squared();
        squares[o.frame].0 += error;
        squares[o.frame].1 += 1;
        chi2 += error / (o.sigma_px * o.sigma_px);
        count += 2.0;
    }
    // The trackers' own sigmas know nothing of what changes between frames: scale them to what the bundle found.
    let inflation = (chi2 / f64::max(count, 1.0)).max(1.0);
    let mut cloud = Vec::new();
    for (i, point) in problem.points.iter().enumerate().filter(|&(i, _)| seen[i] >= 3) {
        let Some(covariance) = information[i].try_inverse() else { continue };
        cloud.push(CloudPoint { position: *point, covariance: covariance * inflation });
    }
    let rms_px = squares.iter().map(|&(sum, n)| (n > 0).then(|| (sum / n as f64).sqrt())).collect();
    Structure { camera: problem.camera, poses: problem.poses, cloud, rms_px, agreement }
}
