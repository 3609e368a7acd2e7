//! Scattering in media: paths that a medium scatters before they reach a surface.
//!
//! Along a ray, a distance is drawn by free flight. If it is before the next surface, the medium scatters the
//! path there: lights are sampled, and the path continues in a direction sampled from the phase function. In
//! addition, light that arrives directly is estimated at a distance near to a light. Both strategies are
//! weighted by the balance heuristic.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use raycam_bvh::{ExactHit, Hit, Ray};

use crate::bsdf::BsdfSample;
use crate::integrator::camera_ray_batch::is_miss;
use crate::integrator::passes::{FirstScattering, LightSource};
use crate::integrator::path_state::{LightSearch, PathState, WavefrontQueues};
use crate::integrator::path_tracer::PathTracer;
use crate::interaction::LightSampleContext;
use crate::light::light_sampling::{LightSampling, SampledLight};
use crate::light::samples::{LightLiSample, ONE_MINUS_SHADOW_EPSILON};
use crate::lobes::henyey_greenstein::{henyey_greenstein, sample_henyey_greenstein};
use crate::media::equiangular::Equiangular;
use crate::media::free_flight::FreeFlight;
use crate::media::map::{MediaMap, MediumPart, MediumRay};
use crate::media::nested_dielectrics::InteriorList;
use crate::prepare::fog::transmittance;
use crate::prepare::medium::Medium;
use crate::sampling::dimension::Dimension;

/// Offset of the random numbers for free flights beyond the first medium of a ray: see
/// [`Sampler::get_1d_random`](crate::sampling::sampler::Sampler::get_1d_random).
const LATER_FLIGHTS: u32 = 1 << 20;

/// A point at which a medium scatters a path.
struct VolumeVertex {
    position: DVec3,
    medium: Medium,
    interior: InteriorList,
    /// Equiangular sampling of light that arrives directly, which is combined with free flight; `None` if it does not
    /// apply to this ray.
    near_lights: Option<NearLights>,
    /// Distance of the vertex from the start of the part of the ray that is in this medium, and the density of this
    /// distance by free flight.
    distance: f64,
    density: f64,
}

/// Equiangular sampling along the part of a ray that is in one medium.
#[derive(Clone, Copy)]
struct NearLights {
    /// Point at which a light is selected.
    chooser: LightSampleContext,
    begin: DVec3,
    direction: DVec3,
    length: f64,
}

impl NearLights {
    fn toward(&self, center: DVec3) -> Equiangular {
        Equiangular::new(center - self.begin, self.direction, self.length)
    }
}

impl PathTracer<'_> {
    /// Returns the ray of a path up to its hit, starting at the distance `begin`.
    pub(super) fn ray_through_media(&self, path: &PathState, hit: &Hit, begin: f64) -> MediumRay {
        let (origin, direction) = (path.prev_context.position, path.direction.as_dvec3());
        let end = self.geometry.ray_length(origin, direction, hit);
        MediumRay { origin, direction, begin, end, is_camera_ray: path.is_camera_ray }
    }

    /// Moves a path through the media before its hit, along a ray that crosses `borders`. Returns true if the path
    /// reaches the hit; otherwise a medium scattered the path, and `continues` is true if its next ray is queued.
    pub(super) fn cross_media(
        &self,
        media: &MediaMap,
        path: &mut PathState,
        hit: &Hit,
        (ray, borders): (&MediumRay, &[ExactHit]),
        queues: &mut WavefrontQueues,
        (out, continues): (&mut Vec3, &mut bool),
    ) -> bool {
        *continues = false;
        if !self.skips_light(path) {
            self.add_lights_in_media(media, path, (ray, borders), out);
        }
        if is_miss(hit) && path.is_camera_ray && self.settings.hide_environment {
            return true;
        }
        let mut index = 0;
        let interior = path.interior_list;
        let scattered = media.visit(interior, ray, borders, |part| {
            let found = self.cross_part(path, ray, part, index, queues);
            index += 1;
            match found {
                Some(vertex) => ControlFlow::Break(vertex),
                None => ControlFlow::Continue(()),
            }
        });
        let vertex = match scattered {
            ControlFlow::Continue(interior) => {
                path.interior_list = interior;
                return true;
            }
            ControlFlow::Break(vertex) => vertex,
        };
        *continues = self.scatter(path, &vertex, queues);
        false
    }

    /// Adds lights without a mesh that the ray crosses, dimmed by the media before them.
    fn add_lights_in_media(
        &self,
        media: &MediaMap,
        path: &PathState,
        (ray, borders): (&MediumRay, &[ExactHit]),
        out: &mut Vec3,
    ) {
        let (lights, view) = self.lights_of(path);
        lights.intersect_visible(
            &path.prev_context,
            path.light_sampling,
            path.direction,
            ray.end,
            |index, at, radiance, pdf| {
                if at >= ray.begin {
                    let before = MediumRay { end: at, ..*ray };
                    let passed = media.transmittance(path.interior_list, &before, borders);
                    let light = path.throughput * passed * radiance * self.mis_weight(path, pdf);
                    *out += light;
                    self.record(path, LightSource::Finite { index, view }, light);
                }
            },
        );
    }

    /// Moves a path through one medium; returns the point at which the medium scatters the path, if it does.
    fn cross_part(
        &self,
        path: &mut PathState,
        ray: &MediumRay,
        part: &MediumPart,
        index: u32,
        queues: &mut WavefrontQueues,
    ) -> Option<VolumeVertex> {
        let (medium, length) = (part.medium, part.end - part.begin);
        if medium.albedo == Vec3::ZERO {
            path.throughput *= transmittance(medium.extinction, length);
            return None;
        }
        let flight = FreeFlight::new(path.throughput, medium.extinction);
        let is_found = index == 0 && path.light_search != LightSearch::Sampled;
        let near_lights = is_found.then(|| self.near_lights(path, ray, part)).flatten();
        if let Some(near_lights) = &near_lights {
            self.sample_near_light(path, part, &flight, near_lights, queues);
        }
        let sampler = &self.samplers[path.ray_index()];
        let random = match index {
            0 => sampler.get_2d(Dimension::FreeFlight(self.bounce)),
            _ => [0, 1].map(|i| {
                let number = self.bounce.wrapping_mul(64).wrapping_add(2 * index + i);
                sampler.get_1d_random(LATER_FLIGHTS.wrapping_add(number))
            }),
        };
        let distance = flight.sample(random);
        if distance >= length {
            path.throughput *= transmittance(medium.extinction, length) / flight.passing(length) as f32;
            return None;
        }
        let density = flight.density(distance);
        let scattering = medium.extinction * medium.albedo;
        path.throughput *= scattering * transmittance(medium.extinction, distance) / density as f32;
        let position = ray.origin + (part.begin + distance) * ray.direction;
        Some(VolumeVertex { position, medium, interior: part.interior, near_lights, distance, density })
    }

    /// Equiangular sampling along the part of a ray that is in one medium; `None` if no light has a position.
    fn near_lights(&self, path: &PathState, ray: &MediumRay, part: &MediumPart) -> Option<NearLights> {
        if !self.lights.has_finite() || self.is_at_max_depth(path) {
            return None;
        }
        let begin = ray.origin + part.begin * ray.direction;
        let length = part.end - part.begin;
        let reach = length.min(1.0 / f64::from(part.medium.extinction.max_element()));
        let chooser = LightSampleContext { position: begin + 0.5 * reach * ray.direction, normal: Vec3::ZERO };
        Some(NearLights { chooser, begin, direction: ray.direction, length })
    }

    /// Queues the shadow ray of light that a medium scatters into the ray, at a distance near to a light.
    fn sample_near_light(
        &self,
        path: &PathState,
        part: &MediumPart,
        flight: &FreeFlight,
        near_lights: &NearLights,
        queues: &mut WavefrontQueues,
    ) {
        let sampler = &self.samplers[path.ray_index()];
        let [choice, random] = sampler.get_2d(Dimension::NearLight(self.bounce, 0));
        let Some((index, probability)) = self.lights.choose_finite_at(&near_lights.chooser, choice) else {
            return;
        };
        let angles = near_lights.toward(self.lights.center_of_finite(index));
        let distance = angles.sample(random);
        if distance >= near_lights.length {
            return;
        }
        let position = near_lights.begin + distance * near_lights.direction;
        let context = LightSampleContext { position, normal: Vec3::ZERO };
        let random = sampler.get_2d(Dimension::NearLight(self.bounce, 1));
        let Some(sample) = self.lights.sample_finite_light(&context, index, random) else {
            return;
        };
        let selection = self.lights.finite_probability(&context, LightSampling::Importance, index);
        let densities = [flight.density(distance) * selection, probability * angles.density(distance)];
        let medium = &part.medium;
        let weight = medium.extinction * medium.albedo * transmittance(medium.extinction, distance)
            / (densities[0] + densities[1]) as f32;
        let phase = henyey_greenstein(path.direction.dot(sample.direction), medium.g);
        let light_pdf = sample.pdf * selection as f32;
        let mis = self.mis_of_light_sample(&sample, phase, light_pdf);
        let light = path.throughput * weight * phase * (sample.radiance / sample.pdf) * mis;
        let sample = (&sample, SampledLight::Finite(index));
        self.queue_volume_light(path, (position, part.interior), sample, light, queues);
    }

    /// Balance-heuristic weight of a light sample, combined with samples of the phase function; 1 if no sample of the
    /// phase function can hit the light.
    fn mis_of_light_sample(&self, sample: &LightLiSample, phase: f32, light_pdf: f32) -> f32 {
        if sample.is_delta || !self.modes.mis_with_bsdf {
            1.0
        } else if light_pdf > 0.0 {
            1.0 / (1.0 + phase / light_pdf)
        } else {
            0.0
        }
    }

    /// Samples a light at a point of a medium, and continues the path; returns false if the path ends.
    fn scatter(&self, path: &mut PathState, vertex: &VolumeVertex, queues: &mut WavefrontQueues) -> bool {
        if self.is_at_max_depth(path) || path.light_search == LightSearch::Sampled {
            return false;
        }
        let context = LightSampleContext { position: vertex.position, normal: Vec3::ZERO };
        if self.modes.has_light_samples() {
            self.sample_light_in_volume(path, vertex, &context, queues);
        }
        let g = vertex.medium.g;
        let random = self.samplers[path.ray_index()].get_2d(Dimension::Bsdf(self.bounce));
        let wi = sample_henyey_greenstein(path.direction, g, random).normalize();
        let pdf = henyey_greenstein(path.direction.dot(wi), g);
        let sample = BsdfSample { wi, weight: Vec3::ONE, pdf, is_specular: false, eta_scale: 1.0 };
        self.record_scattering(path, || FirstScattering::Medium);
        let continues = self.continue_path(path, &sample, vertex.position.as_vec3(), context, vertex.interior, queues);
        path.light_sampling = LightSampling::Importance;
        continues
    }

    fn sample_light_in_volume(
        &self,
        path: &PathState,
        vertex: &VolumeVertex,
        context: &LightSampleContext,
        queues: &mut WavefrontQueues,
    ) {
        let sampler = &self.samplers[path.ray_index()];
        let [_, choice] = sampler.get_2d(Dimension::LobeAndLight(self.bounce));
        let random = sampler.get_2d(Dimension::Light(self.bounce, 0));
        let sampling = LightSampling::Importance;
        let found =
            self.lights.sample_with_light(&context.into(), self.geometry, sampling, choice, &random.into(), None);
        let Some((sample, sampled)) = found else {
            return;
        };
        let phase = henyey_greenstein(path.direction.dot(sample.direction), vertex.medium.g);
        let mis = self.mis_of_light_sample(&sample, phase, sample.pdf);
        let mut weight = 1.0;
        if let (Some(near_lights), SampledLight::Finite(light)) = (&vertex.near_lights, sampled) {
            let selection = self.lights.finite_probability(context, sampling, light);
            let probability = self.lights.finite_probability_at(&near_lights.chooser, light);
            let angles = near_lights.toward(self.lights.center_of_finite(light));
            let [own, other] = [vertex.density * selection, probability * angles.density(vertex.distance)];
            weight = (own / (own + other)) as f32;
        }
        let light = path.throughput * phase * (sample.radiance / sample.pdf) * (mis * weight);
        self.queue_volume_light(path, (vertex.position, vertex.interior), (&sample, sampled), light, queues);
    }

    fn queue_volume_light(
        &self,
        path: &PathState,
        (position, interior): (DVec3, InteriorList),
        (sample, sampled): (&LightLiSample, SampledLight),
        light: Vec3,
        queues: &mut WavefrontQueues,
    ) {
        if light == Vec3::ZERO || !light.is_finite() {
            return;
        }
        let origin = position.as_vec3().to_array();
        let ray = match sample.p_light {
            None => Ray { origin, direction: sample.direction.to_array(), t_max: f32::INFINITY },
            Some(p_light) => {
                let direction = (p_light - position).as_vec3().to_array();
                Ray { origin, direction, t_max: ONE_MINUS_SHADOW_EPSILON }
            }
        };
        let queue = &mut queues.shadow_rays[0];
        queue.push_within(ray, path.ray_index(), light, interior);
        let source = LightSource::of_sample(sampled, sample, true);
        queue.tag_last(self.tag(path, source, || FirstScattering::Medium));
    }
}
