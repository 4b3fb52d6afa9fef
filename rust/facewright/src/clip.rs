//! A clip after it was looked at: faces, the head that their landmarks give, and the frames chosen from it.

use crate::observe::{Observation, observe};
use crate::select::{Candidate, SelectOptions, median, select};
use crate::{Assets, FacewrightError, FrameSet, SourcedCamera};
use geometry::{Progress, Transform, Vec2};
use head::GenericHead;
use head::fit::{FitOptions, FrameObservation, HeadSize, LandmarkFit, fit_landmarks};
use image::{GrayImage, RgbImage, imageops};
use rayon::prelude::*;
use std::collections::BTreeMap;
use vision::landmarks::{Face, MaskOptions, face_mask};
use vision::pyramid::Pyramid;

/// Jitter of the landmark net in terms of the distance between the eyes.
const NET_JITTER: f64 = 0.012;
/// Keys that tell whether a face is quiet.
const EXPRESSIONS: [&str; 6] = ["jawOpen", "mouthSmile", "mouthFunnel", "mouthPucker", "browInnerUp", "mouthStretch"];
/// Levels of the pyramids that are tracked in.
const LEVELS: usize = 4;
/// Turned by less than this, a head shows no depth, degrees.
const LEAST_TURN_DEG: f64 = 6.0;

/// A frame from which shape and texture are taken.
pub struct ChosenFrame {
    /// Its place in the clip.
    pub index: usize,
    /// The picture.
    pub picture: RgbImage,
    /// Its grey levels, halved again and again.
    pub pyramid: Pyramid,
    /// Skin that may be tracked.
    pub mask: GrayImage,
}

/// What is known of a clip before anything is tracked.
pub struct Clip {
    /// Name of each frame.
    pub names: Vec<String>,
    /// Each frame.
    pub observations: Vec<Observation>,
    /// What the fit was given of each frame.
    pub seen: Vec<FrameObservation>,
    /// The head that landmarks alone give.
    pub landmark_fit: LandmarkFit,
    /// Per frame, why it is used (`Ok`) or not.
    pub verdicts: Vec<Result<String, String>>,
    /// The chosen frames, ascending.
    pub chosen: Vec<ChosenFrame>,
    /// What the artist should know.
    pub warnings: Vec<String>,
}

/// How the head's size is known.
pub fn head_size(interocular: Option<f64>) -> HeadSize {
    interocular.map_or(HeadSize::Usual, HeadSize::Pupils)
}

impl Clip {
    /// Finds faces, fits the landmarks and chooses frames.
    pub fn look(
        frames: &FrameSet,
        assets: &Assets,
        camera: &SourcedCamera,
        interocular: Option<f64>,
        progress: &Progress,
    ) -> Result<Self, FacewrightError> {
        let observations = observe(frames, &assets.landmarker, progress)?;
        let warnings = face_warnings(&observations)?;
        let seen: Vec<FrameObservation> = observations.iter().map(|o| observation(o.face.as_ref())).collect();
        let options = FitOptions {
            focal_sigma: camera.source.focal_sigma(),
            size: head_size(interocular),
            ..FitOptions::default()
        };
        let landmark_fit = fit_landmarks(&assets.head, &camera.camera, &seen, &options, progress)?;
        let candidates = candidates(&assets.head, &observations, &landmark_fit);
        let verdicts = select(&candidates, &SelectOptions::default());
        check_enough(&verdicts, &landmark_fit)?;
        let chosen = load_chosen(frames, &observations, &verdicts, progress)?;
        let names = frames.frames.iter().map(|f| f.name.clone()).collect();
        Ok(Self { names, observations, seen, landmark_fit, verdicts, chosen, warnings })
    }

    /// Landmark-fit pose of a chosen frame.
    pub fn pose(&self, chosen: &ChosenFrame) -> Transform {
        self.landmark_fit.frames[chosen.index].as_ref().map_or_else(Transform::identity, |f| f.pose)
    }

    /// The face in a chosen frame.
    pub fn face(&self, chosen: &ChosenFrame) -> Option<&Face> {
        self.observations[chosen.index].face.as_ref()
    }
}

fn face_warnings(observations: &[Observation]) -> Result<Vec<String>, FacewrightError> {
    let faces = observations.iter().filter_map(|o| o.face.as_ref());
    let (found, several) = (faces.clone().count(), faces.filter(|f| f.faces_in_picture > 1).count());
    match found {
        0 => Err(FacewrightError::NoFace { frames: observations.len() }),
        _ if several > 0 => Ok(vec![format!("{several} frames show several faces: the largest one was followed")]),
        _ => Ok(Vec::new()),
    }
}

/// What the landmark fit is told of a frame.
pub fn observation(face: Option<&Face>) -> FrameObservation {
    let Some(face) = face else { return FrameObservation::default() };
    let jitter = (NET_JITTER * face.eye_distance()).hypot(0.2);
    let visible = face.irises.iter().filter(|i| i.visible);
    // The eye that looks at the camera: the other one is foreshortened.
    let widest = visible.map(|i| 2.0 * i.radius).max_by(f64::total_cmp);
    FrameObservation {
        landmarks: face.points.iter().map(|p| p.xy()).collect::<Vec<Vec2>>(),
        sigma_px: vec![jitter; face.points.len()],
        initial_pose: None,
        iris_diameter_px: widest,
    }
}

fn candidates(head: &GenericHead, observations: &[Observation], fit: &LandmarkFit) -> Vec<Option<Candidate>> {
    let indices = |wanted: &[&str]| -> Vec<usize> {
        let matches = |name: &str| wanted.iter().any(|w| name.starts_with(w));
        (0..head.keys.len()).filter(|&i| matches(&head.keys[i].name)).collect()
    };
    let (expressions, blinks) = (indices(&EXPRESSIONS), indices(&["eyeBlink"]));
    let fitted = || fit.frames.iter().flatten();
    let usual: Vec<f64> = (0..head.keys.len()).map(|k| median(fitted().map(|f| f.expression[k]))).collect();
    let strongest =
        |expression: &[f64], keys: &[usize]| keys.iter().map(|&k| (expression[k] - usual[k]).abs()).fold(0.0, f64::max);
    let candidate = |(observed, fitted): (&Observation, &Option<head::fit::FittedFrame>)| {
        let fitted = fitted.as_ref()?;
        Some(Candidate {
            cam_from_head: fitted.pose,
            rms_px: fitted.rms_px,
            sharpness: observed.sharpness,
            expression: strongest(&fitted.expression, &expressions),
            blink: strongest(&fitted.expression, &blinks),
        })
    };
    observations.iter().zip(&fit.frames).map(candidate).collect()
}

fn check_enough(verdicts: &[Result<String, String>], fit: &LandmarkFit) -> Result<(), FacewrightError> {
    let used: Vec<usize> = (0..verdicts.len()).filter(|&i| verdicts[i].is_ok()).collect();
    let poses: Vec<Transform> = used.iter().filter_map(|&i| fit.frames[i].as_ref().map(|f| f.pose)).collect();
    let turn = poses.iter().flat_map(|a| poses.iter().map(|b| a.angle_to(b))).fold(0.0, f64::max).to_degrees();
    if used.len() < 2 {
        let all: Vec<Transform> = fit.frames.iter().flatten().map(|f| f.pose).collect();
        let whole = all.iter().flat_map(|a| all.iter().map(|b| a.angle_to(b))).fold(0.0, f64::max).to_degrees();
        if all.len() > 1 && whole < LEAST_TURN_DEG {
            return Err(FacewrightError::NoRotation { degrees: whole });
        }
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for reason in verdicts.iter().filter_map(|v| v.as_ref().err()) {
            *counts.entry(reason.split([':', '(']).next().unwrap_or(reason).trim()).or_default() += 1;
        }
        let reasons = counts.iter().map(|(reason, n)| format!("{n} {reason}")).collect::<Vec<_>>().join(", ");
        return Err(FacewrightError::TooFewUsable { usable: used.len(), frames: verdicts.len(), reasons });
    }
    if turn < LEAST_TURN_DEG { Err(FacewrightError::NoRotation { degrees: turn }) } else { Ok(()) }
}

fn load_chosen(
    frames: &FrameSet,
    observations: &[Observation],
    verdicts: &[Result<String, String>],
    progress: &Progress,
) -> Result<Vec<ChosenFrame>, FacewrightError> {
    progress.stage("pictures")?;
    let used: Vec<usize> = (0..verdicts.len()).filter(|&i| verdicts[i].is_ok()).collect();
    let load = |&index: &usize| -> Result<Option<ChosenFrame>, FacewrightError> {
        progress.step(0, 1)?;
        let Some(face) = observations[index].face.as_ref() else { return Ok(None) };
        let picture = frames.load(index)?;
        let pyramid = Pyramid::new(&imageops::grayscale(&picture), LEVELS);
        let mask_options = MaskOptions { shrink: 0.04, ..MaskOptions::default() };
        let mask = face_mask(face, picture.width(), picture.height(), &mask_options);
        Ok(Some(ChosenFrame { index, picture, pyramid, mask }))
    };
    let loaded: Result<Vec<_>, _> = used.par_iter().map(load).collect();
    Ok(loaded?.into_iter().flatten().collect())
}
