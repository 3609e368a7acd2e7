//! `ao`: how much of the sky each point of a surface sees, as if everything were white and matte.

use glam::Vec3;
use raycam_bvh::Coherence;

use super::{CameraRayBatch, is_miss};
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::SurfaceInteraction;
use crate::lobes::shading_frame::{sample_cosine_hemisphere, to_world_around};
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;

/// 1 in the open and for the background, 0 where all directions, weighed by their cosine, end within `distance`.
pub(super) fn radiance(
    world: &PreparedWorld,
    distance: f32,
    batch: &CameraRayBatch,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) {
    let mut shadows = ShadowRayQueue::default();
    for (i, hit) in batch.hits.iter().enumerate() {
        if is_miss(hit) {
            radiance[i] = Vec3::ONE;
            sky[i] = true;
            continue;
        }
        radiance[i] = Vec3::ZERO;
        let place = SurfaceInteraction::new(&world.geometry, batch.directions[i], hit, 0.0);
        let random = batch.samplers[i].get_2d(Dimension::AmbientOcclusion);
        let direction = to_world_around(place.geometric_normal, sample_cosine_hemisphere(random));
        shadows.push(place.spawn_ray(direction, distance), i, Vec3::ONE);
    }
    shadows.trace(world, batch.scene, Coherence::Incoherent, radiance);
}
