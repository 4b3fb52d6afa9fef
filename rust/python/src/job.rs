//! Work on a thread of its own, polled from Python.

use crate::error::{FacewrightError, raise};
use crate::files;
use crate::reconstruction::{Reconstruction, vectors};
use crate::survey::Survey;
use facewright::FacewrightError as CoreError;
use geometry::{Progress, ProgressSnapshot};
use numpy::PyArray2;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use serde::Serialize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// How often it is looked whether a job has ended or is interrupted.
const POLL: Duration = Duration::from_millis(10);

/// What a job makes.
pub enum Output {
    /// Nothing but that it went well.
    Nothing,
    /// JSON.
    Text(String),
    /// A camera.
    Camera(Box<facewright::CameraFile>),
    /// Calibrated cameras and their poses.
    Rig(Box<facewright::CalibratedRig>),
    /// Faces in the frames of a clip.
    Faces(Box<facewright::Faces>),
    /// What a clip shows.
    Survey(Box<facewright::Survey>),
    /// Points of a face in many frames.
    Tracks(Box<facewright::Tracks>),
    /// The pose of a head in every frame.
    Motion(Box<facewright::HeadMotion>),
    /// Names of frames.
    Names(Vec<String>),
    /// A head.
    Head(Box<facewright::Reconstruction>),
}

impl Output {
    /// A value as JSON.
    pub fn json(value: &impl Serialize) -> Self {
        // Our own types have string keys and finite numbers: serialisation cannot fail.
        Self::Text(serde_json::to_string(value).unwrap_or_default())
    }

    fn into_python(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Self::Nothing => py.None(),
            Self::Text(text) => text.into_pyobject(py)?.into_any().unbind(),
            Self::Camera(camera) => Py::new(py, files::Camera::new(*camera))?.into_any(),
            Self::Rig(rig) => Py::new(py, files::Rig::new(*rig))?.into_any(),
            Self::Faces(faces) => Py::new(py, files::Faces::new(*faces))?.into_any(),
            Self::Survey(survey) => Py::new(py, Survey::new(*survey))?.into_any(),
            Self::Tracks(tracks) => Py::new(py, files::Tracks::new(*tracks))?.into_any(),
            Self::Motion(motion) => Py::new(py, files::Motion::new(*motion))?.into_any(),
            Self::Names(names) => names.into_pyobject(py)?.into_any().unbind(),
            Self::Head(head) => Py::new(py, Reconstruction::new(*head))?.into_any(),
        })
    }
}

type Outcome = Result<Output, CoreError>;

/// Work on a thread of its own, which never touches Python. Dropping the job cancels it.
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
    /// Name of the present stage, the fraction of the whole work that is done, 0 to 1, and seconds left.
    ///
    /// The fraction never decreases; the seconds are None until they can be estimated.
    fn progress(&self) -> (String, f64, Option<f64>) {
        let ProgressSnapshot { stage, fraction, remaining_s, .. } = self.progress.snapshot();
        (stage, fraction, remaining_s)
    }

    /// Number of the present step, counted from 1, and of all steps; None where the work has only one.
    fn step(&self) -> Option<(usize, usize)> {
        self.progress.snapshot().step
    }

    /// What a reconstruction has of the head so far: its number, and (n, 3) vertices as a Reconstruction has them.
    ///
    /// None before the first, and while there is none after the one of the number `after`.
    #[pyo3(signature = (after = 0))]
    fn sketch<'py>(&self, py: Python<'py>, after: usize) -> Option<(usize, Bound<'py, PyArray2<f32>>)> {
        let sketch = self.progress.sketch().filter(|sketch| sketch.number > after)?;
        Some((sketch.number, vectors(py, &sketch.positions)))
    }

    /// Whether result() returns immediately.
    fn finished(&self) -> bool {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Ask the work to stop; it does within a fraction of a second.
    fn cancel(&self) {
        self.progress.cancel();
    }

    /// Wait for the result. Raises FacewrightError, or Cancelled. Call once. An interrupt cancels the work.
    fn result(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let thread = self.take().ok_or_else(|| PyRuntimeError::new_err("the result has already been taken"))?;
        let mut interrupted = Ok(());
        while !thread.is_finished() {
            py.detach(|| std::thread::sleep(POLL));
            if interrupted.is_ok() {
                interrupted = py.check_signals().inspect_err(|_| self.progress.cancel());
            }
        }
        interrupted?;
        let outcome = py.detach(|| thread.join().ok().flatten());
        match outcome {
            Some(Ok(output)) => output.into_python(py),
            Some(Err(error)) => Err(raise(&error)),
            None => Err(FacewrightError::new_err("Facewright failed internally; please report it with these frames")),
        }
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
