//! Between Python objects and TOML values.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{
    PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PySequence, PyString, PyTuple,
};
use swath_core::config::ConfigError;
use toml::{Table, Value};

use crate::errors::Error;

/// A Python mapping as a table; messages name what is in it by `path`.
pub(crate) fn table_from(mapping: &Bound<PyMapping>, path: &str) -> Result<Table, Error> {
    let mut table = Table::new();
    for item in mapping.items()? {
        let (key, value): (Bound<PyAny>, Bound<PyAny>) = item.extract()?;
        let Ok(key) = key.extract::<String>() else {
            return Err(ConfigError::value(named(path), "a block with text keys", key).into());
        };
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        table.insert(key, value_from(&value, &path)?);
    }
    Ok(table)
}

/// A Python value, a `numpy` scalar or array among them, as a TOML value.
fn value_from(object: &Bound<PyAny>, path: &str) -> Result<Value, Error> {
    if let Ok(flag) = object.cast::<PyBool>() {
        Ok(Value::Boolean(flag.is_true()))
    } else if object.is_instance_of::<PyInt>() {
        let whole = object.extract().map_err(|_| {
            ConfigError::value(named(path), "a whole number of at most 63 bits", object)
        })?;
        Ok(Value::Integer(whole))
    } else if object.is_instance_of::<PyFloat>() {
        Ok(Value::Float(object.extract()?))
    } else if object.is_instance_of::<PyString>() {
        Ok(Value::String(object.extract()?))
    } else if let Ok(mapping) = object.cast::<PyMapping>() {
        Ok(Value::Table(table_from(mapping, path)?))
    } else if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        array_from(object.cast::<PySequence>().map_err(PyErr::from)?, path)
    } else if object.hasattr("tolist")? {
        value_from(&object.call_method0("tolist")?, path)
    } else if object.hasattr("__fspath__")? {
        value_from(&object.call_method0("__fspath__")?, path)
    } else {
        let expected = "a number, a text, a list or a block of keys";
        Err(ConfigError::value(named(path), expected, object.repr()?).into())
    }
}

fn array_from(sequence: &Bound<PySequence>, path: &str) -> Result<Value, Error> {
    let mut values = Vec::with_capacity(sequence.len()?);
    for (index, item) in sequence.try_iter()?.enumerate() {
        values.push(value_from(&item?, &format!("{path}[{index}]"))?);
    }
    Ok(Value::Array(values))
}

fn named(path: &str) -> &str {
    if path.is_empty() { "scenario" } else { path }
}

/// A TOML table as a Python dictionary.
pub(crate) fn table_to<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (key, value) in table {
        dict.set_item(key, value_to(py, value)?)?;
    }
    Ok(dict)
}

/// A TOML value as a Python object.
fn value_to<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Integer(whole) => whole.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::Boolean(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
        Value::Array(values) => {
            let items =
                values.iter().map(|value| value_to(py, value)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, items)?.into_any()
        }
        Value::Table(table) => table_to(py, table)?.into_any(),
        Value::Datetime(_) => {
            return Err(PyTypeError::new_err("a scenario holds no dates"));
        }
    })
}
