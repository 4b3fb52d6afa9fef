//! A clip that was looked at: the faces, the head that their landmarks give, and where it is in every frame.

use super::look::CHUNK;
use super::person::People;
use super::shots::{forget_signatures, leave_out_others, undecided};
use super::whose::another;
use super::{FaceOptions, Faces, Followed, KnownHead, Placing, landmarks_of, look_at};
use crate::frames::Octave;
use crate::patches::octave;
use crate::{Assets, FacewrightError, FrameSet, SizeOptions, SourcedCamera};
use geometry::{Camera, Progress, Transform};
use head::GenericHead;
use head::fit::{FitOptions, FrameObservation, LandmarkFit, fit_landmarks};
use head::neutral::Rest;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use vision::landmarks::PersonMask;

/// In every so many frames of those that are seen at first, a face is sought that is small or tilted, before a clip is believed to show
/// none.
pub(super) const THOROUGH: usize = 16;
/// Frames that the nets look at at first, about: enough to see a turn from all sides, to choose from, and to begin with …
pub(super) const FIRST_LOOKS: usize = 64;
/// … but at least every so many frames, in which a head may turn to the side and back.
pub(super) const FARTHEST_LOOKS: usize = 12;
/// Between looks whose heads are turned against each other by more than this, radians …
const FAR_RAD: f64 = 0.2;
/// … or shifted by more of the distance between the eyes, the nets look again.
const FAR_SHIFT: f64 = 0.6;
/// Usual distance between the eyes, metres.
const EYES: f64 = 0.063;
/// The landmarks' head is fitted anew for a focal length that is another by this, of its logarithm: from there on the distance of a head
/// tells its shape otherwise …
const OTHER_FOCAL: f64 = 0.22;
/// … or for a camera that is aimed elsewhere, radians.
const OTHER_AIM_RAD: f64 = 0.05;
/// Times that the nets look again where the head is too fast, and where points lose it.
const ROUNDS: usize = 5;

/// Time of a fit, and of it for each frame that was looked at, in times of a look …
const FIT: [f64; 2] = [20.0, 0.4];
/// … that of placing the head in a frame between …
const PLACE: f64 = 0.2;
/// … and that of doing something once more, which is mostly not needed, as part of it.
const AGAIN: f64 = 0.1;
/// Times of the first looks, in parts: whether there is a face, looks spread over the clip, and looks where the face comes or goes.
const FIRST: [f64; 3] = [5.0, 90.0, 5.0];

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
    /// The octave in which it is tracked.
    pub octave: Octave,
    /// The face at rest, as the landmarks of all frames tell it.
    pub rest: Rest,
    people: People<'a>,
}

/// What is known before anybody looks.
pub struct Known<'a> {
    /// Faces that were found before.
    pub faces: Option<&'a Faces>,
    /// The camera.
    pub camera: &'a SourcedCamera,
    /// What is known of the head's size.
    pub size: &'a SizeOptions,
    /// Whose face it is about.
    pub person: &'a FaceOptions,
}

impl<'a> Clip<'a> {
    /// Looks at the frames, or takes the faces given, and places the head in all.
    ///
    /// # Errors
    /// [`FacewrightError::NoFace`], [`FacewrightError::Faces`] for the faces of another clip.
    pub fn look(
        frames: &'a FrameSet,
        assets: &'a Assets,
        known: &Known,
        progress: &Progress,
    ) -> Result<Self, FacewrightError> {
        let (given, triangles) = (known.faces, assets.head.outer_skin());
        let looking = Looking { frames, assets, known, triangles };
        let looks = given.map_or(frames.len().div_ceil(step(frames)), |faces| faces.looked().len());
        let finishes = finishes(looks, frames.len());
        let first = if given.is_some() { 0.0 } else { looks as f64 };
        let [first, finishing] = progress.split(&[first, finishes.iter().sum()]);
        let finishing = finishing.split(&finishes);
        let faces = match given {
            Some(faces) => {
                faces.check(frames)?;
                faces.clone()
            }
            None => looking.first(&first)?,
        };
        let mut clip = looking.finish(faces, finishing)?;
        forget_signatures(&mut clip.faces);
        progress.done()?;
        Ok(clip)
    }

    /// Fits the head to the landmarks anew where points have found a camera under which it would look another: the poses that begin the
    /// shape would be another head's.
    ///
    /// # Errors
    /// Those of [`fit_landmarks`]; [`FacewrightError::Cancelled`].
    pub fn refit(&mut self, camera: &Camera, size: &SizeOptions, progress: &Progress) -> Result<(), FacewrightError> {
        let before = &self.landmark_fit.camera;
        let aside = (camera.cx - before.cx).hypot(camera.cy - before.cy) / camera.fx;
        if (camera.fx / before.fx).ln().abs() < OTHER_FOCAL && aside < OTHER_AIM_RAD {
            return Ok(());
        }
        let options = FitOptions { size: size.head_size(), ..FitOptions::default() };
        self.landmark_fit = fit_landmarks(self.head, camera, &self.seen, &options, progress)?;
        self.rest = Rest::of(self.head, &self.landmark_fit);
        Ok(())
    }

    /// Pose of the head by the landmarks of a frame that was looked at; by its points in another.
    pub fn pose(&self, frame: usize) -> Transform {
        self.known.pose(frame).unwrap_or_else(Transform::identity)
    }

    /// The person in a frame, with hair and clothes, told from what is behind; `None` where the nets saw no face, or did not look.
    /// Found when it is asked for first.
    ///
    /// # Errors
    /// Those of reading the frame, and of the net.
    pub fn person(&self, frame: usize) -> Result<Option<Arc<PersonMask>>, FacewrightError> {
        self.people.of(frame, self.frames, &self.faces)
    }
}

/// What looking takes.
struct Looking<'a, 'b> {
    frames: &'a FrameSet,
    assets: &'a Assets,
    known: &'b Known<'b>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Looking<'a, '_> {
    /// Frames spread over the clip, and where the face comes or goes.
    fn first(&self, progress: &Progress) -> Result<Faces, FacewrightError> {
        progress.stage("faces")?;
        let [glancing, looking, mut further] = progress.split(&FIRST);
        let mut faces = Faces::unseen(self.frames);
        let step = step(self.frames);
        let every = |step: usize| self.frames.films().flat_map(|film| spread(&film, step)).collect::<Vec<_>>();
        if !self.is_any_face(&every(step.div_ceil(2)), &glancing)? {
            return Ok(faces);
        }
        self.look(&mut faces, &every(step), &looking)?;
        faces = self.of_person(faces, &every(step), &looking)?;
        let mut wanted = comings_and_goings(&faces);
        while !wanted.is_empty() {
            let [round, later] = further.round();
            self.look(&mut faces, &wanted, &round)?;
            (wanted, further) = (comings_and_goings(&faces), later);
        }
        if !(0..self.frames.len()).any(|frame| faces.face(frame).is_some()) && step > 1 {
            // A face that is there for a moment only.
            let between: Vec<usize> =
                every(step.div_ceil(2)).into_iter().filter(|&f| faces.look(f).is_none()).collect();
            self.look(&mut faces, &between, &further)?;
        }
        self.find_shots(faces, &further)
    }

    /// Looks where a cut is until it is known to the frame, and leaves out all but the longest shot.
    fn find_shots(&self, mut faces: Faces, progress: &Progress) -> Result<Faces, FacewrightError> {
        if self.frames.films().count() > 1 {
            return Ok(faces);
        }
        let mut wanted = undecided(&faces);
        while !wanted.is_empty() {
            self.look(&mut faces, &wanted, progress)?;
            wanted = undecided(&faces);
        }
        leave_out_others(&mut faces);
        Ok(faces)
    }

    /// Lets the nets look at more frames.
    fn look(&self, faces: &mut Faces, wanted: &[usize], progress: &Progress) -> Result<(), FacewrightError> {
        look_at(faces, (wanted, &[]), self.frames, &self.assets.landmarker, progress)
    }

    /// Looks again for another face where the largest one is not the one that the clip is about.
    fn of_person(&self, faces: Faces, wanted: &[usize], progress: &Progress) -> Result<Faces, FacewrightError> {
        let several = faces.frames.iter().filter_map(|frame| frame.look.as_ref()?.face.as_ref());
        if self.frames.films().count() > 1 || !several.into_iter().any(|face| face.faces_in_picture > 1) {
            return Ok(faces);
        }
        let (landmarker, options) = (&self.assets.landmarker, (self.known.person, CHUNK / 2));
        let Some((known, why)) = another(&faces, self.frames, landmarker, options, progress)? else {
            let followed = if self.known.person.face.is_some() { Followed::Chosen } else { Followed::Largest };
            return Ok(Faces { followed, ..faces });
        };
        let mut faces = Faces { followed: why, ..Faces::unseen(self.frames) };
        look_at(&mut faces, (wanted, &known), self.frames, landmarker, progress)?;
        Ok(faces)
    }

    /// Whether any of these frames shows a face; a clip without one is told so soon.
    fn is_any_face(&self, frames: &[usize], progress: &Progress) -> Result<bool, FacewrightError> {
        let landmarker = &self.assets.landmarker;
        let done = AtomicUsize::new(0);
        let is_face = |(k, &frame): (usize, &usize)| {
            progress.step(done.fetch_add(1, Ordering::Relaxed), frames.len())?;
            let picture = self.frames.picture(frame)?;
            Ok(landmarker.glance(&picture)? || (k % THOROUGH == 0 && landmarker.find(&picture)?.is_some()))
        };
        // The answer is the same whichever frame shows the face.
        let found = frames.par_iter().enumerate().map(is_face).find_any(|found| !matches!(found, Ok(false)));
        found.unwrap_or(Ok(false))
    }

    /// Fits the head, looks again where it moves too fast, places it in all frames, and looks again where points lose it.
    fn finish(
        &self,
        mut faces: Faces,
        [fitting, mut following, placing, mut finding]: [Progress; 4],
    ) -> Result<Clip<'a>, FacewrightError> {
        let mut clip = self.fit(faces, &fitting)?;
        fitting.show(&clip.landmark_fit.positions);
        for _ in 0..ROUNDS {
            let fast = fast(&clip);
            if fast.is_empty() {
                break;
            }
            let [round, later] = following.round();
            let [looking, fitting] = round.split(&[1.0, 1.0]);
            faces = clip.faces;
            self.look(&mut faces, &fast, &looking)?;
            clip = self.fit(faces, &fitting)?;
            following = later;
        }
        self.place(&mut clip, |_| true, &placing)?;
        for _ in 0..ROUNDS {
            let lost = lost(&clip);
            if lost.is_empty() {
                break;
            }
            let [round, later] = finding.round();
            let [looking, fitting, placing] = round.split(&[1.0, 1.0, 1.0]);
            let before = clip.known.frames;
            faces = clip.faces;
            self.look(&mut faces, &lost, &looking)?;
            clip = self.fit(faces, &fitting)?;
            // Elsewhere the head is where it was.
            clip.known.frames.iter_mut().zip(before).for_each(|(known, before)| *known = known.take().or(before));
            self.place(&mut clip, |[a, b]| lost.contains(&a) || lost.contains(&b), &placing)?;
            finding = later;
        }
        Ok(clip)
    }

    /// The head by the landmarks of the frames that were looked at.
    fn fit(&self, faces: Faces, progress: &Progress) -> Result<Clip<'a>, FacewrightError> {
        if faces.counts().1 == 0 {
            return Err(FacewrightError::NoFace { frames: faces.frames.len() });
        }
        let seen = landmarks_of(&faces);
        let options = FitOptions {
            focal_sigma: self.known.camera.source.focal_sigma(),
            size: self.known.size.head_size(),
            ..FitOptions::default()
        };
        let head = &self.assets.head;
        let landmark_fit = fit_landmarks(head, &self.known.camera.camera, &seen, &options, progress)?;
        let known = KnownHead::by_landmarks(&landmark_fit);
        let octave = octave(faces.eye_distance());
        let people = People::new(&self.assets.landmarker, self.frames.len());
        let rest = Rest::of(head, &landmark_fit);
        Ok(Clip { frames: self.frames, head, faces, seen, landmark_fit, known, octave, rest, people })
    }

    /// Places the head in the frames of those gaps between looks that are wanted.
    fn place(
        &self,
        clip: &mut Clip,
        is_wanted: impl Fn([usize; 2]) -> bool,
        progress: &Progress,
    ) -> Result<(), FacewrightError> {
        let gaps: Vec<[usize; 2]> = gaps(&clip.faces).filter(|gap| is_wanted(*gap)).collect();
        let placing = Placing {
            frames: self.frames,
            head: &self.assets.head,
            known: &clip.known,
            octave: clip.octave,
            camera: clip.octave.camera(&clip.known.camera),
            triangles: &self.triangles,
        };
        let (faces, done) = (&clip.faces, AtomicUsize::new(0));
        let place = |&[a, b]: &[usize; 2]| {
            progress.step(done.fetch_add(1, Ordering::Relaxed), gaps.len())?;
            let placed = match (faces.face(a), faces.face(b)) {
                (Some(face_a), Some(face_b)) => placing.between([a, b], [face_a, face_b])?,
                _ => vec![None; b - a - 1],
            };
            Ok((a + 1..b).zip(placed).collect::<Vec<_>>())
        };
        let placed: Result<Vec<_>, FacewrightError> = gaps.par_iter().map(place).collect();
        placed?.into_iter().flatten().for_each(|(frame, found)| clip.known.frames[frame] = found);
        Ok(())
    }
}

/// The nets look at first at every so many frames.
fn step(frames: &FrameSet) -> usize {
    frames.len().div_ceil(FIRST_LOOKS).min(FARTHEST_LOOKS)
}

/// Times of what follows the looks: the fit, further looks with fits, placing, and all of it again, in times of a look.
fn finishes(looks: usize, frames: usize) -> [f64; 4] {
    let (looks, between) = (looks as f64, frames.saturating_sub(looks) as f64);
    let (fit, place) = (FIT[0] + FIT[1] * looks, PLACE * between);
    let again = if between > 0.0 { AGAIN * fit } else { 0.0 };
    [fit, again, place, again]
}

/// Neighbouring looks with frames between them.
fn gaps(faces: &Faces) -> impl Iterator<Item = [usize; 2]> {
    let looked = faces.looked();
    (1..looked.len()).map(move |k| [looked[k - 1], looked[k]]).filter(|[a, b]| a + 1 < *b)
}

/// The middles of gaps over which the head moves too far to be predicted in between.
fn fast(clip: &Clip) -> Vec<usize> {
    let is_far = |[a, b]: &[usize; 2]| match (clip.known.pose(*a), clip.known.pose(*b)) {
        (Some(a), Some(b)) => is_far(&a, &b),
        _ => false,
    };
    gaps(&clip.faces).filter(is_far).map(|[a, b]| usize::midpoint(a, b)).collect()
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
    let changes = gaps(faces).filter(|[a, b]| faces.face(*a).is_some() != faces.face(*b).is_some());
    changes.map(|[a, b]| usize::midpoint(a, b)).collect()
}

/// Frames between two looks that saw the face, in which points do not find it.
fn lost(clip: &Clip) -> Vec<usize> {
    let between = gaps(&clip.faces).filter(|[a, b]| clip.faces.face(*a).is_some() && clip.faces.face(*b).is_some());
    between.flat_map(|[a, b]| a + 1..b).filter(|&frame| clip.known.frames[frame].is_none()).collect()
}
