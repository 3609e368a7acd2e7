//! Calibration files.

use std::path::PathBuf;

use pyo3::prelude::*;
use raycam_calibration::{CameraRecord, Pose, PoseHints, ReadHints, RigMount};
use raycam_formats::{Budget, FormatError};
use raycam_scene::LensModel;

use crate::arrays::rows_of;
use crate::camera::Camera;
use crate::camera::rig::Rig;
use crate::error::{IntoPyErr, OrRaise, camera_error, catch_panic, detached};
use crate::notice::Notices;

/// A rotation, such as camera_from_world, and a centre.
type RotationCenter = ([[f64; 3]; 3], [f64; 3]);

/// Camera with the exact values of its file, so that it is written back bit for bit.
#[pyclass(frozen, module = "raycam._core", name = "Record")]
pub(crate) struct PyCameraRecord {
    inner: CameraRecord,
}

#[pymethods]
impl PyCameraRecord {
    /// Record of a camera. If the camera is on a rig, the record also contains the rig's frame and the camera's name on
    /// the rig.
    #[staticmethod]
    #[pyo3(name = "of", signature = (name, camera, image, time, on=None))]
    fn from_camera(
        name: &str,
        camera: &Camera,
        image: Option<String>,
        time: Option<f64>,
        on: Option<(PyRef<'_, Rig>, String, String)>,
    ) -> PyResult<Self> {
        let mut inner = CameraRecord::from_camera(name, &camera.inner);
        (inner.image, inner.time) = (image, time);
        if let Some((rig, frame, name)) = on {
            let rig = &rig.inner;
            let mount = rig.mounts().iter().find(|mount| mount.name == name);
            let mount = mount.ok_or_else(|| camera_error(format!("the rig has no camera named {name:?}")))?;
            let body = rig.body();
            inner.mount = Some(RigMount {
                rig: rig.name().into(),
                frame,
                name,
                camera: Pose::from_r_c(mount.camera.r(), mount.camera.c()),
                body: Pose::from_r_c(body.r, body.c),
            });
        }
        Ok(Self { inner })
    }

    /// Returns a copy of the record with this image and time.
    fn replaced(&self, image: Option<String>, time: Option<f64>) -> Self {
        Self { inner: CameraRecord { image, time, ..self.inner.clone() } }
    }

    /// Returns the mount of a camera on a rig: the names of the rig, the frame and the camera on the rig;
    /// camera_from_body and the camera's centre in the body's axes; body_from_world and the body's position.
    #[getter]
    #[allow(clippy::type_complexity, reason = "the tuple contains the parts of a mount")]
    fn mount(&self) -> Option<(&str, &str, &str, RotationCenter, RotationCenter)> {
        let mount = self.inner.mount.as_ref()?;
        let placed = |pose: &Pose| {
            let (r, c) = pose.r_c();
            (rows_of(r), c.to_array())
        };
        Some((&mount.rig, &mount.frame, &mount.name, placed(&mount.camera), placed(&mount.body)))
    }

    /// Returns the camera; an error if the record does not contain the size and the intrinsics.
    fn camera(&self) -> PyResult<Camera> {
        let inner = self.inner.camera().map_err(|error| match error {
            FormatError::Encode(message) => camera_error(message),
            error => error.into_py_err(),
        })?;
        Ok(Camera { inner })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    #[getter]
    fn image(&self) -> Option<&str> {
        self.inner.image.as_deref()
    }

    #[getter]
    fn time(&self) -> Option<f64> {
        self.inner.time
    }
}

/// Reads a calibration file; returns its camera records, and notices. `poses` contains the direction of poses (true for
/// world_from_camera) and their axes (true for OpenGL's), each `None` if the caller does not specify it.
#[pyfunction]
#[pyo3(signature = (path, format, size, intrinsics, lens=None, poses=(None, None)))]
pub(crate) fn read_cameras(
    py: Python<'_>,
    path: PathBuf,
    format: Option<String>,
    size: Option<[u32; 2]>,
    intrinsics: Option<&Camera>,
    lens: Option<&str>,
    poses: (Option<bool>, Option<bool>),
) -> PyResult<(Vec<PyCameraRecord>, Notices)> {
    let known = ReadHints {
        size,
        intrinsics: intrinsics.map(|camera| CameraRecord::from_camera("", &camera.inner)),
        lens: lens.map(LensModel::from_name).transpose().map_err(|error| camera_error(error.to_string()))?,
        poses: PoseHints { world_from_camera: poses.0, opengl: poses.1 },
    };
    let found = detached(py, || raycam_calibration::read(&path, format.as_deref(), &known, &Budget::default()))?;
    let records = found.records.into_iter().map(|inner| PyCameraRecord { inner });
    Ok((records.collect(), found.notices.into()))
}

/// Returns the names (relative to `path`) and bytes of the files that store the records, and notices.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "two lists")]
pub(crate) fn write_cameras(
    records: Vec<PyRef<'_, PyCameraRecord>>,
    path: PathBuf,
    format: &str,
) -> PyResult<(Vec<(String, Vec<u8>)>, Notices)> {
    let records: Vec<_> = records.iter().map(|record| record.inner.clone()).collect();
    let written = catch_panic(|| raycam_calibration::write(&records, &path, format))?.or_raise()?;
    Ok((written.files, written.notices.into()))
}

/// Returns the names of the readable formats and the names of the writable formats.
#[pyfunction]
pub(crate) fn calibration_formats() -> (Vec<&'static str>, Vec<&'static str>) {
    (raycam_calibration::formats().collect(), raycam_calibration::written_formats().collect())
}

/// Extensions of calibration files, without the point.
#[pyfunction]
pub(crate) fn calibration_endings() -> Vec<&'static str> {
    raycam_calibration::file_endings().collect()
}
