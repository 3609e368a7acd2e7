//! Layers of conductors, which are described by a complex index of refraction.

use glam::Vec3;
use raycam_scene::Metal;

use crate::bsdf::layer_stack::LayerStack;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;

/// Reflectance of a metal, multiplied by a base colour.
pub(crate) fn fresnel(metal: &Metal, base: Vec3) -> Fresnel {
    Fresnel::Conductor { ior: metal.ior.into(), extinction: metal.extinction.into(), tint: base }
}

/// Layer stack of a metal: only an interface.
pub(crate) fn layer_stack(metal: &Metal, base: Vec3) -> LayerStack<'static> {
    let fresnel = fresnel(metal, base);
    LayerStack {
        fresnel,
        base_fresnel: fresnel,
        ggx: Ggx::isotropic(metal.roughness),
        diffuse: Vec3::ZERO,
        diffuse_transmission: Vec3::ZERO,
        transmission: Vec3::ZERO,
        eta: 1.0,
        dielectric_albedo: None,
        coat: None,
        sheen: None,
    }
}
