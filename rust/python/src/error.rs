//! The library's errors as Python's, whose classes are in `facewright/errors.py`.

use facewright::{ErrorGroup, FacewrightError as CoreError};
use pyo3::exceptions::PyValueError;
use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(facewright.errors, FacewrightError);

/// The library's error as Python's.
pub(crate) fn raise(error: &CoreError) -> PyErr {
    Python::attach(|py| made(py, error).unwrap_or_else(|failed| failed))
}

fn made(py: Python<'_>, error: &CoreError) -> PyResult<PyErr> {
    let class = py.import("facewright.errors")?.getattr(class_of(error.group()))?;
    let made = class.call1((error.to_string(),))?;
    made.setattr("kind", error.kind())?;
    Ok(PyErr::from_value(made))
}

fn class_of(group: ErrorGroup) -> &'static str {
    match group {
        ErrorGroup::Input => "InputError",
        ErrorGroup::Output => "OutputError",
        ErrorGroup::Film => "FilmError",
        ErrorGroup::Camera => "CameraError",
        ErrorGroup::Tracks => "TracksError",
        ErrorGroup::Option => "OptionError",
        ErrorGroup::Setup => "SetupError",
        ErrorGroup::Cancelled => "Cancelled",
    }
}

/// A command line that cannot be read, or asks for help; the exit code tells.
pub(crate) fn usage(py: Python<'_>, error: &clap::Error) -> PyErr {
    let made = || -> PyResult<PyErr> {
        let made = py.import("facewright.errors")?.getattr("UsageError")?.call1((error.to_string(),))?;
        made.setattr("exit_code", error.exit_code())?;
        Ok(PyErr::from_value(made))
    };
    made().unwrap_or_else(|failed| failed)
}

/// A value that is not JSON, as of a path that is no text.
pub(crate) fn unwritten(error: &serde_json::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}
