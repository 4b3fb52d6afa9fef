//! Bench of `sequence`: the pose of every frame and the place of every point of a turning head, from observations alone.
//!
//! Both sides get the same observations, of which some are wrong, and the same camera, whose focal length is right or has to
//! be found. Ours is also told rough poses, as landmarks of a face tell them; the peer, COLMAP's incremental mapper, has no
//! way to be told them. Another way of ours is not told them either and begins, like the peer, with a pair of frames. All of
//! ours know the standard deviation of the noise, of which the peer knows nothing but what it is set to tolerate.
//!
//! Which observations belong to one point is known to both. The peer takes that as matches of pairs of frames, which it
//! first verifies; its time stands with and without that.

mod cases;
mod judge;

use crate::clock::timed;
use crate::feature::{Feature, Figure};
use crate::results::{Pixel, Run};
use geometry::{Camera, Progress, Transform, Vec2};
use motion::sequence::{PointTrack, Sequence, SequenceOptions, Sighting, reconstruct_sequence};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// How far the rough poses are believed, radians and metres, as `facewright motion` believes landmarks.
const LANDMARK_SIGMAS: (f64, f64) = (0.05, 0.3);

/// The bench.
pub struct SequenceBench;

/// Films of one kind.
#[derive(Serialize, Deserialize)]
pub struct Case {
    name: String,
    /// The camera, or what it is taken for.
    camera: Camera,
    /// Whether its focal length is to be found.
    refine_focal: bool,
    /// Noise of each coordinate of an observation.
    sigma_px: f64,
    /// Number of frames.
    frames: usize,
    /// Number of points.
    points: usize,
    films: Vec<Film>,
}

/// What is seen of one head.
#[derive(Serialize, Deserialize)]
struct Film {
    /// Frame, point and pixel of each observation.
    observations: Vec<(usize, usize, Pixel)>,
    /// `cam_from_head` of every frame as landmarks might tell it. Only one of our ways reads them.
    rough_poses: Vec<Transform>,
}

/// What only the judge knows of a film.
#[derive(Serialize, Deserialize)]
pub struct Truth {
    focal_px: f64,
    /// `cam_from_head` of every frame.
    poses: Vec<Transform>,
    points: Vec<[f64; 3]>,
    /// Whether each observation is wrong.
    wrong: Vec<bool>,
}

/// A motion with its points, in a frame and a unit of its own.
#[derive(Serialize, Deserialize)]
pub struct Answer {
    focal_px: f64,
    /// `cam_from_head` of every frame; none where it was not found.
    poses: Vec<Option<Transform>>,
    /// Every point; none where it was not placed.
    points: Vec<Option<[f64; 3]>>,
}

impl Feature for SequenceBench {
    type Inputs = Vec<Case>;
    /// Of each film of each case.
    type Truth = Vec<Vec<Truth>>;
    /// Of each film.
    type Answer = Vec<Answer>;

    fn inputs(_folder: &Path) -> anyhow::Result<(Self::Inputs, Self::Truth)> {
        Ok(cases::KINDS.iter().map(cases::Kind::case).unzip())
    }

    fn measure(inputs: &Self::Inputs, _folder: &Path) -> anyhow::Result<Vec<Run<Self::Answer>>> {
        let mut runs = Vec::new();
        for case in inputs {
            runs.push(measure(case, "", |film| options(case, film))?);
            runs.push(measure(case, "not told the poses", |film| not_told(options(case, film)))?);
            if case.frames > SequenceOptions::default().key_frames {
                runs.push(measure(case, "every frame a key frame", |film| all_key_frames(options(case, film)))?);
            }
        }
        Ok(runs)
    }

    fn figures(run: &Run<Self::Answer>, inputs: &Self::Inputs, truth: &Self::Truth) -> anyhow::Result<Vec<Figure>> {
        let Some(k) = inputs.iter().position(|case| case.name == run.case) else { return Ok(Vec::new()) };
        Ok(judge::figures(run, &inputs[k], &truth[k]))
    }
}

fn measure(case: &Case, setting: &str, options: impl Fn(&Film) -> SequenceOptions) -> anyhow::Result<Run<Vec<Answer>>> {
    let asked: Vec<_> = case.films.iter().map(|film| (tracks(case, film), options(film))).collect();
    let solve = |(tracks, options): &(Vec<PointTrack>, SequenceOptions)| {
        Ok(answer(reconstruct_sequence(tracks, &case.camera, options, &Progress::new())?))
    };
    let (all_ms, answers) = timed(|| asked.iter().map(solve).collect::<anyhow::Result<Vec<_>>>());
    // Nothing of ours comes before the motion.
    let times_ms = BTreeMap::from([("verify".to_owned(), 0.0), ("map".to_owned(), all_ms / case.films.len() as f64)]);
    let (name, task) = (case.name.clone(), "motion".to_owned());
    Ok(Run { case: name, task, setting: setting.to_owned(), times_ms, answer: answers? })
}

fn tracks(case: &Case, film: &Film) -> Vec<PointTrack> {
    let mut tracks = vec![PointTrack::default(); case.points];
    for &(frame, point, pixel) in &film.observations {
        tracks[point].observations.push(Sighting { frame, pixel: Vec2::from(pixel), sigma_px: case.sigma_px });
    }
    tracks
}

/// What `facewright motion` asks for.
fn options(case: &Case, film: &Film) -> SequenceOptions {
    SequenceOptions {
        frames: case.frames,
        initial_poses: Some(film.rough_poses.iter().copied().map(Some).collect()),
        initial_sigma_rad: LANDMARK_SIGMAS.0,
        initial_sigma_m: LANDMARK_SIGMAS.1,
        refine_focal: case.refine_focal,
        ..SequenceOptions::default()
    }
}

fn not_told(options: SequenceOptions) -> SequenceOptions {
    SequenceOptions { initial_poses: None, ..options }
}

fn all_key_frames(options: SequenceOptions) -> SequenceOptions {
    SequenceOptions { key_frames: options.frames, ..options }
}

fn answer(found: Sequence) -> Answer {
    Answer {
        focal_px: found.camera.fx,
        poses: found.poses.into_iter().map(Result::ok).collect(),
        points: found.points.into_iter().map(|point| point.map(Into::into)).collect(),
    }
}
