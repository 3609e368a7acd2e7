//! Light at points of surfaces and along rays. Python has already converted the arrays to C order and equal length.

use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use raycam_render::Control;
use raycam_render::queries::light::{LightRays, PointLight, Quantity, SurfacePoints, light_at, radiance_along};

use crate::arrays::{Floats, NewArray, array, flat, rows};
use crate::error::settings_error;
use crate::interruptible::run_for_work;
use crate::render::settings::RenderArguments;
use crate::world::state::World;

/// A dict of points \[n]: their objects, triangles, barycentric coordinates, normals, and pixels that select the
/// random numbers.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PointArguments<'py> {
    instance: PyReadonlyArrayDyn<'py, i32>,
    triangle: PyReadonlyArrayDyn<'py, i32>,
    barycentric: Floats<'py>,
    normal: Floats<'py>,
    pixel: PyReadonlyArrayDyn<'py, i32>,
}

/// The light \[n, 3] at points, and its standard error \[n].
type LightParts<'py> = (NewArray<'py, f32>, NewArray<'py, f32>);

/// Returns the irradiance at points, or the radiance that leaves them along their normals, and its standard error.
#[pyfunction]
pub(crate) fn world_light_at<'py>(
    world: &Bound<'py, World>,
    points: PointArguments<'py>,
    quantity: &str,
    arguments: RenderArguments,
) -> PyResult<LightParts<'py>> {
    let settings = arguments.settings()?;
    let quantity = match quantity {
        "irradiance" => Quantity::Irradiance,
        "radiance" => Quantity::Radiance,
        name => return Err(settings_error(format!("unknown quantity {name:?}"))),
    };
    let places = SurfacePoints {
        instances: flat(&points.instance, "instance")?,
        triangles: flat(&points.triangle, "triangle")?,
        barycentrics: rows(&points.barycentric, "barycentric")?,
        normals: rows(&points.normal, "normal")?,
        pixels: rows(&points.pixel, "pixel")?,
    };
    let py = world.py();
    let prepared = world.get().prepared(py, settings.threads)?;
    let work = |control: &Control| light_at(&prepared, &places, quantity, &settings, control);
    to_arrays(py, run_for_work(py, false, None, work)?)
}

fn to_arrays(py: Python<'_>, PointLight { light, error }: PointLight) -> PyResult<LightParts<'_>> {
    let n = error.len();
    Ok((array(py, light.into_flattened(), &[n, 3])?, array(py, error, &[n])?))
}

/// A dict of rays \[n]: their origins, unit directions, and pixels that select the random numbers.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LightRayArguments<'py> {
    origin: Floats<'py>,
    direction: Floats<'py>,
    pixel: PyReadonlyArrayDyn<'py, i32>,
}

/// Returns the radiance along rays and its standard error.
#[pyfunction]
pub(crate) fn world_radiance_along<'py>(
    world: &Bound<'py, World>,
    rays: LightRayArguments<'py>,
    arguments: RenderArguments,
) -> PyResult<LightParts<'py>> {
    let settings = arguments.settings()?;
    let rays = LightRays {
        origins: rows(&rays.origin, "origin")?,
        directions: rows(&rays.direction, "direction")?,
        pixels: rows(&rays.pixel, "pixel")?,
    };
    let py = world.py();
    let prepared = world.get().prepared(py, settings.threads)?;
    let work = |control: &Control| radiance_along(&prepared, &rays, &settings, control);
    to_arrays(py, run_for_work(py, false, None, work)?)
}
