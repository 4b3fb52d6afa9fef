//! Boards and cameras.

use crate::error::raise;
use crate::files::{Calibration, Camera, Or};
use crate::job::{Job, Output};
use crate::options::{CalibrateOptions, SheetOptions, UndistortOptions};
use drawing::Format;
use facewright::pictures::board::sheet;
use facewright::pictures::calibration::{DPI, of_camera, of_rig};
use facewright::program::open_numbers;
use facewright::{CameraFile, FacewrightError as CoreError, FrameSet, RigInput, write_drawing};
use geometry::Progress;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};

/// Write a board to print as the SVG, PDF or PNG that the path's extension says, exact at 100 % print scale.
///
/// `options` or further keywords are those of SheetOptions: the board, the page, the mark. Raises OptionError for a
/// board that cannot be or does not fit on the page, OutputError where the file cannot be written.
#[pyfunction]
#[pyo3(signature = (path, *, options = None, **fields))]
pub fn save_board(
    py: Python<'_>,
    path: PathBuf,
    options: Option<&Bound<'_, SheetOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    let options = SheetOptions::merged(options, fields)?;
    py.detach(|| write_drawing(&path, &sheet(&options)?, options.dpi)).map_err(|e| raise(&e))
}

/// Calibrate a camera from image files, folders or videos of a board; the job's result is a Camera.
///
/// `numbers` are those that are used of one video or folder, ascending and counted from 0, as Blender counts them.
/// `options` or further keywords are those of CalibrateOptions. The result is also drawn into `picture`, as by
/// save_calibration_picture.
///
/// Raises OptionError and OutputError at once. The job raises InputError for pictures that cannot be read, CameraError
/// where the board is found in too few of them, or they do not tell the camera.
#[pyfunction]
#[pyo3(signature = (pictures, *, numbers = None, picture = None, options = None, **fields))]
pub fn calibrate(
    pictures: Vec<PathBuf>,
    numbers: Option<Vec<usize>>,
    picture: Option<PathBuf>,
    options: Option<&Bound<'_, CalibrateOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = CalibrateOptions::merged(options, fields)?;
    check_picture(picture.as_deref())?;
    Job::start(move |progress| {
        let (frames, progress) = open_numbers(&pictures, numbers.as_deref(), progress)?;
        let calibrated = facewright::calibrate(&frames, &options, &progress)?;
        picture.map_or(Ok(()), |path| write_drawing(&path, &of_camera(&calibrated), DPI))?;
        Ok(Output::Camera(Box::new(CameraFile::Calibrated(Box::new(calibrated)))))
    })
}

/// Calibrate cameras that saw one board at the same moments, and find their poses; the job's result is a Rig.
///
/// `cameras` are (name, pictures), two or more. Pictures with the same number at the end of their names belong to one
/// moment; without numbers, the k-th ones of all cameras do. `options`, `picture` and errors are those of calibrate;
/// CameraError also where pictures of the cameras do not belong together.
#[pyfunction]
#[pyo3(signature = (cameras, *, picture = None, options = None, **fields))]
pub fn calibrate_rig(
    cameras: Vec<(String, Vec<PathBuf>)>,
    picture: Option<PathBuf>,
    options: Option<&Bound<'_, CalibrateOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = CalibrateOptions::merged(options, fields)?;
    check_picture(picture.as_deref())?;
    Job::start(move |progress| {
        let [opening, working] = progress.split(&[0.03, 0.97]);
        let parts = opening.split_evenly(cameras.len());
        let inputs = cameras.into_iter().zip(&parts).map(|(camera, part)| rig_input(camera, part));
        let inputs: Vec<RigInput> = inputs.collect::<Result<_, _>>()?;
        let calibrated = facewright::calibrate_rig(&inputs, &options, &working)?;
        picture.map_or(Ok(()), |path| write_drawing(&path, &of_rig(&calibrated), DPI))?;
        Ok(Output::Rig(Box::new(calibrated)))
    })
}

fn rig_input((name, pictures): (String, Vec<PathBuf>), progress: &Progress) -> Result<RigInput, CoreError> {
    Ok(RigInput { name, pictures: FrameSet::open(&pictures, progress)? })
}

/// Refuses another kind of picture before the work, not after it.
pub fn check_picture(picture: Option<&Path>) -> PyResult<()> {
    picture.map(Format::of).transpose().map(drop).map_err(|e| raise(&e.into()))
}

/// Draw a Camera or a Rig, or the text of either's file, into the SVG, PDF or PNG that the path's extension says.
///
/// Raises OutputError where the file cannot be written, FacewrightError for a camera that does not tell of the boards
/// it was calibrated from.
#[pyfunction]
pub fn save_calibration_picture(py: Python<'_>, calibration: Calibration, path: PathBuf) -> PyResult<()> {
    let drawing = calibration.drawing()?;
    py.detach(|| write_drawing(&path, &drawing, DPI)).map_err(|e| raise(&e))
}

/// Write image files, folders of them or videos without lens distortion into a folder, as PNG under their names.
///
/// `camera` is a Camera, or the text of its file. The job's result is the Camera of the new pictures, which is also
/// left as camera.json among them. `numbers` are those that are used of one video or folder, ascending and counted from
/// 0, as Blender counts them. `options` or further keywords are those of UndistortOptions.
///
/// Raises OutputError at once where the folder cannot be written. The job raises InputError for pictures that cannot be
/// read, CameraError for the camera of another size.
#[pyfunction]
#[pyo3(signature = (pictures, folder, *, camera, numbers = None, options = None, **fields))]
pub fn undistort(
    pictures: Vec<PathBuf>,
    folder: PathBuf,
    camera: Or<Camera>,
    numbers: Option<Vec<usize>>,
    options: Option<&Bound<'_, UndistortOptions>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<Job> {
    let options = UndistortOptions::merged(options, fields)?;
    let camera = camera.sourced()?;
    facewright::check_folder(&folder).map_err(|e| raise(&e))?;
    Job::start(move |progress| {
        let (frames, progress) = open_numbers(&pictures, numbers.as_deref(), progress)?;
        let straight = facewright::undistort(&frames, &camera, &options, &folder, &progress)?;
        Ok(Output::Camera(Box::new(CameraFile::Numbers(straight))))
    })
}
