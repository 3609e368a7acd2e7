//! Properties that depend only on the material: its batch kind, its interior, its dispersion.

use glam::Vec3;
use raycam_scene::{Material, MaterialModel, Principled};

use crate::lobes::albedo_dielectric::{DielectricAlbedo, FresnelModel};
use crate::lobes::ggx::Ggx;

/// Batched BSDF that evaluates a material's hits. Single hits may still be moved to [`BatchKind::General`],
/// for example because of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum BatchKind {
    /// Only Lambertian reflection; the albedo is this factor times the base colour.
    Diffuse(f32),
    /// A smooth conductor, or a clear dielectric that has the same index of refraction for all colours.
    Specular,
    /// A rough isotropic interface over a diffuse base, perhaps under a clear coat and a sheen.
    Glossy,
    /// A rough isotropic interface that refracts, and nothing else.
    RoughDielectric,
    /// All other materials, which are evaluated one hit at a time.
    General,
}

impl BatchKind {
    pub fn from_material(material: &Material) -> Self {
        let is_bare = !material.bends_normals() && material.emission.value == [0.0; 3];
        match &material.model {
            MaterialModel::Phong { diffuse, specular, .. } if *specular == [0.0; 3] && is_bare => {
                Self::Diffuse(*diffuse)
            }
            MaterialModel::Metal(metal) if !is_smooth(metal.roughness) => Self::Glossy,
            MaterialModel::Metal(_) if is_bare => Self::Specular,
            MaterialModel::Glass(glass) if is_smooth(glass.roughness) => match is_bare && !is_dispersive(material) {
                true => Self::Specular,
                false => Self::General,
            },
            MaterialModel::Glass(glass) if !glass.thin && glass.dispersion == 0.0 => Self::RoughDielectric,
            MaterialModel::Principled(p) => Self::from_principled(p, is_bare),
            MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Boundary => Self::General,
            MaterialModel::Metal(_) | MaterialModel::Glass(_) => Self::General,
        }
    }

    fn from_principled(p: &Principled, is_bare: bool) -> Self {
        let strengths = [&p.diffuse_transmission, &p.iridescence, &p.anisotropy];
        let is_simple = strengths.iter().all(|strength| strength.value == 0.0) && p.dispersion == 0.0;
        let is_interface_only = p.clearcoat.value == 0.0 && p.sheen_color.value == [0.0; 3];
        let is_smooth = is_smooth(p.roughness.value);
        let is_clear = p.transmission.value == 1.0 && p.metallic.value == 0.0 && is_smooth;
        if !is_simple {
            Self::General
        } else if p.transmission.value == 0.0 {
            Self::Glossy
        } else if is_interface_only && is_clear && is_bare {
            Self::Specular
        } else if is_interface_only && has_interior(p) && !is_smooth {
            Self::RoughDielectric
        } else {
            Self::General
        }
    }

    /// True if sampling the BSDF requires a random number that selects a lobe.
    pub fn needs_lobe_choice(self, material: &Material) -> bool {
        match self {
            Self::Specular => !matches!(material.model, MaterialModel::Metal(_)),
            Self::Glossy | Self::RoughDielectric => true,
            Self::Diffuse(_) | Self::General => false,
        }
    }
}

/// True if an interface of this perceptual roughness is a mirror.
pub(crate) fn is_smooth(roughness: f32) -> bool {
    Ggx::isotropic(roughness).effectively_smooth()
}

/// True if a principled material refracts: it has a volume and transmits light.
pub(crate) fn has_interior(p: &Principled) -> bool {
    p.thickness.value > 0.0 && p.ior > 0.0 && p.transmission.value > 0.0
}

/// True if a material refracts light like smooth glass with an interior.
pub(crate) fn is_solid_glass(material: &Material) -> bool {
    /// Perceptual roughness below which glass counts as smooth; light sampling works at rougher surfaces.
    const MAX_ROUGHNESS: f32 = 0.05;
    match &material.model {
        MaterialModel::Glass(glass) => !glass.thin && glass.roughness < MAX_ROUGHNESS,
        MaterialModel::Principled(p) => {
            has_interior(p) && p.transmission.value > 0.5 && p.roughness.value < MAX_ROUGHNESS
        }
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) | MaterialModel::Boundary => false,
    }
}

/// True if light passes straight through a material's surface: thin, smooth, without other layers.
pub(crate) fn is_straight(material: &Material) -> bool {
    let is_thin = match &material.model {
        MaterialModel::Glass(glass) => glass.thin,
        MaterialModel::Principled(p) => p.transmission.value > 0.0 && !has_interior(p),
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) | MaterialModel::Boundary => false,
    };
    is_thin && BatchKind::from_material(material) == BatchKind::Specular
}

/// True if a material transmits no light: light passes its surface only where the opacity is below 1.
pub(crate) fn reflects_only(material: &Material) -> bool {
    match &material.model {
        MaterialModel::Principled(p) => p.transmission.value == 0.0 && p.diffuse_transmission.value == 0.0,
        MaterialModel::Glass(_) => false,
        MaterialModel::Boundary => false,
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) => true,
    }
}

/// True if a material refracts each colour by a different angle.
pub(crate) fn is_dispersive(material: &Material) -> bool {
    match &material.model {
        MaterialModel::Principled(p) => p.dispersion > 0.0 && has_interior(p),
        MaterialModel::Glass(glass) => glass.dispersion > 0.0 && !glass.thin,
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) | MaterialModel::Boundary => false,
    }
}

/// Albedo tables of a material that refracts: one for each colour if the colours' indices of refraction differ.
pub(crate) fn dielectric_tables(material: &Material) -> Vec<DielectricAlbedo> {
    let (index, dispersion, fresnel_model) = match &material.model {
        MaterialModel::Glass(glass) if !glass.thin => (glass.ior, glass.dispersion, FresnelModel::Exact),
        MaterialModel::Principled(p) if has_interior(p) => (p.ior, p.dispersion, FresnelModel::Schlick),
        MaterialModel::Glass(_) | MaterialModel::Principled(_) => return vec![],
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) | MaterialModel::Boundary => {
            return vec![];
        }
    };
    let table = |channel| DielectricAlbedo::new(ior_of_channel(index, dispersion, channel), fresnel_model);
    match is_dispersive(material) {
        true => [0, 1, 2].map(|channel| table(Some(channel))).into(),
        false => vec![table(None)],
    }
}

/// The absorption per metre in the interior of a material; none for materials without an interior.
pub(crate) fn interior_absorption(material: &Material) -> Option<Vec3> {
    match &material.model {
        MaterialModel::Principled(p) => {
            let is_passed = p.transmission.value > 0.0 || p.diffuse_transmission.value > 0.0;
            (is_passed && p.thickness.value > 0.0)
                .then(|| absorption_coefficient(p.attenuation_color, p.attenuation_distance))
        }
        MaterialModel::Glass(glass) => {
            (!glass.thin).then(|| absorption_coefficient(glass.attenuation_color, glass.attenuation_distance))
        }
        MaterialModel::Boundary => Some(Vec3::ZERO),
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) => None,
    }
}

/// The index of refraction in the interior of a material, for a colour channel.
pub(crate) fn interior_ior(material: &Material, channel: Option<usize>) -> f32 {
    match &material.model {
        MaterialModel::Glass(glass) if !glass.thin => ior_of_channel(glass.ior, glass.dispersion, channel),
        MaterialModel::Principled(p) if has_interior(p) => ior_of_channel(p.ior, p.dispersion, channel),
        MaterialModel::Glass(_) | MaterialModel::Principled(_) => 1.0,
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) | MaterialModel::Boundary => 1.0,
    }
}

/// The index of refraction of a colour channel (`KHR_materials_dispersion`).
pub(crate) fn ior_of_channel(ior: f32, dispersion: f32, channel: Option<usize>) -> f32 {
    let spread = (ior - 1.0) * 0.025 * dispersion;
    ior + match channel {
        Some(0) => -spread,
        Some(2) => spread,
        _ => 0.0,
    }
}

/// Absorption per metre of a medium in which white light has this colour after this distance (Beer's law).
fn absorption_coefficient(color: [f32; 3], distance: f32) -> Vec3 {
    if distance.is_infinite() {
        return Vec3::ZERO;
    }
    // Black would require an infinite coefficient. It is stored as a large finite one, with which no light remains
    // after a small part of the distance.
    Vec3::from(color.map(|part| -part.max(1e-30).ln() / distance))
}
