//! `flat`: the lecture's picture, the base colour of the nearest triangle, whatever the light.

use glam::Vec3;

use crate::integrator::{CameraRayBatch, is_miss};
use crate::interaction::ray_cone::Footprint;
use crate::prepare::world::PreparedWorld;
use crate::settings::Integrator;

pub(crate) fn radiance(
    world: &PreparedWorld,
    batch: &CameraRayBatch,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) {
    let lights = Integrator::Flat.effective_lights(world);
    let rays = batch.hits.iter().zip(batch.directions);
    for ((hit, &direction), (radiance, sky)) in rays.zip(radiance.iter_mut().zip(sky)) {
        *sky = is_miss(hit);
        *radiance = if *sky {
            lights.escaped_radiance(direction, None)
        } else {
            world.geometry.base_color(hit, &Footprint::default())
        };
    }
}
