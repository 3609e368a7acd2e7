//! Animated properties of materials (`KHR_animation_pointer`). Factors that are animated separately are stored
//! separately.

use serde::{Deserialize, Serialize};

use crate::material::principled::Principled;
use crate::material::{Alpha, Material};
use crate::texture::TextureSlot;

/// Property of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names are equal to the fields of `Material` and `Principled`")]
pub enum MaterialProperty {
    /// Colour with opacity: four numbers.
    BaseColor,
    Metallic,
    Roughness,
    AlphaCutoff,
    /// Emitted colour: three numbers, multiplied by the strength.
    EmissionColor,
    EmissionStrength,
    NormalScale,
    OcclusionStrength,
    Ior,
    Specular,
    SpecularColor,
    Transmission,
    Thickness,
    AttenuationColor,
    AttenuationDistance,
    Dispersion,
    Clearcoat,
    ClearcoatRoughness,
    ClearcoatNormalScale,
    SheenColor,
    SheenRoughness,
    Iridescence,
    IridescenceIor,
    IridescenceThinnest,
    IridescenceThickest,
    Anisotropy,
    AnisotropyRotation,
    DiffuseTransmission,
    DiffuseTransmissionColor,
    /// Transform of a texture's coordinates.
    Uv(TextureSlotKind, UvProperty),
}

/// Texture of a material, by its purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names are equal to the fields of `Material` and `Principled`")]
pub enum TextureSlotKind {
    BaseColor,
    MetallicRoughness,
    Normal,
    Occlusion,
    Emission,
    Specular,
    SpecularColor,
    Transmission,
    Thickness,
    Clearcoat,
    ClearcoatRoughness,
    ClearcoatNormal,
    SheenColor,
    SheenRoughness,
    Iridescence,
    IridescenceThickness,
    Anisotropy,
    DiffuseTransmission,
    DiffuseTransmissionColor,
}

/// Part of a texture's transform (`KHR_texture_transform`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum UvProperty {
    /// Translation of the coordinates: two numbers.
    Offset,
    /// Rotation in radians, counter-clockwise in the image.
    Rotation,
    /// Scale of the coordinates along u and v: two numbers.
    Scale,
}

/// Translation * rotation * scale of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UvTransform {
    /// Translation, applied last.
    pub offset: [f64; 2],
    /// Rotation in radians, counter-clockwise in the image.
    pub rotation: f64,
    /// Scale per axis, applied first.
    pub scale: [f64; 2],
}

impl UvTransform {
    /// Returns the 2x3 matrix that [`TextureSlot`] contains.
    pub fn image_from_mesh(&self) -> [[f32; 3]; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let ([x, y], [width, height]) = (self.offset, self.scale);
        [[cos * width, sin * height, x], [-sin * width, cos * height, y]].map(|row| row.map(|v| v as f32))
    }
}

/// An animated material at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnimatedMaterial {
    /// Index into the world's materials.
    pub material: usize,
    /// The material without animation, with all its properties.
    pub base: Material,
    /// Emitted colour, and the strength by which it is multiplied.
    pub emission: ([f32; 3], f32),
    /// Transforms of the material's texture coordinates.
    pub uvs: Vec<(TextureSlotKind, UvTransform)>,
}

impl AnimatedMaterial {
    /// Sets a property; has no effect if the material does not have this property. Values beyond the valid range are
    /// clamped, so that the material stays valid.
    pub(super) fn set(&mut self, property: MaterialProperty, value: &[f64]) {
        use MaterialProperty as P;
        let first = value.first().map_or(0.0, |&v| v as f32);
        let share = first.clamp(0.0, 1.0);
        let positive = first.max(0.0);
        let color: [f32; 3] = std::array::from_fn(|i| value.get(i).map_or(0.0, |&v| v.max(0.0) as f32));
        let shares = color.map(|v| v.min(1.0));
        let base = &mut self.base;
        match property {
            P::BaseColor => {
                base.color = shares;
                base.opacity = value.get(3).map_or(1.0, |&v| v.clamp(0.0, 1.0) as f32);
            }
            P::AlphaCutoff => {
                if let Alpha::Mask { cutoff } = &mut base.alpha {
                    *cutoff = positive;
                }
            }
            P::EmissionColor => self.emission.0 = shares,
            P::EmissionStrength => self.emission.1 = positive,
            P::NormalScale => {
                if let Some(normal) = &mut base.normal_map {
                    normal.scale = first;
                }
            }
            P::OcclusionStrength => {
                if let Some(occlusion) = &mut base.occlusion {
                    occlusion.value = share;
                }
            }
            P::Uv(texture, part) => {
                let found = self.uvs.iter_mut().find(|(other, _)| *other == texture);
                if let (Some((_, uv)), [x, ..]) = (found, value) {
                    let pair = [*x, value.get(1).copied().unwrap_or(*x)];
                    match part {
                        UvProperty::Offset => uv.offset = pair,
                        UvProperty::Rotation => uv.rotation = *x,
                        UvProperty::Scale => uv.scale = pair,
                    }
                }
            }
            property => {
                if let Some(principled) = base.model.as_principled_mut() {
                    set_principled(principled, property, (first, share, positive), (color, shares));
                }
            }
        }
    }

    /// Returns the material at the current time.
    pub(crate) fn material(self) -> Material {
        let mut material = self.base;
        material.emission.value = self.emission.0.map(|v| v * self.emission.1);
        for (texture, uv) in self.uvs {
            for slot in slots_of_kind(&mut material, texture) {
                slot.image_from_mesh = uv.image_from_mesh();
            }
        }
        material
    }
}

fn set_principled(
    p: &mut Principled,
    property: MaterialProperty,
    (value, share, positive): (f32, f32, f32),
    (color, shares): ([f32; 3], [f32; 3]),
) {
    use MaterialProperty as P;
    match property {
        P::Metallic => p.metallic.value = share,
        P::Roughness => p.roughness.value = share,
        P::Ior => p.ior = if value == 0.0 { 0.0 } else { value.max(1.0) },
        P::Specular => p.specular.value = share,
        P::SpecularColor => p.specular_color.value = color,
        P::Transmission => p.transmission.value = share,
        P::Thickness => p.thickness.value = positive,
        P::AttenuationColor => p.attenuation_color = shares,
        P::AttenuationDistance => p.attenuation_distance = value.max(f32::MIN_POSITIVE),
        P::Dispersion => p.dispersion = positive,
        P::Clearcoat => p.clearcoat.value = share,
        P::ClearcoatRoughness => p.clearcoat_roughness.value = share,
        P::ClearcoatNormalScale => {
            if let Some(normal) = &mut p.clearcoat_normal {
                normal.scale = value;
            }
        }
        P::SheenColor => p.sheen_color.value = shares,
        P::SheenRoughness => p.sheen_roughness.value = share,
        P::Iridescence => p.iridescence.value = share,
        P::IridescenceIor => p.iridescence_ior = value.max(1.0),
        P::IridescenceThinnest => p.iridescence_thickness[0] = positive,
        P::IridescenceThickest => p.iridescence_thickness[1] = positive,
        P::Anisotropy => p.anisotropy.value = share,
        P::AnisotropyRotation => p.anisotropy_rotation = value,
        P::DiffuseTransmission => p.diffuse_transmission.value = share,
        P::DiffuseTransmissionColor => p.diffuse_transmission_color.value = shares,
        // Every material has these properties, so the caller sets them.
        P::BaseColor
        | P::AlphaCutoff
        | P::EmissionColor
        | P::EmissionStrength
        | P::NormalScale
        | P::OcclusionStrength
        | P::Uv(..) => {}
    }
}

/// The texture slots of a material that belong to this purpose.
fn slots_of_kind(material: &mut Material, texture: TextureSlotKind) -> Vec<&mut TextureSlot> {
    use TextureSlotKind as T;
    match texture {
        T::BaseColor => return material.texture.iter_mut().collect(),
        T::Emission => return material.emission.texture.iter_mut().collect(),
        T::Normal => return material.normal_map.iter_mut().map(|n| &mut n.texture).collect(),
        T::Occlusion => {
            return material.occlusion.iter_mut().flat_map(|o| o.texture.iter_mut()).collect();
        }
        _ => {}
    }
    let Some(p) = material.model.as_principled_mut() else { return Vec::new() };
    let slot = match texture {
        T::MetallicRoughness => {
            return p.metallic.texture.iter_mut().chain(p.roughness.texture.iter_mut()).collect();
        }
        T::ClearcoatNormal => return p.clearcoat_normal.iter_mut().map(|n| &mut n.texture).collect(),
        T::Specular => &mut p.specular.texture,
        T::SpecularColor => &mut p.specular_color.texture,
        T::Transmission => &mut p.transmission.texture,
        T::Thickness => &mut p.thickness.texture,
        T::Clearcoat => &mut p.clearcoat.texture,
        T::ClearcoatRoughness => &mut p.clearcoat_roughness.texture,
        T::SheenColor => &mut p.sheen_color.texture,
        T::SheenRoughness => &mut p.sheen_roughness.texture,
        T::Iridescence => &mut p.iridescence.texture,
        T::IridescenceThickness => &mut p.iridescence_thickness_texture,
        T::Anisotropy => &mut p.anisotropy.texture,
        T::DiffuseTransmission => &mut p.diffuse_transmission.texture,
        T::DiffuseTransmissionColor => &mut p.diffuse_transmission_color.texture,
        T::BaseColor | T::Emission | T::Normal | T::Occlusion => return Vec::new(),
    };
    slot.iter_mut().collect()
}
