//! Direction and camera axes of poses whose files specify neither.

use glam::{DMat3, DVec3};
use raycam_scene::{Notice, NoticeCode};

use crate::document::rigid;
use crate::files::PoseConvention;
use crate::{Pose, ReadHints, Rotation};

/// Words in the names of files and keys that mean camera_from_world.
const CAMERA_FROM_WORLD: [&str; 7] =
    ["extrinsic", "w2c", "world_to_cam", "world2cam", "world_to_camera", "camera_from_world", "cam_from_world"];

/// True for the name of a file, folder or key that means camera_from_world.
pub(crate) fn means_camera_from_world(name: &str) -> bool {
    let lower = name.to_lowercase();
    CAMERA_FROM_WORLD.iter().any(|word| lower.contains(word))
}

/// Returns the convention that the caller specifies. A direction that the caller does not specify is assumed with a
/// notice: camera_from_world if `is_inverse` (because of a name), or else world_from_camera. The default axes are OpenCV's.
pub(crate) fn convention_of(is_inverse: bool, hints: &ReadHints, notices: &mut Vec<Notice>) -> PoseConvention {
    if let Some(world_from_camera) = hints.poses.world_from_camera {
        return hints.poses.directed(world_from_camera);
    }
    let direction =
        if is_inverse { "camera_from_world (because of the name of the file or key)" } else { "world_from_camera" };
    let message = match hints.poses.opengl {
        None => format!(
            "the file does not specify the direction and axes of its poses; {direction} and OpenCV axes are \
             assumed (set them with direction= and axes=, or with --direction and --axes)"
        ),
        Some(_) => format!(
            "the file does not specify the direction of its poses; {direction} is assumed (set it with direction= \
             or --direction)"
        ),
    };
    notices.push(Notice::new(NoticeCode::AssumedConvention, message));
    hints.poses.directed(!is_inverse)
}

impl PoseConvention {
    /// Creates a pose from the rows of a 3x4 matrix.
    pub(crate) fn pose(self, rows: &[f64; 12]) -> Pose {
        let (r, t) = rigid(rows);
        self.pose_of(r, t)
    }

    /// Creates a pose from the rotation and the translation of a transform.
    pub(crate) fn pose_of(self, mut r: DMat3, t: DVec3) -> Pose {
        if self.world_from_camera {
            if self.opengl {
                r = flip_columns(r);
            }
            return Pose::world_from_camera(Rotation::Matrix(r), t);
        }
        let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let (r, t) = if self.opengl { (flip * r, flip * t) } else { (r, t) };
        Pose::camera_from_world(Rotation::Matrix(r), t)
    }

    /// Creates a pose from a rotation of this convention and the camera's centre in the world.
    pub(crate) fn pose_at(self, rotation: DMat3, center: DVec3) -> Pose {
        let r = if self.world_from_camera { rotation } else { rotation.transpose() };
        let r = if self.opengl { flip_columns(r) } else { r };
        Pose::world_from_camera(Rotation::Matrix(r), center)
    }
}

/// Converts world_from_camera from OpenGL's axes (x right, y up, z backward) to OpenCV's, or the reverse.
pub(crate) fn flip_columns(world_from_camera: DMat3) -> DMat3 {
    DMat3::from_cols(world_from_camera.x_axis, -world_from_camera.y_axis, -world_from_camera.z_axis)
}
