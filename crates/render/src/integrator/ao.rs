//! `ao`: ambient occlusion, the cosine-weighted fraction of the hemisphere that is open.

use glam::Vec3;
use raycam_bvh::Coherence;

use crate::integrator::camera_ray_batch::{CameraRayBatch, is_miss};
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::SurfaceInteraction;
use crate::interaction::ray_cone::RayCone;
use crate::lobes::shading_frame::{sample_cosine_hemisphere, to_world_around};
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;

/// Sets the radiance of each ray: 1 for the background; for a hit, 1 if a random direction of the hemisphere
/// is open up to `distance`, and 0 if a surface occludes this direction.
pub(super) fn radiance(
    world: &PreparedWorld,
    distance: f32,
    batch: &CameraRayBatch,
    radiance: &mut [Vec3],
    is_background: &mut [bool],
) {
    let mut queue = ShadowRayQueue::default();
    for (i, hit) in batch.hits.iter().enumerate() {
        if is_miss(hit) {
            radiance[i] = Vec3::ONE;
            is_background[i] = true;
            continue;
        }
        radiance[i] = Vec3::ZERO;
        let interaction = SurfaceInteraction::new(&world.geometry, batch.directions[i], hit, &RayCone::default());
        let random = batch.samplers[i].get_2d(Dimension::AmbientOcclusion);
        let direction = to_world_around(interaction.side_normal, sample_cosine_hemisphere(random));
        queue.push(interaction.spawn_ray(direction, distance), i, Vec3::ONE);
    }
    queue.trace(&world.geometry, batch.scene, Coherence::Incoherent, None, None, radiance);
}
