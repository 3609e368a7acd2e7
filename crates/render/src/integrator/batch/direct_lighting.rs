//! Direct lighting of a chunk: light samples of all lanes and their shadow rays.

use glam::{DVec3, Vec3};
use raycam_bvh::{Ray, WithSimd, dispatch_simd};

use crate::bsdf::batch::LaneContext;
use crate::integrator::batch::bsdf::BatchBsdf;
use crate::integrator::batch::path_lanes::PathLanes;
use crate::integrator::path_tracer::PathTracer;
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::LightSampleContext;
use crate::light::light_sampling::{LightSampleContexts, LightSampling, MAX_SPLIT_SAMPLES};
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::{EnvironmentSample, LightLiSamples, LightRandom, ONE_MINUS_SHADOW_EPSILON};
use crate::light::tree::importance::{ComputeNodeImportances, NodeImportances};
use crate::media::nested_dielectrics::InteriorList;
use crate::soa::{LANES, Vec3xN, get_lane, lane_dvec3, lane_vec3, set_lane};

/// Random numbers of all hits of a bounce, and the light samples and shadow rays of one chunk.
#[derive(Default)]
pub(crate) struct DirectLightingBatch {
    pub randoms: LightRandoms,
    /// For each hit: random numbers that select a lobe and a light.
    pub light_choices: Vec<[f32; 2]>,
    pub samples: [LightLiSamples<LANES>; MAX_SPLIT_SAMPLES],
    shadow_rays: [ShadowRayLanes; MAX_SPLIT_SAMPLES],
    /// Importances of the nodes of two light trees: over lights without a mesh, and over emissive triangles.
    importances: [NodeImportances; 2],
    /// Number of entries of `shadow_rays` in use.
    count: usize,
}

/// Random numbers of all hits of a bounce, in one list per light sample.
#[derive(Default)]
pub(crate) struct LightRandoms {
    pub numbers: [Vec<[f32; 2]>; MAX_SPLIT_SAMPLES],
    /// Samples of the environment for these random numbers, and the environment's index among the infinite lights.
    environment_samples: [Vec<EnvironmentSample>; MAX_SPLIT_SAMPLES],
    environment_index: usize,
}

impl LightRandoms {
    /// Samples the environment for all hits at once, so that cache misses in its tables overlap.
    pub fn presample_environment(&mut self, tracer: &PathTracer) {
        self.environment_samples.iter_mut().for_each(Vec::clear);
        let Some((index, environment)) = tracer.lights.environment() else {
            return;
        };
        self.environment_index = index;
        let is_split = tracer.light_sampling_of_bounce() == LightSampling::Split;
        let indices = tracer.light_sample_indices();
        for i in indices.filter(|&i| tracer.modes.batch_direct_lighting || i == 0) {
            if !is_split || i == index {
                environment.sample_many(&self.numbers[i], &mut self.environment_samples[i]);
            }
        }
    }

    /// Random numbers of one light sample at a hit.
    pub fn random_for(&self, sample: usize, hit: usize) -> LightRandom {
        let environment = self.environment_samples[sample].get(hit);
        LightRandom {
            random: self.numbers[sample][hit],
            environment: environment.map(|&environment| (self.environment_index, environment)),
        }
    }
}

impl DirectLightingBatch {
    /// Samples lights for the lanes of a chunk, and evaluates the BSDFs. If a rectangle is the only light, its samples
    /// already exist.
    pub fn evaluate_chunk(
        &mut self,
        tracer: &PathTracer,
        chunk: usize,
        context: LaneContext,
        bsdf: &BatchBsdf,
        path_lanes: &PathLanes,
    ) {
        if !matches!(tracer.modes.single_light(), Some(PreparedLight::Rectangle(_))) {
            self.sample_lights(tracer, chunk, context, bsdf);
        }
        self.count = 0;
        for i in tracer.light_sample_indices() {
            // Light samples whose indices are skipped have no shadow rays.
            for shadow_rays in &mut self.shadow_rays[self.count..i] {
                shadow_rays.is_active = [false; LANES];
            }
            dispatch_simd(EvaluateDirect {
                context,
                bsdf,
                path_lanes,
                samples: &self.samples[i],
                mis_with_bsdf: tracer.modes.mis_with_bsdf,
                shadow_rays: &mut self.shadow_rays[i],
            });
            self.count = i + 1;
        }
    }

    fn sample_lights(&mut self, tracer: &PathTracer, chunk: usize, context: LaneContext, bsdf: &BatchBsdf) {
        let interactions = context.interactions;
        tracer.light_sample_indices().for_each(|i| self.samples[i].clear());
        let sampling = tracer.light_sampling_of_bounce();
        let is_sampled = self.sample_fixed_lights(tracer, chunk, sampling, interactions.positions());
        if tracer.light_sample_indices().all(|i| is_sampled[i]) {
            return;
        }
        let nodes = tracer.lights.single_node_trees(sampling);
        let normals = bsdf.light_sample_normals(context);
        for (node, out) in nodes.iter().zip(&mut self.importances) {
            if let Some(node) = node {
                dispatch_simd(ComputeNodeImportances {
                    node,
                    points: interactions.positions(),
                    normals: &normals,
                    out,
                });
            }
        }
        let importances = [0, 1].map(|i: usize| nodes[i].map(|_| &self.importances[i]));
        for lane in (0..LANES).filter(|&lane| bsdf.is_non_specular(lane)) {
            let from = LightSampleContext { position: interactions.position(lane), normal: lane_vec3(&normals, lane) };
            let hit = chunk * LANES + lane;
            let choice = if tracer.modes.needs_light_choice() { self.light_choices[hit][1] } else { 0.0 };
            let random = |i: usize| self.randoms.random_for(i, hit);
            let remaining = |i: usize| (!is_sampled[i]).then(|| random(i));
            let emit = |i: usize, sample, _| self.samples[i].set_lane(lane, Some(sample));
            let contexts =
                LightSampleContexts { from: &from, importances: importances.map(|known| Some((known?, lane))) };
            match sampling {
                LightSampling::Split => {
                    tracer.lights.sample_split(&contexts, tracer.geometry, choice, remaining, emit);
                }
                _ => tracer.for_each_light_sample(sampling, &contexts, choice, random, emit),
            }
        }
    }

    /// Samples the lights that are the same in every lane, if there is a method for many points. Returns true for each
    /// index of a sampled light.
    fn sample_fixed_lights(
        &mut self,
        tracer: &PathTracer,
        chunk: usize,
        sampling: LightSampling,
        points: &Vec3xN<f64, LANES>,
    ) -> [bool; MAX_SPLIT_SAMPLES] {
        let mut is_sampled = [false; MAX_SPLIT_SAMPLES];
        if sampling != LightSampling::Split && tracer.modes.needs_light_choice() {
            return is_sampled;
        }
        for i in tracer.light_sample_indices() {
            let Some(light) = tracer.lights.light_of_index(i) else {
                continue;
            };
            let mut random = [[0.0; LANES]; 2];
            for (lane, numbers) in self.randoms.numbers[i].iter().skip(chunk * LANES).take(LANES).enumerate() {
                [random[0][lane], random[1][lane]] = *numbers;
            }
            is_sampled[i] = light.sample_many(points, &random, &mut self.samples[i]);
        }
        is_sampled
    }

    /// Pushes the shadow rays of a lane to the queues; `ray_index` is the camera ray of the lane's path.
    #[inline(always)]
    pub fn push_shadow_rays(&self, lane: usize, ray_index: usize, queues: &mut [ShadowRayQueue]) {
        for (rays, queue) in self.shadow_rays[..self.count].iter().zip(queues) {
            if rays.is_active[lane] {
                let light = lane_vec3(&rays.contribution, lane);
                queue.push(rays.shadow_ray(lane), ray_index, light);
            }
        }
    }

    /// Pushes the shadow rays of a lane through media, which multiply their light by `transmittance`, a function of the
    /// direction and of the point on the light.
    #[inline]
    pub fn push_attenuated_shadow_rays(
        &self,
        lane: usize,
        ray_index: usize,
        queues: &mut [ShadowRayQueue],
        transmittance: impl Fn(Vec3, DVec3) -> (Vec3, InteriorList),
    ) {
        for (i, (rays, queue)) in self.shadow_rays[..self.count].iter().zip(queues).enumerate() {
            if rays.is_active[lane] {
                let samples = &self.samples[i];
                let p_light = lane_dvec3(&samples.p_light, lane);
                let (transmittance, interior) = transmittance(lane_vec3(&samples.direction, lane), p_light);
                if transmittance != Vec3::ZERO {
                    let light = transmittance * lane_vec3(&rays.contribution, lane);
                    queue.push_within(rays.shadow_ray(lane), ray_index, light, interior);
                }
            }
        }
    }
}

/// One shadow ray per lane, and the light that the ray adds if it is unoccluded.
#[derive(Clone, Copy, Debug, Default)]
struct ShadowRayLanes {
    is_active: [bool; LANES],
    contribution: Vec3xN<f32, LANES>,
    origin: Vec3xN<f32, LANES>,
    direction: Vec3xN<f32, LANES>,
    t_max: [f32; LANES],
}

impl ShadowRayLanes {
    #[inline(always)]
    fn shadow_ray(&self, lane: usize) -> Ray {
        Ray {
            origin: get_lane(&self.origin, lane),
            direction: get_lane(&self.direction, lane),
            t_max: self.t_max[lane],
        }
    }
}

/// Evaluates the contribution of one light sample in every lane.
struct EvaluateDirect<'a> {
    context: LaneContext<'a>,
    bsdf: &'a BatchBsdf,
    path_lanes: &'a PathLanes,
    samples: &'a LightLiSamples<LANES>,
    mis_with_bsdf: bool,
    shadow_rays: &'a mut ShadowRayLanes,
}

impl WithSimd for EvaluateDirect<'_> {
    #[inline(always)]
    fn run(self) {
        let (samples, interactions) = (self.samples, self.context.interactions);
        let mut rays = ShadowRayLanes::default();
        let evals = self.bsdf.eval(self.context, &samples.direction);
        for lane in 0..LANES {
            let wi = lane_vec3(&samples.direction, lane);
            let radiance = lane_vec3(&samples.radiance, lane);
            let throughput = lane_vec3(&self.path_lanes.throughput, lane);
            let pdf = samples.pdf[lane];
            let light = throughput * lane_vec3(&evals.value, lane) * (radiance / pdf);
            // Weight by the balance heuristic.
            let has_mis = self.mis_with_bsdf & !samples.is_delta[lane];
            let light = light / if has_mis { 1.0 + evals.pdf[lane] / pdf } else { 1.0 };
            let origin = interactions.offset_ray_origin(lane, wi);
            let p_light = lane_dvec3(&samples.p_light, lane);
            let towards = (p_light - origin).as_vec3();
            let is_infinite = p_light.x == f64::INFINITY;
            let direction = if is_infinite { wi } else { towards };
            rays.t_max[lane] = if is_infinite { f32::INFINITY } else { ONE_MINUS_SHADOW_EPSILON };
            let Vec3 { x, y, z } = light;
            rays.is_active[lane] = (pdf > 0.0) & ((x != 0.0) | (y != 0.0) | (z != 0.0));
            set_lane(&mut rays.contribution, lane, light.to_array());
            set_lane(&mut rays.origin, lane, origin.as_vec3().to_array());
            set_lane(&mut rays.direction, lane, direction.to_array());
        }
        *self.shadow_rays = rays;
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::World;

    use super::*;
    use crate::bsdf::BsdfModel;
    use crate::bsdf::tests::diffuse_lanes::{diffuse_lanes, unit};
    use crate::control::Control;
    use crate::light::samples::LightLiSample;
    use crate::prepare::world::PreparedWorld;

    #[test]
    fn batched_direct_lighting_equals_scalar_evaluation() {
        let mut lit = 0;
        let world = PreparedWorld::new(&World::default(), None, None, &Control::new()).unwrap();
        for first in (0..320).step_by(LANES) {
            let (interactions, diffuse) = diffuse_lanes(first);
            let bsdf = BatchBsdf { diffuse, ..BatchBsdf::default() };
            let mut path_lanes = PathLanes::default();
            let mut samples = LightLiSamples::default();
            for lane in 0..LANES {
                let i = first + lane;
                path_lanes.set_throughput(lane, unit(7 * i).abs());
                let sample = LightLiSample {
                    direction: unit(5 * i),
                    p_light: (i % 7 != 0).then_some(unit(5 * i).as_dvec3() * 3.0),
                    radiance: Vec3::new(3.0, 2.0, 1.0),
                    pdf: 0.1 + i as f32,
                    is_delta: i % 3 == 0,
                };
                samples.set_lane(lane, (i % 5 != 0).then_some(sample));
            }
            let mut rays = ShadowRayLanes::default();
            dispatch_simd(EvaluateDirect {
                context: LaneContext { geometry: &world.geometry, interactions: &interactions },
                bsdf: &bsdf,
                path_lanes: &path_lanes,
                samples: &samples,
                mis_with_bsdf: true,
                shadow_rays: &mut rays,
            });
            for lane in 0..LANES {
                let interaction = interactions.lane(lane);
                let frame = interaction.shading_frame(unit(first + lane));
                let scalar = samples.get_lane(lane).and_then(|sample| {
                    let wi = sample.direction;
                    let scattered = bsdf.diffuse.model.lane(lane).eval(&frame, wi);
                    let throughput = lane_vec3(&path_lanes.throughput, lane);
                    let mut light = throughput * scattered.value * (sample.radiance / sample.pdf);
                    if !sample.is_delta {
                        light /= 1.0 + scattered.pdf / sample.pdf;
                    }
                    let ray = match sample.p_light {
                        None => interaction.spawn_ray(wi, f32::INFINITY),
                        Some(p_light) => Ray {
                            direction: (p_light - interaction.offset_ray_origin(wi)).as_vec3().to_array(),
                            ..interaction.spawn_ray(wi, ONE_MINUS_SHADOW_EPSILON)
                        },
                    };
                    (light != Vec3::ZERO).then_some((ray, light))
                });
                let batched = rays.is_active[lane].then(|| {
                    let light = lane_vec3(&rays.contribution, lane);
                    (rays.shadow_ray(lane), light)
                });
                assert_eq!(format!("{batched:?}"), format!("{scalar:?}"));
                lit += usize::from(scalar.is_some());
            }
        }
        assert!(lit > 60, "{lit}");
    }
}
