//! Textures in descriptions: an image and its lookup options.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess};

use crate::schema::keys::by_key;
use crate::schema::shorthand::{Splat, Wraps};
use crate::texture::{Image, TexelFilter};
use crate::written::{written, written_schema};

/// An image and its lookup options: a file, texels, or a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureSpec(pub TextureTable);

/// A texture as a table.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TextureTable {
    /// An image file in the world file's folder or below, or rows of texels.
    pub image: ImageSpec,
    /// Wrap mode outside 0..1: "repeat" (default), "clamp" or "mirror", or a list of one for u and one for v.
    pub wrap: Option<Wraps>,
    /// The filter between texels: "linear" (default) or "nearest".
    #[serde(default)]
    pub filter: TexelFilter,
    /// Number of repetitions along u and v, one number or two; default 1.
    pub repeat: Option<Splat<2>>,
    /// Counter-clockwise rotation of the coordinates in degrees, as in `KHR_texture_transform`.
    #[serde(default)]
    pub rotation: f64,
    /// Offset that is added to the coordinates last.
    #[serde(default)]
    pub offset: [f64; 2],
    /// Index of the mesh's set of texture coordinates.
    #[serde(default)]
    pub uv_set: usize,
    /// The one channel that is used, instead of the channel specified by glTF.
    pub channel: Option<TextureChannel>,
    /// Strength of a normal or occlusion texture; default 1.
    pub strength: Option<f32>,
}

/// Channels of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TextureChannel {
    /// The first channel, which is the only channel of grey images.
    Red,
    /// The second channel.
    Green,
    /// The third channel.
    Blue,
    /// The last channel.
    Alpha,
}

/// Source of an image.
#[derive(Clone, Debug, PartialEq)]
pub enum ImageSpec {
    /// A file.
    File(String),
    /// Texels: whole numbers 0 to 255 are 8-bit values (sRGB for colours); numbers with a decimal point are linear.
    Texels(Arc<Image>),
}

/// Textures that multiply a material's values. If a value has a texture and is not given itself, the value is 1.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TexturesSpec {
    /// Normals with finer detail than the mesh: red, green, blue for x, y, z; `strength` multiplies x and y.
    pub normal: Option<TextureSpec>,
    /// Heights above the mesh, positive or negative: red. `height_scale` is the height of the value 1 in metres. The
    /// slopes of the heights bend the shading normals, or the surface itself moves: see `displace`.
    pub height: Option<TextureSpec>,
    /// Fraction of indirect light that reaches the surface: red. Integrators that compute occlusion ignore it.
    pub occlusion: Option<TextureSpec>,
    /// Diffuse reflectance at a lidar's wavelength, 0 to 1, in the red channel. For lidars, it replaces the material's
    /// colour. The object's `lidar.reflectance`, if given, multiplies it.
    pub reflectance: Option<TextureSpec>,
    /// Emission: red, green, blue.
    pub emission: Option<TextureSpec>,
    /// Metalness: blue. This and all following textures belong to type = "principled"; their channels are those of
    /// glTF.
    pub metallic: Option<TextureSpec>,
    /// Roughness: green.
    pub roughness: Option<TextureSpec>,
    /// Strength of the dielectric's reflection: alpha.
    pub specular: Option<TextureSpec>,
    /// Colour of the dielectric's reflection: red, green, blue.
    pub specular_color: Option<TextureSpec>,
    /// Fraction of light that is transmitted: red.
    pub transmission: Option<TextureSpec>,
    /// Strength of the clear coat: red.
    pub clearcoat: Option<TextureSpec>,
    /// Roughness of the clear coat: green.
    pub clearcoat_roughness: Option<TextureSpec>,
    /// Normals of the clear coat: red, green, blue for x, y, z; `strength` multiplies x and y.
    pub clearcoat_normal: Option<TextureSpec>,
    /// Colour of the sheen: red, green, blue.
    pub sheen_color: Option<TextureSpec>,
    /// Roughness of the sheen: alpha.
    pub sheen_roughness: Option<TextureSpec>,
    /// Strength of the thin film: red.
    pub iridescence: Option<TextureSpec>,
    /// Thickness of the thin film: green.
    pub iridescence_thickness: Option<TextureSpec>,
    /// Strength of the anisotropy: blue; red and green are its direction, 0 to 1 for -1 to 1.
    pub anisotropy: Option<TextureSpec>,
    /// Fraction of diffuse light that is transmitted: alpha.
    pub diffuse_transmission: Option<TextureSpec>,
    /// Colour of diffusely transmitted light: red, green, blue.
    pub diffuse_transmission_color: Option<TextureSpec>,
}

impl TexturesSpec {
    pub(crate) fn given(&self) -> Vec<(&'static str, &TextureSpec)> {
        let all = by_key! { self, as_ref:
            normal, occlusion, reflectance, emission, metallic, roughness, specular, specular_color, transmission,
            clearcoat, clearcoat_roughness, clearcoat_normal, sheen_color, sheen_roughness, iridescence,
            iridescence_thickness, anisotropy, diffuse_transmission, diffuse_transmission_color, height,
        };
        all.into_iter().filter_map(|(key, spec)| Some((key, spec?))).collect()
    }
}

written! {
    TextureSpec: "an image file, rows of texels, or a table { image, wrap, ... }",

    fn visit_str<E: Error>(self, file: &str) -> Result<TextureSpec, E> {
        Ok(TextureSpec::from_image(ImageSpec::File(file.into())))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, rows: A) -> Result<TextureSpec, A::Error> {
        ImageSpec::deserialize(SeqAccessDeserializer::new(rows)).map(TextureSpec::from_image)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TextureSpec, A::Error> {
        TextureTable::deserialize(MapAccessDeserializer::new(map)).map(TextureSpec)
    }
}

impl TextureSpec {
    fn from_image(image: ImageSpec) -> Self {
        Self(TextureTable {
            image,
            wrap: None,
            filter: TexelFilter::default(),
            repeat: None,
            rotation: 0.0,
            offset: [0.0; 2],
            uv_set: 0,
            channel: None,
            strength: None,
        })
    }
}

written_schema!(TextureSpec, "Texture", |generator| {
    let image = generator.subschema_for::<ImageSpec>();
    let table = generator.subschema_for::<TextureTable>();
    schemars::json_schema!({ "anyOf": [image, table] })
});
