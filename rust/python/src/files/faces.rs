//! `faces.json`.

use super::{Numbers, Or, Rows, file_class, rows};
use facewright::Faces as CoreFaces;
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;
use std::sync::Arc;

/// A faces.json: what the nets saw in the frames of a clip that they ran on.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Faces(Arc<CoreFaces>);

file_class!(Faces, CoreFaces, "faces.json");

#[pymethods]
impl Faces {
    /// Version of Facewright.
    #[getter]
    fn version(&self) -> &str {
        &self.0.version
    }

    /// Width and height of the pictures, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    /// Names of all frames.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.0.frames.iter().map(|frame| frame.name.as_str()).collect()
    }

    /// Indices of the frames that the nets ran on.
    #[getter]
    fn looked(&self) -> Vec<usize> {
        (0..self.0.frames.len()).filter(|&frame| self.0.look(frame).is_some()).collect()
    }

    /// Indices of the frames in which the face was seen, ascending.
    #[getter]
    fn seen(&self) -> Vec<usize> {
        (0..self.0.frames.len()).filter(|&frame| self.0.face(frame).is_some()).collect()
    }

    /// (n, 468, 3) landmarks in the seen frames: u, v pixels, and depth in the same scale, growing away from the camera.
    #[getter]
    fn landmarks<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        let faces: Vec<_> = (0..self.0.frames.len()).filter_map(|frame| self.0.face(frame)).collect();
        let count = faces.first().map_or(0, |face| face.points.len());
        Array3::from_shape_fn((faces.len(), count, 3), |(n, i, k)| faces[n].points[i][k]).into_pyarray(py)
    }

    /// (n, 2) centres of an iris in the seen frames, pixels; `side` 0 is the subject's left.
    fn irises<'py>(&self, py: Python<'py>, side: usize) -> Rows<'py> {
        let centres = (0..self.0.frames.len()).filter_map(|frame| self.0.face(frame)).map(|face| {
            let centre = face.irises[side.min(1)].centre;
            [centre.x, centre.y]
        });
        rows(py, &centres.collect::<Vec<_>>())
    }

    /// (n,) sharpness of the face in the looked frames: compare within a clip.
    #[getter]
    fn sharpness<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        let looks = (0..self.0.frames.len()).filter_map(|frame| self.0.look(frame));
        looks.map(|look| look.sharpness).collect::<Vec<f64>>().into_pyarray(py)
    }

    /// What the artist should know.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings()
    }

    fn __repr__(&self) -> String {
        let (looked, seen) = self.0.counts();
        format!("Faces({seen} of {looked} frames looked at, of {})", self.0.frames.len())
    }
}

impl Or<Faces> {
    /// The library's value.
    pub fn core(&self) -> PyResult<CoreFaces> {
        match self {
            Self::Class(faces) => Ok((*faces.0).clone()),
            Self::Text(text) => CoreFaces::parse(text).map_err(|e| crate::raise(&e)),
        }
    }
}
