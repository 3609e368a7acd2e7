//! Materials: metallic-roughness and the extensions that add to it.

use raycam_scene::material::principled::{NormalMap, Principled, Textured};
use raycam_scene::material::{Alpha, Material, MaterialModel};
use raycam_scene::texture::TextureSlot;

use crate::error::Result;
use crate::gltf::json::material::{self as json, Extensions};
use crate::gltf::json::texture_info::TextureInfo;
use crate::gltf::world::builder::Builder;
use crate::image::decoder::ColorUse::{self, Color, Data};

/// Any number that is not negative.
pub(crate) const NON_NEGATIVE: [f64; 2] = [0.0, f32::MAX as f64];
const UNIT_INTERVAL: [f64; 2] = [0.0, 1.0];

impl Builder<'_, '_> {
    /// All materials, with those of the document first and in its order; then the one of those that have none.
    pub(crate) fn materials(&mut self) -> Result<()> {
        let document = self.document;
        for (i, json) in document.root.materials.iter().enumerate() {
            let place = format!("materials[{i}]");
            let material = self.material(&place, json)?;
            let added = self.world.add_material(material);
            added.map_err(|error| document.scene(&place, error))?;
        }
        Ok(())
    }

    /// The index in the world of a material of the document, or of glTF's own for those that have none.
    pub(crate) fn material_index(&mut self, place: &str, index: Option<usize>) -> Result<usize> {
        let document = self.document;
        let count = document.root.materials.len();
        match index {
            Some(index) if index < count => Ok(index),
            Some(index) => Err(document.unresolved(&format!("{place}.material"), index, count)),
            None if self.world.materials.len() > count => Ok(count),
            None => {
                let material = Material {
                    double_sided: false,
                    model: MaterialModel::Principled(Box::default()),
                    ..Material::default()
                };
                let added = self.world.add_material(material);
                added.map_err(|error| document.scene(place, error))
            }
        }
    }

    fn material(&mut self, place: &str, json: &json::Material) -> Result<Material> {
        let pbr = &json.pbr_metallic_roughness;
        let at = |key: &str| format!("{place}.{key}");
        let pbr_at = |key: &str| format!("{place}.pbrMetallicRoughness.{key}");
        let extensions = &json.extensions;
        let mut material = Material {
            name: json.name.clone(),
            double_sided: json.double_sided,
            alpha: self.alpha(place, json)?,
            ..Material::default()
        };
        let mut principled = Principled::default();
        if let Some(old) = &extensions.specular_glossiness {
            self.specular_glossiness(place, old, &mut material, &mut principled)?;
        } else {
            let factor = pbr.base_color_factor.unwrap_or([1.0; 4]);
            let [r, g, b, a] = self.numbers(&pbr_at("baseColorFactor"), factor, UNIT_INTERVAL);
            (material.color, material.opacity) = ([r, g, b], a);
            let info = pbr.base_color_texture.as_ref();
            material.texture = self.slot(&pbr_at("baseColorTexture"), info, Color)?;
            let info = pbr.metallic_roughness_texture.as_ref();
            let texture = self.slot(&pbr_at("metallicRoughnessTexture"), info, Data)?;
            let (metallic, roughness) = (pbr.metallic_factor, pbr.roughness_factor);
            let metallic = metallic.unwrap_or(1.0);
            let value = self.number(&pbr_at("metallicFactor"), metallic, UNIT_INTERVAL);
            principled.metallic = Textured { value, texture };
            let roughness = roughness.unwrap_or(1.0);
            let value = self.number(&pbr_at("roughnessFactor"), roughness, UNIT_INTERVAL);
            principled.roughness = Textured { value, texture };
        }
        if extensions.unlit.is_some() {
            material.model = MaterialModel::Unlit;
            return Ok(material);
        }
        let strength = extensions.emissive_strength.as_ref();
        let strength = strength.and_then(|e| e.emissive_strength).unwrap_or(1.0);
        let strength_at = at("extensions.KHR_materials_emissive_strength.emissiveStrength");
        let strength = self.number(&strength_at, strength, NON_NEGATIVE);
        let emission = self.numbers(&at("emissiveFactor"), json.emissive_factor, UNIT_INTERVAL);
        material.emission = Textured {
            value: emission.map(|v| v * strength),
            texture: self.slot(&at("emissiveTexture"), json.emissive_texture.as_ref(), Color)?,
        };
        let normal = json.normal_texture.as_ref();
        material.normal_map = self.normal_map(&at("normalTexture"), normal)?;
        if let Some(info) = &json.occlusion_texture {
            let place = at("occlusionTexture");
            let strength = info.strength.unwrap_or(1.0);
            material.occlusion = Some(Textured {
                value: self.number(&format!("{place}.strength"), strength, UNIT_INTERVAL),
                texture: self.slot(&place, Some(info), Data)?,
            });
        }
        self.read_extensions(&at("extensions"), extensions, &mut principled)?;
        material.model = MaterialModel::Principled(Box::new(principled));
        Ok(material)
    }

    fn alpha(&mut self, place: &str, json: &json::Material) -> Result<Alpha> {
        Ok(match json.alpha_mode.as_deref() {
            None | Some("OPAQUE") => Alpha::Opaque,
            Some("BLEND") => Alpha::Blend,
            Some("MASK") => Alpha::Mask {
                cutoff: self.number(&format!("{place}.alphaCutoff"), json.alpha_cutoff.unwrap_or(0.5), NON_NEGATIVE),
            },
            Some(mode) => {
                return Err(self.document.fault(format!(
                    "{place}.alphaMode: {mode:?}, expected OPAQUE, MASK or BLEND (VALUE_NOT_IN_LIST)"
                )));
            }
        })
    }

    fn read_extensions(&mut self, place: &str, extensions: &Extensions, principled: &mut Principled) -> Result<()> {
        let at = |name: &str, key: &str| format!("{place}.KHR_materials_{name}.{key}");
        if let Some(json) = &extensions.ior {
            let ior = json.ior.unwrap_or(1.5);
            // 0 has a meaning of its own.
            let least = if ior == 0.0 { 0.0 } else { 1.0 };
            principled.ior = self.number(&at("ior", "ior"), ior, [least, NON_NEGATIVE[1]]);
        }
        if let Some(json) = &extensions.specular {
            self.specular(&format!("{place}.KHR_materials_specular"), json, principled)?;
        }
        if let Some(json) = &extensions.transmission {
            principled.transmission = self.textured_factor(
                &at("transmission", "transmission"),
                json.transmission_factor,
                json.transmission_texture.as_ref(),
                Data,
            )?;
        }
        if let Some(json) = &extensions.volume {
            self.volume(&format!("{place}.KHR_materials_volume"), json, principled)?;
        }
        if let Some(json) = &extensions.dispersion {
            principled.dispersion = self.number(&at("dispersion", "dispersion"), json.dispersion, NON_NEGATIVE);
        }
        if let Some(json) = &extensions.clearcoat {
            self.clearcoat(&format!("{place}.KHR_materials_clearcoat"), json, principled)?;
        }
        if let Some(json) = &extensions.sheen {
            self.sheen(&format!("{place}.KHR_materials_sheen"), json, principled)?;
        }
        if let Some(json) = &extensions.iridescence {
            self.iridescence(&format!("{place}.KHR_materials_iridescence"), json, principled)?;
        }
        if let Some(json) = &extensions.anisotropy {
            self.anisotropy(&format!("{place}.KHR_materials_anisotropy"), json, principled)?;
        }
        if let Some(json) = &extensions.diffuse_transmission {
            self.diffuse_transmission(&format!("{place}.KHR_materials_diffuse_transmission"), json, principled)?;
        }
        Ok(())
    }

    fn specular(&mut self, place: &str, json: &json::Specular, principled: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        principled.specular = self.textured_factor(
            &at("specular"),
            json.specular_factor.unwrap_or(1.0),
            json.specular_texture.as_ref(),
            Color,
        )?;
        let color = json.specular_color_factor.unwrap_or([1.0; 3]);
        principled.specular_color = Textured {
            value: self.numbers(&at("specularColorFactor"), color, NON_NEGATIVE),
            texture: self.slot(&at("specularColorTexture"), json.specular_color_texture.as_ref(), Color)?,
        };
        Ok(())
    }

    fn volume(&mut self, place: &str, json: &json::Volume, principled: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        principled.thickness = Textured {
            value: self.number(&at("thicknessFactor"), json.thickness_factor, NON_NEGATIVE),
            texture: self.slot(&at("thicknessTexture"), json.thickness_texture.as_ref(), Data)?,
        };
        let color = json.attenuation_color.unwrap_or([1.0; 3]);
        principled.attenuation_color = self.numbers(&at("attenuationColor"), color, UNIT_INTERVAL);
        if let Some(distance) = json.attenuation_distance {
            let least = f64::from(f32::MIN_POSITIVE);
            principled.attenuation_distance =
                self.number(&at("attenuationDistance"), distance, [least, NON_NEGATIVE[1]]);
        }
        Ok(())
    }

    fn clearcoat(&mut self, place: &str, json: &json::Clearcoat, principled: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        let (strength, roughness) = (json.clearcoat_factor, json.clearcoat_roughness_factor);
        let texture = json.clearcoat_texture.as_ref();
        principled.clearcoat = self.textured_factor(&at("clearcoat"), strength, texture, Data)?;
        let texture = json.clearcoat_roughness_texture.as_ref();
        principled.clearcoat_roughness = self.textured_factor(&at("clearcoatRoughness"), roughness, texture, Data)?;
        let normal = json.clearcoat_normal_texture.as_ref();
        principled.clearcoat_normal = self.normal_map(&at("clearcoatNormalTexture"), normal)?;
        Ok(())
    }

    fn sheen(&mut self, place: &str, json: &json::Sheen, principled: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        let color = json.sheen_color_factor;
        principled.sheen_color = Textured {
            value: self.numbers(&at("sheenColorFactor"), color, UNIT_INTERVAL),
            texture: self.slot(&at("sheenColorTexture"), json.sheen_color_texture.as_ref(), Color)?,
        };
        let texture = json.sheen_roughness_texture.as_ref();
        principled.sheen_roughness =
            self.textured_factor(&at("sheenRoughness"), json.sheen_roughness_factor, texture, Color)?;
        Ok(())
    }

    fn iridescence(&mut self, place: &str, json: &json::Iridescence, principled: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        let texture = json.iridescence_texture.as_ref();
        principled.iridescence = self.textured_factor(&at("iridescence"), json.iridescence_factor, texture, Data)?;
        let ior = json.iridescence_ior.unwrap_or(1.3);
        principled.iridescence_ior = self.number(&at("iridescenceIor"), ior, [1.0, NON_NEGATIVE[1]]);
        let thickness =
            [json.iridescence_thickness_minimum.unwrap_or(100.0), json.iridescence_thickness_maximum.unwrap_or(400.0)];
        principled.iridescence_thickness = self.numbers(&at("iridescenceThicknessMinimum"), thickness, NON_NEGATIVE);
        let texture = json.iridescence_thickness_texture.as_ref();
        principled.iridescence_thickness_texture = self.slot(&at("iridescenceThicknessTexture"), texture, Data)?;
        Ok(())
    }

    fn anisotropy(&mut self, place: &str, json: &json::Anisotropy, principled: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        principled.anisotropy = Textured {
            value: self.number(&at("anisotropyStrength"), json.anisotropy_strength, UNIT_INTERVAL),
            texture: self.slot(&at("anisotropyTexture"), json.anisotropy_texture.as_ref(), Data)?,
        };
        principled.anisotropy_rotation = json.anisotropy_rotation as f32;
        Ok(())
    }

    fn diffuse_transmission(
        &mut self,
        place: &str,
        json: &json::DiffuseTransmission,
        principled: &mut Principled,
    ) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        let texture = json.diffuse_transmission_texture.as_ref();
        let factor = json.diffuse_transmission_factor;
        principled.diffuse_transmission = self.textured_factor(&at("diffuseTransmission"), factor, texture, Color)?;
        let color = json.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
        principled.diffuse_transmission_color = Textured {
            value: self.numbers(&at("diffuseTransmissionColorFactor"), color, UNIT_INTERVAL),
            texture: self.slot(
                &at("diffuseTransmissionColorTexture"),
                json.diffuse_transmission_color_texture.as_ref(),
                Color,
            )?,
        };
        Ok(())
    }

    /// A factor of the unit interval with its texture: `placeFactor` and `placeTexture`.
    fn textured_factor(
        &mut self,
        place: &str,
        value: f64,
        info: Option<&TextureInfo>,
        color_use: ColorUse,
    ) -> Result<Textured<f32>> {
        Ok(Textured {
            value: self.number(&format!("{place}Factor"), value, UNIT_INTERVAL),
            texture: self.slot(&format!("{place}Texture"), info, color_use)?,
        })
    }

    fn normal_map(&mut self, place: &str, info: Option<&TextureInfo>) -> Result<Option<NormalMap>> {
        let slot: Option<TextureSlot> = self.slot(place, info, Data)?;
        let scale = info.and_then(|info| info.scale).unwrap_or(1.0);
        Ok(slot.map(|texture| NormalMap { texture, scale: scale.clamp(-NON_NEGATIVE[1], NON_NEGATIVE[1]) as f32 }))
    }

    pub(crate) fn number(&mut self, place: &str, value: f64, range: [f64; 2]) -> f32 {
        self.numbers(place, [value], range)[0]
    }

    /// Numbers of a range; others are clamped, and that is said.
    pub(crate) fn numbers<const N: usize>(&mut self, place: &str, values: [f64; N], [low, high]: [f64; 2]) -> [f32; N] {
        if values.iter().any(|v| !(low..=high).contains(v)) {
            let message = format!("{values:?} is clamped to {low}..={high} (VALUE_NOT_IN_RANGE)");
            self.diagnostics.note(place, message);
        }
        values.map(|v| v.clamp(low, high) as f32)
    }
}
