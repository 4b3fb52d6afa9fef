//! The pose of the head in every frame and a metric cloud of its points, from tracks.
//!
//! # Entry points
//! - [`solve_motion`] with [`MotionOptions`]; [`HeadMotion`] is what `motion.json` holds.
//! - [`solve_motion_on_rig`]: the same with the size that the places of several cameras give.
//! - [`solve_on_films`]: all films of a rig at once, as `reconstruct` takes them.
//!
//! # Conventions
//! Those of [`geometry`]; the head frame is that of the landmarks' head, placed by the poses of the tracks.
//!
//! # Order of work
//! Skin alone gives a first motion; without a calibrated camera a second one, of all that has a place on the head, gives the focal length:
//! who talks contradicts every focal length, and tracks chosen by one would confirm it. Every track is judged by that motion over the whole
//! sequence, so that lips, lids and brows take part where they are still and are left out where they talk (`rigid`); what is rigid gives
//! the motion; then the size (`scale`) and what is said of it (`report`).

mod films;
mod frames;
mod head_motion;
mod report;
mod rig;
mod rigid;
mod scale;

use crate::camera::{contradicted_exif, lens_prior, usual_focal, usual_lens};
use crate::clock::Clock;
use crate::faces::{LANDMARK_SIGMA_RAD, check_turn};
use crate::patches::threshold_px;
use crate::{CameraSource, FacewrightError, Region, SizeOptions, SourcedCamera, Tracks};
use clap::Args;
pub(crate) use films::{Rig, solve_on_films};
use geometry::{Camera, Progress, Transform};
pub use head_motion::{FrameMotion, HeadMotion, PointMotion, Roughness};
use motion::bundle::{FocalPrior, PointPrior};
use motion::sequence::{PointTrack, Sequence, SequenceOptions, Sighting, reconstruct_sequence};
pub use rig::{RigTracks, solve_motion_on_rig};
use rigid::{Judged, judge};
use serde::{Deserialize, Serialize};

/// Standard deviation of the landmarks' positions along each axis, metres: they hold nothing but the frame of the head.
pub(crate) const LANDMARK_SIGMA_M: f64 = 0.3;
/// Standard deviation of the landmarks' head under a point, metres: it constrains what a narrow range of yaw leaves open.
pub(crate) const SURFACE_SIGMA_M: f64 = 0.006;

/// Frames that the first solution takes its structure from: enough to tell which tracks move with the skull.
const FIRST_KEY_FRAMES: usize = 48;

/// Times of the solutions, in parts: the skin's, that of all tracks, which finds the focal length, and that of all that is rigid …
const PARTS: [f64; 3] = [25.0, 55.0, 20.0];
/// … where the focal length is known.
const CALIBRATED: [f64; 3] = [50.0, 0.0, 50.0];

/// How [`solve_motion`] works.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct MotionOptions {
    /// What is known of the head's size.
    #[command(flatten)]
    #[serde(flatten)]
    pub size: SizeOptions,
}

impl MotionOptions {
    /// Refuses sizes that no head has.
    ///
    /// # Errors
    /// [`FacewrightError::Option`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        self.size.validate()
    }
}

/// Solves for the poses of all frames and the positions of all points; with a calibrated `camera` instead of that of the tracks.
///
/// # Errors
/// - [`FacewrightError::NoFace`], [`FacewrightError::OneFrame`], [`FacewrightError::NoRotation`],
///   [`FacewrightError::OnlyZoom`]: the clip shows no depth.
/// - [`FacewrightError::OtherCamera`], [`FacewrightError::Option`], [`FacewrightError::Length`],
///   [`FacewrightError::NoPupils`]: what was given beside the tracks does not fit.
/// - [`FacewrightError::TooFewUsable`], [`motion::MotionError`]: tracks and poses do not fit together.
/// - [`FacewrightError::Cancelled`].
///
/// # Examples
/// ```no_run
/// use facewright::{MotionOptions, Tracks, solve_motion};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let tracks = Tracks::read(Path::new("tracks.json"))?;
/// let motion = solve_motion(&tracks, None, &MotionOptions::default(), &Progress::new())?;
/// for frame in &motion.frames {
///     match &frame.cam_from_head {
///         Some(pose) => println!("{}: the head is {:.3} m away", frame.name, pose.translation.norm()),
///         None => println!("{}: {}", frame.name, frame.reason),
///     }
/// }
/// motion.write(Path::new("motion.json"))?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn solve_motion(
    tracks: &Tracks,
    camera: Option<&SourcedCamera>,
    options: &MotionOptions,
    progress: &Progress,
) -> Result<HeadMotion, FacewrightError> {
    let mut clock = Clock::start();
    let camera = usual_lens(known_or_tracked(camera, tracks)?);
    check(tracks, options)?;
    let mut problem = Problem::new(tracks, camera);
    let refine = problem.options.refine_focal;
    let [before, lens, after] = progress.split(if refine { &PARTS } else { &CALIBRATED });
    let skin: Vec<bool> = tracks.tracks.iter().map(|track| track.region == Region::Skin).collect();
    let mut found = problem.solve(&skin, Round::First, &before)?;
    let mut judged = judge(&problem.tracks, &found, problem.options.threshold_px);
    clock.lap("skin");
    if refine {
        let placed: Vec<bool> = judged.iter().map(|judged| *judged != Judged::Lost).collect();
        found = problem.lens(&placed, &found, &lens)?;
        judged = judge(&problem.tracks, &found, problem.options.threshold_px);
        clock.lap("lens");
    }
    let rigid: Vec<bool> = judged.iter().map(|judged| *judged == Judged::Rigid).collect();
    let last = problem.solve(&rigid, Round::Last(&found), &after)?;
    let (focal_sigma_px, is_lens_free) = (found.focal_sigma_px, found.is_lens_free);
    let last = Sequence { focal_sigma_px, is_lens_free, anchored: last.anchored && found.anchored, ..last };
    clock.lap("motion");
    let motion = report::report(tracks, &problem, last, &judged, (options, None), clock)?;
    progress.done()?;
    Ok(motion)
}

/// Refuses what cannot be solved before anything is.
fn check(tracks: &Tracks, options: &MotionOptions) -> Result<(), FacewrightError> {
    options.validate()?;
    let poses: Vec<Transform> = tracks.frames.iter().filter_map(|frame| frame.cam_from_head).collect();
    match poses.len() {
        0 => Err(FacewrightError::NoFace { frames: tracks.frames.len() }),
        1 => Err(FacewrightError::OneFrame),
        _ => check_turn(&poses),
    }
}

/// The camera to start with: a calibrated one, or that of the tracks.
fn known_or_tracked(known: Option<&SourcedCamera>, tracks: &Tracks) -> Result<SourcedCamera, FacewrightError> {
    let Some(known) = known else { return Ok(tracks.camera) };
    let (own, of_tracks) = (&known.camera, &tracks.camera.camera);
    if (own.width, own.height) != (of_tracks.width, of_tracks.height) {
        return Err(FacewrightError::OtherCamera {
            camera_width: own.width,
            camera_height: own.height,
            width: of_tracks.width,
            height: of_tracks.height,
        });
    }
    Ok(*known)
}

/// Tracks as the solver takes them, and what holds for every solution.
struct Problem {
    tracks: Vec<PointTrack>,
    /// The landmarks' pose of each frame.
    poses: Vec<Option<Transform>>,
    camera: SourcedCamera,
    options: SequenceOptions,
    /// A point in fewer frames tells no shape.
    fewest_frames: usize,
}

/// Which solution is wanted, and the one before.
#[derive(Clone, Copy)]
enum Round<'a> {
    /// From the landmarks' poses.
    First,
    /// For the focal length and its deviation.
    Lens(&'a Sequence),
    /// With the camera of the one before.
    Last(&'a Sequence),
}

/// A point of one camera's film in fewer frames than this tells no shape.
const LEAST_SEEN: usize = 3;

impl Problem {
    fn new(tracks: &Tracks, camera: SourcedCamera) -> Self {
        let poses: Vec<Transform> = tracks.frames.iter().filter_map(|frame| frame.cam_from_head).collect();
        let sighting = |&crate::PointObservation { frame, pixel, sigma_px }: &_| Sighting { frame, pixel, sigma_px };
        let solver = SequenceOptions {
            frames: tracks.frames.len(),
            initial_sigma_rad: LANDMARK_SIGMA_RAD,
            initial_sigma_m: LANDMARK_SIGMA_M,
            threshold_px: threshold_px(&poses, &camera.camera),
            refine_focal: camera.source != CameraSource::Board,
            focal_prior: Some(usual_focal(&camera.camera)),
            lens_prior: lens_prior(&camera),
            point_priors: point_priors(tracks),
            ..SequenceOptions::default()
        };
        let of_track =
            |track: &crate::PointTrack| PointTrack { observations: track.observations.iter().map(sighting).collect() };
        let of_tracks = tracks.tracks.iter().map(of_track).collect();
        let poses = tracks.frames.iter().map(|frame| frame.cam_from_head).collect();
        Self { tracks: of_tracks, poses, camera, options: solver, fewest_frames: LEAST_SEEN }
    }

    /// The motion by the tracks that take part; points keep the numbers of all tracks.
    fn solve(&self, takes_part: &[bool], round: Round<'_>, progress: &Progress) -> Result<Sequence, FacewrightError> {
        let chosen = |(track, part): (&PointTrack, &bool)| if *part { track.clone() } else { PointTrack::default() };
        let tracks: Vec<PointTrack> = self.tracks.iter().zip(takes_part).map(chosen).collect();
        let (options, camera) = self.round(round);
        Ok(reconstruct_sequence(&tracks, &camera, &options, progress)?)
    }

    /// For the focal length: that which EXIF tells helps unless the head's motion contradicts it.
    fn lens(
        &mut self,
        takes_part: &[bool],
        before: &Sequence,
        progress: &Progress,
    ) -> Result<Sequence, FacewrightError> {
        if self.camera.source != CameraSource::Exif {
            return self.solve(takes_part, Round::Lens(before), progress);
        }
        let [alone, with_exif] = progress.split(&[1.0, 1.0]);
        let found = self.solve(takes_part, Round::Lens(before), &alone)?;
        let (exif_px, sigma_px) = (self.camera.camera.fx, found.focal_sigma_px.unwrap_or(0.0));
        if contradicted_exif(&self.camera, found.camera.fx, sigma_px).is_some() {
            self.camera.source = CameraSource::Estimated;
            return Ok(found);
        }
        let log_sigma = CameraSource::Exif.focal_sigma();
        self.options.focal_prior = Some(FocalPrior { focal_px: exif_px, log_sigma });
        self.solve(takes_part, Round::Lens(&found), &with_exif)
    }

    fn round(&self, round: Round<'_>) -> (SequenceOptions, Camera) {
        let options = SequenceOptions { initial_poses: Some(self.poses.clone()), ..self.options.clone() };
        let poses = |of: &Sequence| of.poses.iter().map(|pose| pose.as_ref().ok().copied()).collect::<Vec<_>>();
        match round {
            Round::First => {
                let start = SequenceOptions { key_frames: FIRST_KEY_FRAMES, focal_sigma: false, ..options };
                (start, self.camera.camera)
            }
            Round::Lens(before) => (SequenceOptions { start_poses: Some(poses(before)), ..options }, before.camera),
            Round::Last(before) => {
                let options = SequenceOptions { start_poses: Some(poses(before)), refine_focal: false, ..options };
                (options, before.camera)
            }
        }
    }
}

/// Where points are on the landmarks' head.
fn point_priors(tracks: &Tracks) -> Vec<PointPrior> {
    let placed = tracks.tracks.iter().enumerate().filter_map(|(k, track)| Some((k, track.place?)));
    placed.map(|(k, place)| PointPrior::near(k, place.into(), SURFACE_SIGMA_M)).collect()
}
