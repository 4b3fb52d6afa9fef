//! Whole sequences: corners of a few reference frames, found again in every frame.
//!
//! Every frame is searched for the *reference's* patch, warped as the landmarks' head, pose and expression predict it:
//! nothing is handed on from frame to frame, so nothing drifts, and a point that was hidden is found again when it comes
//! back. Frames are read a few at a time; a long clip never stands in memory.

use super::chain::chain;
use super::findings::{Finding, Findings, Loss};
use super::region::region;
use super::relay::relay;
use super::{DisabledPoint, FrameTracks, PointObservation, PointTrack, Tracks};
use crate::camera::starting_camera;
use crate::faces::{Clip, FaceOptions, Known, KnownHead, qualities, yaw_pitch};
use crate::frames::Octave;
use crate::patches::{
    Anchors, Hair, REFERENCE_PX, Scene, Search, SearchOptions, Seed, SkinPoint, Surface, TrackedSkin, View, seeds,
};
use crate::reason::{FrameReason, Told};
use crate::{Assets, CameraSource, Faces, FacewrightError, FrameSet, Method, Schema, SizeOptions, SourcedCamera};
use clap::Args;
use geometry::mesh::at_barycentric;
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use head::fit::eye_centres;
use image::{GrayImage, Luma};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use vision::track::TrackError;

/// Frames that are in memory at the same time, besides the reference frames.
pub(super) const CHUNK: usize = 16;
/// Yaws at which a reference frame is taken, degrees; the first one gets the most points.
const REFERENCE_YAWS_DEG: [f64; 7] = [0.0, -15.0, 15.0, -30.0, 30.0, -50.0, 50.0];
/// A reference frame is at most so far from its yaw, degrees.
const REFERENCE_REACH_DEG: f64 = 9.0;
/// A frame that is blurred, covered or full of expression is taken only where others are farther off by this, degrees.
const UNFIT_DEG: f64 = 20.0;
/// A frame turned further than this from a reference is not searched for its points, degrees: with the head that landmarks give …
const FARTHEST_TURN_DEG: f64 = 34.0;
/// … and with a measured one, which predicts how patches are warped.
const FARTHEST_TURN_MEASURED_DEG: f64 = 40.0;

/// Points are chosen so far from hair, pixels of what is tracked in: a corner's own window.
const HAIR_MARGIN: i64 = 3;

/// Times of the steps of [`track`], in parts: faces, tracks.
const PARTS: [f64; 2] = [50.0, 50.0];
/// Those of tracking: corners of the reference frames, the search for them, and relays where there are any.
const TRACKING: [f64; 2] = [5.0, 45.0];
const RELAYING: f64 = 50.0;

/// How a sequence is tracked.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct TrackClipOptions {
    /// Chain of steps
    #[arg(long, value_enum, default_value_t)]
    pub method: Method,
    /// Number of points wanted in each reference frame, found again or new
    #[arg(long, default_value_t = Self::default().points)]
    pub points: usize,
    /// Window of the tracker, pixels, odd (default: 7 for the paper's method, otherwise in proportion to the face)
    #[arg(long)]
    pub window: Option<usize>,
    /// Choose points only in this frame, given by its name without extension
    #[arg(long, value_name = "FRAME")]
    pub from: Option<String>,
    /// Whose face it is.
    #[command(flatten)]
    #[serde(flatten)]
    pub person: FaceOptions,
}

impl Default for TrackClipOptions {
    fn default() -> Self {
        Self { method: Method::Default, points: 200, window: None, from: None, person: FaceOptions::default() }
    }
}

impl TrackClipOptions {
    /// Refuses numbers of points and windows with which nothing can be tracked. Whether the frame exists, its clip tells.
    ///
    /// # Errors
    /// [`FacewrightError::Option`], [`TrackError::Window`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        check_points(self.points)?;
        check_window(self.window)
    }
}

/// Refuses as many points as no face has, or too few for a motion.
pub(super) fn check_points(points: usize) -> Result<(), FacewrightError> {
    let is_sensible = (8..=5000).contains(&points);
    is_sensible.then_some(()).ok_or(FacewrightError::Option { name: "the number of points", expected: "8 to 5000" })
}

/// Refuses a window that the tracker does not have, before anything is read.
pub(super) fn check_window(window: Option<usize>) -> Result<(), FacewrightError> {
    match window.filter(|w| !(3..=31).contains(w) || w.is_multiple_of(2)) {
        Some(window) => Err(TrackError::Window(window).into()),
        None => Ok(()),
    }
}

/// Tracks points of the face through a sequence. Frames are in the order of time; without a
/// `camera` the focal length is estimated, without `faces` they are found.
///
/// # Examples
/// ```no_run
/// use facewright::{Assets, Faces, FrameSet, TrackClipOptions, track};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let frames = FrameSet::open(&["clip.mp4".into()], &progress)?;
/// let assets = Assets::load(&Assets::default_folder())?;
/// let faces = Faces::read(Path::new("faces.json"))?;
/// let tracks = track(&frames, &assets, None, Some(&faces), &TrackClipOptions::default(), &progress)?;
/// for point in &tracks.tracks {
///     println!("point {} was found in {} frames", point.id, point.observations.len());
/// }
/// tracks.write(Path::new("tracks.json"))?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn track(
    frames: &FrameSet,
    assets: &Assets,
    camera: Option<&SourcedCamera>,
    faces: Option<&Faces>,
    options: &TrackClipOptions,
    progress: &Progress,
) -> Result<Tracks, FacewrightError> {
    if frames.len() < 2 {
        return Err(FacewrightError::OneFrame);
    }
    options.validate()?;
    let camera = starting_camera(frames, camera)?;
    let [looking, tracking] = progress.split_steps(&PARTS);
    let known = Known { faces, camera: &camera, size: &SizeOptions::default(), person: &options.person };
    let clip = Clip::look(frames, assets, &known, &looking)?;
    track_head(&clip, &clip.known, camera.source, options, Corners::New, &tracking)
}

/// How many steps [`track()`] counts in its progress.
pub const TRACK_STEPS: usize = 2;

/// Which corners a reference frame gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corners<'a> {
    /// Those that no reference frame before it has given.
    New,
    /// As many as if it were the only one, on a head that was measured: a place that several have chosen is measured several times.
    /// Within a window of these places nothing is chosen, and nothing found: an artist has said that points go wrong there.
    All(&'a [DisabledPoint]),
}

impl<'a> Corners<'a> {
    fn farthest_turn_deg(self) -> f64 {
        match self {
            Self::New => FARTHEST_TURN_DEG,
            Self::All(_) => FARTHEST_TURN_MEASURED_DEG,
        }
    }

    /// The places of a frame that are left out.
    fn disabled(self, frame: usize) -> impl Iterator<Item = &'a Vec2> {
        let all = if let Self::All(disabled) = self { disabled } else { &[] };
        all.iter().filter(move |point| point.frame == frame).map(|point| &point.pixel)
    }
}

/// Tracks points of a head that is known, about where it is known to be in each frame.
pub fn track_head(
    clip: &Clip,
    known: &KnownHead,
    source: CameraSource,
    options: &TrackClipOptions,
    corners: Corners<'_>,
    progress: &Progress,
) -> Result<Tracks, FacewrightError> {
    let sequence = Sequence::new(clip, known, options, corners)?;
    progress.stage("track")?;
    let (window, findings) = match options.method {
        Method::Default => sequence.follow(progress)?,
        Method::Paper => chain(&sequence, progress)?,
    };
    progress.done()?;
    Ok(sequence.report(SourcedCamera { camera: known.camera, source }, window, &findings))
}

/// What tracking works on.
pub(super) struct Sequence<'a> {
    pub clip: &'a Clip<'a>,
    pub options: &'a TrackClipOptions,
    corners: Corners<'a>,
    known: &'a KnownHead,
    triangles: Vec<[u32; 3]>,
    /// What is tracked in: places found are the octave's until they are reported …
    octave: Octave,
    /// … and its lens.
    camera: Camera,
    pub search: SearchOptions,
    /// How good each frame is to choose points in, or why it is not.
    quality: Vec<Result<f64, FrameReason>>,
    /// Standard deviation of the noise in frames that nobody looked at, grey levels.
    noise: f64,
}

/// A frame in memory.
pub(super) struct Shot {
    pub index: usize,
    pub skin: TrackedSkin,
    pose: Transform,
    /// The head with the frame's expression.
    positions: Vec<Vec3>,
}

/// A frame in which points were chosen.
pub(super) struct Reference<'a> {
    index: usize,
    pub anchors: Anchors<'a>,
    /// Number of its first point.
    pub first: usize,
}

impl<'a> Sequence<'a> {
    fn new(
        clip: &'a Clip<'a>,
        known: &'a KnownHead,
        options: &'a TrackClipOptions,
        corners: Corners<'a>,
    ) -> Result<Self, FacewrightError> {
        let search = SearchOptions { window: options.window, ..SearchOptions::default() };
        let quality = qualities(clip);
        // The paper's windows, and those that are asked for, are the picture's.
        let is_free = options.method == Method::Default && options.window.is_none();
        let octave = if is_free { clip.octave } else { Octave::default() };
        let (camera, triangles) = (octave.camera(&known.camera), clip.head.outer_skin());
        let mut sequence =
            Self { clip, options, corners, known, triangles, octave, camera, search, quality, noise: 0.0 };
        if let Some(&first) = sequence.references()?.first() {
            sequence.noise = sequence.shoot(first)?.map_or(0.0, |shot| shot.skin.noise);
        }
        Ok(sequence)
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.clip.frames.len()
    }

    /// Part of the face that a pixel of the octave shows in a frame.
    pub fn region(&self, index: usize, pixel: &Vec2) -> super::Region {
        self.clip.faces.face(index).map_or(super::Region::Skin, |face| region(face, &self.octave.outside(pixel)))
    }

    /// The places of the octave that are left out in a frame.
    fn disabled(&self, index: usize) -> impl Iterator<Item = Vec2> {
        self.corners.disabled(index).map(|pixel| self.octave.inside(pixel))
    }

    /// Where a place of the skin is when the face is at rest, head frame, metres.
    pub fn place(&self, point: &SkinPoint) -> Vec3 {
        at_barycentric(&self.known.positions, &point.triangle, &point.weights)
    }

    /// Reads a frame; `None` where the head is not known to be.
    pub fn shoot(&self, index: usize) -> Result<Option<Shot>, FacewrightError> {
        let Some(known) = &self.known.frames[index] else { return Ok(None) };
        let pyramid = self.clip.frames.pyramid(index, self.octave)?;
        let skin = match self.clip.faces.face(index) {
            Some(face) => TrackedSkin::of(pyramid, &self.octave.face(face)),
            None => TrackedSkin::sought(pyramid, self.noise),
        };
        let positions = match self.corners {
            Corners::New => self.clip.head.with_expression(&self.known.positions, &known.expression),
            // Quiet faces were chosen: what landmarks make of their expressions is mostly jitter.
            Corners::All(_) => self.known.positions.clone(),
        };
        Ok(Some(Shot { index, skin, pose: known.cam_from_head, positions }))
    }

    /// Frames in which points are chosen: the one that was asked for, or the best near each yaw.
    pub fn references(&self) -> Result<Vec<usize>, FacewrightError> {
        let is_seen = |&i: &usize| self.known.frames[i].is_some() && self.clip.faces.face(i).is_some();
        let seen: Vec<usize> = (0..self.len()).filter(is_seen).collect();
        if let Some(name) = &self.options.from {
            return self.named(name, &seen).map(|found| vec![found]);
        }
        let away = |i: usize, yaw_deg: f64| {
            self.known.pose(i).map_or(f64::INFINITY, |pose| (yaw_pitch(&pose).0.to_degrees() - yaw_deg).abs())
        };
        let cost = |i: usize, yaw_deg: f64| away(i, yaw_deg) - self.quality[i].as_ref().map_or(-UNFIT_DEG, |q| *q);
        let mut references = Vec::new();
        for yaw_deg in REFERENCE_YAWS_DEG {
            let near = seen.iter().copied().filter(|&i| away(i, yaw_deg) < REFERENCE_REACH_DEG);
            let best = near.min_by(|&i, &j| cost(i, yaw_deg).total_cmp(&cost(j, yaw_deg)));
            references.extend(best.filter(|i| !references.contains(i)));
        }
        Ok(references)
    }

    /// The frame of a name, which must be among those with a face.
    fn named(&self, name: &str, seen: &[usize]) -> Result<usize, FacewrightError> {
        let names = &self.clip.frames.frames;
        let [first, last] = [&names[0], &names[names.len() - 1]].map(|frame| frame.name.clone());
        let found = seen.iter().copied().find(|&i| names[i].name == *name);
        found.ok_or(FacewrightError::NoSuchFrame { name: name.to_owned(), first, last })
    }

    /// Chooses points in the reference frames and seeks them in all frames; the window, and what was found.
    fn follow(&self, progress: &Progress) -> Result<(usize, Findings), FacewrightError> {
        let relays = if self.corners == Corners::New { RELAYING } else { 0.0 };
        let [choosing, seeking, relaying] = progress.split(&[TRACKING[0], TRACKING[1], relays]);
        let references = self.references()?.into_iter();
        let shots: Vec<Shot> = references.filter_map(|i| self.shoot(i).transpose()).collect::<Result<_, _>>()?;
        let surfaces: Vec<Surface> = shots.iter().map(|shot| self.surface(shot)).collect();
        let scenes: Vec<Scene> = shots.iter().zip(&surfaces).map(|(shot, surface)| self.scene(shot, surface)).collect();
        let references = self.choose(&shots, &scenes, &choosing)?;
        let mut findings = Findings::default();
        for reference in &references {
            let region = |seed: &Seed| self.region(reference.index, &seed.pixel);
            for seed in &reference.anchors.seeds {
                findings.add(reference.index, region(seed), Some(self.place(&seed.point)));
            }
        }
        let indices: Vec<usize> = (0..self.len()).collect();
        for chunk in indices.chunks(CHUNK) {
            seeking.step(chunk[0], indices.len())?;
            let found: Result<Vec<_>, FacewrightError> = chunk.par_iter().map(|&i| self.seek(i, &references)).collect();
            found?.into_iter().flatten().for_each(|(point, finding)| findings.note(point, finding));
        }
        if self.corners == Corners::New {
            relay(self, &references, &mut findings, &relaying)?;
        }
        findings.drop_unreliable();
        let window = scenes.first().map_or(0, |scene| self.search.window(&scene.view));
        Ok((window, findings))
    }

    pub fn surface<'s>(&'s self, shot: &'s Shot) -> Surface<'s> {
        Surface::new(&shot.positions, &self.triangles)
    }

    pub fn scene<'s>(&'s self, shot: &'s Shot, surface: &'s Surface<'s>) -> Scene<'s> {
        Scene { skin: &shot.skin, view: View::new(surface, &self.camera, shot.pose) }
    }

    /// Corners of each reference frame, beside the points of those before it or not.
    fn choose<'s>(
        &self,
        shots: &[Shot],
        scenes: &'s [Scene<'s>],
        progress: &Progress,
    ) -> Result<Vec<Reference<'s>>, FacewrightError> {
        let mut references: Vec<Reference> = Vec::new();
        for (shot, scene) in shots.iter().zip(scenes) {
            progress.step(references.len(), shots.len())?;
            let skin = self.skin(scene, shot.index)?;
            let seeds = match self.corners {
                Corners::New => self.new_corners(scene, &skin, &references)?,
                Corners::All(_) => self.all_corners(scene, skin, shot.index)?,
            };
            let first = references.last().map_or(0, |r| r.first + r.anchors.seeds.len());
            let anchors = Anchors::take(scene, seeds, &self.search)?;
            references.push(Reference { index: shot.index, anchors, first });
        }
        Ok(references)
    }

    /// The skin of a frame that is well within the person and not under hair: where the landmarks promise skin and the picture shows the
    /// wall or a fringe, points would be theirs.
    fn skin(&self, scene: &Scene, index: usize) -> Result<GrayImage, FacewrightError> {
        let (mut skin, outside) = (scene.skin.mask.clone(), |pixel: &Vec2| self.octave.outside(pixel));
        if let Some((face, person)) = self.clip.faces.face(index).zip(self.clip.person(index)?) {
            person.clear_outside(&mut skin, person.rim(), outside);
            let picture = self.clip.frames.picture(index)?;
            if let Some(hair) = Hair::of(&picture, face, &person) {
                hair.clear(&mut skin, HAIR_MARGIN, outside);
            }
        }
        Ok(skin)
    }

    /// Corners away from the points that other reference frames have given, and from where the skin turns away.
    fn new_corners(
        &self,
        scene: &Scene,
        skin: &GrayImage,
        references: &[Reference],
    ) -> Result<Vec<Seed>, FacewrightError> {
        let window = self.search.window(&scene.view);
        let mut free = scene.view.shared(&scene.view, self.search.least_cosine(), window / 4);
        free.iter_mut().zip(skin.iter()).for_each(|(free, skin)| *free &= skin);
        let mut known = 0;
        for reference in references {
            let again = reference.anchors.search(scene, &self.search)?;
            for sighting in again.sightings.into_iter().flatten().filter(|s| s.outcome.is_usable()) {
                clear_disc(&mut free, &sighting.pixel, 0.5 * window as f64);
                known += 1;
            }
        }
        seeds(scene, &free, &self.search.corners(scene, self.options.points.saturating_sub(known)))
    }

    /// All corners of the skin that faces the camera.
    fn all_corners(&self, scene: &Scene, mut free: GrayImage, index: usize) -> Result<Vec<Seed>, FacewrightError> {
        let window = self.search.window(&scene.view) as f64;
        self.disabled(index).for_each(|pixel| clear_disc(&mut free, &pixel, window));
        let mut seeds = seeds(scene, &free, &self.search.corners(scene, self.options.points))?;
        let cosine = self.search.least_cosine();
        seeds.retain(|seed| scene.view.facing(&seed.point).is_some_and(|found| found > cosine));
        Ok(seeds)
    }

    /// Seeks the points of all references in one frame: number and finding of every point.
    fn seek(&self, index: usize, references: &[Reference]) -> Result<Vec<(usize, Finding)>, FacewrightError> {
        let mut found = Vec::new();
        let shot = self.shoot(index)?;
        let surface = shot.as_ref().map(|shot| self.surface(shot));
        let scene = shot.as_ref().zip(surface.as_ref()).map(|(shot, surface)| self.scene(shot, surface));
        for reference in references {
            let numbers = reference.first..reference.first + reference.anchors.seeds.len();
            let all = |loss: Loss| numbers.clone().map(move |n| (n, Err((index, loss))));
            let turn = |scene: &Scene| {
                scene.view.cam_from_head.angle_to(&reference.anchors.scene.view.cam_from_head).to_degrees()
            };
            match &scene {
                None => found.extend(all(Loss::NoFace)),
                Some(_) if reference.index == index => {
                    let own =
                        |seed: &Seed| Ok(PointObservation { frame: index, pixel: seed.pixel, sigma_px: REFERENCE_PX });
                    found.extend(numbers.clone().zip(reference.anchors.seeds.iter().map(own)));
                }
                Some(scene) if turn(scene) > self.corners.farthest_turn_deg() => found.extend(all(Loss::Turned)),
                Some(scene) => {
                    let again = reference.anchors.search(scene, &self.search)?;
                    let window = self.search.window(&scene.view) as f64;
                    let near = |pixel: &Vec2| self.disabled(index).any(|at| (at - pixel).norm() <= window);
                    let kept = |finding: Finding| {
                        finding.and_then(|o| if near(&o.pixel) { Err((index, Loss::Disabled)) } else { Ok(o) })
                    };
                    found.extend(numbers.clone().zip(verdicts(index, &again).map(kept)));
                }
            }
        }
        Ok(found)
    }

    /// The tracks as they are written.
    fn report(&self, camera: SourcedCamera, window: usize, findings: &Findings) -> Tracks {
        let mut tracks: Vec<PointTrack> = findings.tracks(self.clip.frames.fewest_sightings());
        for o in tracks.iter_mut().flat_map(|track| &mut track.observations) {
            (o.pixel, o.sigma_px) = (self.octave.outside(&o.pixel), self.octave.factor() * o.sigma_px);
        }
        let mut counts = vec![0; self.len()];
        tracks.iter().flat_map(|t| &t.observations).for_each(|o| counts[o.frame] += 1);
        let frame = |i: usize| {
            let pose = self.known.pose(i);
            let reason = match (&self.quality[i], &pose) {
                (_, Some(pose)) if counts[i] > 0 => FrameReason::Yaw(yaw_pitch(pose).0.to_degrees()),
                (Err(reason), _) => reason.clone(),
                _ => FrameReason::NothingFound,
            };
            let name = self.clip.frames.frames[i].name.clone();
            let Told { reason, kind: reason_kind } = reason.told();
            FrameTracks { name, used: counts[i] > 0, reason, reason_kind, cam_from_head: pose, points: counts[i] }
        };
        Tracks {
            schema: Schema,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            method: self.options.method,
            camera,
            interocular: eye_centres(self.clip.head, &self.known.positions).map(|[a, b]| (a - b).norm()),
            window: window * self.octave.factor() as usize,
            frames: (0..self.len()).map(frame).collect(),
            tracks,
            disabled: Vec::new(),
            warnings: self.clip.faces.warnings(),
        }
    }
}

/// What a search found of each seed.
fn verdicts(index: usize, found: &Search) -> impl Iterator<Item = Finding> {
    found.sightings.iter().map(move |sighting| {
        let Some(s) = sighting else { return Err((index, Loss::Hidden)) };
        match Loss::of(s.status, s.outcome) {
            None if s.sigma_px.is_finite() => {
                Ok(PointObservation { frame: index, pixel: s.pixel, sigma_px: s.sigma_px })
            }
            loss => Err((index, loss.unwrap_or(Loss::Tracker(s.status)))),
        }
    })
}

/// Clears the pixels of a mask around a position.
fn clear_disc(mask: &mut GrayImage, at: &Vec2, radius: f64) {
    let range = |middle: f64, size: u32| {
        let first = (middle - radius).ceil().max(0.0) as u32;
        first..((middle + radius).floor() + 1.0).clamp(0.0, f64::from(size)) as u32
    };
    for y in range(at.y, mask.height()) {
        for x in range(at.x, mask.width()) {
            if (f64::from(x) - at.x).hypot(f64::from(y) - at.y) <= radius {
                mask.put_pixel(x, y, Luma([0]));
            }
        }
    }
}
