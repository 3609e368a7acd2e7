//! Lights in images: emission of textured meshes, and the penumbra of a sun with a diameter.

use std::sync::Arc;

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{
    Image, Light, Material, MaterialModel, TexelFilter, Texels, Texture, TextureSampler, TextureSlot, World,
};

fn seen(world: &World, at: DVec3, samples: u32, integrator: Integrator) -> f64 {
    // The image has many pixels that show nearly the same point, because rays are traced in batches.
    const SIDE: u32 = 16;
    let camera = look_at(at + DVec3::new(1e-3, -0.4, 0.4), at, 0.01, [SIDE, SIDE]);
    let settings = Settings {
        integrator,
        samples: samples.div_ceil(SIDE * SIDE),
        max_depth: (integrator == Integrator::Path).then_some(2),
        ..Settings::default()
    };
    let frame = render(world, &camera, &settings);
    let color = f32s(&frame, Channel::Color);
    color.iter().map(|&v| f64::from(v)).sum::<f64>() / color.len() as f64
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "found {found}, expected {expected}");
}

#[test]
fn textured_meshes_emit_like_their_texels() {
    // A sheet above the floor has two by two texels: four parts, each equal to a separate light.
    let radiance = [[8.0f32, 0.0], [1.0, 3.0]];
    let image = Image::new("", [2, 2], Texels::Float(radiance.iter().flatten().map(|&v| [v, v, v, 1.0]).collect()));
    let mut shining = plane(4.0, 0.5);
    shining.add_light(Light::uniform_sky([0.0; 3])).unwrap();
    let texture = shining.add_texture(Texture {
        image: Arc::new(image),
        sampler: TextureSampler { magnification: TexelFilter::Nearest, ..TextureSampler::default() },
    });
    let mut material = Material {
        model: MaterialModel::Phong { diffuse: 0.0, specular: [0.0; 3], shininess: 1.0 },
        ..Material::default()
    };
    material.emission.value = [1.0; 3];
    material.emission.texture = Some(TextureSlot::plain(texture));
    // The sheet is turned upside down about x: its upper edge, v = 0, is now at y < 0.
    let place = DAffine3::from_translation(DVec3::new(0.2, 0.1, 1.0)) * DAffine3::from_rotation_x(std::f64::consts::PI);
    add(&mut shining, primitive::plane([1.0, 1.0]).unwrap(), material, place);
    let mut sheets = plane(4.0, 0.5);
    for (row, line) in radiance.iter().enumerate() {
        for (column, &radiance) in line.iter().enumerate() {
            let corner = DVec3::new(column as f64 * 0.5 - 0.25, row as f64 * 0.5 - 0.25, 0.0);
            let light = Light::Rectangle {
                position: (corner + DVec3::new(0.2, 0.1, 1.0)).to_array(),
                u: [0.5, 0.0, 0.0],
                v: [0.0, -0.5, 0.0],
                radiance: [radiance; 3],
                two_sided: false,
            };
            sheets.add_light(light).unwrap();
        }
    }
    for at in [DVec3::ZERO, DVec3::new(-0.8, 0.5, 0.0)] {
        let expected = seen(&sheets, at, 1 << 18, Integrator::Direct);
        for integrator in [Integrator::Direct, Integrator::Path] {
            close(seen(&shining, at, 1 << 20, integrator), expected, 2e-3);
        }
    }
}

#[test]
fn sun_penumbra_equals_the_visible_fraction_of_the_disk() {
    const DIAMETER: f64 = 20.0;
    const HEIGHT: f64 = 1.0;
    let mut world = plane(20.0, 1.0);
    let sun =
        Light::Sun { direction: [0.0, 0.0, -1.0], irradiance: [std::f32::consts::PI; 3], angular_diameter: DIAMETER };
    world.add_light(sun).unwrap();
    // A screen covers all points with x > 0.
    let screen = primitive::plane([40.0, 40.0]).unwrap();
    let place = DAffine3::from_translation(DVec3::new(20.0, 0.0, HEIGHT));
    add(&mut world, screen, material([0.0; 3], 0.0, 0.0, 1.0), place);
    let radius = (DIAMETER / 2.0).to_radians().sin();
    for x in [-0.3, -0.12, -0.05, 0.02, 0.1, 0.15, 0.3] {
        // Seen from the floor, the screen's edge is a great circle. Projected along z, the sun is a circle of this
        // radius, and the edge is part of an ellipse in it. The light is the area beyond the ellipse (Nusselt's
        // analogue).
        let sine = -x / (x * x + HEIGHT * HEIGHT).sqrt();
        const STEPS: usize = 20_000;
        let visible: f64 = (0..STEPS)
            .map(|i| {
                let y = ((i as f64 + 0.5) / STEPS as f64 * 2.0 - 1.0) * radius;
                let half = (radius * radius - y * y).sqrt();
                let edge = sine * (1.0 - y * y).sqrt();
                (edge.clamp(-half, half) + half) * 2.0 * radius / STEPS as f64
            })
            .sum();
        let expected = visible / (std::f64::consts::PI * radius * radius);
        let found = seen(&world, DVec3::new(x, 0.0, 0.0), 1 << 18, Integrator::Direct);
        assert!((found - expected).abs() < 1e-3, "at {x}: found {found}, expected {expected}");
    }
}

#[test]
fn daylight_comes_from_the_given_direction() {
    let mut world = plane(4.0, 1.0);
    world.add_light(Light::Preetham { direction: [-1.0, 0.0, -1.0], turbidity: 3.0, scale: 1.0 }).unwrap();
    // A wall shades the floor on the side that faces away from the sun, but not on the other side.
    let wall = primitive::box_([0.1, 4.0, 1.0]).unwrap();
    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.5));
    add(&mut world, wall, material([0.0; 3], 0.0, 0.0, 1.0), place);
    let [behind, before] = [-0.5, 0.5].map(|x| {
        let at = DVec3::new(x, 0.0, 0.0);
        seen(&world, at, 256, Integrator::Path)
    });
    assert!(before > 3.0 * behind, "{before} {behind}");
}
