//! `path`, and `direct`, which is `path` of one bounce behind mirrors and glass: one loop over the rays of a tile.
//!
//! Every turn shades what the live rays met, asks for shadows in one batch and traces the rays that go on in another.
//! Light is found in two ways, by sampling lights and by sampling the surface; each way is weighed by the balance
//! heuristic (E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2.2).

use glam::Vec3;
use raycam_bvh::{Coherence, Hit, Ray};

use super::{CameraRayBatch, PathSettings, is_miss};
use crate::control::Control;
use crate::error::RenderError;
use crate::integrator::batch::hits::HitBatch;
use crate::integrator::nested_dielectrics::InteriorList;
use crate::integrator::shade::PathTracer;
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::LightSampleContext;
use crate::interaction::ray_cone::RayCone;
use crate::light::light_sampling::{LightSampling, MAX_SPLIT_SAMPLES};
use crate::light::lights::Lights;
use crate::prepare::material::PreparedMaterial;
use crate::prepare::world::PreparedWorld;
use crate::soa::LANES;

/// A ray on its way from the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathState {
    /// Index in the batch.
    pub ray_index: usize,
    /// What radiance along the ray is multiplied by to get the camera's.
    pub throughput: Vec3,
    pub direction: Vec3,
    /// Where it was scattered last; the camera at first.
    pub prev_context: LightSampleContext,
    /// The density with which the surface there chose this direction.
    pub bsdf_pdf: f32,
    /// Whether no light sampling could have found its direction: it comes from the camera, a mirror or smooth glass.
    pub specular_bounce: bool,
    /// Whether nothing has scattered it yet.
    pub is_camera_ray: bool,
    /// How often it has gone two ways.
    pub split_count: u8,
    /// How lights were chosen where it was scattered last.
    pub light_sampling: LightSampling,
    /// Segments, this one included, as the rules count them.
    pub depth: u32,
    /// What clear matter it goes through.
    pub interior_list: InteriorList,
    /// The one colour that it carries, where dispersion has split it.
    pub wavelength_channel: Option<u8>,
    /// What refraction has divided the throughput by, and will multiply it by on the way out.
    pub eta_scale: f32,
    /// How wide it is, until a surface scatters it.
    pub ray_cone: RayCone,
}

// Two lines of the cache; what is larger the compiler copies by a call.
const _: () = assert!(size_of::<PathState>() <= 128);

pub(super) fn radiance(
    world: &PreparedWorld,
    rules: &PathSettings,
    batch: &CameraRayBatch,
    control: &Control,
    room: &mut PathScratch,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) -> Result<(), RenderError> {
    let lights = rules.lights;
    let at_once = lights.max_split_samples().filter(|_| rules.split_lights);
    let sampled = lights.has_light_samples(rules.light_sampling);
    // Where an ambient term is no part of it.
    let many = sampled && rules.ambient_term.is_none() && rules.light_samples <= MAX_SPLIT_SAMPLES;
    let mut walk = PathTracer {
        world,
        lights,
        settings: rules,
        samplers: batch.samplers,
        mis_with_bsdf: lights.is_hittable(rules.ambient_term.is_some()),
        has_light_samples: sampled,
        needs_light_choice: rules.light_samples > 1 || lights.needs_choice(rules.light_sampling),
        single_light: lights
            .single_light(rules.light_sampling)
            .filter(|_| many && rules.light_samples == 1),
        batch_direct_lighting: many,
        split_lights: at_once.is_some(),
        occlusion_only_last_segment: last_segment_is_occlusion_only(world, lights),
        needs_lobe_choice: needs_lobe_choice(world),
        caustic_casters: match lights.can_cast_caustics() {
            true => &world.guiding.caustic_casters,
            false => &[],
        },
        caustic_maps: world.guiding.caustic_maps.get().map_or(&[], Vec::as_slice),
        bounce: 0,
    };
    let PathScratch {
        paths,
        active: live,
        next_active: next,
        hits,
        escaped: behind,
        hit_batch: meetings,
        queues: wave,
    } = room;
    wave.begin(at_once.unwrap_or(rules.light_samples));
    paths.clear();
    let rays = batch.origins.iter().zip(batch.directions).enumerate().map(
        |(ray, (&position, &direction))| PathState {
            ray_index: ray,
            throughput: Vec3::ONE,
            direction,
            prev_context: LightSampleContext {
                position,
                normal: Vec3::ZERO,
            },
            bsdf_pdf: 0.0,
            specular_bounce: true,
            is_camera_ray: true,
            split_count: 0,
            light_sampling: rules.light_sampling,
            depth: 1,
            interior_list: InteriorList::default(),
            wavelength_channel: None,
            eta_scale: 1.0,
            ray_cone: batch.ray_cone,
        },
    );
    paths.extend(rays);
    hits.clear();
    hits.extend_from_slice(batch.hits);
    live.clear();
    live.extend(0..paths.len() as u32);
    while !live.is_empty() {
        control.check()?;
        let environment = lights.environment();
        if let Some((_, environment)) = environment {
            let missed = live.iter().zip(&*hits).filter(|(_, hit)| is_miss(hit));
            let directions = missed.map(|(&at, _)| paths[at as usize].direction);
            environment.lookup_many(directions, behind);
        }
        let mut missed = behind.iter();
        let mut met = 0;
        for i in 0..live.len() {
            let path = &paths[live[i] as usize];
            if is_miss(&hits[i]) {
                sky[path.ray_index] |= path.is_camera_ray;
                let known = environment.and_then(|(number, _)| Some((number, *missed.next()?)));
                walk.handle_escaped_ray(path, known, &mut radiance[path.ray_index]);
            } else {
                (live[met], hits[met]) = (live[i], hits[i]);
                met += 1;
            }
        }
        live.truncate(met);
        hits.truncate(met);
        meetings.begin_bounce(&walk, paths, live, hits);
        next.clear();
        for (number, hits) in hits.chunks(LANES).enumerate() {
            let first = number * LANES;
            meetings.load_lanes(&walk, number, paths, &live[first..][..hits.len()], hits);
            for (lane, hit) in hits.iter().enumerate() {
                let at = live[first + lane];
                let path = &mut paths[at as usize];
                let goes_on = if meetings.alpha_rejected[lane] {
                    // The same ray, from the other side.
                    let place = meetings.places.lane(lane);
                    wave.next_rays
                        .push(place.spawn_ray(path.direction, f32::INFINITY));
                    true
                } else if meetings.diffuse.is_active[lane] {
                    walk.shade_diffuse(path, meetings, (number, lane), hit, wave, radiance)
                } else if meetings.glossy.is_active[lane] {
                    walk.shade_glossy(path, meetings, lane, hit, wave, radiance)
                } else if meetings.specular.points.is_active[lane] {
                    walk.step_smooth(path, meetings, lane, wave, radiance)
                } else if meetings.rough_dielectric.points.is_active[lane] {
                    walk.step_frosted(path, meetings, lane, hit, wave, radiance)
                } else {
                    let meeting = meetings.view(&walk, number, lane, hit);
                    walk.shade(path, &meeting, wave, radiance)
                };
                if goes_on {
                    next.push(at);
                }
                for fork in wave.split_paths.drain(..) {
                    next.push(paths.len() as u32);
                    paths.push(fork);
                }
            }
        }
        std::mem::swap(live, next);
        let coherence = if walk.bounce == 0 {
            Coherence::Unknown
        } else {
            Coherence::Incoherent
        };
        for shadows in &mut wave.shadow_rays {
            shadows.trace(world, batch.scene, coherence, radiance);
        }
        wave.bsdf_shadow_rays
            .trace(world, batch.scene, Coherence::Incoherent, radiance);
        // All are written; what they were does not matter.
        hits.resize(wave.next_rays.len(), Hit::MISS);
        batch
            .scene
            .closest(&wave.next_rays, hits, Coherence::Incoherent);
        wave.next_rays.clear();
        walk.bounce += 1;
    }
    Ok(())
}

/// Whether the last segments of paths find no more than lights behind everything, or between surfaces in empty space.
fn last_segment_is_occlusion_only(world: &PreparedWorld, lights: &Lights) -> bool {
    let clear = |prepared: &PreparedMaterial| prepared.absorption.is_some();
    let dims = lights.has_finite() && world.geometry.materials.iter().any(clear);
    // Of an image or a clear sky, only what is seen is worth finding.
    let reads = lights.environment().is_some();
    !(world.geometry.has_transparency || lights.has_emissive_triangles() || dims || reads)
}

/// Whether surfaces that are met many at a time choose between two ways: clear glass, and glossy ones.
fn needs_lobe_choice(world: &PreparedWorld) -> bool {
    let choose = |prepared: &PreparedMaterial| {
        let metal = prepared.material.model.is_metal();
        prepared.glossy || prepared.frosted || (prepared.clear && !metal)
    };
    world.geometry.materials.iter().any(choose)
}

/// What the paths of a batch take, kept from batch to batch.
#[derive(Default)]
pub(crate) struct PathScratch {
    paths: Vec<PathState>,
    /// Which of them go on, which will then, and what these meet.
    active: Vec<u32>,
    next_active: Vec<u32>,
    hits: Vec<Hit>,
    /// What the image or the sky all around has behind those that meet nothing.
    escaped: Vec<(Vec3, f32)>,
    hit_batch: HitBatch,
    queues: WavefrontQueues,
}

/// What one turn of the loop asks for.
#[derive(Default)]
pub(super) struct WavefrontQueues {
    /// One batch for each light sampled at a point: neighbours run alike where it is the same light.
    pub shadow_rays: Vec<ShadowRayQueue>,
    /// In directions that surfaces chose.
    pub bsdf_shadow_rays: ShadowRayQueue,
    /// Of the paths that go on.
    pub next_rays: Vec<Ray>,
    /// Those that have begun where one went two ways.
    pub split_paths: Vec<PathState>,
}

impl WavefrontQueues {
    /// Asks for nothing yet, and for the light of so many lights at a point.
    fn begin(&mut self, lights: usize) {
        self.shadow_rays
            .resize_with(lights, ShadowRayQueue::default);
        self.shadow_rays.iter_mut().for_each(ShadowRayQueue::clear);
        self.bsdf_shadow_rays.clear();
        self.next_rays.clear();
        self.split_paths.clear();
    }
}
