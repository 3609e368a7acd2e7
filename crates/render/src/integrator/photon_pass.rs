//! Light on its way from lamps through mirrors and lenses to where it falls.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, Hit, Ray};
use rayon::prelude::*;

use crate::bsdf::BsdfModel;
use crate::bsdf::ShadingPoint;
use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::caustic_map::{CausticMap, PhotonDeposit};
use crate::integrator::batch::hits::MIN_CAUSTIC_SEGMENTS;
use crate::integrator::is_miss;
use crate::integrator::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::interaction::LightSampleContext;
use crate::interaction::SurfaceInteraction;
use crate::light::light_sampling::{LightSampleContexts, LightSampling};
use crate::light::lights::Lights;
use crate::light::samples::ONE_MINUS_SHADOW_EPSILON;
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::settings::{Integrator, Settings};

/// How many are sent to each object that throws light, and how many at a time.
const PHOTONS_PER_CASTER: u32 = 1 << 14;
const PHOTON_BATCH: u32 = 1 << 11;
/// Surfaces that one meets at most.
const MAX_BOUNCES: u32 = 8;

/// Light on its way.
#[derive(Clone, Copy)]
struct Photon {
    sampler: Sampler,
    direction: Vec3,
    power: f64,
    interior_list: InteriorList,
    /// Which object it has left last, and where.
    last_exit: Option<(usize, DVec3)>,
}

/// Finds what guides the paths of pictures, once for a world, where any are long enough to be guided.
pub(crate) fn build_caustic_maps(world: &PreparedWorld, settings: &Settings) {
    let lights = settings.integrator.effective_lights(world);
    let long = settings
        .max_depth
        .is_none_or(|most| most > MIN_CAUSTIC_SEGMENTS);
    let guided = settings.integrator == Integrator::Path && long && lights.can_cast_caustics();
    if guided
        && !world.guiding.caustic_casters.is_empty()
        && world.guiding.caustic_maps.get().is_none()
    {
        // Not while others wait for it: a thread that does so takes up work of other pictures.
        let _ = world.guiding.caustic_maps.set(build_maps(world, lights));
    }
}

/// What each of a world's mirrors throws. It guides paths alone: what is left out of it makes noise and no error.
pub(crate) fn build_maps(world: &PreparedWorld, lights: &Lights) -> Vec<CausticMap> {
    let mirrors = &world.guiding.caustic_casters;
    let batches: Vec<_> = (0..mirrors.len())
        .flat_map(|mirror| (0..PHOTONS_PER_CASTER / PHOTON_BATCH).map(move |batch| (mirror, batch)))
        .collect();
    let fallen: Vec<_> = batches
        .into_par_iter()
        .map(|(mirror, batch)| {
            let sampler = Sampler::for_pixel(0, mirror as u32, [0, 0]);
            let samplers =
                (batch * PHOTON_BATCH..(batch + 1) * PHOTON_BATCH).map(|i| sampler.with_sample(i));
            trace_photons(world, lights, &mirrors[mirror], samplers)
        })
        .collect();
    let thrown = |(number, mirror)| {
        let all = fallen.iter().flatten();
        let by_it = all.filter(|(by, _)| *by == number);
        CausticMap::new(mirror, by_it.map(|(_, fallen)| *fallen))
    };
    mirrors.iter().enumerate().map(thrown).collect()
}

/// Sends photons to a mirror; those that have fallen on something else, and which mirror they left last.
fn trace_photons(
    world: &PreparedWorld,
    lights: &Lights,
    mirror: &CausticCaster,
    samplers: impl Iterator<Item = Sampler>,
) -> Vec<(usize, PhotonDeposit)> {
    let sent = samplers.filter_map(|sampler| emit_photon(world, lights, mirror, sampler));
    let (mut photons, mut rays): (Vec<_>, Vec<_>) = sent.unzip();
    let (mut hits, mut fallen) = (vec![], vec![]);
    for turn in 0..MAX_BOUNCES {
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        world
            .geometry
            .scene
            .closest(&rays, &mut hits, Coherence::Incoherent);
        rays.clear();
        let mut hits = hits.iter();
        photons.retain_mut(|photon| {
            let hit = hits.next().filter(|hit| !is_miss(hit));
            let ray = hit.and_then(|hit| photon.bounce(world, hit, turn, &mut fallen));
            rays.extend(ray);
            ray.is_some()
        });
    }
    fallen
}

/// From a light to a place in the sphere around a mirror.
fn emit_photon(
    world: &PreparedWorld,
    lights: &Lights,
    mirror: &CausticCaster,
    sampler: Sampler,
) -> Option<(Photon, Ray)> {
    let [height, turn] = sampler.get_2d(Dimension::PixelFilter).map(f64::from);
    let [radius, which] = sampler.get_2d(Dimension::LobeAndLight(0));
    let on_light = sampler.get_2d(Dimension::Light(0, 0));
    let z = 2.0 * height - 1.0;
    let (sin, cos) = (TAU * turn).sin_cos();
    let across = (1.0 - z * z).sqrt();
    let within = DVec3::new(across * cos, across * sin, z) * f64::from(radius).cbrt();
    let from = LightSampleContext {
        position: mirror.center + mirror.radius * within,
        normal: Vec3::ZERO,
    };
    let by = LightSampleContexts::from(&from);
    let sample = lights.sample(
        &by,
        &world.geometry,
        LightSampling::Importance,
        which,
        &on_light.into(),
    )?;
    // Those without a size are not found through mirrors, those all around shine on all of them.
    let end = sample.p_light.filter(|_| !sample.is_delta)?;
    let photon = Photon {
        sampler,
        direction: -sample.direction,
        power: f64::from(sample.radiance.element_sum()) / f64::from(sample.pdf),
        interior_list: InteriorList::default(),
        last_exit: None,
    };
    let origin = from.position + (end - from.position) * f64::from(ONE_MINUS_SHADOW_EPSILON);
    let ray = Ray {
        origin: origin.as_vec3().to_array(),
        direction: photon.direction.to_array(),
        t_max: f32::INFINITY,
    };
    Some((photon, ray))
}

impl Photon {
    /// Goes on from a mirror; elsewhere it has fallen, if it has been at one.
    fn bounce(
        &mut self,
        world: &PreparedWorld,
        hit: &Hit,
        turn: u32,
        fallen: &mut Vec<(usize, PhotonDeposit)>,
    ) -> Option<Ray> {
        let place = SurfaceInteraction::new(&world.geometry, self.direction, hit, 0.0);
        let mut mirrors = world.guiding.caustic_casters.iter();
        let Some(mirror) = mirrors.position(|mirror| mirror.instance == hit.instance) else {
            fallen.extend(self.last_exit.map(|(mirror, left)| {
                let (at, power) = (place.position, self.power);
                (
                    mirror,
                    PhotonDeposit {
                        exit_point: left,
                        landing_point: at,
                        power,
                    },
                )
            }));
            return None;
        };
        let skin =
            InterfaceTransition::at_hit(world, self.interior_list, hit, place.is_front, None);
        if skin.is_false_intersection {
            self.interior_list = skin.inside;
            return Some(place.spawn_ray(self.direction, f32::INFINITY));
        }
        let surface = ShadingPoint::new(
            &world.geometry,
            &place,
            self.direction,
            hit,
            None,
            skin.outside_ior,
        );
        let [choice, _] = self.sampler.get_2d(Dimension::LobeAndLight(turn + 1));
        let [x, y] = self.sampler.get_2d(Dimension::Bsdf(turn));
        let sample = surface.bsdf.sample(&surface.frame, [choice, x, y])?;
        self.power *= f64::from(sample.weight.element_sum() / 3.0);
        self.interior_list = skin.medium_towards(surface.frame.geometric, sample.wi);
        self.direction = sample.wi;
        self.last_exit = Some((mirror, place.position));
        let shines = self.power > 0.0 && self.power.is_finite();
        shines.then(|| place.spawn_ray(self.direction, f32::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Glass, Light, Material, MaterialModel, Metal, Object, World};

    use super::*;
    use crate::control::Control;

    const MIDDLE: DVec3 = DVec3::new(0.0, 0.0, 0.6);
    const LAMP: DVec3 = DVec3::new(1.0, 0.5, 3.0);

    /// A ball over a floor under a lamp, and over both a roof if there is one.
    fn world(reflectance: MaterialModel, roof: bool) -> PreparedWorld {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([12.0, 12.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(0.5, 5).unwrap());
        let matte = world.add_material(Material::default()).unwrap();
        let clear = Material {
            model: reflectance,
            ..Material::default()
        };
        let clear = world.add_material(clear).unwrap();
        let mut things = vec![(floor, matte, DVec3::ZERO), (ball, clear, MIDDLE)];
        if roof {
            things.push((floor, matte, 2.0 * DVec3::Z));
        }
        for (mesh, material, at) in things {
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
        Settings {
            integrator,
            max_depth: Some(max_depth),
            ..Settings::default()
        }
    }

    /// What the ball throws on a place of the world: the middle of where it left, and how far from there.
    fn thrown_on(world: &PreparedWorld, at: DVec3) -> (DVec3, f64) {
        build_caustic_maps(world, &settings(Integrator::Path, 6));
        let thrown = &world.guiding.caustic_maps.get().unwrap()[0];
        let CausticCaster { center, radius, .. } = world.guiding.caustic_casters[0];
        let exit = thrown.lookup(((at - world.geometry.origin - center) / radius).as_vec3());
        let left = Vec3::from(exit.center).as_dvec3() * radius;
        (
            center + world.geometry.origin + left,
            f64::from(exit.radius) * radius,
        )
    }

    #[test]
    fn a_ball_reflects_a_lamp_where_angles_are_equal() {
        let world = world(gold(), false);
        for (x, y) in [(1.0, 0.5), (0.9, -0.3), (0.4, 0.9), (2.0, 1.5), (-0.3, 0.8)] {
            let at = DVec3::new(x, y, 0.0);
            let mut normal = DVec3::Z;
            for _ in 0..100 {
                let there = MIDDLE + 0.5 * normal;
                let half = (LAMP - there).normalize() + (at - there).normalize();
                // Half the way: the whole of it goes to and fro.
                normal = (normal + 0.5 * half.normalize()).normalize();
            }
            let (left, radius) = thrown_on(&world, at);
            let off = left.distance(MIDDLE + 0.5 * normal);
            assert!(0.0 < radius && radius < 0.25, "{at} {radius}");
            assert!(off < radius, "{at} {off} {radius}");
        }
    }

    #[test]
    fn a_ball_of_glass_throws_light_behind_it() {
        let world = world(MaterialModel::Glass(Glass::default()), false);
        let away = (MIDDLE - LAMP) / (LAMP.z - MIDDLE.z);
        let focus = MIDDLE + away * MIDDLE.z;
        let (left, radius) = thrown_on(&world, focus);
        assert!(
            radius > 0.0 && (left - MIDDLE).dot(away) > 0.2,
            "{left} {radius}"
        );
    }

    #[test]
    fn what_no_light_reaches_throws_none() {
        let world = world(gold(), true);
        assert_eq!(thrown_on(&world, DVec3::new(1.0, 0.5, 0.0)).1, 0.0);
    }

    #[test]
    fn only_long_paths_are_guided() {
        let world = world(gold(), false);
        for (integrator, depth) in [
            (Integrator::Direct, 6),
            (Integrator::Flat, 6),
            (Integrator::Path, 2),
        ] {
            build_caustic_maps(&world, &settings(integrator, depth));
            assert!(world.guiding.caustic_maps.get().is_none());
        }
        build_caustic_maps(&world, &settings(Integrator::Path, 3));
        assert_eq!(world.guiding.caustic_maps.get().map(Vec::len), Some(1));
    }
}
