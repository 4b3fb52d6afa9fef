//! `rig.json`.

use super::{Camera, Numbers, Or, Rows, file_class, matrix, rows};
use crate::error::FacewrightError;
use drawing::Drawing;
use facewright::pictures::calibration::{of_camera, of_rig};
use facewright::{CalibratedRig, CameraFile};
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::Arc;

/// A rig.json: several cameras that were calibrated together, and their poses.
///
/// The rig's frame is that of its first camera: x right, y down, z forward, metres.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Rig(Arc<CalibratedRig>);

file_class!(Rig, CalibratedRig, "rig.json");

#[pymethods]
impl Rig {
    /// The cameras, in the order given.
    #[getter]
    fn cameras(&self) -> Vec<MountedCamera> {
        (0..self.0.cameras.len()).map(|number| MountedCamera { rig: self.0.clone(), number }).collect()
    }

    /// Their names.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.cameras.iter().map(|camera| camera.name.clone()).collect()
    }

    /// One of the cameras by its name, as a camera.json; raises CameraError where there is none.
    fn camera(&self, name: &str) -> PyResult<Camera> {
        let found = self.0.camera(name).map_err(|e| crate::raise(&e))?;
        Ok(Camera::calibrated(found.calibrated.clone()))
    }

    /// Root mean square reprojection error of all corners, pixels.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.0.rms_px
    }

    /// The hold-out error: of each moment, with a calibration without it.
    #[getter]
    fn hold_out_rms_px(&self) -> Option<f64> {
        self.0.hold_out_rms_px
    }

    /// What to photograph next, and what to distrust.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    fn __len__(&self) -> usize {
        self.0.cameras.len()
    }

    fn __repr__(&self) -> String {
        format!("<facewright.Rig: {}>", self.names().join(", "))
    }
}

/// A camera of a rig, and its pose.
#[pyclass(frozen, module = "facewright")]
pub struct MountedCamera {
    rig: Arc<CalibratedRig>,
    number: usize,
}

impl MountedCamera {
    fn core(&self) -> &facewright::MountedCamera {
        &self.rig.cameras[self.number]
    }
}

#[pymethods]
impl MountedCamera {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.core().name
    }

    /// All of its camera.json.
    #[getter]
    fn camera(&self) -> Camera {
        Camera::calibrated(self.core().calibrated.clone())
    }

    /// (4, 4) its pose, metres; the identity for the first one.
    #[getter]
    fn camera_from_rig<'py>(&self, py: Python<'py>) -> Rows<'py> {
        matrix(py, &self.core().mount.camera_from_rig)
    }

    /// (3,) standard deviations of small rotations about its axes, radians.
    #[getter]
    fn rotation_deviations<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, &self.core().mount.rotation_deviations)
    }

    /// (3,) standard deviations of the translation along its axes, metres.
    #[getter]
    fn translation_deviations<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, &self.core().mount.translation_deviations)
    }

    /// (6, 6) covariance of both, in this order.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, &self.core().mount.covariance)
    }

    /// Distance of its centre from the first camera's, metres.
    #[getter]
    fn baseline(&self) -> f64 {
        self.core().mount.baseline
    }

    /// Standard deviation of that distance.
    #[getter]
    fn baseline_deviation(&self) -> f64 {
        self.core().mount.baseline_deviation
    }

    fn __repr__(&self) -> String {
        format!("<facewright.MountedCamera {}: {:.3} m from the first>", self.name(), self.baseline())
    }
}

impl Or<Rig> {
    /// The rig.
    pub fn core(&self) -> PyResult<CalibratedRig> {
        match self {
            Self::Class(rig) => Ok((*rig.0).clone()),
            Self::Text(text) => CalibratedRig::parse(text).map_err(|e| crate::raise(&e)),
        }
    }
}

/// A camera or a rig, or the text of either's file.
#[derive(FromPyObject)]
pub enum Calibration {
    /// A camera.
    Camera(Camera),
    /// A rig.
    Rig(Rig),
    /// The text.
    Text(String),
}

impl Calibration {
    /// The picture of its boards, corners, errors and numbers.
    pub fn drawing(&self) -> PyResult<Drawing> {
        match self {
            Self::Camera(camera) => of_file(camera.core()),
            Self::Rig(rig) => Ok(of_rig(&rig.0)),
            Self::Text(text) => match CalibratedRig::parse(text) {
                Ok(rig) => Ok(of_rig(&rig)),
                Err(_) => of_file(&CameraFile::parse(text).map_err(|e| crate::raise(&e))?),
            },
        }
    }
}

fn of_file(camera: &CameraFile) -> PyResult<Drawing> {
    let told = camera.calibration().map(of_camera);
    told.ok_or_else(|| FacewrightError::new_err("this camera does not say which boards it was calibrated from"))
}
