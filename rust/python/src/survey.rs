//! What a survey of a clip gives.

use crate::files::{json, word};
use facewright::SurveyedFrame as CoreFrame;
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;

/// What a clip shows, by some of its frames: whether a head can be made of it, and what is missing.
#[pyclass(frozen, module = "facewright")]
pub struct Survey(Arc<facewright::Survey>);

impl Survey {
    /// Wraps a value of the library.
    pub fn new(survey: facewright::Survey) -> Self {
        Self(Arc::new(survey))
    }
}

#[pymethods]
impl Survey {
    /// Version of Facewright.
    #[getter]
    fn version(&self) -> &str {
        &self.0.version
    }

    /// How many frames the clip has, or those of its numbers that were given.
    #[getter]
    fn frames(&self) -> usize {
        self.0.frames
    }

    /// Width and height of the pictures, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    /// The frames that were looked at, in order.
    #[getter]
    fn looks(&self) -> Vec<SurveyedFrame> {
        (0..self.0.looks.len()).map(|index| SurveyedFrame { survey: self.0.clone(), index }).collect()
    }

    /// How far the head turns, and how many of the frames that were looked at can be used, in words.
    #[getter]
    fn summary(&self) -> Vec<String> {
        self.0.summary.clone()
    }

    /// What speaks against a reconstruction, as (word, sentence); empty for a good clip.
    #[getter]
    fn findings(&self) -> Vec<(String, String)> {
        self.0.findings.iter().map(|finding| (word(&finding.kind), finding.sentence.clone())).collect()
    }

    /// The same of the frames with some numbers alone; nothing is looked at again.
    fn part(&self, numbers: HashSet<usize>) -> Self {
        Self::new(self.0.part(|number| numbers.contains(&number)))
    }

    /// All but the thumbnails as JSON, in one line.
    fn to_json(&self) -> String {
        json(&*self.0)
    }

    fn __repr__(&self) -> String {
        let usable = self.0.looks.iter().filter(|look| look.usable).count();
        format!("Survey({usable} of {} frames looked at can be used, of {})", self.0.looks.len(), self.0.frames)
    }
}

/// A frame that was looked at.
#[pyclass(frozen, module = "facewright")]
pub struct SurveyedFrame {
    survey: Arc<facewright::Survey>,
    index: usize,
}

impl SurveyedFrame {
    fn of(&self) -> &CoreFrame {
        &self.survey.looks[self.index]
    }

    fn face(&self) -> Option<&facewright::SurveyedFace> {
        self.of().face.as_ref()
    }
}

#[pymethods]
impl SurveyedFrame {
    /// Its number in the clip, counted from 0.
    #[getter]
    fn number(&self) -> usize {
        self.of().number
    }

    /// File name without extension.
    #[getter]
    fn name(&self) -> &str {
        &self.of().name
    }

    /// Whether shape and texture could be taken from it.
    #[getter]
    fn usable(&self) -> bool {
        self.of().usable
    }

    /// How far the head is turned, or why the frame is of no use.
    #[getter]
    fn reason(&self) -> &str {
        &self.of().reason
    }

    /// The same as a word, like `blurred`.
    #[getter]
    fn reason_kind(&self) -> String {
        word(&self.of().reason_kind)
    }

    /// The rectangle around the face: left, top, width, height, pixels; None without one.
    #[getter]
    fn rectangle(&self) -> Option<[u32; 4]> {
        self.face().map(|face| face.rectangle)
    }

    /// Yaw, pitch and roll of the head, degrees: positive where the nose points to the right of the picture, where it
    /// looks up, and where the crown leans to the right. None without a face.
    #[getter]
    fn turn_deg(&self) -> Option<(f64, f64, f64)> {
        self.face().map(|face| (face.yaw_deg, face.pitch_deg, face.roll_deg))
    }

    /// Distance between the eyes, pixels; None without a face.
    #[getter]
    fn eye_distance_px(&self) -> Option<f64> {
        self.face().map(|face| face.eye_distance_px)
    }

    /// Sharpness of the face: compare within a clip. None without one.
    #[getter]
    fn sharpness(&self) -> Option<f64> {
        self.face().map(|face| face.sharpness)
    }

    /// (height, width, 3) sRGB of the whole picture, 96 pixels wide or high, top row first.
    #[getter]
    fn thumbnail<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let picture = &self.of().thumbnail;
        let shape = (picture.height() as usize, picture.width() as usize, 3);
        let array = Array3::from_shape_vec(shape, picture.as_raw().clone());
        Ok(array.map_err(|e| pyo3::exceptions::PyRuntimeError::new_err(e.to_string()))?.into_pyarray(py))
    }
}
