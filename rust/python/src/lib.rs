//! Python binding: checks arguments, starts jobs, passes arrays on. Nothing is computed here.

mod assets;
mod cameras;
mod command;
mod error;
mod files;
mod given;
mod heads;
mod job;
mod options;
mod reconstruction;
mod survey;
mod values;

pub(crate) use error::raise;

use geometry::Progress;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Version of the library.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Raise OutputError when a result folder cannot be written; nothing is left behind.
#[pyfunction]
fn check_folder(folder: PathBuf) -> PyResult<()> {
    facewright::check_folder(&folder).map_err(|e| raise(&e))
}

/// The pictures of a folder, in the order in which they are taken for frames; hidden files are none.
#[pyfunction]
fn pictures_in(folder: PathBuf) -> PyResult<Vec<PathBuf>> {
    facewright::pictures_in(&folder).map_err(|e| raise(&e))
}

/// Width and height of a video's frames, upright and of square pixels, as they are decoded here.
///
/// Raises InputError where it cannot be, and SetupError where there is no ffmpeg. An interrupt is not heard: it takes a
/// moment.
#[pyfunction]
fn video_size(py: Python<'_>, video: PathBuf) -> PyResult<(u32, u32)> {
    py.detach(|| facewright::video_size(&video, &Progress::new())).map_err(|e| raise(&e))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    options::add(module)?;
    files::add_classes(module)?;
    module.add_class::<assets::Assets>()?;
    module.add_class::<command::Command>()?;
    module.add_class::<job::Job>()?;
    module.add_class::<reconstruction::Reconstruction>()?;
    module.add_class::<survey::Survey>()?;
    module.add_class::<survey::SurveyedFrame>()?;
    module.add_function(wrap_pyfunction!(version, module)?)?;
    module.add_function(wrap_pyfunction!(check_folder, module)?)?;
    module.add_function(wrap_pyfunction!(pictures_in, module)?)?;
    module.add_function(wrap_pyfunction!(video_size, module)?)?;
    module.add_function(wrap_pyfunction!(cameras::save_board, module)?)?;
    module.add_function(wrap_pyfunction!(cameras::calibrate, module)?)?;
    module.add_function(wrap_pyfunction!(cameras::calibrate_rig, module)?)?;
    module.add_function(wrap_pyfunction!(cameras::save_calibration_picture, module)?)?;
    module.add_function(wrap_pyfunction!(cameras::undistort, module)?)?;
    module.add_function(wrap_pyfunction!(heads::match_pair, module)?)?;
    module.add_function(wrap_pyfunction!(heads::find_faces, module)?)?;
    module.add_function(wrap_pyfunction!(heads::survey, module)?)?;
    module.add_function(wrap_pyfunction!(heads::check_face, module)?)?;
    module.add_function(wrap_pyfunction!(heads::track, module)?)?;
    module.add_function(wrap_pyfunction!(heads::motion, module)?)?;
    module.add_function(wrap_pyfunction!(heads::motion_on_rig, module)?)?;
    module.add_function(wrap_pyfunction!(heads::reconstruct, module)?)?;
    module.add_function(wrap_pyfunction!(heads::reconstruct_on_rig, module)?)?;
    module.add_function(wrap_pyfunction!(heads::overlay, module)?)?;
    module.add_function(wrap_pyfunction!(heads::overlay_on_rig, module)?)?;
    module.add_function(wrap_pyfunction!(heads::generic_head, module)?)?;
    module.add_function(wrap_pyfunction!(command::parse_command, module)?)?;
    module.add_function(wrap_pyfunction!(command::run, module)?)
}
