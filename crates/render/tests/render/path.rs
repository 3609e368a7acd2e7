//! `path` compared with closed forms.

use std::sync::Arc;

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Alpha, Light, Material, MaterialModel, Mesh, NoticeCode, World};

fn settings(integrator: Integrator, samples: u32) -> Settings {
    Settings { integrator, samples, ..Settings::default() }
}

fn mean(world: &World, camera: &raycam_scene::Camera, settings: &Settings) -> f64 {
    let frame = render(world, camera, settings);
    let color = f32s(&frame, Channel::Color);
    color.iter().map(|&v| f64::from(v)).sum::<f64>() / color.len() as f64
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "found {found}, expected {expected}");
}

/// A closed sphere, seen from inside, that emits everywhere and reflects a fraction of the light.
fn glowing_sphere(albedo: [f32; 3]) -> World {
    let mut world = World::default();
    // The normals are flat, because interpolated normals would send some light into the wall.
    let mesh = flat(primitive::sphere(1.0, 0).unwrap().into());
    let mut matter = material(albedo, 1.0, 0.0, 1.0);
    matter.emission = [0.5; 3].into();
    add(&mut world, Arc::unwrap_or_clone(mesh), matter, DAffine3::IDENTITY);
    world.add_light(Light::uniform_sky([0.0; 3])).unwrap();
    world
}

#[test]
fn closed_sphere_radiance_sums_all_bounces() {
    // The radiance satisfies L = E + albedo L everywhere. Roulette depends on the brightest channel: while red
    // continues, most of the remaining light of green and blue does not depend on chance. If green decided alone, its
    // variance would be nine times larger.
    let camera = look_at(DVec3::ZERO, DVec3::X, 90.0, [8, 8]);
    let world = glowing_sphere([0.97, 0.9, 0.5]);
    let frame = render(&world, &camera, &settings(Integrator::Path, 2048));
    let color = f32s(&frame, Channel::Color);
    for (channel, albedo) in [(1, 0.9), (2, 0.5)] {
        let values = color.iter().skip(channel).step_by(3);
        let found = values.map(|&v| f64::from(v)).sum::<f64>() / 64.0;
        close(found, 0.5 / (1.0 - albedo), 1e-3);
    }
}

#[test]
fn max_depth_counts_segments() {
    let camera = look_at(DVec3::ZERO, DVec3::X, 90.0, [8, 8]);
    let world = glowing_sphere([0.5; 3]);
    for (depth, expected) in [(1, 0.5), (2, 0.75), (3, 0.875)] {
        let settings = Settings { max_depth: Some(depth), ..settings(Integrator::Path, 1024) };
        close(mean(&world, &camera, &settings), expected, 1e-3);
    }
}

#[test]
fn direct_equals_path_with_one_bounce() {
    let mut world = still_life();
    let camera = look_at(DVec3::new(4.0, -6.0, 3.0), DVec3::new(0.0, 0.0, 0.7), 40.0, [32, 24]);
    // Bulbs are outside the image, because their edges would need more samples.
    let bulb = |position| Light::Point { position, power: Some([400.0; 3]), intensity: None, radius: 0.5 };
    world.lights[1] = bulb([2.0, -9.0, 6.0]);
    world.lights.push(bulb([-6.0, -2.0, 3.0]));
    let direct = Settings { ambient_occlusion: Some(f64::INFINITY), ..settings(Integrator::Direct, 512) };
    let path = Settings { max_depth: Some(2), ..settings(Integrator::Path, 512) };
    let [direct, path] = [direct, path].map(|settings| render(&world, &camera, &settings));
    let [direct, path] = [&direct, &path].map(|frame| f32s(frame, Channel::Color));
    let mean = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
    close(mean(direct), mean(path), 3e-3);
    for (a, b) in direct.iter().zip(path) {
        assert!((a - b).abs() <= 0.05 + 0.1 * b, "{a} {b}");
    }
}

#[test]
fn last_segments_find_the_same_light_as_shadow_rays() {
    let camera = look_at(DVec3::new(4.0, -6.0, 3.0), DVec3::new(0.0, 0.0, 0.7), 40.0, [48, 32]);
    let whole = still_life();
    // A transparent material, although no object uses it, makes the tracer find the hits of last segments instead of
    // testing only occlusion.
    let mut seen_through = still_life();
    let glass = Material { alpha: Alpha::Blend, ..Material::default() };
    seen_through.add_material(glass).unwrap();
    for (integrator, depth) in [(Integrator::Direct, None), (Integrator::Path, Some(3))] {
        let settings = Settings { max_depth: depth, ..settings(integrator, 16) };
        let [a, b] = [&whole, &seen_through].map(|world| render(world, &camera, &settings));
        let [a, b] = [&a, &b].map(|frame| f32s(frame, Channel::Color));
        // A few pixels at the edges of lights and shadows may differ because of rounding.
        let differ = a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > 1e-5 + 1e-5 * **b);
        let differ = differ.count();
        assert!(differ <= 3, "{integrator:?}: {differ} of {}", a.len());
    }
}

#[test]
fn a_white_furnace_stays_white() {
    let mut world = World::default();
    for (x, specular) in [(-1.2, 0.0), (1.2, 0.3)] {
        let ball = primitive::sphere(1.0, 4).unwrap();
        let place = DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        add(&mut world, ball, material([1.0; 3], 1.0 - specular, specular, 20.0), place);
    }
    world.add_light(Light::uniform_sky([1.0; 3])).unwrap();
    let camera = look_at(DVec3::new(0.0, -6.0, 0.0), DVec3::ZERO, 40.0, [32, 24]);
    let frame = render(&world, &camera, &settings(Integrator::Path, 256));
    for pixel in f32s(&frame, Channel::Color).chunks(3) {
        assert!(pixel[0] <= 1.03 && pixel[0] >= 0.6, "{pixel:?}");
    }
    let whole = mean(&world, &camera, &settings(Integrator::Path, 256));
    assert!(whole <= 1.0005 && whole > 0.95, "{whole}");
    // The two white balls have no smooth normals and no lobe that extends below the surface, so they lose no light.
    world.meshes = world.meshes.drain(..).map(flat).collect();
    for material in &mut world.materials {
        material.model = MaterialModel::DEFAULT;
    }
    let whole = mean(&world, &camera, &settings(Integrator::Path, 64));
    close(whole, 1.0, 1e-3);
}

fn flat(mesh: Arc<Mesh>) -> Arc<Mesh> {
    Arc::new(Mesh { normals: None, ..Arc::unwrap_or_clone(mesh) })
}

/// A screen of some opacity in front of a matte floor under a sun.
fn screened(alpha: Alpha, opacity: f32) -> World {
    let mut world = plane(8.0, 0.5);
    let screen = Material { opacity, alpha, ..material([0.0; 3], 0.0, 0.0, 1.0) };
    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.0));
    add(&mut world, primitive::plane([4.0, 4.0]).unwrap(), screen, place);
    let sun = Light::Sun { direction: [0.0, 0.0, -1.0], irradiance: [std::f32::consts::PI; 3], angular_diameter: 0.0 };
    world.add_light(sun).unwrap();
    world
}

#[test]
fn screens_blend_with_the_background_by_opacity() {
    // The camera's rays and the light both pass the black screen.
    for (alpha, opacity, expected) in [
        (Alpha::Opaque, 0.3, 0.0),
        (Alpha::Blend, 0.0, 0.5),
        (Alpha::Blend, 0.25, 0.5 * 0.75 * 0.75),
        (Alpha::Blend, 0.5, 0.5 * 0.5 * 0.5),
        (Alpha::Mask { cutoff: 0.5 }, 0.49, 0.5),
        (Alpha::Mask { cutoff: 0.5 }, 0.5, 0.0),
    ] {
        let world = screened(alpha, opacity);
        let camera = look_at(DVec3::new(0.1, 0.2, 3.0), DVec3::new(0.1, 0.2, 0.0), 5.0, [8, 8]);
        for integrator in [Integrator::Direct, Integrator::Path] {
            let found = mean(&world, &camera, &settings(integrator, 256));
            close(found, expected, 0.005);
        }
    }
}

#[test]
fn camera_rays_pass_the_back_of_one_sided_surfaces() {
    let mut world = screened(Alpha::Opaque, 1.0);
    world.materials[1].double_sided = false;
    let seen = |eye: f64, world: &World| {
        let target = DVec3::new(0.1, 0.2, 1.0 - (eye - 1.0));
        let camera = look_at(DVec3::new(0.1, 0.2, eye), target, 5.0, [4, 4]);
        mean(world, &camera, &settings(Integrator::Path, 16))
    };
    assert_eq!(seen(2.0, &world), 0.0, "the front side is black");
    world.lights.push(Light::uniform_sky([1.0; 3]));
    close(seen(0.5, &world), 1.0, 1e-6);
    world.materials[1].double_sided = true;
    assert!(seen(0.5, &world) < 0.01);
}

#[test]
fn unlit_surfaces_are_visible_and_emit_no_light() {
    let mut world = plane(4.0, 0.5);
    let shade = Material { color: [0.25, 0.5, 0.75], model: MaterialModel::Unlit, ..Material::default() };
    let wall = Mesh {
        vertices: vec![DVec3::new(-2.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 4.0)],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    add(&mut world, wall, shade, DAffine3::IDENTITY);
    world.add_light(Light::uniform_sky([0.0; 3])).unwrap();
    let eye = DVec3::new(0.0, -2.0, 1.0);
    let camera = look_at(eye, DVec3::new(0.0, 1.0, 1.0), 5.0, [4, 4]);
    let frame = render(&world, &camera, &settings(Integrator::Path, 8));
    for pixel in f32s(&frame, Channel::Color).chunks(3) {
        assert_eq!(pixel, [0.25, 0.5, 0.75]);
    }
    let floor = look_at(eye, DVec3::ZERO, 5.0, [4, 4]);
    assert_eq!(mean(&world, &floor, &settings(Integrator::Path, 64)), 0.0);
}

#[test]
fn path_images_have_the_same_bytes_for_any_number_of_threads() {
    let world = still_life();
    let camera = look_at(DVec3::new(4.0, -6.0, 3.0), DVec3::Z, 40.0, [70, 50]);
    let of = |threads| {
        let settings = Settings { threads: Some(threads), ..settings(Integrator::Path, 4) };
        bits(&render(&world, &camera, &settings))
    };
    let one = of(1);
    for threads in [2, 3, 8] {
        assert_eq!(of(threads), one);
    }
}

#[test]
fn clamped_samples_are_counted() {
    let camera = look_at(DVec3::ZERO, DVec3::X, 90.0, [4, 4]);
    let settings = Settings { clamp: Some(0.7), ..settings(Integrator::Path, 16) };
    let frame = render(&glowing_sphere([0.9; 3]), &camera, &settings);
    assert!(f32s(&frame, Channel::Color).iter().all(|&v| v <= 0.7));
    assert_eq!(frame.notices[0].code, NoticeCode::ClampedSamples);
}

#[test]
fn ambient_occlusion_equals_the_form_factor() {
    // Two planes form a corner. At points close to the edge, each plane hides half of the sky above the other; far
    // away, nothing is hidden.
    let mut world = plane(2000.0, 0.5);
    let camera = look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.01, [1, 1]);
    let ao = |world: &World, distance| {
        let settings = Settings { ambient_occlusion: distance, ..settings(Integrator::Ao, 4096) };
        mean(world, &camera, &settings)
    };
    assert_eq!(ao(&world, None), 1.0);
    let ceiling = DAffine3::from_translation(DVec3::new(0.0, 0.0, 5.0));
    let mesh = primitive::plane([2000.0, 2000.0]).unwrap();
    add(&mut world, mesh, Material::default(), ceiling);
    assert!(ao(&world, None) < 1e-3);
    // The point is 5 below a ceiling. With a limit of 10, the ceiling occludes the directions within 60 degrees of the
    // normal.
    close(ao(&world, Some(10.0)), 0.25, 0.01);
}

#[test]
fn every_light_reaches_visible_surfaces() {
    // The lights have no size, and all of them are sampled at each point, so that nothing depends on random numbers.
    let mut world = plane(10.0, 0.5);
    for i in 0..4 {
        let light = Light::Point {
            position: [f64::from(i) - 3.0, f64::from(i % 2), 1.0 + f64::from(i)],
            power: None,
            intensity: Some([1.0 + i as f32, 2.0, 3.0]),
            radius: 0.0,
        };
        world.add_light(light).unwrap();
    }
    let camera = look_at(DVec3::new(0.0, -2.0, 3.0), DVec3::ZERO, 30.0, [8, 8]);
    let path = Settings { max_depth: Some(2), ..settings(Integrator::Path, 1) };
    let [direct, path] = [settings(Integrator::Direct, 1), path].map(|settings| {
        let frame = render(&world, &camera, &settings);
        f32s(&frame, Channel::Color).to_vec()
    });
    assert!(direct.iter().all(|&v| v > 0.0));
    for (direct, path) in direct.into_iter().zip(path) {
        close(path.into(), direct.into(), 1e-5);
    }
}
