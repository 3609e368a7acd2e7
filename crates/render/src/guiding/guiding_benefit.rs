//! Benefit of guiding: whether samples guided to a caster reduce the noise of the surfaces around it.
//!
//! Guided samples find the light that a caster focuses, but fewer samples remain for all other light. Under a bright
//! sky, which cosine-weighted samples find evenly, guiding adds more noise than it removes. Therefore, directions are
//! sampled with guiding at the surfaces around a caster and followed to the light. From the same samples, the second
//! moments of the light are estimated for sampling with guiding and without. The means are equal, so the difference of
//! the moments is the difference of the variances. The result only affects the noise of images.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, Hit, Ray, dispatch_simd};

use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::caustics::Caustics;
use crate::guiding::photon_pass::{MAX_BOUNCES, PhotonPass, scatter};
use crate::guiding::sample_cones::SampleGuided;
use crate::integrator::camera_ray_batch::is_miss;
use crate::interaction::batch::SurfaceInteractions;
use crate::interaction::ray_cone::RayCone;
use crate::interaction::{LightSampleContext, SurfaceInteraction};
use crate::light::light_sampling::LightSampling;
use crate::light::lights::LightView;
use crate::lobes::cone_mixture::ConeMixture;
use crate::lobes::shading_frame::cosine_hemisphere_pdf;
use crate::media::nested_dielectrics::InteriorList;
use crate::prepare::geometry::Geometry;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::soa::{LANES, Vec3xN, get_lane, set_triangle};

/// Number of rays from a caster that find the surfaces around it. Lab note for all constants of this file: "benefit of
/// guiding under a sky", 12-01.
const RECEIVER_RAYS: u32 = 1024;
/// Number of directions that are sampled at each point of a surface.
const DIRECTIONS: u32 = 8;
/// Distance from the caster, in radii, up to which all parts of a surface have the same weight.
const MAX_DISTANCE: f64 = 8.0;
/// Minimum cosine at a surface of the ray that found the surface, which limits the weights.
const MIN_COSINE: f64 = 0.1;

/// Hit of a ray that left a caster in this direction.
struct Receiver {
    direction: Vec3,
    hit: Hit,
}

/// Ray in a sampled direction.
struct Probe {
    ray: Ray,
    direction: Vec3,
    sampler: Sampler,
    /// Area of the surface that the probe stands for.
    area: f64,
    /// Density with which guiding samples the direction.
    density: f32,
    /// Cosine-weighted density of the direction, divided by `density`.
    ratio: f64,
    interior_list: InteriorList,
    throughput: Vec3,
    /// True if a caster has scattered the ray.
    is_scattered: bool,
    light: Vec3,
}

/// True if guiding to the only caster of `caustics` reduces the variance of the light on the surfaces around it.
pub(crate) fn reduces_noise(pass: &PhotonPass, caustics: &Caustics) -> bool {
    let mut probes = sample_probes(pass.geometry, caustics, &find_receivers(pass, caustics));
    follow_probes(pass, &mut probes);
    let (mut guided, mut plain) = (0.0, 0.0);
    for probe in &probes {
        let light = f64::from(probe.light.element_sum());
        let moment = probe.area * probe.ratio * light * light;
        guided += probe.ratio * moment;
        plain += moment;
    }
    guided < plain
}

/// Hits of rays that leave the caster in all directions, except for hits of casters.
fn find_receivers(pass: &PhotonPass, caustics: &Caustics) -> Vec<Receiver> {
    let caster = &caustics.casters[0];
    let sampler = Sampler::for_pixel(0, caster.instance, [1, 0]);
    let ray = |number| {
        let [height, turn] = sampler.with_sample(number).get_2d(Dimension::PixelFilter).map(f64::from);
        let z = 2.0 * height - 1.0;
        let (sin, cos) = (TAU * turn).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let direction = DVec3::new(across * cos, across * sin, z);
        let origin = (caster.center + caster.radius * direction).as_vec3().to_array();
        Ray { origin, direction: direction.as_vec3().to_array(), t_max: f32::INFINITY }
    };
    let rays: Vec<_> = (0..RECEIVER_RAYS).map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    pass.geometry.two_level().closest(&rays, &mut hits, Coherence::Incoherent);
    let found = rays.iter().zip(hits).filter(|(_, hit)| !is_miss(hit) && !pass.is_candidate(hit));
    found.map(|(ray, hit)| Receiver { direction: ray.direction.into(), hit }).collect()
}

/// Area of the surface that a receiver represents, in any unit.
fn area_of(receiver: &Receiver, interaction: &SurfaceInteraction, caster: &CausticCaster) -> f64 {
    let distance = (interaction.position.distance(caster.center) / caster.radius).min(MAX_DISTANCE);
    let cosine = f64::from(interaction.side_normal.dot(receiver.direction).abs());
    distance * distance / cosine.max(MIN_COSINE)
}

/// Samples directions with guiding at all receivers.
fn sample_probes(geometry: &Geometry, caustics: &Caustics, receivers: &[Receiver]) -> Vec<Probe> {
    let mut probes = vec![];
    let mut interactions = SurfaceInteractions::<LANES>::default();
    let mut cones = Box::new(ConeMixture::<LANES>::default());
    for (chunk, receivers) in receivers.chunks(LANES).enumerate() {
        let corners = interactions.clear();
        for (lane, Receiver { hit, .. }) in receivers.iter().enumerate() {
            set_triangle(corners, lane, geometry.corners(hit.instance, hit.triangle));
        }
        for (lane, Receiver { direction, hit }) in receivers.iter().enumerate() {
            interactions.set_lane(lane, geometry, *direction, hit, &RayCone::default());
        }
        dispatch_simd(&mut interactions);
        for number in 0..DIRECTIONS {
            let sampler = |lane| Sampler::for_pixel(0, (chunk * LANES + lane) as u32, [2, 0]).with_sample(number);
            let samplers: [Sampler; LANES] = std::array::from_fn(sampler);
            let randoms = samplers.map(|sampler| sampler.get_2d(Dimension::Bsdf(0)));
            let random: [[f32; LANES]; 2] = [0, 1].map(|axis: usize| randoms.map(|random| random[axis]));
            let mut out: Vec3xN<f32, LANES> = [[0.0; LANES]; 3];
            dispatch_simd(SampleGuided {
                caustics,
                gaps: &[],
                interactions: &interactions,
                active: &[true; LANES],
                random: &random,
                cones: &mut cones,
                out: &mut out,
            });
            for (lane, receiver) in receivers.iter().enumerate() {
                let interaction = interactions.lane(lane);
                let direction = Vec3::from(get_lane(&out, lane));
                let cosine = interactions.shading_normal(lane).dot(direction);
                let density = cones.pdf(lane, direction, cosine);
                if cosine <= 0.0 || interaction.side_normal.dot(direction) <= 0.0 {
                    continue;
                }
                probes.push(Probe {
                    ray: interaction.spawn_ray(direction, f32::INFINITY),
                    direction,
                    sampler: samplers[lane],
                    area: area_of(receiver, &interaction, &caustics.casters[0]),
                    density,
                    ratio: f64::from(cosine_hemisphere_pdf(cosine) / density),
                    interior_list: InteriorList::default(),
                    throughput: Vec3::ONE,
                    is_scattered: false,
                    light: Vec3::ZERO,
                });
            }
        }
    }
    probes
}

/// Follows probes through casters, and adds the light that they find.
fn follow_probes(pass: &PhotonPass, probes: &mut [Probe]) {
    let mut active: Vec<usize> = (0..probes.len()).collect();
    let mut hits = vec![];
    for bounce in 0..MAX_BOUNCES {
        let rays: Vec<Ray> = active.iter().map(|&index| probes[index].ray).collect();
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        pass.geometry.two_level().closest(&rays, &mut hits, Coherence::Incoherent);
        let mut hits = hits.iter();
        active.retain(|&index| {
            let hit = hits.next();
            hit.is_some_and(|hit| {
                probes[index].add_light(pass, hit);
                probes[index].scatter(pass, hit, bounce)
            })
        });
    }
}

impl Probe {
    /// Adds the light at a hit, except for light that shadow rays find. Light that other surfaces scatter is unknown.
    fn add_light(&mut self, pass: &PhotonPass, hit: &Hit) {
        let (geometry, lights) = (pass.geometry, pass.lights);
        let position = Vec3::from(self.ray.origin).as_dvec3();
        let context = LightSampleContext { position, normal: Vec3::ZERO };
        let sampling = LightSampling::Importance;
        if !self.is_scattered {
            if is_miss(hit) {
                let (radiance, pdf) = lights.radiance_and_pdf(&context, sampling, self.direction, None);
                self.light += radiance / (1.0 + pdf / self.density);
            }
            return;
        }
        let lights = lights.view(LightView::Reflection);
        let distance = if is_miss(hit) { f64::INFINITY } else { f64::from(hit.t) };
        lights.intersect_visible(&context, sampling, self.direction, distance, |_, _, radiance, _| {
            self.light += self.throughput * radiance;
        });
        self.light += self.throughput
            * if is_miss(hit) {
                lights.escaped_radiance(self.direction, None)
            } else {
                let interaction = SurfaceInteraction::new(geometry, self.direction, hit, &RayCone::default());
                geometry.emission(hit, self.direction, &interaction.footprint)
            };
    }

    /// Scatters the probe at a caster; false if the probe ends.
    fn scatter(&mut self, pass: &PhotonPass, hit: &Hit, bounce: u32) -> bool {
        if is_miss(hit) || !pass.is_candidate(hit) {
            return false;
        }
        let interaction = SurfaceInteraction::new(pass.geometry, self.direction, hit, &RayCone::default());
        let [choice, _] = self.sampler.get_2d(Dimension::LobeAndLight(bounce + 1));
        let [x, y] = self.sampler.get_2d(Dimension::Bsdf(bounce + 1));
        let (at, media) = ((hit, &interaction), &mut self.interior_list);
        let Some((sample, ray)) = scatter(pass.geometry, at, self.direction, media, [choice, x, y]) else {
            return false;
        };
        self.ray = ray;
        if let Some(sample) = sample {
            self.throughput *= sample.weight;
            self.direction = sample.wi;
            self.is_scattered = true;
        }
        self.throughput.max_element() > 0.0 && self.throughput.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Light, Material, MaterialModel, Metal, Object, World};

    use crate::control::Control;
    use crate::guiding::LearnedGuiding;
    use crate::path_guiding::PathGuiding;
    use crate::prepare::world::PreparedWorld;
    use crate::settings::{Integrator, Settings};

    /// Number of casters that are used for a gold ball on a floor under a small lamp and a sky, with an optional
    /// roof over all.
    fn caster_count(sky: f32, has_roof: bool) -> usize {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([8.0, 8.0]).unwrap());
        let roof = world.add_mesh(primitive::box_([8.0, 8.0, 3.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(0.4, 5).unwrap());
        let matte = world.add_material(Material::default()).unwrap();
        let gold = MaterialModel::Metal(Metal::named("gold").unwrap());
        let gold = world.add_material(Material { model: gold, ..Material::default() }).unwrap();
        let mut objects = vec![(floor, matte, 0.0), (ball, gold, 0.5)];
        if has_roof {
            objects.push((roof, matte, 1.5));
        }
        for (mesh, material, height) in objects {
            let place = DAffine3::from_translation(height * glam::DVec3::Z);
            world.add_object(Object::new("", mesh, vec![material], place)).unwrap();
        }
        world.lights.push(Light::Rectangle {
            position: [0.8, 0.5, 2.8],
            u: [0.3, 0.0, 0.0],
            v: [0.0, -0.3, 0.0],
            radiance: [60.0; 3],
            two_sided: false,
        });
        world.lights.push(Light::uniform_sky([sky; 3]));
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let guiding = LearnedGuiding::default();
        let settings = Settings { integrator: Integrator::Path, max_depth: Some(6), ..Settings::default() };
        guiding.learn(&world.geometry, &world.lighting().lights, &settings);
        guiding.caustics(&world.geometry).casters.len()
    }

    #[test]
    fn casters_guide_samples_unless_an_open_sky_is_bright() {
        assert_eq!(caster_count(0.1, false), 1);
        assert_eq!(caster_count(10.0, false), 0);
    }

    #[test]
    fn casters_in_closed_rooms_guide_samples_under_any_sky() {
        assert_eq!(caster_count(10.0, true), 1);
    }
}
