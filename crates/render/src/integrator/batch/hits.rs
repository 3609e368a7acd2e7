//! Hits of a bounce: their random numbers, and the interactions and BSDFs of one chunk at a time.

use glam::Vec3;
use raycam_bvh::{Hit, dispatch_simd};

use crate::bsdf::batch::{LaneContext, LaneRandoms};
use crate::bsdf::diffuse::SampleCosineHemisphere;
use crate::bsdf::material_hit::MaterialHit;
use crate::integrator::batch::bsdf::BatchBsdf;
use crate::integrator::batch::direct_lighting::DirectLightingBatch;
use crate::integrator::batch::path_lanes::PathLanes;
use crate::integrator::path_state::{ColorChannel, HitView, PathState};
use crate::integrator::path_tracer::PathTracer;
use crate::interaction::batch::SurfaceInteractions;
use crate::light::prepared_light::PreparedLight;
use crate::light::rectangle::SampleRectangle;
use crate::lobes::classify::BatchKind;
use crate::media::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::path_guiding::{GuidedPoints, MIN_GUIDED_SEGMENTS};
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::soa::{LANES, TriangleXN, lane_vec3, set_lane, set_triangle};

/// Maximum number of times that a path from the camera may follow both branches of a dielectric.
const MAX_SPLITS: u8 = 2;

/// At most [`LANES`] hits of a bounce.
#[derive(Clone, Copy)]
pub(crate) struct Chunk<'a> {
    pub index: usize,
    pub hits: &'a [Hit],
    /// Indices of the hits' paths.
    pub paths: &'a [u32],
}

/// Random numbers of all hits of a bounce, and the data of one chunk.
#[derive(Default)]
pub(crate) struct HitBatch {
    corners: Vec<TriangleXN<LANES>>,
    bsdf_randoms: Vec<[f32; 2]>,
    pub interactions: SurfaceInteractions<LANES>,
    pub path_lanes: PathLanes,
    /// For each lane: true if the ray passes the surface, because of the surface's opacity or because the
    /// object is hidden from the ray.
    pub alpha_rejected: [bool; LANES],
    pub bsdf: BatchBsdf,
    /// For each lane with a transmissive batched BSDF: the media behind the surface.
    pub far_sides: [InteriorList; LANES],
    /// For each lane: true if the BSDF is diffuse and its samples may be guided.
    may_guide: [bool; LANES],
    pub direct_lighting: DirectLightingBatch,
}

impl HitBatch {
    /// Draws the random numbers of a bounce and gathers the triangles of its hits. Each step is one pass over all hits,
    /// so that the cache misses of the triangles, which are scattered in memory, overlap.
    pub fn begin_bounce(&mut self, tracer: &PathTracer, paths: &[PathState], active: &[u32], hits: &[Hit]) {
        self.draw_randoms(tracer, paths, active);
        let chunks = hits.chunks(LANES);
        if self.corners.len() < chunks.len() {
            self.corners.resize(chunks.len(), [[[0.0; LANES]; 3]; 3]);
        }
        for (hits, corners) in chunks.zip(&mut self.corners) {
            for (lane, hit) in hits.iter().enumerate() {
                let triangle = tracer.geometry.corners(hit.instance, hit.triangle);
                set_triangle(corners, lane, triangle);
            }
        }
    }

    fn draw_randoms(&mut self, tracer: &PathTracer, paths: &[PathState], active: &[u32]) {
        let (samplers, bounce, modes) = (tracer.samplers, tracer.bounce, &tracer.modes);
        let ray_indices = || active.iter().map(|&path| paths[path as usize].ray_index());
        let DirectLightingBatch { randoms, light_choices: choices, .. } = &mut self.direct_lighting;
        let [first, more @ ..] = &mut randoms.numbers;
        let (bsdf, light) = (Dimension::Bsdf(bounce), Dimension::Light(bounce, 0));
        let choice = Dimension::LobeAndLight(bounce);
        choices.clear();
        let out = &mut self.bsdf_randoms;
        let has_lights = modes.has_light_samples();
        let has_choice = modes.needs_light_choice() || modes.needs_lobe_choice;
        // It is fastest to draw all dimensions of a group together.
        match (has_lights, has_choice) {
            (true, true) => {
                let dimensions = [bsdf, light, choice];
                Sampler::get_2d_many(samplers, ray_indices(), dimensions, [out, first, choices]);
            }
            (true, false) => {
                Sampler::get_2d_many(samplers, ray_indices(), [bsdf, light], [out, first]);
            }
            (false, true) => {
                Sampler::get_2d_many(samplers, ray_indices(), [bsdf, choice], [out, choices]);
            }
            (false, false) => Sampler::get_2d_many(samplers, ray_indices(), [bsdf], [out]),
        }
        if !has_lights {
            first.clear();
            first.resize(active.len(), [0.0; 2]);
        }
        let indices = tracer.light_sample_indices();
        for i in indices.filter(|&i| modes.batch_direct_lighting && i > 0) {
            let dimension = Dimension::Light(bounce, i);
            Sampler::get_2d_many(samplers, ray_indices(), [dimension], [&mut more[i - 1]]);
        }
        if has_lights {
            randoms.presample_environment(tracer);
        }
    }

    /// Computes interactions, BSDF samples and direct lighting of a chunk.
    pub fn evaluate_chunk(&mut self, tracer: &PathTracer, chunk: Chunk, paths: &mut [PathState]) {
        let first = chunk.index * LANES;
        let mut random = [[0.0; LANES]; 2];
        let mut light_random = [[0.0; LANES]; 2];
        *self.interactions.clear() = self.corners[chunk.index];
        for (lane, (&path, hit)) in chunk.paths.iter().zip(chunk.hits).enumerate() {
            let (index, path) = (first + lane, &mut paths[path as usize]);
            path.ray_cone = path.ray_cone.propagate(hit.t);
            self.interactions.set_lane(lane, tracer.geometry, path.direction, hit, &path.ray_cone);
            [random[0][lane], random[1][lane]] = self.bsdf_randoms[index];
            [light_random[0][lane], light_random[1][lane]] = self.direct_lighting.randoms.numbers[0][index];
        }
        dispatch_simd(&mut self.interactions);
        dispatch_simd(SampleCosineHemisphere {
            normals: self.interactions.shading_normals(),
            random: &random,
            out: &mut self.bsdf.diffuse.model.directions,
        });
        if let Some(PreparedLight::Rectangle(light)) = tracer.modes.single_light() {
            dispatch_simd(SampleRectangle {
                light,
                points: self.interactions.positions(),
                random: &light_random,
                out: &mut self.direct_lighting.samples[0],
            });
        }
        self.bsdf.clear();
        self.may_guide = [false; LANES];
        for (lane, (&path, hit)) in chunk.paths.iter().zip(chunk.hits).enumerate() {
            self.load_lane(tracer, &paths[path as usize], hit, lane);
        }
        self.path_lanes.test_light_bounds(tracer.lights, self.interactions.directions());
        self.guide_diffuse(tracer, &random);
        self.evaluate_bsdfs(tracer, chunk, &random);
    }

    /// Loads the path of a lane, and the BSDF of its hit if that BSDF is batched.
    fn load_lane(&mut self, tracer: &PathTracer, path: &PathState, hit: &Hit, lane: usize) {
        let (geometry, interactions) = (tracer.geometry, &self.interactions);
        let prepared = geometry.material(hit);
        let material = &prepared.material;
        let is_front = interactions.is_front(lane);
        let is_culled = tracer.is_culled_back_face(path, material, is_front);
        self.path_lanes.set(lane, path);
        if tracer.settings.meets_white && path.is_camera_ray {
            self.alpha_rejected[lane] = false;
            self.load_diffuse(tracer, path, Vec3::ONE, lane);
            return;
        }
        self.alpha_rejected[lane] = !is_culled && tracer.fails_alpha_test(path, material, hit)
            || tracer.modes.has_hidden_objects && tracer.is_hidden(path, hit);
        if self.alpha_rejected[lane] {
            return;
        }
        let is_outside = path.interior_list.is_empty();
        match prepared.kind {
            BatchKind::Diffuse(factor) if is_outside && !is_culled => {
                let footprint = interactions.footprint(lane);
                let albedo = geometry.base_color_with(prepared, hit, footprint) * factor;
                self.load_diffuse(tracer, path, albedo, lane);
            }
            BatchKind::Glossy if is_outside && !is_culled && is_lit_in_batch(tracer, path) => {
                let hit = MaterialHit::at_lane(geometry, hit, interactions, lane);
                self.bsdf.glossy.load(lane, &hit);
            }
            BatchKind::Specular => self.load_specular(tracer, path, hit, lane, is_culled),
            BatchKind::RoughDielectric if is_lit_in_batch(tracer, path) => {
                self.load_rough_dielectric(tracer, path, hit, lane);
            }
            _ => {}
        }
    }

    fn load_diffuse(&mut self, tracer: &PathTracer, path: &PathState, albedo: Vec3, lane: usize) {
        let diffuse = &mut self.bsdf.diffuse;
        set_lane(&mut diffuse.model.albedo, lane, albedo.to_array());
        diffuse.activate(lane, self.interactions.shading_normal(lane));
        let segments = u32::from(path.depth).saturating_add(MIN_GUIDED_SEGMENTS);
        self.may_guide[lane] = segments <= tracer.settings.max_depth;
    }

    fn load_specular(&mut self, tracer: &PathTracer, path: &PathState, hit: &Hit, lane: usize, is_culled: bool) {
        let at = (&self.interactions, lane);
        let Some((material_hit, far_side)) = interface_at(tracer, path, hit, at) else {
            return;
        };
        let specular = &mut self.bsdf.specular;
        if specular.load(lane, &material_hit) {
            if path.split_count < MAX_SPLITS && path.specular_bounce {
                specular.model.allow_split(lane);
            }
            if is_culled && specular.model.transmission(lane) == Vec3::ZERO {
                specular.lanes.is_active[lane] = false;
            }
        }
        self.far_sides[lane] = far_side;
    }

    fn load_rough_dielectric(&mut self, tracer: &PathTracer, path: &PathState, hit: &Hit, lane: usize) {
        let at = (&self.interactions, lane);
        let Some((material_hit, far_side)) = interface_at(tracer, path, hit, at) else {
            return;
        };
        if self.bsdf.rough_dielectric.load(lane, &material_hit) && !path.interior_list.is_empty() {
            // Direct lighting requires the throughput at the surface, after absorption along the ray.
            let mut path = *path;
            let position = self.interactions.position(lane);
            let distance = path.distance_to(position);
            tracer.apply_absorption(&mut path, distance);
            self.path_lanes.set_throughput(lane, path.throughput);
        }
        self.far_sides[lane] = far_side;
    }

    /// Samples the directions of diffuse BSDFs by path guiding.
    fn guide_diffuse(&mut self, tracer: &PathTracer, random: &[[f32; LANES]; 2]) {
        let diffuse = &mut self.bsdf.diffuse;
        if !diffuse.any_active() {
            return;
        }
        diffuse.model.guiding.clear();
        if let Some(guide) = &tracer.guide
            && self.may_guide != [false; LANES]
        {
            let points = GuidedPoints { interactions: &self.interactions, active: &self.may_guide, random };
            guide.sample(&points, &mut diffuse.model.guiding, &mut diffuse.model.directions);
        }
    }

    /// Samples the BSDFs of the chunk, and evaluates them for its light samples.
    fn evaluate_bsdfs(&mut self, tracer: &PathTracer, chunk: Chunk, random: &[[f32; LANES]; 2]) {
        let mut lobe = [0.0; LANES];
        let choices = &self.direct_lighting.light_choices;
        for (lobe, [choice, _]) in lobe.iter_mut().zip(choices.iter().skip(chunk.index * LANES)) {
            *lobe = *choice;
        }
        let context = LaneContext { geometry: tracer.geometry, interactions: &self.interactions };
        let randoms = LaneRandoms { direction: random, lobe: &lobe };
        self.bsdf.sample_all(context, randoms);
        if tracer.modes.batch_direct_lighting && self.bsdf.any_non_specular() {
            let (bsdf, paths) = (&self.bsdf, &self.path_lanes);
            self.direct_lighting.evaluate_chunk(tracer, chunk.index, context, bsdf, paths);
        }
    }

    /// False if the ray of a lane passes its hit as if there were no surface.
    pub fn is_solid(&self, tracer: &PathTracer, path: &PathState, (hit, lane): (&Hit, usize)) -> bool {
        let material = &tracer.geometry.material(hit).material;
        !self.alpha_rejected[lane] && !tracer.is_culled_back_face(path, material, self.interactions.is_front(lane))
    }

    /// Hit of a lane, in the form in which single hits are shaded.
    #[inline]
    pub fn view<'a>(&self, tracer: &PathTracer<'a>, chunk: Chunk<'a>, lane: usize) -> HitView<'a> {
        let index = chunk.index * LANES + lane;
        let hit = &chunk.hits[lane];
        HitView {
            hit,
            material: tracer.geometry.material(hit),
            interaction: self.interactions.lane(lane),
            diffuse_direction: lane_vec3(&self.bsdf.diffuse.model.directions, lane),
            bsdf_random: self.bsdf_randoms[index],
            light_random: self.direct_lighting.randoms.random_for(0, index),
            single_light_sample: match tracer.modes.single_light() {
                Some(PreparedLight::Rectangle(_)) => self.direct_lighting.samples[0].get_lane(lane),
                _ => None,
            },
        }
    }
}

/// True if the direct lighting of a path's hit is either evaluated together with its chunk or not required.
fn is_lit_in_batch(tracer: &PathTracer, path: &PathState) -> bool {
    let is_unlit = !tracer.modes.has_light_samples() && tracer.settings.ambient_term.is_none();
    let has_passes = tracer.settings.passes.is_some();
    tracer.samples_lights_in_step(path) && (tracer.modes.batch_direct_lighting || is_unlit) && !has_passes
}

/// Hit of a lane at the boundary of a medium, and the media behind it. `None` for a false intersection, and for the
/// rare path that leaves a medium without having entered it.
#[inline]
fn interface_at<'a>(
    tracer: &PathTracer<'a>,
    path: &PathState,
    hit: &'a Hit,
    (interactions, lane): (&'a SurfaceInteractions<LANES>, usize),
) -> Option<(MaterialHit<'a>, InteriorList)> {
    let channel = path.wavelength_channel.map(ColorChannel::index);
    let (is_front, media) = (interactions.is_front(lane), path.interior_list);
    let transition = InterfaceTransition::at_hit(tracer.geometry, media, hit, is_front, channel);
    if transition.is_false_intersection || transition.near_side != media {
        return None;
    }
    let hit = MaterialHit::at_lane(tracer.geometry, hit, interactions, lane);
    let hit = hit.seen_by(channel, transition.outside_ior);
    Some((hit, transition.far_side))
}
