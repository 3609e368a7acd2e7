//! The arguments of a render.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::{Catchers, Filter, Integrator, Settings, TruthSurface};
use raycam_scene::ViewTransform;
use raycam_scene::render_options::{AmbientOcclusion, FilterName, IntegratorName, RenderOptions};

use crate::arrays::DictResult;
use crate::cancel::Cancel;
use crate::error::settings_error;
use crate::render::frame::channel;

/// A dict of everything that [`Settings`] holds, with names for the members of enums.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct RenderArguments {
    integrator: String,
    samples: u32,
    #[pyo3(default)]
    noise_threshold: Option<f32>,
    #[pyo3(default)]
    time_limit: Option<f64>,
    /// The names of noise threshold, time limit and transparent background until 0.2.
    #[pyo3(default)]
    noise: Option<f32>,
    #[pyo3(default)]
    time: Option<f64>,
    #[pyo3(default)]
    transparent: bool,
    filter: String,
    seed: u64,
    frame: u32,
    channels: Vec<String>,
    surface: String,
    #[pyo3(default)]
    transparent_background: bool,
    #[pyo3(default)]
    catchers: Option<String>,
    max_depth: Option<u32>,
    clamp: Option<f32>,
    ambient_occlusion: Option<f64>,
    region: Option<[u32; 4]>,
    threads: Option<usize>,
    /// The switch that ends the render.
    #[pyo3(default)]
    pub(crate) cancel: Option<Py<Cancel>>,
}

impl RenderArguments {
    /// As `render` wants it.
    pub(crate) fn settings(&self) -> PyResult<Settings> {
        let unknown = |what, name: &str| settings_error(format!("unknown {what} {name:?}"));
        Ok(Settings {
            integrator: match &self.integrator[..] {
                "flat" => Integrator::Flat,
                "direct" => Integrator::Direct,
                "path" => Integrator::Path,
                "ao" => Integrator::Ao,
                name => return Err(unknown("integrator", name)),
            },
            samples: self.samples,
            noise: self.noise_threshold.or(self.noise),
            time: self.time_limit.or(self.time),
            filter: match &self.filter[..] {
                "box" => Filter::Box,
                "blackman-harris" => Filter::BlackmanHarris,
                name => return Err(unknown("filter", name)),
            },
            seed: self.seed,
            frame: self.frame,
            channels: self.channels.iter().map(|name| channel(name)).collect::<PyResult<_>>()?,
            surface: match &self.surface[..] {
                "first" => TruthSurface::First,
                "solid" => TruthSurface::Solid,
                name => return Err(unknown("surface", name)),
            },
            transparent: self.transparent_background || self.transparent,
            catchers: match self.catchers.as_deref() {
                None | Some("show") => Catchers::Show,
                Some("hide") => Catchers::Hide,
                Some("only") => Catchers::Only,
                Some(name) => return Err(unknown("catchers", name)),
            },
            max_depth: self.max_depth,
            clamp: self.clamp,
            ambient_occlusion: self.ambient_occlusion,
            region: self.region,
            threads: self.threads,
        })
    }
}

/// `[render]` of a world file as a dict of the keys that are given.
pub(crate) fn render_section_dict<'py>(py: Python<'py>, options: &RenderOptions) -> DictResult<'py> {
    fn set_item<'py>(dict: &Bound<'py, PyDict>, key: &str, value: Option<impl IntoPyObject<'py>>) -> PyResult<()> {
        value.map_or(Ok(()), |value| dict.set_item(key, value))
    }
    let dict = PyDict::new(py);
    set_item(&dict, "integrator", options.integrator.map(IntegratorName::name))?;
    set_item(&dict, "max_depth", options.max_depth)?;
    set_item(&dict, "clamp", options.clamp)?;
    set_item(&dict, "samples", options.samples)?;
    set_item(&dict, "noise_threshold", options.noise_threshold)?;
    set_item(&dict, "time_limit", options.time_limit)?;
    set_item(
        &dict,
        "filter",
        options.filter.map(|name| match name {
            FilterName::Box => "box",
            FilterName::BlackmanHarris => "blackman-harris",
        }),
    )?;
    set_item(&dict, "seed", options.seed)?;
    set_item(&dict, "threads", options.threads)?;
    match options.ambient_occlusion {
        Some(AmbientOcclusion::Switch(on)) => dict.set_item("ambient_occlusion", on)?,
        Some(AmbientOcclusion::Distance(distance)) => dict.set_item("ambient_occlusion", distance)?,
        None => {}
    }
    set_item(&dict, "exposure", options.exposure)?;
    set_item(&dict, "view", options.view.map(ViewTransform::name))?;
    Ok(dict)
}
