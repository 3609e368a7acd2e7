//! Adaptive sampling of light that few samples find: the mean over many seeds, and the reported error.
//!
//! The reference is the plain estimator: a fixed number of samples per pixel, whose mean is unbiased by construction.
//! The short form of slow scenes uses few seeds and therefore wide tolerances; with `RAYCAM_PROOF`, 64 seeds resolve
//! the error to 10 %.

use std::sync::Arc;

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Control, Integrator, PreparedWorld, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::texture::{Image, Texels, TextureSampler, TextureSlot};
use raycam_scene::{Camera, Light, Material, MaterialModel, Metal, Texture, World};

const SIZE: [u32; 2] = [16, 12];

/// Number of seeds, and limits on two relative errors: of the mean's standard error, and of the reported error.
struct Precision {
    seeds: u64,
    max_sigma: f64,
    max_error_ratio: f64,
}

impl Precision {
    const PROOF: Self = Self { seeds: 64, max_sigma: 0.05, max_error_ratio: 1.1 };
    const SHORT: Self = Self { seeds: 8, max_sigma: 0.1, max_error_ratio: 1.25 };

    /// Precision for scenes that take long to render.
    fn of_slow_scenes() -> Self {
        if std::env::var_os("RAYCAM_PROOF").is_some() { Self::PROOF } else { Self::SHORT }
    }
}

fn grey() -> Material {
    Material { color: [0.7; 3], ..Material::default() }
}

fn block(world: &mut World, at: [f64; 3], size: [f64; 3], material: Material) {
    let place = DAffine3::from_translation(at.into()) * DAffine3::from_scale(size.into());
    add(world, primitive::box_([1.0; 3]).unwrap(), material, place);
}

fn inside(world: World) -> (World, Camera) {
    (world, look_at(DVec3::new(-0.9, -0.9, 1.4), DVec3::new(0.3, 0.4, 0.6), 62.0, SIZE))
}

/// A dark room, and a bright room behind its wall, which has a narrow gap.
fn keyhole() -> (World, Camera) {
    let mut world = World::default();
    block(&mut world, [1.0, 0.0, 1.0], [4.0, 2.0, 2.0], grey());
    block(&mut world, [1.0, -0.22, 1.0], [0.04, 1.56, 2.0], grey());
    block(&mut world, [1.0, 0.8, 1.0], [0.04, 0.4, 2.0], grey());
    let (u, v) = ([0.6, 0.0, 0.0], [0.0, -0.6, 0.0]);
    let position = [2.0, 0.0, 1.98];
    world.add_light(Light::Rectangle { position, u, v, radiance: [90.0; 3], two_sided: false }).unwrap();
    inside(world)
}

/// A room lit by a panel whose texture is black except for a few bright texels.
fn panel() -> (World, Camera) {
    let mut world = World::default();
    block(&mut world, [1.0, 0.0, 1.0], [4.0, 2.0, 2.0], grey());
    let lamp = |i: usize| i % 8 == 3 && i / 32 % 8 == 3;
    let texels = (0..32 * 32).map(|i| if lamp(i) { [60.0, 60.0, 60.0, 1.0] } else { [0.0, 0.0, 0.0, 1.0] }).collect();
    let image = Image::new("panel", [32, 32], Texels::Float(texels));
    let texture = world.add_texture(Texture { image: Arc::new(image), sampler: TextureSampler::default() });
    let mut shining = material([1.0; 3], 0.0, 0.0, 1.0);
    shining.emission.value = [1.0; 3];
    shining.emission.texture = Some(TextureSlot::plain(texture));
    let down = DAffine3::from_translation(DVec3::new(0.5, 0.0, 1.95)) * DAffine3::from_rotation_x(std::f64::consts::PI);
    add(&mut world, primitive::plane([1.0, 1.0]).unwrap(), shining, down);
    inside(world)
}

/// A mirror ball that reflects the light of a lamp onto the floor.
fn caustic() -> (World, Camera) {
    let mut world = World::default();
    add(&mut world, primitive::plane([6.0, 6.0]).unwrap(), grey(), DAffine3::IDENTITY);
    let gold = Material { model: MaterialModel::Metal(Metal::named("gold").unwrap()), ..Material::default() };
    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.6));
    add(&mut world, primitive::sphere(0.5, 4).unwrap(), gold, place);
    let (u, v) = ([0.1, 0.0, 0.0], [0.0, -0.1, 0.0]);
    let position = [1.0, 0.5, 3.0];
    world.add_light(Light::Rectangle { position, u, v, radiance: [200.0; 3], two_sided: false }).unwrap();
    (world, look_at(DVec3::new(0.0, -4.0, 2.0), DVec3::new(0.3, 0.0, 0.3), 45.0, SIZE))
}

/// A closed room with a window, under a sky.
fn window() -> (World, Camera) {
    let mut world = World::default();
    for (at, size) in [
        ([0.0, 0.0, -0.05], [4.0, 3.0, 0.1]),
        ([0.0, 0.0, 2.05], [4.0, 3.0, 0.1]),
        ([-2.05, 0.0, 1.0], [0.1, 3.0, 2.0]),
        ([0.0, -1.55, 1.0], [4.2, 0.1, 2.0]),
        ([0.0, 1.55, 1.0], [4.2, 0.1, 2.0]),
        ([2.05, -0.85, 1.0], [0.1, 1.3, 2.0]),
        ([2.05, 0.85, 1.0], [0.1, 1.3, 2.0]),
        ([2.05, 0.0, 0.5], [0.1, 0.4, 1.0]),
        ([2.05, 0.0, 1.8], [0.1, 0.4, 0.4]),
    ] {
        block(&mut world, at, size, grey());
    }
    world.add_light(Light::uniform_sky([4.0, 4.0, 5.0])).unwrap();
    (world, look_at(DVec3::new(-0.5, -1.2, 1.4), DVec3::new(-1.5, 1.0, 0.4), 60.0, SIZE))
}

/// Luminances and reported errors of an image.
fn picture(world: &PreparedWorld, camera: &Camera, settings: &Settings) -> (Vec<f64>, Vec<f64>) {
    let frame = raycam_render::render(world, camera, settings, &Control::new()).unwrap();
    let luminance = |pixel: &[f32]| {
        let [r, g, b] = [0, 1, 2].map(|i| f64::from(pixel[i]));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let errors = f32s(&frame, Channel::Error).iter().map(|&error| f64::from(error)).collect();
    (f32s(&frame, Channel::Color).chunks(3).map(luminance).collect(), errors)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of all images and the standard error of that mean.
fn mean_and_error(images: &[(Vec<f64>, Vec<f64>)]) -> (f64, f64) {
    let means: Vec<f64> = images.iter().map(|(image, _)| mean(image)).collect();
    let whole = mean(&means);
    let variance = means.iter().map(|one| (one - whole).powi(2)).sum::<f64>() / (means.len() - 1) as f64;
    (whole, (variance / means.len() as f64).sqrt())
}

fn check((world, camera): (World, Camera), noise: f32, precision: Precision) {
    let world = prepare(&world);
    let plain = Settings {
        integrator: Integrator::Path,
        samples: 256,
        max_depth: Some(6),
        channels: vec![Channel::Color, Channel::Error],
        ..Settings::default()
    };
    let adaptive = Settings { samples: 2048, noise_threshold: Some(noise), ..plain.clone() };
    let Precision { seeds, max_sigma, max_error_ratio } = precision;
    let images = |settings: &Settings, first: u64| -> Vec<_> {
        let of = |seed| picture(&world, &camera, &Settings { seed, ..settings.clone() });
        (first..first + seeds).map(of).collect()
    };
    let (shown, exact) = (images(&adaptive, 0), images(&plain, 1000));
    let ((found, error), (expected, exact_error)) = (mean_and_error(&shown), mean_and_error(&exact));
    let sigma = error.hypot(exact_error);
    assert!((found - expected).abs() < 3.0 * sigma, "mean {found}, expected {expected}, sigma {sigma}");
    assert!(sigma < max_sigma * expected, "the test cannot resolve a bias: sigma {sigma} of {expected}");
    // The variance of a pixel over the seeds is the square of the true error.
    let (mut actual, mut reported) = (0.0, 0.0);
    for pixel in 0..shown[0].0.len() {
        let values: Vec<f64> = shown.iter().map(|(image, _)| image[pixel]).collect();
        let whole = mean(&values);
        actual += values.iter().map(|value| (value - whole).powi(2)).sum::<f64>() / (seeds - 1) as f64;
        reported += mean(&shown.iter().map(|(_, errors)| errors[pixel].powi(2)).collect::<Vec<_>>());
    }
    let ratio = (reported / actual).sqrt();
    assert!(ratio.max(1.0 / ratio) < max_error_ratio, "reported error {ratio} of the true error");
}

#[test]
fn adaptive_mean_and_error_of_a_narrow_gap_are_unbiased() {
    check(keyhole(), 0.1, Precision::of_slow_scenes());
}

#[test]
fn adaptive_mean_and_error_of_a_textured_lamp_panel_are_unbiased() {
    check(panel(), 0.02, Precision::of_slow_scenes());
}

#[test]
fn adaptive_mean_and_error_of_a_caustic_are_unbiased() {
    check(caustic(), 0.02, Precision::PROOF);
}

#[test]
fn adaptive_mean_and_error_of_a_window_are_unbiased() {
    check(window(), 0.02, Precision::of_slow_scenes());
}
