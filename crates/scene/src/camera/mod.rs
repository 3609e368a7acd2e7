//! Cameras: P = K R [I | -C], and those whose centre lies at infinity (Hartley and Zisserman, Multiple View Geometry,
//! chapter 6), with what their lens, aperture and shutter do.

mod aperture;
mod decompose;
mod intrinsics;
mod lens;
mod optics;
pub(crate) mod parallel;
pub(crate) mod projection;
mod rig;
pub(crate) mod shutter;
pub(crate) mod undistort_table;
pub(crate) mod validate;
mod vignetting;

pub use aperture::Aperture;
pub use intrinsics::{intrinsics_from_extent, intrinsics_from_focal, intrinsics_from_fov};
pub use lens::{
    Division, DoubleSphere, Eucm, Fisheye, Fov, Lens, LensModel, Omni, OpenCv, PrismFisheye,
    colmap_from_lens, lens_from_colmap,
};

pub use crate::camera::projection::{CameraRay, Pinhole};
pub use crate::camera::shutter::{Pose, ReadoutDirection, ShutterMotion};
pub use rig::Rig;
pub use vignetting::Vignetting;

use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::intrinsics::validated_intrinsics;
use crate::camera::undistort_table::UndistortTable;
use crate::camera::validate::{camera_matrix, check_size, validated_rotation};
use crate::error::SceneError;
use crate::math::rotation;
use crate::world::Up;

/// Where the centre of the first pixel lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PixelCenter {
    /// At (0, 0), as in OpenCV.
    #[default]
    Integer,
    /// At (0.5, 0.5), as in COLMAP and OpenGL.
    Half,
}

impl PixelCenter {
    /// What is added to a column or row to get the coordinate of its centre: 0 or 0.5.
    pub fn offset(self) -> f64 {
        match self {
            PixelCenter::Integer => 0.0,
            PixelCenter::Half => 0.5,
        }
    }
}

/// Where the rays of a camera come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Center {
    /// All from one point, C.
    Point,
    /// From the plane through C at right angles to the principal axis, in parallel: an orthographic camera.
    Plane,
    /// From infinity, in parallel and without a beginning: a camera of a matrix whose left 3x3 part is singular. Depth
    /// counts from the plane through C, the world's origin, and may be negative.
    Infinity,
}

/// A camera: `x = K R (X - C)`, with what its lens does between R and K. Axes x right, y down, z forward. All float64.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    k: DMat3,
    r: DMat3,
    c: DVec3,
    /// `K R [I | -C]`, or what [`Camera::from_matrix`] was given: an ill-conditioned matrix survives to the last digits.
    p: [[f64; 4]; 3],
    size: [u32; 2],
    pixel_center: PixelCenter,
    center: Center,
    /// The matrix that it was made of.
    matrix: Option<[[f64; 4]; 3]>,
    lens: Lens,
    #[serde(skip)]
    undistort_table: UndistortTable,
    aperture: Option<Aperture>,
    vignetting: Option<Vignetting>,
    /// Its middle is the pose.
    motion: Option<ShutterMotion>,
    /// Where the rays of [`Center::Infinity`] start, as depth.
    #[serde(rename = "start")]
    ray_start_depth: f64,
}

/// The largest width and height.
pub const MAX_SIDE: u32 = 65_536;
/// The most pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 28;

impl Camera {
    /// A camera from intrinsics `k` (upper triangular, focal lengths > 0, `K[2][2]` any but 0), rotation `r`
    /// (camera_from_world) and centre `c` in the world. `size` is columns and rows.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where a value is not finite, `k` is not such a matrix, `r` is further than 1e-6 from a
    /// rotation (nearer ones become the nearest rotation), or the size is 0 or beyond [`MAX_SIDE`] and [`MAX_PIXELS`].
    pub fn new(
        k: DMat3,
        r: DMat3,
        c: DVec3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        check_size(size)?;
        let k = validated_intrinsics(k)?;
        let r = validated_rotation(r)?;
        if !c.is_finite() {
            return Err(SceneError::Camera(format!(
                "the camera centre {c} is not finite"
            )));
        }
        let p = camera_matrix(k, r, c, Center::Point)?;
        Ok(Self::from_parts(
            k,
            r,
            c,
            p,
            size,
            pixel_center,
            Center::Point,
        ))
    }

    /// A camera from any 3x4 camera matrix of rank 3, of any scale and sign, by RQ decomposition (Hartley and Zisserman,
    /// section 6.2.4). The third row of its left 3x3 part, times the sign of that part's determinant, points forward.
    ///
    /// Where that part is singular the camera has its centre at infinity ([`Center::Infinity`], section 6.3): affine if
    /// the last row is 0 0 0 w. Its parallel rays go the way on which the picture is not mirrored.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where a value is not finite or the rank is below 3.
    pub fn from_matrix(
        matrix: [[f64; 4]; 3],
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        check_size(size)?;
        let decompose::DecomposedMatrix { k, r, c, p, center } = decompose::decompose(matrix)?;
        let k = match center {
            Center::Point => validated_intrinsics(k)?,
            _ => k,
        };
        let r = validated_rotation(r)?;
        Ok(Self {
            matrix: Some(matrix),
            ..Self::from_parts(k, r, c, p, size, pixel_center, center)
        })
    }

    /// Without lens, aperture and motion.
    fn from_parts(
        k: DMat3,
        r: DMat3,
        c: DVec3,
        p: [[f64; 4]; 3],
        size: [u32; 2],
        pixel_center: PixelCenter,
        center: Center,
    ) -> Self {
        Self {
            k,
            r,
            c,
            p,
            size,
            pixel_center,
            center,
            matrix: None,
            lens: Lens::Pinhole,
            undistort_table: UndistortTable::default(),
            aperture: None,
            vignetting: None,
            motion: None,
            ray_start_depth: 0.0,
        }
    }

    /// A camera at `location` turned by `roll`, `pitch`, `yaw` in degrees (see [`pose`]).
    ///
    /// # Errors
    /// Those of [`Camera::new`], and angles that are not finite.
    #[allow(
        clippy::too_many_arguments,
        reason = "the six numbers of a pose have names of their own"
    )]
    pub fn from_pose(
        location: DVec3,
        roll: f64,
        pitch: f64,
        yaw: f64,
        up: Up,
        k: DMat3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        if ![roll, pitch, yaw].iter().all(|v| v.is_finite()) {
            return Err(SceneError::Camera(format!(
                "roll {roll}, pitch {pitch}, yaw {yaw}: angles must be finite"
            )));
        }
        let world_from_body =
            rotation::world_from_reference(up) * rotation::rotation_from_rpy(roll, pitch, yaw);
        Self::new(
            k,
            rotation::CAMERA_FROM_BODY * world_from_body.transpose(),
            location,
            size,
            pixel_center,
        )
    }

    /// A camera at `eye` that sees `target` at its principal point, with `up_vector` upwards in the picture.
    ///
    /// # Errors
    /// Those of [`Camera::new`]; `eye` equal to `target`; `up_vector` zero or parallel to the viewing direction.
    pub fn look_at(
        eye: DVec3,
        target: DVec3,
        up_vector: DVec3,
        k: DMat3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        let direction = target - eye;
        let world_from_body = rotation::rotation_towards(direction, up_vector).ok_or_else(|| {
            SceneError::Camera(if direction.try_normalize().is_none() {
                format!("eye {eye} and target {target} must be two different finite points")
            } else {
                format!(
                    "up {up_vector} is zero or parallel to the viewing direction {direction}, so which side of the \
                     picture is up is undetermined: give another up vector, or roll, pitch and yaw"
                )
            })
        })?;
        Self::new(
            k,
            rotation::CAMERA_FROM_BODY * world_from_body.transpose(),
            eye,
            size,
            pixel_center,
        )
    }

    /// A camera from OpenCV's extrinsics: a rotation vector (axis times angle in radians) and `t = -R C`.
    ///
    /// # Errors
    /// Those of [`Camera::new`], and values that are not finite.
    pub fn from_opencv(
        k: DMat3,
        rvec: DVec3,
        t: DVec3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        if !(rvec.is_finite() && t.is_finite()) {
            return Err(SceneError::Camera(format!(
                "rotation vector {rvec} and translation {t} must be finite"
            )));
        }
        let r = DMat3::from_quat(DQuat::from_scaled_axis(rvec));
        Self::new(k, r, -(r.transpose() * t), size, pixel_center)
    }

    /// A camera from OpenGL's, Blender's and NeRF's pose matrix, whose camera axes are x right, y up, z backward.
    ///
    /// # Errors
    /// Those of [`Camera::new`], and a matrix whose last row is not 0 0 0 1.
    pub fn from_opengl(
        k: DMat3,
        world_from_camera: DMat4,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        let last = world_from_camera.row(3);
        if last.to_array() != [0.0, 0.0, 0.0, 1.0] {
            return Err(SceneError::Camera(format!(
                "the last row of world_from_camera is {last}, expected 0 0 0 1: is the matrix transposed?"
            )));
        }
        let world_from_gl = DMat3::from_mat4(world_from_camera);
        let world_from_cv = DMat3::from_cols(
            world_from_gl.x_axis,
            -world_from_gl.y_axis,
            -world_from_gl.z_axis,
        );
        Self::new(
            k,
            world_from_cv.transpose(),
            world_from_camera.w_axis.truncate(),
            size,
            pixel_center,
        )
    }

    /// Intrinsics: upper triangular, `K[2][2] = 1`, in pixels. Of parallel rays, focal lengths are in pixels per unit of
    /// the world; of a matrix with its centre at infinity that is not affine, K is any homography.
    pub fn k(&self) -> DMat3 {
        self.k
    }

    /// camera_from_world.
    pub fn r(&self) -> DMat3 {
        self.r
    }

    /// The centre in the world; of parallel rays, what [`Center`] says.
    pub fn c(&self) -> DVec3 {
        self.c
    }

    /// `-R C`.
    pub fn t(&self) -> DVec3 {
        -(self.r * self.c)
    }

    /// The 3x4 camera matrix `K R [I | -C]`, scaled so that its left 3x3 part has a third row of length 1 that points
    /// forward; of parallel rays, with a last row of 0 0 0 1, or else of length 1.
    pub fn p(&self) -> [[f64; 4]; 3] {
        self.p
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Where the centre of the first pixel lies.
    pub fn pixel_center(&self) -> PixelCenter {
        self.pixel_center
    }

    /// The principal axis in the world, unit length: the third row of R.
    pub fn forward(&self) -> DVec3 {
        self.r.row(2)
    }

    /// Roll, pitch and yaw in degrees (see [`rotation::rpy_from_rotation`] for straight up and down).
    pub fn roll_pitch_yaw(&self, up: Up) -> [f64; 3] {
        let world_from_body = self.r.transpose() * rotation::CAMERA_FROM_BODY;
        rotation::rpy_from_rotation(
            rotation::world_from_reference(up).transpose() * world_from_body,
        )
    }

    /// The pixel coordinates of the centre of a pixel.
    #[inline]
    pub fn pixel_center_of(&self, column: u32, row: u32) -> DVec2 {
        DVec2::new(f64::from(column), f64::from(row)) + self.pixel_center.offset()
    }
}
