//! `ao`: how much of the sky each point of a surface sees, as if everything were white and matte.

use glam::Vec3;
use raycam_bvh::Coherence;

use super::{Batch, is_miss};
use crate::bsdf::{above, cosine_direction};
use crate::integrator::shadow_queue::Shadows;
use crate::interaction::Place;
use crate::prepare::PreparedWorld;
use crate::sampling::sampler::Pair;

/// 1 in the open and for the background, 0 where all directions, weighed by their cosine, end within `distance`.
pub(super) fn radiance(
    world: &PreparedWorld,
    distance: f32,
    batch: &Batch,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) {
    let mut shadows = Shadows::default();
    for (i, hit) in batch.hits.iter().enumerate() {
        if is_miss(hit) {
            radiance[i] = Vec3::ONE;
            sky[i] = true;
            continue;
        }
        radiance[i] = Vec3::ZERO;
        let place = Place::new(world, batch.directions[i], hit, 0.0);
        let random = batch.samplers[i].pair(Pair::Ambient);
        let direction = above(place.geometric, cosine_direction(random));
        shadows.ask(place.leaving(direction, distance), i, Vec3::ONE);
    }
    shadows.settle(world, batch.scene, Coherence::Incoherent, radiance);
}
