//! Mount of a camera on a rig.

use crate::Pose;

/// Mount of a camera on a rig, at one pose of the rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigMount {
    /// Name of the rig.
    pub rig: String,
    /// Name of the frame, which is one pose of the rig; the cameras of a frame exposed at the same time.
    pub frame: String,
    /// Name of the camera on the rig.
    pub name: String,
    /// Pose of the camera on the rig: camera_from_body.
    pub camera: Pose,
    /// Pose of the rig in the world: body_from_world.
    pub body: Pose,
}
