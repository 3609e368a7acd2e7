//! Frames have the same bytes however the work is divided.

use crate::common::*;
use glam::DVec3;
use raycam_render::{Channel, Control, Filter, Frame, Integrator, PreparedWorld, RenderError, Settings};

fn scene() -> (PreparedWorld, raycam_scene::Camera, Settings) {
    let camera = look_at(DVec3::new(1.0, -6.0, 3.0), DVec3::new(0.0, 0.0, 0.7), 40.0, [101, 75]);
    let settings = Settings {
        integrator: Integrator::Direct,
        samples: 3,
        filter: Filter::BlackmanHarris,
        seed: 7,
        channels: all_channels(),
        ambient_occlusion: Some(2.0),
        ..Settings::default()
    };
    (prepare(&still_life()), camera, settings)
}

#[test]
fn number_of_threads_does_not_change_bytes() {
    let (world, camera, settings) = scene();
    let with = |threads| {
        let settings = Settings { threads, ..settings.clone() };
        bits(&raycam_render::render(&world, &camera, &settings, &Control::new()).unwrap())
    };
    let one = with(Some(1));
    for threads in [Some(2), Some(3), Some(8), None] {
        assert_eq!(one, with(threads), "{threads:?}");
    }
    let built = PreparedWorld::new(&still_life(), None, Some(1), &Control::new()).unwrap();
    let frame = raycam_render::render(&built, &camera, &settings, &Control::new()).unwrap();
    assert_eq!(one, bits(&frame), "built by one thread");
}

#[test]
fn merged_regions_equal_the_whole_frame() {
    let (world, camera, settings) = scene();
    let part = |region| {
        let settings = Settings { region, ..settings.clone() };
        raycam_render::render(&world, &camera, &settings, &Control::new()).unwrap()
    };
    let whole = part(None);
    assert_eq!((whole.size, whole.region), ([101, 75], [0, 0, 101, 75]));
    let regions = [[0, 0, 37, 41], [37, 0, 64, 41], [0, 41, 101, 1], [0, 42, 101, 33]];
    for order in [[0, 1, 2, 3], [3, 1, 0, 2]] {
        let parts = order.map(|i: usize| part(Some(regions[i])));
        let merged = Frame::merge(parts.into()).unwrap();
        assert_eq!(merged.region, whole.region);
        assert_eq!(bits(&merged), bits(&whole));
    }
    let inner = Frame::merge(vec![part(Some([5, 6, 7, 8])), part(Some([12, 6, 3, 8]))]).unwrap();
    assert_eq!(bits(&inner), bits(&part(Some([5, 6, 10, 8]))));
}

#[test]
fn parts_of_the_wrong_size_are_refused() {
    let (world, camera, _) = scene();
    let part = |region, channel| {
        let settings = Settings { channels: vec![channel], region: Some(region), ..Settings::default() };
        raycam_render::render(&world, &camera, &settings, &Control::new()).unwrap()
    };
    let refused = |parts: Vec<Frame>, word: &str| match Frame::merge(parts) {
        Err(RenderError::Settings(message)) => assert!(message.contains(word), "{message}"),
        other => panic!("{other:?}"),
    };
    let (left, right) = ([0, 0, 8, 8], [8, 0, 8, 8]);
    refused(vec![], "no frames");
    refused(vec![part(left, Channel::Depth), part(right, Channel::Color)], "channels");
    refused(vec![part(left, Channel::Depth), part(left, Channel::Depth)], "overlap");
    refused(vec![part(left, Channel::Depth), part([9, 0, 8, 8], Channel::Depth)], "gaps");
    let mut other = part(right, Channel::Depth);
    other.size = [16, 8];
    refused(vec![part(left, Channel::Depth), other], "size");
    let mut short = part(right, Channel::Depth);
    short.region = [8, 0, 9, 8];
    refused(vec![part(left, Channel::Depth), short], "region");
}

#[test]
fn seeds_and_frame_numbers_change_only_the_noise() {
    let (world, camera, mut settings) = scene();
    // To estimate the error, samples come from several different sequences.
    settings.channels.retain(|&channel| channel != Channel::Error);
    let of = |seed, frame| {
        let settings = Settings { seed, frame, ..settings.clone() };
        raycam_render::render(&world, &camera, &settings, &Control::new()).unwrap()
    };
    let base = of(7, 0);
    for other in [of(8, 0), of(7, 1)] {
        assert_ne!(f32s(&base, Channel::Color), f32s(&other, Channel::Color));
        assert_eq!(i32s(&base, Channel::Triangle), i32s(&other, Channel::Triangle));
    }
    // Requesting fewer channels does not change the remaining ones.
    let settings = Settings { channels: vec![Channel::Color], ..settings };
    let color = raycam_render::render(&world, &camera, &settings, &Control::new()).unwrap();
    assert_eq!(f32s(&base, Channel::Color), f32s(&color, Channel::Color));
}

#[test]
fn settings_with_an_empty_region_or_no_channels_are_refused() {
    let (world, camera, settings) = scene();
    let refused =
        |settings: Settings, word: &str| match raycam_render::render(&world, &camera, &settings, &Control::new()) {
            Err(RenderError::Settings(message)) => assert!(message.contains(word), "{message}"),
            other => panic!("{other:?}"),
        };
    let base = || settings.clone();
    refused(Settings { channels: vec![], ..base() }, "channels is empty");
    let twice = vec![Channel::Depth, Channel::Color, Channel::Depth];
    refused(Settings { channels: twice, ..base() }, "contains \"depth\" twice");
    for region in [[0, 0, 102, 1], [100, 74, 1, 2], [3, 3, 0, 4], [u32::MAX, 0, u32::MAX, 1]] {
        refused(Settings { region: Some(region), ..base() }, "101 x 75");
    }
    for threads in [0, 100_000] {
        refused(Settings { threads: Some(threads), ..base() }, "threads");
    }
}

#[test]
fn images_beyond_memory_are_refused() {
    let (world, _, _) = scene();
    let camera = look_at(DVec3::new(0.0, -5.0, 1.0), DVec3::ZERO, 40.0, [16384, 16384]);
    let settings = Settings { channels: all_channels(), ..Settings::default() };
    let refused = raycam_render::render(&world, &camera, &settings, &Control::new());
    assert!(matches!(refused, Err(RenderError::TooLarge { .. })), "{refused:?}");
}

#[test]
fn rendering_reports_progress_and_stops_on_cancellation() {
    let (world, camera, settings) = scene();
    let control = Control::new();
    raycam_render::render(&world, &camera, &settings, &control).unwrap();
    assert!(control.total() > 0);
    assert_eq!(control.done(), control.total());
    control.cancel();
    let stopped = raycam_render::render(&world, &camera, &settings, &control);
    assert_eq!(stopped.unwrap_err(), RenderError::Cancelled);
    let stopped = PreparedWorld::new(&still_life(), None, None, &control);
    assert_eq!(stopped.unwrap_err(), RenderError::Cancelled);
    // Cancellation during a render that would take far longer than the test waits.
    let control = Control::new();
    let settings = Settings { samples: 1 << 20, ..settings };
    std::thread::scope(|scope| {
        let work = scope.spawn(|| raycam_render::render(&world, &camera, &settings, &control));
        while control.done() == 0 {
            std::thread::yield_now();
        }
        control.cancel();
        assert_eq!(work.join().unwrap().unwrap_err(), RenderError::Cancelled);
    });
}
