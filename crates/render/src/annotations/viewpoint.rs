//! Camera in a prepared world, for annotations.

use raycam_scene::{Camera, World};

use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::PreparedWorld;

/// A world and a camera that sees it.
#[derive(Clone, Copy)]
pub struct Viewpoint<'a> {
    /// The world; of one that moves on while the shutter is open, as it stands in the middle of that.
    pub world: &'a PreparedWorld,
    /// The same as it is described, which says how it moves on; none for a world that stands.
    pub animated_world: Option<&'a World>,
    /// The camera.
    pub camera: &'a Camera,
}

impl<'a> Viewpoint<'a> {
    /// The times at which its lines see the world, where these differ.
    pub(crate) fn rolling_shutter(&self) -> Option<ShutterSlices<'a>> {
        ShutterSlices::new(self.animated_world?, self.world, self.camera)
            .filter(ShutterSlices::is_rolling)
    }
}
