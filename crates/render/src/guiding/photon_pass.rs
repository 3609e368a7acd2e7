//! The photon pass: photons from lights, via caustic casters, to diffuse receivers.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::ops::Range;

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, Hit, Ray};
use rayon::prelude::*;

use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::shading_point::ShadingPoint;
use crate::bsdf::{BsdfModel, BsdfSample};
use crate::guiding::caustic_casters::{CausticCaster, MAX_CANDIDATES};
use crate::guiding::caustic_map::PhotonDeposit;
use crate::integrator::camera_ray_batch::is_miss;
use crate::interaction::LightSampleContext;
use crate::interaction::SurfaceInteraction;
use crate::interaction::ray_cone::RayCone;
use crate::light::light_sampling::{LightSampleContexts, LightSampling};
use crate::light::lights::Lights;
use crate::light::samples::ONE_MINUS_SHADOW_EPSILON;
use crate::media::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::prepare::geometry::Geometry;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;

/// Maximum number of photons emitted to each candidate to measure the light that it casts. Lab note: "2,048 photons",
/// 11-26.
const MAX_PHOTONS_PER_CANDIDATE: u32 = PHOTON_BATCH;
/// Maximum number of photons emitted to all candidates together. Lab note: "for each of 32 candidates", 11-26.
const MAX_CANDIDATE_PHOTONS: u32 = 1 << 16;
/// Number of photons traced together. Not tuned; results do not depend on this number.
pub(crate) const PHOTON_BATCH: u32 = 1 << 11;
/// Maximum number of surfaces that a photon meets. Not tuned.
pub(crate) const MAX_BOUNCES: u32 = 8;

#[derive(Clone, Copy)]
struct Photon {
    sampler: Sampler,
    direction: Vec3,
    power: f64,
    interior_list: InteriorList,
    /// Index of the candidate that the photon left last, and the exit point.
    last_exit: Option<(usize, DVec3)>,
}

/// World in which photons are traced, and the candidates for caustic casters.
pub(crate) struct PhotonPass<'a> {
    pub geometry: &'a Geometry,
    pub lights: &'a Lights,
    candidates: &'a [CausticCaster],
    /// For each instance that is a candidate: its index among the candidates.
    candidate_of: HashMap<u32, usize>,
}

impl<'a> PhotonPass<'a> {
    pub fn new(geometry: &'a Geometry, lights: &'a Lights, candidates: &'a [CausticCaster]) -> Self {
        let by_instance = candidates.iter().enumerate().map(|(index, caster)| (caster.instance, index));
        Self { geometry, lights, candidates, candidate_of: by_instance.collect() }
    }

    /// True if the object at a hit is a candidate.
    pub fn is_candidate(&self, hit: &Hit) -> bool {
        self.candidate_of.contains_key(&hit.instance)
    }

    /// Fraction of all light that each of the largest candidates casts, estimated from photons emitted to it.
    pub fn thrown_fractions(&self) -> Vec<f64> {
        let phi = self.lights.phi();
        let count = self.candidates.len().min(MAX_CANDIDATES);
        let photons = (MAX_CANDIDATE_PHOTONS / count as u32).min(MAX_PHOTONS_PER_CANDIDATE);
        let thrown = |index: usize| {
            let deposits = self.trace_photons(index, 0..photons);
            let own = deposits.iter().filter(|(last, _)| *last == index);
            let fluence = own.map(|(_, deposit)| deposit.power).sum::<f64>() / f64::from(photons);
            // Light through the bounding sphere: the fluence times the sphere's cross-section, relative to the flux of
            // all lights.
            let fraction = fluence * self.candidates[index].radius.powi(2) / phi;
            if fraction.is_finite() { fraction } else { 0.0 }
        };
        (0..count).into_par_iter().map(thrown).collect()
    }

    /// Emits photons to a candidate; returns their deposits, each with the index of the candidate that the photon left
    /// last.
    pub fn trace_photons(&self, candidate: usize, numbers: Range<u32>) -> Vec<(usize, PhotonDeposit)> {
        let sampler = Sampler::for_pixel(0, candidate as u32, [0, 0]);
        let caster = &self.candidates[candidate];
        let emitted = numbers.filter_map(|i| self.emit_photon(caster, sampler.with_sample(i)));
        let (mut photons, mut rays): (Vec<_>, Vec<_>) = emitted.unzip();
        let (mut hits, mut deposits) = (vec![], vec![]);
        for bounce in 0..MAX_BOUNCES {
            hits.clear();
            hits.resize(rays.len(), Hit::MISS);
            self.geometry.two_level().closest(&rays, &mut hits, Coherence::Incoherent);
            rays.clear();
            let mut hits = hits.iter();
            photons.retain_mut(|photon| {
                let hit = hits.next().filter(|hit| !is_miss(hit));
                let ray = hit.and_then(|hit| photon.bounce(self, hit, bounce, &mut deposits));
                rays.extend(ray);
                ray.is_some()
            });
        }
        deposits
    }

    /// Emits a photon from a light to a point in the bounding sphere of a caster.
    fn emit_photon(&self, caster: &CausticCaster, sampler: Sampler) -> Option<(Photon, Ray)> {
        let [height, turn] = sampler.get_2d(Dimension::PixelFilter).map(f64::from);
        let [radius, choice] = sampler.get_2d(Dimension::LobeAndLight(0));
        let light_random = sampler.get_2d(Dimension::Light(0, 0));
        let z = 2.0 * height - 1.0;
        let (sin, cos) = (TAU * turn).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let within = DVec3::new(across * cos, across * sin, z) * f64::from(radius).cbrt();
        let context = LightSampleContext { position: caster.center + caster.radius * within, normal: Vec3::ZERO };
        let contexts = LightSampleContexts::from(&context);
        let sampling = LightSampling::Importance;
        let sample = self.lights.sample(&contexts, self.geometry, sampling, choice, &light_random.into())?;
        // Only lights with a position and an extent emit photons: the BSDF samples that photons guide never
        // hit delta lights, and can reach infinite lights from any caster.
        let p_light = sample.p_light.filter(|_| !sample.is_delta)?;
        let photon = Photon {
            sampler,
            direction: -sample.direction,
            power: f64::from(sample.radiance.element_sum()) / f64::from(sample.pdf),
            interior_list: InteriorList::default(),
            last_exit: None,
        };
        let epsilon = f64::from(ONE_MINUS_SHADOW_EPSILON);
        let origin = context.position + (p_light - context.position) * epsilon;
        let ray =
            Ray { origin: origin.as_vec3().to_array(), direction: photon.direction.to_array(), t_max: f32::INFINITY };
        Some((photon, ray))
    }
}

impl Photon {
    /// Scatters the photon at a candidate, and returns its next ray. At any other surface, the photon ends, and is
    /// deposited if a candidate has scattered it.
    fn bounce(
        &mut self,
        pass: &PhotonPass,
        hit: &Hit,
        bounce: u32,
        deposits: &mut Vec<(usize, PhotonDeposit)>,
    ) -> Option<Ray> {
        let geometry = pass.geometry;
        let interaction = SurfaceInteraction::new(geometry, self.direction, hit, &RayCone::default());
        let Some(&caster) = pass.candidate_of.get(&hit.instance) else {
            deposits.extend(self.last_exit.map(|(caster, exit_point)| {
                let deposit = PhotonDeposit { exit_point, landing_point: interaction.position, power: self.power };
                (caster, deposit)
            }));
            return None;
        };
        let [choice, _] = self.sampler.get_2d(Dimension::LobeAndLight(bounce + 1));
        let [x, y] = self.sampler.get_2d(Dimension::Bsdf(bounce));
        let media = &mut self.interior_list;
        let (sample, ray) = scatter(geometry, (hit, &interaction), self.direction, media, [choice, x, y])?;
        let Some(sample) = sample else {
            return Some(ray);
        };
        self.power *= f64::from(sample.weight.element_sum() / 3.0);
        self.direction = sample.wi;
        self.last_exit = Some((caster, interaction.position));
        let is_alive = self.power > 0.0 && self.power.is_finite();
        is_alive.then_some(ray)
    }
}

/// BSDF sample that scatters a photon at a hit, and the continued ray. The sample is `None` at a false intersection of
/// media; the result is `None` if the photon is absorbed.
pub(crate) fn scatter(
    geometry: &Geometry,
    (hit, interaction): (&Hit, &SurfaceInteraction),
    direction: Vec3,
    media: &mut InteriorList,
    random: [f32; 3],
) -> Option<(Option<BsdfSample>, Ray)> {
    let transition = InterfaceTransition::at_hit(geometry, *media, hit, interaction.is_front, None);
    if transition.is_false_intersection {
        *media = transition.far_side;
        return Some((None, interaction.ray_beyond(direction, f32::INFINITY)));
    }
    let material_hit = MaterialHit::new(geometry, hit, interaction, direction).seen_by(None, transition.outside_ior);
    let point = ShadingPoint::new(interaction, &material_hit);
    let sample = point.bsdf.sample(&point.frame, random)?;
    *media = transition.medium_towards(point.frame.geometric, sample.wi);
    Some((Some(sample), interaction.spawn_ray(sample.wi, f32::INFINITY)))
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Glass, Light, Material, MaterialModel, Metal, Object, World};

    use super::*;
    use crate::control::Control;
    use crate::guiding::LearnedGuiding;
    use crate::path_guiding::PathGuiding;
    use crate::prepare::world::PreparedWorld;
    use crate::settings::{Integrator, Settings};

    const MIDDLE: DVec3 = DVec3::new(0.0, 0.0, 0.6);
    const LAMP: DVec3 = DVec3::new(1.0, 0.5, 3.0);

    /// A ball on a floor under a lamp, with an optional roof over both.
    fn world(reflectance: MaterialModel, roof: bool) -> PreparedWorld {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([12.0, 12.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(0.5, 5).unwrap());
        let matte = world.add_material(Material::default()).unwrap();
        let clear = Material { model: reflectance, ..Material::default() };
        let clear = world.add_material(clear).unwrap();
        let mut objects = vec![(floor, matte, DVec3::ZERO), (ball, clear, MIDDLE)];
        if roof {
            objects.push((floor, matte, 2.0 * DVec3::Z));
        }
        for (mesh, material, at) in objects {
            let place = DAffine3::from_translation(at);
            let object = Object::new("", mesh, vec![material], place);
            world.add_object(object).unwrap();
        }
        world.lights.push(Light::Rectangle {
            position: LAMP.to_array(),
            u: [0.1, 0.0, 0.0],
            v: [0.0, -0.1, 0.0],
            radiance: [40.0; 3],
            two_sided: false,
        });
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    fn gold() -> MaterialModel {
        MaterialModel::Metal(Metal::named("gold").unwrap())
    }

    fn settings(integrator: Integrator, max_depth: u32) -> Settings {
        Settings { integrator, max_depth: Some(max_depth), ..Settings::default() }
    }

    /// Target of the ball's caustic map for a world point: centre and radius.
    fn thrown_on(world: &PreparedWorld, at: DVec3) -> (DVec3, f64) {
        let guiding = LearnedGuiding::default();
        guiding.learn(&world.geometry, &world.lighting().lights, &settings(Integrator::Path, 6));
        let caustics = guiding.caustics(&world.geometry);
        let (thrown, CausticCaster { center, radius, .. }) = (&caustics.maps[0], caustics.casters[0]);
        let [exit, _] = thrown.lookup(((at - world.geometry.origin - center) / radius).as_vec3());
        let left = Vec3::from(exit.center).as_dvec3() * radius;
        (center + world.geometry.origin + left, f64::from(exit.radius) * radius)
    }

    #[test]
    fn photons_leave_a_mirror_ball_where_angles_of_incidence_and_reflection_are_equal() {
        let world = world(gold(), false);
        for (x, y) in [(1.0, 0.5), (0.9, -0.3), (0.4, 0.9), (2.0, 1.5), (-0.3, 0.8)] {
            let at = DVec3::new(x, y, 0.0);
            let mut normal = DVec3::Z;
            for _ in 0..100 {
                let there = MIDDLE + 0.5 * normal;
                let half = (LAMP - there).normalize() + (at - there).normalize();
                // Only half of each step is taken, because full steps would oscillate.
                normal = (normal + 0.5 * half.normalize()).normalize();
            }
            let (left, radius) = thrown_on(&world, at);
            let (distance, there) = (left.distance(at), MIDDLE + 0.5 * normal);
            let off = ((left - at) / distance).distance((there - at).normalize());
            assert!(0.0 < radius && radius < 0.25 * distance, "{at} {radius}");
            assert!(off < radius / distance, "{at} {off} {radius}");
        }
    }

    #[test]
    fn glass_balls_focus_photons_behind_themselves() {
        let world = world(MaterialModel::Glass(Glass::default()), false);
        let away = (MIDDLE - LAMP) / (LAMP.z - MIDDLE.z);
        let focus = MIDDLE + away * MIDDLE.z;
        let (left, radius) = thrown_on(&world, focus);
        assert!(radius > 0.0 && (left - focus).normalize().dot(-away.normalize()) > 0.8, "{left} {radius}");
    }

    #[test]
    fn unlit_objects_cast_no_photons() {
        let world = world(gold(), true);
        assert_eq!(thrown_on(&world, DVec3::new(1.0, 0.5, 0.0)).1, 0.0);
    }

    #[test]
    fn guiding_is_learned_only_for_path_tracing_with_at_least_three_segments() {
        let (world, guiding) = (world(gold(), false), LearnedGuiding::default());
        for (integrator, depth) in [(Integrator::Direct, 6), (Integrator::Flat, 6), (Integrator::Path, 2)] {
            guiding.learn(&world.geometry, &world.lighting().lights, &settings(integrator, depth));
            assert!(guiding.caustics.get().is_none());
        }
        guiding.learn(&world.geometry, &world.lighting().lights, &settings(Integrator::Path, 3));
        assert_eq!(guiding.caustics(&world.geometry).maps.len(), 1);
    }
}
