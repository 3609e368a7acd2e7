//! Poses as files have them: a matrix or a quaternion, from world to camera or back.

use std::f64::consts::TAU;

use glam::{DMat3, DQuat, DVec3};
use raycam_scene::camera::nearest_rotation;

/// The rotation of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rotation {
    /// A matrix.
    Matrix(DMat3),
    /// A quaternion of any length but 0: w, x, y, z.
    Quaternion([f64; 4]),
}

impl Rotation {
    /// From a quaternion w, x, y, z, whose length may differ from 1 by rounding (1e-2).
    ///
    /// # Errors
    /// A quaternion of another length: most often its numbers are other columns.
    pub(crate) fn unit_quaternion(quaternion: [f64; 4]) -> Result<Self, String> {
        let [w, x, y, z] = quaternion;
        let length = w.hypot(x).hypot(y).hypot(z);
        if length.is_nan() || (length - 1.0).abs() > 1e-2 {
            return Err(format!(
                "a quaternion of length {length:.4} (w {w}, x {x}, y {y}, z {z}); expected 1: are these its numbers, in \
                 this order? w 1 and x y z 0 turn nothing"
            ));
        }
        Ok(Self::Quaternion(quaternion))
    }

    /// From a rotation vector in radians: its direction is the axis, its length the angle.
    ///
    /// # Errors
    /// A vector longer than 2 pi: its numbers are degrees or angles.
    pub(crate) fn from_vector([x, y, z]: [f64; 3]) -> Result<Self, String> {
        let length = DVec3::new(x, y, z).length();
        if !length.is_finite() {
            return Err(format!("[{x}, {y}, {z}]: expected finite numbers"));
        }
        if length > TAU + 1e-9 {
            return Err(format!(
                "[{x}, {y}, {z}] is {length:.6} long, and a rotation vector (axis times angle, in radians) has at most 2 \
                 pi: write a rotation vector in radians (numpy.radians([{x}, {y}, {z}]) if these are degrees), or, for \
                 angles about the axes, the 3x3 matrix (scipy.spatial.transform.Rotation.from_euler(\"xyz\", [{x}, {y}, \
                 {z}], degrees=True).as_matrix(), with the order of your axes)"
            ));
        }
        Ok(Self::Matrix(DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(x, y, z)))))
    }

    /// As a matrix.
    pub fn matrix(self) -> DMat3 {
        match self {
            Self::Matrix(matrix) => matrix,
            Self::Quaternion([w, x, y, z]) => {
                let n = (w * w + x * x + y * y + z * z).sqrt();
                DMat3::from_quat(DQuat::from_xyzw(x / n, y / n, z / n, w / n))
            }
        }
    }

    /// As a quaternion w, x, y, z; w is not negative where it is made from a matrix.
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

/// A pose, in the direction that its file has.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    rotation: Rotation,
    translation: DVec3,
    /// True for world_from_camera, false for camera_from_world.
    world_from_camera: bool,
}

impl Pose {
    /// From camera_from_world: x = R X + t.
    pub fn camera_from_world(rotation: Rotation, t: DVec3) -> Self {
        Self { rotation, translation: t, world_from_camera: false }
    }

    /// From world_from_camera: X = R x + C.
    pub fn world_from_camera(rotation: Rotation, c: DVec3) -> Self {
        Self { rotation, translation: c, world_from_camera: true }
    }

    /// The pose of a camera whose axes are those of the world.
    pub fn identity() -> Self {
        Self::camera_from_world(Rotation::Matrix(DMat3::IDENTITY), DVec3::ZERO)
    }

    /// True for the identity.
    pub fn is_identity(&self) -> bool {
        self.r_c() == (DMat3::IDENTITY, DVec3::ZERO)
    }

    /// The inverse transform.
    pub fn inverted(&self) -> Self {
        let (r, c) = self.world_r_c();
        Self::camera_from_world(r, c)
    }

    /// From camera_from_world and the centre.
    pub fn from_r_c(r: DMat3, c: DVec3) -> Self {
        Self::world_from_camera(Rotation::Matrix(r.transpose()), c)
    }

    /// camera_from_world and the centre.
    pub fn r_c(&self) -> (DMat3, DVec3) {
        let m = self.rotation.matrix();
        if self.world_from_camera {
            (m.transpose(), self.translation)
        } else {
            (m, -(m.transpose() * self.translation))
        }
    }

    /// camera_from_world and t; unchanged where the file has them.
    pub fn r_t(&self) -> (Rotation, DVec3) {
        if self.world_from_camera {
            let rotation = self.rotation.inverse();
            (rotation, -(rotation.matrix() * self.translation))
        } else {
            (self.rotation, self.translation)
        }
    }

    /// world_from_camera and the centre; unchanged where the file has them.
    pub fn world_r_c(&self) -> (Rotation, DVec3) {
        if self.world_from_camera { (self.rotation, self.translation) } else { (self.rotation.inverse(), self.r_c().1) }
    }

    /// The pose of a camera in the world; `self` is its pose from the body, `body` the pose of the body: x = R (R' X +
    /// t') + t.
    pub fn compose(&self, body: &Pose) -> Self {
        let ((r, t), (r2, t2)) = (self.r_t(), body.r_t());
        // Errors of rounded matrices would multiply.
        let nearest = |r: DMat3| nearest_rotation(r).map_or(r, |(rotation, _)| rotation);
        let (r, r2) = (nearest(r.matrix()), nearest(r2.matrix()));
        Self::camera_from_world(Rotation::Matrix(r * r2), r * t2 + t)
    }

    /// Replaces a matrix that is nearly a rotation by the nearest rotation; returns the largest difference of an entry if
    /// it exceeds the rounding of float32.
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

/// Largest difference between a matrix and a rotation that remains as written in the file.
const UNREPORTED_DIFFERENCE: f64 = 1e-7;

/// The quaternion with length 1; unchanged where it has that nearly.
pub(crate) fn normalized(quaternion: [f64; 4]) -> [f64; 4] {
    let length = quaternion.iter().map(|value| value * value).sum::<f64>().sqrt();
    if (length - 1.0).abs() < 1e-6 { quaternion } else { quaternion.map(|value| value / length) }
}
