//! Images for displays: the conversion of a pixel does not depend on its neighbours or on the threads.

use raycam_render::film::display::{srgb8, srgb16};
use raycam_scene::ViewTransform;
use raycam_scene::color::srgb_from_linear;

/// Encodes a value by the sRGB curve (IEC 61966-2-1), in steps from 0 to `top`.
fn steps(v: f32, top: f32) -> u32 {
    (srgb_from_linear(v).clamp(0.0, 1.0) * top).round() as u32
}

#[test]
fn display_of_many_pixels_equals_single_pixels() {
    for count in [0, 1, 5, 16_384, 16_385, 100_003] {
        let value = |i: usize| match i % 1000 {
            0 => f32::NAN,
            1 => -0.5,
            2 => f32::INFINITY,
            _ => (i as f32 * 0.001).sin().powi(3) * 1.2,
        };
        let pixels: Vec<_> = (0..count).map(|i| [value(i), value(7 * i), value(13 * i)]).collect();
        for (scale, view) in [(1.0, ViewTransform::Standard), (2.0, ViewTransform::Standard), (1.0, ViewTransform::Agx)]
        {
            let shown = |rgb: &[f32; 3]| view.apply(rgb.map(|v| v * scale));
            let bytes: Vec<u32> = srgb8(&pixels, scale, view).unwrap().into_iter().map(u32::from).collect();
            let shorts: Vec<u32> = srgb16(&pixels, scale, view).unwrap().into_iter().map(u32::from).collect();
            let of =
                |top: f32| -> Vec<u32> { pixels.iter().flat_map(|rgb| shown(rgb).map(|v| steps(v, top))).collect() };
            assert!(bytes == of(255.0), "{count} {scale} {view:?}");
            assert!(shorts == of(65535.0), "{count} {scale} {view:?}");
        }
    }
}
