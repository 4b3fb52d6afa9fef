//! Options: the library's structs as frozen classes with keyword constructors.
//!
//! Names, values and texts are read from the struct itself (serde) and from the program's help (clap), so that a new field
//! of it needs nothing here.

use crate::error::{raise, unwritten};
use crate::values::{dictionary, to_json, to_python};
use clap::{Args, Command};
use facewright::FacewrightError as CoreError;
use pyo3::exceptions::{PyAttributeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// A field whose name is a word of Python's, and what it is called there.
const RENAMED: (&str, &str) = ("from", "from_");

/// The fields of an options struct by their names in Python.
pub(crate) fn fields_of(options: &impl Serialize) -> PyResult<Map<String, Value>> {
    let value = serde_json::to_value(options).map_err(|e| unwritten(&e))?;
    let Value::Object(fields) = value else { return Ok(Map::new()) };
    let renamed = |name: String| if name == RENAMED.0 { RENAMED.1.to_owned() } else { name };
    Ok(fields.into_iter().map(|(name, value)| (renamed(name), value)).collect())
}

/// Options with some of their fields replaced.
pub(crate) fn replaced<T: Serialize + DeserializeOwned>(
    class: &str,
    options: &T,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<T> {
    let mut fields = fields_of(options)?;
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        if !fields.contains_key(&name) {
            let known = fields.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            return Err(PyTypeError::new_err(format!("{class} has no option {name}: it has {known}")));
        }
        fields.insert(name.clone(), to_json(&value)?);
        // Each by itself, so that an error tells which one it is.
        read::<T>(&fields).map_err(|error| refused(&name, &error.to_string()))?;
    }
    read(&fields).map_err(|error| refused(class, &error.to_string()))
}

fn read<T: DeserializeOwned>(fields: &Map<String, Value>) -> Result<T, serde_json::Error> {
    let renamed = |name: &str| if name == RENAMED.1 { RENAMED.0 } else { name }.to_owned();
    let fields = fields.iter().map(|(name, value)| (renamed(name), value.clone())).collect();
    serde_json::from_value(Value::Object(fields))
}

/// A value of the wrong type, or one of the right type that may not be.
fn refused(name: &str, reason: &str) -> PyErr {
    let message = format!("{name}: {reason}");
    let is_value = reason.starts_with("invalid value") || reason.starts_with("unknown variant");
    if is_value { PyValueError::new_err(message) } else { PyTypeError::new_err(message) }
}

/// One field as a Python object.
pub(crate) fn field(py: Python<'_>, class: &str, options: &impl Serialize, name: &str) -> PyResult<Py<PyAny>> {
    let fields = fields_of(options)?;
    let unknown = || PyAttributeError::new_err(format!("{class} has no option {name}"));
    to_python(py, fields.get(name).ok_or_else(unknown)?)
}

/// `Class(name=value, …)`.
pub(crate) fn written(py: Python<'_>, class: &str, options: &impl Serialize) -> PyResult<String> {
    let field = |(name, value): (&String, &Value)| Ok(format!("{name}={}", to_python(py, value)?.bind(py).repr()?));
    let fields = fields_of(options)?.iter().map(field).collect::<PyResult<Vec<_>>>()?;
    Ok(format!("{class}({})", fields.join(", ")))
}

/// What the library says of options that cannot be.
pub(crate) fn checked<T>(options: T, check: impl Fn(&T) -> Result<(), CoreError>) -> PyResult<T> {
    check(&options).map_err(|error| raise(&error))?;
    Ok(options)
}

/// Gives a class its docstring, of the program's help, and its signature, of the defaults.
pub(crate) fn describe<T: Args + Default + Serialize>(class: &Bound<'_, PyAny>, about: &str) -> PyResult<()> {
    let (py, defaults) = (class.py(), fields_of(&T::default())?);
    let helped = T::augment_args(Command::new("options"));
    let line = |name: &String| {
        let argument = helped.get_arguments().find(|argument| argument.get_id() == name.trim_end_matches('_'));
        let help = argument.and_then(clap::Arg::get_help).map(ToString::to_string).unwrap_or_default();
        let turned_off = argument.is_some_and(|a| matches!(a.get_action(), clap::ArgAction::SetFalse));
        format!("\n    {name}: {}{help}", if turned_off { "False: " } else { "" })
    };
    let lines: String = defaults.keys().map(line).collect();
    class.setattr("__doc__", format!("{about}\n\nKeyword arguments, and attributes:\n{lines}\n"))?;
    let inspect = py.import("inspect")?;
    let keyword = inspect.getattr("Parameter")?.getattr("KEYWORD_ONLY")?;
    let parameter = |(name, value): (&String, &Value)| {
        let usual = PyDict::new(py);
        usual.set_item("default", to_python(py, value)?)?;
        inspect.getattr("Parameter")?.call((name, &keyword), Some(&usual))
    };
    let parameters = defaults.iter().map(parameter).collect::<PyResult<Vec<_>>>()?;
    class.setattr("__signature__", inspect.getattr("Signature")?.call1((parameters,))?)
}

/// What pickles and copies are made by: `cls(**fields)`.
pub(crate) fn arguments<'py>(
    py: Python<'py>,
    options: &impl Serialize,
) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
    Ok((PyTuple::empty(py), dictionary(py, &fields_of(options)?)?))
}

macro_rules! options_class {
    ($name:ident, $core:ty, $about:literal, $check:expr) => {
        #[doc = $about]
        #[pyclass(frozen, module = "facewright")]
        pub struct $name(pub $core);

        impl $name {
            const NAME: &str = stringify!($name);

            /// The options given, with the fields given replaced.
            pub fn merged(options: Option<&Bound<'_, Self>>, fields: Option<&Bound<'_, PyDict>>) -> PyResult<$core> {
                let base = options.map(|options| options.get().0.clone()).unwrap_or_default();
                checked(replaced(Self::NAME, &base, fields)?, $check)
            }

            /// Adds the class to the module.
            pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
                module.add_class::<Self>()?;
                describe::<$core>(&module.getattr(Self::NAME)?, $about)
            }
        }

        #[pymethods]
        impl $name {
            #[new]
            #[pyo3(signature = (**fields))]
            fn new(fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
                Self::merged(None, fields).map(Self)
            }

            #[pyo3(signature = (**fields))]
            #[doc = "The same options with these replaced."]
            fn replace(&self, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
                checked(replaced(Self::NAME, &self.0, fields)?, $check).map(Self)
            }

            fn __getattr__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
                field(py, Self::NAME, &self.0, name)
            }

            fn __dir__(&self) -> PyResult<Vec<String>> {
                let own = ["replace", "__doc__", "__class__"].map(str::to_owned);
                Ok(fields_of(&self.0)?.keys().cloned().chain(own).collect())
            }

            fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
                written(py, Self::NAME, &self.0)
            }

            fn __eq__(&self, other: &Self) -> bool {
                self.0 == other.0
            }

            fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
                arguments(py, &self.0)
            }
        }
    };
}

options_class!(
    SheetOptions,
    facewright::pictures::board::SheetOptions,
    "What save_board prints, and on what.",
    facewright::pictures::board::SheetOptions::validate
);
options_class!(
    BoardOptions,
    facewright::BoardOptions,
    "The board that was filmed: a checkerboard of inner corners, or separate black squares.",
    facewright::BoardOptions::validate
);
options_class!(
    CalibrateOptions,
    facewright::CalibrateOptions,
    "The board that was filmed, and the model of the lens.",
    facewright::CalibrateOptions::validate
);
options_class!(UndistortOptions, facewright::UndistortOptions, "How undistort works.", |_| Ok(()));
options_class!(MatchOptions, facewright::MatchOptions, "How match_pair works.", facewright::MatchOptions::validate);
options_class!(TrackOptions, facewright::TrackClipOptions, "How track works.", facewright::TrackClipOptions::validate);
options_class!(MotionOptions, facewright::MotionOptions, "How motion works.", facewright::MotionOptions::validate);
options_class!(
    ReconstructOptions,
    facewright::ReconstructOptions,
    "How reconstruct works.",
    facewright::ReconstructOptions::validate
);

/// Adds all of them to the module.
pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    SheetOptions::add(module)?;
    BoardOptions::add(module)?;
    CalibrateOptions::add(module)?;
    UndistortOptions::add(module)?;
    MatchOptions::add(module)?;
    TrackOptions::add(module)?;
    MotionOptions::add(module)?;
    ReconstructOptions::add(module)
}
