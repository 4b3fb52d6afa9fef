//! A finished head as arrays.

use crate::files::Report;
use crate::raise;
use geometry::Vec3;
use head::expressions::expressions;
use image::RgbaImage;
use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use std::path::PathBuf;

type KeyArrays<'py> = (String, Bound<'py, PyArray1<u32>>, Bound<'py, PyArray2<f32>>);
type Span = (usize, usize);

/// A head on the generic head's topology; head frame (x the subject's left, y up, z out of the face), metres.
#[pyclass(frozen, module = "facewright")]
pub struct Reconstruction(facewright::Reconstruction);

impl Reconstruction {
    /// Wraps a result.
    pub fn new(head: facewright::Reconstruction) -> Self {
        Self(head)
    }
}

#[pymethods]
impl Reconstruction {
    /// (n, 3) the person at rest.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        vectors(py, &self.0.positions)
    }

    /// (n, 3) the generic head's own vertices.
    #[getter]
    fn generic_positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        vectors(py, &self.0.generic_positions)
    }

    /// (m, 4) vertex indices, counter-clockwise from outside.
    #[getter]
    fn quads<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<u32>> {
        Array2::from_shape_fn((self.0.quads.len(), 4), |(i, k)| self.0.quads[i][k]).into_pyarray(py)
    }

    /// (m, 4, 2) texture coordinates of each quad's corners, v up.
    #[getter]
    fn uvs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f32>> {
        Array3::from_shape_fn((self.0.uvs.len(), 4, 2), |(i, k, c)| self.0.uvs[i][k][c]).into_pyarray(py)
    }

    /// (name, (first vertex, end), (first quad, end)): skin first.
    #[getter]
    fn parts(&self) -> Vec<(String, Span, Span)> {
        let span = |r: &std::ops::Range<usize>| (r.start, r.end);
        self.0.parts.iter().map(|p| (p.name.clone(), span(&p.vertices), span(&p.quads))).collect()
    }

    /// (name, moved vertices (k,), their offsets (k, 3)): 52 ARKit keys, then 15 visemes.
    #[getter]
    fn keys<'py>(&self, py: Python<'py>) -> Vec<KeyArrays<'py>> {
        let arrays = |key: &head::Key| {
            let indices: Vec<u32> = key.offsets.iter().map(|(i, _)| *i).collect();
            let offsets: Vec<Vec3> = key.offsets.iter().map(|(_, d)| *d).collect();
            (key.name.clone(), indices.into_pyarray(py), vectors(py, &offsets))
        };
        self.0.keys.iter().map(arrays).collect()
    }

    /// Named poses: (name, [(ARKit key, value)]).
    #[getter]
    fn expressions(&self) -> Vec<(&'static str, Vec<(&'static str, f64)>)> {
        expressions().iter().map(|e| (e.name, e.weights.to_vec())).collect()
    }

    /// (size, size, 4) sRGB of the skin, top row first; alpha below 255 where no frame looked.
    #[getter]
    fn texture<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        picture(py, &self.0.texture)
    }

    /// (size, size, 4) sRGB of the eyes, top row first.
    #[getter]
    fn eyes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        picture(py, &self.0.eyes)
    }

    /// report.json as text; `parsed_report` is the same as a class.
    #[getter]
    fn report(&self) -> String {
        serde_json::to_string_pretty(&self.0.report).unwrap_or_default()
    }

    /// The same as `report`, read: frames, fit and texture as attributes.
    #[getter]
    fn parsed_report(&self) -> Report {
        Report::new(self.0.report.clone())
    }

    /// Write head.glb, texture.png, eyes.png and report.json into a folder, all or none; raises OutputError.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| self.0.write(&folder)).map_err(|e| raise(&e))
    }
}

/// Places as (n, 3).
pub fn vectors<'py>(py: Python<'py>, values: &[Vec3]) -> Bound<'py, PyArray2<f32>> {
    Array2::from_shape_fn((values.len(), 3), |(i, k)| values[i][k] as f32).into_pyarray(py)
}

fn picture<'py>(py: Python<'py>, picture: &RgbaImage) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let shape = (picture.height() as usize, picture.width() as usize, 4);
    let array = Array3::from_shape_vec(shape, picture.as_raw().clone());
    Ok(array.map_err(|e| pyo3::exceptions::PyRuntimeError::new_err(e.to_string()))?.into_pyarray(py))
}
