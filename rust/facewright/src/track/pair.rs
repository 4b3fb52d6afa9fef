//! Corners of the face matched between two frames (paper, sections 2.3 and 2.4; and ours).

use crate::faces::observation;
use crate::frames::Octave;
use crate::patches::{
    Anchors, Scene, Search, SearchOptions, Seed, Sighting, Surface, TrackedSkin, View, octave, seeds,
};
use crate::track::sequence::{check_points, check_window};
use crate::{Assets, CameraSource, FacewrightError, FrameSet, Method, Schema, SourcedCamera, camera::starting_camera};
use clap::{ArgAction, Args};
use geometry::{Camera, Progress, Vec2};
use head::fit::{FitOptions, FrameObservation, fit_landmarks};
use image::GrayImage;
use motion::two_view::{TwoViewOptions, robust};
use serde::{Deserialize, Serialize};
use std::path::Path;
use vision::corners::{CornerOptions, Spread, detect};
use vision::correct::{Correction, LocalAdjustmentOptions, Match as PointMatch, Outcome, Reason, local_adjustment};
use vision::pyramid::Pyramid;
use vision::track::{Status, Track, TrackOptions, track};

/// Corners of the paper's example.
const PAPER_CORNERS: usize = 66;
/// Window at which the paper's tables are best.
pub(crate) const PAPER_WINDOW: usize = 7;

/// How two frames are matched.
#[derive(Clone, Copy, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct MatchOptions {
    /// Chain of steps
    #[arg(long, value_enum, default_value_t)]
    pub method: Method,
    /// Number of corners at most
    #[arg(long, default_value_t = Self::default().points)]
    pub points: usize,
    /// Window of the tracker, pixels, odd (default: 7 for the paper's method, otherwise in proportion to the face)
    #[arg(long)]
    pub window: Option<usize>,
    /// Pyramid levels of the tracker (default: 4 for the paper's method, otherwise 2)
    #[arg(long)]
    pub levels: Option<usize>,
    /// Leave the matches as the tracker found them
    #[arg(long = "no-correction", action = ArgAction::SetFalse)]
    pub correct: bool,
    /// Largest distance of a kept match from its epipolar line, pixels; only with the default method
    #[arg(long, default_value_t = Self::default().epipolar_px)]
    pub epipolar_px: f64,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self {
            method: Method::Default,
            window: None,
            levels: None,
            points: PAPER_CORNERS,
            correct: true,
            epipolar_px: 1.0,
        }
    }
}

impl MatchOptions {
    /// Refuses numbers of points, windows and distances with which nothing can be matched.
    ///
    /// # Errors
    /// [`FacewrightError::Option`], [`vision::track::TrackError::Window`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        if !(self.epipolar_px > 0.0 && self.epipolar_px.is_finite()) {
            let (name, expected) = ("the distance from an epipolar line", "more than 0 pixels");
            return Err(FacewrightError::Option { name, expected });
        }
        check_points(self.points)?;
        check_window(self.window)
    }
}

/// A match: `ua, va, ub, vb` pixels, and 1 where it is kept.
pub type Match = (f64, f64, f64, f64, u8);

/// Matches of one pair of frames; the lists have one entry per match.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MatchedPair {
    /// Name of the first frame.
    pub a: String,
    /// Name of the second frame.
    pub b: String,
    /// The matches. One that is not kept stands where it was last believed to be.
    pub points: Vec<Match>,
    /// Where the tracker had put each point in the second frame before the correction; none where it had given it up.
    pub tracked: Vec<Option<[f64; 2]>>,
    /// What became of each: `kept`, `moved: REASON` or `rejected: REASON`.
    pub outcomes: Vec<String>,
    /// Cross matches (pairs on a line, method `paper`) or flipped triangles (`default`) before the correction …
    pub violations_before: usize,
    /// … and after it.
    pub violations_after: usize,
}

impl MatchedPair {
    /// The matches that are believed.
    pub fn kept(&self) -> impl Iterator<Item = &Match> {
        self.points.iter().filter(|point| point.4 == 1)
    }

    /// Adds a point of the first frame with its place in the second one, what the tracker had said, and the verdict.
    fn add(&mut self, a: &Vec2, b: &Vec2, tracked: Option<Vec2>, outcome: Outcome) {
        self.points.push((a.x, a.y, b.x, b.y, u8::from(outcome.is_usable())));
        self.tracked.push(tracked.map(|at| [at.x, at.y]));
        self.outcomes.push(outcome.to_string());
    }
}

/// `matches.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Matches {
    /// Version of the file's fields.
    #[serde(default)]
    pub schema: Schema,
    /// The pairs.
    pub pairs: Vec<MatchedPair>,
}

/// Times of the steps, in parts: frames opened, a look at each, matches.
const PARTS: [f64; 4] = [5.0, 25.0, 25.0, 45.0];

/// Matches corners of the face between two frames.
///
/// # Examples
/// ```no_run
/// use facewright::{Assets, MatchOptions, match_pair, write_json};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let (a, b) = (Path::new("frame_010.png"), Path::new("frame_014.png"));
/// let assets = Assets::load(&Assets::default_folder())?;
/// let matches = match_pair(a, b, None, &assets, &MatchOptions::default(), &Progress::new())?;
/// println!("{} matches kept", matches.pairs[0].kept().count());
/// write_json(Path::new("matches.json"), &matches)?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn match_pair(
    a: &Path,
    b: &Path,
    camera: Option<&SourcedCamera>,
    assets: &Assets,
    options: &MatchOptions,
    progress: &Progress,
) -> Result<Matches, FacewrightError> {
    options.validate()?;
    let [opening, first, second, matching] = progress.split(&PARTS);
    let frames = FrameSet::open(&[a.to_owned(), b.to_owned()], &opening)?;
    let camera = starting_camera(&frames, camera)?;
    let looks = looks(&frames, assets, options, [&first, &second])?;
    let mut pair = match options.method {
        Method::Paper => paper_matches([&looks[0].skin.pyramid, &looks[1].skin.pyramid], &looks[0].skin.mask, options)?,
        Method::Default => head_matches(&looks, assets, &camera, options, &matching)?,
    };
    let kept = pair.kept().count();
    if kept < 8 {
        return Err(FacewrightError::TooFewMatches { found: kept });
    }
    [pair.a, pair.b] = [0, 1].map(|i| frames.frames[i].name.clone());
    progress.done()?;
    Ok(Matches { schema: Schema, pairs: vec![pair] })
}

/// The paper's: corners by the smaller eigenvalue, pyramidal Lucas–Kanade, local adjustment of cross matches. The pair has
/// no names yet.
pub fn paper_matches(
    pyramids: [&Pyramid; 2],
    mask: &GrayImage,
    options: &MatchOptions,
) -> Result<MatchedPair, FacewrightError> {
    let window = options.window.unwrap_or(PAPER_WINDOW);
    let corner_options = CornerOptions {
        max_count: options.points,
        window,
        spread: Spread::Strongest,
        min_distance: 5.0,
        ..CornerOptions::default()
    };
    let corners: Vec<Vec2> = detect(pyramids[0], Some(mask), &corner_options)?.iter().map(|c| c.position).collect();
    let paper = TrackOptions::paper(window);
    let track_options = TrackOptions { levels: options.levels.unwrap_or(paper.levels), ..paper };
    let tracked = track(pyramids[0], pyramids[1], &corners, None, &track_options)?;
    let found = |t: &Track| t.status == Status::Found;
    let match_of =
        |(a, t): (&Vec2, &Track)| if found(t) { PointMatch { a: *a, b: t.position } } else { PointMatch::missing(*a) };
    let matches: Vec<PointMatch> = corners.iter().zip(&tracked).map(match_of).collect();
    let correction = if options.correct {
        let adjustment = LocalAdjustmentOptions { window, ..LocalAdjustmentOptions::default() };
        local_adjustment(pyramids[0], pyramids[1], &matches, &adjustment)?
    } else {
        Correction::unchanged(&matches)
    };
    let mut pair = MatchedPair {
        violations_before: correction.violations_before,
        violations_after: correction.violations_after,
        ..MatchedPair::default()
    };
    for (i, (m, outcome)) in correction.matches.iter().zip(&correction.outcomes).enumerate() {
        let b = if outcome.is_usable() { m.b } else { tracked[i].position };
        pair.add(&corners[i], &b, found(&tracked[i]).then_some(tracked[i].position), *outcome);
    }
    Ok(pair)
}

/// A frame with a face in it.
struct Look {
    skin: TrackedSkin,
    seen: FrameObservation,
    /// What the skin was taken in.
    octave: Octave,
}

/// Both frames, in the octave of the larger face; the paper's windows, and those that are asked for, are the picture's.
fn looks(
    frames: &FrameSet,
    assets: &Assets,
    options: &MatchOptions,
    progress: [&Progress; 2],
) -> Result<[Look; 2], FacewrightError> {
    let face = |i: usize| {
        progress[i].stage("faces")?;
        let found = assets.landmarker.find(&*frames.picture(i)?)?;
        found.ok_or(FacewrightError::NoFace { frames: 1 })
    };
    let faces = [face(0)?, face(1)?];
    let eyes_px = faces[0].eye_distance().max(faces[1].eye_distance());
    let is_free = options.method == Method::Default && options.window.is_none();
    let octave = if is_free { octave(eyes_px) } else { Octave::default() };
    let look = |i: usize| -> Result<Look, FacewrightError> {
        let skin = TrackedSkin::of(frames.pyramid(i, octave)?, &octave.face(&faces[i]));
        Ok(Look { skin, seen: observation(Some(&faces[i])), octave })
    };
    Ok([look(0)?, look(1)?])
}

/// Ours: the head that both frames' landmarks give predicts where each corner goes and how its surroundings are
/// warped; an essential matrix throws out what does not move with the head.
fn head_matches(
    looks: &[Look; 2],
    assets: &Assets,
    camera: &SourcedCamera,
    options: &MatchOptions,
    progress: &Progress,
) -> Result<MatchedPair, FacewrightError> {
    let fit_options = FitOptions {
        focal_sigma: if camera.source == CameraSource::Board { 0.0 } else { 1e-3 },
        size: head::fit::HeadSize::Usual,
        ..FitOptions::default()
    };
    let head = &assets.head;
    let observations: Vec<FrameObservation> = looks.iter().map(|l| l.seen.clone()).collect();
    let fit = fit_landmarks(head, &camera.camera, &observations, &fit_options, progress)?;
    let fitted = |i: usize| fit.frames[i].as_ref().ok_or(FacewrightError::NoFace { frames: 1 });
    let positions = [0, 1].map(|i| fitted(i).map(|f| head.with_expression(&fit.positions, &f.expression)));
    let [positions_a, positions_b] = positions;
    let (positions_a, positions_b) = (positions_a?, positions_b?);
    let triangles = head.outer_skin();
    let octave = looks[0].octave;
    let lens = octave.camera(&camera.camera);
    let surfaces = [Surface::new(&positions_a, &triangles), Surface::new(&positions_b, &triangles)];
    let scene = |i: usize| -> Result<Scene<'_>, FacewrightError> {
        let view = View::new(&surfaces[i], &lens, fitted(i)?.pose);
        Ok(Scene { skin: &looks[i].skin, view })
    };
    let (from, to) = (scene(0)?, scene(1)?);
    let usual = SearchOptions::default();
    let search_options = SearchOptions {
        window: options.window,
        levels: options.levels.unwrap_or(usual.levels),
        correct: options.correct,
        ..usual
    };
    let margin = search_options.window(&from.view) / 4;
    let mut shared = from.view.shared(&to.view, search_options.least_cosine(), margin);
    shared.iter_mut().zip(from.skin.mask.iter()).for_each(|(shared, mask)| *shared &= mask);
    let corners = search_options.corners(&from, options.points);
    let anchors = Anchors::take(&from, seeds(&from, &shared, &corners)?, &search_options)?;
    let found = anchors.search(&to, &search_options)?;
    Ok(vote(&anchors.seeds, &found, octave, &camera.camera, options))
}

/// Marks the matches that one motion of the head explains.
fn vote(seeds: &[Seed], found: &Search, octave: Octave, camera: &Camera, options: &MatchOptions) -> MatchedPair {
    let outside = |s: Sighting| Sighting {
        tracked: s.tracked.map(|at| octave.outside(&at)),
        pixel: octave.outside(&s.pixel),
        sigma_px: octave.factor() * s.sigma_px,
        ..s
    };
    let seen = seeds.iter().zip(&found.sightings);
    let seen = seen.filter_map(|(seed, sighting)| Some((octave.outside(&seed.pixel), outside((*sighting)?))));
    let (pixels, mut sightings): (Vec<Vec2>, Vec<Sighting>) = seen.unzip();
    let usable: Vec<usize> = (0..pixels.len()).filter(|&i| sightings[i].outcome.is_usable()).collect();
    let a: Vec<Vec2> = usable.iter().map(|&i| camera.normalise(&pixels[i])).collect();
    let b: Vec<Vec2> = usable.iter().map(|&i| camera.normalise(&sightings[i].pixel)).collect();
    let two_view = TwoViewOptions { threshold: options.epipolar_px / camera.fx, ..TwoViewOptions::default() };
    // Frames that are too alike for a motion have nothing against any match.
    if let Ok(motion) = robust(&a, &b, &two_view) {
        let outside = usable.iter().zip(motion.inliers).filter(|(_, inlier)| !inlier);
        outside.for_each(|(&i, _)| sightings[i].outcome = Outcome::Rejected(Reason::Expectation));
    }
    let mut pair = MatchedPair {
        violations_before: found.violations_before,
        violations_after: found.violations_after,
        ..MatchedPair::default()
    };
    for (pixel, sighting) in pixels.iter().zip(&sightings) {
        pair.add(pixel, &sighting.pixel, sighting.tracked, sighting.outcome);
    }
    pair
}
