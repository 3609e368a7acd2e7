//! Textures as people write them: an image, and how it is looked up.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};

use crate::error::SceneError;
use crate::mesh::Mesh;
use crate::model::AssetLoader;
use crate::schema::build_world::BuildFailure;
use crate::schema::shorthand::{Splat, Wraps};
use crate::schema::spec::object::ObjectSpec;
use crate::schema::texture_binding::TextureBinding;
use crate::texture::{Image, TexelFilter, Texels, Texture, TextureSampler, TextureSlot};

/// An image, and how it is looked up: its file or texels alone, or a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureSpec(pub TextureTable);

/// A texture in full.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TextureTable {
    /// An image file beside the world file, or rows of texels.
    pub image: ImageSpec,
    /// What it does beyond 0..1: "repeat" (where not given), "clamp" or "mirror", or one of them for u and one for v.
    pub wrap: Option<Wraps>,
    /// What lies between texels: "linear" (where not given) or "nearest".
    #[serde(default)]
    pub filter: TexelFilter,
    /// How often it repeats along u and v, one number or two; 1 where not given.
    pub repeat: Option<Splat<2>>,
    /// Degrees by which the coordinates are turned counter-clockwise, as `KHR_texture_transform` has it.
    #[serde(default)]
    pub rotation: f64,
    /// What is added to the coordinates at last.
    #[serde(default)]
    pub offset: [f64; 2],
    /// Which of the mesh's sets of texture coordinates.
    #[serde(default)]
    pub uv_set: usize,
    /// The one channel that counts, instead of what glTF says.
    pub channel: Option<TextureChannel>,
    /// Of a normal or occlusion texture: how strong it is; 1 where not given.
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

/// Where an image comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum ImageSpec {
    /// A file.
    File(String),
    /// Texels as they are: whole numbers 0..=255 are 8-bit values, sRGB in colours; numbers with a point are linear.
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
    /// What shines: red, green, blue.
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
    /// Blue; red and green are the direction, 0..=1 for -1..=1.
    pub anisotropy: Option<TextureSpec>,
    /// Alpha.
    pub diffuse_transmission: Option<TextureSpec>,
    /// Red, green, blue.
    pub diffuse_transmission_color: Option<TextureSpec>,
}

/// The textures that hold colours, in sRGB where they are 8-bit.
const COLORS: [&str; 5] = [
    "texture",
    "emission",
    "specular_color",
    "sheen_color",
    "diffuse_transmission_color",
];

impl TexturesSpec {
    pub(crate) fn given(&self) -> Vec<(&'static str, &TextureSpec)> {
        let all = [
            ("normal", &self.normal),
            ("occlusion", &self.occlusion),
            ("emission", &self.emission),
            ("metallic", &self.metallic),
            ("roughness", &self.roughness),
            ("specular", &self.specular),
            ("specular_color", &self.specular_color),
            ("transmission", &self.transmission),
            ("clearcoat", &self.clearcoat),
            ("clearcoat_roughness", &self.clearcoat_roughness),
            ("clearcoat_normal", &self.clearcoat_normal),
            ("sheen_color", &self.sheen_color),
            ("sheen_roughness", &self.sheen_roughness),
            ("iridescence", &self.iridescence),
            ("iridescence_thickness", &self.iridescence_thickness),
            ("anisotropy", &self.anisotropy),
            ("diffuse_transmission", &self.diffuse_transmission),
            (
                "diffuse_transmission_color",
                &self.diffuse_transmission_color,
            ),
        ];
        all.into_iter()
            .filter_map(|(key, spec)| Some((key, spec.as_ref()?)))
            .collect()
    }
}

impl TextureSpec {
    /// The texture and its place, as the world's number `next`; `wrap` where it says nothing itself.
    pub(crate) fn read<F: AssetLoader>(
        &self,
        key: &'static str,
        wrap: Option<Wraps>,
        next: usize,
        files: &mut F,
    ) -> Result<(Texture, TextureBinding), BuildFailure<F::Error>> {
        let TextureSpec(table) = self;
        let Wraps(wrap) = table.wrap.or(wrap).unwrap_or_default();
        let image = match &table.image {
            ImageSpec::Texels(image) => image.clone(),
            ImageSpec::File(file) => {
                let texture = files.texture(file, wrap);
                texture
                    .map_err(|error| BuildFailure::File(key.into(), error))?
                    .image
            }
        };
        let image = table.as_used(key, image)?;
        image.validate()?;
        let kept = files.store_texture(image);
        let texture = Texture {
            image: kept.map_err(|error| BuildFailure::File(key.into(), error))?,
            sampler: TextureSampler {
                wrap,
                magnification: table.filter,
                minification: table.filter,
                ..TextureSampler::default()
            },
        };
        let (sin, cos) = table.rotation.to_radians().sin_cos();
        let Splat([width, height]) = table.repeat.unwrap_or(Splat([1.0; 2]));
        let [x, y] = table.offset;
        let rows = [
            [cos * width, sin * height, x],
            [-sin * width, cos * height, y],
        ];
        let strength = table.strength.unwrap_or(1.0);
        if !rows.iter().flatten().all(|v| v.is_finite()) {
            let message = "repeat, rotation and offset: expected finite numbers";
            return Err(SceneError::schema("", message).into());
        }
        if table.strength.is_some() && !matches!(key, "normal" | "clearcoat_normal" | "occlusion") {
            let message = "it goes with normal and occlusion; elsewhere the material's value is it";
            return Err(SceneError::schema("strength", message).into());
        }
        if !strength.is_finite() || (key == "occlusion" && !(0.0..=1.0).contains(&strength)) {
            let message = format!("{strength}: expected a finite number, 0..=1 for occlusion");
            return Err(SceneError::schema("strength", message).into());
        }
        let put = TextureBinding {
            key,
            slot: TextureSlot {
                texture: next,
                uv_set: table.uv_set,
                image_from_mesh: rows.map(|row| row.map(|v| v as f32)),
            },
            strength,
        };
        Ok((texture, put))
    }
}

impl TextureTable {
    /// The image as this use sees it: data is linear, and one channel may stand for all.
    fn as_used(&self, key: &str, image: Arc<Image>) -> Result<Arc<Image>, SceneError> {
        let data = !COLORS.contains(&key) && matches!(image.texels, Texels::Srgb8(_));
        if !data && self.channel.is_none() {
            return Ok(image);
        }
        let mut image = Arc::unwrap_or_clone(image);
        image.texels = image.texels.into_memory()?;
        if let (true, Texels::Srgb8(texels)) = (data, &mut image.texels) {
            image.texels = Texels::Linear8(std::mem::take(texels));
        }
        if let Some(channel) = self.channel {
            let channel = channel as usize;
            match &mut image.texels {
                Texels::Srgb8(texels) | Texels::Linear8(texels) => splat_channel(texels, channel),
                Texels::Linear16(texels) => splat_channel(texels, channel),
                Texels::Float(texels) => splat_channel(texels, channel),
                Texels::Paged(_) => {} // was made another above
            }
        }
        Ok(Arc::new(image))
    }
}

fn splat_channel<T: Copy>(texels: &mut [[T; 4]], channel: usize) {
    for texel in texels {
        *texel = [texel[channel]; 4];
    }
}

impl<'de> Deserialize<'de> for TextureSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TextureVisitor;
        impl<'de> Visitor<'de> for TextureVisitor {
            type Value = TextureSpec;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("an image file, rows of texels, or a table { image, wrap, ... }")
            }

            fn visit_str<E: Error>(self, file: &str) -> Result<TextureSpec, E> {
                Ok(TextureSpec::from_image(ImageSpec::File(file.into())))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, rows: A) -> Result<TextureSpec, A::Error> {
                ImageSpec::deserialize(SeqAccessDeserializer::new(rows))
                    .map(TextureSpec::from_image)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TextureSpec, A::Error> {
                TextureTable::deserialize(MapAccessDeserializer::new(map)).map(TextureSpec)
            }
        }
        deserializer.deserialize_any(TextureVisitor)
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

impl JsonSchema for TextureSpec {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Texture".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let image = generator.subschema_for::<ImageSpec>();
        let table = generator.subschema_for::<TextureTable>();
        schemars::json_schema!({ "anyOf": [image, table] })
    }
}

/// Images, and where they go.
type BoundTextures = (Vec<Texture>, Vec<TextureBinding>);

impl ObjectSpec {
    /// Its images and where they go, for a mesh; the first will be the world's texture `next`.
    pub(crate) fn read_textures<F: AssetLoader>(
        &self,
        mesh: &Mesh,
        next: usize,
        files: &mut F,
    ) -> Result<BoundTextures, BuildFailure<F::Error>> {
        let base = self.texture.as_ref().map(|texture| ("texture", &**texture));
        let others = self.textures.as_ref().map(|textures| textures.given());
        let (mut textures, mut puts) = (Vec::new(), Vec::new());
        for (key, texture) in base.into_iter().chain(others.into_iter().flatten()) {
            let path = match key {
                "texture" => String::from(key),
                key => format!("textures.{key}"),
            };
            let set = texture.0.uv_set;
            if mesh.uv_set(set).is_none() {
                let message = match set {
                    0 => "the mesh has no texture coordinates: give \"uvs\", one for each vertex"
                        .into(),
                    set => format!("uv_set {set}: the mesh has no such texture coordinates"),
                };
                return Err(SceneError::schema(path, message).into());
            }
            let read = texture.read(key, self.wrap, next + textures.len(), files);
            let (texture, put) = read.map_err(|failure| match failure {
                BuildFailure::Scene(error) => BuildFailure::Scene(error.in_context(&path)),
                BuildFailure::File(_, error) => BuildFailure::File(path.clone(), error),
            })?;
            textures.push(texture);
            puts.push(put);
        }
        Ok((textures, puts))
    }
}
