//! Points of the face followed through the chosen frames.
//!
//! Corners are taken in a few reference frames and every other frame is searched for the *reference's* patch, warped as
//! the head's estimated pose and surface predict it: a template that is re-anchored cannot drift away over a sequence.

use super::search::{Anchors, FINEST_PX, REFERENCE_PX, Scene, SearchOptions, Seed, seeds};
use super::surface::{Surface, View};
use crate::FacewrightError;
use crate::faces::TrackedSkin;
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use rayon::prelude::*;

/// How points are followed.
#[derive(Clone, Debug)]
pub struct FollowOptions {
    /// Corners per reference frame.
    pub corners: usize,
    /// Yaws at which a reference frame is taken (the nearest chosen frame), degrees.
    pub reference_yaws_deg: Vec<f64>,
    /// A frame turned further than this from the reference is not searched, degrees.
    pub max_turn_deg: f64,
    /// Least number of frames a point must be found in.
    pub min_frames: usize,
    /// How it is sought.
    pub search: SearchOptions,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self {
            corners: 350,
            reference_yaws_deg: vec![0.0, -15.0, 15.0, -30.0, 30.0, -50.0, 50.0],
            max_turn_deg: 32.0,
            min_frames: 4,
            search: SearchOptions::default(),
        }
    }
}

/// A frame in which points are sought.
pub struct TrackedFrame<'a> {
    /// Its skin.
    pub skin: &'a TrackedSkin,
    /// Estimated pose.
    pub cam_from_head: Transform,
}

/// A point of the skin, seen in several frames.
#[derive(Clone, Debug)]
pub struct FaceTrack {
    /// Estimated place on the head, head frame, metres.
    pub point: Vec3,
    /// Frame, pixel, one standard deviation in pixels; ascending frames.
    pub observations: Vec<(usize, Vec2, f64)>,
}

/// Follows corners of the reference frames through all frames. `positions` and `triangles` are the head's skin as it is
/// known so far.
pub fn follow(
    frames: &[TrackedFrame],
    camera: &Camera,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &FollowOptions,
    progress: &Progress,
) -> Result<Vec<FaceTrack>, FacewrightError> {
    progress.stage("track")?;
    let surface = Surface::new(positions, triangles);
    let scenes: Vec<Scene> =
        frames.iter().map(|f| Scene { skin: f.skin, view: View::new(&surface, camera, f.cam_from_head) }).collect();
    let references = references(frames, options);
    let mut tracks = Vec::new();
    for (done, &reference) in references.iter().enumerate() {
        progress.step(done, references.len())?;
        tracks.extend(follow_from(reference, &scenes, options)?);
    }
    Ok(tracks)
}

/// The tracks of the corners of one frame.
fn follow_from(reference: usize, scenes: &[Scene], options: &FollowOptions) -> Result<Vec<FaceTrack>, FacewrightError> {
    let from = &scenes[reference];
    let cosine = options.search.least_cosine();
    let corners = options.search.corners(from, options.corners);
    let mut seeds = seeds(from, &from.skin.mask, &corners)?;
    seeds.retain(|seed| from.view.facing(&seed.point).is_some_and(|found| found > cosine));
    let near = |scene: &Scene| {
        scene.view.cam_from_head.angle_to(&from.view.cam_from_head).to_degrees() <= options.max_turn_deg
    };
    let others: Vec<usize> = (0..scenes.len()).filter(|&i| i != reference && near(&scenes[i])).collect();
    let anchors = Anchors::take(from, seeds, &options.search)?;
    let sightings: Result<Vec<_>, FacewrightError> =
        others.par_iter().map(|&i| anchors.search(&scenes[i], &options.search)).collect();
    let sightings = sightings?;
    let track = |(k, seed): (usize, &Seed)| {
        let mut observations: Vec<(usize, Vec2, f64)> = others
            .iter()
            .zip(&sightings)
            .filter_map(|(&i, found)| {
                found.sightings[k]
                    .filter(|s| s.outcome.is_usable() && s.sigma_px.is_finite())
                    .map(|s| (i, s.pixel, s.sigma_px.max(FINEST_PX)))
            })
            .collect();
        observations.push((reference, seed.pixel, REFERENCE_PX));
        observations.sort_by_key(|o| o.0);
        let point = from.view.surface.place(&seed.point);
        FaceTrack { point, observations }
    };
    let tracks = anchors.seeds.iter().enumerate().map(track);
    Ok(tracks.filter(|t| t.observations.len() >= options.min_frames).collect())
}

/// The chosen frame nearest to each wanted yaw, each once.
pub(crate) fn references(frames: &[TrackedFrame], options: &FollowOptions) -> Vec<usize> {
    let yaw = |i: usize| crate::faces::select::yaw_pitch(&frames[i].cam_from_head).0.to_degrees();
    let mut references = Vec::new();
    for wanted in &options.reference_yaws_deg {
        let nearest = (0..frames.len()).min_by(|&a, &b| (yaw(a) - wanted).abs().total_cmp(&(yaw(b) - wanted).abs()));
        let Some(nearest) = nearest.filter(|n| (yaw(*n) - wanted).abs() < 9.0) else { continue };
        if !references.contains(&nearest) {
            references.push(nearest);
        }
    }
    references
}
