//! The JSON of glTF's materials and of their extensions.

use serde::Deserialize;

use crate::gltf::json::texture_info::TextureInfo;

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Material {
    pub(crate) name: String,
    pub(crate) pbr_metallic_roughness: MetallicRoughness,
    pub(crate) normal_texture: Option<TextureInfo>,
    pub(crate) occlusion_texture: Option<TextureInfo>,
    pub(crate) emissive_texture: Option<TextureInfo>,
    pub(crate) emissive_factor: [f64; 3],
    pub(crate) alpha_mode: Option<String>,
    pub(crate) alpha_cutoff: Option<f64>,
    pub(crate) double_sided: bool,
    pub(crate) extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct MetallicRoughness {
    pub(crate) base_color_factor: Option<[f64; 4]>,
    pub(crate) base_color_texture: Option<TextureInfo>,
    pub(crate) metallic_factor: Option<f64>,
    pub(crate) roughness_factor: Option<f64>,
    pub(crate) metallic_roughness_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Extensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub(crate) emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_ior")]
    pub(crate) ior: Option<Ior>,
    #[serde(rename = "KHR_materials_specular")]
    pub(crate) specular: Option<Box<Specular>>,
    #[serde(rename = "KHR_materials_unlit")]
    pub(crate) unlit: Option<Unlit>,
    #[serde(rename = "KHR_materials_transmission")]
    pub(crate) transmission: Option<Box<Transmission>>,
    #[serde(rename = "KHR_materials_volume")]
    pub(crate) volume: Option<Box<Volume>>,
    #[serde(rename = "KHR_materials_dispersion")]
    pub(crate) dispersion: Option<Dispersion>,
    #[serde(rename = "KHR_materials_clearcoat")]
    pub(crate) clearcoat: Option<Box<Clearcoat>>,
    #[serde(rename = "KHR_materials_sheen")]
    pub(crate) sheen: Option<Box<Sheen>>,
    #[serde(rename = "KHR_materials_iridescence")]
    pub(crate) iridescence: Option<Box<Iridescence>>,
    #[serde(rename = "KHR_materials_anisotropy")]
    pub(crate) anisotropy: Option<Box<Anisotropy>>,
    #[serde(rename = "KHR_materials_diffuse_transmission")]
    pub(crate) diffuse_transmission: Option<Box<DiffuseTransmission>>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub(crate) specular_glossiness: Option<Box<SpecularGlossiness>>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Unlit {}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct EmissiveStrength {
    pub(crate) emissive_strength: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Ior {
    pub(crate) ior: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Specular {
    pub(crate) specular_factor: Option<f64>,
    pub(crate) specular_texture: Option<TextureInfo>,
    pub(crate) specular_color_factor: Option<[f64; 3]>,
    pub(crate) specular_color_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Transmission {
    pub(crate) transmission_factor: f64,
    pub(crate) transmission_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Volume {
    pub(crate) thickness_factor: f64,
    pub(crate) thickness_texture: Option<TextureInfo>,
    pub(crate) attenuation_distance: Option<f64>,
    pub(crate) attenuation_color: Option<[f64; 3]>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Dispersion {
    pub(crate) dispersion: f64,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Clearcoat {
    pub(crate) clearcoat_factor: f64,
    pub(crate) clearcoat_texture: Option<TextureInfo>,
    pub(crate) clearcoat_roughness_factor: f64,
    pub(crate) clearcoat_roughness_texture: Option<TextureInfo>,
    pub(crate) clearcoat_normal_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Sheen {
    pub(crate) sheen_color_factor: [f64; 3],
    pub(crate) sheen_color_texture: Option<TextureInfo>,
    pub(crate) sheen_roughness_factor: f64,
    pub(crate) sheen_roughness_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Iridescence {
    pub(crate) iridescence_factor: f64,
    pub(crate) iridescence_texture: Option<TextureInfo>,
    pub(crate) iridescence_ior: Option<f64>,
    pub(crate) iridescence_thickness_minimum: Option<f64>,
    pub(crate) iridescence_thickness_maximum: Option<f64>,
    pub(crate) iridescence_thickness_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Anisotropy {
    pub(crate) anisotropy_strength: f64,
    pub(crate) anisotropy_rotation: f64,
    pub(crate) anisotropy_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct DiffuseTransmission {
    pub(crate) diffuse_transmission_factor: f64,
    pub(crate) diffuse_transmission_texture: Option<TextureInfo>,
    pub(crate) diffuse_transmission_color_factor: Option<[f64; 3]>,
    pub(crate) diffuse_transmission_color_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct SpecularGlossiness {
    pub(crate) diffuse_factor: Option<[f64; 4]>,
    pub(crate) diffuse_texture: Option<TextureInfo>,
    pub(crate) specular_factor: Option<[f64; 3]>,
    pub(crate) glossiness_factor: Option<f64>,
    pub(crate) specular_glossiness_texture: Option<TextureInfo>,
}
