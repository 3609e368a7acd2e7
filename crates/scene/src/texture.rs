//! Textures: images that colour surfaces.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::color::Rgb;

/// What a texture does beyond 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Wrap {
    /// Starts again.
    #[default]
    Repeat,
    /// Keeps its border.
    Clamp,
    /// Turns back.
    Mirror,
}

/// An sRGB image of 8 bits a channel, row 0 at the top, and how it is looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The file it came from, or empty.
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Row-major sRGB texels.
    pub texels: Vec<[u8; 3]>,
    /// Wrap modes of u and v.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// The bilinear colour at texture coordinates (u right, v down), linear; texel centres lie at half integers, and
    /// a texel at its centre comes back exactly. Interpolation is of linear values.
    pub fn lookup(&self, _uv: [f32; 2]) -> Rgb {
        [0.0; 3]
    }
}
