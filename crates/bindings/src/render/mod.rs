//! Renders and annotations of worlds, light at points of their surfaces, and images as bytes.

pub(crate) mod annotations;
pub(crate) mod encode;
pub(crate) mod frame;
pub(crate) mod light;
pub(crate) mod progressive;
pub(crate) mod settings;

use pyo3::prelude::*;
use raycam_render::{BrightPath, Control, brightest_samples, checked_region, is_brief, render_into};

use crate::buffer_pool::OutputPlanes;
use crate::camera::Camera;
use crate::error::OrRaise;
use crate::interruptible::{run_cancellable, run_for_work};
use crate::render::frame::FrameParts;
use crate::render::settings::RenderArguments;
use crate::world::state::World;

/// Brightest sample of a pixel: the sample's fraction of the pixel's light, the instances that its path hits, and the
/// ray towards the light (origin, direction, distance).
pub(crate) type BrightestSample = (f64, Vec<u32>, [f64; 3], [f32; 3], f64);

/// Returns the brightest sample of each given pixel, None for a black pixel. The list is empty if the world moves while
/// the shutter is open.
pub(crate) fn brightest(
    py: Python<'_>,
    world: &World,
    camera: &Camera,
    arguments: &RenderArguments,
    pixels: &[[u32; 2]],
) -> PyResult<Vec<Option<BrightestSample>>> {
    let settings = arguments.settings()?;
    let (world, prepared) = world.prepared_world(py, settings.threads)?;
    if camera.inner.motion().is_some() && world.time.is_some() && world.is_animated() {
        return Ok(vec![]);
    }
    let cancel = arguments.cancel().map(|cancel| &cancel.get().control);
    let found = run_cancellable(py, None, cancel, |control| {
        brightest_samples(&prepared, &camera.inner, &settings, pixels, control)
    })?;
    let parts = |(part, path): (f64, BrightPath)| {
        (part, path.instances, path.origin.to_array(), path.direction.to_array(), path.distance)
    };
    Ok(found.into_iter().map(|sample| sample.map(parts)).collect())
}

/// Renders an image into arrays.
pub(crate) fn render<'py>(
    py: Python<'py>,
    world: &World,
    camera: &Camera,
    arguments: &RenderArguments,
    progress: Option<&Py<PyAny>>,
) -> PyResult<FrameParts<'py>> {
    let settings = arguments.settings()?;
    let cancel = arguments.cancel().map(|cancel| &cancel.get().control);
    let (world, prepared) = world.prepared_world(py, settings.threads)?;
    let ([_, _, width, height], pixels) = checked_region(&camera.inner, &settings).or_raise()?;
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
    Ok((planes, region.into(), notices.into()))
}
