//! The whole path: from frames to a finished head.

use crate::camera::starting_camera;
use crate::clock::Clock;
use crate::faces::clip::Clip;
use crate::head::paper;
use crate::head::shape::{Shape, measure_shape};
use crate::motion::PosedFrame;
use crate::motion::between::pose_between;
use crate::texture::make_skin;
use crate::{
    Assets, CameraSource, FacewrightError, FrameReport, FrameSet, Given, Method, Reconstruction, Report, Scale,
    SizeOptions, SourcedCamera,
};
use clap::Args;
use geometry::Progress;
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
    /// What is known of the head's size.
    #[command(flatten)]
    #[serde(flatten)]
    pub size: SizeOptions,
}

impl Default for ReconstructOptions {
    fn default() -> Self {
        Self { method: Method::Default, texture_size: 2048, size: SizeOptions::default() }
    }
}

impl ReconstructOptions {
    fn validate(&self) -> Result<(), FacewrightError> {
        if !(64..=8192).contains(&self.texture_size) {
            return Err(FacewrightError::Option { name: "the texture size", expected: "64 to 8192 pixels" });
        }
        self.size.validate()
    }
}

/// Reconstructs the head in a clip. Nothing is written.
pub fn reconstruct(
    frames: &FrameSet,
    assets: &Assets,
    given: &Given,
    options: &ReconstructOptions,
    progress: &Progress,
) -> Result<Reconstruction, FacewrightError> {
    options.validate()?;
    if frames.len() < 2 {
        return Err(FacewrightError::OneFrame);
    }
    given.tracks.as_ref().map_or(Ok(()), |tracks| tracks.check(frames))?;
    let mut clock = Clock::start();
    let sourced = starting_camera(frames, given.camera.as_ref())?;
    let mut clip = Clip::look(frames, assets, &sourced, &options.size, progress)?;
    if options.method == Method::Paper {
        paper::keep_trusted(&mut clip);
    }
    clock.lap("landmarks");
    let shape = match options.method {
        Method::Default => {
            let tracks = given.tracks.as_ref();
            measure_shape(&clip, &assets.head, &sourced, &options.size, tracks, progress)?
        }
        Method::Paper => paper::shape(&clip, &assets.head, &sourced, &options.size, progress)?,
    };
    clock.lap("shape");
    let between = match options.method {
        Method::Default => pose_between(frames, &clip, &assets.head, &shape, progress)?,
        Method::Paper => vec![None; frames.len()],
    };
    clock.lap("poses");
    let keys = carry_keys(&assets.head, &shape)?;
    clock.lap("keys");
    let how = (options.texture_size, options.method);
    let skin = make_skin(&assets.head, &shape.positions, &clip, &shape.camera, &shape.poses, how, progress)?;
    clock.lap("texture");
    let mut warnings = clip.warnings.clone();
    warnings.extend(camera_warning(sourced.source));
    warnings.extend(shape.warnings.iter().cloned());
    warnings.extend(skin.warnings);
    let report = Report {
        schema: crate::Schema,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        method: options.method,
        camera: SourcedCamera { camera: shape.camera, source: sourced.source },
        frames: frame_reports(&clip, &shape, &between),
        points: shape.points,
        landmarks68: shape.landmarks68.iter().map(|p| [p.x, p.y, p.z]).collect(),
        scale: Scale::of_eyes(options.size.interocular()),
        fit: shape.fit.clone(),
        texture: skin.report,
        timings_s: clock.finish(),
        warnings,
    };
    let mut result = Reconstruction::on(&assets.head, shape.positions, keys, report);
    (result.texture, result.eyes) = (skin.texture, skin.eyes);
    Ok(result)
}

/// The 52 keys on the person's proportions, and the visemes composed of them.
fn carry_keys(head: &GenericHead, shape: &Shape) -> Result<Vec<Key>, FacewrightError> {
    let mut keys = KeyTransfer::new(head, &shape.positions)?.keys()?;
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
fn frame_reports(clip: &Clip, shape: &Shape, between: &[Option<PosedFrame>]) -> Vec<FrameReport> {
    let pose = |index: usize| {
        if let Some(k) = clip.chosen.iter().position(|c| c.index == index) {
            return (Some(shape.poses[k]), shape.rms_px[k], shape.rms_px[k].is_some());
        }
        if let Some(posed) = &between[index] {
            return (Some(posed.cam_from_head), Some(posed.rms_px), true);
        }
        let fitted = clip.landmark_fit.frames[index].as_ref();
        (fitted.map(|f| shape.head_from_landmark_head.move_pose(&f.pose)), fitted.map(|f| f.rms_px), false)
    };
    let report = |(index, name): (usize, &String)| {
        let (used, mut reason) = match &clip.verdicts[index] {
            Ok(reason) => (clip.chosen.iter().any(|c| c.index == index), reason.clone()),
            Err(reason) => (false, reason.clone()),
        };
        let (cam_from_head, reprojection_rms_px, by_points) = pose(index);
        if cam_from_head.is_some() && !by_points {
            reason.push_str(", posed by its landmarks alone");
        }
        FrameReport { name: name.clone(), used, reason, cam_from_head, reprojection_rms_px }
    };
    clip.names.iter().enumerate().map(report).collect()
}

/// The generic head itself as a result: its own shape and keys, plain textures, an empty report.
pub fn generic_head(folder: &std::path::Path) -> Result<Reconstruction, FacewrightError> {
    let path = folder.join("generic_head.safetensors.gz");
    let bytes = std::fs::read(&path).map_err(|_| FacewrightError::NoAssets { path })?;
    let head = GenericHead::from_bytes(&bytes)?;
    let mut keys = head.keys.clone();
    let visemes = viseme_keys(&keys);
    keys.extend(visemes);
    let mut result = Reconstruction::on(&head, head.positions.clone(), keys, Report::empty());
    (result.texture, result.eyes) = crate::texture::plain();
    Ok(result)
}
