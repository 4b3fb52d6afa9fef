//! The faces of a clip's frames: what `faces.json` holds.
//!
//! # Entry points
//! - [`find_faces`]: the command; [`Faces`] is what it leaves.
//! - [`Clip::look`]: what the other commands begin with: faces, the head that their landmarks give, and its pose in every frame.
//!
//! # Order of work
//! The nets look at a few dozen frames spread over the clip ([`observe`]), and at more of them where the face comes, goes or moves fast;
//! the landmarks give a head ([`fit`]); points place it in the frames between ([`place`]), and where they lose it the nets look
//! again ([`clip`]). [`person`] tells the person from what is behind, [`select`] says which frames are good for shape and texture.

mod anywhere;
mod appearance;
mod clip;
mod cover;
mod fit;
mod look;
mod person;
mod place;
mod select;
mod shots;
mod whose;

pub use anywhere::check_face;
pub(crate) use anywhere::check_long_video;
pub use appearance::{Appearance, COVERED};
pub use clip::{Clip, Known};
pub use cover::uncovered;
pub use fit::{KnownFrame, KnownHead};
pub(crate) use fit::{LANDMARK_SIGMA_RAD, landmarks_of, observation};
pub(crate) use look::face_box;
pub use look::{Look, look_at};
pub(crate) use place::Placing;
pub use select::{Chosen, check_turn, median, qualities, yaw_pitch};
pub use whose::{FaceOptions, Followed, Pixel};

use crate::camera::starting_camera;
use crate::formats::{self, Format, once};
use crate::{Assets, FacewrightError, FrameSet, Schema, SizeOptions, SourcedCamera};
use geometry::Progress;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FaceFrame {
    /// File name without extension.
    pub name: String,
    /// What the nets saw in it; `null` where they did not look: points place the head there.
    pub look: Option<Look>,
}

/// `faces.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Faces {
    /// Version of the file's fields.
    #[serde(default)]
    pub schema: Schema,
    /// Version of Facewright.
    pub version: String,
    /// Width of the frames, pixels.
    pub width: u32,
    /// Height of the frames, pixels.
    pub height: u32,
    /// By what the face was chosen that is followed.
    #[serde(default, skip_serializing_if = "Followed::is_largest")]
    pub followed: Followed,
    /// Every frame given.
    pub frames: Vec<FaceFrame>,
}

impl Format for Faces {
    const FILE: &'static str = "faces.json";
    const HOLDS: &'static str = "faces";
    const KEYS: &'static [&'static str] = &["frames", "width", "height"];

    fn validate(&self) -> Result<(), String> {
        once(self.frames.iter().map(|frame| frame.name.as_str()), "frame")?;
        let seen = self.frames.iter().filter_map(|frame| Some((frame, frame.look.as_ref()?)));
        for (frame, look) in seen {
            let face = look.face.as_ref().map_or(Ok(()), |face| face.check());
            face.map_err(|reason| format!("in {} {reason}", frame.name))?;
            if !look.sharpness.is_finite() || look.sharpness < 0.0 {
                return Err(format!("the sharpness of {} is no number from 0 up", frame.name));
            }
        }
        Ok(())
    }
}

/// Finds the face in a clip's frames. Of what is given, the camera counts, and faces that were found before: their frames are not
/// looked at again.
///
/// # Errors
/// [`FacewrightError::NoFace`]; those of reading the frames; [`FacewrightError::Cancelled`].
///
/// # Examples
/// ```no_run
/// use facewright::{Assets, FrameSet, find_faces};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let frames = FrameSet::open(&["clip.mp4".into()], &progress)?;
/// let assets = Assets::load(&Assets::default_folder())?;
/// let faces = find_faces(&frames, &assets, None, &progress)?;
/// faces.write(Path::new("faces.json"))?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn find_faces(
    frames: &FrameSet,
    assets: &Assets,
    camera: Option<&SourcedCamera>,
    progress: &Progress,
) -> Result<Faces, FacewrightError> {
    find_faces_of(frames, assets, camera, &FaceOptions::default(), progress)
}

/// The same where the clip shows several people.
///
/// # Errors
/// As those of [`find_faces`].
pub fn find_faces_of(
    frames: &FrameSet,
    assets: &Assets,
    camera: Option<&SourcedCamera>,
    options: &FaceOptions,
    progress: &Progress,
) -> Result<Faces, FacewrightError> {
    let camera = starting_camera(frames, camera)?;
    let known = Known { faces: None, camera: &camera, size: &SizeOptions::default(), person: options };
    Ok(Clip::look(frames, assets, &known, progress)?.faces)
}

impl Faces {
    /// Frames that nobody has looked at.
    pub(crate) fn unseen(frames: &FrameSet) -> Self {
        let frame = |frame: &crate::Frame| FaceFrame { name: frame.name.clone(), look: None };
        Self {
            schema: Schema,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            width: frames.width,
            height: frames.height,
            followed: Followed::Largest,
            frames: frames.frames.iter().map(frame).collect(),
        }
    }

    /// Reads a `faces.json`.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, or what it says cannot be.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        formats::read(path)
    }

    /// Reads the text of a `faces.json`; errors as those of [`Faces::read`].
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        formats::parse(text)
    }

    /// Writes a `faces.json`, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), FacewrightError> {
        formats::write(path, self)
    }

    /// Refuses the faces of other frames.
    pub(crate) fn check(&self, frames: &FrameSet) -> Result<(), FacewrightError> {
        let names = self.frames.iter().map(|frame| &frame.name);
        frames.is_clip_of(names, (self.width, self.height)).map_err(|reason| FacewrightError::Faces { reason })
    }

    /// What the nets saw in a frame, if they looked.
    pub fn look(&self, frame: usize) -> Option<&Look> {
        self.frames[frame].look.as_ref()
    }

    /// The face that the nets saw in a frame.
    pub fn face(&self, frame: usize) -> Option<&vision::landmarks::Face> {
        self.look(frame)?.face.as_ref()
    }

    /// Frames that were looked at, ascending.
    pub(crate) fn looked(&self) -> Vec<usize> {
        (0..self.frames.len()).filter(|&frame| self.look(frame).is_some()).collect()
    }

    /// How many frames were looked at, and how many of them show the face.
    pub fn counts(&self) -> (usize, usize) {
        let looked = self.looked();
        let seen = looked.iter().filter(|&&frame| self.face(frame).is_some()).count();
        (looked.len(), seen)
    }

    /// Distance between the eyes where the face is large and turned to the camera, pixels: the upper decile.
    pub(crate) fn eye_distance(&self) -> f64 {
        let seen = (0..self.frames.len()).filter_map(|frame| self.face(frame));
        let mut distances: Vec<f64> = seen.map(vision::landmarks::Face::eye_distance).collect();
        distances.sort_by(f64::total_cmp);
        distances.get(distances.len() * 9 / 10).copied().unwrap_or(0.0)
    }

    /// What the face's pixels usually say of light and cover.
    pub(crate) fn appearance(&self) -> Option<Appearance> {
        let looks = self.frames.iter().filter_map(|frame| frame.look.as_ref());
        Appearance::usual(&looks.filter_map(|look| look.face.as_ref().and(look.appearance)).collect::<Vec<_>>())
    }

    /// Of every frame, whether it is of another shot than the one that is followed.
    pub(crate) fn other_shots(&self) -> Vec<bool> {
        let mut other = false;
        let of = |frame: &FaceFrame| {
            // Where a shot ends, the frames on both sides were looked at.
            other = frame.look.as_ref().map_or(other, |look| look.other_shot);
            other
        };
        self.frames.iter().map(of).collect()
    }

    /// What is left out because the film is cut.
    fn cut_warning(&self) -> Option<String> {
        let others = self.other_shots();
        let count = others.iter().filter(|other| **other).count();
        let first = (1..others.len()).find(|&f| others[f] != others[f - 1])?;
        let (name, used) = (&self.frames[first].name, others.len() - count);
        Some(format!(
            "picture and face change at once at frame {name}: a cut. The longest shot was used, {used} of {} frames. Give the frames of \
             one shot if it is the wrong one",
            others.len()
        ))
    }

    /// What the artist should know.
    pub fn warnings(&self) -> Vec<String> {
        let looks = || self.frames.iter().filter_map(|frame| frame.look.as_ref());
        let several = looks().filter(|look| look.face.as_ref().is_some_and(|face| face.faces_in_picture > 1)).count();
        let rivals = looks().filter(|look| look.rival).count();
        let count = looks().count();
        let mut warnings: Vec<String> = self.cut_warning().into_iter().collect();
        if several > 0 {
            warnings.push(format!(
                "{several} of {count} frames looked at show several faces: {}",
                self.followed.sentence()
            ));
        }
        if rivals > 0 {
            warnings.push(format!(
                "in about {rivals} of them another face becomes the largest: the one of the frames before was kept. If it is \
                 the wrong one, begin the clip where the right one is the largest"
            ));
        }
        warnings
    }
}
