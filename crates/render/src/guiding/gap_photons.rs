//! Photons that search for gaps: they start at lit surfaces and are scattered by all surfaces.

use std::f64::consts::TAU;
use std::iter::repeat_n;

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, Hit, Ray};
use rayon::prelude::*;

use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::gaps::{PhotonSegment, find_gaps, systematic_counts};
use crate::guiding::photon_pass::scatter;
use crate::integrator::camera_ray_batch::is_miss;
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::ray_cone::RayCone;
use crate::interaction::{LightSampleContext, SurfaceInteraction};
use crate::light::light_sampling::LightSampling;
use crate::light::lights::Lights;
use crate::light::samples::ONE_MINUS_SHADOW_EPSILON;
use crate::media::nested_dielectrics::InteriorList;
use crate::path_guiding::MIN_GUIDED_SEGMENTS;
use crate::prepare::geometry::Geometry;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::settings::{Integrator, Settings};

/// Number of samples of an image before the first sample that is guided to gaps, because finding gaps takes 0.1 to 0.6
/// s. Lab note: "from sample 2^22 / (width x height) of a pixel on", 11-27.
const SAMPLES_BEFORE: u64 = 1 << 22;
/// Number of photons in each of two halves: one half finds gaps, the other half confirms them. Lab note: "2 x 2^17
/// photons", 11-27; 2^16 and 2^18 were rejected.
const PHOTONS: u32 = 1 << 17;
/// Number of lines through the world that search for lit surfaces, for each half of the photons. Not tuned.
const LINES: u32 = 1 << 14;
/// Number of photons traced together. This value is not tuned, because results do not depend on it.
const BATCH: u32 = 1 << 11;
/// Maximum number of surfaces that a line crosses. Not tuned.
const MAX_CROSSINGS: u32 = 16;
/// Maximum number of surfaces that a photon meets. Not tuned.
const MAX_BOUNCES: u32 = 24;

/// A lit point, the direction of the ray that found the point, and the point's irradiance.
#[derive(Clone, Copy)]
struct LitHit {
    hit: Hit,
    direction: Vec3,
    irradiance: f64,
}

#[derive(Clone, Copy)]
struct GapPhoton {
    sampler: Sampler,
    direction: Vec3,
    origin: Vec3,
    leaves_diffuse: bool,
    interior_list: InteriorList,
}

/// Index of a pixel's first sample that is guided to gaps. After this number of samples, the image has already taken
/// much longer than the search for gaps takes. The index does not depend on the number of samples or on the region.
/// `None` for images without guided samples.
pub(crate) fn first_gap_sample(settings: &Settings, [width, height]: [u32; 2]) -> Option<u32> {
    let is_long = settings.max_depth.is_none_or(|depth| depth > MIN_GUIDED_SEGMENTS);
    let before = SAMPLES_BEFORE.div_ceil(u64::from(width) * u64::from(height));
    (settings.integrator == Integrator::Path && is_long).then_some(before as u32)
}

/// Finds the gaps of a world through which light passes; empty if few photons travel from surface to surface.
pub(crate) fn trace_gaps(geometry: &Geometry, lights: &Lights) -> Vec<CausticCaster> {
    let halves = [0, 1].map(|half| {
        let batches = (0..LINES / BATCH).into_par_iter().map(|batch| lit_hits(geometry, lights, half, batch));
        let lit = batches.collect::<Vec<_>>().concat();
        let irradiances: Vec<_> = lit.iter().map(|lit| lit.irradiance).collect();
        // One start per photon; each lit point is chosen in proportion to its light.
        let counts = lit.iter().zip(systematic_counts(&irradiances, PHOTONS));
        let starts: Vec<_> = counts.flat_map(|(lit, count)| repeat_n(*lit, count as usize)).collect();
        let batches = starts.par_chunks(BATCH as usize).enumerate();
        let segments = batches.map(|(batch, starts)| trace_photons(geometry, half, batch as u32, starts));
        segments.collect::<Vec<_>>().concat()
    });
    find_gaps(halves.each_ref().map(Vec::as_slice), geometry.bounds())
}

/// Points at which lines cross surfaces and which light samples reach. The lines are uniform in space, so the points
/// are uniform in area.
fn lit_hits(geometry: &Geometry, lights: &Lights, half: u32, batch: u32) -> Vec<LitHit> {
    let sampler = |line| Sampler::for_pixel(0, 0, [half, 1]).with_sample(batch * BATCH + line);
    let mut rays: Vec<_> = (0..BATCH).map(|line| uniform_line(&sampler(line), geometry.radius)).collect();
    let mut lines: Vec<_> = (0..BATCH).collect();
    let (mut hits, mut lit, mut queue) = (vec![], vec![], ShadowRayQueue::default());
    for crossing in 0..MAX_CROSSINGS {
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        geometry.two_level().closest(&rays, &mut hits, Coherence::Incoherent);
        let (mut beyond, mut going) = (vec![], vec![]);
        for ((ray, hit), &line) in rays.iter().zip(&hits).zip(&lines).filter(|((_, hit), _)| !is_miss(hit)) {
            let direction = Vec3::from(ray.direction);
            let interaction = SurfaceInteraction::new(geometry, direction, hit, &RayCone::default());
            let context = LightSampleContext { position: interaction.position, normal: interaction.side_normal };
            let [choice, _] = sampler(line).get_2d(Dimension::LobeAndLight(crossing));
            let random = sampler(line).get_2d(Dimension::Light(crossing, 0));
            let by = (&context).into();
            if let Some(sample) = lights.sample(&by, geometry, LightSampling::Importance, choice, &random.into()) {
                let cosine = sample.direction.dot(interaction.side_normal).max(0.0);
                let (offset, t_max) = match sample.p_light {
                    Some(at) => ((at - interaction.position).as_vec3(), ONE_MINUS_SHADOW_EPSILON),
                    None => (sample.direction, f32::INFINITY),
                };
                queue.push(interaction.spawn_ray(offset, t_max), lit.len(), sample.radiance * (cosine / sample.pdf));
                lit.push(LitHit { hit: *hit, direction, irradiance: 0.0 });
            }
            beyond.push(interaction.ray_beyond(direction, f32::INFINITY));
            going.push(line);
        }
        (rays, lines) = (beyond, going);
    }
    let mut light = vec![Vec3::ZERO; lit.len()];
    queue.trace(geometry, geometry.two_level(), Coherence::Incoherent, None, None, &mut light);
    for (lit, light) in lit.iter_mut().zip(light) {
        lit.irradiance = f64::from(light.element_sum());
    }
    lit.retain(|lit| lit.irradiance > 0.0 && lit.irradiance.is_finite());
    lit
}

/// A ray that enters the world's bounding sphere along a line; the line is uniform among all lines through the sphere.
fn uniform_line(sampler: &Sampler, radius: f64) -> Ray {
    let [height, turn] = sampler.get_2d(Dimension::PixelFilter).map(f64::from);
    let [x, y] = sampler.get_2d(Dimension::Lens).map(f64::from);
    let (z, (sin, cos)) = (2.0 * height - 1.0, (TAU * turn).sin_cos());
    let across = (1.0 - z * z).sqrt();
    let direction = DVec3::new(across * cos, across * sin, z);
    let (right, up) = direction.any_orthonormal_pair();
    let (sin, cos) = (TAU * y).sin_cos();
    let origin = radius * (x.sqrt() * (right * cos + up * sin) - 1.01 * direction);
    Ray { origin: origin.as_vec3().to_array(), direction: direction.as_vec3().to_array(), t_max: f32::INFINITY }
}

/// Traces photons from lit points; returns the segments of their paths.
fn trace_photons(geometry: &Geometry, half: u32, batch: u32, starts: &[LitHit]) -> Vec<PhotonSegment> {
    let sampler = Sampler::for_pixel(0, 0, [half, 2]);
    let begin = |(number, lit): (usize, &LitHit)| GapPhoton {
        sampler: sampler.with_sample(batch * BATCH + number as u32),
        direction: lit.direction,
        origin: Vec3::ZERO,
        leaves_diffuse: false,
        interior_list: InteriorList::default(),
    };
    let mut photons: Vec<_> = starts.iter().enumerate().map(begin).collect();
    let mut hits: Vec<_> = starts.iter().map(|lit| lit.hit).collect();
    let (mut rays, mut segments) = (vec![], vec![]);
    for bounce in 0..MAX_BOUNCES {
        rays.clear();
        let mut at = hits.iter();
        photons.retain_mut(|photon| {
            let hit = at.next().filter(|hit| !is_miss(hit));
            let ray = hit.and_then(|hit| photon.bounce(geometry, hit, bounce, &mut segments));
            rays.extend(ray);
            ray.is_some()
        });
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        geometry.two_level().closest(&rays, &mut hits, Coherence::Incoherent);
    }
    segments
}

impl GapPhoton {
    /// Records the segment to a hit and scatters the photon there.
    fn bounce(&mut self, geometry: &Geometry, hit: &Hit, bounce: u32, found: &mut Vec<PhotonSegment>) -> Option<Ray> {
        let interaction = SurfaceInteraction::new(geometry, self.direction, hit, &RayCone::default());
        let (end, normal) = (interaction.position.as_vec3(), interaction.side_normal);
        let is_diffuse = geometry.material(hit).is_diffuse();
        if is_diffuse {
            found.push(PhotonSegment { start: self.origin, end, normal, is_diffuse: self.leaves_diffuse });
        }
        let [choice, roulette] = self.sampler.get_2d(Dimension::LobeAndLight(bounce));
        let [x, y] = self.sampler.get_2d(Dimension::Bsdf(bounce));
        let media = &mut self.interior_list;
        let (sample, ray) = scatter(geometry, (hit, &interaction), self.direction, media, [choice, x, y])?;
        if let Some(sample) = sample {
            (self.direction, self.origin, self.leaves_diffuse) = (sample.wi, end, is_diffuse);
            return (roulette < sample.weight.element_sum() / 3.0).then_some(ray);
        }
        Some(ray)
    }
}
