//! Rigs that a video moves.

use glam::DMat3;

use super::Video;
use crate::camera::{Camera, PixelCenter, Pose, Rig};
use crate::error::{Result, SceneError};
use crate::math::rotation;

impl Video {
    /// Returns a rig, moved by the video to its pose at a time in seconds. If the world's rig `index` has its own
    /// keyframes, these move the rig; otherwise, it moves like a camera.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if the rig would have to look straight up or down at its target.
    pub fn rig_at(&self, rig: &Rig, index: Option<usize>, time: f64) -> Result<Rig> {
        let moved = self.rig_pose(rig, index, time)?;
        let Some(shutter) = rig.motion().filter(|shutter| shutter.is_static()) else { return Ok(moved) };
        let motion = shutter.resampled(|since_middle| Ok(self.rig_pose(rig, index, time + since_middle)?.body()))?;
        moved.with_motion(motion)
    }

    fn rig_pose(&self, rig: &Rig, index: Option<usize>, time: f64) -> Result<Rig> {
        let own = self.rigs.iter().find(|(id, _)| Some(*id) == index);
        let body = rig.body();
        let Some((_, motion)) = own else {
            // The body is moved like a camera that looks along the body's x axis.
            let k = DMat3::IDENTITY;
            let ahead = Camera::new(k, rotation::CAMERA_FROM_BODY * body.r, body.c, [1, 1], PixelCenter::Integer)?;
            let moved = self.camera_pose(&ahead, None, time)?;
            if moved == ahead {
                return Ok(rig.clone());
            }
            let r = rotation::CAMERA_FROM_BODY.transpose() * moved.r();
            return rig.at_pose(Pose { r, c: moved.c() });
        };
        let c = motion.location.evaluate(time).unwrap_or(body.c);
        let r = match (motion.target.evaluate(time), motion.rotation_at(self.up, time)) {
            (Some(target), _) => rotation::rotation_towards(target - c, self.up.axis())
                .ok_or_else(|| {
                    SceneError::camera(format!(
                        "rig {:?} at {c} cannot face {target} at {time} s; expected a target that is not the \
                         rig's location, and not straight above or below the rig",
                        rig.name()
                    ))
                })?
                .transpose(),
            (None, Some(world_from_body)) => world_from_body.transpose(),
            (None, None) => body.r,
        };
        rig.at_pose(Pose { r, c })
    }
}
