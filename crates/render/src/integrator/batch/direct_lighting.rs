//! What lights bring to matte and glossy surfaces, many at a time: what [`PathTracer::sample_lights`] asks for one by one.

use glam::{DVec3, Vec3};
use raycam_bvh::{Ray, WithSimd, dispatch_simd};

use crate::integrator::batch::bsdf::BatchBsdf;
use crate::integrator::shade::PathTracer;
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::LightSampleContext;
use crate::interaction::batch::SurfaceInteractions;
use crate::light::light_sampling::{LightSampleContexts, LightSampling, MAX_SPLIT_SAMPLES};
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::{
    EnvironmentSample, LightLiSamples, LightRandom, ONE_MINUS_SHADOW_EPSILON,
};
use crate::light::tree::importance::{ComputeNodeImportances, NodeImportances};
use crate::soa::{LANES, Vec3xN, get_lane, lane_dvec3, set_lane};

/// What the surfaces of a turn ask lights for: the random numbers of all of them, and of some at a time what takes more
/// room.
#[derive(Default)]
pub(crate) struct DirectLightingBatch {
    /// Where on each of the lights that are sampled at a point.
    pub randoms: LightRandoms,
    /// Which light.
    pub light_choices: Vec<[f32; 2]>,
    pub samples: [LightLiSamples<LANES>; MAX_SPLIT_SAMPLES],
    shadow_rays: [ShadowRayLanes<LANES>; MAX_SPLIT_SAMPLES],
    /// Of lights without a mesh, and of surfaces that shine.
    importances: [NodeImportances; 2],
    /// How many of `shadow_rays` there are, the last of which has something.
    count: usize,
}

/// Random numbers of all surfaces of a turn, light by light.
#[derive(Default)]
pub(crate) struct LightRandoms {
    pub numbers: [Vec<[f32; 2]>; MAX_SPLIT_SAMPLES],
    /// What they draw of the image or the sky all around, where it may be asked for, and its number.
    environment_samples: [Vec<EnvironmentSample>; MAX_SPLIT_SAMPLES],
    environment_index: usize,
}

impl LightRandoms {
    /// Draws from the image or the sky all around: for all surfaces, whatever they are, so that none waits for what it reads.
    pub fn presample_environment(&mut self, walk: &PathTracer) {
        self.environment_samples.iter_mut().for_each(Vec::clear);
        let Some((number, environment)) = walk.lights.environment() else {
            return;
        };
        self.environment_index = number;
        let splits = walk.light_sampling_of_bounce() == LightSampling::Split;
        for i in walk
            .light_sample_indices()
            .filter(|&i| walk.batch_direct_lighting || i == 0)
        {
            if !splits || i == number {
                environment.sample_many(&self.numbers[i], &mut self.environment_samples[i]);
            }
        }
    }

    /// Where a surface of the turn asks light `i`.
    pub fn random_for(&self, i: usize, surface: usize) -> LightRandom {
        let around = self.environment_samples[i].get(surface);
        LightRandom {
            random: self.numbers[i][surface],
            environment: around.map(|&around| (self.environment_index, around)),
        }
    }
}

impl DirectLightingBatch {
    /// Finds what arrives at the surfaces of chunk `number`. Samples of a lone area light are there already.
    pub fn evaluate_chunk(
        &mut self,
        walk: &PathTracer,
        number: usize,
        places: &SurfaceInteractions<LANES>,
        surfaces: BatchBsdf<LANES>,
    ) {
        if !matches!(walk.single_light, Some(PreparedLight::Rectangle(_))) {
            walk.light_sample_indices()
                .for_each(|i| self.samples[i].clear());
            let choice = walk.light_sampling_of_bounce();
            let small = walk.lights.single_node_trees(choice);
            let normals = surfaces.normals(places);
            for (node, out) in small.iter().zip(&mut self.importances) {
                if let Some(node) = node {
                    dispatch_simd(ComputeNodeImportances {
                        node,
                        points: places.positions(),
                        normals: &normals,
                        out,
                    });
                }
            }
            let known = [0, 1].map(|i: usize| small[i].map(|_| &self.importances[i]));
            for lane in (0..LANES).filter(|&lane| surfaces.is_active(lane)) {
                let from = LightSampleContext {
                    position: places.position(lane),
                    normal: get_lane(&normals, lane).into(),
                };
                let index = number * LANES + lane;
                let which = if walk.needs_light_choice {
                    self.light_choices[index][1]
                } else {
                    0.0
                };
                let random = |i: usize| self.randoms.random_for(i, index);
                let put = |i: usize, sample| self.samples[i].set_lane(lane, Some(sample));
                let by = LightSampleContexts {
                    from: &from,
                    importances: known.map(|known| Some((known?, lane))),
                };
                walk.for_each_light_sample(choice, &by, which, random, put);
            }
        }
        self.count = 0;
        for i in walk.light_sample_indices() {
            // Numbers between these have nothing.
            for lit in &mut self.shadow_rays[self.count..i] {
                lit.is_active = [false; LANES];
            }
            dispatch_simd(EvaluateDirect {
                places,
                samples: &self.samples[i],
                mis_with_bsdf: walk.mis_with_bsdf,
                surfaces,
                shadow_rays: &mut self.shadow_rays[i],
            });
            self.count = i + 1;
        }
    }

    /// Asks whether light arrives at a lane, which is of a path with this ray.
    #[inline(always)]
    pub fn push_shadow_rays(&self, lane: usize, ray: usize, shadows: &mut [ShadowRayQueue]) {
        for (lit, shadows) in self.shadow_rays[..self.count].iter().zip(shadows) {
            if lit.is_active[lane] {
                shadows.push(
                    lit.shadow_ray(lane),
                    ray,
                    get_lane(&lit.contribution, lane).into(),
                );
            }
        }
    }

    /// The same where only a part of the light from a direction and an end arrives, or none.
    #[inline]
    pub fn push_attenuated_shadow_rays(
        &self,
        lane: usize,
        ray: usize,
        shadows: &mut [ShadowRayQueue],
        through: impl Fn(Vec3, DVec3) -> Vec3,
    ) {
        for (i, (lit, shadows)) in self.shadow_rays[..self.count]
            .iter()
            .zip(shadows)
            .enumerate()
        {
            if lit.is_active[lane] {
                let samples = &self.samples[i];
                let end: DVec3 = lane_dvec3(&samples.p_light, lane);
                let part = through(get_lane(&samples.direction, lane).into(), end);
                if part != Vec3::ZERO {
                    let light = part * Vec3::from(get_lane(&lit.contribution, lane));
                    shadows.push(lit.shadow_ray(lane), ray, light);
                }
            }
        }
    }
}

/// What may come from a light: whether anything, how much, and the shadow ray.
#[derive(Clone, Copy, Debug)]
struct ShadowRayLanes<const N: usize> {
    is_active: [bool; N],
    contribution: Vec3xN<f32, N>,
    origin: Vec3xN<f32, N>,
    direction: Vec3xN<f32, N>,
    t_max: [f32; N],
}

impl<const N: usize> Default for ShadowRayLanes<N> {
    fn default() -> Self {
        Self {
            is_active: [false; N],
            contribution: [[0.0; N]; 3],
            origin: [[0.0; N]; 3],
            direction: [[0.0; N]; 3],
            t_max: [0.0; N],
        }
    }
}

impl<const N: usize> ShadowRayLanes<N> {
    #[inline(always)]
    fn shadow_ray(&self, lane: usize) -> Ray {
        Ray {
            origin: get_lane(&self.origin, lane),
            direction: get_lane(&self.direction, lane),
            t_max: self.t_max[lane],
        }
    }
}

/// Finds what one light brings to the paths.
struct EvaluateDirect<'a, const N: usize> {
    places: &'a SurfaceInteractions<N>,
    samples: &'a LightLiSamples<N>,
    /// Whether scattered rays may find it too.
    mis_with_bsdf: bool,
    surfaces: BatchBsdf<'a, N>,
    shadow_rays: &'a mut ShadowRayLanes<N>,
}

impl<const N: usize> WithSimd for EvaluateDirect<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            samples,
            mis_with_bsdf: found,
            surfaces,
            shadow_rays: out,
        } = self;
        let mut lit = ShadowRayLanes::default();
        let values = surfaces.eval(places, &samples.direction);
        for lane in 0..N {
            let direction = Vec3::from(get_lane(&samples.direction, lane));
            let radiance = Vec3::from(get_lane(&samples.radiance, lane));
            let throughput = Vec3::from(get_lane(&surfaces.path_lanes.throughput, lane));
            let (value, density) = (get_lane(&values.value, lane), values.pdf[lane]);
            let pdf = samples.pdf[lane];
            let light = throughput * Vec3::from(value) * (radiance / pdf);
            let both = found & !samples.is_delta[lane];
            let light = light / if both { 1.0 + density / pdf } else { 1.0 };
            let start = places.offset_ray_origin(lane, direction);
            let end: DVec3 = lane_dvec3(&samples.p_light, lane);
            let way = (end - start).as_vec3();
            let infinite = end.x == f64::INFINITY;
            let way = if infinite { direction } else { way };
            lit.t_max[lane] = if infinite {
                f32::INFINITY
            } else {
                ONE_MINUS_SHADOW_EPSILON
            };
            let Vec3 { x, y, z } = light;
            lit.is_active[lane] = (pdf > 0.0) & ((x != 0.0) | (y != 0.0) | (z != 0.0));
            set_lane(&mut lit.contribution, lane, light.to_array());
            set_lane(&mut lit.origin, lane, start.as_vec3().to_array());
            set_lane(&mut lit.direction, lane, way.to_array());
        }
        *out = lit;
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::World;

    use super::*;
    use crate::bsdf::BsdfModel;
    use crate::bsdf::batch::glossy::GlossyBsdfBatch;
    use crate::bsdf::batch::rough_dielectric::RoughDielectricBsdfBatch;
    use crate::control::Control;
    use crate::integrator::batch::diffuse::tests::{alone, some, unit};
    use crate::integrator::batch::path_lanes::PathLanes;
    use crate::light::samples::LightLiSample;
    use crate::prepare::world::PreparedWorld;

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let mut lit = 0;
        let (glossies, frosted) = (
            GlossyBsdfBatch::default(),
            RoughDielectricBsdfBatch::default(),
        );
        let world = PreparedWorld::new(&World::default(), None, None, &Control::new()).unwrap();
        for first in (0..320).step_by(LANES) {
            let (places, mattes, directions) = some(first);
            let mut arriving = PathLanes::default();
            let mut samples = LightLiSamples::default();
            for lane in 0..LANES {
                let i = first + lane;
                set_lane(&mut arriving.throughput, lane, unit(7 * i).abs().to_array());
                let sample = LightLiSample {
                    direction: unit(5 * i),
                    p_light: (i % 7 != 0).then_some(unit(5 * i).as_dvec3() * 3.0),
                    radiance: Vec3::new(3.0, 2.0, 1.0),
                    pdf: 0.1 + i as f32,
                    is_delta: i % 3 == 0,
                };
                samples.set_lane(lane, (i % 5 != 0).then_some(sample));
            }
            let mut lanes = ShadowRayLanes::default();
            dispatch_simd(EvaluateDirect {
                places: &places,
                samples: &samples,
                mis_with_bsdf: true,
                surfaces: BatchBsdf {
                    path_lanes: &arriving,
                    diffuse: &mattes,
                    glossy: &glossies,
                    rough_dielectric: &frosted,
                    world: &world,
                },
                shadow_rays: &mut lanes,
            });
            for lane in 0..LANES {
                let place = places.lane(lane);
                let matte = alone(&mattes, &directions, lane);
                let frame = place.shading_frame(unit(first + lane));
                let alone = samples.get_lane(lane).and_then(|sample| {
                    let scattered = matte.eval(&frame, sample.direction);
                    let throughput = Vec3::from(get_lane(&arriving.throughput, lane));
                    let mut light = throughput * scattered.value * (sample.radiance / sample.pdf);
                    if !sample.is_delta {
                        light /= 1.0 + scattered.pdf / sample.pdf;
                    }
                    let ray = match sample.p_light {
                        None => place.spawn_ray(sample.direction, f32::INFINITY),
                        Some(end) => Ray {
                            direction: (end - place.offset_ray_origin(sample.direction))
                                .as_vec3()
                                .to_array(),
                            ..place.spawn_ray(sample.direction, ONE_MINUS_SHADOW_EPSILON)
                        },
                    };
                    (light != Vec3::ZERO).then_some((ray, light))
                });
                let known = lanes.is_active[lane].then(|| {
                    let ray = Ray {
                        origin: get_lane(&lanes.origin, lane),
                        direction: get_lane(&lanes.direction, lane),
                        t_max: lanes.t_max[lane],
                    };
                    (ray, Vec3::from(get_lane(&lanes.contribution, lane)))
                });
                assert_eq!(format!("{known:?}"), format!("{alone:?}"));
                lit += usize::from(alone.is_some());
            }
        }
        assert!(lit > 60, "{lit}");
    }
}
