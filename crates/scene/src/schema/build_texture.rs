//! Conversion of a texture's description to its image and its slot in a material.

use std::sync::Arc;

use crate::counted::counted;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::mesh::Mesh;
use crate::model::AssetLoader;
use crate::notice::{Notice, NoticeCode};
use crate::schema::build_failure::BuildFailure;
use crate::schema::shorthand::{Splat, Wraps};
use crate::schema::spec::object::ObjectSpec;
use crate::schema::spec::texture::{ImageSpec, TextureSpec, TextureTable};
use crate::schema::texture_binding::TextureBinding;
use crate::texture::{ColorUse, Image, TexelFilter, Texels, Texture, TextureSampler, TextureSlot};

/// Keys of textures that contain colours, whose 8-bit values are in sRGB.
const COLORS: [&str; 5] = ["texture", "emission", "specular_color", "sheen_color", "diffuse_transmission_color"];

impl TextureSpec {
    /// Returns the texture (index `next` in the world) and its slot; `wrap` applies if the texture does not specify a
    /// wrap mode. Values that the key does not allow are clamped, with a notice.
    pub(crate) fn read<F: AssetLoader>(
        &self,
        key: &'static str,
        wrap: Option<Wraps>,
        next: usize,
        files: &mut F,
        notices: &mut Vec<Notice>,
    ) -> Result<(Texture, TextureBinding), BuildFailure<F::Error>> {
        let TextureSpec(table) = self;
        let Wraps(wrap) = table.wrap.or(wrap).unwrap_or_default();
        let image = match &table.image {
            ImageSpec::Texels(image) => image.clone(),
            ImageSpec::File(file) => {
                let color_use = if COLORS.contains(&key) { ColorUse::Color } else { ColorUse::Data };
                files.texture(file, wrap, color_use).map_err(|error| BuildFailure::File(key.into(), error))?.image
            }
        };
        let image = table.as_used(key, image)?;
        image.validate()?;
        let image = clamp_to_range(key, image, notices);
        let translucent = key == "texture" && table.channel.is_none() && image.texels.has_alpha();
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
        let rows = [[cos * width, sin * height, x], [-sin * width, cos * height, y]];
        let strength = table.strength.unwrap_or(1.0);
        if !rows.iter().flatten().all(|v| v.is_finite()) {
            let message = "repeat, rotation and offset must be finite numbers";
            return Err(SceneError::schema(ErrorCode::OutOfRange, "", message).into());
        }
        if table.strength.is_some() && !matches!(key, "normal" | "clearcoat_normal" | "occlusion") {
            let message = "applies only to normal and occlusion textures; for other textures, set the material's \
                value instead";
            return Err(SceneError::schema(ErrorCode::ConflictingValues, "strength", message).into());
        }
        if key == "height" && table.filter == TexelFilter::Nearest {
            let message = "\"nearest\" has no slopes; heights require \"linear\"";
            return Err(SceneError::schema(ErrorCode::ConflictingValues, "filter", message).into());
        }
        if !strength.is_finite() || (key == "occlusion" && !(0.0..=1.0).contains(&strength)) {
            let message = format!("{strength}; expected a finite number, 0 to 1 for occlusion");
            return Err(SceneError::schema(ErrorCode::OutOfRange, "strength", message).into());
        }
        let put = TextureBinding {
            key,
            slot: TextureSlot {
                texture: next,
                uv_set: table.uv_set,
                image_from_mesh: rows.map(|row| row.map(|v| v as f32)),
            },
            strength,
            translucent,
        };
        Ok((texture, put))
    }
}

impl TextureTable {
    /// Converts the image to the form in which the material uses it: data becomes linear, and if the description
    /// selects one channel, it replaces all channels.
    fn as_used(&self, key: &str, image: Arc<Image>) -> Result<Arc<Image>> {
        let data = !COLORS.contains(&key) && matches!(image.texels, Texels::Srgb8(_));
        if !data && self.channel.is_none() {
            return Ok(image);
        }
        let mut image = Arc::unwrap_or_clone(image);
        image.texels = image.texels.into_memory()?;
        image.encoded = None;
        if let (true, Texels::Srgb8(texels)) = (data, &mut image.texels) {
            image.texels = Texels::Linear8(std::mem::take(texels));
        }
        if let Some(channel) = self.channel {
            let channel = channel as usize;
            match &mut image.texels {
                Texels::Srgb8(texels) | Texels::Linear8(texels) => splat_channel(texels, channel),
                Texels::Linear16(texels) => splat_channel(texels, channel),
                Texels::Float(texels) => splat_channel(texels, channel),
                Texels::Paged(_) => {} // `Paged` does not occur: the texels are stored in memory above
            }
        }
        Ok(Arc::new(image))
    }
}

/// Returns the image with its values clamped to the key's range: heights have no limits, emission has no upper limit,
/// and all other values are 0 to 1.
fn clamp_to_range(key: &str, image: Arc<Image>, notices: &mut Vec<Notice>) -> Arc<Image> {
    let Texels::Float(texels) = &image.texels else { return image };
    if key == "height" {
        return image;
    }
    let largest = if key == "emission" { f32::MAX } else { 1.0 };
    let is_outside = |value: &&f32| !(0.0..=largest).contains(*value);
    let mut outside = texels.as_flattened().iter().filter(is_outside);
    let Some(first) = outside.next() else { return image };
    let range = if key == "emission" { "0 or more" } else { "0 to 1" };
    let count = 1 + outside.count();
    let name = if image.name.is_empty() { String::new() } else { format!(" {:?}", image.name) };
    let message = format!(
        "values are clamped ({}, for example {first}); expected {range}, as for the same key without a texture",
        counted(count, "value")
    );
    notices.push(Notice::about(NoticeCode::ClampedValue, format!("texture of {key}{name}"), message));
    let texels = texels.iter().map(|texel| texel.map(|value| value.clamp(0.0, largest))).collect();
    Arc::new(Image::new(image.name.clone(), image.size, Texels::Float(texels)))
}

fn splat_channel<T: Copy>(texels: &mut [[T; 4]], channel: usize) {
    for texel in texels {
        *texel = [texel[channel]; 4];
    }
}

/// Textures, their slots in the material, and notices.
type BoundTextures = (Vec<Texture>, Vec<TextureBinding>, Vec<Notice>);

impl ObjectSpec {
    /// Returns the description's images and their slots for a mesh; the first image becomes texture `next` of the
    /// world.
    pub(crate) fn read_textures<F: AssetLoader>(
        &self,
        mesh: &Mesh,
        next: usize,
        files: &mut F,
    ) -> Result<BoundTextures, BuildFailure<F::Error>> {
        let base = self.texture.as_ref().map(|texture| ("texture", &**texture));
        let others = self.textures.as_ref().map(|textures| textures.given());
        let (mut textures, mut puts, mut notices) = (Vec::new(), Vec::new(), Vec::new());
        for (key, texture) in base.into_iter().chain(others.into_iter().flatten()) {
            let path = match key {
                "texture" => String::from(key),
                key => format!("textures.{key}"),
            };
            let set = texture.0.uv_set;
            if mesh.uv_set(set).is_none() {
                let message = match set {
                    0 => "the mesh has no texture coordinates; add \"uvs\", one per vertex".into(),
                    set => format!("uv_set {set}: the mesh has no such set of texture coordinates"),
                };
                return Err(SceneError::schema(ErrorCode::MissingValue, path, message).into());
            }
            let read = texture.read(key, self.wrap, next + textures.len(), files, &mut notices);
            let (texture, put) = read.map_err(|failure| match failure {
                BuildFailure::Scene(error) => BuildFailure::Scene(error.in_context(&path)),
                BuildFailure::File(_, error) => BuildFailure::File(path.clone(), error),
            })?;
            textures.push(texture);
            puts.push(put);
        }
        Ok((textures, puts, notices))
    }
}
