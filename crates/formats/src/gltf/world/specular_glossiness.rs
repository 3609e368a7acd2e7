//! `KHR_materials_pbrSpecularGlossiness`, archived but still in use, as a principled material.
//!
//! `KHR_materials_ior` describes the conversion: a dielectric of infinite index of refraction (written as 0) reflects
//! exactly its specular colour at normal incidence. No equation has to be solved, and textures are unchanged. Only
//! roughness, which is one minus glossiness, requires a new texture.

use std::sync::Arc;

use raycam_scene::{Image, Material, Principled, Texels, Texture, TextureSlot, Textured};

use crate::error::Result;
use crate::gltf::json::material::SpecularGlossiness;
use crate::gltf::world::builder::Builder;
use raycam_scene::ColorUse::Color;

impl Builder<'_, '_> {
    pub(crate) fn specular_glossiness(
        &mut self,
        place: &str,
        json: &SpecularGlossiness,
        material: &mut Material,
        principled: &mut Principled,
    ) -> Result<()> {
        let share = [0.0, 1.0];
        let at = |key: &str| format!("{place}.extensions.KHR_materials_pbrSpecularGlossiness.{key}");
        let diffuse = json.diffuse_factor.unwrap_or([1.0; 4]);
        let [r, g, b, a] = self.numbers(&at("diffuseFactor"), diffuse, share);
        (material.color, material.opacity) = ([r, g, b], a);
        material.texture = self.slot(&at("diffuseTexture"), &json.diffuse_texture, Color)?;
        let texture = self.slot(&at("specularGlossinessTexture"), &json.specular_glossiness_texture, Color)?;
        let specular = json.specular_factor.unwrap_or([1.0; 3]);
        principled.metallic = 0.0.into();
        principled.ior = 0.0;
        principled.specular_color = Textured { value: self.numbers(&at("specularFactor"), specular, share), texture };
        let glossiness = json.glossiness_factor.unwrap_or(1.0);
        let glossiness = self.number(&at("glossinessFactor"), glossiness, share);
        principled.roughness = match texture {
            Some(slot) => Textured { value: 1.0, texture: Some(self.roughness(slot, glossiness)?) },
            None => (1.0 - glossiness).into(),
        };
        Ok(())
    }

    /// Roughness texture from the glossiness in another texture's alpha.
    fn roughness(&mut self, slot: TextureSlot, factor: f32) -> Result<TextureSlot> {
        let Texture { image, sampler } = &*self.world.textures[slot.texture];
        let rough = |glossiness: f32| {
            let v = (65535.0 * (1.0 - factor * glossiness)).round() as u16;
            [v, v, v, u16::MAX]
        };
        let texels = image.texels.in_memory()?;
        let texels = (0..texels.len()).map(|i| rough(texels.linear(i)[3])).collect();
        let image = Image::new(format!("{} (roughness)", image.name), image.size, Texels::Linear16(texels));
        let texture = Texture { image: self.assets.store_texture(Arc::new(image))?, sampler: *sampler };
        Ok(TextureSlot { texture: self.world.add_texture(texture), ..slot })
    }
}
