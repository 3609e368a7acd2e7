//! The world at a time.

use crate::error::SceneError;
use crate::world::World;

/// A time of a world, in seconds: of its video, and of one of its animations.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Clock {
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
    /// Those of [`World::animated`] and of [`World::at`].
    pub fn at_clock(&self, clock: Clock) -> Result<World, SceneError> {
        let moved = match (&self.rig, clock.animation) {
            (None, None) => self.at(clock.time)?,
            _ => self
                .animated(clock.animation.unwrap_or(0), clock.time)?
                .at(clock.time)?,
        };
        Ok(World {
            clock: Some(clock),
            ..moved
        })
    }

    /// Whether anything in it is at another place at another time.
    pub fn moves(&self) -> bool {
        let animated = self.rig.iter().any(|rig| !rig.animations.is_empty());
        animated || self.video.iter().any(|video| !video.objects.is_empty())
    }

    /// The world at a time of its video in seconds: objects moved, geometry shared. Cameras are as they are; see
    /// [`Video::camera_at`].
    ///
    /// # Errors
    /// [`SceneError::World`] where an object has to face a point straight above or below it, or its own location.
    pub fn at(&self, time: f64) -> Result<World, SceneError> {
        let animation = None;
        let mut moved = World {
            clock: Some(Clock { time, animation }),
            ..self.clone()
        };
        for (id, motion) in self.video.iter().flat_map(|video| &video.objects) {
            if let Some(object) = moved.objects.get_mut(*id) {
                object.world_from_mesh = motion.place(object, self.up, time)?;
            }
        }
        Ok(moved)
    }
}
