//! A clip after it was looked at: faces, the head that their landmarks give, and the frames chosen from it.

use crate::faces::observe::Observation;
use crate::faces::select::{SelectOptions, check_turn, select, tally};
use crate::faces::{Faces, TrackedSkin};
use crate::{Assets, FacewrightError, FrameSet, SizeOptions, SourcedCamera};
use geometry::{Progress, Transform};
use head::fit::{FrameObservation, LandmarkFit};
use image::RgbImage;
use rayon::prelude::*;
use vision::landmarks::Face;

/// A frame from which shape and texture are taken.
pub struct ChosenFrame {
    /// Its place in the clip.
    pub index: usize,
    /// The picture.
    pub picture: RgbImage,
    /// What points are tracked in.
    pub skin: TrackedSkin,
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

impl Clip {
    /// Finds faces, fits the landmarks and chooses frames.
    pub fn look(
        frames: &FrameSet,
        assets: &Assets,
        camera: &SourcedCamera,
        size: &SizeOptions,
        progress: &Progress,
    ) -> Result<Self, FacewrightError> {
        let faces = Faces::look(frames, assets, camera, size, progress)?;
        let verdicts = select(&faces.candidates(&assets.head), &SelectOptions::default());
        let Faces { observations, seen, landmark_fit, warnings } = faces;
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

fn check_enough(verdicts: &[Result<String, String>], fit: &LandmarkFit) -> Result<(), FacewrightError> {
    let used: Vec<usize> = (0..verdicts.len()).filter(|&i| verdicts[i].is_ok()).collect();
    let poses: Vec<Transform> = used.iter().filter_map(|&i| fit.frames[i].as_ref().map(|f| f.pose)).collect();
    if used.len() < 2 {
        let all: Vec<Transform> = fit.frames.iter().flatten().map(|f| f.pose).collect();
        if all.len() > 1 {
            check_turn(&all)?;
        }
        let reasons = tally(verdicts.iter().filter_map(|v| v.as_ref().err()).map(String::as_str));
        return Err(FacewrightError::TooFewUsable { usable: used.len(), frames: verdicts.len(), reasons });
    }
    check_turn(&poses)
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
        let skin = TrackedSkin::of(&picture, face);
        Ok(Some(ChosenFrame { index, picture, skin }))
    };
    let loaded: Result<Vec<_>, _> = used.par_iter().map(load).collect();
    Ok(loaded?.into_iter().flatten().collect())
}
