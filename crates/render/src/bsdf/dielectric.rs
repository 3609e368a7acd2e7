//! Glass: solid dielectrics, and panes of two parallel interfaces.

use glam::Vec3;
use raycam_scene::Glass;

use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::material_hit::MaterialHit;
use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::classify::ior_of_channel;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;

/// Index of refraction of the far side relative to the viewer's side; for a pane, the pane's own index.
pub(crate) fn eta(glass: &Glass, hit: &MaterialHit) -> f32 {
    eta_of_side(glass, hit.is_front, hit.channel, hit.outside_ior)
}

/// Same as [`eta`], for a given side of the surface, colour channel and index of refraction outside.
pub(crate) fn eta_of_side(glass: &Glass, is_front: bool, channel: Option<usize>, outside_ior: f32) -> f32 {
    let ior = ior_of_channel(glass.ior, glass.dispersion, channel);
    match (glass.thin, is_front) {
        (true, _) => ior,
        (false, true) => ior / outside_ior,
        (false, false) => outside_ior / ior,
    }
}

/// Reflectance of an interface of solid glass, or of a whole pane.
pub(crate) fn fresnel(glass: &Glass, eta: f32) -> Fresnel {
    if glass.thin { Fresnel::ThinDielectric(eta) } else { Fresnel::Dielectric(eta) }
}

/// Relative index of refraction by which light is refracted; 1 for a pane.
pub(crate) fn relative_ior(glass: &Glass, eta: f32) -> f32 {
    if glass.thin { 1.0 } else { eta }
}

/// Layer stack of glass: a single interface, whose base colour tints transmitted light.
pub(crate) fn layer_stack<'a>(
    glass: &Glass,
    eta: f32,
    base: Vec3,
    dielectric_albedo: Option<&'a DielectricAlbedo>,
) -> LayerStack<'a> {
    let fresnel = fresnel(glass, eta);
    LayerStack {
        fresnel,
        base_fresnel: fresnel,
        ggx: Ggx::isotropic(glass.roughness),
        diffuse: Vec3::ZERO,
        diffuse_transmission: Vec3::ZERO,
        transmission: base,
        eta: relative_ior(glass, eta),
        dielectric_albedo,
        coat: None,
        sheen: None,
    }
}
