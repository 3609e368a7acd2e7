//! What paths do at rough metals and plain principled surfaces, many at a time: what [`PathTracer::step`] does one by one.

use glam::Vec3;
use raycam_bvh::Hit;

use crate::bsdf::batch::glossy::GlossyBsdfBatch;
use crate::integrator::batch::hits::HitBatch;
use crate::integrator::path::{PathState, WavefrontQueues};
use crate::integrator::shade::PathTracer;
use crate::interaction::LightSampleContext;
use crate::interaction::batch::SurfaceInteractions;
use crate::prepare::material::PreparedMaterial;
use crate::soa::LANES;

impl PathTracer<'_> {
    /// Sets a lane, where [`PathTracer::shade_glossy`] knows what happens there.
    #[inline]
    pub(crate) fn load_glossy(
        &self,
        path: &PathState,
        (prepared, hit): (&PreparedMaterial, &Hit),
        (places, lane): (&SurfaceInteractions<LANES>, usize),
        points: &mut GlossyBsdfBatch<LANES>,
    ) {
        let material = &prepared.material;
        // What the camera sees through something else chooses lights as nothing else does by now.
        let late = self.light_sampling(path) != self.light_sampling_of_bounce();
        let known = prepared.glossy && path.interior_list.is_empty();
        if !known || late || self.is_culled_back_face(path, material, places.is_front(lane)) {
            return;
        }
        if self.batch_direct_lighting
            || !(self.has_light_samples || self.settings.ambient_term.is_some())
        {
            points.set_lane((places, lane), &self.world.geometry, prepared, hit);
        }
    }

    /// [`PathTracer::step`] at a lane of [`GlossyBsdfBatch`].
    #[inline]
    pub(crate) fn shade_glossy(
        &self,
        path: &mut PathState,
        meetings: &HitBatch,
        lane: usize,
        hit: &Hit,
        wave: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let HitBatch {
            places,
            path_lanes: arriving,
            ..
        } = meetings;
        let out = &mut radiance[path.ray_index];
        let from = LightSampleContext {
            position: places.position(lane),
            normal: places.geometric_normal(lane),
        };
        let material = &self.world.geometry.material(hit).material;
        let distance = (from.position - path.prev_context.position).length();
        if arriving.may_cross_light[lane] {
            self.add_intersected_lights(path, distance, out);
        }
        self.add_emission(path, material, hit, distance, out);
        if !self.is_free_bounce(path) && path.depth >= self.settings.max_depth {
            return false;
        }
        if self.batch_direct_lighting {
            meetings
                .direct_lighting
                .push_shadow_rays(lane, path.ray_index, &mut wave.shadow_rays);
        }
        match meetings.glossy.sample(lane) {
            Some((sample, start)) => {
                self.continue_path(path, &sample, start, from, path.interior_list, wave)
            }
            None => false,
        }
    }
}
