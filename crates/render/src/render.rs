//! One camera's picture of a prepared world.

use raycam_scene::Camera;

use crate::control::Control;
use crate::error::RenderError;
use crate::frame::Frame;
use crate::prepare::PreparedWorld;
use crate::settings::Settings;

/// Renders what a camera sees.
pub fn render(
    _world: &PreparedWorld,
    _camera: &Camera,
    _settings: &Settings,
    _control: &Control,
) -> Result<Frame, RenderError> {
    Err(RenderError::Settings("render is not built yet".into()))
}
