//! Lights as dicts.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_scene::schema::CameraSpec;
use raycam_scene::{Light, LightTraits};
use serde_json::Value;

use crate::arrays::DictResult;

/// Description of a light: its `type`, then its other keys.
pub(crate) fn light_dict<'py>(py: Python<'py>, light: &Light, traits: &LightTraits) -> DictResult<'py> {
    let value = serde_json::to_value(light).map_err(|e| PyValueError::new_err(e.to_string()))?;
    let dict = PyDict::new(py);
    let Value::Object(variant) = value else { return Ok(dict) };
    dict.set_item("type", light.type_name())?;
    if let Some(name) = &traits.name {
        dict.set_item("name", name)?;
    }
    if !traits.visible.is_everywhere() {
        let visible = PyDict::new(py);
        visible.set_item("camera", traits.visible.camera)?;
        visible.set_item("reflection", traits.visible.reflection)?;
        visible.set_item("light", traits.visible.light)?;
        dict.set_item("visible", visible)?;
    }
    if let Light::Projector { camera: Some(camera), .. } = light {
        let text = serde_json::to_string(&CameraSpec::from_camera(camera))
            .map_err(|e| PyValueError::new_err(e.to_string()))?;
        dict.set_item("camera", py.import("json")?.call_method1("loads", (text,))?)?;
    }
    for keys in variant.values() {
        let Value::Object(keys) = keys else { continue };
        for (key, value) in keys.iter().filter(|(key, _)| *key != "camera") {
            dict.set_item(key, to_python(py, value)?)?;
        }
    }
    Ok(dict)
}

/// Value of a light for Python.
fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(value) => value.into_pyobject(py)?.to_owned().into_any(),
        Value::Number(number) => number.as_f64().into_pyobject(py)?,
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Array(items) => {
            let items: PyResult<Vec<_>> = items.iter().map(|item| to_python(py, item)).collect();
            items?.into_pyobject(py)?
        }
        Value::Object(_) => return Err(PyValueError::new_err("a light's values cannot be tables")),
    })
}
