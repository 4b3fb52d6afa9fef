//! `matches.json`.

use super::{Rows, file_class, rows};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use std::sync::Arc;

/// A matches.json: corners of the face matched between two frames.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Matches(Arc<facewright::Matches>);

file_class!(Matches, facewright::Matches, "matches.json");

#[pymethods]
impl Matches {
    /// The pairs of frames.
    #[getter]
    fn pairs(&self) -> Vec<MatchedPair> {
        self.0.pairs.iter().cloned().map(MatchedPair).collect()
    }

    fn __len__(&self) -> usize {
        self.0.pairs.len()
    }

    fn __repr__(&self) -> String {
        let points: usize = self.0.pairs.iter().map(|pair| pair.points.len()).sum();
        format!("<facewright.Matches: {points} matches in {} pairs>", self.0.pairs.len())
    }
}

/// The matches of two frames as arrays of one length.
#[pyclass(frozen, module = "facewright")]
pub struct MatchedPair(facewright::MatchedPair);

#[pymethods]
impl MatchedPair {
    /// Name of the first frame, without extension.
    #[getter]
    fn a(&self) -> &str {
        &self.0.a
    }

    /// Name of the second frame, without extension.
    #[getter]
    fn b(&self) -> &str {
        &self.0.b
    }

    /// (n, 2) where they are in the first frame, pixels as filmed: x right, y down, centres at integers.
    #[getter]
    fn points_a<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, &self.0.points.iter().map(|p| [p.0, p.1]).collect::<Vec<_>>())
    }

    /// (n, 2) where they are in the second frame; one that is not kept, where it was last believed to be.
    #[getter]
    fn points_b<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, &self.0.points.iter().map(|p| [p.2, p.3]).collect::<Vec<_>>())
    }

    /// (n,) whether each is believed.
    #[getter]
    fn kept<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.0.points.iter().map(|p| p.4 == 1).collect::<Vec<_>>().into_pyarray(py)
    }

    /// (n, 2) where the tracker put them in the second frame before the correction; NaN where it gave up.
    #[getter]
    fn tracked<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, &self.0.tracked.iter().map(|at| at.unwrap_or([f64::NAN; 2])).collect::<Vec<_>>())
    }

    /// What became of each: kept, or moved or rejected with why.
    #[getter]
    fn outcomes(&self) -> Vec<String> {
        self.0.outcomes.clone()
    }

    /// Cross matches (method paper) or flipped triangles (default) before the correction.
    #[getter]
    fn violations_before(&self) -> usize {
        self.0.violations_before
    }

    /// The same after it.
    #[getter]
    fn violations_after(&self) -> usize {
        self.0.violations_after
    }

    fn __len__(&self) -> usize {
        self.0.points.len()
    }

    fn __repr__(&self) -> String {
        let (kept, points) = (self.0.kept().count(), self.0.points.len());
        format!("<facewright.MatchedPair {} {}: {kept} of {points} matches kept>", self.0.a, self.0.b)
    }
}
