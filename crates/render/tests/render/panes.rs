//! Thin walls in front of lights: shadow rays and paths pass the walls, and their light is multiplied by the walls'
//! transmittance.

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Glass, Light, Material, MaterialModel, Principled, World};

const IOR: f64 = 1.5;

fn glass(thin: bool) -> Material {
    let model = MaterialModel::Glass(Glass { ior: IOR as f32, thin, ..Glass::default() });
    Material { model, ..Material::default() }
}

/// glTF's window: it transmits all light that Schlick's approximation does not reflect.
fn window() -> Material {
    let mut p = Principled::default();
    (p.metallic.value, p.roughness.value, p.transmission.value, p.thickness.value) = (0.0, 0.0, 1.0, 0.0);
    Material { model: MaterialModel::Principled(p.into()), ..Material::default() }
}

/// A white floor under horizontal panes; the k-th pane is 1 + k / 4 above it.
fn floor_under(panes: &[Material], light: Light) -> World {
    let mut world = plane(20.0, 1.0);
    for (k, material) in panes.iter().enumerate() {
        let height = DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.0 + 0.25 * k as f64));
        add(&mut world, primitive::plane([40.0, 40.0]).unwrap(), material.clone(), height);
    }
    world.add_light(light).unwrap();
    world
}

/// Mean radiance of a patch of the floor, seen from below the panes.
fn radiance(world: &World, integrator: Integrator, depth: Option<u32>, samples: u32) -> f64 {
    let camera = look_at(DVec3::new(0.1, 0.0, 0.9), DVec3::new(0.1, 1e-3, 0.0), 5.0, [4, 4]);
    let settings = Settings { integrator, samples, max_depth: depth, ..Settings::default() };
    let frame = render(world, &camera, &settings);
    let color = f32s(&frame, Channel::Color);
    color.iter().map(|&v| f64::from(v)).sum::<f64>() / color.len() as f64
}

/// Transmittance of a pane with all reflections between its faces, by the cosine of incidence.
fn pane_transmittance(cosine: f64) -> f64 {
    let refracted = (1.0 - (1.0 - cosine * cosine) / (IOR * IOR)).sqrt();
    let s = (cosine - IOR * refracted) / (cosine + IOR * refracted);
    let p = (IOR * cosine - refracted) / (IOR * cosine + refracted);
    let once = (s * s + p * p) / 2.0;
    (1.0 - once) / (1.0 + once)
}

#[test]
fn sun_and_bulb_shine_through_panes() {
    let direction = DVec3::new(0.6, 0.0, -0.8);
    let sun = Light::Sun { direction: direction.to_array(), irradiance: [3.0; 3], angular_diameter: 0.0 };
    let schlick = 0.04 + 0.96 * (1.0f64 - 0.8).powi(5);
    let cases = [
        (vec![glass(true)], pane_transmittance(0.8)),
        (vec![glass(true), glass(true)], pane_transmittance(0.8).powi(2)),
        (vec![window()], 1.0 - schlick),
    ];
    for (panes, transmittance) in cases {
        // With two segments, light that the floor reflects up to the panes is not included.
        let found = radiance(&floor_under(&panes, sun.clone()), Integrator::Path, Some(2), 16);
        let expected = 3.0 * 0.8 * transmittance / std::f64::consts::PI;
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
    // The bulb's light arrives at the point of the floor at an angle whose cosine is 0.8.
    let bulb = Light::Point { position: [1.6, 0.0, 2.0], power: None, intensity: Some([5.0; 3]), radius: 0.0 };
    let found = radiance(&floor_under(&[glass(true)], bulb), Integrator::Direct, None, 16);
    let cosine = 2.0 / (1.5f64 * 1.5 + 4.0).sqrt();
    let expected = 5.0 * cosine / (1.5 * 1.5 + 4.0) * pane_transmittance(cosine) / std::f64::consts::PI;
    assert!((found / expected - 1.0).abs() < 5e-3, "{found} {expected}");
}

#[test]
fn light_samples_and_bsdf_samples_agree_behind_panes() {
    // The lamp is distant and subtends a small angle, so that its light falls nearly straight down.
    let lamp = |two_sided| Light::Rectangle {
        position: [0.1, 0.0, 6.0],
        u: [2.0, 0.0, 0.0],
        v: [0.0, -2.0, 0.0],
        radiance: [7.0; 3],
        two_sided,
    };
    let open = radiance(&floor_under(&[], lamp(false)), Integrator::Path, Some(2), 4096);
    for panes in [vec![glass(true)], vec![glass(true); 3]] {
        let found = radiance(&floor_under(&panes, lamp(false)), Integrator::Path, Some(2), 4096);
        let expected = open * pane_transmittance(1.0).powi(panes.len() as i32);
        assert!((found / expected - 1.0).abs() < 4e-3, "{} {found} {expected}", panes.len());
    }
    // The light of a lamp in front of the pane is counted only once.
    let mut world = floor_under(&[], lamp(true));
    let height = DAffine3::from_translation(DVec3::new(0.0, 0.0, 8.0));
    add(&mut world, primitive::plane([40.0, 40.0]).unwrap(), glass(true), height);
    let found = radiance(&world, Integrator::Path, Some(2), 4096);
    assert!((found / open - 1.0).abs() < 4e-3, "{found} {open}");
}

#[test]
fn solid_glass_still_blocks_a_light_without_size() {
    let sun = Light::Sun { direction: [0.0, 0.0, -1.0], irradiance: [3.0; 3], angular_diameter: 0.0 };
    let found = radiance(&floor_under(&[glass(false)], sun), Integrator::Path, Some(2), 16);
    assert_eq!(found, 0.0);
}
