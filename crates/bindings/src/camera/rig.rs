//! Rigs.

use pyo3::prelude::*;
use raycam_scene::NoAssets;
use raycam_scene::camera::NamedCamera;
use raycam_scene::camera::{self, Pose};
use raycam_scene::schema::{RigSpec, from_value};

use crate::arrays::{matrix3, rows_of, vector};
use crate::camera::sensor::{SensorData, named_sensor, sensor_data};
use crate::camera::{Camera, up};
use crate::error::{OrRaise, camera_error};
use crate::py_value::to_value;

/// Cameras on one body.
#[pyclass(frozen, module = "raycam._core")]
pub(crate) struct Rig {
    /// The Rust rig that this class wraps.
    pub(crate) inner: camera::Rig,
}

/// Cameras by name.
type NamedCameras = Vec<(String, Camera)>;

#[pymethods]
impl Rig {
    /// Creates a rig from body_from_world, the body's position, and cameras whose poses are in the body's axes.
    #[new]
    fn new(name: &str, r: [[f64; 3]; 3], c: [f64; 3], cameras: Vec<(String, PyRef<'_, Camera>)>) -> PyResult<Self> {
        let mounts = cameras.into_iter().map(|(name, camera)| NamedCamera { name, camera: camera.inner.clone() });
        wrap(camera::Rig::new(name, pose(r, c), mounts.collect()))
    }

    /// Builds the rig that a dict describes, with the keys of a rig in a world file.
    #[staticmethod]
    fn from_dict(description: &Bound<'_, PyAny>, up: &str) -> PyResult<Self> {
        let spec: RigSpec = from_value(&to_value(description, "")?).or_raise()?;
        wrap(spec.build(self::up(up)?, "", &mut NoAssets))
    }

    /// Returns the rig's sensors that are not cameras.
    fn sensors(&self) -> Vec<SensorData> {
        self.inner.sensors().iter().map(sensor_data).collect()
    }

    /// Returns the rig with sensors, each given by name, kind and settings; the settings contain the pose.
    fn with_sensors(&self, sensors: Vec<(String, String, String)>) -> PyResult<Self> {
        wrap(self.inner.clone().with_sensors(sensors.into_iter().map(named_sensor).collect()))
    }

    /// Returns the rig's exact description as JSON.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&RigSpec::from_rig(&self.inner)).map_err(|error| camera_error(error.to_string()))
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

    /// Returns the cameras in the world.
    fn cameras(&self) -> PyResult<NamedCameras> {
        let cameras = self.inner.cameras().or_raise()?;
        Ok(named_cameras(cameras))
    }

    /// Returns the cameras in the axes of the body.
    fn mounts(&self) -> NamedCameras {
        named_cameras(self.inner.mounts().to_vec())
    }

    /// Returns a copy with another pose.
    fn at_pose(&self, r: [[f64; 3]; 3], c: [f64; 3]) -> PyResult<Self> {
        wrap(self.inner.at_pose(pose(r, c)))
    }
}

fn pose(r: [[f64; 3]; 3], c: [f64; 3]) -> Pose {
    Pose { r: matrix3(r), c: vector(c) }
}

pub(crate) fn wrap(rig: Result<camera::Rig, raycam_scene::SceneError>) -> PyResult<Rig> {
    rig.map(|inner| Rig { inner }).or_raise()
}

fn named_cameras(cameras: Vec<NamedCamera>) -> NamedCameras {
    let pair = |NamedCamera { name, camera }| (name, Camera { inner: camera });
    cameras.into_iter().map(pair).collect()
}
