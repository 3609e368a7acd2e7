//! What paths do at mirrors and clear glass, many at a time: what [`PathTracer::step`] does one by one.

use glam::Vec3;
use raycam_bvh::{Hit, dispatch_simd};

use crate::bsdf::BsdfSample;
use crate::bsdf::batch::specular::{SampleSpecular, SpecularBsdfBatch};
use crate::integrator::batch::hits::HitBatch;
use crate::integrator::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::integrator::path::{PathState, WavefrontQueues};
use crate::integrator::shade::PathTracer;
use crate::interaction::LightSampleContext;
use crate::interaction::batch::SurfaceInteractions;
use crate::prepare::material::PreparedMaterial;
use crate::soa::LANES;

/// How often a path from the camera goes both ways of clear glass, where each is often enough.
const MAX_SPLITS: u8 = 2;

/// Paths at smooth metals and clear glass.
#[derive(Debug, Default)]
pub(crate) struct SpecularBatch {
    /// Which they are, and what these do.
    pub points: SpecularBsdfBatch<LANES>,
    /// What the paths are in behind the surface.
    inside: [InteriorList; LANES],
}

impl PathTracer<'_> {
    /// Sets a lane, where [`PathTracer::step_smooth`] knows what happens there.
    #[inline]
    pub(crate) fn put_smooth(
        &self,
        path: &PathState,
        (prepared, hit): (&PreparedMaterial, &Hit),
        (places, lane): (&SurfaceInteractions<LANES>, usize),
        smooths: &mut SpecularBatch,
    ) {
        if !prepared.clear {
            return;
        }
        let (material, front) = (&prepared.material, places.is_front(lane));
        let channel = path.wavelength_channel.map(usize::from);
        let skin = InterfaceTransition::at_hit(self.world, path.interior_list, hit, front, channel);
        // A path that leaves what it never entered is rare.
        if skin.is_false_intersection || skin.outside != path.interior_list {
            return;
        }
        let points = &mut smooths.points;
        let forks = path.split_count < MAX_SPLITS && path.specular_bounce;
        let at = (&self.world.geometry, hit);
        points.set_lane((places, lane), at, channel, skin.outside_ior, forks);
        if points.transmission(lane) == Vec3::ZERO
            && self.is_culled_back_face(path, material, front)
        {
            points.is_active[lane] = false;
        }
        smooths.inside[lane] = skin.inside;
    }

    /// Finds where the paths of the lanes go on, by numbers that choose between ways.
    pub(crate) fn find_smooth(
        &self,
        choice: &[f32; LANES],
        places: &SurfaceInteractions<LANES>,
        smooths: &mut SpecularBatch,
    ) {
        if smooths.points.any_active() {
            dispatch_simd(SampleSpecular {
                places,
                choice,
                batch: &mut smooths.points,
            });
        }
    }

    /// [`PathTracer::step`] at a lane of [`SpecularBatch`].
    #[inline]
    pub(crate) fn step_smooth(
        &self,
        path: &mut PathState,
        meetings: &HitBatch,
        lane: usize,
        wave: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let HitBatch {
            places,
            specular: smooths,
            path_lanes: arriving,
            ..
        } = meetings;
        let geometric = places.geometric_normal(lane);
        let from = LightSampleContext {
            position: places.position(lane),
            normal: if smooths.points.transmission(lane) == Vec3::ZERO {
                geometric
            } else {
                Vec3::ZERO
            },
        };
        if arriving.may_cross_light[lane] || !path.interior_list.is_empty() {
            let distance = (from.position - path.prev_context.position).length();
            self.absorb(path, distance);
            self.add_intersected_lights(path, distance, &mut radiance[path.ray_index]);
        }
        if !self.is_free_bounce(path) && path.depth >= self.settings.max_depth {
            return false;
        }
        let go = |path: &mut PathState,
                  (sample, start): (BsdfSample, Vec3),
                  wave: &mut WavefrontQueues| {
            let media = if geometric.dot(sample.wi) < 0.0 {
                smooths.inside[lane]
            } else {
                path.interior_list
            };
            self.continue_path(path, &sample, start, from, media, wave)
        };
        let fork = smooths.points.transmitted_sample(lane).map(|through| {
            path.split_count += 1;
            (*path, through)
        });
        let goes_on = match smooths.points.sample(lane) {
            Some(sample) => go(path, sample, wave),
            None => false,
        };
        if let Some((mut path, through)) = fork
            && go(&mut path, through, wave)
        {
            wave.split_paths.push(path);
        }
        goes_on
    }
}
