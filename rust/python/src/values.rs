//! JSON values to Python objects and back.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyString, PyTuple};
use serde_json::{Map, Number, Value};
use std::path::PathBuf;

/// A Python object as JSON; sequences become lists, paths and enums of strings their texts.
pub(crate) fn to_json(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    if object.is_none() {
        return Ok(Value::Null);
    }
    if object.is_instance_of::<PyBool>() {
        return Ok(Value::Bool(object.extract()?));
    }
    if let Ok(text) = object.cast::<PyString>() {
        return Ok(Value::String(text.to_str()?.to_owned()));
    }
    if object.is_instance_of::<PyTuple>() || object.is_instance_of::<PyList>() {
        let items = object.try_iter()?.map(|item| to_json(&item?));
        return Ok(Value::Array(items.collect::<PyResult<_>>()?));
    }
    number(object).ok_or_else(|| {
        let kind = object.get_type().name().map_or_else(|_| "this".to_owned(), |name| name.to_string());
        PyTypeError::new_err(format!("{kind} is not a number, a string, a boolean or a sequence of these"))
    })
}

/// Whole numbers stay whole; a path is its text.
fn number(object: &Bound<'_, PyAny>) -> Option<Value> {
    if let Ok(whole) = object.extract::<i64>() {
        return Some(Value::from(whole));
    }
    if let Ok(number) = object.extract::<f64>() {
        // No JSON has them: the option's own check tells what it may be.
        return Some(Number::from_f64(number).map_or_else(|| Value::from(number.to_string()), Value::Number));
    }
    object.extract::<PathBuf>().ok().and_then(|path| path.to_str().map(Value::from))
}

/// JSON as a Python object that does not change: lists are tuples.
pub(crate) fn to_python(py: Python<'_>, value: &Value) -> PyResult<Py<PyAny>> {
    Ok(match value {
        Value::Null => py.None(),
        Value::Bool(truth) => PyBool::new(py, *truth).to_owned().into_any().unbind(),
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(whole), _) => whole.into_pyobject(py)?.into_any().unbind(),
            (None, number) => number.into_pyobject(py)?.unbind(),
        },
        Value::String(text) => text.into_pyobject(py)?.into_any().unbind(),
        Value::Array(items) => {
            let items = items.iter().map(|item| to_python(py, item)).collect::<PyResult<Vec<_>>>()?;
            PyTuple::new(py, items)?.into_any().unbind()
        }
        Value::Object(fields) => dictionary(py, fields)?.into_any().unbind(),
    })
}

/// A JSON object as a dictionary.
pub(crate) fn dictionary<'py>(py: Python<'py>, fields: &Map<String, Value>) -> PyResult<Bound<'py, PyDict>> {
    let made = PyDict::new(py);
    fields.iter().try_for_each(|(name, value)| made.set_item(name, to_python(py, value)?))?;
    Ok(made)
}
