//! The path of a pixel's brightest sample, in scenes with mirrors and suns.

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{BrightPath, Control, Integrator, Settings, brightest_samples};
use raycam_scene::mesh::primitive;
use raycam_scene::{Camera, Light, Material, MaterialModel, Metal, World};

/// The brightest sample of the centre pixel.
fn brightest(world: &World, camera: &Camera, settings: &Settings) -> (f64, BrightPath) {
    let [width, height] = camera.size();
    let pixels = [[width / 2, height / 2]];
    let found = brightest_samples(&prepare(world), camera, settings, &pixels, &Control::new()).unwrap();
    found.into_iter().next().flatten().unwrap()
}

fn settings(samples: u32) -> Settings {
    Settings { integrator: Integrator::Path, samples, ..Settings::default() }
}

fn sun(direction: [f64; 3]) -> Light {
    Light::Sun { direction, irradiance: [1.0; 3], angular_diameter: 0.0 }
}

#[test]
fn bright_path_of_a_sunlit_plane_follows_the_shadow_ray() {
    let mut world = plane(4.0, 0.5);
    world.add_light(sun([0.0, -1.0, -1.0])).unwrap();
    let camera = look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 10.0, [9, 9]);
    let (share, path) = brightest(&world, &camera, &settings(8));
    // With uniform light, every sample has the same fraction.
    assert!((share - 1.0 / 8.0).abs() < 1e-6, "{share}");
    assert_eq!(path.instances, [0]);
    assert_eq!(path.distance, f64::INFINITY);
    assert!(path.origin.length() < 0.2, "{}", path.origin);
    assert!((path.direction.as_dvec3() - DVec3::new(0.0, 1.0, 1.0).normalize()).length() < 1e-6);
}

#[test]
fn bright_paths_list_the_mirror_before_the_reflected_plane() {
    let mut world = plane(40.0, 0.5);
    world.add_light(sun([1.0, 0.0, -1.0])).unwrap();
    let mirror = Material { model: MaterialModel::Metal(Metal::named("silver").unwrap()), ..Material::default() };
    // The mirror is above the plane and faces the plane.
    let turned =
        DAffine3::from_translation(DVec3::new(0.0, 0.0, 2.0)) * DAffine3::from_rotation_x(std::f64::consts::PI);
    add(&mut world, primitive::plane([1.0, 1.0]).unwrap(), mirror, turned);
    let camera = look_at(DVec3::new(0.0, -4.0, 1.0), DVec3::new(0.0, 0.0, 2.0), 2.0, [9, 9]);
    let (_, path) = brightest(&world, &camera, &settings(4));
    assert_eq!(path.instances, [1, 0]);
    // From the mirror, the ray goes down by two metres, with the same horizontal distance per metre of height as on the
    // way up.
    assert!((path.origin - DVec3::new(0.0, 8.0, 0.0)).length() < 0.5, "{}", path.origin);
}

#[test]
fn bright_paths_end_at_the_lamps_distance() {
    let mut world = World::default();
    let radiance = [3.0; 3];
    let area = Light::Rectangle {
        position: [0.0, 0.0, 3.0],
        u: [1.0, 0.0, 0.0],
        v: [0.0, -1.0, 0.0],
        radiance,
        two_sided: true,
    };
    world.add_light(area).unwrap();
    let camera = look_at(DVec3::ZERO, DVec3::Z, 5.0, [5, 5]);
    let (_, path) = brightest(&world, &camera, &settings(4));
    assert!(path.instances.is_empty());
    assert!((path.distance - 3.0).abs() < 0.01, "{}", path.distance);
    assert!((path.radiance - 3.0).abs() < 1e-5);
}

#[test]
fn bright_paths_outside_the_image_are_refused() {
    let mut world = plane(4.0, 0.5);
    world.add_light(sun([0.0, 0.0, -1.0])).unwrap();
    let camera = look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 10.0, [9, 9]);
    let prepared = prepare(&world);
    let found = |pixel, integrator| {
        let settings = Settings { integrator, ..settings(2) };
        brightest_samples(&prepared, &camera, &settings, &[pixel], &Control::new())
    };
    assert!(found([9, 0], Integrator::Path).unwrap_err().to_string().contains("9 x 9"));
    assert_eq!(found([4, 4], Integrator::Flat).unwrap(), [None]);
    assert!(found([4, 4], Integrator::Direct).unwrap()[0].is_some());
}
