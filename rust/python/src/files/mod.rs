//! The files that commands hand to each other, as frozen classes with arrays: read, checked and written by the library alone.
//!
//! Every class has `parse`, `read`, `write` and `to_json`; where one is an argument, its text is as good.

mod camera;
mod faces;
mod matches;
mod motion;
mod report;
mod rig;
mod shared;
mod tracks;

pub use camera::Camera;
pub use faces::Faces;
pub use motion::Motion;
pub use report::Report;
pub use rig::{Calibration, Rig};
pub use tracks::Tracks;

use camera::{Board, BoardBend, BoardImage};
use matches::{MatchedPair, Matches};
use motion::{MotionFrame, MotionPoints, Roughness};
use report::{DenseReport, FitReport, Measure, Quality, ReportFrame, TextureReport};
use rig::MountedCamera;
use shared::Scale;
use tracks::{Track, TrackedFrame};

use geometry::Transform;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use serde::Serialize;

/// Numbers, (n,).
type Numbers<'py> = Bound<'py, PyArray1<f64>>;
/// Rows of numbers: (n, 2) pixels, (n, 3) points, (4, 4) poses.
type Rows<'py> = Bound<'py, PyArray2<f64>>;

/// A pose as its 4×4 matrix.
fn matrix<'py>(py: Python<'py>, pose: &Transform) -> Rows<'py> {
    rows(py, &pose.rows())
}

/// Rows of one length as an array.
fn rows<'py, const N: usize>(py: Python<'py>, rows: &[[f64; N]]) -> Rows<'py> {
    Array2::from_shape_fn((rows.len(), N), |(i, k)| rows[i][k]).into_pyarray(py)
}

/// What the file's text is.
pub(crate) fn json(value: &impl Serialize) -> String {
    // Our own types have string keys: serialisation cannot fail.
    serde_json::to_string(value).unwrap_or_default()
}

/// The name that a value has in files.
pub(crate) fn word(value: &impl Serialize) -> String {
    json(value).trim_matches('"').to_owned()
}

/// `parse`, `read`, `write`, `to_json` and `str()` of a class around a value of the library.
macro_rules! file_class {
    ($class:ident, $core:ty, $file:literal) => {
        impl $class {
            /// Wraps a value of the library.
            pub fn new(value: $core) -> Self {
                Self(std::sync::Arc::new(value))
            }
        }

        #[pymethods]
        impl $class {
            #[doc = concat!("Parse the text of a ", $file, "; raises FacewrightError with what is wrong.")]
            #[staticmethod]
            fn parse(py: Python<'_>, text: &str) -> PyResult<Self> {
                let value = py.detach(|| <$core>::parse(text));
                value.map(Self::new).map_err(|e| $crate::raise(&e))
            }

            #[doc = concat!("Read a ", $file, "; raises FacewrightError with what is wrong.")]
            #[staticmethod]
            fn read(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
                let value = py.detach(|| <$core>::read(&path));
                value.map(Self::new).map_err(|e| $crate::raise(&e))
            }

            #[doc = concat!("Write a ", $file, ", whole or not at all.")]
            fn write(&self, py: Python<'_>, path: std::path::PathBuf) -> PyResult<()> {
                py.detach(|| self.0.write(&path)).map_err(|e| $crate::raise(&e))
            }

            #[doc = concat!("The text of a ", $file, ", in one line.")]
            fn to_json(&self) -> String {
                $crate::files::json(&*self.0)
            }

            fn __str__(&self) -> String {
                self.to_json()
            }
        }
    };
}
pub(crate) use file_class;

/// Adds the classes to the module.
pub fn add_classes(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Camera>()?;
    module.add_class::<Board>()?;
    module.add_class::<BoardBend>()?;
    module.add_class::<BoardImage>()?;
    module.add_class::<Rig>()?;
    module.add_class::<MountedCamera>()?;
    module.add_class::<Faces>()?;
    module.add_class::<Matches>()?;
    module.add_class::<MatchedPair>()?;
    module.add_class::<Tracks>()?;
    module.add_class::<TrackedFrame>()?;
    module.add_class::<Track>()?;
    module.add_class::<Motion>()?;
    module.add_class::<MotionFrame>()?;
    module.add_class::<MotionPoints>()?;
    module.add_class::<Roughness>()?;
    module.add_class::<Report>()?;
    module.add_class::<ReportFrame>()?;
    module.add_class::<Scale>()?;
    module.add_class::<DenseReport>()?;
    module.add_class::<FitReport>()?;
    module.add_class::<TextureReport>()?;
    module.add_class::<Quality>()?;
    module.add_class::<Measure>()
}

/// A class, or the text of its file.
#[derive(FromPyObject)]
pub enum Or<T> {
    /// The class.
    Class(T),
    /// The text.
    Text(String),
}
