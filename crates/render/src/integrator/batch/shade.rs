//! Shading of a chunk's hits: with batched BSDFs, or one hit at a time.

use glam::Vec3;

use crate::bsdf::BsdfSample;
use crate::bsdf::batch::{BatchModel, BsdfBatch};
use crate::bsdf::shading_point::ShadingPoint;
use crate::integrator::batch::hits::{Chunk, HitBatch};
use crate::integrator::passes::FirstScattering;
use crate::integrator::path_state::{PathState, WavefrontQueues};
use crate::integrator::path_tracer::PathTracer;
use crate::interaction::LightSampleContext;
use crate::media::nested_dielectrics::InterfaceTransition;

/// One lane of a chunk.
#[derive(Clone, Copy)]
struct ChunkLane<'a> {
    hits: &'a HitBatch,
    chunk: Chunk<'a>,
    lane: usize,
}

impl PathTracer<'_> {
    /// Shades the hit of a lane; true if the path continues.
    pub fn shade_lane(
        &self,
        path: &mut PathState,
        (hits, chunk, lane): (&HitBatch, Chunk, usize),
        queues: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let at = ChunkLane { hits, chunk, lane };
        let bsdf = &hits.bsdf;
        if hits.alpha_rejected[lane] {
            let interaction = hits.interactions.lane(lane);
            let ray = interaction.ray_beyond(path.direction, f32::INFINITY);
            queues.next_rays.push(ray);
            true
        } else if bsdf.diffuse.is_active(lane) {
            self.shade_batch(path, &bsdf.diffuse, at, queues, radiance)
        } else if bsdf.glossy.is_active(lane) {
            self.shade_batch(path, &bsdf.glossy, at, queues, radiance)
        } else if bsdf.specular.is_active(lane) {
            self.shade_batch(path, &bsdf.specular, at, queues, radiance)
        } else if bsdf.rough_dielectric.is_active(lane) {
            self.shade_batch(path, &bsdf.rough_dielectric, at, queues, radiance)
        } else {
            self.shade(path, &hits.view(self, chunk, lane), queues, radiance)
        }
    }

    /// [`PathTracer::shade`] for a lane with a batched BSDF.
    #[inline]
    fn shade_batch<M: BatchModel>(
        &self,
        path: &mut PathState,
        bsdf: &BsdfBatch<M>,
        at: ChunkLane,
        queues: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let ChunkLane { hits, chunk, lane } = at;
        let geometric = hits.interactions.side_normal(lane);
        let context = LightSampleContext {
            position: hits.interactions.position(lane),
            normal: if bsdf.model.is_transmissive(lane) { Vec3::ZERO } else { geometric },
        };
        let out = &mut radiance[path.ray_index()];
        let may_cross_light = hits.path_lanes.may_cross_light[lane];
        let may_absorb = M::IS_TRANSMISSIVE && !path.interior_list.is_empty();
        if M::MAY_EMIT || may_cross_light || may_absorb {
            let distance = path.distance_to(context.position);
            self.apply_absorption(path, distance);
            if may_cross_light {
                self.add_intersected_lights(path, distance, out);
            }
            if M::MAY_EMIT {
                let hit = &chunk.hits[lane];
                let material = &self.geometry.material(hit).material;
                self.add_emission(path, material, hit, distance, out);
            }
        }
        let is_straight = M::IS_SPECULAR && self.geometry.material(&chunk.hits[lane]).is_straight;
        if self.is_at_max_depth(path) && !is_straight {
            return false;
        }
        if !M::IS_SPECULAR {
            self.queue_direct_lighting(path, bsdf, at, queues, out);
        }
        let far_side = hits.far_sides[lane];
        let advance = |path: &mut PathState, (sample, origin): (BsdfSample, Vec3), queues: &mut _| {
            if is_straight && geometric.dot(sample.wi) < 0.0 {
                return self.pass_straight(path, &sample, (context.position, origin), queues);
            }
            let interior_list =
                if M::IS_TRANSMISSIVE && geometric.dot(sample.wi) < 0.0 { far_side } else { path.interior_list };
            // If passes are recorded, only specular and diffuse BSDFs are batched, so the fraction of diffuse
            // light is 0 or 1.
            let diffuse = if M::IS_SPECULAR { Vec3::ZERO } else { Vec3::ONE };
            self.record_scattering(path, || FirstScattering::Surface { diffuse });
            self.continue_path(path, &sample, origin, context, interior_list, queues)
        };
        let split = M::transmitted_sample(&bsdf.view, lane).map(|sample| {
            path.split_count += 1;
            (*path, sample)
        });
        let continues = bsdf.samples.get(lane).is_some_and(|sample| advance(path, sample, queues));
        if let Some((mut path, sample)) = split
            && advance(&mut path, sample, queues)
        {
            queues.split_paths.push(path);
        }
        continues
    }

    /// Queues the shadow rays of a lane: the rays evaluated for the chunk, or otherwise rays computed for this lane.
    #[inline(always)]
    fn queue_direct_lighting<M: BatchModel>(
        &self,
        path: &PathState,
        bsdf: &BsdfBatch<M>,
        ChunkLane { hits, chunk, lane }: ChunkLane,
        queues: &mut WavefrontQueues,
        out: &mut Vec3,
    ) {
        let lighting = &hits.direct_lighting;
        let is_batched = self.modes.batch_direct_lighting && self.samples_lights_in_step(path);
        if is_batched && !M::IS_TRANSMISSIVE {
            lighting.push_shadow_rays(lane, path.ray_index(), &mut queues.shadow_rays);
        } else if is_batched {
            let interactions = &hits.interactions;
            let transition = InterfaceTransition {
                near_side: path.interior_list,
                far_side: hits.far_sides[lane],
                ..InterfaceTransition::no_interface(path.interior_list)
            };
            let transmittance = |wi, p_light| {
                let media = transition.medium_towards(interactions.side_normal(lane), wi);
                let origin = interactions.offset_ray_origin(lane, wi);
                (self.shadow_transmittance(path.ray_index(), media, origin, p_light), media)
            };
            let queues = &mut queues.shadow_rays;
            lighting.push_attenuated_shadow_rays(lane, path.ray_index(), queues, transmittance);
        } else if self.modes.has_light_samples() || self.settings.ambient_term.is_some() {
            let Some(bsdf) = bsdf.model.single(lane) else {
                return;
            };
            let view = hits.view(self, chunk, lane);
            let point = ShadingPoint {
                interaction: &view.interaction,
                frame: view.interaction.shading_frame(path.direction),
                bsdf,
            };
            let transition = InterfaceTransition::no_interface(path.interior_list);
            self.sample_lights(path, &point, transition, &view, queues, out);
        }
    }
}
