//! The faces of a clip's frames, and the head that their landmarks give.

pub mod clip;
pub mod observe;
pub mod select;

use crate::{Assets, FacewrightError, FrameSet, SizeOptions, SourcedCamera};
use geometry::face_mesh::LANDMARKS;
use geometry::{Progress, Vec2};
use head::GenericHead;
use head::fit::{FitOptions, FrameObservation, LandmarkFit, fit_landmarks};
use image::{GrayImage, RgbImage, imageops};
use observe::{Observation, observe};
use select::{Candidate, median};
use std::sync::Arc;
use vision::landmarks::{Face, MaskOptions, face_mask};
use vision::noise::noise;
use vision::pyramid::Pyramid;

/// Jitter of the landmark net in terms of the distance between the eyes.
const NET_JITTER: f64 = 0.012;
/// Keys that tell whether a face is quiet.
const EXPRESSIONS: [&str; 6] = ["jawOpen", "mouthSmile", "mouthFunnel", "mouthPucker", "browInnerUp", "mouthStretch"];
/// Levels of the pyramids that are tracked in.
const LEVELS: usize = 4;
/// The face's outline is drawn in by this part before skin is tracked: it is where the skin turns away, and hair begins.
const OUTLINE: f64 = 0.04;

/// Least noise that is believed, grey levels.
const LEAST_NOISE: f64 = 0.7;

/// What the landmarks tell of a clip.
pub struct Faces {
    /// Each frame.
    pub observations: Vec<Observation>,
    /// What the fit was given of each frame.
    pub seen: Vec<FrameObservation>,
    /// The head that landmarks alone give.
    pub landmark_fit: LandmarkFit,
    /// What the artist should know.
    pub warnings: Vec<String>,
}

impl Faces {
    /// Finds the faces and fits the head to their landmarks.
    pub fn look(
        frames: &FrameSet,
        assets: &Assets,
        camera: &SourcedCamera,
        size: &SizeOptions,
        progress: &Progress,
    ) -> Result<Self, FacewrightError> {
        let observations = observe(frames, &assets.landmarker, progress)?;
        let warnings = warnings(&observations)?;
        let seen: Vec<FrameObservation> = observations.iter().map(|o| observation(o.face.as_ref())).collect();
        let options =
            FitOptions { focal_sigma: camera.source.focal_sigma(), size: size.head_size(), ..FitOptions::default() };
        let landmark_fit = fit_landmarks(&assets.head, &camera.camera, &seen, &options, progress)?;
        Ok(Self { observations, seen, landmark_fit, warnings })
    }

    /// What frames are chosen by; `None` where there is no face.
    pub fn candidates(&self, head: &GenericHead) -> Vec<Option<Candidate>> {
        let (observations, fit) = (&self.observations, &self.landmark_fit);
        let indices = |wanted: &[&str]| -> Vec<usize> {
            let matches = |name: &str| wanted.iter().any(|w| name.starts_with(w));
            (0..head.keys.len()).filter(|&i| matches(&head.keys[i].name)).collect()
        };
        let (expressions, blinks) = (indices(&EXPRESSIONS), indices(&["eyeBlink"]));
        let fitted = || fit.frames.iter().flatten();
        let usual: Vec<f64> = (0..head.keys.len()).map(|k| median(fitted().map(|f| f.expression[k]))).collect();
        let strongest = |expression: &[f64], keys: &[usize]| {
            keys.iter().map(|&k| (expression[k] - usual[k]).abs()).fold(0.0, f64::max)
        };
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
}

/// What the landmark fit is told of a frame.
pub fn observation(face: Option<&Face>) -> FrameObservation {
    let Some(face) = face else {
        let (landmarks, sigma_px) = (vec![Vec2::zeros(); LANDMARKS], vec![0.0; LANDMARKS]);
        return FrameObservation { landmarks, sigma_px, ..FrameObservation::default() };
    };
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

/// What points are tracked in.
#[derive(Clone, Debug)]
pub struct TrackedSkin {
    /// The picture's grey levels, halved again and again.
    pub pyramid: Pyramid,
    /// 255 on skin that may be tracked.
    pub mask: GrayImage,
    /// Standard deviation of the skin's noise, grey levels.
    pub noise: f64,
}

impl TrackedSkin {
    /// Of a picture with a face.
    pub fn of(picture: &RgbImage, face: &Face) -> Self {
        let options = MaskOptions { shrink: OUTLINE, ..MaskOptions::default() };
        let mask = face_mask(face, picture.width(), picture.height(), &options);
        let grey = imageops::grayscale(picture);
        // Compression leaves skin without any noise; what it leaves of texture is no finer than this.
        let noise = noise(&grey, Some(&mask)).unwrap_or(LEAST_NOISE).max(LEAST_NOISE);
        Self { pyramid: Pyramid::sharing(Arc::new(grey), LEVELS), mask, noise }
    }
}

fn warnings(observations: &[Observation]) -> Result<Vec<String>, FacewrightError> {
    let faces = observations.iter().filter_map(|o| o.face.as_ref());
    let (found, several) = (faces.clone().count(), faces.filter(|f| f.faces_in_picture > 1).count());
    if found == 0 {
        return Err(FacewrightError::NoFace { frames: observations.len() });
    }
    let rivals = observations.iter().filter(|o| o.rival).count();
    let mut warnings = Vec::new();
    if several > 0 {
        warnings.push(format!("{several} frames show several faces: the largest one was followed"));
    }
    if rivals > 0 {
        warnings.push(format!(
            "in about {rivals} of them another face becomes the largest: the one of the frames before was kept. If it is \
             the wrong one, begin the clip where the right one is the largest"
        ));
    }
    Ok(warnings)
}
