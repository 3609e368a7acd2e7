//! Lights as dicts.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_scene::Light;

/// A light as it is written.
pub(crate) fn light_dict<'py>(py: Python<'py>, light: &Light) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    match light {
        Light::Sun {
            direction,
            irradiance,
        } => {
            dict.set_item("type", "sun")?;
            dict.set_item("direction", direction)?;
            dict.set_item("irradiance", irradiance)?;
        }
        Light::Bulb {
            position,
            power,
            intensity,
            radius,
        } => {
            dict.set_item("type", "bulb")?;
            dict.set_item("position", position)?;
            if let Some(power) = power {
                dict.set_item("power", power)?;
            }
            if let Some(intensity) = intensity {
                dict.set_item("intensity", intensity)?;
            }
            dict.set_item("radius", radius)?;
        }
        Light::Sky { radiance } => {
            dict.set_item("type", "sky")?;
            dict.set_item("radiance", radiance)?;
        }
    }
    Ok(dict)
}
