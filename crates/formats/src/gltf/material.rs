//! Materials: metallic-roughness and the extensions that add to it.

use raycam_scene::Mesh;
use raycam_scene::material::principled::{NormalMap, Principled, Textured};
use raycam_scene::material::{Alpha, Material, Reflectance};
use raycam_scene::texture::TextureSlot;

use super::json::{Primitive, TextureInfo};
use super::{Builder, Document};
use crate::error::FormatError;
use crate::gltf::diagnostics::Ledger;
use crate::gltf::json::material::{self as json, Extensions};
use crate::image::ColorUse::{self, Color, Data};

/// Any number that is not negative.
pub(super) const ANY: [f64; 2] = [0.0, f32::MAX as f64];
const SHARE: [f64; 2] = [0.0, 1.0];

impl Builder<'_, '_> {
    /// All materials, with those of the document first and in its order; then the one of those that have none.
    pub(super) fn materials(&mut self) -> Result<(), FormatError> {
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
    pub(super) fn material_index(
        &mut self,
        place: &str,
        index: Option<usize>,
    ) -> Result<usize, FormatError> {
        let document = self.document;
        let count = document.root.materials.len();
        match index {
            Some(index) if index < count => Ok(index),
            Some(index) => Err(document.unresolved(&format!("{place}.material"), index, count)),
            None if self.world.materials.len() > count => Ok(count),
            None => {
                let material = Material {
                    double_sided: false,
                    reflectance: Reflectance::Principled(Box::default()),
                    ..Material::default()
                };
                let added = self.world.add_material(material);
                added.map_err(|error| document.scene(place, error))
            }
        }
    }

    fn material(
        &mut self,
        place: &str,
        json: &json::Material,
    ) -> Result<Material, FormatError> {
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
            let [r, g, b, a] = self.numbers(&pbr_at("baseColorFactor"), factor, SHARE);
            (material.color, material.opacity) = ([r, g, b], a);
            let info = pbr.base_color_texture.as_ref();
            material.texture = self.slot(&pbr_at("baseColorTexture"), info, Color)?;
            let info = pbr.metallic_roughness_texture.as_ref();
            let texture = self.slot(&pbr_at("metallicRoughnessTexture"), info, Data)?;
            let (metallic, roughness) = (pbr.metallic_factor, pbr.roughness_factor);
            let metallic = metallic.unwrap_or(1.0);
            let value = self.number(&pbr_at("metallicFactor"), metallic, SHARE);
            principled.metallic = Textured { value, texture };
            let roughness = roughness.unwrap_or(1.0);
            let value = self.number(&pbr_at("roughnessFactor"), roughness, SHARE);
            principled.roughness = Textured { value, texture };
        }
        if extensions.unlit.is_some() {
            material.reflectance = Reflectance::Unlit;
            return Ok(material);
        }
        let strength = extensions.emissive_strength.as_ref();
        let strength = strength.and_then(|e| e.emissive_strength).unwrap_or(1.0);
        let strength_at = at("extensions.KHR_materials_emissive_strength.emissiveStrength");
        let strength = self.number(&strength_at, strength, ANY);
        let emission = self.numbers(&at("emissiveFactor"), json.emissive_factor, SHARE);
        material.emission = Textured {
            value: emission.map(|v| v * strength),
            texture: self.slot(
                &at("emissiveTexture"),
                json.emissive_texture.as_ref(),
                Color,
            )?,
        };
        let normal = json.normal_texture.as_ref();
        material.normal_map = self.normal_map(&at("normalTexture"), normal)?;
        if let Some(info) = &json.occlusion_texture {
            let place = at("occlusionTexture");
            let strength = info.strength.unwrap_or(1.0);
            material.occlusion = Some(Textured {
                value: self.number(&format!("{place}.strength"), strength, SHARE),
                texture: self.slot(&place, Some(info), Data)?,
            });
        }
        self.extend(&at("extensions"), extensions, &mut principled)?;
        material.reflectance = Reflectance::Principled(Box::new(principled));
        Ok(material)
    }

    fn alpha(&mut self, place: &str, json: &json::Material) -> Result<Alpha, FormatError> {
        Ok(match json.alpha_mode.as_deref() {
            None | Some("OPAQUE") => Alpha::Opaque,
            Some("BLEND") => Alpha::Blend,
            Some("MASK") => Alpha::Mask {
                cutoff: self.number(
                    &format!("{place}.alphaCutoff"),
                    json.alpha_cutoff.unwrap_or(0.5),
                    ANY,
                ),
            },
            Some(mode) => {
                return Err(self.document.fault(format!(
                    "{place}.alphaMode: {mode:?}, expected OPAQUE, MASK or BLEND (VALUE_NOT_IN_LIST)"
                )));
            }
        })
    }

    fn extend(
        &mut self,
        place: &str,
        extensions: &Extensions,
        principled: &mut Principled,
    ) -> Result<(), FormatError> {
        let at = |name: &str, key: &str| format!("{place}.KHR_materials_{name}.{key}");
        if let Some(json) = &extensions.ior {
            let ior = json.ior.unwrap_or(1.5);
            // 0 has a meaning of its own.
            let least = if ior == 0.0 { 0.0 } else { 1.0 };
            principled.ior = self.number(&at("ior", "ior"), ior, [least, ANY[1]]);
        }
        if let Some(json) = &extensions.specular {
            let at = |key| at("specular", key);
            principled.specular = self.factor(
                &at("specular"),
                json.specular_factor.unwrap_or(1.0),
                json.specular_texture.as_ref(),
                Color,
            )?;
            let color = json.specular_color_factor.unwrap_or([1.0; 3]);
            principled.specular_color = Textured {
                value: self.numbers(&at("specularColorFactor"), color, ANY),
                texture: self.slot(
                    &at("specularColorTexture"),
                    json.specular_color_texture.as_ref(),
                    Color,
                )?,
            };
        }
        if let Some(json) = &extensions.transmission {
            principled.transmission = self.factor(
                &at("transmission", "transmission"),
                json.transmission_factor,
                json.transmission_texture.as_ref(),
                Data,
            )?;
        }
        if let Some(json) = &extensions.volume {
            let at = |key| at("volume", key);
            principled.thickness = Textured {
                value: self.number(&at("thicknessFactor"), json.thickness_factor, ANY),
                texture: self.slot(
                    &at("thicknessTexture"),
                    json.thickness_texture.as_ref(),
                    Data,
                )?,
            };
            let color = json.attenuation_color.unwrap_or([1.0; 3]);
            principled.attenuation_color = self.numbers(&at("attenuationColor"), color, SHARE);
            if let Some(distance) = json.attenuation_distance {
                let least = f64::from(f32::MIN_POSITIVE);
                principled.attenuation_distance =
                    self.number(&at("attenuationDistance"), distance, [least, ANY[1]]);
            }
        }
        if let Some(json) = &extensions.dispersion {
            principled.dispersion =
                self.number(&at("dispersion", "dispersion"), json.dispersion, ANY);
        }
        if let Some(json) = &extensions.clearcoat {
            let at = |key| at("clearcoat", key);
            let (strength, roughness) = (json.clearcoat_factor, json.clearcoat_roughness_factor);
            let texture = json.clearcoat_texture.as_ref();
            principled.clearcoat = self.factor(&at("clearcoat"), strength, texture, Data)?;
            let texture = json.clearcoat_roughness_texture.as_ref();
            principled.clearcoat_roughness =
                self.factor(&at("clearcoatRoughness"), roughness, texture, Data)?;
            let normal = json.clearcoat_normal_texture.as_ref();
            principled.clearcoat_normal = self.normal_map(&at("clearcoatNormalTexture"), normal)?;
        }
        if let Some(json) = &extensions.sheen {
            let at = |key| at("sheen", key);
            let color = json.sheen_color_factor;
            principled.sheen_color = Textured {
                value: self.numbers(&at("sheenColorFactor"), color, SHARE),
                texture: self.slot(
                    &at("sheenColorTexture"),
                    json.sheen_color_texture.as_ref(),
                    Color,
                )?,
            };
            let texture = json.sheen_roughness_texture.as_ref();
            principled.sheen_roughness = self.factor(
                &at("sheenRoughness"),
                json.sheen_roughness_factor,
                texture,
                Color,
            )?;
        }
        if let Some(json) = &extensions.iridescence {
            let at = |key| at("iridescence", key);
            let texture = json.iridescence_texture.as_ref();
            principled.iridescence =
                self.factor(&at("iridescence"), json.iridescence_factor, texture, Data)?;
            let ior = json.iridescence_ior.unwrap_or(1.3);
            principled.iridescence_ior = self.number(&at("iridescenceIor"), ior, [1.0, ANY[1]]);
            let thickness = [
                json.iridescence_thickness_minimum.unwrap_or(100.0),
                json.iridescence_thickness_maximum.unwrap_or(400.0),
            ];
            principled.iridescence_thickness =
                self.numbers(&at("iridescenceThicknessMinimum"), thickness, ANY);
            let texture = json.iridescence_thickness_texture.as_ref();
            principled.iridescence_thickness_texture =
                self.slot(&at("iridescenceThicknessTexture"), texture, Data)?;
        }
        if let Some(json) = &extensions.anisotropy {
            let at = |key| at("anisotropy", key);
            principled.anisotropy = Textured {
                value: self.number(&at("anisotropyStrength"), json.anisotropy_strength, SHARE),
                texture: self.slot(
                    &at("anisotropyTexture"),
                    json.anisotropy_texture.as_ref(),
                    Data,
                )?,
            };
            principled.anisotropy_rotation = json.anisotropy_rotation as f32;
        }
        if let Some(json) = &extensions.diffuse_transmission {
            let at = |key| at("diffuse_transmission", key);
            let texture = json.diffuse_transmission_texture.as_ref();
            let factor = json.diffuse_transmission_factor;
            principled.diffuse_transmission =
                self.factor(&at("diffuseTransmission"), factor, texture, Color)?;
            let color = json.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
            principled.diffuse_transmission_color = Textured {
                value: self.numbers(&at("diffuseTransmissionColorFactor"), color, SHARE),
                texture: self.slot(
                    &at("diffuseTransmissionColorTexture"),
                    json.diffuse_transmission_color_texture.as_ref(),
                    Color,
                )?,
            };
        }
        Ok(())
    }

    /// A share with its texture: `placeFactor` and `placeTexture`.
    fn factor(
        &mut self,
        place: &str,
        value: f64,
        info: Option<&TextureInfo>,
        color_use: ColorUse,
    ) -> Result<Textured<f32>, FormatError> {
        Ok(Textured {
            value: self.number(&format!("{place}Factor"), value, SHARE),
            texture: self.slot(&format!("{place}Texture"), info, color_use)?,
        })
    }

    fn normal_map(
        &mut self,
        place: &str,
        info: Option<&TextureInfo>,
    ) -> Result<Option<NormalMap>, FormatError> {
        let slot: Option<TextureSlot> = self.slot(place, info, Data)?;
        let scale = info.and_then(|info| info.scale).unwrap_or(1.0);
        Ok(slot.map(|texture| NormalMap {
            texture,
            scale: scale.clamp(-ANY[1], ANY[1]) as f32,
        }))
    }

    pub(super) fn number(&mut self, place: &str, value: f64, range: [f64; 2]) -> f32 {
        self.numbers(place, [value], range)[0]
    }

    /// Numbers of a range; others are clamped, and that is said.
    pub(super) fn numbers<const N: usize>(
        &mut self,
        place: &str,
        values: [f64; N],
        [low, high]: [f64; 2],
    ) -> [f32; N] {
        if values.iter().any(|v| !(low..=high).contains(v)) {
            let message = format!("{values:?} is clamped to {low}..={high} (VALUE_NOT_IN_RANGE)");
            self.ledger.note(place, message);
        }
        values.map(|v| v.clamp(low, high) as f32)
    }
}

/// What a primitive's materials, those of variants included, want of its vertices.
pub(super) struct Uses {
    /// Sets of texture coordinates.
    sets: Vec<usize>,
    /// The set that tangents follow, where a material needs tangents.
    pub(super) tangent_uvs: Option<usize>,
}

impl Uses {
    pub(super) fn of(
        document: &Document<'_>,
        place: &str,
        primitive: &Primitive,
    ) -> Result<Self, FormatError> {
        let mappings = primitive.extensions.variants.iter();
        let mappings = mappings.flat_map(|variants| &variants.mappings);
        let materials = primitive.material.into_iter();
        let (mut sets, mut tangent_uvs) = (Vec::new(), None);
        for index in materials.chain(mappings.map(|mapping| mapping.material)) {
            let place = &format!("{place}.material");
            let material = document.get(&document.root.materials, index, place)?;
            sets.extend(material.textures().map(TextureInfo::uv_set));
            tangent_uvs = tangent_uvs.or(material.tangent_uvs());
        }
        sets.sort_unstable();
        sets.dedup();
        Ok(Self { sets, tangent_uvs })
    }

    /// Says which sets of texture coordinates the mesh lacks.
    pub(super) fn check_uvs(&self, place: &str, mesh: &Mesh, ledger: &mut Ledger) {
        for set in self.sets.iter().filter(|&&set| mesh.uv_set(set).is_none()) {
            let message = format!(
                "its material uses TEXCOORD_{set}, which it lacks (MESH_PRIMITIVE_TOO_FEW_TEXCOORDS)"
            );
            ledger.note(place, message);
        }
    }
}

impl json::Material {
    fn textures(&self) -> impl Iterator<Item = &TextureInfo> {
        let pbr = &self.pbr_metallic_roughness;
        let unlit = self.extensions.unlit.is_some();
        let own = [
            pbr.base_color_texture.as_ref(),
            pbr.metallic_roughness_texture.as_ref().filter(|_| !unlit),
            self.normal_texture.as_ref().filter(|_| !unlit),
            self.occlusion_texture.as_ref().filter(|_| !unlit),
            self.emissive_texture.as_ref().filter(|_| !unlit),
        ];
        own.into_iter().flatten()
    }

    /// The texture coordinates of whatever needs tangents.
    fn tangent_uvs(&self) -> Option<usize> {
        let extensions = &self.extensions;
        if extensions.unlit.is_some() {
            return None;
        }
        let clearcoat = extensions.clearcoat.as_ref();
        let clearcoat = clearcoat.and_then(|coat| coat.clearcoat_normal_texture.as_ref());
        let anisotropy = extensions.anisotropy.as_ref();
        let texture = anisotropy.and_then(|ani| ani.anisotropy_texture.as_ref());
        let textures = [self.normal_texture.as_ref(), clearcoat, texture];
        let first = textures.into_iter().flatten().next();
        first.map(TextureInfo::uv_set).or(anisotropy.map(|_| 0))
    }
}
