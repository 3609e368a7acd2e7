//! Textures: images as PNG in the binary chunk, samplers, and the channels that materials use.

use std::sync::Arc;

use raycam_scene::color::srgb_from_linear;
use raycam_scene::{Image, NoticeCode, TexelFilter, Texels, TextureSampler, TextureSlot, Wrap};
use serde_json::{Map, Value, json};

use crate::encode::png::{self, Samples};
use crate::error::Result;
use crate::gltf::writer::binary::BufferTarget;
use crate::gltf::writer::document::Writer;
use crate::gltf::writer::number::shortest_f32;
use raycam_scene::ColorUse;

impl Writer<'_> {
    /// JSON of a reference to a texture of the world.
    pub(super) fn texture_info(&mut self, slot: &TextureSlot, color_use: ColorUse) -> Result<Map<String, Value>> {
        // A material's textures exist, because the world has been validated.
        let texture = self.world.textures[slot.texture].clone();
        self.image_info(&texture.image, texture.sampler, slot, color_use)
    }

    /// JSON of a reference to an image, with a sampler, and with the transform and set of texture coordinates
    /// of a slot.
    pub(super) fn image_info(
        &mut self,
        image: &Arc<Image>,
        sampler: TextureSampler,
        slot: &TextureSlot,
        color_use: ColorUse,
    ) -> Result<Map<String, Value>> {
        let source = self.image(image, color_use)?;
        let sampler_index = match self.textures.samplers.get(&sampler) {
            Some(&index) => index,
            None => {
                let index = self.push("samplers", sampler_json(&sampler));
                self.textures.samplers.insert(sampler, index);
                index
            }
        };
        let index = match self.textures.textures.get(&(source, sampler)) {
            Some(&index) => index,
            None => {
                let json = json!({ "source": source, "sampler": sampler_index });
                let index = self.push("textures", json);
                self.textures.textures.insert((source, sampler), index);
                index
            }
        };
        let mut info = Map::new();
        info.insert("index".into(), json!(index));
        if slot.uv_set > 0 {
            info.insert("texCoord".into(), json!(slot.uv_set));
        }
        if let Some(transform) = self.transform(slot) {
            self.extend(&mut info, "KHR_texture_transform", transform);
        }
        Ok(info)
    }

    fn image(&mut self, image: &Arc<Image>, color_use: ColorUse) -> Result<usize> {
        let key = (Arc::as_ptr(image), color_use == ColorUse::Color);
        if let Some(&index) = self.textures.images.get(&key) {
            return Ok(index);
        }
        let bytes = self.encoded(image, color_use)?;
        let view = self.binary.view(&bytes, BufferTarget::Other);
        let mut json = json!({ "bufferView": view, "mimeType": "image/png" });
        if !image.name.is_empty() {
            json["name"] = json!(image.name);
        }
        let index = self.push("images", json);
        self.textures.images.insert(key, index);
        Ok(index)
    }

    /// Encodes a PNG: in sRGB for colours, linear for data. 8-bit texels that already have this encoding are written
    /// with 8 bits per channel, all other texels with 16.
    fn encoded(&mut self, image: &Image, color_use: ColorUse) -> Result<Vec<u8>> {
        let texels = image.texels.in_memory()?;
        match (&*texels, color_use) {
            (Texels::Srgb8(texels), ColorUse::Color) | (Texels::Linear8(texels), ColorUse::Data) => {
                let opaque = texels.iter().all(|texel| texel[3] == 255);
                let (bytes, channels) = pack_channels(texels, opaque);
                return png::encode(image.size, channels, Samples::U8(&bytes));
            }
            (Texels::Linear16(texels), ColorUse::Data) => {
                let opaque = texels.iter().all(|texel| texel[3] == u16::MAX);
                let (samples, channels) = pack_channels(texels, opaque);
                return png::encode(image.size, channels, Samples::U16(&samples));
            }
            _ => {}
        }
        let (name, mut outside) = (&image.name, false);
        let mut code = |v: f32| {
            outside |= !(0.0..=1.0).contains(&v);
            (v.clamp(0.0, 1.0) * 65535.0).round() as u16
        };
        let texels: Vec<[u16; 4]> = (0..texels.len())
            .map(|i| {
                let [r, g, b, a] = texels.linear(i);
                let shown = |v: f32| match color_use {
                    ColorUse::Color if (0.0..=1.0).contains(&v) => srgb_from_linear(v),
                    _ => v,
                };
                [code(shown(r)), code(shown(g)), code(shown(b)), code(a)]
            })
            .collect();
        if outside {
            self.note(NoticeCode::ClampedValue, format!("image {name:?}: values outside 0 to 1 are clamped"));
        } else {
            self.note(NoticeCode::ApproximatedValue, format!("image {name:?}: rounded to 16 bits per channel"));
        }
        let opaque = texels.iter().all(|texel| texel[3] == u16::MAX);
        let (samples, channels) = pack_channels(&texels, opaque);
        png::encode(image.size, channels, Samples::U16(&samples))
    }

    /// `KHR_texture_transform` of a slot with a transform: translation * rotation * scale.
    fn transform(&mut self, slot: &TextureSlot) -> Option<Value> {
        let [[a, b, x], [c, d, y]] = slot.image_from_mesh.map(|row| row.map(f64::from));
        if slot.image_from_mesh == TextureSlot::plain(0).image_from_mesh {
            return None;
        }
        // The matrix has the columns width * (cos, -sin) and height * (sin, cos).
        let [mut width, mut height] = [a.hypot(c), b.hypot(d)];
        if a * d - b * c < 0.0 {
            height = -height;
        }
        let rotation = if width > 0.0 { (-c).atan2(a) } else { (b * height.signum()).atan2(d * height.signum()) };
        if (a * b + c * d).abs() > 1e-5 * width * height.abs() {
            let message = "sheared texture coordinates are omitted, because glTF does not support shear";
            self.note(NoticeCode::NotWritten, message);
        }
        let mut rotation = rotation;
        // A rotation by 180 degrees is equal to mirroring both axes; the simpler of both representations is used.
        if (rotation.abs() - std::f64::consts::PI).abs() < 1e-7 {
            (rotation, width, height) = (0.0, -width, -height);
        }
        let rounded = |v: f64| shortest_f32(v as f32);
        let mut json = json!({});
        if [x, y] != [0.0; 2] {
            json["offset"] = json!([rounded(x), rounded(y)]);
        }
        if rotation.abs() > 1e-7 {
            json["rotation"] = json!(rotation);
        }
        if (width - 1.0).abs().max((height - 1.0).abs()) > 1e-7 {
            json["scale"] = json!([rounded(width), rounded(height)]);
        }
        Some(json)
    }
}

/// Values of all channels, or of all channels except alpha if alpha is constantly 1; and the number of channels.
fn pack_channels<T: Copy>(texels: &[[T; 4]], opaque: bool) -> (Vec<T>, usize) {
    match opaque {
        true => (texels.iter().flat_map(|t| [t[0], t[1], t[2]]).collect(), 3),
        false => (texels.as_flattened().to_vec(), 4),
    }
}

fn sampler_json(sampler: &TextureSampler) -> Value {
    use TexelFilter::{Linear, Nearest};
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::Clamp => 33071,
        Wrap::Mirror => 33648,
    };
    let magnification = match sampler.magnification {
        Nearest => 9728,
        Linear => 9729,
    };
    let minification = match (sampler.minification, sampler.mip) {
        (Nearest, None) => 9728,
        (Linear, None) => 9729,
        (Nearest, Some(Nearest)) => 9984,
        (Linear, Some(Nearest)) => 9985,
        (Nearest, Some(Linear)) => 9986,
        (Linear, Some(Linear)) => 9987,
    };
    let [s, t] = sampler.wrap.map(wrap);
    json!({ "magFilter": magnification, "minFilter": minification, "wrapS": s, "wrapT": t })
}
