//! The world at a time.

use crate::error::SceneError;
use crate::world::World;

/// A time of a world, in seconds: of its video, and of one of its animations.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WorldTime {
    /// In seconds.
    pub time: f64,
    /// By number; the first where there are any.
    pub animation: Option<usize>,
}

impl World {
    /// The world when a clock says so: moved by one of its animations, where it has any, and by its video. What does not
    /// move is shared. Cameras are as they are; see [`Video::camera_at`].
    ///
    /// # Errors
    /// Those of [`World::animated_at`] and of [`World::at_video_time`].
    pub fn at_time(&self, clock: WorldTime) -> Result<World, SceneError> {
        let moved = match (&self.node_tree, clock.animation) {
            (None, None) => self.at_video_time(clock.time)?,
            _ => self
                .animated_at(clock.animation.unwrap_or(0), clock.time)?
                .at_video_time(clock.time)?,
        };
        Ok(World {
            time: Some(clock),
            ..moved
        })
    }

    /// Whether anything in it is at another place at another time.
    pub fn is_animated(&self) -> bool {
        let animated = self.node_tree.iter().any(|rig| !rig.animations.is_empty());
        animated || self.video.iter().any(|video| !video.objects.is_empty())
    }

    /// The world at a time of its video in seconds: objects moved, geometry shared. Cameras are as they are; see
    /// [`Video::camera_at`].
    ///
    /// # Errors
    /// [`SceneError::World`] where an object has to face a point straight above or below it, or its own location.
    pub fn at_video_time(&self, time: f64) -> Result<World, SceneError> {
        let animation = None;
        let mut moved = World {
            time: Some(WorldTime { time, animation }),
            ..self.clone()
        };
        for (id, motion) in self.video.iter().flat_map(|video| &video.objects) {
            if let Some(object) = moved.objects.get_mut(*id) {
                object.world_from_mesh = motion.world_from_mesh_at(object, self.up, time)?;
            }
        }
        Ok(moved)
    }
}
