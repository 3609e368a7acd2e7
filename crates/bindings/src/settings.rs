//! What is asked of a picture.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::{Filter, Integrator, Settings, TruthSurface};
use raycam_scene::ViewTransform;
use raycam_scene::schema::{AmbientOcclusion, FilterName, IntegratorName, RenderSpec};

use crate::error::settings_error;
use crate::frame::channel;

/// A dict of everything that [`Settings`] holds, with names for the members of enums.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Request {
    integrator: String,
    samples: u32,
    noise: Option<f32>,
    time: Option<f64>,
    filter: String,
    seed: u64,
    frame: u32,
    channels: Vec<String>,
    surface: String,
    transparent: bool,
    max_depth: Option<u32>,
    clamp: Option<f32>,
    ambient_occlusion: Option<f64>,
    region: Option<[u32; 4]>,
    threads: Option<usize>,
}

impl Request {
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
            noise: self.noise,
            time: self.time,
            filter: match &self.filter[..] {
                "box" => Filter::Box,
                "blackman-harris" => Filter::BlackmanHarris,
                name => return Err(unknown("filter", name)),
            },
            seed: self.seed,
            frame: self.frame,
            channels: self
                .channels
                .iter()
                .map(|name| channel(name))
                .collect::<PyResult<_>>()?,
            surface: match &self.surface[..] {
                "first" => TruthSurface::First,
                "solid" => TruthSurface::Solid,
                name => return Err(unknown("surface", name)),
            },
            transparent: self.transparent,
            max_depth: self.max_depth,
            clamp: self.clamp,
            ambient_occlusion: self.ambient_occlusion,
            region: self.region,
            threads: self.threads,
        })
    }
}

/// What `[render]` of a world file says, and nothing that it does not.
pub(crate) fn written<'py>(py: Python<'py>, spec: &RenderSpec) -> PyResult<Bound<'py, PyDict>> {
    fn put<'py>(
        dict: &Bound<'py, PyDict>,
        key: &str,
        value: Option<impl IntoPyObject<'py>>,
    ) -> PyResult<()> {
        value.map_or(Ok(()), |value| dict.set_item(key, value))
    }
    let dict = PyDict::new(py);
    put(
        &dict,
        "integrator",
        spec.integrator.map(IntegratorName::name),
    )?;
    put(&dict, "max_depth", spec.max_depth)?;
    put(&dict, "clamp", spec.clamp)?;
    put(&dict, "samples", spec.samples)?;
    put(&dict, "noise", spec.noise)?;
    put(&dict, "time", spec.time)?;
    put(
        &dict,
        "filter",
        spec.filter.map(|name| match name {
            FilterName::Box => "box",
            FilterName::BlackmanHarris => "blackman-harris",
        }),
    )?;
    put(&dict, "seed", spec.seed)?;
    put(&dict, "threads", spec.threads)?;
    match spec.ambient_occlusion {
        Some(AmbientOcclusion::Switch(on)) => dict.set_item("ambient_occlusion", on)?,
        Some(AmbientOcclusion::Distance(distance)) => {
            dict.set_item("ambient_occlusion", distance)?
        }
        None => {}
    }
    put(&dict, "exposure", spec.exposure)?;
    put(&dict, "view", spec.view.map(ViewTransform::name))?;
    Ok(dict)
}
