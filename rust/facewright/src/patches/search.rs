//! Points of the skin, seen in one frame, sought in another.
//!
//! The template is always the first frame's patch, warped as the head's pose and surface predict it. What neighbouring
//! points contradict is searched again where they put it ([`vision::correct`]).

use super::skin::TrackedSkin;
use super::surface::{SkinPoint, View};
use crate::FacewrightError;
use crate::frames::Octave;
use geometry::Vec2;
use image::GrayImage;
use nalgebra::Matrix2;
use vision::corners::{CornerOptions, detect};
use vision::correct::{Correction, GeometricOptions, Known, Match, Outcome, geometric};
use vision::track::{Guess, Status, Templates, Track, TrackOptions};

/// Standard deviation of a corner in the frame that defines it, pixels.
pub const REFERENCE_PX: f64 = 0.1;
/// Least standard deviation that is believed of a place found again, pixels.
pub const FINEST_PX: f64 = 0.05;
/// Least score of a corner, in variances of the noise: twice what noise alone gives.
const LEAST_SCORE: f64 = 0.3;
/// Least texture beyond noise that is tracked, squared grey levels per pixel.
const LEAST_TEXTURE: f64 = 0.3;

/// Side of a patch as part of the distance between the eyes.
const PATCH: f64 = 0.22;
/// Least and largest side of a patch, pixels.
const SIDES: [usize; 2] = [9, 31];

/// The octave in which a face is tracked, by the distance between its eyes, pixels: the first in which its patches are not too large.
pub fn octave(eyes_px: f64) -> Octave {
    Octave::bringing(PATCH * eyes_px, SIDES[1] as f64)
}

/// How points are chosen and sought.
#[derive(Clone, Debug)]
pub struct SearchOptions {
    /// Side of the patch as part of the distance between the eyes.
    pub patch: f64,
    /// Side of the patch, odd pixels, instead.
    pub window: Option<usize>,
    /// Pyramid levels used.
    pub levels: usize,
    /// The surface must face the camera within this angle in both frames, degrees.
    pub max_slant_deg: f64,
    /// Judge matches by their neighbours and search again those that fail.
    pub correct: bool,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self { patch: PATCH, window: None, levels: 2, max_slant_deg: 68.0, correct: true }
    }
}

impl SearchOptions {
    /// Window of the tracker, odd pixels, in proportion to the face unless it was given.
    pub fn window(&self, view: &View) -> usize {
        let eyes = 0.063 * view.camera.fx / view.cam_from_head.translation.z.max(1e-3);
        self.window.unwrap_or((((self.patch * eyes).round() as usize) | 1).clamp(SIDES[0], SIDES[1]))
    }

    /// The tracker of patches of a frame.
    pub fn tracker(&self, from: &Scene) -> TrackOptions {
        TrackOptions {
            window: self.window(&from.view),
            levels: self.levels,
            noise: from.skin.noise,
            min_texture: LEAST_TEXTURE,
            ..TrackOptions::default()
        }
    }

    /// Corners that can be sought: peaks of small windows, since the tracker's own window sums up more, that stand out of
    /// the noise.
    pub fn corners(&self, scene: &Scene, count: usize) -> CornerOptions {
        let (window, noise) = (self.window(&scene.view), scene.skin.noise);
        CornerOptions {
            max_count: count,
            window: ((window / 3) | 1).clamp(3, 7),
            min_distance: (0.25 * window as f64).max(3.0),
            quality: 0.0,
            min_score: LEAST_SCORE * noise * noise,
            ..CornerOptions::default()
        }
    }

    /// Least cosine between the skin's normal and the direction to the camera.
    pub fn least_cosine(&self) -> f64 {
        self.max_slant_deg.to_radians().cos()
    }
}

/// A frame with the head in it.
pub struct Scene<'a> {
    pub skin: &'a TrackedSkin,
    pub view: View<'a>,
}

/// A point of the skin in the frame it was chosen in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seed {
    pub pixel: Vec2,
    pub point: SkinPoint,
}

/// A seed in another frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Before the correction; none where the tracker gave the point up.
    pub tracked: Option<Vec2>,
    pub pixel: Vec2,
    pub sigma_px: f64,
    /// What the tracker said.
    pub status: Status,
    pub outcome: Outcome,
}

/// The seeds of one frame in another.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// One per seed; none where the head hides it, or shows it too much from the side.
    pub sightings: Vec<Option<Sighting>>,
    /// Flipped triangles before the correction …
    pub violations_before: usize,
    /// … and after it.
    pub violations_after: usize,
}

/// Corners of a frame within a mask, cast onto the head.
pub fn seeds(scene: &Scene, mask: &GrayImage, options: &CornerOptions) -> Result<Vec<Seed>, FacewrightError> {
    let corners = detect(&scene.skin.pyramid, Some(mask), options)?;
    let seed = |pixel: Vec2| Some(Seed { pixel, point: scene.view.cast(&pixel)? });
    Ok(corners.iter().filter_map(|corner| seed(corner.position)).collect())
}

/// Points of a frame with their patches, to be sought in any number of other frames.
pub struct Anchors<'a> {
    pub scene: &'a Scene<'a>,
    pub seeds: Vec<Seed>,
    templates: Templates<'a>,
}

impl<'a> Anchors<'a> {
    /// Takes the patches.
    pub fn take(scene: &'a Scene<'a>, seeds: Vec<Seed>, options: &SearchOptions) -> Result<Self, FacewrightError> {
        let points: Vec<Vec2> = seeds.iter().map(|seed| seed.pixel).collect();
        let templates = Templates::take(&scene.skin.pyramid, &points, &options.tracker(scene))?;
        Ok(Self { scene, seeds, templates })
    }

    /// Seeks the points in another frame.
    pub fn search(&self, to: &Scene, options: &SearchOptions) -> Result<Search, FacewrightError> {
        let (from, cosine) = (self.scene, options.least_cosine());
        let guess = |seed: &Seed| {
            to.view.facing(&seed.point).filter(|found| *found > cosine)?;
            from.view.predict(&seed.point, &seed.pixel, &to.view)
        };
        let expected: Vec<Option<Guess>> = self.seeds.iter().map(guess).collect();
        // A patch squeezed to nothing is given up at once.
        let nowhere = Guess { position: Vec2::zeros(), warp: Matrix2::zeros() };
        let all: Vec<Guess> = expected.iter().map(|guess| guess.unwrap_or(nowhere)).collect();
        let all = self.templates.track(&to.skin.pyramid, Some(&all))?;
        let (wanted, guesses): (Vec<usize>, Vec<Guess>) =
            expected.iter().enumerate().filter_map(|(i, guess)| Some((i, (*guess)?))).unzip();
        let points: Vec<Vec2> = wanted.iter().map(|&i| self.seeds[i].pixel).collect();
        let tracked: Vec<Track> = wanted.iter().map(|&i| all[i]).collect();
        let correction = corrected(from, to, &points, &guesses, &tracked, options)?;
        let mut sightings = vec![None; self.seeds.len()];
        for (k, &i) in wanted.iter().enumerate() {
            let found = correction.matches[k].b;
            sightings[i] = Some(Sighting {
                tracked: (tracked[k].status == Status::Found).then_some(tracked[k].position),
                pixel: if found.x.is_finite() { found } else { tracked[k].position },
                sigma_px: tracked[k].sigma_px,
                status: tracked[k].status,
                outcome: correction.outcomes[k],
            });
        }
        let Correction { violations_before, violations_after, .. } = correction;
        Ok(Search { sightings, violations_before, violations_after })
    }
}

/// What neighbouring points and a second search make of tracked points.
fn corrected(
    from: &Scene,
    to: &Scene,
    points: &[Vec2],
    guesses: &[Guess],
    tracked: &[Track],
    options: &SearchOptions,
) -> Result<Correction, FacewrightError> {
    let matches: Vec<Match> = points.iter().zip(tracked).map(found).collect();
    if !options.correct {
        return Ok(Correction::unchanged(&matches));
    }
    // Two searches from different sides, or the neighbours, vouch for what is found: it need not track back.
    let search = TrackOptions { levels: 1, forward_backward_px: None, ..options.tracker(from) };
    let known = Known { predictions: Some(guesses), ..Known::default() };
    let geometric_options = GeometricOptions { search: Some(search), ..GeometricOptions::default() };
    Ok(geometric(&from.skin.pyramid, &to.skin.pyramid, &matches, &known, &geometric_options)?)
}

fn found((point, track): (&Vec2, &Track)) -> Match {
    if track.status == Status::Found { Match { a: *point, b: track.position } } else { Match::missing(*point) }
}
