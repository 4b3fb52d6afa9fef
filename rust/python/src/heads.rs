//! Matches, tracks, motion and heads.

use crate::assets::AssetsArgument;
use crate::cameras::check_picture;
use crate::error::raise;
use crate::files::{Camera, Faces, Motion, Or, Rig, Tracks};
use crate::given::{self, given};
use crate::job::{Job, Output};
use crate::options::{MatchOptions, MotionOptions, ReconstructOptions, TrackOptions};
use crate::reconstruction::Reconstruction;
use facewright::program::{draw_match, match_steps, open_clip, open_frames};
use facewright::{
    FaceOptions, FacewrightError, FrameSet, Given, RigFrames, TRACK_STEPS, reconstruct_steps, solve_motion,
    solve_motion_on_rig,
};
use geometry::Progress;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Times of the steps with a rig, in parts: the frames are opened, then worked on.
const OPENING: [f64; 2] = [0.03, 0.97];

/// Match corners of the face between two frames; the job's result is the text of a matches.json, which Matches.parse
/// reads.
///
/// `a` and `b` are image files. `camera` is a Camera, or the text of its file; without it the focal length is
/// estimated. Both frames with their matches are also drawn into `picture`: SVG, PDF or PNG. `options` or further
/// keywords are those of MatchOptions.
///
/// Raises OptionError, and OutputError for another kind of picture, at once. The job raises InputError for frames that
/// cannot be read, SetupError without assets, CameraError for the camera of another size, FilmError where a face is
/// missing or hardly a match is right.
#[pyfunction]
#[pyo3(signature = (a, b, *, assets, camera = None, picture = None, options = None, **fields))]
pub fn match_pair(
    a: PathBuf,
    b: PathBuf,
    assets: AssetsArgument<'_>,
    camera: Option<Or<Camera>>,
    picture: Option<PathBuf>,
    options: Option<&Bound<'_, MatchOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = MatchOptions::merged(options, fields)?;
    check_picture(picture.as_deref())?;
    let (camera, assets) = (given::camera(camera.as_ref())?, assets.handle());
    Job::start(move |progress| {
        let [matching, drawing] = match_steps(progress, picture.is_some());
        let matches = facewright::match_pair(&a, &b, camera.as_ref(), &*assets.load()?, &options, &matching)?;
        picture.map_or(Ok(()), |file| draw_match(&matches.pairs[0], &a, &b, &file, &drawing))?;
        Ok(Output::json(&matches))
    })
}

/// Find the face in image files, folders or videos; the job's result is Faces.
///
/// `frames` are in the order of time, `numbers` those that are used of one video or folder, ascending and counted from
/// 0, as Blender counts them. `camera` is a Camera, or the text of its file; without it the focal length is
/// estimated. Of several faces, `face` is a pixel of the one to follow where the clip begins.
///
/// The job raises InputError for frames that cannot be read, CameraError for the camera of another size, FilmError
/// where no frame shows a face.
#[pyfunction]
#[pyo3(signature = (frames, *, assets, numbers = None, camera = None, face = None))]
pub fn find_faces(
    frames: Vec<PathBuf>,
    assets: AssetsArgument<'_>,
    numbers: Option<Vec<usize>>,
    camera: Option<Or<Camera>>,
    face: Option<(f64, f64)>,
) -> PyResult<Job> {
    let (given, assets) = (given(camera.as_ref(), None, None, None)?, assets.handle());
    let options = FaceOptions { face: face.map(Into::into) };
    Job::start(move |progress| {
        let inputs = (&frames[..], numbers.as_deref());
        let (frames, assets, progress) = open_clip(inputs, None, || assets.load(), progress)?;
        let faces = facewright::find_faces_of(&frames, &assets, given.camera.as_ref(), &options, &progress)?;
        Ok(Output::Faces(Box::new(faces)))
    })
}

/// Look at some frames of a clip, and say whether a head can be made of it; the job's result is a Survey.
///
/// `frames`, `numbers`, `camera` and `face` are as for find_faces, but of one video, one folder, or pictures. A clip
/// without a face is no error: the survey says so.
///
/// The job raises InputError for frames that cannot be read, CameraError for the camera of another size.
#[pyfunction]
#[pyo3(signature = (frames, *, assets, numbers = None, camera = None, face = None))]
pub fn survey(
    frames: Vec<PathBuf>,
    assets: AssetsArgument<'_>,
    numbers: Option<Vec<usize>>,
    camera: Option<Or<Camera>>,
    face: Option<(f64, f64)>,
) -> PyResult<Job> {
    let (given, assets) = (given(camera.as_ref(), None, None, None)?, assets.handle());
    let options = FaceOptions { face: face.map(Into::into) };
    Job::start(move |progress| {
        let (inputs, known) = ((&frames[..], numbers.as_deref()), (given.camera.as_ref(), &options));
        Ok(Output::Survey(Box::new(facewright::survey(inputs, &*assets.load()?, known, progress)?)))
    })
}

/// Look for a face in image files, no further than the first that shows one; the job's result is None.
///
/// `frames` is how many frames the clip has of which these pictures are some, which the error says.
///
/// The job raises InputError for pictures that cannot be read, FilmError where none shows a face.
#[pyfunction]
#[pyo3(signature = (pictures, *, assets, frames))]
pub fn check_face(pictures: Vec<PathBuf>, assets: AssetsArgument<'_>, frames: usize) -> PyResult<Job> {
    let assets = assets.handle();
    Job::start(move |progress| {
        facewright::check_face(&pictures, frames, &assets.load()?.landmarker, progress)?;
        Ok(Output::Nothing)
    })
}

/// Track points of the face through image files, folders or videos; the job's result is Tracks.
///
/// `frames` are in the order of time, two or more, `numbers` those that are used of one video or folder, ascending and
/// counted from 0, as Blender counts them. `camera` is a Camera, `faces` are those found in the same frames
/// before, or the texts of their files; without a camera the focal length is estimated. `options` or further keywords
/// are those of TrackOptions. Places are pixels of the picture as filmed: x right, y down, centres at integers.
///
/// Raises OptionError at once. The job raises InputError for frames that cannot be read, CameraError for the camera of
/// another size, TracksError for the faces of another clip, FilmError where no frame shows a face.
#[pyfunction]
#[pyo3(signature = (frames, *, assets, numbers = None, camera = None, faces = None, options = None, **fields))]
pub fn track(
    frames: Vec<PathBuf>,
    assets: AssetsArgument<'_>,
    numbers: Option<Vec<usize>>,
    camera: Option<Or<Camera>>,
    faces: Option<Or<Faces>>,
    options: Option<&Bound<'_, TrackOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = TrackOptions::merged(options, fields)?;
    let (given, assets) = (given(camera.as_ref(), faces.as_ref(), None, None)?, assets.handle());
    Job::start(move |progress| {
        let (camera, faces) = (given.camera.as_ref(), given.faces.as_ref());
        let inputs = (&frames[..], numbers.as_deref());
        let progress = progress.as_step(1, 1 + TRACK_STEPS);
        let (frames, assets, progress) = open_clip(inputs, faces, || assets.load(), &progress)?;
        let tracks = facewright::track(&frames, &assets, camera, faces, &options, &progress)?;
        Ok(Output::Tracks(Box::new(tracks)))
    })
}

/// Solve for the head's pose in every frame and the positions of its points; the job's result is a Motion.
///
/// `tracks` are Tracks, `camera` a Camera to take instead of theirs, or the texts of their files. `options` or further
/// keywords are those of MotionOptions; `lengths` are (number of a track, number of another, millimetres between them)
/// as measured on the head. Poses are (4, 4) cam_from_head, places are in the head frame, both in metres.
///
/// Raises OptionError at once. The job raises CameraError for the camera of another size, TracksError for tracks that
/// do not tell what is needed, FilmError where the head does not turn, or no motion explains its points.
#[pyfunction]
#[pyo3(signature = (tracks, *, camera = None, options = None, **fields))]
pub fn motion(
    tracks: Or<Tracks>,
    camera: Option<Or<Camera>>,
    options: Option<&Bound<'_, MotionOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = MotionOptions::merged(options, fields)?;
    let (tracks, camera) = (tracks.core()?, given::camera(camera.as_ref())?);
    Job::start(move |progress| {
        Ok(Output::Motion(Box::new(solve_motion(&tracks, camera.as_ref(), &options, progress)?)))
    })
}

/// Solve for the motion that the first film shows; the places of the rig's cameras give its size. The job's result is a
/// Motion.
///
/// `films` are (name of a camera of the rig, Tracks of the film that it took at the same moments), two or more, `rig`
/// is a Rig; the texts of their files will do.
///
/// The job raises CameraError for a camera that the rig has not, and for films that do not show the same moments; else
/// as motion does.
#[pyfunction]
pub fn motion_on_rig(films: Vec<(String, Or<Tracks>)>, rig: Or<Rig>) -> PyResult<Job> {
    let (films, rig) = given::films(&films, &rig)?;
    Job::start(move |progress| Ok(Output::Motion(Box::new(solve_motion_on_rig(&films, &rig, progress)?))))
}

/// Reconstruct the head in image files, folders or videos; the job's result is a Reconstruction.
///
/// `frames` are in the order of time, two or more, `numbers` those that are used of one video or folder, ascending and
/// counted from 0, as Blender counts them. `camera`, `faces`, `tracks` and `motion` of the same frames, or the
/// texts of their files: what is given is not found anew. `options` or further keywords are those of
/// ReconstructOptions. Nothing is written: Reconstruction.write does.
///
/// Raises OptionError at once. The job raises InputError for frames that cannot be read, CameraError for the camera of
/// another size, TracksError for what belongs to another clip, FilmError where the head does not turn or hardly a frame
/// is sharp, uncovered and quiet.
#[pyfunction]
#[pyo3(signature = (
    frames, *, assets, numbers = None, camera = None, faces = None, tracks = None, motion = None, options = None, **fields
))]
// As many as Python has keywords.
#[expect(clippy::too_many_arguments)]
pub fn reconstruct(
    frames: Vec<PathBuf>,
    assets: AssetsArgument<'_>,
    numbers: Option<Vec<usize>>,
    camera: Option<Or<Camera>>,
    faces: Option<Or<Faces>>,
    tracks: Option<Or<Tracks>>,
    motion: Option<Or<Motion>>,
    options: Option<&Bound<'_, ReconstructOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = ReconstructOptions::merged(options, fields)?;
    let (given, assets) = (given(camera.as_ref(), faces.as_ref(), tracks.as_ref(), motion.as_ref())?, assets.handle());
    Job::start(move |progress| {
        let inputs = (&frames[..], numbers.as_deref());
        let progress = progress.as_step(1, 1 + reconstruct_steps(&given, options.method));
        let (frames, assets, progress) = open_clip(inputs, given.faces.as_ref(), || assets.load(), &progress)?;
        let result = facewright::reconstruct(&frames, &assets, &given, &options, &progress)?;
        Ok(Output::Head(Box::new(result)))
    })
}

/// Reconstruct the head that a rig's cameras filmed at the same moments, or took one photograph each of; the job's
/// result is a Reconstruction in true size.
///
/// `films` are (name of a camera of the rig, its image files, folders or videos), two or more with as many frames each;
/// `rig` is a Rig, or the text of its file. `options` or further keywords are those of ReconstructOptions, whose method
/// and size are the rig's own here.
///
/// Raises OptionError at once. The job raises CameraError for a camera that the rig has not, for films of different
/// lengths and for cameras that see the head from one direction; else as reconstruct does.
#[pyfunction]
#[pyo3(signature = (films, rig, *, assets, options = None, **fields))]
pub fn reconstruct_on_rig(
    films: Vec<(String, Vec<PathBuf>)>,
    rig: Or<Rig>,
    assets: AssetsArgument<'_>,
    options: Option<&Bound<'_, ReconstructOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = ReconstructOptions::merged(options, fields)?;
    let (rig, assets) = (rig.core()?, assets.handle());
    Job::start(move |progress| {
        let steps = 1 + reconstruct_steps(&Given::default(), options.method);
        let (films, progress) = open_all(&films, &progress.as_step(1, steps))?;
        let result = facewright::reconstruct_on_rig(&films, &rig, &*assets.load()?, &options, &progress)?;
        Ok(Output::Head(Box::new(result)))
    })
}

/// The frames of a rig's cameras, and what is left of the progress.
fn open_all(
    films: &[(String, Vec<PathBuf>)],
    progress: &Progress,
) -> Result<(Vec<RigFrames>, Progress), FacewrightError> {
    let [opening, working] = progress.split_steps(&OPENING);
    let parts = opening.split_evenly(films.len());
    let film = |((camera, inputs), part): (&(String, Vec<PathBuf>), &Progress)| {
        Ok(RigFrames { camera: camera.clone(), frames: FrameSet::open(inputs, part)? })
    };
    Ok((films.iter().zip(&parts).map(film).collect::<Result<_, FacewrightError>>()?, working))
}

/// Draw the head that a rig filmed over the frames of its cameras, into PNG of the report's names, like left_0012; the
/// job's result is those names.
///
/// `films` are given as for reconstruct_on_rig, `result` and `folder` as for overlay, whose errors these are;
/// CameraError for a camera that the result does not know.
#[pyfunction]
pub fn overlay_on_rig(result: PathBuf, films: Vec<(String, Vec<PathBuf>)>, folder: PathBuf) -> PyResult<Job> {
    facewright::check_folder(&folder).map_err(|e| raise(&e))?;
    Job::start(move |progress| {
        let (films, progress) = open_all(&films, progress)?;
        Ok(Output::Names(facewright::overlay_on_rig(&result, &films, &folder, &progress)?))
    })
}

/// Draw the head of a result folder over its frames, into PNG of the frames' names; the job's result is the names of
/// the frames drawn.
///
/// `result` is a folder that Reconstruction.write has left, `frames` are the image files, folders or videos that it was
/// made from, `folder` is where the pictures go.
///
/// Raises OutputError at once where that cannot be written. The job raises InputError where `result` holds no result.
#[pyfunction]
pub fn overlay(result: PathBuf, frames: Vec<PathBuf>, folder: PathBuf) -> PyResult<Job> {
    facewright::check_folder(&folder).map_err(|e| raise(&e))?;
    Job::start(move |progress| {
        let (frames, progress) = open_frames(&frames, progress)?;
        Ok(Output::Names(facewright::overlay(&result, &frames, &folder, &progress)?))
    })
}

/// The generic head itself, with its own keys and a plain texture; its report is empty.
///
/// `assets` is a folder, or a handle; the nets are not needed. Raises SetupError where the head is missing.
#[pyfunction]
pub fn generic_head(py: Python<'_>, assets: AssetsArgument<'_>) -> PyResult<Reconstruction> {
    let assets = assets.handle();
    let head = py.detach(|| assets.with_head(facewright::generic_head)).map_err(|e| raise(&e))?;
    Ok(Reconstruction::new(head))
}
