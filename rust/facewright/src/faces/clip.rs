//! A clip that was looked at: the faces, the head that their landmarks give, and where it is in every frame.

use super::{Faces, KnownFrame, KnownHead, Placing, landmarks_of, look_at};
use crate::{Assets, FacewrightError, FrameSet, Given, SizeOptions, SourcedCamera};
use geometry::{Progress, Transform};
use head::GenericHead;
use head::fit::{FitOptions, FrameObservation, LandmarkFit, fit_landmarks};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ops::Range;

/// Frames that the nets look at at first, about: enough to see a turn from all sides, to choose from, and to begin with …
const FIRST_LOOKS: usize = 64;
/// … but at least every so many frames, in which a head may turn to the side and back.
const FARTHEST_LOOKS: usize = 12;
/// Between looks whose heads are turned against each other by more than this, radians …
const FAR_RAD: f64 = 0.2;
/// … or shifted by more of the distance between the eyes, the nets look again.
const FAR_SHIFT: f64 = 0.6;
/// Usual distance between the eyes, metres.
const EYES: f64 = 0.063;
/// Times that frames are placed by points, and looked at where the head is too fast or points lose it.
const ROUNDS: usize = 5;

/// What is known of a clip before anything is tracked.
pub struct Clip<'a> {
    /// The frames.
    pub frames: &'a FrameSet,
    /// The generic head.
    pub head: &'a GenericHead,
    /// What the nets saw.
    pub faces: Faces,
    /// What the fit was given of each frame.
    pub seen: Vec<FrameObservation>,
    /// The head that landmarks alone give, in the frames that were looked at.
    pub landmark_fit: LandmarkFit,
    /// The same in every frame.
    pub known: KnownHead,
}

impl<'a> Clip<'a> {
    /// Looks at the frames, or takes the faces given, and places the head in all.
    ///
    /// # Errors
    /// [`FacewrightError::NoFace`], [`FacewrightError::Faces`] for the faces of another clip.
    pub fn look(
        frames: &'a FrameSet,
        assets: &'a Assets,
        given: &Given,
        camera: &SourcedCamera,
        size: &SizeOptions,
        progress: &Progress,
    ) -> Result<Self, FacewrightError> {
        let looking = Looking { frames, assets, camera, size, triangles: assets.head.outer_skin(), progress };
        let faces = match &given.faces {
            Some(faces) => {
                faces.check(frames)?;
                faces.clone()
            }
            None => looking.first()?,
        };
        looking.finish(faces)
    }

    /// Pose of the head by the landmarks of a frame that was looked at; by its points in another.
    pub fn pose(&self, frame: usize) -> Transform {
        self.known.pose(frame).unwrap_or_else(Transform::identity)
    }
}

/// What looking takes.
struct Looking<'a, 'b> {
    frames: &'a FrameSet,
    assets: &'a Assets,
    camera: &'b SourcedCamera,
    size: &'b SizeOptions,
    triangles: Vec<[u32; 3]>,
    progress: &'b Progress,
}

impl<'a> Looking<'a, '_> {
    /// Frames spread over the clip, and where the face comes or goes.
    fn first(&self) -> Result<Faces, FacewrightError> {
        self.progress.stage("faces")?;
        let count = self.frames.len();
        let mut faces = Faces::unseen(self.frames);
        let step = count.div_ceil(FIRST_LOOKS).min(FARTHEST_LOOKS);
        let mut wanted: Vec<usize> = self.frames.films().flat_map(|film| spread(&film, step)).collect();
        while !wanted.is_empty() {
            look_at(&mut faces, &wanted, self.frames, &self.assets.landmarker, self.progress)?;
            wanted = comings_and_goings(&faces);
        }
        if !(0..count).any(|frame| faces.face(frame).is_some()) && step > 1 {
            // A face that is there for a moment only.
            let more = self.frames.films().flat_map(|film| spread(&film, step.div_ceil(2)));
            let between: Vec<usize> = more.filter(|&f| faces.look(f).is_none()).collect();
            look_at(&mut faces, &between, self.frames, &self.assets.landmarker, self.progress)?;
        }
        Ok(faces)
    }

    /// Fits the head, places it in all frames, and looks again where it moves too fast or points lose it.
    fn finish(&self, mut faces: Faces) -> Result<Clip<'a>, FacewrightError> {
        for _ in 0..ROUNDS {
            let clip = self.fit(faces)?;
            let fast = self.fast(&clip);
            let wanted = if fast.is_empty() { lost(&clip) } else { fast };
            if wanted.is_empty() {
                return Ok(clip);
            }
            faces = clip.faces;
            look_at(&mut faces, &wanted, self.frames, &self.assets.landmarker, self.progress)?;
        }
        self.fit(faces)
    }

    /// The head by landmarks, and by points between them.
    fn fit(&self, faces: Faces) -> Result<Clip<'a>, FacewrightError> {
        if !(0..faces.frames.len()).any(|frame| faces.face(frame).is_some()) {
            return Err(FacewrightError::NoFace { frames: faces.frames.len() });
        }
        let seen = landmarks_of(&faces);
        let options = FitOptions {
            focal_sigma: self.camera.source.focal_sigma(),
            size: self.size.head_size(),
            ..FitOptions::default()
        };
        let head = &self.assets.head;
        let landmark_fit = fit_landmarks(head, &self.camera.camera, &seen, &options, self.progress)?;
        let mut known = KnownHead::by_landmarks(&landmark_fit);
        let placed = self.place(&faces, &known)?;
        placed.into_iter().for_each(|(frame, found)| known.frames[frame] = found);
        Ok(Clip { frames: self.frames, head, faces, seen, landmark_fit, known })
    }

    /// The head in the frames between looks that saw it.
    fn place(&self, faces: &Faces, known: &KnownHead) -> Result<Vec<(usize, Option<KnownFrame>)>, FacewrightError> {
        let looked = faces.looked();
        let gaps: Vec<[usize; 2]> =
            looked.windows(2).map(|ends| [ends[0], ends[1]]).filter(|[a, b]| a + 1 < *b).collect();
        let placing = Placing { frames: self.frames, head: &self.assets.head, known, triangles: &self.triangles };
        let total = gaps.len();
        let place = |(done, &[a, b]): (usize, &[usize; 2])| {
            self.progress.step(done, total)?;
            let placed = match (faces.face(a), faces.face(b)) {
                (Some(face_a), Some(face_b)) => placing.between([a, b], [face_a, face_b])?,
                _ => vec![None; b - a - 1],
            };
            Ok((a + 1..b).zip(placed).collect::<Vec<_>>())
        };
        let placed: Result<Vec<_>, FacewrightError> = gaps.par_iter().enumerate().map(place).collect();
        Ok(placed?.into_iter().flatten().collect())
    }

    /// The middles of gaps over which the head moves too far to be foretold in between.
    fn fast(&self, clip: &Clip) -> Vec<usize> {
        let looked = clip.faces.looked();
        let gaps = looked.windows(2).filter(|ends| ends[0] + 1 < ends[1]);
        let is_far = |ends: &&[usize]| match (clip.known.pose(ends[0]), clip.known.pose(ends[1])) {
            (Some(a), Some(b)) => is_far(&a, &b),
            _ => false,
        };
        gaps.filter(is_far).map(|ends| usize::midpoint(ends[0], ends[1])).collect()
    }
}

fn is_far(a: &Transform, b: &Transform) -> bool {
    let shift = |k: usize| a.translation[k] / a.translation.z - b.translation[k] / b.translation.z;
    let eyes = EYES / a.translation.z.max(b.translation.z);
    a.angle_to(b) > FAR_RAD || shift(0).hypot(shift(1)) > FAR_SHIFT * eyes
}

/// Every `step`-th frame of a film, and the last one: nothing is sought between the end of a film and the beginning of the next.
fn spread(film: &Range<usize>, step: usize) -> BTreeSet<usize> {
    film.clone().step_by(step.max(1)).chain(film.clone().last()).collect()
}

/// The middles between looks of which only one saw the face.
fn comings_and_goings(faces: &Faces) -> Vec<usize> {
    let looked = faces.looked();
    let gaps = looked.windows(2).filter(|ends| ends[0] + 1 < ends[1]);
    let changes = gaps.filter(|ends| faces.face(ends[0]).is_some() != faces.face(ends[1]).is_some());
    changes.map(|ends| usize::midpoint(ends[0], ends[1])).collect()
}

/// Frames between two looks that saw the face, in which points do not find it.
fn lost(clip: &Clip) -> Vec<usize> {
    let looked = clip.faces.looked();
    let gaps = looked.windows(2).filter(|ends| ends[0] + 1 < ends[1]);
    let between = gaps.filter(|ends| clip.faces.face(ends[0]).is_some() && clip.faces.face(ends[1]).is_some());
    between.flat_map(|ends| ends[0] + 1..ends[1]).filter(|&frame| clip.known.frames[frame].is_none()).collect()
}
