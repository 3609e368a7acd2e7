//! A camera in a world. With a rolling shutter, each row of the image shows the world at its own time.

use raycam_scene::{Camera, World};

use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::PreparedWorld;

/// A camera, and the world that its image shows.
#[derive(Clone, Copy)]
pub struct Viewpoint<'a> {
    /// Prepared world. For a moving world: its state in the middle of the shutter's time.
    pub world: &'a PreparedWorld,
    /// Description of a moving world; `None` for a static world.
    pub animated_world: Option<&'a World>,
    /// The camera.
    pub camera: &'a Camera,
}

impl<'a> Viewpoint<'a> {
    /// World states of the camera's rows, if rows are exposed at different times.
    pub(crate) fn rolling_shutter(&self) -> Option<ShutterSlices<'a>> {
        ShutterSlices::new(self.animated_world?, self.world, self.camera).filter(ShutterSlices::is_rolling)
    }
}
