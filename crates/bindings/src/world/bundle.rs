//! Worlds as bytes: for other processes, and as glTF for other programs.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use raycam_formats::{Budget, bundle};

use crate::arrays::{self, BytesResult};
use crate::camera::Camera;
use crate::error::detached;
use crate::notice::Notices;
use crate::world::state::{World, budget};

/// Returns a copy of the world with additional cameras after its own cameras; both worlds share everything that has
/// been built.
#[pyfunction]
pub(crate) fn world_with_cameras(world: &World, cameras: Vec<(String, PyRef<'_, Camera>)>) -> PyResult<World> {
    let copy = World { state: Mutex::new(world.state().clone()), folder: world.folder.clone() };
    copy.modify_unseen(|inner| {
        for (name, camera) in cameras {
            inner.add_camera(&name, camera.inner.clone());
        }
        Ok(())
    })?;
    Ok(copy)
}

/// Returns the world as bytes.
#[pyfunction]
pub(crate) fn world_to_bytes<'py>(py: Python<'py>, world: &World) -> BytesResult<'py> {
    let inner = world.snapshot();
    arrays::bytes(py, &detached(py, || bundle::write(&inner))?)
}

/// Reads a world from the bytes of [`world_to_bytes`]; relative names of files that are added later refer to `folder`.
#[pyfunction]
pub(crate) fn world_from_bytes(
    py: Python<'_>,
    bytes: &[u8],
    texture_memory: Option<u64>,
    folder: PathBuf,
) -> PyResult<World> {
    let budget = budget(texture_memory);
    let read = || bundle::read(bytes, Path::new("the world of the job"), budget);
    Ok(World::from_inner(detached(py, read)?, folder))
}

/// Returns the world as a GLB file, with notices about everything that GLB cannot represent. If the caller writes the
/// video, no notice about the video is added.
#[pyfunction]
#[pyo3(signature = (world, video_is_written=false))]
pub(crate) fn world_to_gltf<'py>(
    py: Python<'py>,
    world: &World,
    video_is_written: bool,
) -> PyResult<(Bound<'py, PyBytes>, Notices)> {
    let mut inner = world.snapshot().as_ref().clone();
    if video_is_written {
        inner.video = None;
    }
    let (bytes, notices) = detached(py, || raycam_formats::write_gltf(&inner))?;
    Ok((arrays::bytes(py, &bytes)?, notices.into()))
}

/// Reads a world from a GLB file's bytes, sets its up axis, and adds the given notices.
#[pyfunction]
pub(crate) fn world_from_gltf(
    py: Python<'_>,
    bytes: Vec<u8>,
    name: PathBuf,
    up: &str,
    notices: Notices,
) -> PyResult<World> {
    let up = crate::camera::up(up)?;
    let mut world = detached(py, || raycam_formats::decode(bytes, &name, &Budget::default()))?;
    world.up = up;
    world.notices.extend(notices.0);
    Ok(World::from_inner(world, PathBuf::new()))
}
