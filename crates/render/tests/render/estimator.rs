//! The reported error, and images that stop at an error threshold or a time limit.

use std::sync::Arc;

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Control, Frame, Integrator, Progressive, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::texture::{Image, Texels, TextureSampler, TextureSlot};
use raycam_scene::{Camera, NoticeCode, Texture, World};

fn settings(samples: u32) -> Settings {
    Settings {
        integrator: Integrator::Path,
        samples,
        max_depth: Some(3),
        channels: vec![Channel::Color, Channel::Error],
        ..Settings::default()
    }
}

fn scene() -> (World, Camera) {
    let camera = look_at(DVec3::new(4.0, -6.0, 3.0), DVec3::new(0.0, 0.0, 0.7), 40.0, [24, 16]);
    (still_life(), camera)
}

/// Adds a floor with an image of fine squares.
fn add_squares(world: &mut World) {
    let texels = (0..64 * 64).map(|i| if (i % 64 + i / 64) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] }).collect();
    let image = Image::new("squares", [64, 64], Texels::Srgb8(texels));
    let texture = world.add_texture(Texture { image: Arc::new(image), sampler: TextureSampler::default() });
    let mut stuff = material([1.0; 3], 1.0, 0.0, 1.0);
    stuff.texture = Some(TextureSlot::plain(texture));
    let floor = primitive::plane([9.0, 9.0]).unwrap();
    add(world, floor, stuff, DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.01)));
}

fn luminance(frame: &Frame) -> Vec<f64> {
    let weigh = |pixel: &[f32]| {
        let [r, g, b] = [0, 1, 2].map(|i| f64::from(pixel[i]));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    f32s(frame, Channel::Color).chunks(3).map(weigh).collect()
}

/// The ratio of the reported error to the true error of four images, both as root mean square.
fn estimated_over_actual_error(world: &World, camera: &Camera, exact: &Settings, of: &Settings) -> f64 {
    let exact = luminance(&render(world, camera, exact));
    let (mut actual, mut estimated) = (0.0, 0.0);
    for seed in 1..5 {
        let frame = render(world, camera, &Settings { seed, ..of.clone() });
        let errors = f32s(&frame, Channel::Error);
        for ((found, exact), error) in luminance(&frame).iter().zip(&exact).zip(errors) {
            actual += (found - exact).powi(2);
            estimated += f64::from(*error).powi(2);
        }
    }
    (estimated / actual).sqrt()
}

#[test]
fn reported_error_equals_the_true_error() {
    let (world, camera) = scene();
    let ratio = estimated_over_actual_error(&world, &camera, &settings(4096), &settings(64));
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn reported_error_is_the_standard_error_of_the_mean() {
    // The image shows the edge of an unlit plane: only the white fraction of each pixel depends on random numbers.
    let camera = look_at(DVec3::new(4.0, -6.0, 3.0), DVec3::new(0.0, 0.0, 0.7), 70.0, [48, 32]);
    let flat = |samples| Settings { integrator: Integrator::Flat, ..settings(samples) };
    for samples in [16, 50, 256] {
        let ratio = estimated_over_actual_error(&plane(9.0, 1.0), &camera, &flat(1 << 14), &flat(samples));
        assert!((0.85..1.15).contains(&ratio), "{samples}: {ratio}");
    }
}

#[test]
fn adaptive_pixels_stop_below_the_noise_threshold() {
    let (world, camera) = scene();
    let noisy = Settings { noise_threshold: Some(0.01), ..settings(2048) };
    let whole = render(&world, &camera, &noisy);
    let good = f32s(&whole, Channel::Error).iter().filter(|&&error| error <= 0.01).count();
    assert!(good as f64 > 0.95 * (24.0 * 16.0), "{good}");
    assert_eq!(whole.notices[0].code, NoticeCode::SamplesUsed);
    for threads in [1, 3] {
        let frame = render(&world, &camera, &Settings { threads: Some(threads), ..noisy.clone() });
        assert_eq!(bits(&frame), bits(&whole));
    }
    let part = render(&world, &camera, &Settings { region: Some([5, 3, 9, 7]), ..noisy });
    let (whole, part) = (f32s(&whole, Channel::Color), f32s(&part, Channel::Color));
    for y in 0..7 {
        for x in 0..9 {
            let (i, j) = ((y + 3) * 24 + x + 5, y * 9 + x);
            assert_eq!(whole[3 * i..3 * i + 3], part[3 * j..3 * j + 3]);
        }
    }
}

#[test]
fn time_limited_images_can_be_reproduced() {
    // The texture filter (below 16 samples), the scene (flattened from some number of samples on) and the single ray
    // through the centre depend on the number of samples.
    let (still, camera) = scene();
    let mut checkered = still.clone();
    add_squares(&mut checkered);
    for world in [still, checkered] {
        let start = std::time::Instant::now();
        render(&world, &camera, &settings(2));
        let each = start.elapsed().as_secs_f64() / 2.0;
        for share in [0.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0, 9.0, 20.0, 60.0] {
            let timed = Settings { time_limit: Some((each * share).max(1e-9)), ..settings(1 << 14) };
            let frame = render(&world, &camera, &timed);
            let samples: u32 = frame.notices[0].message.split(' ').next().unwrap().parse().unwrap();
            assert!(share > 0.0 || samples == 1, "{samples}");
            let again = render(&world, &camera, &settings(samples));
            assert_eq!(bits(&frame), bits(&again), "{samples} samples");
        }
    }
}

#[test]
fn error_of_one_sample_is_infinite() {
    let (world, camera) = scene();
    let frame = render(&world, &camera, &settings(1));
    assert!(f32s(&frame, Channel::Error).iter().all(|error| *error == f32::INFINITY));
}

#[test]
fn time_slices_of_untextured_worlds_repeat_no_sample() {
    // Units of work are samples of tiles. Below 16 samples textures have a different filter, so those samples are
    // discarded.
    let (mut textured, (_, camera)) = (World::default(), scene());
    add_squares(&mut textured);
    for (world, is_once) in [(plane(9.0, 0.5), true), (textured, false)] {
        let settings = Settings { channels: vec![Channel::Color], threads: Some(1), ..settings(32) };
        let (world, prepared) = (Arc::new(world.clone()), Arc::new(prepare(&world)));
        let done = |slices: &[u32]| {
            let mut picture = Progressive::new(world.clone(), prepared.clone(), &camera, settings.clone()).unwrap();
            let control = Control::new();
            slices.iter().for_each(|&until| picture.add(until, None, &control).unwrap());
            control.done()
        };
        assert_eq!(done(&[2, 4, 16, 32]) == done(&[32]), is_once);
    }
}
