//! What paths do at rough glass, many at a time: what [`PathTracer::step`] does one by one.

use glam::Vec3;
use raycam_bvh::Hit;

use crate::bsdf::batch::rough_dielectric::RoughDielectricBsdfBatch;
use crate::integrator::batch::hits::HitBatch;
use crate::integrator::batch::path_lanes::PathLanes;
use crate::integrator::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::integrator::path::{PathState, WavefrontQueues};
use crate::integrator::shade::PathTracer;
use crate::interaction::LightSampleContext;
use crate::interaction::batch::SurfaceInteractions;
use crate::prepare::material::PreparedMaterial;
use crate::soa::LANES;

/// Paths at rough interfaces that refract.
#[derive(Debug, Default)]
pub(crate) struct Frosteds {
    /// What these do.
    pub points: RoughDielectricBsdfBatch<LANES>,
    /// What the paths are in before the surface, and behind it.
    before: [InteriorList; LANES],
    after: [InteriorList; LANES],
}

impl Frosteds {
    /// What light goes through between a lane and where it comes from, by the triangle's normal.
    #[inline]
    pub fn beyond(&self, lane: usize, geometric: Vec3, direction: Vec3) -> InteriorList {
        if geometric.dot(direction) < 0.0 {
            self.after[lane]
        } else {
            self.before[lane]
        }
    }
}

impl PathTracer<'_> {
    /// Sets a lane, where [`PathTracer::step_frosted`] knows what happens there.
    #[inline]
    pub(crate) fn put_frosted(
        &self,
        path: &PathState,
        (prepared, hit): (&PreparedMaterial, &Hit),
        (places, lane): (&SurfaceInteractions<LANES>, usize),
        arriving: &mut PathLanes<LANES>,
        frosteds: &mut Frosteds,
    ) {
        // What the camera sees through something else chooses lights as nothing else does by now.
        let late = self.light_sampling(path) != self.light_sampling_of_bounce();
        let lit = self.batch_direct_lighting
            || !(self.has_light_samples || self.settings.ambient_term.is_some());
        if !prepared.frosted || late || !lit {
            return;
        }
        let channel = path.wavelength_channel.map(usize::from);
        let skin = InterfaceTransition::at_hit(
            self.world,
            path.interior_list,
            hit,
            places.is_front(lane),
            channel,
        );
        // A path that leaves what it never entered is rare.
        if skin.is_false_intersection || skin.outside != path.interior_list {
            return;
        }
        let points = &mut frosteds.points;
        points.set_lane(
            (places, lane),
            &self.world.geometry,
            hit,
            channel,
            skin.outside_ior,
        );
        (frosteds.before[lane], frosteds.after[lane]) = (skin.outside, skin.inside);
        if points.is_active[lane] && !path.interior_list.is_empty() {
            // Before it asks for light.
            let mut absorbed = *path;
            let distance = (places.position(lane) - path.prev_context.position).length();
            self.absorb(&mut absorbed, distance);
            arriving.set_lane(lane, &absorbed);
        }
    }

    /// [`PathTracer::step`] at a lane of [`Frosteds`].
    #[inline]
    pub(crate) fn step_frosted(
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
            rough_dielectric: frosteds,
            direct_lighting: asked,
            ..
        } = meetings;
        let out = &mut radiance[path.ray_index];
        let from = LightSampleContext {
            position: places.position(lane),
            normal: Vec3::ZERO,
        };
        let material = &self.world.geometry.material(hit).material;
        let distance = (from.position - path.prev_context.position).length();
        self.absorb(path, distance);
        if meetings.path_lanes.may_cross_light[lane] {
            self.add_intersected_lights(path, distance, out);
        }
        self.add_emission(path, material, hit, distance, out);
        if !self.is_free_bounce(path) && path.depth >= self.settings.max_depth {
            return false;
        }
        let geometric = places.geometric_normal(lane);
        if self.batch_direct_lighting {
            asked.push_attenuated_shadow_rays(
                lane,
                path.ray_index,
                &mut wave.shadow_rays,
                |direction, end| {
                    let media = frosteds.beyond(lane, geometric, direction);
                    self.arrives(
                        path.ray_index,
                        media,
                        places.offset_ray_origin(lane, direction),
                        end,
                    )
                },
            );
        }
        let Some((sample, start)) = frosteds.points.sample(lane) else {
            return false;
        };
        let media = frosteds.beyond(lane, geometric, sample.wi);
        self.continue_path(path, &sample, start, from, media, wave)
    }
}
