//! `flat`: base colour of the nearest triangle, independent of the lights.

use glam::Vec3;

use crate::integrator::camera_ray_batch::{CameraRayBatch, is_miss};
use crate::integrator::closed_form_fog::fade_unlit;
use crate::integrator::requirements::effective_lights;
use crate::light::lights::LightView;
use crate::media::map::MediaMap;
use crate::prepare::world::PreparedWorld;
use crate::settings::Integrator;

/// Sets the base colour along every camera ray, or the radiance of the environment.
pub(crate) fn radiance(
    world: &PreparedWorld,
    batch: &CameraRayBatch,
    radiance: &mut [Vec3],
    is_background: &mut [bool],
) {
    let lights = effective_lights(Integrator::Flat, world).view(LightView::Camera);
    let media = MediaMap::new(&world.geometry);
    let rays = batch.hits.iter().zip(batch.directions).zip(batch.ray_cones).enumerate();
    for ((index, ((hit, &direction), cone)), (radiance, is_background)) in
        rays.zip(radiance.iter_mut().zip(is_background))
    {
        *is_background = is_miss(hit);
        *radiance = if *is_background {
            lights.escaped_radiance(direction, None)
        } else {
            let footprint = world.geometry.footprint(hit, direction, &cone.propagate(hit.t));
            world.geometry.base_color(hit, &footprint)
        };
        if let Some(media) = &media {
            fade_unlit(media, &world.geometry, batch, index, radiance);
        }
    }
}
