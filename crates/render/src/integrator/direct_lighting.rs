//! The light of lights at a surface: what is asked for by shadow rays (next event estimation).

use glam::{DVec3, Vec3};
use raycam_bvh::Ray;

use crate::bsdf::BsdfModel;
use crate::bsdf::ShadingPoint;
use crate::integrator::batch::hits::HitView;
use crate::integrator::nested_dielectrics::InterfaceTransition;
use crate::integrator::path::{PathState, WavefrontQueues};
use crate::integrator::shade::PathTracer;
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::light::light_sampling::{LightSampleContexts, LightSampling, MAX_SPLIT_SAMPLES};
use crate::light::samples::{LightLiSample, LightRandom, ONE_MINUS_SHADOW_EPSILON};
use crate::lobes::shading_frame::{sample_cosine_hemisphere, to_world_around};
use crate::sampling::dimension::Dimension;

impl PathTracer<'_> {
    /// How lights are chosen where a path is scattered.
    pub(crate) fn light_sampling(&self, path: &PathState) -> LightSampling {
        if self.split_lights && path.is_camera_ray {
            LightSampling::Split
        } else {
            self.settings.light_sampling
        }
    }

    /// The same for all paths that nothing has let through before.
    pub(crate) fn light_sampling_of_bounce(&self) -> LightSampling {
        if self.split_lights && self.bounce == 0 {
            LightSampling::Split
        } else {
            self.settings.light_sampling
        }
    }

    /// The numbers of the lights that may be sampled at surfaces of this turn.
    pub(crate) fn light_sample_indices(&self) -> impl Iterator<Item = usize> {
        let (split, count) = match self.light_sampling_of_bounce() {
            LightSampling::Split => (true, MAX_SPLIT_SAMPLES),
            _ => (false, self.settings.light_samples),
        };
        (0..count).filter(move |&i| !split || self.lights.may_use_index(i))
    }

    /// Asks for the light of one or more lights at a surface.
    #[inline]
    pub(crate) fn sample_lights<S: BsdfModel>(
        &self,
        path: &PathState,
        surface: &ShadingPoint<S>,
        skin: InterfaceTransition,
        meeting: &HitView,
        wave: &mut WavefrontQueues,
        out: &mut Vec3,
    ) {
        if !surface.bsdf.is_non_specular() {
            return;
        }
        let sampler = &self.samplers[path.ray_index];
        if let Some(within) = self.settings.ambient_term
            && self.lights.ambient != Vec3::ZERO
        {
            let ambient =
                path.throughput * self.lights.ambient * surface.bsdf.albedo(&surface.frame);
            match within {
                None => *out += ambient,
                Some(distance) => {
                    let direction = to_world_around(
                        surface.interaction.geometric_normal,
                        sample_cosine_hemisphere(sampler.get_2d(Dimension::AmbientOcclusion)),
                    );
                    let ray = surface.interaction.spawn_ray(direction, distance);
                    wave.bsdf_shadow_rays.push(ray, path.ray_index, ambient);
                }
            }
        }
        if !self.has_light_samples {
            return;
        }
        let from = surface.light_sample_context();
        let [_, choice] = if self.needs_light_choice {
            sampler.get_2d(Dimension::LobeAndLight(self.bounce))
        } else {
            [0.0; 2]
        };
        let random = |index| match index {
            0 => meeting.light_random,
            _ => sampler.get_2d(Dimension::Light(self.bounce, index)).into(),
        };
        if let Some(sample) = &meeting.single_light_sample {
            self.add_light_sample(path, surface, skin, sample, &mut wave.shadow_rays[0]);
            return;
        }
        let tell = |index: usize, sample: LightLiSample| {
            self.add_light_sample(path, surface, skin, &sample, &mut wave.shadow_rays[index]);
        };
        self.for_each_light_sample(
            self.light_sampling(path),
            &(&from).into(),
            choice,
            random,
            tell,
        );
    }

    /// Tells of the samples of lights at a point with their numbers, each with the density of all of its kind together.
    /// `by` knows what lights may matter to the point, `which` chooses among them, and `random` gives where on each.
    #[inline(always)]
    pub(crate) fn for_each_light_sample(
        &self,
        choice: LightSampling,
        by: &LightSampleContexts,
        which: f32,
        random: impl Fn(usize) -> LightRandom,
        mut tell: impl FnMut(usize, LightLiSample),
    ) {
        let (lights, world) = (self.lights, self.world);
        if let Some(light) = self.single_light {
            if let Some(sample) = light.sample(by.from, random(0).random) {
                tell(0, sample);
            }
            return;
        }
        if choice == LightSampling::Split {
            lights.sample_split(by, &world.geometry, which, random, tell);
            return;
        }
        let count = self.settings.light_samples;
        for index in 0..count {
            let which = (which + index as f32) / count as f32;
            if let Some(mut sample) =
                lights.sample(by, &world.geometry, choice, which, &random(index))
            {
                sample.pdf *= count as f32;
                tell(index, sample);
            }
        }
    }

    /// Asks for the light of a sample.
    #[inline]
    fn add_light_sample<S: BsdfModel>(
        &self,
        path: &PathState,
        surface: &ShadingPoint<S>,
        skin: InterfaceTransition,
        sample: &LightLiSample,
        shadows: &mut ShadowRayQueue,
    ) {
        let pdf = sample.pdf;
        let radiance = match sample.p_light {
            None if !sample.is_delta => self.environment_without_ambient(false, sample.radiance),
            _ => sample.radiance,
        };
        let scattered = surface.bsdf.eval(&surface.frame, sample.direction);
        let mut light = path.throughput * scattered.value * (radiance / pdf);
        if !sample.is_delta && self.mis_with_bsdf {
            light /= 1.0 + scattered.pdf / pdf;
        }
        if light == Vec3::ZERO {
            return;
        }
        let media = skin.medium_towards(surface.frame.geometric, sample.direction);
        let start = surface.interaction.offset_ray_origin(sample.direction);
        let end = sample.p_light.unwrap_or(DVec3::INFINITY);
        light *= self.arrives(path.ray_index, media, start, end);
        if light == Vec3::ZERO {
            return;
        }
        let ray = match sample.p_light {
            None => surface
                .interaction
                .spawn_ray(sample.direction, f32::INFINITY),
            Some(end) => Ray {
                direction: (end - start).as_vec3().to_array(),
                ..surface
                    .interaction
                    .spawn_ray(sample.direction, ONE_MINUS_SHADOW_EPSILON)
            },
        };
        shadows.push(ray, path.ray_index, light);
    }
}
