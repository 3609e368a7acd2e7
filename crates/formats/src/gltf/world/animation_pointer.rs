//! `KHR_animation_pointer`: targets given by JSON pointers into the document.

use MaterialProperty as P;
use TextureSlotKind as T;
use raycam_scene::animation::{
    AnimatedMaterial, AnimationTarget, LightProperty, MaterialProperty, TextureSlotKind, UvProperty,
};

use crate::gltf::document::Document;
use crate::gltf::json::material::Material;
use crate::gltf::json::texture_info::TextureInfo;
use crate::gltf::world::builder::Builder;

/// Properties of a material, by their paths below the material.
pub(crate) const MATERIAL_PROPERTIES: &[(&str, MaterialProperty)] = &[
    ("pbrMetallicRoughness/baseColorFactor", P::BaseColor),
    ("pbrMetallicRoughness/metallicFactor", P::Metallic),
    ("pbrMetallicRoughness/roughnessFactor", P::Roughness),
    ("alphaCutoff", P::AlphaCutoff),
    ("emissiveFactor", P::EmissionColor),
    ("extensions/KHR_materials_emissive_strength/emissiveStrength", P::EmissionStrength),
    ("normalTexture/scale", P::NormalScale),
    ("occlusionTexture/strength", P::OcclusionStrength),
    ("extensions/KHR_materials_ior/ior", P::Ior),
    ("extensions/KHR_materials_specular/specularFactor", P::Specular),
    ("extensions/KHR_materials_specular/specularColorFactor", P::SpecularColor),
    ("extensions/KHR_materials_transmission/transmissionFactor", P::Transmission),
    ("extensions/KHR_materials_volume/thicknessFactor", P::Thickness),
    ("extensions/KHR_materials_volume/attenuationColor", P::AttenuationColor),
    ("extensions/KHR_materials_volume/attenuationDistance", P::AttenuationDistance),
    ("extensions/KHR_materials_dispersion/dispersion", P::Dispersion),
    ("extensions/KHR_materials_clearcoat/clearcoatFactor", P::Clearcoat),
    ("extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", P::ClearcoatRoughness),
    ("extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale", P::ClearcoatNormalScale),
    ("extensions/KHR_materials_sheen/sheenColorFactor", P::SheenColor),
    ("extensions/KHR_materials_sheen/sheenRoughnessFactor", P::SheenRoughness),
    ("extensions/KHR_materials_iridescence/iridescenceFactor", P::Iridescence),
    ("extensions/KHR_materials_iridescence/iridescenceIor", P::IridescenceIor),
    ("extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", P::IridescenceThinnest),
    ("extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", P::IridescenceThickest),
    ("extensions/KHR_materials_anisotropy/anisotropyStrength", P::Anisotropy),
    ("extensions/KHR_materials_anisotropy/anisotropyRotation", P::AnisotropyRotation),
    ("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", P::DiffuseTransmission),
    ("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", P::DiffuseTransmissionColor),
];

type TextureFinder = fn(&Material) -> Option<&TextureInfo>;

/// Expands to a function that returns the texture of a material's extension.
macro_rules! of {
    ($extension:ident, $texture:ident) => {
        |m| m.extensions.$extension.as_ref()?.$texture.as_ref()
    };
}

/// Textures of a material, by their paths below the material.
pub(crate) const TEXTURES: &[(&str, TextureSlotKind, TextureFinder)] = &[
    ("pbrMetallicRoughness/baseColorTexture", T::BaseColor, |m| m.pbr_metallic_roughness.base_color_texture.as_ref()),
    ("pbrMetallicRoughness/metallicRoughnessTexture", T::MetallicRoughness, |m| {
        m.pbr_metallic_roughness.metallic_roughness_texture.as_ref()
    }),
    ("normalTexture", T::Normal, |m| m.normal_texture.as_ref()),
    ("occlusionTexture", T::Occlusion, |m| m.occlusion_texture.as_ref()),
    ("emissiveTexture", T::Emission, |m| m.emissive_texture.as_ref()),
    ("extensions/KHR_materials_specular/specularTexture", T::Specular, of!(specular, specular_texture)),
    ("extensions/KHR_materials_specular/specularColorTexture", T::SpecularColor, of!(specular, specular_color_texture)),
    (
        "extensions/KHR_materials_transmission/transmissionTexture",
        T::Transmission,
        of!(transmission, transmission_texture),
    ),
    ("extensions/KHR_materials_volume/thicknessTexture", T::Thickness, of!(volume, thickness_texture)),
    ("extensions/KHR_materials_clearcoat/clearcoatTexture", T::Clearcoat, of!(clearcoat, clearcoat_texture)),
    (
        "extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture",
        T::ClearcoatRoughness,
        of!(clearcoat, clearcoat_roughness_texture),
    ),
    (
        "extensions/KHR_materials_clearcoat/clearcoatNormalTexture",
        T::ClearcoatNormal,
        of!(clearcoat, clearcoat_normal_texture),
    ),
    ("extensions/KHR_materials_sheen/sheenColorTexture", T::SheenColor, of!(sheen, sheen_color_texture)),
    ("extensions/KHR_materials_sheen/sheenRoughnessTexture", T::SheenRoughness, of!(sheen, sheen_roughness_texture)),
    ("extensions/KHR_materials_iridescence/iridescenceTexture", T::Iridescence, of!(iridescence, iridescence_texture)),
    (
        "extensions/KHR_materials_iridescence/iridescenceThicknessTexture",
        T::IridescenceThickness,
        of!(iridescence, iridescence_thickness_texture),
    ),
    ("extensions/KHR_materials_anisotropy/anisotropyTexture", T::Anisotropy, of!(anisotropy, anisotropy_texture)),
    (
        "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionTexture",
        T::DiffuseTransmission,
        of!(diffuse_transmission, diffuse_transmission_texture),
    ),
    (
        "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture",
        T::DiffuseTransmissionColor,
        of!(diffuse_transmission, diffuse_transmission_color_texture),
    ),
];

/// Properties of a texture's `KHR_texture_transform`, by their paths below the texture.
pub(crate) const UV_PROPERTIES: &[(&str, UvProperty)] = &[
    ("/extensions/KHR_texture_transform/offset", UvProperty::Offset),
    ("/extensions/KHR_texture_transform/rotation", UvProperty::Rotation),
    ("/extensions/KHR_texture_transform/scale", UvProperty::Scale),
];

/// Path of a document's lights.
pub(crate) const LIGHT_PATH: &str = "/extensions/KHR_lights_punctual/lights/";

/// Function that returns the animation target for a camera's index in the document.
pub(crate) type CameraTarget = fn(usize) -> AnimationTarget;

/// Animated properties of a camera, by their paths below the camera.
pub(crate) const CAMERA_PROPERTIES: &[(&str, CameraTarget)] = &[
    ("perspective/yfov", AnimationTarget::FieldOfView),
    ("orthographic/xmag", |camera| AnimationTarget::Magnification(camera, 0)),
    ("orthographic/ymag", |camera| AnimationTarget::Magnification(camera, 1)),
];

/// Properties of a light, by their paths below the light.
pub(crate) const LIGHT_PROPERTIES: &[(&str, LightProperty)] = &[
    ("color", LightProperty::Color),
    ("intensity", LightProperty::Intensity),
    ("spot/innerConeAngle", LightProperty::InnerAngle),
    ("spot/outerConeAngle", LightProperty::OuterAngle),
];

/// Splits a path into its leading index and the remaining path.
fn split_index(rest: &str) -> Option<(usize, &str)> {
    let (number, rest) = rest.split_once('/')?;
    Some((number.parse().ok()?, rest))
}

impl Document<'_> {
    /// Targets of a pointer to anything except a node; `None` if raycam does not animate this property.
    pub(crate) fn resolve_pointer(&self, pointer: &str) -> Option<Vec<AnimationTarget>> {
        let row = |found: bool, target| found.then(|| vec![target]);
        if let Some((mesh, "weights")) = pointer.strip_prefix("/meshes/").and_then(split_index) {
            let nodes = self.root.nodes.iter().enumerate();
            let users = nodes.filter(|(_, node)| node.mesh == Some(mesh) && node.weights.is_none());
            return Some(users.map(|(i, _)| AnimationTarget::Weights(i)).collect());
        }
        if let Some((material, path)) = pointer.strip_prefix("/materials/").and_then(split_index) {
            let property = property(path)?;
            let exists = material < self.root.materials.len();
            return row(exists, AnimationTarget::Material(material, property));
        }
        if let Some((light, path)) = pointer.strip_prefix(LIGHT_PATH).and_then(split_index) {
            let (_, property) = LIGHT_PROPERTIES.iter().find(|(other, _)| *other == path)?;
            return Some(vec![AnimationTarget::Light(light, *property)]);
        }
        let (camera, path) = pointer.strip_prefix("/cameras/").and_then(split_index)?;
        let (_, target) = CAMERA_PROPERTIES.iter().find(|(other, _)| *other == path)?;
        Some(vec![target(camera)])
    }
}

fn property(path: &str) -> Option<MaterialProperty> {
    if let Some((_, property)) = MATERIAL_PROPERTIES.iter().find(|(other, _)| *other == path) {
        return Some(*property);
    }
    UV_PROPERTIES.iter().find_map(|(part, property)| {
        let texture = path.strip_suffix(part)?;
        let (_, used, _) = TEXTURES.iter().find(|(other, ..)| *other == texture)?;
        Some(P::Uv(*used, *property))
    })
}

impl Builder<'_, '_> {
    /// Materials that channels animate; each material is in its rest state.
    pub(crate) fn animated_materials(&self, targets: impl Iterator<Item = AnimationTarget>) -> Vec<AnimatedMaterial> {
        let mut moving: Vec<AnimatedMaterial> = Vec::new();
        for target in targets {
            let AnimationTarget::Material(material, property) = target else { continue };
            let document = &self.document.root.materials;
            let (Some(json), Some(base)) = (document.get(material), self.world.materials.get(material)) else {
                continue;
            };
            let known = moving.iter().position(|other| other.material == material);
            let index = known.unwrap_or_else(|| {
                let strength = json.extensions.emissive_strength.as_ref();
                let strength = strength.and_then(|e| e.emissive_strength).unwrap_or(1.0);
                moving.push(AnimatedMaterial {
                    material,
                    base: base.clone(),
                    emission: (json.emissive_factor.map(|v| v as f32), strength as f32),
                    uvs: Vec::new(),
                });
                moving.len() - 1
            });
            let P::Uv(used, _) = property else { continue };
            let uvs = &mut moving[index].uvs;
            let info = TEXTURES.iter().find(|(_, other, _)| *other == used);
            if let Some(info) = info.and_then(|(_, _, find)| find(json))
                && uvs.iter().all(|(other, _)| *other != used)
            {
                uvs.push((used, info.uv_transform()));
            }
        }
        moving
    }
}
