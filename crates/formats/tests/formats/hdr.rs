use std::path::Path;

use raycam_formats::{Budget, ColorUse, decode_image, hdr};
use raycam_scene::Texels;

#[test]
fn a_picture_comes_back_within_its_precision() {
    let rgb: Vec<f32> = (0..37 * 9 * 3)
        .map(|i| (i as f32 * 0.7).sin().abs() * 10_f32.powi(i % 7 - 3))
        .collect();
    let file = hdr::encode([37, 9], &rgb).unwrap();
    let mut budget = Budget::default();
    let image = decode_image(
        &file,
        Path::new("a.hdr"),
        ColorUse::Color,
        &mut budget,
        &mut Vec::new(),
    );
    let image = image.unwrap();
    assert_eq!(image.size, [37, 9]);
    let Texels::Float(texels) = image.texels else {
        panic!("not floats");
    };
    for (found, expected) in texels.iter().zip(rgb.as_chunks::<3>().0) {
        let largest = expected.iter().fold(0.0_f32, |a, &b| a.max(b));
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() <= largest / 128.0, "{found:?} {expected:?}");
        }
        assert_eq!(found[3], 1.0);
    }
}

#[test]
fn what_the_format_cannot_say_is_refused() {
    let error = |size, rgb: &[f32]| hdr::encode(size, rgb).unwrap_err().to_string();
    let expected = "HDR: 3 values, expected 2 x 1 x 3 and more than 0";
    assert_eq!(error([2, 1], &[0.0; 3]), expected);
    for value in [-1.0, f32::NAN, f32::INFINITY] {
        let expected = format!("HDR: a value of {value}, expected 0 or more and finite");
        assert_eq!(error([1, 1], &[1.0, value, 1.0]), expected);
    }
}
