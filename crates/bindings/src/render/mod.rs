//! Renders, ray queries and annotations of worlds, and pictures as bytes.

pub(crate) mod annotations;
pub(crate) mod encode;
pub(crate) mod frame;
pub(crate) mod settings;

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::annotations::ray_queries::{self, Kernel, RayArrays};
use raycam_render::{Control, checked_region, is_brief, render_into};

use crate::arrays::{Floats, array, hits_to_dict, rows};
use crate::buffer_pool::OutputPlanes;
use crate::camera::Camera;
use crate::error::IntoPyErr;
use crate::interruptible::{run_for_work, run_interruptible};
use crate::render::frame::FrameParts;
use crate::render::settings::RenderArguments;
use crate::world::state::World;

/// How rays are traced.
#[derive(Clone, Copy)]
pub(crate) struct RayOptions {
    /// True if exact signs decide, false if float32 does.
    pub(crate) exact: bool,
    /// True if neighbouring rays run alike; decided from the rays without.
    pub(crate) coherent: Option<bool>,
    /// All of the machine's without.
    pub(crate) threads: Option<usize>,
}

/// Renders a picture into arrays.
pub(crate) fn render<'py>(
    py: Python<'py>,
    world: &World,
    camera: &Camera,
    arguments: &RenderArguments,
    progress: Option<&Py<PyAny>>,
) -> PyResult<FrameParts<'py>> {
    let settings = arguments.settings()?;
    let (world, prepared) = world.prepared_world(py, settings.threads)?;
    let region = checked_region(&camera.inner, &settings);
    let ([_, _, width, height], pixels) = region.map_err(IntoPyErr::into_py_err)?;
    let planes = OutputPlanes::new(py, &settings.channels, pixels);
    let (region, notices) = planes.write(py, |targets| {
        let camera = &camera.inner;
        let work = |control: &Control| render_into(&world, &prepared, camera, &settings, control, targets);
        match progress {
            None => run_for_work(py, is_brief(&world, &prepared, camera, &settings), work),
            Some(_) => run_interruptible(py, progress, work),
        }
    })?;
    let planes = planes.into_arrays(py, [height as usize, width as usize])?;
    Ok((planes, region.into(), notices))
}

/// Arrays of rays from Python: [n, 3] and, for the limits, [1, 1] or [n, 1].
pub(crate) struct PyRays<'py> {
    pub(crate) origins: Floats<'py>,
    pub(crate) directions: Floats<'py>,
    pub(crate) t_min: Floats<'py>,
    pub(crate) t_max: Floats<'py>,
}

impl PyRays<'_> {
    fn arrays(&self, RayOptions { exact, coherent, .. }: RayOptions) -> PyResult<RayArrays<'_>> {
        Ok(RayArrays {
            origins: rows(&self.origins, "origins")?,
            directions: rows(&self.directions, "directions")?,
            t_min: rows::<f64, 1>(&self.t_min, "t_min")?.as_flattened(),
            t_max: rows::<f64, 1>(&self.t_max, "t_max")?.as_flattened(),
            kernel: if exact { Kernel::Exact } else { Kernel::Float32 { coherent } },
        })
    }
}

/// The closest hits of rays, by the names of `World.cast_rays`.
pub(crate) fn cast_rays<'py>(
    py: Python<'py>,
    world: &World,
    rays: &PyRays<'py>,
    options: RayOptions,
) -> PyResult<Bound<'py, PyDict>> {
    let arrays = rays.arrays(options)?;
    let prepared = world.prepared(py, options.threads)?;
    let is_brief = ray_queries::is_brief(arrays.origins.len());
    let hits =
        run_for_work(py, is_brief, |control| ray_queries::cast_rays(&prepared, &arrays, options.threads, control))?;
    hits_to_dict(py, hits)
}

/// For each ray, true if anything lies in its range of t.
pub(crate) fn occluded<'py>(
    py: Python<'py>,
    world: &World,
    rays: &PyRays<'py>,
    options: RayOptions,
) -> PyResult<Bound<'py, PyArrayDyn<bool>>> {
    let arrays = rays.arrays(options)?;
    let prepared = world.prepared(py, options.threads)?;
    let is_brief = ray_queries::is_brief(arrays.origins.len());
    let occluded =
        run_for_work(py, is_brief, |control| ray_queries::occluded(&prepared, &arrays, options.threads, control))?;
    array(py, occluded, &[arrays.origins.len()])
}
