//! Requirements of integrators: lights, and rays beyond the first hit.

use crate::light::lights::Lights;
use crate::prepare::world::PreparedWorld;
use crate::settings::Integrator;

/// Lights of a world, or default lights if the integrator requires light and the world has none.
pub(crate) fn effective_lights(integrator: Integrator, world: &PreparedWorld) -> &Lights {
    let lighting = world.lighting();
    match &lighting.default_lights {
        Some(lights) if needs_light(integrator) => lights,
        _ => &lighting.lights,
    }
}

/// True if the integrator traces further rays from the first hit.
pub(crate) fn traces_secondary_rays(integrator: Integrator) -> bool {
    integrator != Integrator::Flat
}

/// True if the integrator computes light from emitters.
pub(crate) fn needs_light(integrator: Integrator) -> bool {
    matches!(integrator, Integrator::Direct | Integrator::Path)
}
