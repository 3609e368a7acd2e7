//! Where the paths of a turn meet surfaces, and the random numbers that they need there.

use glam::Vec3;
use raycam_bvh::{Hit, dispatch_simd};

use crate::bsdf::batch::glossy::GlossyBsdfBatch;
use crate::bsdf::batch::glossy_sample::SampleGlossy;
use crate::bsdf::batch::rough_dielectric_sample::SampleRoughDielectric;
use crate::bsdf::diffuse::SampleCosineHemisphere;
use crate::guiding::sample_cones::SampleGuided;
use crate::integrator::batch::bsdf::BatchBsdf;
use crate::integrator::batch::diffuse::{DiffuseBatch, Scatter};
use crate::integrator::batch::direct_lighting::DirectLightingBatch;
use crate::integrator::batch::path_lanes::PathLanes;
use crate::integrator::batch::rough_dielectric::Frosteds;
use crate::integrator::batch::specular::SpecularBatch;
use crate::integrator::path::PathState;
use crate::integrator::shade::PathTracer;
use crate::interaction::SurfaceInteraction;
use crate::interaction::batch::SurfaceInteractions;
use crate::light::prepared_light::PreparedLight;
use crate::light::rectangle::SampleRectangle;
use crate::light::samples::{LightLiSample, LightRandom};
use crate::prepare::material::PreparedMaterial;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::soa::{LANES, TriangleXN, Vec3xN, get_lane, set_triangle};

/// Segments from a surface through a mirror to a light, at least.
pub(crate) const MIN_CAUSTIC_SEGMENTS: u32 = 2;

/// Of all paths of a turn at once, and of some at a time what takes more room.
#[derive(Default)]
pub(crate) struct HitBatch {
    corners: Vec<TriangleXN<LANES>>,
    bsdf_randoms: Vec<[f32; 2]>,
    pub places: SurfaceInteractions<LANES>,
    /// Which surfaces are not there for the ray, by their opacity.
    pub alpha_rejected: [bool; LANES],
    pub diffuse_directions: Vec3xN<f32, LANES>,
    pub path_lanes: PathLanes<LANES>,
    pub diffuse: DiffuseBatch<LANES>,
    pub glossy: GlossyBsdfBatch<LANES>,
    pub specular: SpecularBatch,
    pub rough_dielectric: Frosteds,
    pub direct_lighting: DirectLightingBatch,
}

/// One path's.
pub(crate) struct HitView<'a> {
    pub hit: &'a Hit,
    pub material: &'a PreparedMaterial,
    pub place: SurfaceInteraction,
    /// Where the surface scatters to, if it is matte.
    pub diffuse_direction: Vec3,
    /// ... and if it is not.
    pub bsdf_random: [f32; 2],
    /// Where on the first light.
    pub light_random: LightRandom,
    /// The sample of an area light that is the only one.
    pub single_light_sample: Option<LightLiSample>,
}

impl HitBatch {
    /// Begins a turn. Step by step over all of them: triangles come from all over the memory, and many are fetched at once.
    pub fn begin_bounce(
        &mut self,
        walk: &PathTracer,
        paths: &[PathState],
        live: &[u32],
        hits: &[Hit],
    ) {
        let world = walk.world;
        let which = || live.iter().map(|&at| paths[at as usize].ray_index);
        let turn = walk.bounce;
        let DirectLightingBatch {
            randoms: draws,
            light_choices: choices,
            ..
        } = &mut self.direct_lighting;
        let [first, more @ ..] = &mut draws.numbers;
        let (scatter, light) = (Dimension::Bsdf(turn), Dimension::Light(turn, 0));
        let choice = Dimension::LobeAndLight(turn);
        choices.clear();
        let (samplers, out) = (walk.samplers, &mut self.bsdf_randoms);
        // Together, as they are of one group.
        match (
            walk.has_light_samples,
            (walk.has_light_samples && walk.needs_light_choice) || walk.needs_lobe_choice,
        ) {
            (true, true) => {
                let pairs = [scatter, light, choice];
                Sampler::get_2d_many(samplers, which(), pairs, [out, first, choices]);
            }
            (true, false) => {
                Sampler::get_2d_many(samplers, which(), [scatter, light], [out, first])
            }
            (false, true) => {
                Sampler::get_2d_many(samplers, which(), [scatter, choice], [out, choices])
            }
            (false, false) => Sampler::get_2d_many(samplers, which(), [scatter], [out]),
        }
        if !walk.has_light_samples {
            first.clear();
            first.resize(live.len(), [0.0; 2]);
        }
        for i in walk
            .light_sample_indices()
            .filter(|&i| walk.batch_direct_lighting && i > 0)
        {
            let out = &mut more[i - 1];
            Sampler::get_2d_many(samplers, which(), [Dimension::Light(turn, i)], [out]);
        }
        if walk.has_light_samples {
            draws.presample_environment(walk);
        }
        let chunks = hits.chunks(LANES);
        if self.corners.len() < chunks.len() {
            self.corners.resize(chunks.len(), [[[0.0; LANES]; 3]; 3]);
        }
        for (hits, corners) in chunks.zip(&mut self.corners) {
            for (lane, hit) in hits.iter().enumerate() {
                set_triangle(
                    corners,
                    lane,
                    world.geometry.corners(hit.instance, hit.triangle),
                );
            }
        }
    }

    /// Goes on to chunk `number` of [`LANES`] paths.
    pub fn load_lanes(
        &mut self,
        walk: &PathTracer,
        number: usize,
        paths: &mut [PathState],
        live: &[u32],
        hits: &[Hit],
    ) {
        let first = number * LANES;
        let mut random = [[0.0; LANES]; 2];
        let mut on_light = [[0.0; LANES]; 2];
        *self.places.clear() = self.corners[number];
        for (lane, (&at, hit)) in live.iter().zip(hits).enumerate() {
            let (index, path) = (first + lane, &mut paths[at as usize]);
            path.ray_cone = path.ray_cone.propagate(hit.t);
            let (direction, width) = (path.direction, path.ray_cone.width);
            self.places
                .set_lane(lane, &walk.world.geometry, direction, hit, width);
            [random[0][lane], random[1][lane]] = self.bsdf_randoms[index];
            [on_light[0][lane], on_light[1][lane]] = self.direct_lighting.randoms.numbers[0][index];
        }
        dispatch_simd(&mut self.places);
        dispatch_simd(SampleCosineHemisphere {
            normals: self.places.shading_normals(),
            random: &random,
            out: &mut self.diffuse_directions,
        });
        if let Some(PreparedLight::Rectangle(area)) = walk.single_light {
            dispatch_simd(SampleRectangle {
                light: area,
                points: self.places.positions(),
                random: &on_light,
                out: &mut self.direct_lighting.samples[0],
            });
        }
        self.scatter(walk, number, paths, live, hits, &random);
    }

    /// What happens at surfaces that are met many at a time.
    fn scatter(
        &mut self,
        walk: &PathTracer,
        number: usize,
        paths: &[PathState],
        live: &[u32],
        hits: &[Hit],
        random: &[[f32; LANES]; 2],
    ) {
        let Self {
            places,
            alpha_rejected: absent,
            diffuse_directions: matte,
            path_lanes: arriving,
            diffuse: mattes,
            glossy: glossies,
            specular: smooths,
            rough_dielectric: frosteds,
            direct_lighting: asked,
            ..
        } = self;
        mattes.is_active = [false; LANES];
        glossies.clear();
        smooths.points.clear();
        frosteds.points.clear();
        let mut aimed = [false; LANES];
        for (lane, (&at, hit)) in live.iter().zip(hits).enumerate() {
            let path = &paths[at as usize];
            let material = walk.world.geometry.material(hit);
            arriving.set_lane(lane, path);
            // The backs of one-sided surfaces are another matter.
            absent[lane] =
                !walk.is_culled_back_face(path, &material.material, places.is_front(lane))
                    && walk.fails_alpha_test(path, &material.material, hit);
            if absent[lane] {
                continue;
            }
            let Some(albedo) = walk.diffuse_albedo(path, (material, hit), places, lane) else {
                walk.load_glossy(path, (material, hit), (places, lane), glossies);
                walk.put_smooth(path, (material, hit), (places, lane), smooths);
                walk.put_frosted(path, (material, hit), (places, lane), arriving, frosteds);
                continue;
            };
            mattes.set_lane(lane, albedo);
            aimed[lane] =
                path.depth.saturating_add(MIN_CAUSTIC_SEGMENTS) <= walk.settings.max_depth;
        }
        arriving.test_light_bounds(walk.lights, places.directions());
        let mut choice = [0.0; LANES];
        let choices = asked.light_choices.iter().skip(number * LANES);
        for (choice, [x, _]) in choice.iter_mut().zip(choices) {
            *choice = *x;
        }
        walk.find_smooth(&choice, places, smooths);
        if glossies.any() {
            dispatch_simd(SampleGlossy {
                places,
                random,
                choice: &choice,
                batch: glossies,
            });
        }
        if frosteds.points.any() {
            dispatch_simd(SampleRoughDielectric {
                world: &walk.world.geometry,
                places,
                random,
                choice: &choice,
                batch: &mut frosteds.points,
            });
        }
        if mattes.any_active() {
            mattes.guiding.clear();
            if !walk.caustic_casters.is_empty() && aimed != [false; LANES] {
                dispatch_simd(SampleGuided {
                    casters: walk.caustic_casters,
                    maps: walk.caustic_maps,
                    places,
                    active: &aimed,
                    random,
                    cones: &mut mattes.guiding,
                    out: matte,
                });
            }
            dispatch_simd(Scatter {
                places,
                directions: matte,
                mattes,
            });
        }
        if walk.batch_direct_lighting
            && (mattes.any_active() || glossies.any() || frosteds.points.any())
        {
            let surfaces = BatchBsdf {
                path_lanes: arriving,
                diffuse: mattes,
                glossy: glossies,
                rough_dielectric: &frosteds.points,
                world: walk.world,
            };
            asked.evaluate_chunk(walk, number, places, surfaces);
        }
    }

    /// One of the chunk at hand, by its hit.
    #[inline]
    pub fn view<'a>(
        &self,
        walk: &PathTracer<'a>,
        number: usize,
        lane: usize,
        hit: &'a Hit,
    ) -> HitView<'a> {
        let index = number * LANES + lane;
        HitView {
            hit,
            material: walk.world.geometry.material(hit),
            place: self.places.lane(lane),
            diffuse_direction: get_lane(&self.diffuse_directions, lane).into(),
            bsdf_random: self.bsdf_randoms[index],
            light_random: self.direct_lighting.randoms.random_for(0, index),
            single_light_sample: match walk.single_light {
                Some(PreparedLight::Rectangle(_)) => self.direct_lighting.samples[0].get_lane(lane),
                _ => None,
            },
        }
    }
}
