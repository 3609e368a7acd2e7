//! Glass: Fresnel's equations, refraction, and panes.

use glam::Vec3;
use raycam_scene::Glass;

use crate::bsdf::layered::Layers;
use crate::bsdf::principled::{absorption, dispersed};
use crate::lobes::albedo_dielectric::Interface;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;

/// The index of the other side relative to the viewer's, where that of what is around the glass is `around`; a pane's own.
pub(crate) fn eta(glass: &Glass, front: bool, channel: Option<usize>, around: f32) -> f32 {
    let ior = dispersed(glass.ior, glass.dispersion, channel);
    match (glass.thin, front) {
        (true, _) => ior,
        (false, true) => ior / around,
        (false, false) => around / ior,
    }
}

/// What its interface reflects, or a whole pane.
pub(crate) fn fresnel(glass: &Glass, eta: f32) -> Fresnel {
    if glass.thin {
        Fresnel::Pane(eta)
    } else {
        Fresnel::Dielectric(eta)
    }
}

/// The index of the other side relative to the viewer's.
pub(crate) fn beyond(glass: &Glass, eta: f32) -> f32 {
    if glass.thin { 1.0 } else { eta }
}

/// Glass whose base colour tints what passes its surface.
pub(crate) fn layers<'a>(
    glass: &Glass,
    eta: f32,
    base: Vec3,
    interface: Option<&'a Interface>,
) -> Layers<'a> {
    let fresnel = fresnel(glass, eta);
    Layers {
        fresnel,
        over: fresnel,
        ggx: Ggx::isotropic(glass.roughness),
        diffuse: Vec3::ZERO,
        through: Vec3::ZERO,
        transmission: base,
        eta: beyond(glass, eta),
        interface,
        coat: None,
        sheen: None,
    }
}

/// Its absorption per metre, where it has an inside.
pub(crate) fn inside(glass: &Glass) -> Option<Vec3> {
    (!glass.thin).then(|| absorption(glass.attenuation_color, glass.attenuation_distance))
}
