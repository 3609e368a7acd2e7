//! Arguments of a render.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::{Catchers, Settings, TruthSurface};
use raycam_scene::render_options::{OptionRange, OptionValue, RENDER_OPTIONS, RenderOption, RenderOptions};
use raycam_scene::schema::from_value;

use crate::arrays::DictResult;
use crate::cancel::Cancel;
use crate::error::{OrRaise, as_settings_error, settings_error};
use crate::py_value::to_value;
use crate::render::frame::channel;
use crate::world::state::World;

/// Arguments of one call from a dict, in addition to the options of [`RenderOptions`].
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct CallArguments {
    frame: u32,
    channels: Vec<String>,
    surface: String,
    #[pyo3(default)]
    transparent_background: bool,
    #[pyo3(default)]
    catchers: Option<String>,
    region: Option<[u32; 4]>,
    /// Flag that cancels the render.
    #[pyo3(default)]
    cancel: Option<Py<Cancel>>,
}

/// Arguments of a render, from a dict with the keys of [`RenderOptions`] and [`CallArguments`].
pub(crate) struct RenderArguments {
    options: RenderOptions,
    call: CallArguments,
}

impl<'py> FromPyObject<'_, 'py> for RenderArguments {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let arguments = object.cast::<PyDict>()?;
        let call = arguments.extract()?;
        let options = PyDict::new(object.py());
        for row in RENDER_OPTIONS {
            if let Some(value) = arguments.get_item(row.name)? {
                options.set_item(row.name, value)?;
            }
        }
        Ok(Self { options: options_from_dict(&options)?, call })
    }
}

impl RenderArguments {
    /// Settings of the render.
    pub(crate) fn settings(&self) -> PyResult<Settings> {
        let call = &self.call;
        let unknown = |what, name: &str| settings_error(format!("unknown {what} {name:?}"));
        let catchers = call.catchers.as_deref().unwrap_or("show");
        Ok(Settings {
            frame: call.frame,
            channels: call.channels.iter().map(|name| channel(name)).collect::<PyResult<_>>()?,
            surface: TruthSurface::from_name(&call.surface).ok_or_else(|| unknown("surface", &call.surface))?,
            transparent_background: call.transparent_background,
            catchers: Catchers::from_name(catchers).ok_or_else(|| unknown("catchers", catchers))?,
            region: call.region,
            ..Settings::resolve(&self.options).or_raise()?
        })
    }

    /// Flag that cancels the render.
    pub(crate) fn cancel(&self) -> Option<&Py<Cancel>> {
        self.call.cancel.as_ref()
    }
}

/// Reads options from a dict of their values; None counts as absent.
fn options_from_dict(options: &Bound<'_, PyDict>) -> PyResult<RenderOptions> {
    let values = to_value(options, "").map_err(|error| as_settings_error(options.py(), error))?;
    from_value(&values).map_err(|error| settings_error(error.to_string()))
}

/// Returns the given options as a dict.
pub(crate) fn options_dict<'py>(py: Python<'py>, options: &RenderOptions) -> DictResult<'py> {
    let dict = PyDict::new(py);
    for (row, value) in options.values() {
        match value {
            OptionValue::Name(name) => dict.set_item(row.name, name)?,
            OptionValue::Whole(number) => dict.set_item(row.name, number)?,
            OptionValue::Number(number) => dict.set_item(row.name, number)?,
            OptionValue::Switch(on) => dict.set_item(row.name, on)?,
        }
    }
    Ok(dict)
}

/// Options of a call. Options that are not passed to the call come from the world's `[render]` section or are the
/// defaults.
#[pyfunction]
#[pyo3(signature = (world, options))]
pub(crate) fn complete_render_options<'py>(
    py: Python<'py>,
    world: Option<&World>,
    options: &Bound<'py, PyDict>,
) -> DictResult<'py> {
    let mut options = options_from_dict(options)?;
    if let Some(world) = world {
        options = options.or(&world.snapshot().render);
    }
    options_dict(py, &options.complete().map_err(|error| settings_error(error.to_string()))?)
}

/// Returns the table of render options: a dict for each option with `name`, `kind`, `help`, `expected`, `default`
/// (None: off), and `choices`, or `minimum` and `maximum`.
#[pyfunction]
pub(crate) fn render_options(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let defaults = options_dict(py, &RenderOptions::defaults())?;
    let describe = |row: &RenderOption| {
        let dict = PyDict::new(py);
        dict.set_item("name", row.name)?;
        dict.set_item("help", row.help())?;
        dict.set_item("expected", row.range.to_string())?;
        dict.set_item("default", defaults.get_item(row.name)?)?;
        let kind = match row.range {
            OptionRange::Names(names) => {
                dict.set_item("choices", names)?;
                "name"
            }
            OptionRange::Whole { min, max } => {
                dict.set_item("minimum", min)?;
                dict.set_item("maximum", max)?;
                "whole number"
            }
            OptionRange::Radiance => "radiance",
            OptionRange::Seconds => "seconds",
            OptionRange::Stops => "stops",
            OptionRange::SwitchOrDistance => "switch or distance",
        };
        dict.set_item("kind", kind)?;
        Ok(dict)
    };
    RENDER_OPTIONS.iter().map(describe).collect()
}
