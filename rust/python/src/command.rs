//! Command lines of the program, from Python.

use crate::error::usage;
use crate::options::{
    CalibrateOptions, MatchOptions, MotionOptions, ReconstructOptions, SheetOptions, TrackOptions, UndistortOptions,
    fields_of,
};
use crate::values::dictionary;
use facewright::program::{self, Arguments, Command as CoreCommand};
use geometry::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

/// How often signals are polled.
const POLL: Duration = Duration::from_millis(50);

/// A command line that was parsed: the command's name, its files and options.
#[pyclass(frozen, module = "facewright")]
pub struct Command {
    arguments: Arguments,
    name: String,
    files: serde_json::Map<String, Value>,
}

impl Command {
    fn new(arguments: Arguments) -> PyResult<Self> {
        let Some((name, Value::Object(mut files))) = fields_of(&arguments.command)?.into_iter().next() else {
            return Err(PyRuntimeError::new_err("the command has no fields"));
        };
        files.remove("options");
        Ok(Self { arguments, name, files })
    }
}

#[pymethods]
impl Command {
    /// The command's name, like "track".
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// What it reads and writes, under the names in the help: paths as text, None where nothing was given.
    #[getter]
    fn files<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        dictionary(py, &self.files)
    }

    /// Its options, of the class that the function of the same name takes; None where it has none.
    #[getter]
    fn options(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        Ok(Some(match &self.arguments.command {
            CoreCommand::Board(command) => Py::new(py, SheetOptions(command.options.clone()))?.into_any(),
            CoreCommand::Calibrate(command) => Py::new(py, CalibrateOptions(command.options.clone()))?.into_any(),
            CoreCommand::Undistort(command) => Py::new(py, UndistortOptions(command.options.clone()))?.into_any(),
            CoreCommand::Match(command) => Py::new(py, MatchOptions(command.options))?.into_any(),
            CoreCommand::Track(command) => Py::new(py, TrackOptions(command.options.clone()))?.into_any(),
            CoreCommand::Motion(command) => Py::new(py, MotionOptions(command.options.clone()))?.into_any(),
            CoreCommand::Reconstruct(command) => Py::new(py, ReconstructOptions(command.options.clone()))?.into_any(),
            CoreCommand::Faces(_) | CoreCommand::Survey(_) | CoreCommand::Overlay(_) => return Ok(None),
        }))
    }

    /// Folder of the assets, if one was given.
    #[getter]
    fn assets(&self) -> Option<PathBuf> {
        self.arguments.assets.clone()
    }

    /// Whether to print the result as JSON.
    #[getter]
    fn json(&self) -> bool {
        self.arguments.json
    }
}

/// Parse a command line of the `facewright` program, without its name, and run nothing.
///
/// `program` is its name in help and errors. Raises UsageError if it cannot be parsed, or if help is asked for.
#[pyfunction]
#[pyo3(signature = (arguments, *, program = "facewright"))]
pub fn parse_command(py: Python<'_>, arguments: Vec<OsString>, program: &str) -> PyResult<Command> {
    Command::new(program::parse(program, arguments).map_err(|e| usage(py, &e))?)
}

/// Run a command line of the `facewright` program, print what it prints, and return the exit code.
///
/// `program` is its name in help and errors. An interrupt cancels the work.
#[pyfunction]
#[pyo3(signature = (arguments, *, program = "facewright"))]
pub fn run(py: Python<'_>, arguments: Vec<OsString>, program: &str) -> PyResult<u8> {
    let progress = Progress::new();
    let (watched, program) = (progress.clone(), program.to_owned());
    let thread = std::thread::spawn(move || program::run(&program, arguments, &watched));
    let mut interrupted = Ok(());
    while !thread.is_finished() {
        py.detach(|| std::thread::sleep(POLL));
        if interrupted.is_ok() {
            interrupted = py.check_signals().inspect_err(|_| progress.cancel());
        }
    }
    interrupted?;
    py.detach(|| thread.join()).map_err(|_| PyRuntimeError::new_err("Facewright failed internally; please report it"))
}
