//! Work on a thread of its own, polled from Python.

use crate::reconstruction::Reconstruction;
use crate::{FacewrightError, files, raise};
use facewright::FacewrightError as CoreError;
use geometry::{Progress, ProgressSnapshot};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

/// What a job makes.
pub enum Output {
    /// A calibrated camera.
    Camera(Box<facewright::CalibratedCamera>),
    /// Calibrated cameras and where they stand.
    Rig(Box<facewright::CalibratedRig>),
    /// Points of a face in many frames.
    Tracks(Box<facewright::Tracks>),
    /// The pose of a head in every frame.
    Motion(Box<facewright::HeadMotion>),
    /// A head.
    Head(Box<facewright::Reconstruction>),
}

impl Output {
    fn into_python(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Self::Camera(camera) => Py::new(py, files::Camera::calibrated(*camera))?.into_any(),
            Self::Rig(rig) => Py::new(py, files::Rig::new(*rig))?.into_any(),
            Self::Tracks(tracks) => Py::new(py, files::Tracks::new(*tracks))?.into_any(),
            Self::Motion(motion) => Py::new(py, files::Motion::new(*motion))?.into_any(),
            Self::Head(head) => Py::new(py, Reconstruction::new(*head))?.into_any(),
        })
    }
}

type Outcome = Result<Output, CoreError>;

/// A running or finished job. The worker owns its input and never touches Python.
#[pyclass(frozen, module = "facewright", generic)]
pub struct Job {
    progress: Progress,
    thread: Mutex<Option<JoinHandle<Option<Outcome>>>>,
}

impl Job {
    /// Starts work. A panic in it becomes an error, not the end of Blender.
    pub fn start(work: impl FnOnce(&Progress) -> Outcome + Send + 'static) -> PyResult<Self> {
        let progress = Progress::new();
        let watched = progress.clone();
        let guarded = move || catch_unwind(AssertUnwindSafe(|| work(&watched))).ok();
        let thread = std::thread::Builder::new().name("facewright".into()).spawn(guarded);
        let thread = thread.map_err(|e| PyRuntimeError::new_err(format!("no thread can be started: {e}")))?;
        Ok(Self { progress, thread: Mutex::new(Some(thread)) })
    }

    fn take(&self) -> Option<JoinHandle<Option<Outcome>>> {
        self.thread.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

#[pymethods]
impl Job {
    fn progress(&self) -> (String, f64, Option<f64>) {
        let ProgressSnapshot { stage, fraction, remaining_s } = self.progress.snapshot();
        (stage, fraction, remaining_s)
    }

    fn finished(&self) -> bool {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    fn cancel(&self) {
        self.progress.cancel();
    }

    fn result(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let thread = self.take().ok_or_else(|| PyRuntimeError::new_err("the result was taken already"))?;
        let outcome = py.detach(|| thread.join().ok().flatten());
        match outcome {
            Some(Ok(output)) => output.into_python(py),
            Some(Err(error)) => Err(raise(&error)),
            None => Err(FacewrightError::new_err("Facewright failed inside; please report it with these frames")),
        }
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
