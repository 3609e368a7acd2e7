//! Images whose late samples are guided through gaps.

use std::sync::Arc;

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{
    Channel, Control, Frame, Integrator, OutputPlane, PlaneData, PreparedWorld, Progressive, Settings,
};
use raycam_scene::camera::intrinsics_from_fov;
use raycam_scene::mesh::primitive;
use raycam_scene::{Camera, Light, Material, PixelCenter, World};

/// Images with this many pixels per side have four unguided samples per pixel; smaller images have thousands.
const SIDE: u32 = 1024;
const REGION: [u32; 4] = [0, 0, 24, 16];

/// A grey room next to a room with a lamp; the wall between the rooms has a slot of this width.
fn rooms(slot: f64) -> World {
    let mut world = World::default();
    let walls = [
        ([1.0, 0.0, 1.0], [4.0, 2.0, 2.0]),
        ([1.0, -0.2 - 0.5 * slot, 1.0], [0.04, 1.6 - slot, 2.0]),
        ([1.0, 0.8, 1.0], [0.04, 0.4, 2.0]),
    ];
    let grey = Material { color: [0.7; 3], ..Material::default() };
    for (at, size) in walls {
        let place = DAffine3::from_translation(at.into()) * DAffine3::from_scale(size.into());
        add(&mut world, primitive::box_([1.0; 3]).unwrap(), grey.clone(), place);
    }
    let lamp = Light::Rectangle {
        position: [2.0, 0.0, 1.98],
        u: [0.6, 0.0, 0.0],
        v: [0.0, -0.6, 0.0],
        radiance: [90.0; 3],
        two_sided: false,
    };
    world.add_light(lamp).unwrap();
    world
}

/// Camera of a large image, or of a small image that is as large as [`REGION`]. The pixels of the region have the same
/// rays in both images.
fn camera(is_large: bool) -> Camera {
    let [_, _, width, height] = REGION;
    let k = intrinsics_from_fov(62.0, [width, height], PixelCenter::Integer).unwrap();
    let size = if is_large { [SIDE, SIDE] } else { [width, height] };
    let (eye, target) = (DVec3::new(-0.9, -0.9, 1.4), DVec3::new(0.3, 0.4, 0.6));
    Camera::look_at(eye, target, DVec3::Z, k, size, PixelCenter::Integer).unwrap()
}

fn settings(samples: u32) -> Settings {
    let channels = vec![Channel::Color, Channel::Error];
    let max_depth = Some(16);
    Settings { integrator: Integrator::Path, samples, max_depth, region: Some(REGION), channels, ..Settings::default() }
}

fn picture(world: &PreparedWorld, is_large: bool, settings: &Settings) -> Frame {
    raycam_render::render(world, &camera(is_large), settings, &Control::new()).unwrap()
}

#[test]
fn gap_guiding_keeps_the_light_and_reduces_noise() {
    let world = prepare(&rooms(0.1));
    let [guided, plain] = [true, false].map(|is_large| {
        let of = |seed| picture(&world, is_large, &Settings { seed, ..settings(128) });
        (0..16).map(|seed| f32s(&of(seed), Channel::Color).to_vec()).collect::<Vec<_>>()
    });
    let all = || guided.iter().chain(&plain);
    let means: Vec<f32> = (0..plain[0].len()).map(|i| all().map(|one| one[i]).sum::<f32>() / 32.0).collect();
    // Each pixel is divided by its mean over all images, because some pixels show the bright room.
    let light = |all: &[Vec<f32>]| -> f64 {
        all.iter().flat_map(|one| one.iter().zip(&means)).map(|(x, m)| f64::from(x / m)).sum()
    };
    let noise = |all: &[Vec<f32>]| -> f64 {
        let apart = |pair: &[Vec<f32>]| -> f64 {
            (0..means.len()).map(|i| f64::from((pair[0][i] - pair[1][i]) / means[i]).powi(2)).sum()
        };
        all.chunks(2).map(apart).sum()
    };
    // The three channels have the same noise, so the variance of their sum is three times the sum of their variances.
    let error = (3.0 * (noise(&guided) + noise(&plain))).sqrt();
    let off = light(&guided) - light(&plain);
    assert!(error < 0.01 * light(&plain) && off.abs() < 4.0 * error, "{off} {error} of {}", light(&plain));
    assert!(noise(&guided) < 0.8 * noise(&plain), "{} {}", noise(&guided), noise(&plain));
}

#[test]
fn samples_are_guided_after_the_first_four_if_there_are_gaps() {
    for (slot, samples, is_guided) in [(0.1, 4, false), (0.1, 5, true), (1.2, 64, false)] {
        let world = prepare(&rooms(slot));
        let [large, small] = [true, false].map(|is_large| picture(&world, is_large, &settings(samples)));
        assert_eq!(bits(&large) != bits(&small), is_guided, "{slot} {samples}");
    }
}

#[test]
fn gap_guiding_does_not_depend_on_threads_slices_or_regions() {
    let world = Arc::new(rooms(0.1));
    let ten = Settings { threads: Some(1), ..settings(10) };
    let prepared = Arc::new(prepare(&world));
    let whole = picture(&prepared, true, &ten);
    let threads = Settings { threads: Some(3), ..ten.clone() };
    assert_eq!(bits(&picture(&prepare(&world), true, &threads)), bits(&whole));
    let part = picture(&prepared, true, &Settings { region: Some([0, 3, 24, 5]), ..ten.clone() });
    let row = 24 * 3;
    assert_eq!(f32s(&part, Channel::Color), &f32s(&whole, Channel::Color)[3 * row..8 * row]);
    let mut slices = Progressive::new(world, prepared.clone(), &camera(true), ten.clone()).unwrap();
    for until in [3, 7, 10] {
        slices.add(until, None, &Control::new()).unwrap();
    }
    let channels = [Channel::Color, Channel::Error];
    let [mut color, mut error] = channels.map(|channel| vec![0.0; f32s(&whole, channel).len()]);
    let plane = |channel, data| OutputPlane { channel, values: PlaneData::F32(data), zero: true };
    slices.develop(vec![plane(Channel::Color, &mut color), plane(Channel::Error, &mut error)]).unwrap();
    assert_eq!([&*color, &*error], channels.map(|channel| f32s(&whole, channel)));
    // Pixels that stop at the noise threshold have the same samples as pixels of an image with fewer samples.
    let stopped = picture(&prepared, true, &Settings { noise_threshold: Some(1e9), samples: 256, ..ten.clone() });
    let short = picture(&prepared, true, &Settings { samples: 64, ..ten });
    assert_eq!(f32s(&stopped, Channel::Color), f32s(&short, Channel::Color));
}
