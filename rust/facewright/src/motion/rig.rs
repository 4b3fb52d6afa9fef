//! The size of a head from several cameras that filmed it at the same moments, and whose places are calibrated.
//!
//! Each film gives the head's motion up to its size and in a head frame of its own. At every moment all see the same head:
//! for the cameras `a` and `b`, with sizes `s` and the turn `R` and shift `t` between their head frames,
//! `R_b t + s_b t_b = R_ba s_a t_a + t_ba`, which is linear in `t`, `s_b` and `s_a`; `t_ba` is in metres.

use super::head_motion::HeadMotion;
use super::{MotionOptions, solve_motion};
use crate::calibrate::{CalibratedRig, MountedCamera};
use crate::faces::median;
use crate::{FacewrightError, Scale, Tracks};
use geometry::{Mat3, Progress, Transform, Vec3};
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};

/// Steps of the iteratively re-weighted solution.
const STEPS: usize = 10;
/// Groups of neighbouring frames of which one is left out in turn.
const GROUPS: usize = 8;
/// Fewest moments from which a size is told.
const FEWEST_MOMENTS: usize = 2 * GROUPS;
/// No size is believed to be known better than this, as part of it.
const LEAST_SIGMA: f64 = 1e-6;
/// Clips whose head rotations differ by a median of more than this do not show the same moments, degrees.
const OTHER_MOMENTS_DEG: f64 = 2.0;

/// The tracks of one camera's film.
#[derive(Clone, Debug)]
pub struct RigTracks {
    /// The camera's name in the rig.
    pub camera: String,
    /// Its tracks; the k-th frames of all cameras belong together.
    pub tracks: Tracks,
}

/// The head at one moment in two cameras.
struct Moment {
    a: Transform,
    b: Transform,
}

/// Solves for the motion that the first film shows; the other films give its size.
///
/// # Errors
/// Those of [`solve_motion`] for each film; [`FacewrightError::RigCamera`] for a camera that the rig does not have,
/// [`FacewrightError::RigPictures`] for films of different lengths, [`FacewrightError::RigMoments`] for films that show
/// other moments, or hardly any moment together.
pub fn solve_motion_on_rig(
    films: &[RigTracks],
    rig: &CalibratedRig,
    progress: &Progress,
) -> Result<HeadMotion, FacewrightError> {
    let [first, _, ..] = films else {
        return Err(FacewrightError::Option { name: "the clips of a rig", expected: "two or more" });
    };
    if films.iter().any(|film| film.tracks.frames.len() != first.tracks.frames.len()) {
        let counts = films.iter().map(|film| format!("{} of {}", film.tracks.frames.len(), film.camera));
        return Err(FacewrightError::RigPictures { counts: counts.collect::<Vec<_>>().join(", ") });
    }
    let cameras = films.iter().map(|film| mounted(rig, &film.camera)).collect::<Result<Vec<_>, _>>()?;
    let parts = progress.split_evenly(films.len());
    let solve = |((film, camera), part): ((&RigTracks, &&MountedCamera), &Progress)| {
        solve_motion(&film.tracks, Some(&camera.calibrated.camera), &MotionOptions::default(), part)
    };
    let mut motions = films.iter().zip(&cameras).zip(&parts).map(solve).collect::<Result<Vec<_>, _>>()?;
    let (mut weights, mut sum) = (0.0, 0.0);
    for k in 1..films.len() {
        let size = Pair::new([cameras[0], cameras[k]], [&motions[0], &motions[k]])?.size()?;
        // Films without any noise would weigh infinitely.
        let weight = 1.0 / size.1.max(LEAST_SIGMA).powi(2);
        (weights, sum) = (weights + weight, sum + weight * size.0);
    }
    let names = films.iter().map(|film| film.camera.as_str()).collect::<Vec<_>>().join(", ");
    let scale = Scale::measured(format!("positions of the cameras {names}"), (1.0 / weights).sqrt() / (sum / weights));
    let mut motion = motions.swap_remove(0);
    motion.resize(sum / weights, scale);
    Ok(motion)
}

fn mounted<'a>(rig: &'a CalibratedRig, name: &str) -> Result<&'a MountedCamera, FacewrightError> {
    rig.cameras.iter().find(|camera| camera.name == name).ok_or_else(|| FacewrightError::RigCamera {
        name: name.to_owned(),
        known: rig.cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", "),
    })
}

/// Two cameras and the moments at which both have a pose.
struct Pair<'a> {
    cameras: [&'a MountedCamera; 2],
    moments: Vec<Moment>,
}

impl<'a> Pair<'a> {
    fn new(cameras: [&'a MountedCamera; 2], motions: [&HeadMotion; 2]) -> Result<Self, FacewrightError> {
        let frames = motions[0].frames.iter().zip(&motions[1].frames);
        let moments: Vec<Moment> =
            frames.filter_map(|(a, b)| Some(Moment { a: a.cam_from_head?, b: b.cam_from_head? })).collect();
        let pair = Self { cameras, moments };
        let refused = |reason: String| {
            let [a, b] = cameras.map(|camera| camera.name.clone());
            Err(FacewrightError::RigMoments { a, b, reason })
        };
        if pair.moments.len() < FEWEST_MOMENTS {
            return refused(format!("only {} moments have a pose in both", pair.moments.len()));
        }
        let degrees = pair.disagreement_deg();
        if degrees > OTHER_MOMENTS_DEG {
            return refused(format!("the head's rotation differs between them by {degrees:.1}° (median)"));
        }
        Ok(pair)
    }

    /// `b_from_a` of the cameras, each moved a little from its calibrated place.
    fn b_from_a(&self, steps: [Vector6<f64>; 2]) -> Transform {
        let [a, b] = [0, 1].map(|k| self.cameras[k].mount.camera_from_rig.retract(&steps[k]));
        b * a.inverse()
    }

    /// Turn between the head frames that each moment tells: `head_b_from_head_a`.
    fn head_turns(&self) -> impl Iterator<Item = Mat3> {
        let turn = self.b_from_a([Vector6::zeros(); 2]).rotation;
        self.moments.iter().map(move |m| (m.b.rotation.inverse() * turn * m.a.rotation).into_inner())
    }

    /// Median angle of the moments' turns between the head frames from their mean, degrees.
    fn disagreement_deg(&self) -> f64 {
        let mean = Transform::from_matrix(&self.head_turns().sum(), Vec3::zeros());
        median(self.head_turns().map(|turn| Transform::from_matrix(&turn, Vec3::zeros()).angle_to(&mean).to_degrees()))
    }

    /// The factor that makes the first camera's motion metric, and its standard deviation: by groups of frames left out in
    /// turn (their errors last for many frames), and by what is not known of the cameras' places.
    fn size(&self) -> Result<(f64, f64), FacewrightError> {
        let still = [Vector6::zeros(); 2];
        let all = self.factor(&self.b_from_a(still), |_| true)?;
        let count = self.moments.len();
        let mut variance = 0.0;
        for group in 0..GROUPS {
            let without = self.factor(&self.b_from_a(still), |k| k * GROUPS / count != group)?;
            variance += (without - all).powi(2) * (GROUPS - 1) as f64 / GROUPS as f64;
        }
        for camera in 0..2 {
            for step in deviations(self.cameras[camera]) {
                let mut steps = still;
                steps[camera] = step;
                variance += (self.factor(&self.b_from_a(steps), |_| true)? - all).powi(2);
            }
        }
        Ok((all, variance.sqrt()))
    }

    /// The factor by the moments that take part, robustly.
    fn factor(&self, b_from_a: &Transform, takes_part: impl Fn(usize) -> bool) -> Result<f64, FacewrightError> {
        let chosen = self.moments.iter().enumerate().filter(|(k, _)| takes_part(*k));
        let rows: Vec<SMatrix<f64, 3, 5>> = chosen.map(|(_, moment)| row(moment, b_from_a)).collect();
        let mut weights = vec![1.0; rows.len()];
        let mut solution = SVector::<f64, 5>::zeros();
        for _ in 0..STEPS {
            let (mut normal, mut right) = (SMatrix::<f64, 5, 5>::zeros(), SVector::<f64, 5>::zeros());
            for (row, weight) in rows.iter().zip(&weights) {
                normal += row.transpose() * row * *weight;
                right += row.transpose() * b_from_a.translation * *weight;
            }
            solution = normal.cholesky().map(|factor| factor.solve(&right)).ok_or_else(|| self.undetermined())?;
            let off: Vec<f64> = rows.iter().map(|row| (row * solution - b_from_a.translation).norm()).collect();
            let usual = median(off.iter().copied()).max(1e-9);
            weights
                .iter_mut()
                .zip(&off)
                .for_each(|(weight, off)| *weight = 1.0 / (1.0 + (off / (2.0 * usual)).powi(2)));
        }
        Some(solution[4]).filter(|factor| factor.is_finite() && *factor > 0.0).ok_or_else(|| self.undetermined())
    }

    fn undetermined(&self) -> FacewrightError {
        let [a, b] = self.cameras.map(|camera| camera.name.clone());
        FacewrightError::RigMoments {
            a,
            b,
            reason: "together they do not determine how far away the head is".to_owned(),
        }
    }
}

/// The equations of a moment for the shift between the head frames, the size in `b` and the size in `a`.
fn row(moment: &Moment, b_from_a: &Transform) -> SMatrix<f64, 3, 5> {
    let mut row = SMatrix::<f64, 3, 5>::zeros();
    row.fixed_columns_mut::<3>(0).copy_from(moment.b.rotation.matrix());
    row.set_column(3, &moment.b.translation);
    row.set_column(4, &-(b_from_a.rotation * moment.a.translation));
    row
}

/// Independent steps, each a standard deviation long, by which a camera's place is uncertain; none for the rig's first.
fn deviations(camera: &MountedCamera) -> impl Iterator<Item = Vector6<f64>> {
    let covariance = Matrix6::from_fn(|i, j| camera.mount.covariance[i][j]);
    let eigen = covariance.symmetric_eigen();
    (0..6).map(move |k| eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt())
}
