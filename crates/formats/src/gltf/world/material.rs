//! Materials: metallic-roughness and its extensions.

use raycam_scene::{Alpha, Material, MaterialModel, NormalMap, NoticeCode, Principled, TextureSlot, Textured};

use crate::error::Result;
use crate::gltf::json::material::{self as json, Extensions};
use crate::gltf::json::texture_info::TextureInfo;
use crate::gltf::world::builder::Builder;
use raycam_scene::ColorUse::{self, Color, Data};

/// Range of all non-negative numbers.
pub(crate) const NON_NEGATIVE: [f64; 2] = [0.0, f32::MAX as f64];
const UNIT_INTERVAL: [f64; 2] = [0.0, 1.0];

impl Builder<'_, '_> {
    /// Adds all materials of the document to the world, in order.
    pub(crate) fn materials(&mut self) -> Result<()> {
        let document = self.document;
        for (i, json) in document.root.materials.iter().enumerate() {
            let place = format!("materials[{i}]");
            let material = self.material(&place, json)?;
            self.world.add_material(material).map_err(|error| document.scene(&place, error))?;
        }
        Ok(())
    }

    /// Index in the world of a material of the document, or of glTF's default material.
    pub(crate) fn material_index(&mut self, place: &str, index: Option<usize>) -> Result<usize> {
        let document = self.document;
        let count = document.root.materials.len();
        match index {
            Some(index) if index < count => Ok(index),
            Some(index) => Err(document.unresolved(&format!("{place}.material"), "materials", index, count)),
            None if self.world.materials.len() > count => Ok(count),
            None => {
                let material = Material {
                    double_sided: false,
                    model: MaterialModel::Principled(Box::default()),
                    ..Material::default()
                };
                self.world.add_material(material).map_err(|error| document.scene(place, error))
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
            alpha: self.alpha(place, json),
            ..Material::default()
        };
        let mut principled = Principled::default();
        if let Some(old) = &extensions.specular_glossiness {
            self.specular_glossiness(place, old, &mut material, &mut principled)?;
        } else {
            let factor = pbr.base_color_factor.unwrap_or([1.0; 4]);
            let [r, g, b, a] = self.numbers(&pbr_at("baseColorFactor"), factor, UNIT_INTERVAL);
            (material.color, material.opacity) = ([r, g, b], a);
            material.texture = self.slot(&pbr_at("baseColorTexture"), &pbr.base_color_texture, Color)?;
            let texture = self.slot(&pbr_at("metallicRoughnessTexture"), &pbr.metallic_roughness_texture, Data)?;
            let value = self.number(&pbr_at("metallicFactor"), pbr.metallic_factor.unwrap_or(1.0), UNIT_INTERVAL);
            principled.metallic = Textured { value, texture };
            let value = self.number(&pbr_at("roughnessFactor"), pbr.roughness_factor.unwrap_or(1.0), UNIT_INTERVAL);
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
            texture: self.slot(&at("emissiveTexture"), &json.emissive_texture, Color)?,
        };
        material.normal_map = self.normal_map(&at("normalTexture"), &json.normal_texture)?;
        if let Some(info) = &json.occlusion_texture {
            let strength = info.strength.unwrap_or(1.0);
            material.occlusion = Some(Textured {
                value: self.number(&at("occlusionTexture.strength"), strength, UNIT_INTERVAL),
                texture: self.slot(&at("occlusionTexture"), &json.occlusion_texture, Data)?,
            });
        }
        self.read_extensions(&at("extensions"), extensions, &mut principled)?;
        material.model = MaterialModel::Principled(Box::new(principled));
        Ok(material)
    }

    fn alpha(&mut self, place: &str, json: &json::Material) -> Alpha {
        match json.alpha_mode.as_deref() {
            None | Some("OPAQUE") => Alpha::Opaque,
            Some("BLEND") => Alpha::Blend,
            Some("MASK") => Alpha::Mask {
                cutoff: self.number(&format!("{place}.alphaCutoff"), json.alpha_cutoff.unwrap_or(0.5), NON_NEGATIVE),
            },
            Some(mode) => {
                let message = format!("{mode:?} is read as OPAQUE; expected OPAQUE, MASK or BLEND (VALUE_NOT_IN_LIST)");
                self.diagnostics.note(NoticeCode::InvalidFile, format!("{place}.alphaMode"), message);
                Alpha::Opaque
            }
        }
    }

    fn read_extensions(&mut self, place: &str, extensions: &Extensions, p: &mut Principled) -> Result<()> {
        let at = |name: &str| format!("{place}.KHR_materials_{name}");
        if let Some(json) = &extensions.ior {
            let ior = json.ior.unwrap_or(1.5);
            // An index of refraction of 0 is allowed: it represents a dielectric of infinite index.
            let least = if ior == 0.0 { 0.0 } else { 1.0 };
            p.ior = self.number(&at("ior.ior"), ior, [least, NON_NEGATIVE[1]]);
        }
        if let Some(json) = &extensions.specular {
            self.specular(&at("specular"), json, p)?;
        }
        if let Some(json) = &extensions.transmission {
            let (factor, texture) = (json.transmission_factor, &json.transmission_texture);
            p.transmission = self.textured_factor(&at("transmission.transmission"), factor, texture, Data)?;
        }
        if let Some(json) = &extensions.volume {
            self.volume(&at("volume"), json, p)?;
        }
        if let Some(json) = &extensions.dispersion {
            p.dispersion = self.number(&at("dispersion.dispersion"), json.dispersion, NON_NEGATIVE);
        }
        if let Some(json) = &extensions.clearcoat {
            self.clearcoat(&at("clearcoat"), json, p)?;
        }
        if let Some(json) = &extensions.sheen {
            self.sheen(&at("sheen"), json, p)?;
        }
        if let Some(json) = &extensions.iridescence {
            self.iridescence(&at("iridescence"), json, p)?;
        }
        if let Some(json) = &extensions.anisotropy {
            self.anisotropy(&at("anisotropy"), json, p)?;
        }
        if let Some(json) = &extensions.diffuse_transmission {
            self.diffuse_transmission(&at("diffuse_transmission"), json, p)?;
        }
        Ok(())
    }

    fn specular(&mut self, place: &str, json: &json::Specular, p: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        let factor = json.specular_factor.unwrap_or(1.0);
        p.specular = self.textured_factor(&at("specular"), factor, &json.specular_texture, Color)?;
        let color = json.specular_color_factor.unwrap_or([1.0; 3]);
        p.specular_color = Textured {
            value: self.numbers(&at("specularColorFactor"), color, NON_NEGATIVE),
            texture: self.slot(&at("specularColorTexture"), &json.specular_color_texture, Color)?,
        };
        Ok(())
    }

    fn volume(&mut self, place: &str, json: &json::Volume, p: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        p.thickness = Textured {
            value: self.number(&at("thicknessFactor"), json.thickness_factor, NON_NEGATIVE),
            texture: self.slot(&at("thicknessTexture"), &json.thickness_texture, Data)?,
        };
        let color = json.attenuation_color.unwrap_or([1.0; 3]);
        p.attenuation_color = self.numbers(&at("attenuationColor"), color, UNIT_INTERVAL);
        if let Some(distance) = json.attenuation_distance {
            let least = f64::from(f32::MIN_POSITIVE);
            p.attenuation_distance = self.number(&at("attenuationDistance"), distance, [least, NON_NEGATIVE[1]]);
        }
        Ok(())
    }

    fn clearcoat(&mut self, place: &str, json: &json::Clearcoat, p: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        p.clearcoat = self.textured_factor(&at("clearcoat"), json.clearcoat_factor, &json.clearcoat_texture, Data)?;
        let (roughness, texture) = (json.clearcoat_roughness_factor, &json.clearcoat_roughness_texture);
        p.clearcoat_roughness = self.textured_factor(&at("clearcoatRoughness"), roughness, texture, Data)?;
        p.clearcoat_normal = self.normal_map(&at("clearcoatNormalTexture"), &json.clearcoat_normal_texture)?;
        Ok(())
    }

    fn sheen(&mut self, place: &str, json: &json::Sheen, p: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        p.sheen_color = Textured {
            value: self.numbers(&at("sheenColorFactor"), json.sheen_color_factor, UNIT_INTERVAL),
            texture: self.slot(&at("sheenColorTexture"), &json.sheen_color_texture, Color)?,
        };
        let (roughness, texture) = (json.sheen_roughness_factor, &json.sheen_roughness_texture);
        p.sheen_roughness = self.textured_factor(&at("sheenRoughness"), roughness, texture, Color)?;
        Ok(())
    }

    fn iridescence(&mut self, place: &str, json: &json::Iridescence, p: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        let (factor, texture) = (json.iridescence_factor, &json.iridescence_texture);
        p.iridescence = self.textured_factor(&at("iridescence"), factor, texture, Data)?;
        let ior = json.iridescence_ior.unwrap_or(1.3);
        p.iridescence_ior = self.number(&at("iridescenceIor"), ior, [1.0, NON_NEGATIVE[1]]);
        let thickness =
            [json.iridescence_thickness_minimum.unwrap_or(100.0), json.iridescence_thickness_maximum.unwrap_or(400.0)];
        p.iridescence_thickness = self.numbers(&at("iridescenceThicknessMinimum"), thickness, NON_NEGATIVE);
        let texture = &json.iridescence_thickness_texture;
        p.iridescence_thickness_texture = self.slot(&at("iridescenceThicknessTexture"), texture, Data)?;
        Ok(())
    }

    fn anisotropy(&mut self, place: &str, json: &json::Anisotropy, p: &mut Principled) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        p.anisotropy = Textured {
            value: self.number(&at("anisotropyStrength"), json.anisotropy_strength, UNIT_INTERVAL),
            texture: self.slot(&at("anisotropyTexture"), &json.anisotropy_texture, Data)?,
        };
        p.anisotropy_rotation = json.anisotropy_rotation as f32;
        Ok(())
    }

    fn diffuse_transmission(
        &mut self,
        place: &str,
        json: &json::DiffuseTransmission,
        p: &mut Principled,
    ) -> Result<()> {
        let at = |key: &str| format!("{place}.{key}");
        let (factor, texture) = (json.diffuse_transmission_factor, &json.diffuse_transmission_texture);
        p.diffuse_transmission = self.textured_factor(&at("diffuseTransmission"), factor, texture, Color)?;
        let color = json.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
        let texture = &json.diffuse_transmission_color_texture;
        p.diffuse_transmission_color = Textured {
            value: self.numbers(&at("diffuseTransmissionColorFactor"), color, UNIT_INTERVAL),
            texture: self.slot(&at("diffuseTransmissionColorTexture"), texture, Color)?,
        };
        Ok(())
    }

    /// Factor in 0..=1 with its texture; their keys are `place` followed by `Factor` and `Texture`.
    fn textured_factor(
        &mut self,
        place: &str,
        value: f64,
        info: &Option<TextureInfo>,
        color_use: ColorUse,
    ) -> Result<Textured<f32>> {
        Ok(Textured {
            value: self.number(&format!("{place}Factor"), value, UNIT_INTERVAL),
            texture: self.slot(&format!("{place}Texture"), info, color_use)?,
        })
    }

    fn normal_map(&mut self, place: &str, info: &Option<TextureInfo>) -> Result<Option<NormalMap>> {
        let slot: Option<TextureSlot> = self.slot(place, info, Data)?;
        let scale = info.as_ref().and_then(|info| info.scale).unwrap_or(1.0);
        Ok(slot.map(|texture| NormalMap { texture, scale: scale.clamp(-NON_NEGATIVE[1], NON_NEGATIVE[1]) as f32 }))
    }

    pub(crate) fn number(&mut self, place: &str, value: f64, range: [f64; 2]) -> f32 {
        self.numbers(place, [value], range)[0]
    }

    /// Clamps numbers to a range, with a notice.
    pub(crate) fn numbers<const N: usize>(&mut self, place: &str, values: [f64; N], [low, high]: [f64; 2]) -> [f32; N] {
        if values.iter().any(|v| !(low..=high).contains(v)) {
            let message = format!("{values:?} is clamped to the range {low} to {high} (VALUE_NOT_IN_RANGE)");
            self.diagnostics.note(NoticeCode::ClampedValue, place, message);
        }
        values.map(|v| v.clamp(low, high) as f32)
    }
}
