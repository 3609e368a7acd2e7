//! One camera of a file, with its numbers as the file has them.

use glam::{DMat3, DVec3};
use raycam_scene::camera::Center;
use raycam_scene::{Camera, Lens, PixelCenter};

use crate::Pose;
use crate::rig_mount::RigMount;
use raycam_formats::{FormatError, Result};

/// A camera as a file has it, before it becomes a [`Camera`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraRecord {
    /// The name, unique in a file.
    pub name: String,
    /// Columns and rows.
    pub size: Option<[u32; 2]>,
    /// Intrinsics in pixels.
    pub k: Option<DMat3>,
    /// The lens.
    pub lens: Lens,
    /// Convention of pixel centres.
    pub pixel_center: PixelCenter,
    /// The pose; without one, the camera is at the origin of the world and looks along z.
    pub pose: Option<Pose>,
    /// The camera matrix, where the file has that instead of K and a pose.
    pub matrix: Option<[[f64; 4]; 3]>,
    /// Seconds.
    pub time: Option<f64>,
    /// The image it took, as the file names it.
    pub image: Option<String>,
    /// Millimetres per unit of a depth image (BOP).
    pub depth_scale: Option<f64>,
    /// The mount on a rig.
    pub mount: Option<RigMount>,
    /// Properties of the camera that no calibration file holds.
    pub unsupported: Vec<&'static str>,
}

impl CameraRecord {
    /// A pinhole of no size, at the origin.
    pub fn new(name: impl Into<String>, pixel_center: PixelCenter) -> Self {
        Self { name: name.into(), pixel_center, ..Self::default() }
    }

    /// The record of a camera. A camera with parallel rays has neither K nor a place: its record has the matrix alone.
    pub fn from_camera(name: impl Into<String>, camera: &Camera) -> Self {
        let mut record = Self::new(name, camera.pixel_center());
        record.size = Some(camera.size());
        record.unsupported = camera.further_properties().collect();
        if camera.center() == Center::Plane {
            record.unsupported.push("plane from which its rays come, and so depth");
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

    /// The camera.
    ///
    /// # Errors
    /// [`FormatError::Encode`] where size or intrinsics are missing, and [`FormatError::Scene`] for a camera that cannot
    /// be.
    pub fn camera(&self) -> Result<Camera> {
        let size = self.require_size("a camera")?;
        if let (Some(matrix), None) = (self.matrix, &self.pose) {
            return Ok(Camera::from_matrix(matrix, size, self.pixel_center)?);
        }
        let (r, c) = self.r_c();
        let camera = Camera::new(self.require_k("a camera")?, r, c, size, self.pixel_center)?;
        Ok(camera.with_lens(self.lens.clone())?)
    }

    /// camera_from_world and the centre.
    pub(crate) fn r_c(&self) -> (DMat3, DVec3) {
        self.pose.as_ref().map_or((DMat3::IDENTITY, DVec3::ZERO), Pose::r_c)
    }

    /// Its pose, from the matrix where it has only that.
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
            FormatError::encode(format!(
                "camera {:?}: its file does not say how large its picture is, which {what} needs: give it (--size \
                 WIDTHxHEIGHT, size=(width, height)), or where there are poses alone a calibration (--intrinsics FILE, \
                 intrinsics=, a camera)",
                self.name
            ))
        })
    }

    /// K, from the matrix where it has only that.
    pub(crate) fn require_k(&self, what: &str) -> Result<DMat3> {
        match (self.k, self.matrix) {
            (Some(k), _) => Ok(k),
            (None, Some(matrix)) => Ok(self.with_a_center(matrix)?.k()),
            (None, None) => Err(FormatError::encode(format!(
                "camera {:?}: its file has a pose and no intrinsics, which {what} needs: give intrinsics=, a camera \
                 (--intrinsics FILE)",
                self.name
            ))),
        }
    }

    /// The camera of a matrix, whose rays come from a point.
    fn with_a_center(&self, matrix: [[f64; 4]; 3]) -> Result<Camera> {
        let camera = Camera::from_matrix(matrix, [1, 1], self.pixel_center)?;
        match camera.center() {
            Center::Point => Ok(camera),
            _ => Err(self.unsupported_error(
                "this format",
                "parallel rays (it has K and a pose, no matrix): write KITTI, or to_dict()",
            )),
        }
    }

    /// K with the pixel centres that a format has.
    pub(crate) fn k_with(&self, center: PixelCenter, format: &str) -> Result<DMat3> {
        let mut k = self.require_k(format)?;
        let shift = center.offset() - self.pixel_center.offset();
        if shift != 0.0 {
            k.z_axis.x += shift;
            k.z_axis.y += shift;
        }
        Ok(k)
    }

    /// fx, fy, cx, cy of a format that has no skew.
    pub(crate) fn focals_with(&self, center: PixelCenter, format: &str) -> Result<[f64; 4]> {
        let k = self.k_with(center, format)?;
        if k.y_axis.x != 0.0 {
            return Err(self.unsupported_error(format, &format!("skew (K[0, 1] = {})", k.y_axis.x)));
        }
        Ok([k.x_axis.x, k.y_axis.y, k.z_axis.x, k.z_axis.y])
    }

    /// The error of a property that a format does not hold.
    pub(crate) fn unsupported_error(&self, format: &str, what: &str) -> FormatError {
        FormatError::encode(format!("camera {:?}: {format} cannot hold {what}", self.name))
    }

    /// Refuses a record with a lens.
    pub(crate) fn require_pinhole(&self, format: &str) -> Result<()> {
        match self.lens.coefficients() {
            None => Ok(()),
            Some((model, coefficients)) => {
                Err(self.unsupported_error(format, &format!("a lens ({}, distortion {coefficients:?})", model.name())))
            }
        }
    }

    /// Replaces matrices of the pose and of the mount that are nearly rotations by the nearest ones; returns the largest
    /// difference of an entry.
    pub(crate) fn orthonormalize(&mut self) -> Option<f64> {
        let mount = self.mount.iter_mut().flat_map(|mount| [&mut mount.camera, &mut mount.body]);
        self.pose.iter_mut().chain(mount).filter_map(Pose::orthonormalize).reduce(f64::max)
    }
}
