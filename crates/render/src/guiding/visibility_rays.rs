//! Shadow rays from the points of a cube, which test whether light sampling finds light there.

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, Ray};

use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::LightSampleContext;
use crate::light::light_sampling::LightSampling;
use crate::light::lights::Lights;
use crate::light::samples::ONE_MINUS_SHADOW_EPSILON;
use crate::prepare::geometry::Geometry;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::settings::{Integrator, Settings};

/// Points of a cube from which shadow rays start, given by their numbers: first a few points, then the others, because
/// the first rays are sufficient in most lit cubes. Lab note: "32 shadow rays", 11-26.
const POINTS: [std::ops::Range<u32>; 2] = [0..4, 4..32];

/// True if sampling lights less often at dark places may be faster: see
/// [`crate::guiding::light_visibility::LightVisibility`].
pub(crate) fn needs_light_visibility(lights: &Lights, settings: &Settings) -> bool {
    // With infinite lights, the test is not useful, because they are visible from everywhere except closed rooms. With
    // a single light, no light is selected at random.
    settings.integrator == Integrator::Path
        && !lights.has_infinite_samples()
        && lights.needs_choice(LightSampling::Importance)
}

/// True if a shadow ray from any tested point of a scene-local cube finds light.
pub(crate) fn sees_light(geometry: &Geometry, lights: &Lights, [lower, upper]: [DVec3; 2]) -> bool {
    let sampler = Sampler::for_pixel(0, 0, [0, 0]);
    let mut queue = ShadowRayQueue::default();
    POINTS.into_iter().any(|points| {
        for number in points {
            let sampler = sampler.with_sample(number);
            let [x, y] = sampler.get_2d(Dimension::PixelFilter).map(f64::from);
            let [z, choice] = sampler.get_2d(Dimension::LobeAndLight(0));
            let position = lower + DVec3::new(x, y, f64::from(z)) * (upper - lower);
            let context = LightSampleContext { position, normal: Vec3::ZERO };
            let random = sampler.get_2d(Dimension::Light(0, 0));
            let sampling = LightSampling::Importance;
            let sample = lights.sample(&(&context).into(), geometry, sampling, choice, &random.into());
            if let Some(p_light) = sample.and_then(|sample| sample.p_light) {
                let direction = (p_light - position).as_vec3().to_array();
                let origin = position.as_vec3().to_array();
                queue.push(Ray { origin, direction, t_max: ONE_MINUS_SHADOW_EPSILON }, 0, Vec3::ONE);
            }
        }
        let mut found = [Vec3::ZERO];
        queue.trace(geometry, geometry.two_level(), Coherence::Incoherent, None, None, &mut found);
        found != [Vec3::ZERO]
    })
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Camera, Glass, Light, Material, MaterialModel, Object, PixelCenter, World, camera};

    use super::*;
    use crate::control::Control;
    use crate::film::channel::Channel;
    use crate::film::image_plane::ImagePlane;
    use crate::guiding::LearnedGuiding;
    use crate::guiding::light_visibility::{HIDDEN_RATE, LightVisibility};
    use crate::integrator::requirements::effective_lights;
    use crate::path_guiding::PathGuiding;
    use crate::prepare::world::PreparedWorld;
    use crate::render;

    const OPEN: DVec3 = DVec3::new(1.5, 0.0, 1.0);

    /// A box that contains a shining ball in a glass globe, and a lamp behind a wall that is open at the top.
    fn world() -> PreparedWorld {
        let mut world = World::default();
        let of = |model| Material { model, ..Material::default() };
        let mut shining = Material::default();
        shining.emission.value = [2.0; 3];
        let materials = [Material::default(), of(MaterialModel::Glass(Glass::default())), shining]
            .map(|material| world.add_material(material).unwrap());
        let room = world.add_mesh(primitive::box_([4.0, 2.0, 2.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(1.0, 3).unwrap());
        let placed = |at, size| DAffine3::from_translation(at) * DAffine3::from_scale(DVec3::splat(size));
        let globe = DVec3::new(-1.0, 0.0, 1.4);
        let wall = placed(DVec3::new(0.9, 0.0, 0.5), 1.0) * DAffine3::from_scale(DVec3::new(0.01, 1.0, 0.8));
        for (mesh, material, place) in [
            (room, 0, placed(DVec3::new(0.0, 0.0, 1.0), 1.0)),
            (room, 0, wall),
            (ball, 1, placed(globe, 0.25)),
            (ball, 2, placed(globe, 0.1)),
        ] {
            world.add_object(Object::new("", mesh, vec![materials[material]], place)).unwrap();
        }
        for x in [1.3, 1.7] {
            let (u, v) = ([0.35, 0.0, 0.0], [0.0, -1.8, 0.0]);
            let position = [x, 0.0, 0.6];
            world.lights.push(Light::Rectangle { position, u, v, radiance: [2.0; 3], two_sided: false });
        }
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    fn settings(samples: u32, seed: u64) -> Settings {
        Settings {
            integrator: Integrator::Path,
            samples,
            seed,
            max_depth: Some(4),
            channels: vec![Channel::Color],
            ..Settings::default()
        }
    }

    fn rate(world: &PreparedWorld, guiding: &LearnedGuiding, at: DVec3) -> f32 {
        let lights = effective_lights(Integrator::Path, world);
        guiding.light_sampling_rate(&world.geometry, lights, at - world.geometry.origin)
    }

    #[test]
    fn cubes_without_visible_lights_are_hidden() {
        let (world, guiding) = (world(), LearnedGuiding::default());
        guiding.learn(&world.geometry, effective_lights(Integrator::Path, &world), &settings(1, 0));
        assert!(guiding.has_rare_light_sampling());
        // Points next to and below the lamps, which shine down.
        assert_eq!(rate(&world, &guiding, OPEN - 0.9 * DVec3::Z), 1.0);
        // Points around and inside the globe, whose glass blocks shadow rays.
        assert_eq!(rate(&world, &guiding, DVec3::new(-1.5, 0.6, 0.1)), HIDDEN_RATE);
        assert_eq!(rate(&world, &guiding, DVec3::new(-1.0, 0.0, 1.55)), 1.0);
    }

    #[test]
    fn rare_light_samples_conserve_light() {
        let size = [24, 16];
        let k = camera::intrinsics_from_fov(80.0, size, PixelCenter::Integer).unwrap();
        let eye = DVec3::new(-0.2, -0.9, 1.0);
        let target = DVec3::new(-2.0, 0.6, 0.8);
        let camera = Camera::look_at(eye, target, DVec3::Z, k, size, PixelCenter::Integer).unwrap();
        let picture = |world: &PreparedWorld, seed| {
            let control = Control::new();
            let frame = render(world, &camera, &settings(96, seed), &control).unwrap();
            let ImagePlane::F32 { data: color, .. } = frame.plane(Channel::Color).unwrap() else {
                unreachable!("colours are float32");
            };
            color.iter().map(|&value| f64::from(value)).sum::<f64>() / color.len() as f64
        };
        let mean = |visibility: Option<LightVisibility>| {
            let world = world();
            let guiding = LearnedGuiding { light_visibility: visibility.into(), ..LearnedGuiding::default() };
            world.guiding.install(|_| Some(Box::new(guiding)));
            let all: Vec<f64> = (1..=6).map(|seed| picture(&world, seed)).collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            let variance = all.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / (all.len() - 1) as f64;
            (mean, variance / all.len() as f64)
        };
        // A point from which a light is visible.
        let everywhere = [DVec3::splat(-3.0), DVec3::splat(3.0)];
        let ((rare, a), (always, b)) = (mean(LightVisibility::all_hidden(everywhere)), mean(None));
        assert!((rare - always).abs() < 4.0 * (a + b).sqrt(), "{rare} {always} {}", (a + b).sqrt());
        assert!((a + b).sqrt() < 0.04 * always, "{}", (a + b).sqrt() / always);
    }
}
