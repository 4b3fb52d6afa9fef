//! Files that commands read, and places that they write to.

use crate::faces::check_long_video;
use crate::frames::is_video;
use crate::{Assets, Faces, FacewrightError, FrameSet, HeadMotion, RigFrames, SourcedCamera, check_folder};
use geometry::Progress;
use std::borrow::Borrow;
use std::path::{Path, PathBuf};

/// Times of the steps of a command, in parts: its pictures are opened, then it works on them …
const PARTS: [f64; 2] = [0.03, 0.97];
/// … and of one with a video, which is decoded first.
const PARTS_OF_VIDEO: [f64; 2] = [0.05, 0.95];

fn parts<'i>(mut inputs: impl Iterator<Item = &'i Path>) -> &'static [f64; 2] {
    if inputs.any(is_video) { &PARTS_OF_VIDEO } else { &PARTS }
}

/// Opens the pictures of a command; also what is left of its progress for the work on them.
pub fn open(inputs: &[PathBuf], progress: &Progress) -> Result<(FrameSet, Progress), FacewrightError> {
    open_numbers(inputs, None, progress)
}

/// Opens the frames of a command that looks for a face in them, all or those of some numbers, and loads its assets. Of a long video a face is
/// sought first, if nobody has found it before.
pub fn open_clip<A: Borrow<Assets>>(
    (inputs, numbers): (&[PathBuf], Option<&[usize]>),
    faces: Option<&Faces>,
    load: impl FnOnce() -> Result<A, FacewrightError>,
    progress: &Progress,
) -> Result<(FrameSet, A, Progress), FacewrightError> {
    let video =
        inputs.first().filter(|video| inputs.len() == 1 && faces.is_none() && is_video(video) && video.is_file());
    let Some(video) = video else {
        let (frames, progress) = open_numbers(inputs, numbers, progress)?;
        return Ok((frames, load()?, progress));
    };
    let (assets, [seeking, progress]) = (load()?, progress.split(&PARTS));
    check_long_video(video, numbers, &assets.borrow().landmarker, &seeking)?;
    let (frames, progress) = open_numbers(inputs, numbers, &progress)?;
    Ok((frames, assets, progress))
}

/// Opens the pictures of some numbers only.
pub fn open_numbers(
    inputs: &[PathBuf],
    numbers: Option<&[usize]>,
    progress: &Progress,
) -> Result<(FrameSet, Progress), FacewrightError> {
    let [opening, working] = progress.split_steps(parts(inputs.iter().map(PathBuf::as_path)));
    Ok((FrameSet::open_numbers(inputs, numbers, &opening)?, working))
}

/// Whether frames are told apart by a rig's cameras, as in `left=DIR`; a file of such a name is a file.
pub(super) fn is_of_rig(inputs: &[PathBuf]) -> bool {
    !inputs.is_empty() && inputs.iter().all(|input| !input.exists() && named(input).is_some())
}

fn named(input: &Path) -> Option<(&str, &str)> {
    input.to_str()?.split_once('=').filter(|(name, frames)| !name.is_empty() && !frames.is_empty())
}

/// Opens the frames of a rig's cameras from `NAME=FRAMES`, several of one name together; also what is left of the progress.
pub fn open_films(inputs: &[PathBuf], progress: &Progress) -> Result<(Vec<RigFrames>, Progress), FacewrightError> {
    let frames = inputs.iter().filter_map(|input| named(input)).map(|(_, frames)| Path::new(frames));
    let [opening, working] = progress.split_steps(parts(frames));
    let mut all: Vec<(&str, Vec<PathBuf>)> = Vec::new();
    for input in inputs {
        let wrong = FacewrightError::Option { name: "frames of a rig", expected: "NAME=FRAMES, like left=DIR" };
        let (name, frames) = named(input).ok_or(wrong)?;
        match all.iter_mut().find(|(other, _)| *other == name) {
            Some((_, others)) => others.push(frames.into()),
            None => all.push((name, vec![frames.into()])),
        }
    }
    let parts = opening.split_evenly(all.len());
    let film = |((name, inputs), part): (&(&str, Vec<PathBuf>), &Progress)| {
        Ok(RigFrames { camera: (*name).to_owned(), frames: FrameSet::open(inputs, part)? })
    };
    Ok((all.iter().zip(&parts).map(film).collect::<Result<_, FacewrightError>>()?, working))
}

/// A calibrated camera, where one is given.
pub(super) fn camera(file: Option<&Path>) -> Result<Option<SourcedCamera>, FacewrightError> {
    file.map(SourcedCamera::read).transpose()
}

/// The faces of a clip, where they are given.
pub(super) fn faces(file: Option<&Path>) -> Result<Option<Faces>, FacewrightError> {
    file.map(Faces::read).transpose()
}

/// Reads a `motion.json`.
pub fn motion(file: &Path) -> Result<HeadMotion, FacewrightError> {
    HeadMotion::read(file)
}

/// Refuses a file that cannot be written before the work, not after it.
pub fn check_output(file: &Path) -> Result<(), FacewrightError> {
    check_folder(file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}
