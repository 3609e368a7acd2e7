//! Direct lighting of one point: next-event estimation with shadow rays.

use glam::{DVec3, Vec3};
use raycam_bvh::Ray;

use crate::bsdf::BsdfModel;
use crate::bsdf::shading_point::ShadingPoint;
use crate::integrator::passes::{FirstScattering, LightSource};
use crate::integrator::path_state::{HitView, PathState, WavefrontQueues};
use crate::integrator::path_tracer::PathTracer;
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::light::light_sampling::{LightSampleContexts, LightSampling, MAX_SPLIT_SAMPLES, SampledLight};
use crate::light::samples::{LightLiSample, LightRandom, ONE_MINUS_SHADOW_EPSILON};
use crate::light::tree::RecentNodes;
use crate::lobes::shading_frame::{sample_cosine_hemisphere, to_world_around};
use crate::media::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::sampling::dimension::Dimension;

/// Only one of this many shadow rays that must cross the boundary of a closed body is traced, and its light is
/// multiplied by this number. The rate is not zero, because light can pass through parts of a mesh that are inside out.
const INTERIOR_SHADOW_RATE: f32 = 16.0;

/// Fraction of each colour of a BSDF's value that comes from the diffuse lobes.
fn diffuse_share<B: BsdfModel>(point: &ShadingPoint<B>, wi: Vec3, value: Vec3) -> Vec3 {
    let diffuse = point.bsdf.eval_diffuse(&point.frame, wi);
    Vec3::select(value.cmpgt(Vec3::ZERO), diffuse / value, Vec3::ZERO).clamp(Vec3::ZERO, Vec3::ONE)
}

/// [`diffuse_share`] for a direction that the BSDF has sampled.
pub(super) fn sampled_diffuse_share<B: BsdfModel>(point: &ShadingPoint<B>, wi: Vec3) -> Vec3 {
    diffuse_share(point, wi, point.bsdf.eval(&point.frame, wi).value)
}

/// First scattering of ambient light: its diffuse fraction is the albedo of the diffuse lobes divided by the whole
/// albedo.
fn ambient_scattering<B: BsdfModel>(point: &ShadingPoint<B>) -> FirstScattering {
    let whole = point.bsdf.albedo(&point.frame);
    let diffuse = point.bsdf.diffuse_albedo(&point.frame) / whole;
    FirstScattering::Surface { diffuse: Vec3::select(whole.cmpgt(Vec3::ZERO), diffuse, Vec3::ZERO).min(Vec3::ONE) }
}

impl PathTracer<'_> {
    /// Indices of the light samples that a point may have at this bounce.
    pub fn light_sample_indices(&self) -> impl Iterator<Item = usize> {
        let (is_split, count) = match self.light_sampling_of_bounce() {
            LightSampling::Split => (true, MAX_SPLIT_SAMPLES),
            _ => (false, self.settings.light_samples),
        };
        (0..count).filter(move |&i| !is_split || self.lights.may_use_index(i))
    }

    /// Samples lights at a point and queues their shadow rays.
    #[inline]
    pub fn sample_lights<B: BsdfModel>(
        &self,
        path: &PathState,
        point: &ShadingPoint<B>,
        transition: InterfaceTransition,
        view: &HitView,
        queues: &mut WavefrontQueues,
        out: &mut Vec3,
    ) {
        if !point.bsdf.is_non_specular() {
            return;
        }
        self.add_ambient(path, point, queues, out);
        if !self.modes.has_light_samples() {
            return;
        }
        if let Some(sample) = &view.single_light_sample {
            let sampled = (sample, SampledLight::Finite(0));
            self.queue_light_sample(path, point, transition, sampled, &mut queues.shadow_rays[0]);
            return;
        }
        let sampler = &self.samplers[path.ray_index()];
        let [_, choice] = if self.modes.needs_light_choice() {
            sampler.get_2d(Dimension::LobeAndLight(self.bounce))
        } else {
            [0.0; 2]
        };
        let random = |index| match index {
            0 => view.light_random,
            _ => sampler.get_2d(Dimension::Light(self.bounce, index)).into(),
        };
        let emit = |index: usize, sample: LightLiSample, light: SampledLight| {
            let queue = &mut queues.shadow_rays[index];
            self.queue_light_sample(path, point, transition, (&sample, light), queue);
        };
        let context = point.light_sample_context();
        let sampling = self.light_sampling(path);
        self.for_each_light_sample(sampling, &(&context).into(), choice, random, emit);
    }

    /// Adds the ambient term, unless nearby surfaces occlude it.
    fn add_ambient<B: BsdfModel>(
        &self,
        path: &PathState,
        point: &ShadingPoint<B>,
        queues: &mut WavefrontQueues,
        out: &mut Vec3,
    ) {
        let Some(max_distance) = self.settings.ambient_term else {
            return;
        };
        if self.lights.ambient == Vec3::ZERO {
            return;
        }
        let ambient = path.throughput * self.lights.ambient * point.bsdf.albedo(&point.frame);
        match max_distance {
            None => {
                *out += ambient;
                self.record_ambient(path, point, ambient);
            }
            Some(distance) => {
                let sampler = &self.samplers[path.ray_index()];
                let local = sample_cosine_hemisphere(sampler.get_2d(Dimension::AmbientOcclusion));
                let direction = to_world_around(point.interaction.side_normal, local);
                let ray = point.interaction.spawn_ray(direction, distance);
                let tag = self.tag(path, LightSource::Ambient, || ambient_scattering(point));
                queues.bsdf_shadow_rays.push_tagged(ray, path.ray_index(), ambient, tag);
            }
        }
    }

    /// Records the ambient term of a path's hit in the passes.
    fn record_ambient<B: BsdfModel>(&self, path: &PathState, point: &ShadingPoint<B>, ambient: Vec3) {
        if let Some(passes) = self.settings.passes
            && let Some(tag) = self.tag(path, LightSource::Ambient, || ambient_scattering(point))
        {
            passes.add(path.ray_index(), tag, ambient);
        }
    }

    /// Calls `emit` with the index, the sample and the light of each light sample at a point. The densities include two
    /// probabilities: that the light is selected, and that the point has samples at all. `choice` is the random number
    /// for both decisions; `random` returns the random numbers for a position on a light.
    #[inline(always)]
    pub fn for_each_light_sample(
        &self,
        sampling: LightSampling,
        contexts: &LightSampleContexts,
        choice: f32,
        random: impl Fn(usize) -> LightRandom,
        mut emit: impl FnMut(usize, LightLiSample, SampledLight),
    ) {
        let (lights, geometry) = (self.lights, self.geometry);
        if let Some(light) = self.modes.single_light() {
            if let Some(sample) = light.sample(contexts.from, random(0).random) {
                emit(0, sample, SampledLight::Finite(0));
            }
            return;
        }
        if sampling == LightSampling::Split {
            lights.sample_split(contexts, geometry, choice, |index| Some(random(index)), emit);
            return;
        }
        let rate = self.light_sampling_rate(sampling, contexts.from.position);
        if choice >= rate {
            return;
        }
        // The random number is below `rate`; after division by `rate` it is uniform from 0 to 1 again.
        let choice = choice / rate;
        let count = self.settings.light_samples;
        let mut recent = (count > 1).then(<[RecentNodes; 2]>::default);
        for index in 0..count {
            let choice = (choice + index as f32) / count as f32;
            let random = random(index);
            let sampled = lights.sample_with_light(contexts, geometry, sampling, choice, &random, recent.as_mut());
            if let Some((mut sample, light)) = sampled {
                sample.pdf *= count as f32 * rate;
                emit(index, sample, light);
            }
        }
    }

    /// Queues the shadow ray of a light sample, unless the sample contributes nothing.
    #[inline]
    fn queue_light_sample<B: BsdfModel>(
        &self,
        path: &PathState,
        point: &ShadingPoint<B>,
        transition: InterfaceTransition,
        (sample, sampled): (&LightLiSample, SampledLight),
        queue: &mut ShadowRayQueue,
    ) {
        let (wi, pdf) = (sample.direction, sample.pdf);
        let radiance = match sample.p_light {
            None if !sample.is_delta => self.environment_without_ambient(false, sample.radiance),
            _ => sample.radiance,
        };
        let scattered = point.bsdf.eval(&point.frame, wi);
        let mut light = path.throughput * scattered.value * (radiance / pdf);
        if !sample.is_delta && self.modes.mis_with_bsdf {
            // Weight by the balance heuristic.
            light /= 1.0 + scattered.pdf / pdf;
        }
        if light == Vec3::ZERO {
            return;
        }
        let interior_list = transition.medium_towards(point.frame.geometric, wi);
        let origin = point.interaction.offset_ray_origin(wi);
        let p_light = sample.p_light.unwrap_or(DVec3::INFINITY);
        light *= self.shadow_transmittance(path.ray_index(), interior_list, origin, p_light);
        if light == Vec3::ZERO {
            return;
        }
        let ray = match sample.p_light {
            None => point.interaction.spawn_ray(wi, f32::INFINITY),
            Some(p_light) => Ray {
                direction: (p_light - origin).as_vec3().to_array(),
                ..point.interaction.spawn_ray(wi, ONE_MINUS_SHADOW_EPSILON)
            },
        };
        queue.push_within(ray, path.ray_index(), light, interior_list);
        if self.settings.passes.is_some() {
            let source = LightSource::of_sample(sampled, sample, self.settings.ambient_term.is_none());
            let diffuse = || FirstScattering::Surface { diffuse: diffuse_share(point, wi, scattered.value) };
            queue.tag_last(self.tag(path, source, diffuse));
        }
    }

    /// Transmittance of the media between a point and a light along an unoccluded shadow ray; zero if no ray needs to
    /// be traced. `p_light` is scene-local, or infinite.
    #[inline]
    pub fn shadow_transmittance(
        &self,
        ray_index: usize,
        interior_list: InteriorList,
        origin: DVec3,
        p_light: DVec3,
    ) -> Vec3 {
        if interior_list.is_empty() || self.geometry.has_media() {
            return Vec3::ONE;
        }
        let mut transmittance = Vec3::ONE;
        if interior_list.light_outside_closed_body(self.geometry, p_light) {
            let random = self.samplers[ray_index].get_1d_random(self.bounce);
            if random * INTERIOR_SHADOW_RATE >= 1.0 {
                return Vec3::ZERO;
            }
            transmittance *= INTERIOR_SHADOW_RATE;
        }
        if p_light.x < f64::INFINITY {
            let distance = (p_light - origin).length() as f32;
            transmittance *= (-interior_list.absorption(self.geometry) * distance).exp();
        }
        transmittance
    }
}
