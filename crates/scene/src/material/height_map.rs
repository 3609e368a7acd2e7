//! Height maps: relief that only bends the shading normals (J. Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978).

use crate::error::{Result, SceneError};
use crate::texture::TextureSlot;

/// A texture of heights above the mesh's surface, along its normals.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HeightMap {
    /// Heights: red, of any sign.
    pub texture: TextureSlot,
    /// Height of the value 1, in metres of the world; negative values turn hills into dents.
    pub scale: f32,
}

impl HeightMap {
    /// Checks its values.
    ///
    /// # Errors
    /// [`SceneError::World`] for a scale that is not finite.
    pub fn validate(&self) -> Result<()> {
        if self.scale.is_finite() {
            return Ok(());
        }
        Err(SceneError::material(format!("height_scale {}; expected a finite number of metres", self.scale)))
    }
}
