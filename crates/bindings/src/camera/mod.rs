//! Cameras.

pub(crate) mod calibration;
pub(crate) mod rig;
pub(crate) mod sensor;

use glam::{DMat4, DVec2};
use pyo3::prelude::*;
use raycam_scene::camera::{Background, BackgroundFit};
use raycam_scene::schema::{CameraSpec, from_value};
use raycam_scene::{Lens, LensModel, PixelCenter, SceneError, Up, camera};

use crate::arrays::{ArrayResult, Floats, NewArray, array, matrix3, rows, rows_of, vector};
use crate::error::{OrRaise, camera_error};
use crate::py_value::to_value;

/// Parses "z" or "y".
pub(crate) fn up(name: &str) -> PyResult<Up> {
    match name {
        "z" => Ok(Up::Z),
        "y" => Ok(Up::Y),
        _ => Err(camera_error(format!("up is {name:?}; expected \"z\" or \"y\""))),
    }
}

/// Parses "integer" or "half".
pub(crate) fn pixel_center(name: &str) -> PyResult<PixelCenter> {
    match name {
        "integer" => Ok(PixelCenter::Integer),
        "half" => Ok(PixelCenter::Half),
        _ => Err(camera_error(format!(
            "pixel_center is {name:?}; expected \"integer\" (OpenCV: the centre of the first pixel is (0, 0)) or \
             \"half\" (COLMAP, OpenGL: (0.5, 0.5))"
        ))),
    }
}

/// Converts a Rust camera to a Python camera; an error becomes an exception.
fn wrap(camera: Result<camera::Camera, SceneError>) -> PyResult<Camera> {
    camera.map(|inner| Camera { inner }).or_raise()
}

type Matrix3 = [[f64; 3]; 3];
type Vector = [f64; 3];

/// Camera for Python.
#[pyclass(frozen, module = "raycam._core")]
pub(crate) struct Camera {
    /// The Rust camera that this class wraps.
    pub(crate) inner: camera::Camera,
}

#[pymethods]
impl Camera {
    #[new]
    fn new(k: Matrix3, r: Matrix3, c: Vector, size: [u32; 2], pixel_center: &str) -> PyResult<Self> {
        let center = self::pixel_center(pixel_center)?;
        wrap(camera::Camera::new(matrix3(k), matrix3(r), vector(c), size, center))
    }

    #[staticmethod]
    fn from_matrix(p: [[f64; 4]; 3], size: [u32; 2], pixel_center: &str) -> PyResult<Self> {
        wrap(camera::Camera::from_matrix(p, size, self::pixel_center(pixel_center)?))
    }

    #[staticmethod]
    fn from_pose(
        location: Vector,
        roll_pitch_yaw: Vector,
        up: &str,
        k: Matrix3,
        size: [u32; 2],
        pixel_center: &str,
    ) -> PyResult<Self> {
        let [roll, pitch, yaw] = roll_pitch_yaw;
        let (up, center) = (self::up(up)?, self::pixel_center(pixel_center)?);
        wrap(camera::Camera::from_pose(vector(location), roll, pitch, yaw, up, matrix3(k), size, center))
    }

    #[staticmethod]
    fn look_at(
        eye: Vector,
        target: Vector,
        up: Vector,
        k: Matrix3,
        size: [u32; 2],
        pixel_center: &str,
    ) -> PyResult<Self> {
        let center = self::pixel_center(pixel_center)?;
        wrap(camera::Camera::look_at(vector(eye), vector(target), vector(up), matrix3(k), size, center))
    }

    #[staticmethod]
    fn from_opencv(k: Matrix3, rvec: Vector, t: Vector, size: [u32; 2], pixel_center: &str) -> PyResult<Self> {
        let center = self::pixel_center(pixel_center)?;
        wrap(camera::Camera::from_opencv(matrix3(k), vector(rvec), vector(t), size, center))
    }

    #[staticmethod]
    fn from_opengl(k: Matrix3, world_from_camera: [[f64; 4]; 4], size: [u32; 2], pixel_center: &str) -> PyResult<Self> {
        let center = self::pixel_center(pixel_center)?;
        let pose = DMat4::from_cols_array_2d(&world_from_camera).transpose();
        wrap(camera::Camera::from_opengl(matrix3(k), pose, size, center))
    }

    /// Returns a copy with a lens model, given by its name and distortion coefficients.
    fn with_lens(&self, model: &str, distortion: Vec<f64>) -> PyResult<Self> {
        let model = LensModel::from_name(model).or_raise()?;
        let lens = Lens::new(model, &distortion).or_raise()?;
        wrap(self.inner.clone().with_lens(lens))
    }

    /// Returns a camera with one of COLMAP's camera models, at a pose.
    #[staticmethod]
    fn from_colmap(
        model: &str,
        params: Vec<f64>,
        r: Matrix3,
        t: Vector,
        size: [u32; 2],
        pixel_center: &str,
    ) -> PyResult<Self> {
        let center = self::pixel_center(pixel_center)?;
        let (mut k, lens) = camera::lens_from_colmap(model, &params).or_raise()?;
        k.z_axis += DVec2::splat(center.offset() - 0.5).extend(0.0);
        let (r, t) = (matrix3(r), vector(t));
        let pinhole = camera::Camera::new(k, r, -(r.transpose() * t), size, center);
        wrap(pinhole.and_then(|camera| camera.with_lens(lens)))
    }

    /// Returns the name and the parameters of the equivalent COLMAP model.
    fn colmap(&self) -> PyResult<(&'static str, Vec<f64>)> {
        let mut k = self.inner.k();
        k.z_axis += DVec2::splat(0.5 - self.inner.pixel_center().offset()).extend(0.0);
        camera::colmap_from_lens(k, self.inner.lens()).or_raise()
    }

    /// Returns the model and the coefficients of the lens; None for a pinhole.
    #[getter]
    fn lens(&self) -> Option<(&'static str, Vec<f64>)> {
        let (model, coefficients) = self.inner.lens().coefficients()?;
        Some((model.name(), coefficients.to_vec()))
    }

    #[getter]
    fn k(&self) -> Matrix3 {
        rows_of(self.inner.k())
    }

    #[getter]
    fn r(&self) -> Matrix3 {
        rows_of(self.inner.r())
    }

    #[getter]
    fn c(&self) -> Vector {
        self.inner.c().to_array()
    }

    #[getter]
    fn t(&self) -> Vector {
        self.inner.t().to_array()
    }

    #[getter]
    fn p(&self) -> [[f64; 4]; 3] {
        self.inner.p()
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        self.inner.size().into()
    }

    #[getter]
    fn pixel_center(&self) -> &'static str {
        match self.inner.pixel_center() {
            PixelCenter::Integer => "integer",
            PixelCenter::Half => "half",
        }
    }

    fn roll_pitch_yaw(&self, up: &str) -> PyResult<Vector> {
        Ok(self.inner.roll_pitch_yaw(self::up(up)?))
    }

    /// Returns the pixels \[n, 2] and in_front \[n] of points \[n, 3].
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: Floats<'py>,
    ) -> PyResult<(NewArray<'py, f64>, NewArray<'py, bool>)> {
        let points = rows::<f64, 3>(&points, "points")?;
        let (pixels, in_front): (Vec<_>, Vec<_>) = py.detach(|| {
            let project = |p: &[f64; 3]| self.inner.project(vector(*p));
            points.iter().map(project).map(|(pixel, front)| (pixel.to_array(), front)).unzip()
        });
        let n = points.len();
        Ok((array(py, pixels.into_flattened(), &[n, 2])?, array(py, in_front, &[n])?))
    }

    /// Returns the origins and unit directions [n, 3] of pixels [n, 2]; NaN for pixels without a ray.
    fn rays<'py>(&self, py: Python<'py>, pixels: Floats<'py>) -> PyResult<(NewArray<'py, f64>, NewArray<'py, f64>)> {
        let pixels = rows::<f64, 2>(&pixels, "pixels")?;
        let (origins, directions): (Vec<_>, Vec<_>) = py.detach(|| {
            pixels
                .iter()
                .map(|p| self.inner.ray(DVec2::from_array(*p)))
                .map(|(origin, direction)| (origin.to_array(), direction.to_array()))
                .unzip()
        });
        let shape = [pixels.len(), 3];
        Ok((array(py, origins.into_flattened(), &shape)?, array(py, directions.into_flattened(), &shape)?))
    }

    /// Builds the camera that a dict describes, with the keys of a camera in a world file.
    #[staticmethod]
    fn from_dict(description: &Bound<'_, PyAny>, up: &str) -> PyResult<Self> {
        let spec: CameraSpec = from_value(&to_value(description, "")?).or_raise()?;
        wrap(spec.build(self::up(up)?))
    }

    /// Returns the camera's exact description as JSON.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&CameraSpec::from_camera(&self.inner)).map_err(|error| camera_error(error.to_string()))
    }

    /// Returns a copy with another pose.
    fn at_pose(&self, r: Matrix3, c: Vector) -> PyResult<Self> {
        wrap(self.inner.at_pose(matrix3(r), vector(c)))
    }

    /// Returns the background image: file, fit and the camera that took it.
    #[getter]
    fn background(&self) -> Option<(&str, &'static str, Option<Self>)> {
        let background = self.inner.background()?;
        let fit = match background.fit {
            BackgroundFit::Exact => "exact",
            BackgroundFit::Cover => "cover",
        };
        let taker = background.camera.as_deref().map(|camera| Self { inner: camera.clone() });
        Some((&background.image, fit, taker))
    }

    /// Returns a copy with a background image, or without one if `image` is None. If `covers`, the image fills the
    /// frame; otherwise `camera` took it.
    fn with_background(&self, image: Option<String>, covers: bool, camera: Option<&Self>) -> Self {
        let fit = if covers { BackgroundFit::Cover } else { BackgroundFit::Exact };
        let camera = camera.map(|camera| camera.inner.clone().with_background(None).into());
        let background = image.map(|image| Background { image, fit, camera });
        Self { inner: self.inner.clone().with_background(background) }
    }

    /// Returns a copy with new intrinsics.
    fn with_intrinsics(&self, k: Matrix3, size: [u32; 2]) -> PyResult<Self> {
        wrap(self.inner.with_intrinsics(matrix3(k), size))
    }

    /// Returns the origin of the camera's rays: "point", "plane" or "infinity".
    #[getter]
    fn center(&self) -> &'static str {
        match self.inner.center() {
            camera::Center::Point => "point",
            camera::Center::Plane => "plane",
            camera::Center::Infinity => "infinity",
        }
    }

    /// Returns camera_from_world [n, 3, 3] for pixels [n, 2], each in the middle of the pixel's exposure.
    fn rotations<'py>(&self, py: Python<'py>, pixels: Floats<'py>) -> ArrayResult<'py, f64> {
        let pixels = rows::<f64, 2>(&pixels, "pixels")?;
        let rotations: Vec<_> =
            pixels.iter().flat_map(|p| rows_of(self.inner.rotation_at(DVec2::from_array(*p)))).collect();
        array(py, rotations.into_flattened(), &[pixels.len(), 3, 3])
    }
}

/// Returns the name of each lens model, and true if the model is a panorama.
#[pyfunction]
pub(crate) fn lens_models() -> Vec<(&'static str, bool)> {
    LensModel::ALL.iter().map(|model| (model.name(), model.is_panorama())).collect()
}

/// Returns the names of each lens model's coefficients.
#[pyfunction]
pub(crate) fn lens_coefficients() -> Vec<(&'static str, Vec<&'static str>)> {
    LensModel::ALL.iter().map(|model| (model.name(), model.coefficient_names().to_vec())).collect()
}

/// Returns K for a vertical field of view in degrees.
#[pyfunction]
pub(crate) fn intrinsics_from_fov(fov: f64, size: [u32; 2], pixel_center: &str) -> PyResult<Matrix3> {
    camera::intrinsics_from_fov(fov, size, self::pixel_center(pixel_center)?).map(rows_of).or_raise()
}

/// Returns K for a focal length in pixels.
#[pyfunction]
pub(crate) fn intrinsics_from_focal(focal: f64, size: [u32; 2], pixel_center: &str) -> PyResult<Matrix3> {
    Ok(rows_of(camera::intrinsics_from_focal(focal, size, self::pixel_center(pixel_center)?)))
}
