//! Poses as stored in files: a matrix or a quaternion, from world to camera or from camera to world.

use std::f64::consts::TAU;

use glam::{DMat3, DQuat, DVec3};
use raycam_scene::camera::nearest_rotation;

/// Text of the notice about a quaternion that was scaled.
pub(crate) const SCALED_QUATERNION: &str = "the quaternion does not have length 1; it was scaled";

/// Rotation of a pose, as stored in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rotation {
    /// A matrix, which may differ from a rotation by rounding.
    Matrix(DMat3),
    /// A quaternion of any length except 0: w, x, y, z.
    Quaternion([f64; 4]),
}

impl Rotation {
    /// Creates a rotation from a quaternion w, x, y, z, whose length may differ from 1 by rounding (1e-2).
    ///
    /// # Errors
    /// A quaternion of another length, which usually means that its components come from the wrong columns.
    pub(crate) fn unit_quaternion(quaternion: [f64; 4]) -> Result<Self, String> {
        let [w, x, y, z] = quaternion;
        let length = w.hypot(x).hypot(y).hypot(z);
        if length.is_nan() || (length - 1.0).abs() > 1e-2 {
            return Err(format!(
                "the quaternion has length {length:.4} (w {w}, x {x}, y {y}, z {z}); expected 1, so check the columns \
                 and their order (w = 1, x = y = z = 0 is the identity)"
            ));
        }
        Ok(Self::Quaternion(quaternion))
    }

    /// Creates a rotation from a quaternion w, x, y, z of any length, for files in which names identify its components.
    /// The second value is true if the length differed from 1 by more than rounding (1e-2).
    ///
    /// # Errors
    /// A quaternion of length 0, or with components that are not finite.
    pub(crate) fn scaled_quaternion(quaternion: [f64; 4]) -> Result<(Self, bool), String> {
        let [w, x, y, z] = quaternion;
        let length = w.hypot(x).hypot(y).hypot(z);
        if !(length.is_normal() && length.recip().is_normal()) {
            return Err(format!("the quaternion (w {w}, x {x}, y {y}, z {z}) has no direction; expected length 1"));
        }
        let is_scaled = (length - 1.0).abs() > 1e-2;
        let unit = if is_scaled { quaternion.map(|value| value / length) } else { quaternion };
        Ok((Self::Quaternion(unit), is_scaled))
    }

    /// Creates a rotation from a rotation vector in radians: its direction is the axis, its length the angle.
    ///
    /// # Errors
    /// A vector longer than 2 pi, which is probably in degrees or contains angles.
    pub(crate) fn from_vector([x, y, z]: [f64; 3]) -> Result<Self, String> {
        let length = DVec3::new(x, y, z).length();
        if !length.is_finite() {
            return Err(format!("[{x}, {y}, {z}]; expected finite numbers"));
        }
        if length > TAU + 1e-9 {
            return Err(format!(
                "[{x}, {y}, {z}] has length {length:.6}; expected a rotation vector (axis times angle, in radians) with a \
                 length of at most 2 pi. If its numbers are degrees, write numpy.radians([{x}, {y}, {z}]). If the \
                 numbers are angles about the axes, write the 3x3 matrix \
                 scipy.spatial.transform.Rotation.from_euler(\"xyz\", [{x}, {y}, {z}], degrees=True).as_matrix(), \
                 with the order of your axes"
            ));
        }
        Ok(Self::Matrix(DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(x, y, z)))))
    }

    /// Returns the rotation as a matrix.
    pub fn matrix(self) -> DMat3 {
        match self {
            Self::Matrix(matrix) => matrix,
            Self::Quaternion([w, x, y, z]) => {
                let n = (w * w + x * x + y * y + z * z).sqrt();
                DMat3::from_quat(DQuat::from_xyzw(x / n, y / n, z / n, w / n))
            }
        }
    }

    /// Returns the rotation as a quaternion w, x, y, z; w is not negative if the quaternion is computed from a matrix.
    pub fn quaternion(self) -> [f64; 4] {
        match self {
            Self::Quaternion(quaternion) => quaternion,
            Self::Matrix(matrix) => {
                let q = DQuat::from_mat3(&matrix).normalize();
                let q = if q.w < 0.0 { -q } else { q };
                [q.w, q.x, q.y, q.z].map(|v| v + 0.0)
            }
        }
    }

    fn inverse(self) -> Self {
        match self {
            Self::Matrix(matrix) => Self::Matrix(matrix.transpose()),
            Self::Quaternion([w, x, y, z]) => Self::Quaternion([w, -x, -y, -z]),
        }
    }
}

/// A pose in the direction in which its file stores it.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    rotation: Rotation,
    translation: DVec3,
    /// True for world_from_camera, false for camera_from_world.
    world_from_camera: bool,
}

impl Pose {
    /// Creates a pose from camera_from_world: x = R X + t.
    pub fn camera_from_world(rotation: Rotation, t: DVec3) -> Self {
        Self { rotation, translation: t, world_from_camera: false }
    }

    /// Creates a pose from world_from_camera: X = R x + C.
    pub fn world_from_camera(rotation: Rotation, c: DVec3) -> Self {
        Self { rotation, translation: c, world_from_camera: true }
    }

    /// Pose of a camera whose axes are the world's axes.
    pub fn identity() -> Self {
        Self::camera_from_world(Rotation::Matrix(DMat3::IDENTITY), DVec3::ZERO)
    }

    /// True if the pose is the identity.
    pub fn is_identity(&self) -> bool {
        self.r_c() == (DMat3::IDENTITY, DVec3::ZERO)
    }

    /// True if both poses are equal up to the rounding of numbers with a few digits.
    pub(crate) fn is_near(&self, other: &Self) -> bool {
        let ((r, c), (r2, c2)) = (self.r_c(), other.r_c());
        r.abs_diff_eq(r2, NEAR) && c.abs_diff_eq(c2, NEAR * (1.0 + c.length()))
    }

    /// Returns the inverse transform.
    pub fn inverted(&self) -> Self {
        let (r, c) = self.world_r_c();
        Self::camera_from_world(r, c)
    }

    /// Creates a pose from the rotation R (camera_from_world) and the camera centre C in world coordinates.
    pub fn from_r_c(r: DMat3, c: DVec3) -> Self {
        Self::world_from_camera(Rotation::Matrix(r.transpose()), c)
    }

    /// Returns the rotation R (camera_from_world) and the camera centre C in world coordinates.
    pub fn r_c(&self) -> (DMat3, DVec3) {
        let m = self.rotation.matrix();
        if self.world_from_camera {
            (m.transpose(), self.translation)
        } else {
            (m, -(m.transpose() * self.translation))
        }
    }

    /// Returns the rotation camera_from_world and the translation t, with exactly the file's numbers if the
    /// file stores this direction.
    pub fn r_t(&self) -> (Rotation, DVec3) {
        if self.world_from_camera {
            let rotation = self.rotation.inverse();
            (rotation, -(rotation.matrix() * self.translation))
        } else {
            (self.rotation, self.translation)
        }
    }

    /// Returns the rotation world_from_camera and the camera centre C in world coordinates, with exactly the file's
    /// numbers if the file stores this direction.
    pub fn world_r_c(&self) -> (Rotation, DVec3) {
        if self.world_from_camera { (self.rotation, self.translation) } else { (self.rotation.inverse(), self.r_c().1) }
    }

    /// Returns the pose camera_from_world, if `self` is camera_from_body and `body` is body_from_world: x = R (R' X +
    /// t') + t.
    pub fn compose(&self, body: &Pose) -> Self {
        let ((r, t), (r2, t2)) = (self.r_t(), body.r_t());
        // Nearest rotations are used, because the errors of rounded matrices would multiply.
        let nearest = |r: DMat3| nearest_rotation(r).map_or(r, |(rotation, _)| rotation);
        let (r, r2) = (nearest(r.matrix()), nearest(r2.matrix()));
        Self::camera_from_world(Rotation::Matrix(r * r2), r * t2 + t)
    }

    /// Replaces a matrix that is nearly a rotation by the nearest rotation, unless they differ only by float32
    /// rounding; returns the largest difference between their entries, or `None` if nothing was replaced.
    pub(crate) fn orthonormalize(&mut self) -> Option<f64> {
        let Rotation::Matrix(matrix) = self.rotation else { return None };
        let (rotation, off) = nearest_rotation(matrix).ok()?;
        if off <= UNREPORTED_DIFFERENCE {
            return None;
        }
        self.rotation = Rotation::Matrix(rotation);
        Some(off)
    }
}

/// Maximum difference between the entries of two poses that count as equal; for centres, relative to their distance from
/// the origin.
const NEAR: f64 = 1e-4;

/// Maximum difference between a matrix and a rotation at which the matrix is kept as in the file.
const UNREPORTED_DIFFERENCE: f64 = 1e-7;

/// Returns the quaternion scaled to length 1; unchanged if its length is almost 1.
pub(crate) fn normalized(quaternion: [f64; 4]) -> [f64; 4] {
    let length = quaternion.iter().map(|value| value * value).sum::<f64>().sqrt();
    if (length - 1.0).abs() < 1e-6 { quaternion } else { quaternion.map(|value| value / length) }
}
