//! Rigs and sensors of worlds.

use pyo3::prelude::*;

use crate::camera::rig::{Rig, wrap};
use crate::camera::sensor::{SensorData, named_sensor, sensor_data};
use crate::error::{OrRaise, world_error};
use crate::world::state::World;

/// Adds a rig and its cameras to a world.
#[pyfunction]
pub(crate) fn world_add_rig(world: &World, rig: &Rig) -> PyResult<()> {
    world.modify_unseen(|world| world.add_rig(rig.inner.clone()).map(drop).or_raise())
}

/// Returns the rigs of a world.
#[pyfunction]
pub(crate) fn world_rigs(world: &World) -> Vec<Rig> {
    let world = world.snapshot();
    let rigs = world.rigs.iter().cloned();
    rigs.map(|inner| Rig { inner }).collect()
}

/// The sensors of a world that are neither cameras nor on a rig.
#[pyfunction]
pub(crate) fn world_sensors(world: &World) -> Vec<SensorData> {
    world.snapshot().sensors.iter().map(sensor_data).collect()
}

/// Adds a sensor by name, kind and settings, which contain the pose.
#[pyfunction]
pub(crate) fn world_add_sensor(world: &World, name: String, kind: String, settings: String) -> PyResult<()> {
    let sensor = named_sensor((name, kind, settings));
    sensor.validate().or_raise()?;
    world.modify_unseen(|world| {
        world.add_sensor(sensor);
        Ok(())
    })
}

/// Index of an object, its reflectance, its retroreflection, and the table of its retroreflection.
type LidarSurfaceParts = (usize, Option<f64>, Option<f64>, Option<Vec<[f64; 2]>>);

/// Returns the lidar properties of each object that has the key `lidar`.
#[pyfunction]
pub(crate) fn world_lidar_surfaces(world: &World) -> Vec<LidarSurfaceParts> {
    let world = world.snapshot();
    let parts = |(id, object): (usize, &raycam_scene::Object)| {
        let own = object.lidar.clone()?;
        Some((id, own.reflectance, own.retroreflection, own.retroreflection_table))
    };
    world.objects.iter().enumerate().filter_map(parts).collect()
}

/// True if a material of the world has a texture of reflectances for lidars.
#[pyfunction]
pub(crate) fn world_has_reflectances(world: &World) -> bool {
    world.snapshot().materials.iter().any(|material| material.reflectance.is_some())
}

/// Returns a rig as moved by the video of a world: by the keyframes of the world's rig with the same name, otherwise by
/// the keyframes of the camera.
#[pyfunction]
pub(crate) fn world_rig_at(world: &World, rig: &Rig, time: f64) -> PyResult<Rig> {
    let world = world.snapshot();
    let video = world.video.as_ref().ok_or_else(|| {
        world_error(
            "the world has no [video]; add one with an orbit or \
        keyframes",
        )
    })?;
    let name = rig.inner.name();
    let index = world.rigs.iter().position(|known| known.name() == name);
    wrap(video.rig_at(&rig.inner, index, time))
}
