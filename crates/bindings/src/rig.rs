//! Rigs.

use pyo3::prelude::*;
use raycam_scene::camera::{self, Pose};
use raycam_scene::schema::{RigSpec, from_value};
use raycam_scene::world::NamedCamera;

use crate::arrays::{matrix3, rows_of, vector};
use crate::camera::{Camera, up};
use crate::error::{IntoPyErr, camera_error, world_error};
use crate::node::node;
use crate::world::World;

/// Cameras on one body.
#[pyclass(frozen, module = "raycam._core")]
pub(crate) struct Rig {
    /// What it wraps.
    pub(crate) inner: camera::Rig,
}

/// Cameras by name.
type Named = Vec<(String, Camera)>;

#[pymethods]
impl Rig {
    /// Of cameras in the axes of the body: body_from_world and where the body is.
    #[new]
    fn new(
        name: &str,
        r: [[f64; 3]; 3],
        c: [f64; 3],
        cameras: Vec<(String, PyRef<'_, Camera>)>,
    ) -> PyResult<Self> {
        let mounts = cameras.into_iter().map(|(name, camera)| NamedCamera {
            name,
            camera: camera.inner.clone(),
        });
        made(camera::Rig::new(name, pose(r, c), mounts.collect()))
    }

    /// The rig of a description as in a world file.
    #[staticmethod]
    fn from_dict(description: &Bound<'_, PyAny>, up: &str) -> PyResult<Self> {
        let spec: RigSpec = from_value(&node(description, "")?).map_err(IntoPyErr::into_py_err)?;
        made(spec.build(self::up(up)?))
    }

    /// Its description, to the last digit, as JSON.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&RigSpec::from_rig(&self.inner))
            .map_err(|error| camera_error(error.to_string()))
    }

    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    #[getter]
    fn r(&self) -> [[f64; 3]; 3] {
        rows_of(self.inner.body().r)
    }

    #[getter]
    fn c(&self) -> [f64; 3] {
        self.inner.body().c.to_array()
    }

    /// The cameras in the world.
    fn cameras(&self) -> PyResult<Named> {
        let cameras = self.inner.cameras().map_err(IntoPyErr::into_py_err)?;
        Ok(named(cameras))
    }

    /// The cameras in the axes of the body.
    fn mounts(&self) -> Named {
        named(self.inner.mounts().to_vec())
    }

    /// The same rig elsewhere.
    fn at_pose(&self, r: [[f64; 3]; 3], c: [f64; 3]) -> PyResult<Self> {
        made(self.inner.at_pose(pose(r, c)))
    }
}

/// Adds a rig and its cameras to a world.
#[pyfunction]
pub(crate) fn world_add_rig(world: &World, rig: &Rig) -> PyResult<()> {
    world.change(|world| {
        let added = world.add_rig(rig.inner.clone());
        added.map(drop).map_err(IntoPyErr::into_py_err)
    })
}

/// The rigs of a world.
#[pyfunction]
pub(crate) fn world_rigs(world: &World) -> Vec<Rig> {
    let world = world.snapshot();
    let rigs = world.rigs.iter().cloned();
    rigs.map(|inner| Rig { inner }).collect()
}

/// A rig as the video of a world moves it: the world's of that name, where `named`.
#[pyfunction]
pub(crate) fn world_rig_at(world: &World, rig: &Rig, time: f64) -> PyResult<Rig> {
    let world = world.snapshot();
    let video = world
        .video
        .as_ref()
        .ok_or_else(|| world_error("the world has no [video]".into()))?;
    let name = rig.inner.name();
    let index = world.rigs.iter().position(|known| known.name() == name);
    made(video.rig_at(&rig.inner, index, time))
}

fn pose(r: [[f64; 3]; 3], c: [f64; 3]) -> Pose {
    Pose {
        r: matrix3(r),
        c: vector(c),
    }
}

fn made(rig: Result<camera::Rig, raycam_scene::SceneError>) -> PyResult<Rig> {
    rig.map(|inner| Rig { inner })
        .map_err(IntoPyErr::into_py_err)
}

fn named(cameras: Vec<NamedCamera>) -> Named {
    let pair = |NamedCamera { name, camera }| (name, Camera { inner: camera });
    cameras.into_iter().map(pair).collect()
}
