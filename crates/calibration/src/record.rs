//! One camera of a file, with its numbers as in the file.

use glam::{DMat3, DVec3};
use raycam_scene::camera::Center;
use raycam_scene::{Camera, ErrorCode, Lens, PixelCenter};

use crate::Pose;
use crate::rig_mount::RigMount;
use raycam_formats::{FormatError, Result};

/// A camera as stored in a file, before it becomes a [`Camera`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraRecord {
    /// Name, unique in a file.
    pub name: String,
    /// Image size in pixels: columns, rows.
    pub size: Option<[u32; 2]>,
    /// Intrinsics K in pixels; `pixel_center` is their convention of pixel centres.
    pub k: Option<DMat3>,
    /// Lens model with its coefficients.
    pub lens: Lens,
    /// Convention of pixel centres.
    pub pixel_center: PixelCenter,
    /// Pose of the camera; without a pose, the camera is at the world's origin and looks along z.
    pub pose: Option<Pose>,
    /// Camera matrix, if the file contains it instead of K and a pose.
    pub matrix: Option<[[f64; 4]; 3]>,
    /// Time of the image in seconds.
    pub time: Option<f64>,
    /// Name of the camera's image in the file.
    pub image: Option<String>,
    /// Number of millimetres per unit of the camera's depth image (BOP).
    pub depth_scale: Option<f64>,
    /// Mount of the camera on a rig.
    pub mount: Option<RigMount>,
    /// Properties of the camera that no calibration file can store.
    pub unsupported: Vec<&'static str>,
}

impl CameraRecord {
    /// Creates the record of a pinhole camera at the origin, without a size and without K.
    pub fn new(name: impl Into<String>, pixel_center: PixelCenter) -> Self {
        Self { name: name.into(), pixel_center, ..Self::default() }
    }

    /// Creates the record of a camera. A camera with parallel rays has neither K nor a position: its record contains
    /// only the matrix.
    pub fn from_camera(name: impl Into<String>, camera: &Camera) -> Self {
        let mut record = Self::new(name, camera.pixel_center());
        record.size = Some(camera.size());
        record.unsupported = camera.further_properties().collect();
        if camera.center() == Center::Plane {
            record.unsupported.push("plane where the rays start (from which depth is measured)");
        }
        if camera.center() != Center::Point {
            record.matrix = Some(camera.p());
            return record;
        }
        record.k = Some(camera.k());
        record.lens = camera.lens().clone();
        record.pose = Some(Pose::from_r_c(camera.r(), camera.c()));
        record.matrix = matches!(camera.lens(), Lens::Pinhole).then(|| camera.p());
        record
    }

    /// Returns the camera.
    ///
    /// # Errors
    /// [`FormatError::Encode`] if size or intrinsics are missing, and [`FormatError::Scene`] for an invalid camera.
    pub fn camera(&self) -> Result<Camera> {
        let size = self.require_size("a camera")?;
        if let (Some(matrix), None) = (self.matrix, &self.pose) {
            return Ok(Camera::from_matrix(matrix, size, self.pixel_center)?);
        }
        let (r, c) = self.r_c();
        let camera = Camera::new(self.require_k("a camera")?, r, c, size, self.pixel_center)?;
        Ok(camera.with_lens(self.lens.clone())?)
    }

    /// Returns the rotation R (camera_from_world) and the camera centre C in world coordinates.
    pub(crate) fn r_c(&self) -> (DMat3, DVec3) {
        self.pose.as_ref().map_or((DMat3::IDENTITY, DVec3::ZERO), Pose::r_c)
    }

    /// Returns the camera's pose; if the record contains only a matrix, the pose is computed from it.
    pub(crate) fn require_pose(&self) -> Result<Pose> {
        match (&self.pose, self.matrix) {
            (Some(pose), _) => Ok(pose.clone()),
            (None, Some(matrix)) => {
                let camera = self.with_a_center(matrix)?;
                Ok(Pose::from_r_c(camera.r(), camera.c()))
            }
            (None, None) => Ok(Pose::from_r_c(DMat3::IDENTITY, DVec3::ZERO)),
        }
    }

    pub(crate) fn require_size(&self, what: &str) -> Result<[u32; 2]> {
        self.size.ok_or_else(|| {
            FormatError::encode(ErrorCode::MissingArgument.message(format!(
                "camera {:?}: its file does not contain the image size, which {what} requires; set it with --size \
                 WIDTHxHEIGHT or size=(width, height). For a file with only poses, pass a calibration instead \
                 (--intrinsics FILE, intrinsics=)",
                self.name
            )))
        })
    }

    /// Returns K; if the record contains only a matrix, K is computed from it.
    pub(crate) fn require_k(&self, what: &str) -> Result<DMat3> {
        match (self.k, self.matrix) {
            (Some(k), _) => Ok(k),
            (None, Some(matrix)) => Ok(self.with_a_center(matrix)?.k()),
            (None, None) => Err(FormatError::encode(ErrorCode::MissingArgument.message(format!(
                "camera {:?}: its file has a pose but no intrinsics, which {what} requires; pass a camera as \
                 intrinsics= (--intrinsics FILE)",
                self.name
            )))),
        }
    }

    /// Returns the camera of a matrix; an error if its rays do not start at one point.
    fn with_a_center(&self, matrix: [[f64; 4]; 3]) -> Result<Camera> {
        let camera = Camera::from_matrix(matrix, [1, 1], self.pixel_center)?;
        match camera.center() {
            Center::Point => Ok(camera),
            _ => Err(self.unsupported_error(
                "this format",
                "parallel rays, because it stores K and a pose instead of a matrix; use the format kitti, or \
                 Camera.to_dict()",
            )),
        }
    }

    /// Returns K, converted to the pixel-centre convention of a format.
    pub(crate) fn k_with(&self, center: PixelCenter, format: &str) -> Result<DMat3> {
        let mut k = self.require_k(format)?;
        let shift = center.offset() - self.pixel_center.offset();
        if shift != 0.0 {
            k.z_axis.x += shift;
            k.z_axis.y += shift;
        }
        Ok(k)
    }

    /// Returns fx, fy, cx and cy for a format without skew; an error if the skew is not 0.
    pub(crate) fn focals_with(&self, center: PixelCenter, format: &str) -> Result<[f64; 4]> {
        let k = self.k_with(center, format)?;
        if k.y_axis.x != 0.0 {
            return Err(self.unsupported_error(format, &format!("skew (K[0, 1] = {})", k.y_axis.x)));
        }
        Ok([k.x_axis.x, k.y_axis.y, k.z_axis.x, k.z_axis.y])
    }

    /// Returns the error for a property that a format cannot store.
    pub(crate) fn unsupported_error(&self, format: &str, what: &str) -> FormatError {
        FormatError::encode(format!("camera {:?}: {format} cannot store {what}", self.name))
    }

    /// Returns an error if the record has a lens model with coefficients.
    pub(crate) fn require_pinhole(&self, format: &str) -> Result<()> {
        match self.lens.coefficients() {
            None => Ok(()),
            Some((model, coefficients)) => Err(self
                .unsupported_error(format, &format!("lens model {} with distortion {coefficients:?}", model.name()))),
        }
    }

    /// Replaces matrices of the pose and of the mount that are nearly rotations by the nearest rotations; returns the
    /// largest difference between their entries; `None` if nothing was replaced.
    pub(crate) fn orthonormalize(&mut self) -> Option<f64> {
        let mount = self.mount.iter_mut().flat_map(|mount| [&mut mount.camera, &mut mount.body]);
        self.pose.iter_mut().chain(mount).filter_map(Pose::orthonormalize).reduce(f64::max)
    }
}
