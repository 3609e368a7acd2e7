//! Textures as people write them: an image, and how it is looked up.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess};

use crate::schema::keys::by_key;
use crate::schema::shorthand::{Splat, Wraps};
use crate::texture::{Image, TexelFilter};
use crate::written::{written, written_schema};

/// An image, and how it is looked up: its file or texels alone, or a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureSpec(pub TextureTable);

/// A texture in full.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TextureTable {
    /// An image file beside the world file, or rows of texels.
    pub image: ImageSpec,
    /// The wrap mode beyond 0..1: "repeat" (where not given), "clamp" or "mirror", or one of them for u and one for v.
    pub wrap: Option<Wraps>,
    /// The filter between texels: "linear" (where not given) or "nearest".
    #[serde(default)]
    pub filter: TexelFilter,
    /// How often it repeats along u and v, one number or two; 1 where not given.
    pub repeat: Option<Splat<2>>,
    /// Degrees by which the coordinates are turned counter-clockwise, as `KHR_texture_transform` has it.
    #[serde(default)]
    pub rotation: f64,
    /// Added to the coordinates at last.
    #[serde(default)]
    pub offset: [f64; 2],
    /// Which of the mesh's sets of texture coordinates.
    #[serde(default)]
    pub uv_set: usize,
    /// The one channel that counts, instead of what glTF says.
    pub channel: Option<TextureChannel>,
    /// Strength of a normal or occlusion texture; 1 where not given.
    pub strength: Option<f32>,
}

/// The channels of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TextureChannel {
    /// The first, and that of grey images.
    Red,
    /// The second.
    Green,
    /// The third.
    Blue,
    /// The last.
    Alpha,
}

/// The source of an image.
#[derive(Clone, Debug, PartialEq)]
pub enum ImageSpec {
    /// A file.
    File(String),
    /// Texels as they are: whole numbers 0 to 255 are 8-bit values, sRGB in colours; numbers with a point are linear.
    Texels(Arc<Image>),
}

/// Textures that multiply a material's values. A value that has a texture and is not given is 1.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TexturesSpec {
    /// Normals of finer detail than the mesh: red, green, blue for x, y, z; `strength` multiplies x and y.
    pub normal: Option<TextureSpec>,
    /// How much indirect light the surroundings let through: red. Integrators that compute it do not look.
    pub occlusion: Option<TextureSpec>,
    /// Emission: red, green, blue.
    pub emission: Option<TextureSpec>,
    /// Blue, as in all these of type "principled" glTF says which channel counts.
    pub metallic: Option<TextureSpec>,
    /// Green.
    pub roughness: Option<TextureSpec>,
    /// Alpha.
    pub specular: Option<TextureSpec>,
    /// Red, green, blue.
    pub specular_color: Option<TextureSpec>,
    /// Red.
    pub transmission: Option<TextureSpec>,
    /// Red.
    pub clearcoat: Option<TextureSpec>,
    /// Green.
    pub clearcoat_roughness: Option<TextureSpec>,
    /// Red, green, blue for x, y, z; `strength` multiplies x and y.
    pub clearcoat_normal: Option<TextureSpec>,
    /// Red, green, blue.
    pub sheen_color: Option<TextureSpec>,
    /// Alpha.
    pub sheen_roughness: Option<TextureSpec>,
    /// Red.
    pub iridescence: Option<TextureSpec>,
    /// Green.
    pub iridescence_thickness: Option<TextureSpec>,
    /// Blue; red and green are the direction, 0 to 1 for -1 to 1.
    pub anisotropy: Option<TextureSpec>,
    /// Alpha.
    pub diffuse_transmission: Option<TextureSpec>,
    /// Red, green, blue.
    pub diffuse_transmission_color: Option<TextureSpec>,
}

impl TexturesSpec {
    pub(crate) fn given(&self) -> Vec<(&'static str, &TextureSpec)> {
        let all = by_key! { self, as_ref:
            normal, occlusion, emission, metallic, roughness, specular, specular_color, transmission,
            clearcoat, clearcoat_roughness, clearcoat_normal, sheen_color, sheen_roughness, iridescence,
            iridescence_thickness, anisotropy, diffuse_transmission, diffuse_transmission_color,
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
