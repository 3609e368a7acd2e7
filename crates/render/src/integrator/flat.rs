//! `flat`: the lecture's picture, the base colour of the nearest triangle, whatever the light.

use glam::Vec3;

use super::{Batch, is_miss};
use crate::prepare::PreparedWorld;
use crate::settings::Integrator;

pub(super) fn radiance(world: &PreparedWorld, batch: &Batch, radiance: &mut [Vec3]) {
    let lights = Integrator::Flat.lights(world);
    for ((hit, &direction), radiance) in batch.hits.iter().zip(batch.directions).zip(radiance) {
        *radiance = if is_miss(hit) {
            lights.sky(direction)
        } else {
            world.base_color(hit)
        };
    }
}
