//! Renders and annotations of worlds, and pictures as bytes.

pub(crate) mod annotations;
pub(crate) mod encode;
pub(crate) mod frame;
pub(crate) mod settings;

use pyo3::prelude::*;
use raycam_render::{checked_region, render_into};

use crate::buffer_pool::OutputPlanes;
use crate::camera::Camera;
use crate::error::IntoPyErr;
use crate::interruptible::run_interruptible;
use crate::render::frame::FrameParts;
use crate::render::settings::RenderArguments;
use crate::world::state::World;

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
