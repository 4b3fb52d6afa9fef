//! A quick look at a clip before any work: is it worth it, and what is missing?
//!
//! # Entry points
//! - [`survey`]: the command; [`Survey`] is what it gives, [`Survey::part`] the same of a part of the clip, without another look.
//!
//! # Order of work
//! Some frames spread over the clip are read ([`spread`]), the nets look at them and the landmarks give a head, just as for a
//! reconstruction ([`crate::faces`]); [`check`] says in words what was measured.

mod check;
mod thumbnail;

pub use check::{Finding, FindingKind};

use crate::camera::starting_camera;
use crate::faces::{Clip, Known, face_box, qualities, yaw_pitch};
use crate::frames::{film_length, is_video, pictures_of};
use crate::reason::FrameReason;
use crate::{Appearance, Assets, FaceOptions, FacewrightError, FrameSet, ReasonKind, SizeOptions, SourcedCamera};
use check::Checked;
use geometry::{Progress, Transform, Vec3};
use image::RgbImage;
use serde::Serialize;
use std::path::PathBuf;

/// Frames that are looked at, at most: a head that turns once and back within a clip is seen from both sides, and a clip of a webcam is
/// surveyed while its user reaches for the next button.
const LOOKS: usize = 48;
/// Times of the steps: frames are read, the nets look, thumbnails are made.
const PARTS: [f64; 3] = [0.4, 0.55, 0.05];

/// What a clip shows, by some of its frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Survey {
    /// Version of Facewright.
    pub version: String,
    /// How many frames the clip has, or those of its numbers that were given.
    pub frames: usize,
    /// Their numbers, ascending.
    #[serde(skip)]
    numbers: Vec<usize>,
    /// Width of the frames, pixels.
    pub width: u32,
    /// Height of the frames, pixels.
    pub height: u32,
    /// The frames that were looked at, in order.
    pub looks: Vec<SurveyedFrame>,
    /// How far the head turns, and how many of the frames that were looked at can be used, in words.
    pub summary: Vec<String>,
    /// What speaks against a reconstruction, and what helps; empty for a good clip.
    pub findings: Vec<Finding>,
}

/// A frame that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurveyedFrame {
    /// Its number in the clip, counted from 0.
    pub number: usize,
    /// File name without extension.
    pub name: String,
    /// Whether shape and texture could be taken from it.
    pub usable: bool,
    /// How far the head is turned, or why the frame is of no use.
    pub reason: String,
    /// The same as a word.
    pub reason_kind: ReasonKind,
    /// What was measured of the face that is followed; `null` without one.
    pub face: Option<SurveyedFace>,
    /// The whole picture, small.
    #[serde(skip)]
    pub thumbnail: RgbImage,
}

/// A face in a frame that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurveyedFace {
    /// The rectangle around its landmarks: left, top, width, height, pixels.
    pub rectangle: [u32; 4],
    /// Turn of the head about its vertical axis: positive where the nose points to the right of the picture, degrees.
    pub yaw_deg: f64,
    /// Positive where it looks up, degrees.
    pub pitch_deg: f64,
    /// Positive where the crown leans to the right of the picture, degrees.
    pub roll_deg: f64,
    /// Distance between the eyes, pixels.
    pub eye_distance_px: f64,
    /// As [`crate::Look::sharpness`]: compare within a clip.
    pub sharpness: f64,
    /// What its pixels say of light and cover.
    pub appearance: Appearance,
    /// How many faces the picture shows.
    pub faces_in_picture: usize,
}

/// Looks at some frames of a clip: of one video or folder all, or those of some `numbers`, ascending and counted from 0; or of pictures, in
/// the order of time. A clip without a face is no error: the survey says so.
///
/// # Errors
/// [`FacewrightError::Option`] for several videos; those of reading the frames; [`FacewrightError::OtherCamera`];
/// [`FacewrightError::Cancelled`].
pub fn survey(
    (inputs, numbers): (&[PathBuf], Option<&[usize]>),
    assets: &Assets,
    (camera, person): (Option<&SourcedCamera>, &FaceOptions),
    progress: &Progress,
) -> Result<Survey, FacewrightError> {
    let [reading, looking, drawing] = progress.split(&PARTS);
    let Opened { all, wanted, frames } = open(inputs, numbers, &reading)?;
    let camera = starting_camera(&frames, camera)?;
    let known = Known { faces: None, camera: &camera, size: &SizeOptions::default(), person };
    let looked = match Clip::look(&frames, assets, &known, &looking) {
        Ok(clip) => looks(&clip),
        Err(FacewrightError::NoFace { .. }) => vec![(None, Err(FrameReason::NoFace)); frames.len()],
        Err(error) => return Err(error),
    };
    let thumbnails = thumbnail::of_all(&frames, &drawing)?;
    let named = wanted.into_iter().zip(frames.frames.iter().map(|frame| frame.name.clone()));
    let surveyed = named.zip(looked.into_iter().zip(thumbnails)).map(frame_of).collect();
    progress.done()?;
    Ok(Survey::of(all, (frames.width, frames.height), surveyed))
}

impl Survey {
    /// Of the frames of a clip that were looked at.
    fn of(numbers: Vec<usize>, (width, height): (u32, u32), looks: Vec<SurveyedFrame>) -> Self {
        let (version, frames) = (env!("CARGO_PKG_VERSION").to_owned(), numbers.len());
        let Checked { summary, findings } = check::check(frames, &looks);
        Self { version, frames, numbers, width, height, looks, summary, findings }
    }

    /// What those of the frames show whose numbers are wanted.
    pub fn part(&self, is_wanted: impl Fn(usize) -> bool) -> Self {
        let looks = self.looks.iter().filter(|look| is_wanted(look.number)).cloned().collect();
        let numbers = self.numbers.iter().copied().filter(|&number| is_wanted(number)).collect();
        Self::of(numbers, (self.width, self.height), looks)
    }
}

/// What was opened of a clip: the numbers of its frames, those of the frames that are looked at, and these.
struct Opened {
    all: Vec<usize>,
    wanted: Vec<usize>,
    frames: FrameSet,
}

fn open(inputs: &[PathBuf], numbers: Option<&[usize]>, progress: &Progress) -> Result<Opened, FacewrightError> {
    let given = numbers.map(<[usize]>::to_vec);
    if let [video] = inputs
        && is_video(video)
    {
        let all = given.map_or_else(|| film_length(video).map(|length| (0..length).collect()), Ok)?;
        let wanted = spread(&all);
        let frames = FrameSet::open_numbers(inputs, Some(&wanted), progress)?;
        return Ok(Opened { all, wanted, frames });
    }
    if inputs.iter().any(|input| is_video(input)) {
        return Err(FacewrightError::Option { name: "the clip", expected: "one video, one folder, or pictures" });
    }
    let pictures: Result<Vec<_>, _> = inputs.iter().map(|input| pictures_of(input)).collect();
    let pictures: Vec<PathBuf> = pictures?.into_iter().flatten().collect();
    let all = given.unwrap_or_else(|| (0..pictures.len()).collect());
    let wanted = spread(&all);
    let of = |&number: &usize| {
        pictures.get(number).cloned().ok_or_else(|| FacewrightError::Read {
            path: inputs.first().cloned().unwrap_or_default(),
            reason: format!("it has {} frames, counted from 0: there is no frame {number}", pictures.len()),
        })
    };
    let paths: Result<Vec<_>, _> = wanted.iter().map(of).collect();
    Ok(Opened { all, frames: FrameSet::open(&paths?, progress)?, wanted })
}

/// Numbers spread over all, with the first and the last.
fn spread(all: &[usize]) -> Vec<usize> {
    let (count, looks) = (all.len(), all.len().min(LOOKS));
    let place = |k: usize| if looks < 2 { 0 } else { (k * (count - 1) + (looks - 1) / 2) / (looks - 1) };
    (0..looks).map(|k| all[place(k)]).collect()
}

type Look = (Option<SurveyedFace>, Result<FrameReason, FrameReason>);

/// What is known of each frame of a clip.
fn looks(clip: &Clip) -> Vec<Look> {
    let look = |(frame, verdict): (usize, Result<f64, FrameReason>)| {
        let face = face_of(clip, frame);
        let yaw = face.as_ref().map_or(0.0, |face| face.yaw_deg);
        (face, verdict.map(|_| FrameReason::Yaw(yaw)))
    };
    qualities(clip).into_iter().enumerate().map(look).collect()
}

fn face_of(clip: &Clip, frame: usize) -> Option<SurveyedFace> {
    let (look, pose) = (clip.faces.look(frame)?, clip.known.pose(frame)?);
    let face = look.face.as_ref()?;
    let (yaw, pitch) = yaw_pitch(&pose);
    Some(SurveyedFace {
        rectangle: face_box(face, (clip.frames.width, clip.frames.height)),
        yaw_deg: yaw.to_degrees(),
        pitch_deg: pitch.to_degrees(),
        roll_deg: roll(&pose).to_degrees(),
        eye_distance_px: face.eye_distance(),
        sharpness: look.sharpness,
        appearance: look.appearance?,
        faces_in_picture: face.faces_in_picture,
    })
}

fn frame_of(((number, name), ((face, verdict), thumbnail)): ((usize, String), (Look, RgbImage))) -> SurveyedFrame {
    let (Ok(reason) | Err(reason)) = &verdict;
    let (usable, reason, reason_kind) = (verdict.is_ok(), reason.to_string(), reason.kind());
    SurveyedFrame { number, name, usable, reason, reason_kind, face, thumbnail }
}

/// Lean of the head as the camera sees it, radians: positive where the crown is to the right.
fn roll(cam_from_head: &Transform) -> f64 {
    let crown = cam_from_head.rotation * Vec3::y();
    crown.x.atan2(-crown.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn looks_are_spread_from_the_first_frame_to_the_last() {
        assert_eq!((spread(&[]), spread(&[7]), spread(&[3, 5, 9])), (vec![], vec![7], vec![3, 5, 9]));
        let long = spread(&(0..1337).collect::<Vec<_>>());
        assert_eq!((long.len(), long[0], long[LOOKS - 1]), (LOOKS, 0, 1336));
        assert!(long.windows(2).all(|two| (28..=29).contains(&(two[1] - two[0]))));
    }

    #[test]
    fn a_head_that_leans_to_the_right_of_the_picture_has_a_positive_roll() {
        let facing = Rotation3::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
        for degrees in [-25.0_f64, 0.0, 40.0] {
            let lean = Rotation3::from_axis_angle(&Vec3::z_axis(), degrees.to_radians());
            let pose = Transform::new(lean * facing, Vec3::new(0.0, 0.0, 0.7));
            assert!((roll(&pose).to_degrees() - degrees).abs() < 1e-9);
        }
    }
}
