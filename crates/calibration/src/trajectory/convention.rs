//! Direction and camera axes of poses whose files specify neither.

use glam::DMat3;
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

/// Returns the convention that the caller specifies. Otherwise, a convention is assumed with a notice: OpenCV's axes, and
/// camera_from_world if `is_inverse` (because of a name), or else world_from_camera.
pub(crate) fn convention_of(is_inverse: bool, hints: &ReadHints, notices: &mut Vec<Notice>) -> PoseConvention {
    if let Some(stated) = hints.poses {
        return stated;
    }
    let direction =
        if is_inverse { "camera_from_world (because of the name of the file or key)" } else { "world_from_camera" };
    notices.push(Notice::new(
        NoticeCode::AssumedConvention,
        format!(
            "the file does not specify the direction and axes of its poses; {direction} and OpenCV axes are \
             assumed (set them with direction= and axes=, --direction and --axes)"
        ),
    ));
    PoseConvention { world_from_camera: !is_inverse, opengl: false }
}

impl PoseConvention {
    /// Creates a pose from the rows of a 3x4 matrix.
    pub(crate) fn pose(self, rows: &[f64; 12]) -> Pose {
        let (mut r, t) = rigid(rows);
        if self.world_from_camera {
            if self.opengl {
                r = flip_columns(r);
            }
            return Pose::world_from_camera(Rotation::Matrix(r), t);
        }
        let flip = DMat3::from_diagonal(glam::DVec3::new(1.0, -1.0, -1.0));
        let (r, t) = if self.opengl { (flip * r, flip * t) } else { (r, t) };
        Pose::camera_from_world(Rotation::Matrix(r), t)
    }
}

/// Converts world_from_camera from OpenGL's axes (x right, y up, z backward) to OpenCV's, or the reverse.
pub(crate) fn flip_columns(world_from_camera: DMat3) -> DMat3 {
    DMat3::from_cols(world_from_camera.x_axis, -world_from_camera.y_axis, -world_from_camera.z_axis)
}
