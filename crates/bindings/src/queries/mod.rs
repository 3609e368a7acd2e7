//! Queries of worlds: rays, points and pairs of points; colours of photographs.

pub(crate) mod lidar;
pub(crate) mod photo_pyramid;
pub(crate) mod points;
pub(crate) mod rays;
pub(crate) mod texel_views;

use numpy::Element;
use pyo3::prelude::*;
use raycam_render::{Control, PreparedWorld, RenderError};

use crate::arrays::{ArrayResult, array};
use crate::interruptible::run_for_work;
use crate::world::state::World;

/// Prepares a world and answers a query with it. The query can be interrupted unless it `is_brief`.
fn answer<T: Send>(
    world: &Bound<'_, World>,
    threads: Option<usize>,
    is_brief: bool,
    work: impl FnOnce(&PreparedWorld, &Control) -> Result<T, RenderError> + Send,
) -> PyResult<T> {
    let prepared = world.get().prepared(world.py(), threads)?;
    run_for_work(world.py(), is_brief, None, |control| work(&prepared, control))
}

/// Same as [`answer`], but returns the answer as a one-dimensional array.
fn answer_array<'py, T: Element + Send>(
    world: &Bound<'py, World>,
    threads: Option<usize>,
    is_brief: bool,
    work: impl FnOnce(&PreparedWorld, &Control) -> Result<Vec<T>, RenderError> + Send,
) -> ArrayResult<'py, T> {
    let found = answer(world, threads, is_brief, work)?;
    let count = found.len();
    array(world.py(), found, &[count])
}
