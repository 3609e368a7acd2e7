//! Videos: orbits and keyframes, and the world at a time.

use crate::camera::Camera;
use crate::error::SceneError;
use crate::schema::VideoSpec;
use crate::world::World;

/// A `[video]` whose object names are resolved and keyframes are in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Video {
    fps: f64,
    seconds: f64,
}

impl Video {
    /// A video of this world.
    ///
    /// # Errors
    /// [`SceneError::Schema`] where times are not in order, an object is unknown, or values make no sense.
    pub fn new(_spec: &VideoSpec, _world: &World) -> Result<Self, SceneError> {
        Err(SceneError::World("not built yet".into()))
    }

    /// Frames per second.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// Length in seconds.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// How many frames it has: `fps * seconds` to the nearest, at least one.
    pub fn frame_count(&self) -> usize {
        ((self.fps * self.seconds).round() as usize).max(1)
    }

    /// When a frame is, in seconds.
    pub fn time(&self, frame: usize) -> f64 {
        frame as f64 / self.fps
    }

    /// `base` (one of the world's cameras, or another) as the video moves it, at a time in seconds.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where it has to look straight up or down at its target.
    pub fn camera_at(&self, _base: &Camera, _time: f64) -> Result<Camera, SceneError> {
        Err(SceneError::World("not built yet".into()))
    }
}

impl World {
    /// The world at a time of its video in seconds: objects moved, geometry shared.
    ///
    /// # Errors
    /// [`SceneError::World`] where an object has to look straight up or down at its target.
    pub fn at(&self, _time: f64) -> Result<World, SceneError> {
        Ok(self.clone())
    }
}
