//! Renders and annotations of worlds, and pictures as bytes.

pub(crate) mod annotations;
pub(crate) mod encode;
pub(crate) mod frame;
pub(crate) mod progressive;
pub(crate) mod settings;

use pyo3::prelude::*;
use raycam_render::{Control, checked_region, is_brief, render_into};

use crate::buffer_pool::OutputPlanes;
use crate::camera::Camera;
use crate::error::IntoPyErr;
use crate::interruptible::{run_cancellable, run_for_work};
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
    let cancel = arguments.cancel.as_ref().map(|cancel| &cancel.get().control);
    let (world, prepared) = world.prepared_world(py, settings.threads)?;
    let region = checked_region(&camera.inner, &settings);
    let ([_, _, width, height], pixels) = region.map_err(IntoPyErr::into_py_err)?;
    let planes = OutputPlanes::new(py, &settings.channels, pixels);
    let (region, notices) = planes.write(py, |targets| {
        let camera = &camera.inner;
        let work = |control: &Control| render_into(&world, &prepared, camera, &settings, control, targets);
        match progress {
            None => run_for_work(py, is_brief(&world, &prepared, camera, &settings), cancel, work),
            Some(_) => run_cancellable(py, progress, cancel, work),
        }
    })?;
    let planes = planes.into_arrays(py, [height as usize, width as usize])?;
    Ok((planes, region.into(), notices))
}
