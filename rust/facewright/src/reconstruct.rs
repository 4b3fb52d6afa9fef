//! The whole path: faces → track → motion → shape → rest → features → eyes → keys → texture → result, each the same function that its
//! own command runs.

use crate::camera::{contradicted_exif, part_of_picture, starting_camera};
use crate::clock::Clock;
use crate::faces::{Clip, Known, KnownHead, median};
use crate::head::{Measured, MeasuredFrame, dense, eyes, paper, rest, shape};
use crate::judge::{Judged, because, judge};
use crate::motion::{Rig, solve_on_films};
use crate::reason::Told;
use crate::texture::{make_textures, paper_eyes, plain};
use crate::track::{Corners, track_head};
use crate::{
    Assets, CameraSource, FaceOptions, FacewrightError, FitReport, FrameReport, FrameSet, Given, HeadMotion, Method,
    MotionOptions, Quality, Reconstruction, Report, Scale, SizeOptions, SourcedCamera, TrackClipOptions, Tracks,
    solve_motion,
};
use clap::{ArgAction, Args};
use geometry::Progress;
use head::eyes::EyeFit;
use head::transfer::KeyTransfer;
use head::visemes::viseme_keys;
use head::{GenericHead, Key};
use serde::{Deserialize, Serialize};

/// How [`reconstruct`] works.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ReconstructOptions {
    /// Chain of steps
    #[arg(long, value_enum, default_value_t)]
    pub method: Method,
    /// Width and height of the texture, pixels
    #[arg(long, default_value_t = Self::default().texture_size)]
    pub texture_size: u32,
    /// Leave the skin as its points give it, without measuring it densely; only with the default method
    #[arg(long = "no-dense", action = ArgAction::SetFalse)]
    pub dense: bool,
    /// What is known of the head's size.
    #[command(flatten)]
    #[serde(flatten)]
    pub size: SizeOptions,
    /// Whose head it is.
    #[command(flatten)]
    #[serde(flatten)]
    pub person: FaceOptions,
}

impl Default for ReconstructOptions {
    fn default() -> Self {
        Self {
            method: Method::Default,
            texture_size: 2048,
            dense: true,
            size: SizeOptions::default(),
            person: FaceOptions::default(),
        }
    }
}

impl ReconstructOptions {
    /// Refuses a texture of no use, and sizes that no head has.
    ///
    /// # Errors
    /// [`FacewrightError::Option`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        if !(64..=8192).contains(&self.texture_size) {
            return Err(FacewrightError::Option { name: "the texture size", expected: "64 to 8192 pixels" });
        }
        self.size.validate()
    }
}

/// Times of the steps in parts, as measured on 181 frames of 400×300 and on 400 of 512×512, on two cores: faces, tracks, motion, shape and
/// the same sharpened, features with the dense surface, eyes and keys, textures.
const WEIGHTS: [f64; 7] = [27.0, 27.0, 13.0, 6.0, 14.0, 9.0, 11.0];
/// The same of the paper's steps: faces, shape, eyes and keys, textures.
const PAPER: [f64; 7] = [62.0, 0.0, 0.0, 5.0, 0.0, 8.0, 25.0];

/// How many steps [`reconstruct()`] counts in its progress.
pub fn reconstruct_steps(given: &Given, method: Method) -> usize {
    weights(given, method).iter().filter(|weight| **weight > 0.0).count()
}

/// What is given takes no time.
fn weights(given: &Given, method: Method) -> [f64; 7] {
    let mut weights = if method == Method::Paper { PAPER } else { WEIGHTS };
    weights[1] *= if given.tracks.is_some() || given.motion.is_some() { 0.0 } else { 1.0 };
    weights[2] *= if given.motion.is_some() { 0.0 } else { 1.0 };
    weights
}

/// Reconstructs the head in a clip. What is given of it is not found anew; nothing is written.
///
/// # Errors
/// Those of [`crate::find_faces`], [`crate::track()`] and [`crate::solve_motion`]; [`FacewrightError::TooFewUsable`] where hardly a frame
/// is sharp, uncovered and quiet; [`FacewrightError::Cancelled`].
///
/// # Examples
/// ```no_run
/// use facewright::{Assets, FrameSet, Given, ReconstructOptions, SourcedCamera, reconstruct};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let frames = FrameSet::open(&["clip.mp4".into()], &progress)?;
/// let assets = Assets::load(&Assets::default_folder())?;
/// let given = Given { camera: Some(SourcedCamera::read(Path::new("camera.json"))?), ..Given::default() };
/// let options = ReconstructOptions { texture_size: 4096, ..ReconstructOptions::default() };
/// let head = reconstruct(&frames, &assets, &given, &options, &progress)?;
/// head.report.warnings.iter().for_each(|warning| eprintln!("{warning}"));
/// head.write(Path::new("out"))?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn reconstruct(
    frames: &FrameSet,
    assets: &Assets,
    given: &Given,
    options: &ReconstructOptions,
    progress: &Progress,
) -> Result<Reconstruction, FacewrightError> {
    options.validate()?;
    given.check(frames)?;
    if frames.len() < 2 {
        return Err(FacewrightError::OneFrame);
    }
    run(frames, assets, given, options, None, progress)
}

/// The same for frames of one camera, or, with a `rig`, for its films one after the other, brought to one camera.
pub(crate) fn run(
    frames: &FrameSet,
    assets: &Assets,
    given: &Given,
    options: &ReconstructOptions,
    rig: Option<&Rig>,
    progress: &Progress,
) -> Result<Reconstruction, FacewrightError> {
    let [looking, tracking, moving, shaping, sharpening, aligning, texturing] =
        progress.split_steps(&weights(given, options.method));
    let (mut clock, head) = (Clock::start(), &assets.head);
    let sourced = starting_camera(frames, given.camera.as_ref())?;
    let known = Known { faces: given.faces.as_ref(), camera: &sourced, size: &options.size, person: &options.person };
    let mut clip = Clip::look(frames, assets, &known, &looking)?;
    rig.map_or(Ok(()), |rig| rig.check(&clip))?;
    clock.lap("faces");
    let solver = Solver { given, size: &options.size, rig };
    let (mut measured, scale) = match options.method {
        Method::Default => {
            let parts = [&tracking, &moving, &shaping, &sharpening];
            solver.measure(&mut clip, &sourced, parts, &mut clock).map_err(|error| because(&clip, error))?
        }
        Method::Paper => {
            let measured = paper::measure(&clip, &sourced, &options.size, &shaping)?;
            clock.lap("shape");
            (measured, Scale::of_eyes(options.size.interocular()))
        }
    };
    aligning.stage("features")?;
    if options.method == Method::Default {
        measured.positions = rest::finish(&clip, &measured)?;
        progress.show(&measured.positions);
        clock.lap("features");
    }
    aligning.step(1, 4)?;
    let skin_surface = if options.dense && options.method == Method::Default {
        let found = dense::refine(&clip, &mut measured)?;
        progress.show(&measured.positions);
        clock.lap("dense");
        Some(found)
    } else {
        None
    };
    aligning.step(2, 4)?;
    let eyes = eyes::finish(&clip, &mut measured)?;
    progress.show(&measured.positions);
    clock.lap("eyes");
    aligning.step(3, 4)?;
    let keys = carry_keys(head, &measured)?;
    clock.lap("keys");
    frames.forget_pyramids();
    let skin = make_textures(&clip, &measured, options.texture_size, options.method, &texturing)?;
    clock.lap("texture");
    let landmarks = crate::head::landmarks68(head, &measured.positions);
    let wrong_exif = measured.focal_sigma_px.and_then(|sigma| contradicted_exif(&sourced, measured.camera.fx, sigma));
    let source = if wrong_exif.is_some() { CameraSource::Estimated } else { sourced.source };
    let fit = fit_report(&clip, &measured, &eyes.fits);
    let judged = Judged { clip: &clip, measured: &measured, skin: &skin, fit: &fit, method: options.method, source };
    let quality = judge(&judged)?;
    clock.lap("judge");
    let report = Report {
        schema: crate::Schema,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        method: options.method,
        camera: SourcedCamera { camera: measured.camera, source },
        rig: Vec::new(),
        frames: frame_reports(&clip, &measured),
        points: measured.points.len(),
        landmarks68: landmarks.iter().map(|p| [p.x, p.y, p.z]).collect(),
        scale: if scale.measured { scale } else { Scale::of_eyes(options.size.interocular()) },
        fit,
        dense: skin_surface.as_ref().map(|surface| surface.report.clone()),
        texture: skin.report,
        timings_s: clock.finish(),
        warnings: warnings(&clip, (source, wrong_exif), &measured, skin.warnings, &quality),
        quality: Some(quality),
    };
    let mut result = Reconstruction::on(head, measured.positions, keys, report);
    (result.texture, result.eyes) = (skin.texture, skin.eyes);
    if let Some(surface) = skin_surface {
        (result.truth, result.relief) = (Some(surface.truth), surface.relief);
    }
    if options.method == Method::Paper {
        paper_eyes::put(&mut result, head, &eyes)?;
    }
    progress.done()?;
    Ok(result)
}

/// What a motion is solved with.
struct Solver<'a> {
    given: &'a Given,
    size: &'a SizeOptions,
    rig: Option<&'a Rig>,
}

impl Solver<'_> {
    /// The shape, in two rounds, and what its size rests on.
    fn measure(
        &self,
        clip: &mut Clip,
        camera: &SourcedCamera,
        [tracking, moving, shaping, sharpening]: [&Progress; 4],
        clock: &mut Clock,
    ) -> Result<(Measured, Scale), FacewrightError> {
        let motion = self.motion(clip, camera, [tracking, moving], clock)?;
        let [refitting, shaping] = &shaping.split(&[1.0, 2.0]);
        clip.refit(&motion.camera.camera, self.size, refitting)?;
        refitting.show(&clip.landmark_fit.positions);
        let chosen = shape::choose(clip, &motion)?;
        let measured = shape::measure(clip, &clip.known, &motion, chosen, self.size, shaping)?;
        shaping.show(&measured.positions);
        clock.lap("shape");
        if measured.points.is_empty() {
            // The size that points have is not that of the landmarks' head.
            return Ok((measured, Scale::of_eyes(self.size.interocular())));
        }
        let measured = sharpen(clip, measured, &motion, self, sharpening)?;
        clock.lap("sharpen");
        Ok((measured, motion.scale))
    }

    /// The motion given, or that of the tracks given, or that of the head's own points.
    fn motion(
        &self,
        clip: &Clip,
        camera: &SourcedCamera,
        [tracking, moving]: [&Progress; 2],
        clock: &mut Clock,
    ) -> Result<HeadMotion, FacewrightError> {
        if let Some(motion) = &self.given.motion {
            return Ok(motion.clone());
        }
        let tracks = match &self.given.tracks {
            Some(tracks) => tracks.clone(),
            None => track_head(clip, &clip.known, camera.source, &TrackClipOptions::default(), Corners::New, tracking)?,
        };
        clock.lap("track");
        let options = MotionOptions { size: self.size.clone() };
        let motion = self.solve(&tracks, self.given.camera.as_ref(), &options, moving)?;
        clock.lap("motion");
        Ok(motion)
    }

    fn solve(
        &self,
        tracks: &Tracks,
        camera: Option<&SourcedCamera>,
        options: &MotionOptions,
        progress: &Progress,
    ) -> Result<HeadMotion, FacewrightError> {
        match self.rig {
            Some(rig) => solve_on_films(tracks, rig, progress),
            None => solve_motion(tracks, camera, options, progress),
        }
    }
}

/// Corners in each reference frame of the second round, whose points need not be told apart by people.
const DENSE: usize = 350;

/// The shape once more, from many points that the better head predicts in the chosen frames. The camera is held: the first round has
/// seen all frames.
fn sharpen(
    clip: &Clip,
    rough: Measured,
    motion: &HeadMotion,
    solver: &Solver,
    progress: &Progress,
) -> Result<Measured, FacewrightError> {
    let [tracking, moving, shaping] = progress.split(&[4.0, 3.0, 3.0]);
    let better = rough.known(clip);
    let chosen = KnownHead {
        frames: better
            .frames
            .iter()
            .enumerate()
            .map(|(f, k)| k.clone().filter(|_| rough.chosen.frames.contains(&f)))
            .collect(),
        ..better.clone()
    };
    let options = TrackClipOptions { points: DENSE, ..TrackClipOptions::default() };
    let disabled = solver.given.tracks.as_ref().map_or(&[][..], |tracks| &tracks.disabled);
    let corners = Corners::All(disabled);
    let tracks = track_head(clip, &chosen, CameraSource::Board, &options, corners, &tracking)?;
    let mut again = solver.solve(&tracks, None, &MotionOptions::default(), &moving)?;
    again.scale = motion.scale.clone();
    let mut sharp = shape::measure(clip, &better, &again, rough.chosen.clone(), solver.size, &shaping)?;
    progress.show(&sharp.positions);
    sharp.focal_sigma_px = rough.focal_sigma_px;
    for (frame, before) in sharp.frames.iter_mut().zip(&rough.frames).filter(|(frame, _)| frame.by_landmarks) {
        (frame.rms_px, frame.by_landmarks) = (before.rms_px, before.by_landmarks);
    }
    Ok(sharp)
}

/// What the artist should know.
fn warnings(
    clip: &Clip,
    (source, wrong_exif): (CameraSource, Option<String>),
    measured: &Measured,
    of_texture: Vec<String>,
    quality: &Quality,
) -> Vec<String> {
    let mut warnings = clip.faces.warnings();
    warnings.extend(measured.focal_sigma_px.map_or_else(|| camera_warning(source), |_| wrong_exif));
    warnings.extend(part_of_picture(&measured.camera).filter(|_| source != CameraSource::Board));
    warnings.extend(measured.warnings.iter().cloned());
    warnings.extend(of_texture);
    warnings.extend(quality.unusual().map(|measure| measure.sentence.clone()));
    warnings
}

fn fit_report(clip: &Clip, measured: &Measured, eyes: &[EyeFit; 2]) -> FitReport {
    let squares: f64 = measured.coefficients.iter().map(|c| c * c).sum();
    let errors = clip.landmark_fit.landmark_errors_px.iter().copied().filter(|e| e.is_finite());
    FitReport {
        components: measured.coefficients.len(),
        coefficient_rms: (squares / measured.coefficients.len().max(1) as f64).sqrt(),
        rigid_agreement: measured.agreement,
        points_median_mm: 1000.0 * measured.points_median,
        landmarks_median_px: median(errors),
        interocular_mm: 1000.0 * (eyes[0].centre - eyes[1].centre).norm(),
    }
}

/// The 52 keys on the person's proportions, and the visemes composed of them.
fn carry_keys(head: &GenericHead, measured: &Measured) -> Result<Vec<Key>, FacewrightError> {
    let mut keys = KeyTransfer::new(head, &measured.positions)?.keys()?;
    let visemes = viseme_keys(&keys);
    keys.extend(visemes);
    Ok(keys)
}

fn camera_warning(source: CameraSource) -> Option<String> {
    let advice = "calibrate with a board for true proportions";
    match source {
        CameraSource::Board => None,
        CameraSource::Exif => Some(format!("the focal length is EXIF's, refined: {advice}")),
        CameraSource::Estimated => Some(format!("the focal length is estimated from the frames: {advice}")),
    }
}

/// What is said of each frame. Its pose is its points', or its landmarks' where they tell none, which its reason says.
fn frame_reports(clip: &Clip, measured: &Measured) -> Vec<FrameReport> {
    let report = |(index, placed): (usize, &MeasuredFrame)| {
        let (used, Told { mut reason, kind: reason_kind }) = match &measured.chosen.verdicts[index] {
            Ok(reason) => (measured.chosen.frames.contains(&index), reason.told()),
            Err(reason) => (false, reason.told()),
        };
        if placed.by_landmarks {
            reason.push_str(", posed by its landmarks alone");
        }
        let name = clip.faces.frames[index].name.clone();
        FrameReport { name, used, reason, reason_kind, cam_from_head: placed.pose, reprojection_rms_px: placed.rms_px }
    };
    measured.frames.iter().enumerate().map(report).collect()
}

/// The generic head itself as a result: its own shape and keys, plain textures, an empty report.
pub fn generic_head(head: &GenericHead) -> Reconstruction {
    let mut keys = head.keys.clone();
    let visemes = viseme_keys(&keys);
    keys.extend(visemes);
    let mut result = Reconstruction::on(head, head.positions.clone(), keys, Report::empty());
    (result.texture, result.eyes) = plain();
    result
}
