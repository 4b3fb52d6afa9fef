//! The motion that the films of several cameras show at once, the cameras' places being known: one pose for each moment, in metres.

use super::rigid::{Judged, judge};
use super::scale::Size;
use super::{MotionOptions, Problem, report};
use crate::clock::Clock;
use crate::faces::{Clip, KnownHead, median};
use crate::{CalibratedRig, FacewrightError, HeadMotion, Region, Scale, Tracks};
use geometry::{Mat3, Progress, Transform, Vec3};
use motion::rig::{Place, RigOptions, RigSequence, reconstruct_rig};
use motion::sequence::PointTrack;
use nalgebra::Matrix6;

/// Moments at most that the points are solved from.
const KEY_MOMENTS: usize = 64;
/// Rays of a point part by this angle at least, radians.
const LEAST_PARALLAX_RAD: f64 = 0.035;
/// Cameras must see the head from directions that part by this much, degrees: where they took one picture each …
const LEAST_ANGLE_DEG: f64 = 6.0;
/// … and where the head turns, so that they need tell its size only.
const LEAST_ANGLE_OF_FILMS_DEG: f64 = 2.0;
/// Clips whose head rotations, by their landmarks, differ by a median of more than this do not show the same moments, degrees.
const OTHER_MOMENTS_DEG: f64 = 4.0;
/// Nor do those of which no more than this part of the points agrees with one motion.
const LEAST_AGREEMENT: f64 = 0.3;

/// Cameras of a rig with a film each: the frames of the first one, then those of the second, and so on.
pub(crate) struct Rig {
    names: Vec<String>,
    places: Vec<Place>,
    /// Frames of each film.
    moments: usize,
}

impl Rig {
    /// The cameras of these names.
    ///
    /// # Errors
    /// [`FacewrightError::RigCamera`] for a camera that the rig does not have.
    pub fn new(rig: &CalibratedRig, names: &[&str], moments: usize) -> Result<Self, FacewrightError> {
        let place = |name: &&str| {
            let mount = rig.camera(name)?.mount;
            let covariance = Matrix6::from_fn(|i, j| mount.covariance[i][j]);
            Ok(Place { camera_from_rig: mount.camera_from_rig, covariance })
        };
        let places = names.iter().map(place).collect::<Result<_, FacewrightError>>()?;
        Ok(Self { names: names.iter().map(|name| (*name).to_owned()).collect(), places, moments })
    }

    /// Refuses what shows no depth, or not the same moments, before anything is tracked.
    ///
    /// # Errors
    /// [`FacewrightError::RigNarrow`], [`FacewrightError::RigMoments`].
    pub fn check(&self, clip: &Clip) -> Result<(), FacewrightError> {
        let others = 1..self.places.len();
        let mut widest = 0.0_f64;
        for (a, b) in others.flat_map(|b| (0..b).map(move |a| (a, b))) {
            let b_from_a = self.places[b].camera_from_rig * self.places[a].camera_from_rig.inverse();
            let both = |moment: usize| Some((self.pose(&clip.known, a, moment)?, self.pose(&clip.known, b, moment)?));
            let both: Vec<(Transform, Transform)> = (0..self.moments).filter_map(both).collect();
            let angle = median(both.iter().map(|(in_a, _)| angle_deg(in_a, &b_from_a)));
            widest = widest.max(angle);
            let off = disagreement_deg(&both, &b_from_a);
            if off > OTHER_MOMENTS_DEG {
                return Err(self.other_moments(
                    a,
                    b,
                    format!("the head's rotation differs between them by {off:.1}° (median)"),
                ));
            }
        }
        let least = if self.moments == 1 { LEAST_ANGLE_DEG } else { LEAST_ANGLE_OF_FILMS_DEG };
        if widest < least { Err(FacewrightError::RigNarrow { degrees: widest }) } else { Ok(()) }
    }

    fn pose(&self, known: &KnownHead, camera: usize, moment: usize) -> Option<Transform> {
        known.pose(camera * self.moments + moment)
    }

    fn other_moments(&self, a: usize, b: usize, reason: String) -> FacewrightError {
        FacewrightError::RigMoments { a: self.names[a].clone(), b: self.names[b].clone(), reason }
    }
}

/// Angle between the directions from which a camera and another one see a head, degrees.
fn angle_deg(a_from_head: &Transform, b_from_a: &Transform) -> f64 {
    let (to_a, to_b) = (-a_from_head.translation, b_from_a.inverse().translation - a_from_head.translation);
    to_a.angle(&to_b).to_degrees()
}

/// Median angle of the moments' turns between the head frames in two cameras from their mean, degrees.
fn disagreement_deg(both: &[(Transform, Transform)], b_from_a: &Transform) -> f64 {
    let turn = |(a, b): &(Transform, Transform)| (b.rotation.inverse() * b_from_a.rotation * a.rotation).into_inner();
    let mean = Transform::from_matrix(&both.iter().map(turn).sum::<Mat3>(), Vec3::zeros());
    let off = |both: &(Transform, Transform)| Transform::from_matrix(&turn(both), Vec3::zeros()).angle_to(&mean);
    median(both.iter().map(|both| off(both).to_degrees()))
}

/// Solves for the poses of all moments, and so of all frames, and the places of all points.
///
/// # Errors
/// [`motion::MotionError::FewShared`], [`FacewrightError::RigMoments`], [`FacewrightError::TooFewUsable`],
/// [`FacewrightError::Cancelled`].
pub(crate) fn solve_on_films(tracks: &Tracks, rig: &Rig, progress: &Progress) -> Result<HeadMotion, FacewrightError> {
    let mut clock = Clock::start();
    let mut problem = Problem::new(tracks, tracks.camera);
    // At one moment nothing moves.
    let is_still = rig.moments == 1;
    problem.fewest_frames = if is_still { 2 } else { problem.fewest_frames };
    let skin: Vec<bool> = tracks.tracks.iter().map(|track| is_still || track.region == Region::Skin).collect();
    let [before, after] = progress.split(&[1.0, 1.0]);
    let first = solve(&problem, tracks, rig, &skin, &before)?;
    let judged = judge(&problem.tracks, &first.sequence, problem.options.threshold_px);
    clock.lap("skin");
    let rigid: Vec<bool> = judged.iter().map(|judged| *judged == Judged::Rigid).collect();
    let last = solve(&problem, tracks, rig, &rigid, &after)?;
    clock.lap("motion");
    let scale = Scale::measured(format!("positions of the cameras {}", rig.names.join(", ")), last.size_sigma);
    let options = MotionOptions::default();
    let known = Some(Size { factor: 1.0, scale });
    let motion = report::report(tracks, &problem, last.sequence, &judged, (&options, known), clock)?;
    if motion.rigid_agreement < LEAST_AGREEMENT {
        let part = 100.0 * motion.rigid_agreement;
        return Err(rig.other_moments(0, 1, format!("only {part:.0} % of the tracked points fit a single motion")));
    }
    progress.done()?;
    Ok(motion)
}

fn solve(
    problem: &Problem,
    tracks: &Tracks,
    rig: &Rig,
    takes_part: &[bool],
    progress: &Progress,
) -> Result<RigSequence, FacewrightError> {
    let chosen = |(track, part): (&PointTrack, &bool)| if *part { track.clone() } else { PointTrack::default() };
    let chosen: Vec<PointTrack> = problem.tracks.iter().zip(takes_part).map(chosen).collect();
    let options = RigOptions {
        places: rig.places.clone(),
        moments: rig.moments,
        initial_poses: tracks.frames.iter().map(|frame| frame.cam_from_head).collect(),
        model: tracks.tracks.iter().map(|track| track.place.map(Vec3::from)).collect(),
        threshold_px: problem.options.threshold_px,
        min_parallax_rad: LEAST_PARALLAX_RAD,
        key_moments: KEY_MOMENTS,
    };
    Ok(reconstruct_rig(&chosen, &problem.camera.camera, &options, progress)?)
}
