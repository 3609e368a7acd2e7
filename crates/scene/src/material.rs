//! Materials: a base colour and how the surface reflects it.

use crate::color::Rgb;

/// What a surface is made of. The base colour at a point is the product of `color`, the mesh's face or vertex colour
/// and the texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Empty when it has none.
    pub name: String,
    /// Linear base colour, each channel 0..=1.
    pub color: Rgb,
    /// Index into the world's textures.
    pub texture: Option<usize>,
    /// How the base colour is reflected.
    pub reflectance: Reflectance,
}

/// The closed set of reflection models.
#[derive(Clone, Debug, PartialEq)]
pub enum Reflectance {
    /// The lecture's: Lambert of albedo `diffuse * base colour` plus the energy-conserving modified Phong lobe of
    /// Lafortune and Willems (1994) with albedo `specular` and exponent `shininess`.
    Lecture {
        /// 0..=1.
        diffuse: f32,
        /// Linear, 0..=1 per channel.
        specular: Rgb,
        /// The Phong exponent, >= 0.
        shininess: f32,
    },
    /// The base colour itself, whatever the light.
    Unlit,
}
