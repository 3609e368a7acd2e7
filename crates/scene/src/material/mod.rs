//! Materials: a base colour, and how the surface reflects it.

pub mod glass;
pub mod height_map;
pub mod metal;
pub mod principled;

use crate::color::Rgb;
use crate::error::{Result, SceneError};
use crate::material::glass::Glass;
use crate::material::height_map::HeightMap;
use crate::material::metal::Metal;
use crate::material::principled::{NormalMap, Principled, Textured};
use crate::medium::Medium;
use crate::mesh::Mesh;
use crate::texture::TextureSlot;

/// The material of a surface. The base colour at a point is the product of `color`, the mesh's face or vertex colour
/// and the texture.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Material {
    /// Name; empty if absent.
    pub name: String,
    /// Linear base colour, each channel 0..=1.
    pub color: Rgb,
    /// The texture that multiplies the base colour; its alpha multiplies `opacity`.
    pub texture: Option<TextureSlot>,
    /// Opacity, 0..=1, multiplied by the texture's and the vertices' alpha; `alpha` specifies how the product is used.
    pub opacity: f32,
    /// Meaning of the opacity.
    pub alpha: Alpha,
    /// True if the back of a triangle is lit like its front; otherwise back faces are culled from the image, as in
    /// glTF.
    pub double_sided: bool,
    /// Emitted radiance, linear, in W/(m² sr). Texture: red, green, blue.
    pub emission: Textured<Rgb>,
    /// Normals with finer detail than the mesh.
    pub normal_map: Option<NormalMap>,
    /// Heights whose slopes bend the shading normals, in addition to a normal map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_map: Option<HeightMap>,
    /// Strength of the ambient occlusion texture, for renderers that do not compute occlusion; texture channel: red.
    pub occlusion: Option<Textured<f32>>,
    /// Diffuse reflectance at a lidar's wavelength, which replaces the base colour for lidars; texture channel: red.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<TextureSlot>,
    /// Priority among overlapping dielectrics: only the body with the highest priority counts; if priorities are equal,
    /// only the inner body counts.
    #[serde(default)]
    pub priority: i32,
    /// Matter inside a closed mesh, instead of the attenuation of a clear material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub medium: Option<Medium>,
    /// Reflection model, to which the base colour is applied.
    pub model: MaterialModel,
}

/// Meaning of a material's opacity (glTF 2.0, 3.9.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Alpha {
    /// Ignored: the surface is fully opaque.
    #[default]
    Opaque,
    /// The surface is opaque where opacity is at least this value, and absent elsewhere.
    Mask {
        /// The cutoff; 0.5 if a file does not specify a cutoff.
        cutoff: f32,
    },
    /// Opacity is the fraction of the surface that is visible; the rest shows what is behind.
    Blend,
}

/// Reflection models.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum MaterialModel {
    /// The lecture's model: a Lambert lobe with the albedo `diffuse * base colour`, and the energy-conserving modified
    /// Phong lobe of Lafortune and Willems (1994) with the albedo `specular` and the exponent `shininess`.
    Phong {
        /// Factor of the diffuse albedo, 0..=1.
        diffuse: f32,
        /// Albedo of the specular lobe, linear, 0..=1 per channel.
        specular: Rgb,
        /// Phong exponent, >= 0.
        shininess: f32,
    },
    /// The base colour itself, independent of light.
    Unlit,
    /// A metal by its index of refraction; the base colour multiplies the reflectance.
    Metal(Metal),
    /// A dielectric.
    Glass(Glass),
    /// glTF's metallic-roughness with its extensions.
    Principled(Box<Principled>),
    /// The border of a medium, which is invisible by itself.
    Boundary,
}

impl MaterialModel {
    /// The default model: purely diffuse.
    pub const DEFAULT: Self = Self::Phong { diffuse: 1.0, specular: [0.0; 3], shininess: 32.0 };

    /// The parameters of the principled material, if the material is principled.
    pub fn as_principled_mut(&mut self) -> Option<&mut Principled> {
        match self {
            Self::Principled(principled) => Some(principled),
            _ => None,
        }
    }

    /// True if the material shows its base colour independently of light.
    pub fn is_unlit(&self) -> bool {
        matches!(self, Self::Unlit)
    }

    /// Checks the material's values.
    ///
    /// # Errors
    /// [`SceneError::World`] for a value that is not finite or outside its range.
    pub fn validate(&self) -> Result<()> {
        match self {
            Self::Unlit | Self::Boundary => Ok(()),
            Self::Metal(metal) => metal.validate(),
            Self::Glass(glass) => glass.validate(),
            Self::Principled(principled) => principled.validate(),
            Self::Phong { diffuse, specular, shininess } => {
                check_fractions("diffuse", &[*diffuse])?;
                check_fractions("specular", specular)?;
                if shininess.is_finite() && *shininess >= 0.0 {
                    return Ok(());
                }
                Err(SceneError::material(format!(
                    "shininess is {shininess}; expected a finite number >= 0, the Phong exponent"
                )))
            }
        }
    }
}

impl Default for Material {
    /// White, opaque, diffuse and double-sided.
    fn default() -> Self {
        Self {
            name: String::new(),
            color: [1.0; 3],
            texture: None,
            opacity: 1.0,
            alpha: Alpha::Opaque,
            double_sided: true,
            emission: [0.0; 3].into(),
            normal_map: None,
            height_map: None,
            occlusion: None,
            reflectance: None,
            priority: 0,
            medium: None,
            model: MaterialModel::DEFAULT,
        }
    }
}

impl Material {
    /// The material of a mesh without materials: white if the mesh has vertex colours, otherwise light grey.
    pub fn for_mesh(mesh: &Mesh) -> Self {
        let colored = mesh.vertex_colors.is_some() || mesh.face_colors.is_some();
        let color = if colored { [1.0; 3] } else { [0.8; 3] };
        Self { color, ..Self::default() }
    }

    /// True if a texture bends the material's shading normals.
    #[inline]
    pub fn bends_normals(&self) -> bool {
        self.normal_map.is_some() || self.height_map.is_some()
    }

    /// Returns every texture that the material uses.
    pub fn texture_slots(&self) -> Vec<TextureSlot> {
        self.clone().texture_slots_mut().map(|slot| *slot).collect()
    }

    /// Returns mutable references to every texture that the material uses.
    pub fn texture_slots_mut(&mut self) -> impl Iterator<Item = &mut TextureSlot> {
        let principled = self.model.as_principled_mut().map(Principled::texture_slots_mut);
        let own = [
            self.texture.as_mut(),
            self.emission.texture.as_mut(),
            self.normal_map.as_mut().map(|normal| &mut normal.texture),
            self.height_map.as_mut().map(|heights| &mut heights.texture),
            self.occlusion.as_mut().and_then(|occlusion| occlusion.texture.as_mut()),
            self.reflectance.as_mut(),
        ];
        own.into_iter().flatten().chain(principled.into_iter().flatten())
    }

    /// Returns the material with `name` as its name, unless it already has a name.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        if self.name.is_empty() {
            self.name = name.into();
        }
        self
    }

    /// Checks the material's values.
    ///
    /// # Errors
    /// [`SceneError::World`] for colours and fractions outside 0..=1, and for a shininess that is negative or not
    /// finite.
    pub fn validate(&self) -> Result<()> {
        check_fractions("color", &self.color)?;
        check_fractions("opacity", &[self.opacity])?;
        if let Alpha::Mask { cutoff } = self.alpha
            && !(cutoff.is_finite() && cutoff >= 0.0)
        {
            return Err(SceneError::material(format!("alpha cutoff is {cutoff}; expected a finite number >= 0")));
        }
        if !self.emission.value.iter().all(|v| v.is_finite() && *v >= 0.0) {
            return Err(SceneError::material(format!(
                "emission is {:?}; expected finite red, green and blue >= 0",
                self.emission.value
            )));
        }
        if let Some(medium) = &self.medium {
            medium.validate().map_err(|error| error.in_context("medium"))?;
        }
        if let Some(heights) = &self.height_map {
            heights.validate()?;
        }
        self.model.validate()
    }

    /// The largest albedo of the three channels, if it exceeds 1.
    pub fn reflectance_above_one(&self) -> Option<f32> {
        let MaterialModel::Phong { diffuse, specular, .. } = self.model else { return None };
        let total = (0..3).map(|i| diffuse * self.color[i] + specular[i]).fold(0.0, f32::max);
        (total > 1.0 + 1e-6).then_some(total)
    }
}

fn check_fractions(name: &str, values: &[f32]) -> Result<()> {
    if values.iter().all(|v| (0.0..=1.0).contains(v)) {
        return Ok(());
    }
    Err(SceneError::material(format!("{name} is {values:?}; expected 0 to 1")))
}
