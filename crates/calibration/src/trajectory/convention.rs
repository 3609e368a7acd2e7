//! Direction and camera axes of poses whose files state neither.

use glam::DMat3;
use raycam_scene::{Notice, NoticeCode};

use crate::document::rigid;
use crate::files::PoseConvention;
use crate::{Pose, ReadHints, Rotation};

/// Words in names of files with camera_from_world.
const CAMERA_FROM_WORLD: [&str; 7] =
    ["extrinsic", "w2c", "world_to_cam", "world2cam", "world_to_camera", "camera_from_world", "cam_from_world"];

/// The convention that the caller states, or else that of the name of a file; a guess has a notice.
pub(crate) fn convention_of(name: &str, hints: &ReadHints, notices: &mut Vec<Notice>) -> PoseConvention {
    if let Some(stated) = hints.poses {
        return stated;
    }
    let lower = name.to_lowercase();
    let inverse = CAMERA_FROM_WORLD.iter().any(|word| lower.contains(word));
    let direction = if inverse { "camera_from_world by the file's name" } else { "world_from_camera" };
    notices.push(Notice::new(NoticeCode::AssumedConvention, format!(
        "the file states neither direction nor axes of its poses: taken as {direction}, OpenCV axes (direction= and \
         axes=, --direction and --axes, say otherwise)"
    )));
    PoseConvention { world_from_camera: !inverse, opengl: false }
}

impl PoseConvention {
    /// The pose of the rows of a 3x4 matrix.
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

/// world_from_camera of OpenGL's axes (x right, y up, z backward) as that of OpenCV's, and back.
pub(crate) fn flip_columns(world_from_camera: DMat3) -> DMat3 {
    DMat3::from_cols(world_from_camera.x_axis, -world_from_camera.y_axis, -world_from_camera.z_axis)
}
