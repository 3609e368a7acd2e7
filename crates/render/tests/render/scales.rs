//! Worlds of any size at any position: no surface shades itself, and ground truth loses no digits.

use crate::common::*;
use glam::{DAffine3, DMat3, DVec3};
use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Light, World};

const PLACES: [DVec3; 3] = [DVec3::ZERO, DVec3::new(1e6, -1e6, 1e6), DVec3::new(-3.1e5, 5.2e6, 17.0)];

/// A box, a ball and a sheared box on the ground, with this size and position, under a sun and a bulb. The position is
/// in the vertices or in the transform.
fn scene(size: f64, place: DVec3, in_vertices: bool) -> World {
    let mut world = World::default();
    let lean = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(0.7, 0.3, 0.0), DVec3::new(0.2, -0.4, 2.0)));
    let up = |z| DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
    let meshes = [
        (primitive::plane([30.0, 30.0]).unwrap(), DAffine3::IDENTITY),
        (primitive::sphere(1.0, 5).unwrap(), up(1.0)),
        (primitive::box_([1.0, 1.0, 1.0]).unwrap(), DAffine3::from_translation(DVec3::new(2.0, 0.0, 1.0)) * lean),
        (
            primitive::box_([1.0, 1.0, 1.0]).unwrap(),
            DAffine3::from_translation(DVec3::new(-2.0, 0.3, 0.5)) * DAffine3::from_rotation_z(0.4),
        ),
    ];
    let all = DAffine3::from_translation(place) * DAffine3::from_scale(DVec3::splat(size));
    for (mut mesh, transform) in meshes {
        mesh.normals = None;
        let mut transform = all * transform;
        if in_vertices {
            for vertex in &mut mesh.vertices {
                *vertex = transform.transform_point3(*vertex);
            }
            transform = DAffine3::IDENTITY;
        }
        add(&mut world, mesh, material([1.0; 3], 1.0, 0.0, 1.0), transform);
    }
    world
}

fn camera(size: f64, place: DVec3) -> raycam_scene::Camera {
    let eye = place + size * DVec3::new(1.0, -7.0, 4.0);
    look_at(eye, place + size * DVec3::new(0.0, 0.0, 0.5), 40.0, [96, 72])
}

#[test]
fn surfaces_do_not_shade_themselves() {
    // All visible surfaces that face the light have the closed form's brightness: the light is behind the camera, so a
    // visible point can only be shaded by its own surface.
    for size in [1e-6, 1e-2, 1.0, 1e3, 1e6] {
        for place in PLACES {
            // If a world is far away and small, float64 retains only some of the digits.
            if place.length() > 1e9 * size {
                continue;
            }
            for in_vertices in [true, false] {
                let mut world = scene(size, place, in_vertices);
                let camera = camera(size, place);
                world
                    .add_light(Light::Point {
                        position: camera.c().to_array(),
                        power: None,
                        intensity: Some([(size * size) as f32; 3]),
                        radius: 0.0,
                    })
                    .unwrap();
                for samples in [1, 4] {
                    let settings = Settings {
                        integrator: Integrator::Direct,
                        samples,
                        channels: all_channels(),
                        ..Settings::default()
                    };
                    let frame = render(&world, &camera, &settings);
                    let wrong = |i: usize| {
                        let color = f64::from(f32s(&frame, Channel::Color)[3 * i]);
                        let normal = &f32s(&frame, Channel::Normal)[3 * i..3 * i + 3];
                        let normal = DVec3::new(f64::from(normal[0]), f64::from(normal[1]), f64::from(normal[2]));
                        let distance = f64::from(f32s(&frame, Channel::Distance)[i]) / size;
                        let position = DVec3::from_slice(&f64s(&frame, Channel::Position)[3 * i..3 * i + 3]);
                        let cosine = normal.dot((camera.c() - position).normalize());
                        let expected = cosine / std::f64::consts::PI / distance.powi(2);
                        let pure = f32s(&frame, Channel::Coverage)[i] == 1.0;
                        let hit = i32s(&frame, Channel::Instance)[i] >= 0;
                        // The tolerance includes the variation of the ball's facets and of the distance within a pixel.
                        let tolerance = if samples == 1 { 1e-3 } else { 0.2 };
                        hit && pure && cosine > 0.1 && (color - expected).abs() > tolerance * expected
                    };
                    let wrong = (0..96 * 72).filter(|&i| wrong(i)).count();
                    // With several samples, the samples of a pixel may hit different facets of an object.
                    let allowed = if samples == 1 { 0 } else { 60 };
                    assert!(
                        wrong <= allowed,
                        "size {size} at {place} in_vertices {in_vertices}, {samples} samples: {wrong} wrong pixels"
                    );
                }
            }
        }
    }
}

#[test]
fn thin_gaps_let_light_through() {
    // A lid lies a thousandth above the ground and is seen from the side: grazing light must pass under it.
    for size in [1e-6, 1.0, 1e6] {
        for place in [DVec3::ZERO, DVec3::new(1e3, 1e3, 1e3) * size] {
            let mut world = World::default();
            let at = |z: f64| {
                DAffine3::from_translation(place + DVec3::new(0.0, 0.0, z * size))
                    * DAffine3::from_scale(DVec3::splat(size))
            };
            let matte = || material([1.0; 3], 1.0, 0.0, 1.0);
            let mesh = primitive::plane([1.0, 1.0]).unwrap();
            add(&mut world, mesh.clone(), matte(), at(0.0));
            add(&mut world, mesh, matte(), at(0.001));
            let low = DVec3::new(1.0, 0.0, 0.0015).normalize();
            world
                .add_light(Light::Sun { direction: (-low).to_array(), irradiance: [1e4; 3], angular_diameter: 0.0 })
                .unwrap();
            let lit = |x: f64| {
                let target = place + size * DVec3::new(x, 0.0, 0.0);
                let eye = target + size * DVec3::new(0.9 - x, 0.0, 0.0012);
                let camera = look_at(eye, target, 1e-3, [1, 1]);
                let settings = Settings {
                    integrator: Integrator::Direct,
                    channels: vec![Channel::Color, Channel::Instance],
                    ..Settings::default()
                };
                let frame = render(&world, &camera, &settings);
                assert_eq!(i32s(&frame, Channel::Instance), [0], "size {size} at {place}");
                f32s(&frame, Channel::Color)[0] > 0.0
            };
            assert!(lit(0.2), "size {size} at {place}");
            assert!(!lit(-0.4), "size {size} at {place}");
        }
    }
}

#[test]
fn ground_truth_keeps_precision_far_from_the_origin() {
    for size in [1e-6, 1.0, 1e6] {
        for place in PLACES {
            if place.length() > 1e7 * size {
                continue;
            }
            let world = scene(size, place, false);
            let near = scene(1.0, DVec3::ZERO, false);
            let settings = Settings { channels: all_channels(), ..Settings::default() };
            let there = camera(size, place);
            let far = render(&world, &there, &settings);
            let here = render(&near, &camera(1.0, DVec3::ZERO), &settings);
            let mut compared = 0;
            for i in 0..96 * 72 {
                let ids = |f| (i32s(f, Channel::Instance)[i], i32s(f, Channel::Triangle)[i]);
                // Pixels at edges are excluded, because rounding of the position decides what they show.
                if ids(&far) != ids(&here) || ids(&far).0 < 0 {
                    continue;
                }
                compared += 1;
                let depth = f64::from(f32s(&far, Channel::Depth)[i]) / size;
                let expected = f64::from(f32s(&here, Channel::Depth)[i]);
                assert!((depth - expected).abs() <= 2e-6 * expected, "{depth} {expected}");
                let point = DVec3::from_slice(&f64s(&far, Channel::Position)[3 * i..3 * i + 3]);
                let (pixel, in_front) = there.project(point);
                let center = there.pixel_center_of(i as u32 % 96, i as u32 / 96);
                assert!(in_front && (pixel - center).length() < 1e-3, "{pixel} {center}");
            }
            let hits = |f| i32s(f, Channel::Instance).iter().filter(|&&i| i >= 0).count();
            assert!(compared > hits(&here) * 99 / 100, "{compared} of {}", hits(&here));
        }
    }
}
