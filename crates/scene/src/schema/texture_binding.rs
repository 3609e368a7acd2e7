//! Assignment of a description's textures to the slots of a material.

use crate::material::height_map::{HeightMap, HeightUnit};
use crate::material::principled::{NormalMap, Textured};
use crate::material::{Material, MaterialModel};
use crate::texture::TextureSlot;

/// Slot of a texture in a material.
pub(crate) struct TextureBinding {
    /// Key of the value that the texture multiplies; "texture" for the base colour.
    pub key: &'static str,
    pub slot: TextureSlot,
    pub strength: f32,
    /// True if this is the base colour's texture and has alpha.
    pub translucent: bool,
}

impl TextureBinding {
    /// Assigns the texture to its slot; false if the material has no such slot. If `plain`, the value that the
    /// texture multiplies becomes 1.
    pub(crate) fn bind(&self, material: &mut Material, plain: bool) -> bool {
        let slot = Some(self.slot);
        let normal = Some(NormalMap { texture: self.slot, scale: self.strength });
        match self.key {
            "texture" => material.texture = slot,
            "normal" => material.normal_map = normal,
            "height" => {
                material.height_map = Some(HeightMap { texture: self.slot, scale: 1.0, unit: HeightUnit::Metre })
            }
            "occlusion" => {
                let mut occlusion = Textured::from(self.strength);
                occlusion.texture = slot;
                material.occlusion = Some(occlusion);
            }
            "reflectance" => material.reflectance = slot,
            "emission" => {
                material.emission.texture = slot;
                if plain {
                    material.emission.value = [1.0; 3];
                }
            }
            _ => return self.bind_principled(&mut material.model, plain),
        }
        true
    }

    fn bind_principled(&self, model: &mut MaterialModel, plain: bool) -> bool {
        let Some(p) = model.as_principled_mut() else { return false };
        let slot = Some(self.slot);
        let number = match self.key {
            "metallic" => &mut p.metallic,
            "roughness" => &mut p.roughness,
            "specular" => &mut p.specular,
            "transmission" => &mut p.transmission,
            "clearcoat" => &mut p.clearcoat,
            "clearcoat_roughness" => &mut p.clearcoat_roughness,
            "sheen_roughness" => &mut p.sheen_roughness,
            "iridescence" => &mut p.iridescence,
            "anisotropy" => &mut p.anisotropy,
            "diffuse_transmission" => &mut p.diffuse_transmission,
            "clearcoat_normal" => {
                p.clearcoat_normal = Some(NormalMap { texture: self.slot, scale: self.strength });
                return true;
            }
            "iridescence_thickness" => {
                p.iridescence_thickness[0] = 0.0;
                p.iridescence_thickness_texture = slot;
                return true;
            }
            key => {
                let color = match key {
                    "specular_color" => &mut p.specular_color,
                    "sheen_color" => &mut p.sheen_color,
                    _ => &mut p.diffuse_transmission_color,
                };
                color.texture = slot;
                if plain {
                    color.value = [1.0; 3];
                }
                return true;
            }
        };
        number.texture = slot;
        if plain {
            number.value = 1.0;
        }
        true
    }
}
