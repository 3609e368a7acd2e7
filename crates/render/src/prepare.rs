//! From a world as written to a world as rendered.

use raycam_scene::World;

use crate::control::Control;
use crate::error::RenderError;

/// A world ready to be rendered: acceleration structures, instances and lights relative to a local origin.
#[derive(Debug)]
pub struct PreparedWorld {}

impl PreparedWorld {
    /// Prepares a world. Meshes that `previous` already holds (the same `Arc`) are not built again, so that moving
    /// objects, lights and materials cost next to nothing. Stops between meshes when `control` is cancelled.
    pub fn new(
        _world: &World,
        _previous: Option<&PreparedWorld>,
        _threads: Option<usize>,
        _control: &Control,
    ) -> Result<Self, RenderError> {
        Ok(Self {})
    }
}
