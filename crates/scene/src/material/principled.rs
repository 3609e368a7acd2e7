//! The principled material: data of glTF 2.0's metallic-roughness model and its extensions.

use crate::color::Rgb;
use crate::error::{Result, SceneError};
use crate::texture::TextureSlot;

/// A number or colour, and a texture that multiplies it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Textured<T> {
    /// Linear value.
    pub value: T,
    /// Texture; the field's documentation specifies the channels.
    pub texture: Option<TextureSlot>,
}

impl<T> From<T> for Textured<T> {
    fn from(value: T) -> Self {
        Self { value, texture: None }
    }
}

/// A texture of tangent-space normals.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NormalMap {
    /// Red, green, blue are x, y, z; values 0..=1 represent -1..=1.
    pub texture: TextureSlot,
    /// Factor on x and y.
    pub scale: f32,
}

/// Metal and dielectric in one material, layered as in the glTF 2.0 specification, appendix B, and its
/// `KHR_materials_*` extensions. The base colour is the material's.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Principled {
    /// 0 for a dielectric, 1 for a metal. Texture: blue.
    pub metallic: Textured<f32>,
    /// Perceptual roughness 0..=1; alpha is its square. Texture: green.
    pub roughness: Textured<f32>,
    /// Index of refraction, >= 1; 0 means infinite, as in `KHR_materials_ior`.
    pub ior: f32,
    /// Strength of the dielectric's reflection. Texture: alpha.
    pub specular: Textured<f32>,
    /// Colour of the dielectric's reflection at normal incidence; may exceed 1. Texture: red, green, blue.
    pub specular_color: Textured<Rgb>,
    /// Fraction of the light that is not reflected and passes through. Texture: red.
    pub transmission: Textured<f32>,
    /// Thickness in the mesh's units; 0 for thin walls. A ray tracer uses the geometry itself, so it only matters
    /// whether the value is 0. Texture: green.
    pub thickness: Textured<f32>,
    /// Transmittance after `attenuation_distance`.
    pub attenuation_color: Rgb,
    /// Distance in metres of the world after which white light has the `attenuation_color`; infinite without
    /// absorption.
    pub attenuation_distance: f32,
    /// Dispersion: 20 divided by the Abbe number; 0 without dispersion.
    pub dispersion: f32,
    /// Strength of a clear layer of index 1.5. Texture: red.
    pub clearcoat: Textured<f32>,
    /// Perceptual roughness of the clear coat. Texture: green.
    pub clearcoat_roughness: Textured<f32>,
    /// Normals of the coat; the geometry's normals if absent.
    pub clearcoat_normal: Option<NormalMap>,
    /// Colour of the sheen (retroreflection of cloth). Texture: red, green, blue.
    pub sheen_color: Textured<Rgb>,
    /// Perceptual roughness of the sheen. Texture: alpha.
    pub sheen_roughness: Textured<f32>,
    /// Strength of a thin film. Texture: red.
    pub iridescence: Textured<f32>,
    /// Index of refraction of the film.
    pub iridescence_ior: f32,
    /// Film thickness in nanometres for texture value 0 and for texture value 1 (or no texture). Texture: green.
    pub iridescence_thickness: [f32; 2],
    /// See `iridescence_thickness`.
    pub iridescence_thickness_texture: Option<TextureSlot>,
    /// Strength of the anisotropy, which stretches highlights. Texture: blue.
    pub anisotropy: Textured<f32>,
    /// Direction of the anisotropy in radians, counter-clockwise from the tangent. The texture's red and green are a
    /// direction; values 0..=1 represent -1..=1.
    pub anisotropy_rotation: f32,
    /// Fraction of diffuse light that is transmitted instead of reflected. Texture: alpha.
    pub diffuse_transmission: Textured<f32>,
    /// Colour of the diffusely transmitted light. Texture: red, green, blue.
    pub diffuse_transmission_color: Textured<Rgb>,
}

impl Default for Principled {
    /// glTF's defaults.
    fn default() -> Self {
        Self {
            metallic: 1.0.into(),
            roughness: 1.0.into(),
            ior: 1.5,
            specular: 1.0.into(),
            specular_color: [1.0; 3].into(),
            transmission: 0.0.into(),
            thickness: 0.0.into(),
            attenuation_color: [1.0; 3],
            attenuation_distance: f32::INFINITY,
            dispersion: 0.0,
            clearcoat: 0.0.into(),
            clearcoat_roughness: 0.0.into(),
            clearcoat_normal: None,
            sheen_color: [0.0; 3].into(),
            sheen_roughness: 0.0.into(),
            iridescence: 0.0.into(),
            iridescence_ior: 1.3,
            iridescence_thickness: [100.0, 400.0],
            iridescence_thickness_texture: None,
            anisotropy: 0.0.into(),
            anisotropy_rotation: 0.0,
            diffuse_transmission: 0.0.into(),
            diffuse_transmission_color: [1.0; 3].into(),
        }
    }
}

impl Principled {
    /// Returns every texture that the material uses.
    pub fn texture_slots_mut(&mut self) -> impl Iterator<Item = &mut TextureSlot> {
        let slots = [
            &mut self.metallic.texture,
            &mut self.roughness.texture,
            &mut self.specular.texture,
            &mut self.specular_color.texture,
            &mut self.transmission.texture,
            &mut self.thickness.texture,
            &mut self.clearcoat.texture,
            &mut self.clearcoat_roughness.texture,
            &mut self.sheen_color.texture,
            &mut self.sheen_roughness.texture,
            &mut self.iridescence.texture,
            &mut self.iridescence_thickness_texture,
            &mut self.anisotropy.texture,
            &mut self.diffuse_transmission.texture,
            &mut self.diffuse_transmission_color.texture,
        ];
        let normal = self.clearcoat_normal.as_mut().map(|normal| &mut normal.texture);
        slots.into_iter().flatten().chain(normal)
    }

    /// Checks the material's values.
    ///
    /// # Errors
    /// [`SceneError::World`] for a value that is not finite or outside its range.
    pub fn validate(&self) -> Result<()> {
        let check = |name: &str, value: f32, good: bool, expected: &str| {
            if good { Ok(()) } else { Err(SceneError::material(format!("{name} is {value}; expected {expected}"))) }
        };
        for (name, value) in [
            ("metallic", self.metallic.value),
            ("roughness", self.roughness.value),
            ("specular", self.specular.value),
            ("transmission", self.transmission.value),
            ("clearcoat", self.clearcoat.value),
            ("clearcoat_roughness", self.clearcoat_roughness.value),
            ("sheen_roughness", self.sheen_roughness.value),
            ("iridescence", self.iridescence.value),
            ("anisotropy", self.anisotropy.value),
            ("diffuse_transmission", self.diffuse_transmission.value),
        ] {
            check(name, value, (0.0..=1.0).contains(&value), "0 to 1")?;
        }
        for (name, color) in [
            ("attenuation_color", self.attenuation_color),
            ("sheen_color", self.sheen_color.value),
            ("diffuse_transmission_color", self.diffuse_transmission_color.value),
        ] {
            for value in color {
                check(name, value, (0.0..=1.0).contains(&value), "0 to 1")?;
            }
        }
        let [thinnest, thickest] = self.iridescence_thickness;
        for (name, value) in [
            ("specular_color", self.specular_color.value[0]),
            ("specular_color", self.specular_color.value[1]),
            ("specular_color", self.specular_color.value[2]),
            ("thickness", self.thickness.value),
            ("dispersion", self.dispersion),
            ("iridescence_thickness", thinnest),
            ("iridescence_thickness", thickest),
        ] {
            check(name, value, value.is_finite() && value >= 0.0, "a finite number >= 0")?;
        }
        for (name, ior) in [("ior", self.ior), ("iridescence_ior", self.iridescence_ior)] {
            check(name, ior, ior.is_finite() && (ior >= 1.0 || ior == 0.0), "a finite number >= 1, or 0")?;
        }
        let distance = self.attenuation_distance;
        check("attenuation_distance", distance, distance > 0.0, "a number > 0, or infinity")?;
        let rotation = self.anisotropy_rotation;
        check("anisotropy_rotation", rotation, rotation.is_finite(), "a finite number")
    }
}
