//! References to textures, with `KHR_texture_transform`.

use raycam_scene::animation::UvTransform;
use serde::Deserialize;

/// Reference to a texture.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureInfo {
    pub(crate) index: usize,
    #[serde(default)]
    pub(crate) tex_coord: usize,
    /// Strength of a normal texture.
    pub(crate) scale: Option<f64>,
    /// Strength of an occlusion texture.
    pub(crate) strength: Option<f64>,
    #[serde(default)]
    pub(crate) extensions: TextureInfoExtensions,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(crate) transform: Option<TextureTransform>,
}

/// `KHR_texture_transform`.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureTransform {
    #[serde(default)]
    pub(crate) offset: [f64; 2],
    #[serde(default)]
    pub(crate) rotation: f64,
    #[serde(default = "ones")]
    pub(crate) scale: [f64; 2],
    pub(crate) tex_coord: Option<usize>,
}

fn ones() -> [f64; 2] {
    [1.0; 2]
}

impl TextureInfo {
    /// Index of the set of texture coordinates.
    pub(crate) fn uv_set(&self) -> usize {
        let transform = self.extensions.transform.as_ref();
        transform.and_then(|transform| transform.tex_coord).unwrap_or(self.tex_coord)
    }

    /// Transform of texture coordinates; the identity if the file has none.
    pub(crate) fn uv_transform(&self) -> UvTransform {
        let transform = self.extensions.transform.as_ref();
        UvTransform {
            offset: transform.map_or([0.0; 2], |t| t.offset),
            rotation: transform.map_or(0.0, |t| t.rotation),
            scale: transform.map_or([1.0; 2], |t| t.scale),
        }
    }
}
