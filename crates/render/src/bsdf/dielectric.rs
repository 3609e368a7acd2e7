//! Glass: Fresnel's equations, refraction, and panes.

use glam::Vec3;
use raycam_scene::Glass;

use crate::bsdf::layered::LayerStack;
use crate::bsdf::principled::{absorption_coefficient, ior_of_channel};
use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;

/// The index of the other side relative to the viewer's, where that of what is around the glass is `around`; a pane's own.
pub(crate) fn eta(glass: &Glass, front: bool, channel: Option<usize>, around: f32) -> f32 {
    let ior = ior_of_channel(glass.ior, glass.dispersion, channel);
    match (glass.thin, front) {
        (true, _) => ior,
        (false, true) => ior / around,
        (false, false) => around / ior,
    }
}

/// What its interface reflects, or a whole pane.
pub(crate) fn fresnel(glass: &Glass, eta: f32) -> Fresnel {
    if glass.thin {
        Fresnel::ThinDielectric(eta)
    } else {
        Fresnel::Dielectric(eta)
    }
}

/// The index of the other side relative to the viewer's.
pub(crate) fn relative_ior(glass: &Glass, eta: f32) -> f32 {
    if glass.thin { 1.0 } else { eta }
}

/// Glass whose base colour tints what passes its surface.
pub(crate) fn layer_stack<'a>(
    glass: &Glass,
    eta: f32,
    base: Vec3,
    interface: Option<&'a DielectricAlbedo>,
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
        dielectric_albedo: interface,
        coat: None,
        sheen: None,
    }
}

/// Its absorption per metre, where it has an inside.
pub(crate) fn interior_absorption(glass: &Glass) -> Option<Vec3> {
    (!glass.thin)
        .then(|| absorption_coefficient(glass.attenuation_color, glass.attenuation_distance))
}
