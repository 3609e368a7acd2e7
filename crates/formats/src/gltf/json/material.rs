//! JSON of glTF's materials and of their extensions.

use serde::Deserialize;

use crate::gltf::json::texture_info::TextureInfo;

json_objects! {
    struct Material {
        name: String,
        pbr_metallic_roughness: MetallicRoughness,
        normal_texture: Option<TextureInfo>,
        occlusion_texture: Option<TextureInfo>,
        emissive_texture: Option<TextureInfo>,
        emissive_factor: [f64; 3],
        alpha_mode: Option<String>,
        alpha_cutoff: Option<f64>,
        double_sided: bool,
        extensions: Extensions,
    }

    struct MetallicRoughness {
        base_color_factor: Option<[f64; 4]>,
        base_color_texture: Option<TextureInfo>,
        metallic_factor: Option<f64>,
        roughness_factor: Option<f64>,
        metallic_roughness_texture: Option<TextureInfo>,
    }

    struct Extensions {
        "KHR_materials_emissive_strength" emissive_strength: Option<EmissiveStrength>,
        "KHR_materials_ior" ior: Option<Ior>,
        "KHR_materials_specular" specular: Option<Box<Specular>>,
        "KHR_materials_unlit" unlit: Option<Unlit>,
        "KHR_materials_transmission" transmission: Option<Box<Transmission>>,
        "KHR_materials_volume" volume: Option<Box<Volume>>,
        "KHR_materials_dispersion" dispersion: Option<Dispersion>,
        "KHR_materials_clearcoat" clearcoat: Option<Box<Clearcoat>>,
        "KHR_materials_sheen" sheen: Option<Box<Sheen>>,
        "KHR_materials_iridescence" iridescence: Option<Box<Iridescence>>,
        "KHR_materials_anisotropy" anisotropy: Option<Box<Anisotropy>>,
        "KHR_materials_diffuse_transmission" diffuse_transmission: Option<Box<DiffuseTransmission>>,
        "KHR_materials_pbrSpecularGlossiness" specular_glossiness: Option<Box<SpecularGlossiness>>,
    }
}

#[derive(Debug, Deserialize)]
pub(crate) struct Unlit {}

json_objects! {
    struct EmissiveStrength {
        emissive_strength: Option<f64>,
    }

    struct Ior {
        ior: Option<f64>,
    }

    struct Specular {
        specular_factor: Option<f64>,
        specular_texture: Option<TextureInfo>,
        specular_color_factor: Option<[f64; 3]>,
        specular_color_texture: Option<TextureInfo>,
    }

    struct Transmission {
        transmission_factor: f64,
        transmission_texture: Option<TextureInfo>,
    }

    struct Volume {
        thickness_factor: f64,
        thickness_texture: Option<TextureInfo>,
        attenuation_distance: Option<f64>,
        attenuation_color: Option<[f64; 3]>,
    }

    struct Dispersion {
        dispersion: f64,
    }

    struct Clearcoat {
        clearcoat_factor: f64,
        clearcoat_texture: Option<TextureInfo>,
        clearcoat_roughness_factor: f64,
        clearcoat_roughness_texture: Option<TextureInfo>,
        clearcoat_normal_texture: Option<TextureInfo>,
    }

    struct Sheen {
        sheen_color_factor: [f64; 3],
        sheen_color_texture: Option<TextureInfo>,
        sheen_roughness_factor: f64,
        sheen_roughness_texture: Option<TextureInfo>,
    }

    struct Iridescence {
        iridescence_factor: f64,
        iridescence_texture: Option<TextureInfo>,
        iridescence_ior: Option<f64>,
        iridescence_thickness_minimum: Option<f64>,
        iridescence_thickness_maximum: Option<f64>,
        iridescence_thickness_texture: Option<TextureInfo>,
    }

    struct Anisotropy {
        anisotropy_strength: f64,
        anisotropy_rotation: f64,
        anisotropy_texture: Option<TextureInfo>,
    }

    struct DiffuseTransmission {
        diffuse_transmission_factor: f64,
        diffuse_transmission_texture: Option<TextureInfo>,
        diffuse_transmission_color_factor: Option<[f64; 3]>,
        diffuse_transmission_color_texture: Option<TextureInfo>,
    }

    struct SpecularGlossiness {
        diffuse_factor: Option<[f64; 4]>,
        diffuse_texture: Option<TextureInfo>,
        specular_factor: Option<[f64; 3]>,
        glossiness_factor: Option<f64>,
        specular_glossiness_texture: Option<TextureInfo>,
    }
}
