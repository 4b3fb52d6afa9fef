//! What files, and frames in them, have in common.

use pyo3::prelude::*;

/// `version`, `method`, `camera` and `warnings` of a class around a file; what is said of the method and the camera differs.
macro_rules! made_by {
    ($class:ident, method: $method:literal, camera: $camera:literal) => {
        #[pymethods]
        impl $class {
            /// Version of Facewright.
            #[getter]
            fn version(&self) -> &str {
                &self.0.version
            }

            #[doc = $method]
            #[getter]
            fn method(&self) -> String {
                $crate::files::word(&self.0.method)
            }

            #[doc = $camera]
            #[getter]
            fn camera(&self) -> $crate::files::Camera {
                $crate::files::Camera::numbers(self.0.camera)
            }

            /// What the artist should know.
            #[getter]
            fn warnings(&self) -> Vec<String> {
                self.0.warnings.clone()
            }
        }
    };
}
pub(super) use made_by;

/// `scale` and `timings_s` of a class around a file.
macro_rules! measured {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            /// What the size rests on.
            #[getter]
            fn scale(&self) -> $crate::files::Scale {
                $crate::files::Scale::of(&self.0.scale)
            }

            /// Seconds per stage.
            #[getter]
            fn timings_s(&self) -> std::collections::BTreeMap<String, f64> {
                self.0.timings_s.clone()
            }
        }
    };
}
pub(super) use measured;

/// `name`, `used`, `reason`, `reason_kind` and `cam_from_head` of a frame; what is said of them differs.
macro_rules! frame {
    ($class:ident, used: $used:literal, reason: $reason:literal, cam_from_head: $pose:literal) => {
        #[pymethods]
        impl $class {
            /// File name without extension.
            #[getter]
            fn name(&self) -> &str {
                &self.0.name
            }

            #[doc = $used]
            #[getter]
            fn used(&self) -> bool {
                self.0.used
            }

            #[doc = $reason]
            #[getter]
            fn reason(&self) -> &str {
                &self.0.reason
            }

            /// The same as a word for programs, like `blurred`; None in files that do not tell.
            #[getter]
            fn reason_kind(&self) -> Option<String> {
                self.0.reason_kind.map(|kind| $crate::files::word(&kind))
            }

            #[doc = $pose]
            #[getter]
            fn cam_from_head<'py>(&self, py: Python<'py>) -> Option<$crate::files::Rows<'py>> {
                self.0.cam_from_head.as_ref().map(|pose| $crate::files::matrix(py, pose))
            }
        }
    };
}
pub(super) use frame;

/// The size of a head and what it rests on.
#[pyclass(frozen, get_all, module = "facewright")]
pub struct Scale {
    /// What fixed the size.
    source: String,
    /// Standard deviation of the size, as part of it; 0 in files that do not tell.
    relative_sigma: f64,
}

impl Scale {
    /// The library's.
    pub fn of(scale: &facewright::Scale) -> Self {
        Self { source: scale.source.clone(), relative_sigma: scale.relative_sigma }
    }
}
