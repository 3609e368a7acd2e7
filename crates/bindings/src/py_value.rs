//! Conversion of Python's dicts, lists and arrays to the schema's nodes.

use numpy::{PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use raycam_scene::color;
use raycam_scene::schema::{Entry, SpannedValue, Value};

use crate::error::{check_memory, world_error};

/// Maximum nesting depth. Without this limit, a list that contains itself would be read forever.
const MAX_DEPTH: usize = 16;
/// Keys whose uint8 arrays are in sRGB.
const SRGB_KEYS: [&str; 3] = ["color", "face_colors", "vertex_colors"];

/// Converts a Python value to a node of a description; error messages contain `path`, the value's key.
pub(crate) fn to_value(value: &Bound<'_, PyAny>, path: &str) -> PyResult<SpannedValue> {
    convert(value, path, 0).map(SpannedValue::from)
}

fn convert(value: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Value> {
    let fail = |message: String| {
        let colon = if path.is_empty() { "" } else { ": " };
        Err(world_error(format!("{path}{colon}{message}")))
    };
    if depth > MAX_DEPTH {
        return fail(format!("nested more than {MAX_DEPTH} levels deep"));
    }
    if value.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(v) = value.cast::<PyBool>() {
        return Ok(Value::Bool(v.is_true()));
    }
    if let Ok(v) = value.cast::<PyFloat>() {
        return Ok(Value::Float(v.value()));
    }
    if value.is_instance_of::<PyInt>() {
        return match (value.extract(), value.extract()) {
            (Ok(v), _) => Ok(Value::Integer(v)),
            (_, Ok(v)) => Ok(Value::Unsigned(v)),
            _ => fail(format!("{value} does not fit into 64 bits")),
        };
    }
    if let Ok(v) = value.cast::<PyString>() {
        return Ok(Value::String(v.to_str()?.to_owned()));
    }
    if let Ok(array) = value.cast::<PyUntypedArray>() {
        return array_value(array, path);
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        let mut entries = Vec::with_capacity(dict.len());
        for (key, value) in dict {
            let Ok(key) = key.extract::<String>() else {
                return fail(format!("the key {key} is not a string"));
            };
            let dot = if path.is_empty() { "" } else { "." };
            let node = convert(&value, &format!("{path}{dot}{key}"), depth + 1)?.into();
            entries.push(Entry { key, key_span: None, value: node });
        }
        return Ok(Value::Table(entries));
    }
    let items = match (value.cast::<PyList>(), value.cast::<PyTuple>()) {
        (Ok(list), _) => Some(list.iter().collect::<Vec<_>>()),
        (_, Ok(tuple)) => Some(tuple.iter().collect()),
        _ => None,
    };
    if let Some(items) = items {
        let convert = |(i, item)| convert(&item, &format!("{path}[{i}]"), depth + 1).map(SpannedValue::from);
        return Ok(Value::List(items.into_iter().enumerate().map(convert).collect::<PyResult<_>>()?));
    }
    // NumPy scalars have the method `item`; paths have `__fspath__`.
    if let Ok(scalar) = value.call_method0("item") {
        return convert(&scalar, path, depth + 1);
    }
    if let Ok(text) = value.call_method0("__fspath__") {
        return convert(&text, path, depth + 1);
    }
    fail(format!(
        "{} is not a number, string, list, dict or array",
        value.get_type().name().map_err(|_| PyTypeError::new_err("a value of unknown type"))?
    ))
}

fn array_value(array: &Bound<'_, PyUntypedArray>, path: &str) -> PyResult<Value> {
    let shape = array.shape().to_vec();
    // 40 bytes per number: two copies of the array as 64-bit numbers, and the mesh built from the array.
    check_memory(&format!("{path}, an array of {} numbers,", array.len()), array.len().saturating_mul(40))?;
    let kind = array.dtype().kind();
    let last = path.rsplit('.').next().unwrap_or(path);
    if SRGB_KEYS.contains(&last)
        && let Ok(bytes) = array.cast::<PyArrayDyn<u8>>()
    {
        let linear = |v| f64::from(color::linear_from_srgb8([v; 3])[0]);
        let table: Vec<f64> = (0..=255).map(linear).collect();
        let data = bytes.to_owned_array().iter().map(|&v| table[usize::from(v)]).collect();
        return Ok(Value::Floats { shape, data });
    }
    // `astype` converts any width and byte order; the result is in C order, for any strides.
    let values = |dtype| array.call_method1("astype", (dtype,));
    match kind {
        b'f' => {
            let data = values("float64")?.cast_into::<PyArrayDyn<f64>>()?.to_owned_array();
            Ok(Value::Floats { shape, data: data.iter().copied().collect() })
        }
        b'i' | b'u' => {
            let data = values("int64")?.cast_into::<PyArrayDyn<i64>>()?.to_owned_array();
            Ok(Value::Integers { shape, data: data.iter().copied().collect() })
        }
        _ => Err(world_error(format!("{path}: array of dtype {}; expected numbers", array.dtype()))),
    }
}
