//! Clear materials inside clear materials, compared with closed forms.

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Camera, Glass, Light, Material, MaterialModel, Mesh, World};

const GLASS: f64 = 1.5;
const WATER: f64 = 1.33;

fn matter(glass: Glass, priority: i32) -> Material {
    Material { priority, model: MaterialModel::Glass(glass), ..Material::default() }
}

fn clear(ior: f64, priority: i32) -> Material {
    let glass = Glass { ior: ior as f32, ..Glass::default() };
    matter(glass, priority)
}

/// Adds a wide slab between two heights.
fn slab(world: &mut World, material: Material, low: f64, high: f64) {
    let mesh = primitive::box_([2e3, 2e3, high - low]).unwrap();
    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, (low + high) / 2.0));
    add(world, mesh, material, place);
}

/// Camera that looks down at an angle to the vertical.
fn looking_down(degrees: f64) -> Camera {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let eye = DVec3::new(9.0 * sin + 1e-3, 0.0, 9.0 * cos);
    look_at(eye, DVec3::new(1e-3, 0.0, 0.0), 0.1, [16, 16])
}

fn mean(world: &World, camera: &Camera, samples: u32) -> [f64; 3] {
    let settings = Settings { integrator: Integrator::Path, samples, ..Settings::default() };
    let frame = render(world, camera, &settings);
    let color = f32s(&frame, Channel::Color);
    [0, 1, 2].map(|channel| {
        let values = color.iter().skip(channel).step_by(3);
        values.map(|&v| f64::from(v)).sum::<f64>() / (color.len() / 3) as f64
    })
}

/// Fresnel reflectance for each polarisation, between two layers of a stack; the angle is measured in air.
fn reflectances(degrees: f64, from: f64, to: f64) -> [f64; 2] {
    let cosine = |n: f64| (1.0 - (degrees.to_radians().sin() / n).powi(2)).sqrt();
    let (a, b) = (cosine(from), cosine(to));
    let s = (from * a - to * b) / (from * a + to * b);
    let p = (to * a - from * b) / (to * a + from * b);
    [s * s, p * p]
}

/// Transmittance of a stack of layers with all interreflections, as computed by a path tracer: without polarisation, so
/// that every interface reflects the mean of both polarisations.
fn transmittance(degrees: f64, indices: &[f64]) -> f64 {
    let (mut passed, mut back) = (1.0, 0.0);
    for pair in indices.windows(2) {
        let [s, p] = reflectances(degrees, pair[0], pair[1]);
        let one = (s + p) / 2.0;
        let between = 1.0 / (1.0 - back * one);
        (passed, back) = (passed * (1.0 - one) * between, one + (1.0 - one) * (1.0 - one) * back * between);
    }
    passed
}

#[test]
fn stacked_layers_transmit_by_fresnel() {
    let stack = [1.0, GLASS, WATER, GLASS, 1.0];
    // Three cases: water that overlaps its glass; water in a cavity that is missing in the glass mesh; and the second
    // case with glass of higher priority, which replaces all water.
    let held = |world: &mut World| {
        slab(world, clear(GLASS, 1), 0.0, 1.0);
        slab(world, clear(WATER, 0), 0.7, 2.2);
        slab(world, clear(GLASS, 1), 2.0, 3.0);
    };
    let within = |priority: i32| {
        move |world: &mut World| {
            slab(world, clear(GLASS, 0), 0.0, 3.0);
            slab(world, clear(WATER, priority), 1.0, 2.0);
        }
    };
    type Build<'a> = (&'a str, &'a dyn Fn(&mut World), &'a [f64]);
    let (equal, higher, lower) = (within(0), within(1), within(-1));
    let cases: [Build; 4] = [
        ("held", &held, &stack),
        ("within", &equal, &stack),
        ("displacing", &higher, &stack),
        ("hidden", &lower, &[1.0, GLASS, 1.0]),
    ];
    for (name, build, indices) in cases {
        let mut world = World::default();
        build(&mut world);
        world
            .add_light(Light::Sky {
                radiance: None,
                zenith: Some([0.0; 3]),
                horizon: Some([0.0; 3]),
                ground: Some([1.0; 3]),
            })
            .unwrap();
        for degrees in [0.0, 40.0, 65.0] {
            let [found, ..] = mean(&world, &looking_down(degrees), 2048);
            let expected = transmittance(degrees, indices);
            assert!((found / expected - 1.0).abs() < 1e-3, "{name} at {degrees}: {found}, expected {expected}");
        }
    }
}

#[test]
fn nested_interiors_absorb_light() {
    // All media have the index of air. The path crosses two metres of water, of which the glass displaces a quarter of
    // a metre.
    let mut world = World::default();
    let tinted = |color, priority| {
        let glass = Glass { ior: 1.0, attenuation_color: color, attenuation_distance: 1.0, ..Glass::default() };
        matter(glass, priority)
    };
    let (water, glass) = ([0.9, 0.8, 0.3], [0.4, 0.9, 0.7]);
    slab(&mut world, tinted(water, 0), 0.0, 2.0);
    slab(&mut world, tinted(glass, 1), 1.75, 2.5);
    world.add_light(Light::uniform_sky([1.0; 3])).unwrap();
    let found = mean(&world, &looking_down(0.0), 16);
    for i in 0..3 {
        let expected = f64::from(water[i]).powf(1.75) * f64::from(glass[i]).powf(0.75);
        assert!((found[i] / expected - 1.0).abs() < 1e-3, "{found:?} {expected}");
    }
}

#[test]
fn nested_clear_objects_are_invisible_under_a_white_sky() {
    let mut world = World::default();
    let ball = |world: &mut World, radius, x, material| {
        let place = DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        let mesh = primitive::sphere(radius, 4).unwrap();
        add(world, mesh, material, place);
    };
    let rough = Glass { roughness: 0.4, ..Glass::default() };
    ball(&mut world, 1.0, -0.3, clear(WATER, 0));
    ball(&mut world, 0.8, 0.6, clear(GLASS, 2));
    ball(&mut world, 0.5, 0.1, clear(1.0, 3));
    ball(&mut world, 0.3, -0.8, matter(rough, 1));
    world.add_light(Light::uniform_sky([1.0; 3])).unwrap();
    let camera = look_at(DVec3::new(0.0, -6.0, 0.0), DVec3::ZERO, 22.0, [16, 16]);
    let found = mean(&world, &camera, 256);
    // The tolerance is larger for rough surfaces inside other media, which lose a little light and are noisy.
    assert!((found[0] - 1.0).abs() < 1e-2, "{found:?}");
}

#[test]
fn lights_inside_clear_objects_are_attenuated() {
    // The scene is a bulb above a matte floor, both inside an absorbing medium with the index of air.
    let seen = |color: [f32; 3]| {
        let mut world = plane(2.0, 0.5);
        let glass = Glass { ior: 1.0, attenuation_color: color, attenuation_distance: 1.0, ..Glass::default() };
        let mesh = primitive::box_([8.0; 3]).unwrap();
        add(&mut world, mesh, matter(glass, 0), DAffine3::IDENTITY);
        world
            .add_light(Light::Point { position: [0.0, 0.0, 2.0], power: None, intensity: Some([1.0; 3]), radius: 0.0 })
            .unwrap();
        let camera = look_at(DVec3::new(0.0, 1e-3, 6.0), DVec3::ZERO, 0.01, [1, 1]);
        mean(&world, &camera, 16)
    };
    let (clear, tinted) = (seen([1.0; 3]), seen([0.5, 0.8, 1.0]));
    // The path is two metres from the bulb to the floor, and four to the camera's entry point.
    for (i, share) in [0.5f64, 0.8, 1.0].into_iter().enumerate() {
        let expected = clear[i] * share.powi(6);
        assert!((tinted[i] / expected - 1.0).abs() < 1e-3, "{tinted:?} {clear:?}");
    }
}

/// A frosted object in the sun and next to a bulb, on a floor. An `open` mesh has one triangle too many, which has no
/// area.
fn frosted(mesh: Mesh, open: bool) -> World {
    let mut world = plane(20.0, 0.5);
    let mut mesh = Mesh { vertices: mesh.vertices, triangles: mesh.triangles, ..Mesh::default() };
    if open {
        let first = mesh.vertices.len() as u32;
        let along = |x: f64| DVec3::new(x, 0.0, 0.0);
        mesh.vertices.extend([along(0.0), along(0.1), along(0.2)]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    let rough = Glass { roughness: 0.5, ..Glass::default() };
    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.2));
    add(&mut world, mesh, matter(rough, 0), place);
    let sun = Light::Sun { direction: [0.3, 0.6, -1.0], irradiance: [2.0; 3], angular_diameter: 0.0 };
    let bulb = Light::Point { position: [2.0, 0.0, 2.0], power: None, intensity: Some([4.0; 3]), radius: 0.0 };
    world.add_light(sun).unwrap();
    world.add_light(bulb).unwrap();
    world
}

/// Camera that shows the object of [`frosted`].
fn in_front(fov: f64, size: [u32; 2]) -> Camera {
    let target = DVec3::new(0.0, 0.0, 1.2);
    look_at(DVec3::new(0.0, -5.0, 2.0), target, fov, size)
}

#[test]
fn lights_blocked_by_objects_are_rarely_sampled() {
    let camera = in_front(30.0, [16; 2]);
    let ball = || primitive::sphere(1.0, 4).unwrap();
    let picture = |open| {
        let settings = Settings { integrator: Integrator::Path, samples: 64, ..Settings::default() };
        let frame = render(&frosted(ball(), open), &camera, &settings);
        f32s(&frame, Channel::Color).to_vec()
    };
    assert!(picture(false) == picture(true));
}

#[test]
fn partly_inverted_bodies_are_lit_like_open_meshes() {
    // The mesh consists of a ball that is inside out and a larger, correctly oriented ball outside the image. The total
    // volume is positive.
    let mesh = || {
        let mut mesh = primitive::sphere(1.0, 3).unwrap();
        mesh.triangles.iter_mut().for_each(|triangle| triangle.reverse());
        let other = primitive::sphere(2.0, 3).unwrap();
        let first = mesh.vertices.len() as u32;
        let away = |&vertex: &DVec3| vertex + DVec3::new(0.0, -30.0, 0.0);
        mesh.vertices.extend(other.vertices.iter().map(away));
        let triangles = other.triangles.iter();
        mesh.triangles.extend(triangles.map(|triangle| triangle.map(|vertex| vertex + first)));
        mesh
    };
    let camera = in_front(10.0, [8; 2]);
    let [body, open] = [false, true].map(|open| mean(&frosted(mesh(), open), &camera, 4096)[0]);
    assert!((body / open - 1.0).abs() < 0.02, "{body} {open}");
}
