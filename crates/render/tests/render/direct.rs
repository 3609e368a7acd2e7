//! `direct` compared with closed forms.

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Light, MaterialModel, Mesh, NoticeCode, World};

fn settings(samples: u32) -> Settings {
    Settings { integrator: Integrator::Direct, samples, ..Settings::default() }
}

/// The red radiance of an image with one pixel.
fn radiance(world: &World, eye: DVec3, target: DVec3, settings: &Settings) -> f64 {
    let frame = render(world, &look_at(eye, target, 0.01, [1, 1]), settings);
    f64::from(f32s(&frame, Channel::Color)[0])
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "found {found}, expected {expected}");
}

fn sun(towards: DVec3, irradiance: f32) -> Light {
    Light::Sun { direction: (-towards).to_array(), irradiance: [irradiance; 3], angular_diameter: 0.0 }
}

fn bulb(position: DVec3, intensity: f32, radius: f64) -> Light {
    Light::Point { position: position.to_array(), power: None, intensity: Some([intensity; 3]), radius }
}

const EYE: DVec3 = DVec3::new(0.4, -0.3, 2.0);

#[test]
fn lambertian_plane_under_the_sun_matches_the_closed_form() {
    for degrees in [0.0f64, 30.0, 60.0, 85.0] {
        let angle = degrees.to_radians();
        let mut world = plane(4.0, 0.6);
        world.add_light(sun(7.0 * DVec3::new(angle.sin(), 0.0, angle.cos()), 3.0)).unwrap();
        let expected = 0.6 * 3.0 * angle.cos() / std::f64::consts::PI;
        close(radiance(&world, EYE, DVec3::ZERO, &settings(1)), expected, 1e-5);
        close(radiance(&world, EYE, DVec3::ZERO, &settings(16)), expected, 1e-3);
    }
}

#[test]
fn lambertian_plane_under_a_bulb_matches_the_closed_form() {
    for position in [DVec3::new(0.0, 0.0, 1.0), DVec3::new(2.0, 1.0, 0.5), DVec3::new(-30.0, 4.0, 70.0)] {
        let mut world = plane(4.0, 0.6);
        world.add_light(bulb(position, 5.0, 0.0)).unwrap();
        let r = position.length();
        let expected = 0.6 * 5.0 * (position.z / r) / (std::f64::consts::PI * r * r);
        close(radiance(&world, EYE, DVec3::ZERO, &settings(1)), expected, 1e-5);
        // A uniformly bright sphere illuminates every outside point like a point light at its centre, if the whole
        // sphere is above the point's horizon.
        let mut world = plane(4.0, 0.6);
        let radius = 0.4 * position.z;
        world.add_light(bulb(position, 5.0, radius)).unwrap();
        // The camera is at a position from which the bulb does not hide the plane.
        let eye = DVec3::new(-1.5, 1.5, 0.2);
        let frame = render(&world, &look_at(eye, DVec3::ZERO, 0.01, [32, 32]), &settings(32));
        let color = f32s(&frame, Channel::Color);
        let mean = color.iter().map(|&v| f64::from(v)).sum::<f64>() / color.len() as f64;
        close(mean, expected, 1e-3);
        // The power is distributed evenly over all directions.
        let mut world = plane(4.0, 0.6);
        let power = Some([4.0 * std::f32::consts::PI * 5.0; 3]);
        let light = Light::Point { position: position.to_array(), power, intensity: None, radius: 0.0 };
        world.add_light(light).unwrap();
        close(radiance(&world, EYE, DVec3::ZERO, &settings(1)), expected, 1e-5);
    }
}

#[test]
fn tiny_distant_spherical_light_equals_a_point_light() {
    let at = DVec3::new(3e5, 0.0, 4e5);
    let of = |radius| {
        let mut world = plane(4.0, 0.6);
        world.add_light(bulb(at, 1e12, radius)).unwrap();
        radiance(&world, EYE, DVec3::ZERO, &settings(4))
    };
    close(of(1e-3), of(0.0), 1e-5);
    close(of(10.0), of(0.0), 1e-4);
}

#[test]
fn spherical_light_is_visible_but_does_not_emit_inwards() {
    // A sphere of radiance L has the intensity L pi r^2.
    let seen = 5.0 / (std::f64::consts::PI * 0.5 * 0.5);
    for (position, radius, expected) in [(DVec3::ZERO, 0.0, 0.0), (DVec3::new(0.0, 0.0, 0.1), 0.5, seen)] {
        let mut world = plane(4.0, 0.6);
        world.add_light(bulb(position, 5.0, radius)).unwrap();
        let eye = DVec3::new(0.0, 0.0, 2.0);
        close(radiance(&world, eye, DVec3::ZERO, &settings(16)), expected, 1e-6);
    }
}

#[test]
fn occluders_cast_shadows() {
    let lit = |light: Light, blocker: Option<f64>, gap: DVec3| {
        let mut world = plane(4.0, 0.6);
        world.add_light(light).unwrap();
        if let Some(height) = blocker {
            let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, height) + gap);
            // The blocker is wide, but outside the camera's view.
            let mesh = primitive::plane([2.0 * height, 2.0 * height]).unwrap();
            add(&mut world, mesh, material([1.0; 3], 1.0, 0.0, 1.0), place);
        }
        radiance(&world, DVec3::new(1.5, 0.0, 0.5), DVec3::ZERO, &settings(16)) > 0.0
    };
    let up = DVec3::Z;
    for light in [sun(up, 1.0), bulb(up, 1.0, 0.0), bulb(up, 1.0, 0.05)] {
        assert!(lit(light.clone(), None, DVec3::ZERO));
        assert!(!lit(light.clone(), Some(0.5), DVec3::ZERO));
        assert!(!lit(light.clone(), Some(0.01), DVec3::ZERO), "a blocker close to the ground");
        assert!(lit(light.clone(), Some(0.5), DVec3::new(0.0, 0.7, 0.0)), "a blocker beside the light's path");
    }
    assert!(lit(bulb(up, 1.0, 0.0), Some(1.5), DVec3::ZERO), "behind the bulb");
    assert!(!lit(sun(up, 1.0), Some(1.5), DVec3::ZERO), "before the sun");
}

#[test]
fn both_sides_of_a_surface_are_lit_without_leaks() {
    let mut world = plane(4.0, 0.6);
    world.add_light(sun(-DVec3::Z, 3.0)).unwrap();
    assert_eq!(radiance(&world, EYE, DVec3::ZERO, &settings(4)), 0.0, "lit from behind");
    close(radiance(&world, -EYE, DVec3::ZERO, &settings(4)), 0.6 * 3.0 / std::f64::consts::PI, 1e-5);
    // Tilted vertex normals must not let light through the triangle.
    let mut leaning = primitive::plane([4.0, 4.0]).unwrap();
    leaning.normals = Some(vec![[0.8, 0.0, 0.6]; leaning.vertices.len()]);
    let mut world = World::default();
    add(&mut world, leaning, material([1.0; 3], 0.6, 0.0, 1.0), DAffine3::IDENTITY);
    world.add_light(sun(DVec3::new(1.0, 0.0, -0.1), 3.0)).unwrap();
    assert_eq!(radiance(&world, EYE, DVec3::ZERO, &settings(4)), 0.0);
}

#[test]
fn vertex_normals_are_transformed_for_shading_also_on_mirrored_objects() {
    let mut leaning = primitive::plane([4.0, 4.0]).unwrap();
    leaning.normals = Some(vec![[0.6, 0.0, 0.8]; leaning.vertices.len()]);
    let flip = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    for (transform, cosine) in [
        (DAffine3::IDENTITY, 1.0),
        (flip, 0.8 * 0.8 - 0.6 * 0.6),
        // Stretched to twice its width, the surface is half as steep.
        (
            DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0)),
            DVec3::new(0.3, 0.0, 0.8).normalize().dot(DVec3::new(0.6, 0.0, 0.8)),
        ),
    ] {
        let mut world = World::default();
        add(&mut world, leaning.clone(), material([1.0; 3], 0.6, 0.0, 1.0), transform);
        world.add_light(sun(DVec3::new(0.6, 0.0, 0.8), 3.0)).unwrap();
        let expected = 0.6 * 3.0 * cosine / std::f64::consts::PI;
        close(radiance(&world, EYE, DVec3::ZERO, &settings(1)), expected, 1e-4);
    }
}

/// Fraction of uniform light that a specular plane reflects to the eye, with one sun for each of many directions. By
/// reciprocity, this fraction is the albedo for light from the eye's direction.
fn albedo(shininess: f32, eye: DVec3) -> f64 {
    const RINGS: usize = 96;
    const TURNS: usize = 48;
    let mut world = World::default();
    let mesh = primitive::plane([4.0, 4.0]).unwrap();
    add(&mut world, mesh, material([1.0; 3], 0.0, 1.0, shininess), DAffine3::IDENTITY);
    let mut sum = 0.0;
    for ring in 0..RINGS {
        // All suns are in one world, because their light adds up. Each represents an equal solid angle.
        world.lights.clear();
        let z = (ring as f64 + 0.5) / RINGS as f64;
        for turn in 0..TURNS {
            let phi = (turn as f64 + 0.5) / TURNS as f64 * std::f64::consts::TAU;
            let r = (1.0 - z * z).sqrt();
            world.add_light(sun(DVec3::new(r * phi.cos(), r * phi.sin(), z), 1.0)).unwrap();
        }
        sum += radiance(&world, eye, DVec3::ZERO, &settings(1));
    }
    sum * std::f64::consts::TAU / (RINGS * TURNS) as f64
}

#[test]
fn phong_lobe_conserves_energy() {
    for shininess in [0.0, 1.0, 5.0, 20.0] {
        close(albedo(shininess, DVec3::new(0.0, 0.0, 2.0)), 1.0, 0.01);
        let mut last = 1.01;
        for degrees in [30.0f64, 60.0, 85.0] {
            let angle = degrees.to_radians();
            let eye = 2.0 * DVec3::new(angle.sin(), 0.0, angle.cos());
            let found = albedo(shininess, eye);
            assert!(found <= last && found > 0.05, "{shininess} {degrees}: {found}");
            last = found;
            // The sky's irradiance is the same integral.
            let mut world = World::default();
            let mesh = primitive::plane([4.0, 4.0]).unwrap();
            add(&mut world, mesh, material([1.0; 3], 0.0, 1.0, shininess), DAffine3::IDENTITY);
            world.add_light(Light::uniform_sky([1.0; 3])).unwrap();
            close(radiance(&world, eye, DVec3::ZERO, &settings(1)), found, 0.02);
        }
    }
}

#[test]
fn sharp_phong_lobe_peaks_in_the_mirror_direction() {
    let mut world = World::default();
    let mesh = primitive::plane([4.0, 4.0]).unwrap();
    add(&mut world, mesh, material([1.0; 3], 0.0, 0.5, 100.0), DAffine3::IDENTITY);
    world.add_light(sun(DVec3::new(1.0, 0.0, 1.0), 2.0)).unwrap();
    let mirror = radiance(&world, DVec3::new(-1.0, 0.0, 1.0), DVec3::ZERO, &settings(1));
    let expected = 0.5 * 102.0 / std::f64::consts::TAU * 2.0 * 0.5f64.sqrt();
    close(mirror, expected, 1e-4);
    let beside = radiance(&world, DVec3::new(1.0, 0.0, 1.0), DVec3::ZERO, &settings(1));
    assert!(beside < 1e-6 * mirror);
}

/// A disc that faces up and down, built as a triangle fan.
fn disc(radius: f64, height: f64) -> Mesh {
    const N: u32 = 256;
    let mut vertices = vec![DVec3::new(0.0, 0.0, height)];
    vertices.extend((0..N).map(|i| {
        let (sin, cos) = (f64::from(i) / f64::from(N) * std::f64::consts::TAU).sin_cos();
        DVec3::new(radius * cos, radius * sin, height)
    }));
    let triangles = (0..N).map(|i| [0, 1 + i, 1 + (i + 1) % N]).collect();
    Mesh { vertices, triangles, ..Mesh::default() }
}

#[test]
fn sky_light_is_reduced_by_ambient_occlusion_within_its_distance() {
    let mut world = plane(4.0, 0.6);
    add(&mut world, disc(1.0, 0.7), material([1.0; 3], 1.0, 0.0, 1.0), DAffine3::IDENTITY);
    for radiance in [[1.5; 3], [0.5; 3]] {
        world.add_light(Light::uniform_sky(radiance)).unwrap();
    }
    // The point is below the disc. The disc's form factor for a point under its centre is r^2 / (r^2 + h^2).
    let eye = DVec3::new(0.5, 0.0, 0.3);
    close(radiance(&world, eye, DVec3::ZERO, &settings(4)), 0.6 * 2.0, 1e-6);
    let occluded = |distance| Settings { ambient_occlusion: Some(distance), ..settings(4096) };
    let open = 1.0 - 1.0 / (1.0 + 0.7 * 0.7);
    close(radiance(&world, eye, DVec3::ZERO, &occluded(f64::INFINITY)), 1.2 * open, 0.01);
    // No occluder is within 0.69 m of the point. Of the disc, only the part within 1.0 m occludes the ambient
    // light.
    close(radiance(&world, eye, DVec3::ZERO, &occluded(0.69)), 1.2, 1e-6);
    close(radiance(&world, eye, DVec3::ZERO, &occluded(1.0)), 1.2 * 0.7 * 0.7, 0.01);
    let background = radiance(&world, eye, DVec3::new(5.0, 0.0, 1.0), &settings(1));
    assert_eq!(background, 2.0);
}

#[test]
fn unlit_surfaces_emit_their_base_colour() {
    let mut world = plane(4.0, 1.0);
    world.materials[0].model = MaterialModel::Unlit;
    world.materials[0].color = [0.25, 0.5, 0.75];
    world.add_light(sun(DVec3::Z, 9.0)).unwrap();
    let camera = look_at(EYE, DVec3::ZERO, 10.0, [4, 4]);
    let frame = render(&world, &camera, &settings(8));
    for pixel in f32s(&frame, Channel::Color).chunks(3) {
        assert_eq!(pixel, [0.25, 0.5, 0.75]);
    }
}

#[test]
fn worlds_without_lights_get_default_lights_with_a_notice() {
    let world = plane(4.0, 0.6);
    let camera = look_at(EYE, DVec3::ZERO, 10.0, [4, 4]);
    let frame = render(&world, &camera, &settings(4));
    assert_eq!(frame.notices[0].code, NoticeCode::DefaultLights);
    let sun = 2.4 / std::f64::consts::PI * 3.0 / 14f64.sqrt();
    close(f64::from(f32s(&frame, Channel::Color)[0]), 0.6 * (0.4 + sun), 1e-6);
    let flat = render(&world, &camera, &Settings::default());
    assert!(flat.notices.is_empty());
    let mut dark = world;
    dark.add_light(Light::uniform_sky([0.0; 3])).unwrap();
    let frame = render(&dark, &camera, &settings(4));
    assert!(frame.notices.is_empty());
    assert_eq!(f32s(&frame, Channel::Color)[0], 0.0);
}

#[test]
fn samples_beyond_float32_become_black_and_are_counted() {
    let mut world = plane(4.0, 0.6);
    world.add_light(bulb(DVec3::new(0.0, 0.0, 1e-3), 3e38, 0.0)).unwrap();
    let camera = look_at(EYE, DVec3::ZERO, 10.0, [4, 4]);
    let frame = render(&world, &camera, &settings(2));
    assert!(f32s(&frame, Channel::Color).iter().all(|v| v.is_finite()));
    assert_eq!(frame.notices[0].code, NoticeCode::TooBrightSamples);
}
