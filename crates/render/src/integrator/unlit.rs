//! `flat`: the lecture's picture, the base colour of the nearest triangle, whatever the light.

use glam::Vec3;

use crate::integrator::{Batch, is_miss};
use crate::prepare::PreparedWorld;
use crate::prepare::texture::Footprint;
use crate::settings::Integrator;

pub(crate) fn radiance(
    world: &PreparedWorld,
    batch: &Batch,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) {
    let lights = Integrator::Flat.lights(world);
    let rays = batch.hits.iter().zip(batch.directions);
    for ((hit, &direction), (radiance, sky)) in rays.zip(radiance.iter_mut().zip(sky)) {
        *sky = is_miss(hit);
        *radiance = if *sky {
            lights.sky(direction, None)
        } else {
            world.base_color(hit, &Footprint::default())
        };
    }
}
