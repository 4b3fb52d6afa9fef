//! `motion.json`.

use super::shared::{frame, made_by, measured};
use super::{Numbers, Or, Rows, file_class, rows, word};
use facewright::{FrameMotion, HeadMotion, PointMotion};
use geometry::Transform;
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray1, PyArray3};
use pyo3::prelude::*;
use std::sync::Arc;

/// A motion.json: the pose of the head in every frame, and a metric cloud of its points.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Motion(Arc<HeadMotion>);

file_class!(Motion, HeadMotion, "motion.json");
made_by!(
    Motion,
    method: "How it was solved: `default` or `paper`.",
    camera: "The camera, its focal length refined unless it was calibrated."
);
measured!(Motion);

#[pymethods]
impl Motion {
    /// Width and height of the pictures, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.0.camera.camera.width, self.0.camera.camera.height)
    }

    /// Standard deviation of a refined focal length, pixels; None where it was given.
    #[getter]
    fn focal_sigma_px(&self) -> Option<f64> {
        self.0.focal_sigma_px
    }

    /// Every frame of the tracks.
    #[getter]
    fn frames(&self) -> Vec<MotionFrame> {
        self.0.frames.iter().cloned().map(MotionFrame).collect()
    }

    /// (n, 4, 4) cam_from_head of every frame, metres; NaN where there is no pose.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        let none = [[f64::NAN; 4]; 4];
        let poses: Vec<[[f64; 4]; 4]> =
            self.0.frames.iter().map(|frame| frame.cam_from_head.as_ref().map_or(none, Transform::rows)).collect();
        Array3::from_shape_fn((poses.len(), 4, 4), |(n, i, k)| poses[n][i][k]).into_pyarray(py)
    }

    /// Indices of the frames that have a pose.
    #[getter]
    fn posed(&self) -> Vec<usize> {
        let frames = self.0.frames.iter().enumerate();
        frames.filter(|(_, frame)| frame.cam_from_head.is_some()).map(|(k, _)| k).collect()
    }

    /// Every point that has a position.
    #[getter]
    fn points(&self) -> MotionPoints {
        MotionPoints(self.0.clone())
    }

    /// Root mean square distance of points from where they are seen, pixels, over all that agree.
    #[getter]
    fn reprojection_rms_px(&self) -> f64 {
        self.0.reprojection_rms_px
    }

    /// How unsteady it is.
    #[getter]
    fn roughness(&self) -> Roughness {
        let facewright::Roughness { rotation_deg, translation_mm } = self.0.roughness;
        Roughness { rotation_deg, translation_mm }
    }

    fn __repr__(&self) -> String {
        let (posed, frames, points) = (self.posed().len(), self.0.frames.len(), self.0.points.len());
        format!("<facewright.Motion: {posed} of {frames} frames, {points} points>")
    }
}

/// How unsteady a motion is: median second differences over neighbouring frames.
#[pyclass(frozen, get_all, module = "facewright")]
pub struct Roughness {
    /// Of the rotation, degrees.
    rotation_deg: f64,
    /// Of the points' centre, millimetres.
    translation_mm: f64,
}

/// A frame of a motion.
#[pyclass(frozen, module = "facewright")]
pub struct MotionFrame(FrameMotion);

frame!(
    MotionFrame,
    used: "Whether the head could be placed in it.",
    reason: "What it rests on, or why there is no pose.",
    cam_from_head: "(4, 4) pose of the head, metres; None where it was left out."
);

#[pymethods]
impl MotionFrame {
    /// Standard deviation of the rotation, degrees, root of the sum over the axes.
    #[getter]
    fn rotation_sigma_deg(&self) -> Option<f64> {
        self.0.rotation_sigma_deg
    }

    /// Standard deviation of the position at the head's centre, millimetres, root of the sum over the axes.
    #[getter]
    fn translation_sigma_mm(&self) -> Option<f64> {
        self.0.translation_sigma_mm
    }

    /// Root mean square distance of its points from where they are seen, pixels.
    #[getter]
    fn reprojection_rms_px(&self) -> Option<f64> {
        self.0.reprojection_rms_px
    }

    /// Points that agree with the pose.
    #[getter]
    fn points(&self) -> usize {
        self.0.points
    }

    fn __repr__(&self) -> String {
        format!("<facewright.MotionFrame {}: {} points>", self.0.name, self.0.points)
    }
}

/// The points of a motion as arrays of one length.
#[pyclass(frozen, module = "facewright")]
pub struct MotionPoints(Arc<HeadMotion>);

impl MotionPoints {
    fn each<T>(&self, of: impl FnMut(&PointMotion) -> T) -> Vec<T> {
        self.0.points.iter().map(of).collect()
    }
}

#[pymethods]
impl MotionPoints {
    /// (n,) numbers of their tracks.
    #[getter]
    fn ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.each(|point| point.id as i64).into_pyarray(py)
    }

    /// (n, 3) head frame, metres.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, &self.each(|point| point.position))
    }

    /// (n,) standard deviations, millimetres, root mean square over the axes.
    #[getter]
    fn sigmas_mm<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.each(|point| point.sigma_mm).into_pyarray(py)
    }

    /// (n,) number of frames that agree with each.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.each(|point| point.frames as i64).into_pyarray(py)
    }

    /// (n,) root mean square distances from where they are seen in those, pixels.
    #[getter]
    fn reprojection_rms_px<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.each(|point| point.reprojection_rms_px).into_pyarray(py)
    }

    /// What each belongs to: `skin`, `mouth`, `eyes` or `brows`.
    #[getter]
    fn regions(&self) -> Vec<String> {
        self.each(|point| word(&point.region))
    }

    /// (n,) whether each moves relative to the head, and was left out of the motion.
    #[getter]
    fn moves<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.each(|point| point.moves).into_pyarray(py)
    }

    fn __len__(&self) -> usize {
        self.0.points.len()
    }

    fn __repr__(&self) -> String {
        format!("<facewright.MotionPoints: {}>", self.0.points.len())
    }
}

impl Or<Motion> {
    /// The motion.
    pub fn core(&self) -> PyResult<HeadMotion> {
        match self {
            Self::Class(motion) => Ok((*motion.0).clone()),
            Self::Text(text) => HeadMotion::parse(text).map_err(|e| crate::raise(&e)),
        }
    }
}
