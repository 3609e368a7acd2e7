//! Metals by their index of refraction.

use glam::Vec3;
use raycam_scene::Metal;

use crate::bsdf::layered::Layers;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;

/// What it reflects, multiplied by a base colour.
pub(crate) fn fresnel(metal: &Metal, base: Vec3) -> Fresnel {
    Fresnel::Conductor {
        ior: metal.ior.into(),
        extinction: metal.extinction.into(),
        tint: base,
    }
}

/// A metal whose reflection is multiplied by a base colour.
pub(crate) fn layers(metal: &Metal, base: Vec3) -> Layers<'static> {
    let fresnel = fresnel(metal, base);
    Layers {
        fresnel,
        over: fresnel,
        ggx: Ggx::isotropic(metal.roughness),
        diffuse: Vec3::ZERO,
        through: Vec3::ZERO,
        transmission: Vec3::ZERO,
        eta: 1.0,
        interface: None,
        coat: None,
        sheen: None,
    }
}
