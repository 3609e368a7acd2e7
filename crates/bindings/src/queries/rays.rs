//! Queries of rays. Python has already made the arrays C-contiguous and broadcast them.

use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::TruthSurface;
use raycam_render::queries::crossings;
use raycam_render::queries::fields::{Column, Columns, FIELDS, Field};
use raycam_render::queries::rays::{self, Kernel, RayArrays};
use raycam_render::queries::selection::{Facing, Selection};
use raycam_render::queries::timed::{self, MovingWorld};

use crate::arrays::{ArrayResult, DictResult, Floats, array, flat, rows};
use crate::cancel::Cancel;
use crate::error::settings_error;
use crate::interruptible::run_for_work;
use crate::queries::{answer, answer_array};
use crate::world::state::World;

/// Rays from a dict: origins and directions \[n, 3], the limits of t \[1] or \[n], and the objects that rays can hit.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct RayArguments<'py> {
    origins: Floats<'py>,
    directions: Floats<'py>,
    t_min: Floats<'py>,
    t_max: Floats<'py>,
    /// True if hits are decided by exact arithmetic; false if float32 is sufficient.
    exact: bool,
    coherent: Option<bool>,
    objects: Option<PyReadonlyArrayDyn<'py, bool>>,
    /// For each ray, the object and the triangle that it starts on, which are ignored: two arrays \[n].
    skip: Option<(PyReadonlyArrayDyn<'py, i32>, PyReadonlyArrayDyn<'py, i32>)>,
    facing: String,
    surface: String,
    /// One time per ray, in seconds after the world's time.
    times: Option<Floats<'py>>,
    threads: Option<usize>,
}

impl RayArguments<'_> {
    fn arrays(&self) -> PyResult<RayArrays<'_>> {
        let skip = match &self.skip {
            Some((objects, triangles)) => Some((flat(objects, "skip")?, flat(triangles, "skip")?)),
            None => None,
        };
        let facing = match &self.facing[..] {
            "both" => Facing::Both,
            "front" => Facing::Front,
            "back" => Facing::Back,
            "material" => Facing::Material,
            name => {
                return Err(settings_error(format!(
                    "unknown facing {name:?}; expected \"both\", \"front\", \"back\" or \"material\""
                )));
            }
        };
        Ok(RayArrays {
            origins: rows(&self.origins, "origins")?,
            directions: rows(&self.directions, "directions")?,
            t_min: flat(&self.t_min, "t_min")?,
            t_max: flat(&self.t_max, "t_max")?,
            kernel: if self.exact { Kernel::Exact } else { Kernel::Float32 { coherent: self.coherent } },
            selection: Selection {
                objects: mask(self.objects.as_ref())?,
                skip,
                facing,
                surface: surface(&self.surface)?,
            },
        })
    }

    /// Returns the time of each ray, if given.
    fn times(&self) -> PyResult<Option<&[f64]>> {
        self.times.as_ref().map(|times| flat(times, "times")).transpose()
    }
}

/// Returns one flag per object (true selects the object), or none if all objects are selected.
pub(crate) fn mask<'a>(objects: Option<&'a PyReadonlyArrayDyn<'_, bool>>) -> PyResult<Option<&'a [bool]>> {
    objects.map(|objects| flat(objects, "objects")).transpose()
}

/// Converts "first" or "solid" to the surface that ground truth shows.
pub(crate) fn surface(name: &str) -> PyResult<TruthSurface> {
    match name {
        "first" => Ok(TruthSurface::First),
        "solid" => Ok(TruthSurface::Solid),
        _ => Err(settings_error(format!("unknown surface {name:?}; expected \"first\" or \"solid\""))),
    }
}

/// Returns the names of the fields of hits.
#[pyfunction]
pub(crate) fn ray_fields() -> Vec<&'static str> {
    FIELDS.iter().map(|(name, _)| *name).collect()
}

fn fields(names: &[String]) -> PyResult<Vec<Field>> {
    let field = |name: &String| {
        let found = FIELDS.iter().find(|(known, _)| known == name).map(|(_, field)| *field);
        found.ok_or_else(|| settings_error(format!("unknown field {name:?}")))
    };
    names.iter().map(field).collect()
}

/// Converts columns to a dict from field names to arrays \[n] or \[n, width].
fn columns_to_dict(py: Python<'_>, columns: Columns) -> DictResult<'_> {
    let dict = PyDict::new(py);
    for (field, column) in columns.0 {
        let name = FIELDS.iter().find(|(_, known)| *known == field).map_or("", |(name, _)| name);
        let shape = match field.width() {
            1 => vec![column.len()],
            width => vec![column.len() / width, width],
        };
        match column {
            Column::Float64(values) => dict.set_item(name, array(py, values, &shape)?)?,
            Column::Float32(values) => dict.set_item(name, array(py, values, &shape)?)?,
            Column::Int32(values) => dict.set_item(name, array(py, values, &shape)?)?,
            Column::Bool(values) => dict.set_item(name, array(py, values, &shape)?)?,
        }
    }
    Ok(dict)
}

/// Returns the requested fields (`names`) of the first hit of each ray, as arrays by name.
#[pyfunction]
pub(crate) fn world_cast_rays<'py>(
    world: &Bound<'py, World>,
    query: RayArguments<'py>,
    names: Vec<String>,
    cancel: Option<PyRef<'py, Cancel>>,
) -> DictResult<'py> {
    let (py, threads) = (world.py(), query.threads);
    let (arrays, times, fields) = (query.arrays()?, query.times()?, fields(&names)?);
    let (world, prepared) = world.get().prepared_world(py, threads)?;
    let is_brief = times.is_none() && rays::is_brief(arrays.origins.len());
    let cancel = cancel.as_deref().map(|cancel| &cancel.control);
    let found = run_for_work(py, is_brief, cancel, |control| match times {
        None => rays::cast_rays(&prepared, &arrays, &fields, threads, control),
        Some(times) => {
            let moving = MovingWorld { world: &world, prepared: &prepared };
            timed::cast_rays_at(&moving, &arrays, times, &fields, threads, control)
        }
    })?;
    columns_to_dict(py, found)
}

/// Returns for each ray true if any surface is within its range of t.
#[pyfunction]
pub(crate) fn world_occluded<'py>(world: &Bound<'py, World>, query: RayArguments<'py>) -> ArrayResult<'py, bool> {
    let (py, threads) = (world.py(), query.threads);
    let (arrays, times) = (query.arrays()?, query.times()?);
    let (world, prepared) = world.get().prepared_world(py, threads)?;
    let is_brief = times.is_none() && rays::is_brief(arrays.origins.len());
    let found = run_for_work(py, is_brief, None, |control| match times {
        None => rays::occluded(&prepared, &arrays, threads, control),
        Some(times) => {
            let moving = MovingWorld { world: &world, prepared: &prepared };
            timed::occluded_at(&moving, &arrays, times, threads, control)
        }
    })?;
    let count = found.len();
    array(py, found, &[count])
}

/// Returns the crossings of each ray, at most `max_hits` per ray, as arrays by name: `offsets` [n + 1] (the crossings
/// of ray i are `offsets[i]..offsets[i + 1]`), `ray` and the requested fields.
#[pyfunction]
pub(crate) fn world_intersections<'py>(
    world: &Bound<'py, World>,
    query: RayArguments<'py>,
    max_hits: Option<usize>,
    names: Vec<String>,
) -> DictResult<'py> {
    let (arrays, fields, threads) = (query.arrays()?, fields(&names)?, query.threads);
    let found = answer(world, threads, crossings::is_brief(arrays.origins.len()), |prepared, control| {
        crossings::intersections(prepared, &arrays, max_hits, &fields, threads, control)
    })?;
    let py = world.py();
    let dict = PyDict::new(py);
    let (offsets, owners) = (found.offsets.len(), found.rays.len());
    dict.set_item("offsets", array(py, found.offsets, &[offsets])?)?;
    dict.set_item("ray", array(py, found.rays, &[owners])?)?;
    dict.update(columns_to_dict(py, found.columns)?.as_mapping())?;
    Ok(dict)
}

/// Returns the number of crossings of each ray. `signed`: the number of exits minus the number of entries.
#[pyfunction]
pub(crate) fn world_count_intersections<'py>(
    world: &Bound<'py, World>,
    query: RayArguments<'py>,
    signed: bool,
) -> ArrayResult<'py, i32> {
    let (arrays, threads) = (query.arrays()?, query.threads);
    answer_array(world, threads, crossings::is_brief(arrays.origins.len()), |prepared, control| {
        crossings::count_intersections(prepared, &arrays, signed, threads, control)
    })
}
