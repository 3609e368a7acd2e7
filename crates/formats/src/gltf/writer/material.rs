//! Materials: metallic-roughness with the required extensions.

use std::sync::Arc;

use raycam_scene::{
    Alpha, HeightMap, HeightUnit, Image, Material, NormalMap, NoticeCode, Principled, Texels, TextureSlot, Textured,
};
use serde_json::{Map, Value, json};

use crate::error::Result;
use crate::gltf::writer::document::Writer;
use crate::gltf::writer::light::color_and_strength;
use crate::gltf::writer::number::{shortest_f32, shortest_f32s};
use crate::image::normals_from_height::normals_from_height;
use raycam_scene::ColorUse::{self, Color, Data};

type Object = Map<String, Value>;

impl Writer<'_> {
    /// JSON of a material.
    pub(super) fn material(&mut self, material: &Material) -> Result<Value> {
        let mut json = Object::new();
        if !material.name.is_empty() {
            json.insert("name".into(), json!(material.name));
        }
        if material.double_sided {
            json.insert("doubleSided".into(), json!(true));
        }
        match material.alpha {
            Alpha::Opaque => {}
            Alpha::Blend => {
                json.insert("alphaMode".into(), json!("BLEND"));
            }
            Alpha::Mask { cutoff } => {
                json.insert("alphaMode".into(), json!("MASK"));
                factor(&mut json, "alphaCutoff", cutoff, 0.5);
            }
        }
        let (color, principled) = self.gltf_material(material);
        let mut pbr = Object::new();
        let [r, g, b] = color;
        let base = [r, g, b, material.opacity];
        if base != [1.0; 4] {
            pbr.insert("baseColorFactor".into(), shortest_f32s(&base));
        }
        self.texture(&mut pbr, "baseColorTexture", material.texture, Color)?;
        match &principled {
            Some(principled) => {
                factor(&mut pbr, "metallicFactor", principled.metallic.value, 1.0);
                factor(&mut pbr, "roughnessFactor", principled.roughness.value, 1.0);
                self.metallic_roughness(&mut pbr, &material.name, principled)?;
            }
            // A fallback value that the extension recommends for readers that do not support the extension.
            None => {
                pbr.insert("metallicFactor".into(), json!(0));
                pbr.insert("roughnessFactor".into(), json!(0.9));
            }
        }
        if !pbr.is_empty() {
            json.insert("pbrMetallicRoughness".into(), pbr.into());
        }
        let Some(principled) = principled else {
            self.extend(&mut json, "KHR_materials_unlit", json!({}));
            return Ok(json.into());
        };
        let Textured { value, texture } = material.emission;
        let (emission, strength) = match value.iter().all(|&v| v <= 1.0) {
            true => (value, 1.0),
            false => color_and_strength(value),
        };
        color3(&mut json, "emissiveFactor", emission, 0.0);
        self.texture(&mut json, "emissiveTexture", texture, Color)?;
        if strength != 1.0 {
            let extension = json!({ "emissiveStrength": shortest_f32(strength) });
            self.extend(&mut json, "KHR_materials_emissive_strength", extension);
        }
        self.normal_map(&mut json, "normalTexture", material.normal_map)?;
        if let (None, Some(map)) = (material.normal_map, &material.height_map)
            && map.unit == HeightUnit::Texel
        {
            self.normals_of_heights(&mut json, "normalTexture", map)?;
        }
        if let Some(Textured { value, texture: Some(slot) }) = &material.occlusion {
            let mut info = self.texture_info(slot, Data)?;
            factor(&mut info, "strength", *value, 1.0);
            json.insert("occlusionTexture".into(), info.into());
        }
        for (name, extension) in self.extensions_of(&principled)? {
            if !extension.is_empty() {
                self.extend(&mut json, name, extension.into());
            }
        }
        Ok(json.into())
    }

    /// All extensions, with the values that differ from their defaults.
    fn extensions_of(&mut self, p: &Principled) -> Result<Vec<(&'static str, Object)>> {
        let mut all = Vec::new();
        let mut json = Object::new();
        factor(&mut json, "ior", p.ior, 1.5);
        all.push(("KHR_materials_ior", json));

        let mut json = Object::new();
        self.textured(&mut json, "specular", p.specular, 1.0, Color)?;
        color3(&mut json, "specularColorFactor", p.specular_color.value, 1.0);
        let texture = p.specular_color.texture;
        self.texture(&mut json, "specularColorTexture", texture, Color)?;
        all.push(("KHR_materials_specular", json));

        let mut json = Object::new();
        self.textured(&mut json, "transmission", p.transmission, 0.0, Data)?;
        all.push(("KHR_materials_transmission", json));

        let mut json = Object::new();
        self.textured(&mut json, "thickness", p.thickness, 0.0, Data)?;
        color3(&mut json, "attenuationColor", p.attenuation_color, 1.0);
        if p.attenuation_distance.is_finite() {
            let distance = json!(shortest_f32(p.attenuation_distance));
            json.insert("attenuationDistance".into(), distance);
        }
        // The dispersion extension requires the volume extension.
        let volume = all.len();
        all.push(("KHR_materials_volume", json));

        let mut json = Object::new();
        factor(&mut json, "dispersion", p.dispersion, 0.0);
        if !json.is_empty() && all[volume].1.is_empty() {
            all[volume].1.insert("thicknessFactor".into(), json!(0));
        }
        all.push(("KHR_materials_dispersion", json));

        self.coating_extensions(p, &mut all)?;
        Ok(all)
    }

    /// Adds the extensions of layers on top of the base, and of scattering.
    fn coating_extensions(&mut self, p: &Principled, all: &mut Vec<(&'static str, Object)>) -> Result<()> {
        let mut json = Object::new();
        self.textured(&mut json, "clearcoat", p.clearcoat, 0.0, Data)?;
        let roughness = p.clearcoat_roughness;
        self.textured(&mut json, "clearcoatRoughness", roughness, 0.0, Data)?;
        self.normal_map(&mut json, "clearcoatNormalTexture", p.clearcoat_normal)?;
        all.push(("KHR_materials_clearcoat", json));

        let mut json = Object::new();
        color3(&mut json, "sheenColorFactor", p.sheen_color.value, 0.0);
        self.texture(&mut json, "sheenColorTexture", p.sheen_color.texture, Color)?;
        self.textured(&mut json, "sheenRoughness", p.sheen_roughness, 0.0, Color)?;
        all.push(("KHR_materials_sheen", json));

        let mut json = Object::new();
        self.textured(&mut json, "iridescence", p.iridescence, 0.0, Data)?;
        factor(&mut json, "iridescenceIor", p.iridescence_ior, 1.3);
        let [thinnest, thickest] = p.iridescence_thickness;
        factor(&mut json, "iridescenceThicknessMinimum", thinnest, 100.0);
        factor(&mut json, "iridescenceThicknessMaximum", thickest, 400.0);
        let texture = p.iridescence_thickness_texture;
        self.texture(&mut json, "iridescenceThicknessTexture", texture, Data)?;
        all.push(("KHR_materials_iridescence", json));

        let mut json = Object::new();
        factor(&mut json, "anisotropyStrength", p.anisotropy.value, 0.0);
        factor(&mut json, "anisotropyRotation", p.anisotropy_rotation, 0.0);
        self.texture(&mut json, "anisotropyTexture", p.anisotropy.texture, Data)?;
        all.push(("KHR_materials_anisotropy", json));

        let mut json = Object::new();
        let share = p.diffuse_transmission;
        self.textured(&mut json, "diffuseTransmission", share, 0.0, Color)?;
        let color = p.diffuse_transmission_color;
        color3(&mut json, "diffuseTransmissionColorFactor", color.value, 1.0);
        let key = "diffuseTransmissionColorTexture";
        self.texture(&mut json, key, color.texture, Color)?;
        all.push(("KHR_materials_diffuse_transmission", json));
        Ok(())
    }

    fn texture(&mut self, json: &mut Object, key: &str, slot: Option<TextureSlot>, color_use: ColorUse) -> Result<()> {
        if let Some(slot) = &slot {
            let info = self.texture_info(slot, color_use)?;
            json.insert(key.into(), info.into());
        }
        Ok(())
    }

    /// Writes the factor and the texture of a property; their keys are `key` followed by `Factor` and
    /// `Texture`.
    fn textured(
        &mut self,
        json: &mut Object,
        key: &str,
        of: Textured<f32>,
        default: f32,
        color_use: ColorUse,
    ) -> Result<()> {
        factor(json, &format!("{key}Factor"), of.value, default);
        self.texture(json, &format!("{key}Texture"), of.texture, color_use)
    }

    fn normal_map(&mut self, json: &mut Object, key: &str, normal: Option<NormalMap>) -> Result<()> {
        if let Some(NormalMap { texture, scale }) = &normal {
            let mut info = self.texture_info(texture, Data)?;
            factor(&mut info, "scale", *scale, 1.0);
            json.insert(key.into(), info.into());
        }
        Ok(())
    }

    /// Writes a normal map that represents the slopes of a height map. Heights are in units of a texel.
    fn normals_of_heights(&mut self, json: &mut Object, key: &str, map: &HeightMap) -> Result<()> {
        let world = self.world;
        let heights = &world.textures[map.texture.texture];
        let normals = Arc::new(normals_from_height(heights)?);
        self.textures.generated.push(normals.clone());
        let mut info = self.image_info(&normals, heights.sampler, &map.texture, Data)?;
        factor(&mut info, "scale", map.scale, 1.0);
        json.insert(key.into(), info.into());
        Ok(())
    }

    /// Writes one texture for metalness (blue) and roughness (green). If these are in two textures, a new texture is
    /// composed.
    fn metallic_roughness(&mut self, json: &mut Object, name: &str, principled: &Principled) -> Result<()> {
        const KEY: &str = "metallicRoughnessTexture";
        let (metallic, roughness) = (principled.metallic, principled.roughness);
        let (m, r) = (metallic.texture, roughness.texture);
        let slot = match (m, r) {
            (None, None) => return Ok(()),
            (m, r) if m == r => return self.texture(json, KEY, m, Data),
            // The other channel of the texture has no effect if its factor is 0.
            (Some(slot), None) if roughness.value == 0.0 => slot,
            (None, Some(slot)) if metallic.value == 0.0 => slot,
            (Some(slot), other) | (None, other @ Some(slot)) => {
                let other = other.filter(|other| {
                    let same = other.uv_set == slot.uv_set && other.image_from_mesh == slot.image_from_mesh;
                    if !same {
                        let message = "roughness and metalness have different texture coordinates, so the roughness \
                            texture is omitted";
                        self.note(NoticeCode::NotWritten, format!("material {name:?}: {message}"));
                    }
                    same
                });
                let (m, r) = if m.is_some() { (m, other) } else { (None, r) };
                return self.pack_metallic_roughness(json, KEY, [r, m], slot);
            }
        };
        self.texture(json, KEY, Some(slot), Data)
    }

    /// Composes and writes a texture with the green channel of one image and the blue channel of another; a missing
    /// image counts as 1.
    fn pack_metallic_roughness(
        &mut self,
        json: &mut Object,
        key: &str,
        parts: [Option<TextureSlot>; 2],
        slot: TextureSlot,
    ) -> Result<()> {
        let world = self.world;
        let textures = parts.map(|part| part.map(|part| &world.textures[part.texture]));
        let sizes = textures.iter().flatten().map(|texture| texture.image.size);
        let [width, height] = sizes.fold([1, 1], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        let value = |which: usize, channel: usize, uv: [f32; 2]| {
            let texture = textures[which].as_ref();
            let value = texture.map_or(1.0, |texture| texture.lookup(uv)[channel]);
            (value.clamp(0.0, 1.0) * 65535.0).round() as u16
        };
        let mut texels = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                let uv = [(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32];
                texels.push([0, value(0, 1, uv), value(1, 2, uv), u16::MAX]);
            }
        }
        let image = Arc::new(Image::new("", [width, height], Texels::Linear16(texels)));
        self.textures.generated.push(image.clone());
        let sampler = world.textures[slot.texture].sampler;
        let info = self.image_info(&image, sampler, &slot, Data)?;
        json.insert(key.into(), info.into());
        Ok(())
    }
}

/// Writes a number if it differs from its default.
fn factor(json: &mut Object, key: &str, value: f32, default: f32) {
    if value != default {
        json.insert(key.into(), json!(shortest_f32(value)));
    }
}

/// Writes a colour if any component differs from the default.
fn color3(json: &mut Object, key: &str, value: [f32; 3], default: f32) {
    if value != [default; 3] {
        json.insert(key.into(), shortest_f32s(&value));
    }
}
