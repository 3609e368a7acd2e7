//! Height maps: relief that only bends the shading normals (J. Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH
//! 1978).

use crate::error::{Result, SceneError};
use crate::texture::TextureSlot;

/// A texture of heights above the mesh's surface, along its normals.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HeightMap {
    /// The texture; its red channel is the height, of any sign.
    pub texture: TextureSlot,
    /// Height that the value 1 represents; a negative scale turns hills into dents.
    pub scale: f32,
    /// Unit of the scale.
    #[serde(default, skip_serializing_if = "HeightUnit::is_metre")]
    pub unit: HeightUnit,
}

/// Unit of heights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum HeightUnit {
    /// A metre of the world.
    #[default]
    Metre,
    /// The width of a texel on the surface: slopes do not depend on the size of the surface. Files that do not specify
    /// a unit use this value.
    Texel,
}

impl HeightUnit {
    fn is_metre(&self) -> bool {
        *self == Self::Metre
    }
}

impl HeightMap {
    /// Checks the height map's values.
    ///
    /// # Errors
    /// [`SceneError::World`] for a scale that is not finite.
    pub fn validate(&self) -> Result<()> {
        if self.scale.is_finite() {
            return Ok(());
        }
        Err(SceneError::material(format!("height_scale is {}; expected a finite number of metres", self.scale)))
    }
}
