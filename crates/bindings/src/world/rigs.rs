//! Rigs of worlds.

use pyo3::prelude::*;

use crate::camera::rig::{Rig, wrap};
use crate::error::{OrRaise, world_error};
use crate::world::state::World;

/// Adds a rig and its cameras to a world.
#[pyfunction]
pub(crate) fn world_add_rig(world: &World, rig: &Rig) -> PyResult<()> {
    world.modify_unseen(|world| world.add_rig(rig.inner.clone()).map(drop).or_raise())
}

/// The rigs of a world.
#[pyfunction]
pub(crate) fn world_rigs(world: &World) -> Vec<Rig> {
    let world = world.snapshot();
    let rigs = world.rigs.iter().cloned();
    rigs.map(|inner| Rig { inner }).collect()
}

/// A rig as the video of a world moves it: the world's of that name, where `named_cameras`.
#[pyfunction]
pub(crate) fn world_rig_at(world: &World, rig: &Rig, time: f64) -> PyResult<Rig> {
    let world = world.snapshot();
    let video = world.video.as_ref().ok_or_else(|| world_error("the world has no [video]"))?;
    let name = rig.inner.name();
    let index = world.rigs.iter().position(|known| known.name() == name);
    wrap(video.rig_at(&rig.inner, index, time))
}
