//! Constructors of cameras: from K, R and C, from a whole matrix, and from the conventions of other programs.

use glam::{DMat3, DMat4, DQuat, DVec3};

use crate::camera::Camera;
use crate::camera::center::Center;
use crate::camera::decompose;
use crate::camera::intrinsics::validated_intrinsics;
use crate::camera::lens::Lens;
use crate::camera::pixel_center::PixelCenter;
use crate::camera::undistort_table::UndistortTable;
use crate::camera::validate::{camera_matrix, check_size, validated_rotation};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::math::rotation;
use crate::up::Up;

impl Camera {
    /// Creates a camera from intrinsics `k` (upper triangular, focal lengths > 0, `K[2][2]` not 0), rotation `r`
    /// (camera_from_world) and centre `c` in the world. `size` is the number of columns and rows.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if a value is not finite, if `k` is not such a matrix, if `r` differs by more than 1e-6
    /// from a rotation (otherwise the nearest rotation is used), or if the size is 0 or exceeds `MAX_SIDE` or
    /// `MAX_PIXELS`.
    pub fn new(k: DMat3, r: DMat3, c: DVec3, size: [u32; 2], pixel_center: PixelCenter) -> Result<Self> {
        check_size(size)?;
        let k = validated_intrinsics(k)?;
        let r = validated_rotation(r)?;
        if !c.is_finite() {
            return Err(SceneError::camera(format!("the camera centre {c} is not finite")));
        }
        let p = camera_matrix(k, r, c, Center::Point)?;
        Ok(Self::from_parts(k, r, c, p, size, pixel_center, Center::Point))
    }

    /// Creates a camera from any 3x4 camera matrix of rank 3, of any scale and sign, by RQ decomposition (Hartley and
    /// Zisserman, section 6.2.4). The third row of its left 3x3 part, times the sign of that part's determinant, points
    /// forward.
    ///
    /// If that part is singular, the camera's centre is at infinity ([`Center::Infinity`], section 6.3); the camera is
    /// affine if the last row is 0 0 0 w. Its parallel rays have the direction for which the image is not mirrored.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if a value is not finite or the rank is below 3.
    pub fn from_matrix(matrix: [[f64; 4]; 3], size: [u32; 2], pixel_center: PixelCenter) -> Result<Self> {
        check_size(size)?;
        let decompose::DecomposedMatrix { k, r, c, p, center } = decompose::decompose(matrix)?;
        let k = match center {
            Center::Point => validated_intrinsics(k)?,
            _ => k,
        };
        let r = validated_rotation(r)?;
        Ok(Self { matrix: Some(matrix), ..Self::from_parts(k, r, c, p, size, pixel_center, center) })
    }

    /// Creates an orthographic camera: parallel rays along the third row of `r` (camera_from_world), from the plane
    /// through `c`. `k` is upper triangular with focal lengths > 0 in pixels per world unit, and its principal point is
    /// the pixel of `c`.
    ///
    /// # Errors
    /// The errors of [`Camera::new`].
    pub fn orthographic(k: DMat3, r: DMat3, c: DVec3, size: [u32; 2], pixel_center: PixelCenter) -> Result<Self> {
        check_size(size)?;
        let (k, r) = (validated_intrinsics(k)?, validated_rotation(r)?);
        if !c.is_finite() {
            return Err(SceneError::camera(format!("the location {c} is not finite")));
        }
        let p = camera_matrix(k, r, c, Center::Plane)?;
        Ok(Self::from_parts(k, r, c, p, size, pixel_center, Center::Plane))
    }

    /// Camera without lens, aperture and motion.
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
            background: None,
        }
    }

    /// Creates a camera at `location`, rotated by `roll`, `pitch`, `yaw` in degrees (see `pose`).
    ///
    /// # Errors
    /// The errors of [`Camera::new`], and angles that are not finite.
    #[allow(clippy::too_many_arguments, reason = "a pose consists of six named numbers")]
    pub fn from_pose(
        location: DVec3,
        roll: f64,
        pitch: f64,
        yaw: f64,
        up: Up,
        k: DMat3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self> {
        if ![roll, pitch, yaw].iter().all(|v| v.is_finite()) {
            return Err(SceneError::Camera(
                ErrorCode::OutOfRange.message(format!("roll {roll}, pitch {pitch}, yaw {yaw}: angles must be finite")),
            ));
        }
        let world_from_body = rotation::world_from_reference(up) * rotation::rotation_from_rpy(roll, pitch, yaw);
        Self::new(k, rotation::CAMERA_FROM_BODY * world_from_body.transpose(), location, size, pixel_center)
    }

    /// Creates a camera at `eye` whose principal point shows `target`, with `up_vector` upwards in the image.
    ///
    /// # Errors
    /// The errors of [`Camera::new`]; `eye` equal to `target`; `up_vector` zero or parallel to the viewing direction.
    pub fn look_at(
        eye: DVec3,
        target: DVec3,
        up_vector: DVec3,
        k: DMat3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self> {
        let direction = target - eye;
        let world_from_body = rotation::rotation_towards(direction, up_vector).ok_or_else(|| {
            SceneError::camera(if direction.try_normalize().is_none() {
                format!("eye {eye} and target {target} must be two different finite points")
            } else {
                format!(
                    "up {up_vector} is zero or parallel to the viewing direction {direction}, so the image's \
                     orientation is undetermined; use another up vector, or roll, pitch and yaw"
                )
            })
        })?;
        Self::new(k, rotation::CAMERA_FROM_BODY * world_from_body.transpose(), eye, size, pixel_center)
    }

    /// Creates a camera from OpenCV's extrinsics: a rotation vector (axis times angle in radians) and `t = -R C`.
    ///
    /// # Errors
    /// The errors of [`Camera::new`], and values that are not finite.
    pub fn from_opencv(k: DMat3, rvec: DVec3, t: DVec3, size: [u32; 2], pixel_center: PixelCenter) -> Result<Self> {
        if !(rvec.is_finite() && t.is_finite()) {
            return Err(SceneError::camera(format!("rotation vector {rvec} and translation {t} must be finite")));
        }
        let r = DMat3::from_quat(DQuat::from_scaled_axis(rvec));
        Self::new(k, r, -(r.transpose() * t), size, pixel_center)
    }

    /// Creates a camera from a pose matrix of OpenGL, Blender or NeRF, whose camera axes are x right, y up, z backward.
    ///
    /// # Errors
    /// The errors of [`Camera::new`], and a matrix whose last row is not 0 0 0 1.
    pub fn from_opengl(k: DMat3, world_from_camera: DMat4, size: [u32; 2], pixel_center: PixelCenter) -> Result<Self> {
        let last = world_from_camera.row(3);
        if last.to_array() != [0.0, 0.0, 0.0, 1.0] {
            return Err(SceneError::Camera(ErrorCode::InvalidMatrix.message(format!(
                "the last row of world_from_camera is {last}; expected 0 0 0 1 (is the matrix transposed?)"
            ))));
        }
        let world_from_gl = DMat3::from_mat4(world_from_camera);
        let world_from_cv = DMat3::from_cols(world_from_gl.x_axis, -world_from_gl.y_axis, -world_from_gl.z_axis);
        Self::new(k, world_from_cv.transpose(), world_from_camera.w_axis.truncate(), size, pixel_center)
    }
}
