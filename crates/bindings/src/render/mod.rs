//! Renders, ray queries and annotations of worlds, and pictures as bytes.

pub(crate) mod annotations;
pub(crate) mod encode;
pub(crate) mod frame;
pub(crate) mod settings;

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::annotations::ray_queries;
use raycam_render::{checked_region, render_into};

use crate::arrays::{Floats, array, hits_to_dict, rows};
use crate::buffer_pool::OutputPlanes;
use crate::camera::Camera;
use crate::error::IntoPyErr;
use crate::interruptible::run_interruptible;
use crate::render::frame::FrameParts;
use crate::render::settings::RenderArguments;
use crate::world::state::World;

/// How rays are traced.
#[derive(Clone, Copy)]
pub(crate) struct RayOptions {
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
        run_interruptible(py, progress, |control| {
            let camera = &camera.inner;
            render_into(&world, &prepared, camera, &settings, control, targets)
        })
    })?;
    let planes = planes.into_arrays(py, [height as usize, width as usize])?;
    Ok((planes, region.into(), notices))
}

/// The closest hits of rays, by the names of `World.cast_rays`.
pub(crate) fn cast_rays<'py>(
    py: Python<'py>,
    world: &World,
    origins: &Floats<'py>,
    directions: &Floats<'py>,
    RayOptions { coherent, threads }: RayOptions,
) -> PyResult<Bound<'py, PyDict>> {
    let (origins, directions) = (rows(origins, "origins")?, rows(directions, "directions")?);
    let prepared = world.prepared(py, threads)?;
    let hits = run_interruptible(py, None, |control| {
        ray_queries::cast_rays(&prepared, origins, directions, coherent, threads, control)
    })?;
    hits_to_dict(py, hits)
}

/// For each ray, true if anything lies before its `t_max`.
pub(crate) fn occluded<'py>(
    py: Python<'py>,
    world: &World,
    [origins, directions, t_max]: [&Floats<'py>; 3],
    RayOptions { coherent, threads }: RayOptions,
) -> PyResult<Bound<'py, PyArrayDyn<bool>>> {
    let (origins, directions) = (rows(origins, "origins")?, rows(directions, "directions")?);
    let t_max = rows::<f64, 1>(t_max, "t_max")?.as_flattened();
    let prepared = world.prepared(py, threads)?;
    let occluded = run_interruptible(py, None, |control| {
        ray_queries::occluded(&prepared, origins, directions, t_max, coherent, threads, control)
    })?;
    array(py, occluded, &[origins.len()])
}
