//! Several cameras on a moving body.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use crate::camera::sensor::{NamedSensor, check_mounts};
use crate::camera::validate::validated_rotation;
use crate::camera::{Camera, Pose, ShutterMotion};
use crate::error::{Result, SceneError};

/// Camera with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedCamera {
    /// Name, unique within the world.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

/// Cameras that a body carries: camera_from_world = camera_from_body * body_from_world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// Name, unique within its world.
    name: String,
    /// body_from_world and the body's position, in the middle of the motion.
    body: Pose,
    /// Motion of the body while the shutters are open.
    motion: Option<ShutterMotion>,
    /// Cameras, with their R and C in the axes of the body.
    mounts: Vec<NamedCamera>,
    /// The sensors that are not cameras, with their poses in the axes of the body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    sensors: Vec<NamedSensor>,
}

impl Rig {
    /// Creates a rig from cameras with R and C in the axes of a body, and the body's pose.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if the pose is not a rotation with a finite position, or if a name is empty or used
    /// twice.
    pub fn new(name: impl Into<String>, body: Pose, mounts: Vec<NamedCamera>) -> Result<Self> {
        let fail = |message: String| Err(SceneError::camera(message));
        let mut names = HashSet::new();
        for NamedCamera { name, .. } in &mounts {
            if name.is_empty() || !names.insert(name) {
                return fail(format!("cameras of a rig must have distinct names; {name:?} is empty or used twice"));
            }
        }
        if !body.c.is_finite() {
            return fail(format!("the position {} of a rig is not finite", body.c));
        }
        let r = validated_rotation(body.r)?;
        Ok(Self { name: name.into(), body: Pose { r, ..body }, motion: None, mounts, sensors: Vec::new() })
    }

    /// Returns a copy with these sensors in addition to its cameras.
    ///
    /// # Errors
    /// The errors of [`check_mounts`].
    pub fn with_sensors(self, sensors: Vec<NamedSensor>) -> Result<Self> {
        check_mounts(self.mounts.iter().map(|mount| &mount.name[..]), &sensors)?;
        Ok(Self { sensors, ..self })
    }

    /// Returns a copy that moves while its cameras expose; `motion` is the motion of the body.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if a camera has its own shutter, or cannot move.
    pub fn with_motion(self, motion: ShutterMotion) -> Result<Self> {
        if let Some(mount) = self.mounts.iter().find(|m| m.camera.motion().is_some()) {
            return Err(SceneError::camera(format!(
                "camera {:?} of the rig has its own shutter; set the shutter on the rig or on its cameras, not on \
                 both",
                mount.name
            )));
        }
        let moving = Self { body: motion.mid_exposure_pose(), motion: Some(motion), ..self };
        moving.cameras()?;
        Ok(moving)
    }

    /// Returns the rig's cameras in the world.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if a camera cannot be moved.
    pub fn cameras(&self) -> Result<Vec<NamedCamera>> {
        let carried = |mount: &NamedCamera| {
            let camera = match &self.motion {
                None => mount.camera.in_world(&self.body)?,
                Some(motion) => {
                    let (r, c) = (mount.camera.r(), mount.camera.c());
                    let motion = motion.clone().with_camera_from_body(Pose { r, c });
                    mount.camera.clone().with_motion(motion)?
                }
            };
            let name = mount.name.clone();
            Ok(NamedCamera { name, camera })
        };
        self.mounts.iter().map(carried).collect()
    }

    /// Returns a copy with another pose: body_from_world, and the body's position. The motion of a moving rig is moved
    /// too.
    ///
    /// # Errors
    /// The errors of [`Rig::new`] about the pose.
    pub fn at_pose(&self, pose: Pose) -> Result<Self> {
        let turn = validated_rotation(pose.r)?.transpose() * self.body.r;
        let motion = self.motion.as_ref().map(|motion| {
            motion.map_poses(|then| Pose { r: then.r * turn.transpose(), c: pose.c + turn * (then.c - self.body.c) })
        });
        Ok(Self { motion, sensors: self.sensors.clone(), ..Self::new(self.name.clone(), pose, self.mounts.clone())? })
    }

    /// Returns a copy with another name.
    pub fn named(self, name: String) -> Self {
        Self { name, ..self }
    }

    /// Name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// body_from_world, and the body's position.
    pub fn body(&self) -> Pose {
        self.body
    }

    /// Motion of the body while the shutters are open; `None` for cameras without a common shutter.
    pub fn motion(&self) -> Option<&ShutterMotion> {
        self.motion.as_ref()
    }

    /// Cameras in the axes of the body.
    pub fn mounts(&self) -> &[NamedCamera] {
        &self.mounts
    }

    /// The sensors that are not cameras, in the axes of the body.
    pub fn sensors(&self) -> &[NamedSensor] {
        &self.sensors
    }
}

impl Camera {
    /// Converts a camera from a body's axes to the world; `body` is the body's pose.
    ///
    /// # Errors
    /// The errors of [`Camera::at_pose`].
    pub fn in_world(&self, body: &Pose) -> Result<Self> {
        if *body == Pose::IDENTITY {
            return Ok(self.clone());
        }
        let pose = body.compose(&Pose { r: self.r(), c: self.c() });
        self.at_pose(pose.r, pose.c)
    }
}
