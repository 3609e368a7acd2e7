//! Queries of worlds: rays, points and pairs of points.

pub(crate) mod points;
pub(crate) mod rays;

use pyo3::prelude::*;
use raycam_render::{Control, PreparedWorld, RenderError};

use crate::interruptible::run_for_work;
use crate::world::state::World;

/// Answers a query of a world, which is prepared first, until it is done or, unless it
/// `is_brief`, interrupted.
fn answer<T: Send>(
    py: Python<'_>,
    world: &World,
    threads: Option<usize>,
    is_brief: bool,
    work: impl FnOnce(&PreparedWorld, &Control) -> Result<T, RenderError> + Send,
) -> PyResult<T> {
    let prepared = world.prepared(py, threads)?;
    run_for_work(py, is_brief, None, |control| work(&prepared, control))
}
