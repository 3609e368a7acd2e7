use std::path::Path;

use ::image::codecs::hdr::HdrDecoder;
use raycam_formats::encode::hdr;
use raycam_formats::{Budget, ColorUse, decode_image};
use raycam_scene::{NoticeCode, Texels};

use crate::image::damage_is_found_before;

#[test]
fn damaged_hdr_is_refused_before_pixels_are_stored() {
    let message = "truncated, or its runs are longer than a line";
    damage_is_found_before(".hdr", message, |bytes| Ok(Box::new(HdrDecoder::new(bytes)?)));
}

#[test]
fn hdr_images_round_trip_within_their_precision() {
    let rgb: Vec<f32> = (0..37 * 9 * 3).map(|i| (i as f32 * 0.7).sin().abs() * 10_f32.powi(i % 7 - 3)).collect();
    let file = hdr::encode([37, 9], &rgb).unwrap();
    let mut budget = Budget::default();
    let image = decode_image(&file, Path::new("a.hdr"), ColorUse::Color, &mut budget, &mut Vec::new());
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
fn values_that_hdr_cannot_store_are_refused() {
    let error = |size, rgb: &[f32]| hdr::encode(size, rgb).unwrap_err().to_string();
    let expected = "HDR: 3 values; expected 2 x 1 x 3 and more than 0";
    assert_eq!(error([2, 1], &[0.0; 3]), expected);
    for value in [-1.0, f32::NAN, f32::INFINITY] {
        let expected = format!("HDR: a value of {value}; expected a finite number >= 0");
        assert_eq!(error([1, 1], &[1.0, value, 1.0]), expected);
    }
}

/// File of these scanlines, each with plain texels (no runs), with a resolution string.
fn scanlines(resolution: &str, lines: &[Vec<[u8; 4]>]) -> Vec<u8> {
    let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{resolution}\n");
    let texels = lines.iter().flatten().flatten();
    header.bytes().chain(texels.copied()).collect()
}

#[test]
fn all_eight_orientations_give_the_same_image() {
    // Each texel encodes its position: red is its column, green its row, both plus 3; an exponent of 136 is a factor of
    // 1.
    let (columns, rows) = (5_u8, 3_u8);
    let texel = |x: u8, y: u8| [x + 3, y + 3, 77, 136];
    // The expected order follows from the text of the specification, and not from the reader.
    let rightwards: Vec<u8> = (0..columns).collect();
    let leftwards: Vec<u8> = rightwards.iter().rev().copied().collect();
    let downwards: Vec<u8> = (0..rows).collect();
    let upwards: Vec<u8> = downwards.iter().rev().copied().collect();
    let by_rows = |ys: &[u8], xs: &[u8]| -> Vec<Vec<[u8; 4]>> {
        let line = |&y: &u8| xs.iter().map(|&x| texel(x, y)).collect();
        ys.iter().map(line).collect()
    };
    let by_columns = |xs: &[u8], ys: &[u8]| -> Vec<Vec<[u8; 4]>> {
        let line = |&x: &u8| ys.iter().map(|&y| texel(x, y)).collect();
        xs.iter().map(line).collect()
    };
    let files = [
        ("-Y 3 +X 5", by_rows(&downwards, &rightwards)),
        ("-Y 3 -X 5", by_rows(&downwards, &leftwards)),
        ("+Y 3 +X 5", by_rows(&upwards, &rightwards)),
        ("+Y 3 -X 5", by_rows(&upwards, &leftwards)),
        ("+X 5 -Y 3", by_columns(&rightwards, &downwards)),
        ("+X 5 +Y 3", by_columns(&rightwards, &upwards)),
        ("-X 5 -Y 3", by_columns(&leftwards, &downwards)),
        ("-X 5 +Y 3", by_columns(&leftwards, &upwards)),
    ];
    for (resolution, lines) in files {
        let file = scanlines(resolution, &lines);
        let mut budget = Budget::default();
        let path = Path::new("a.hdr");
        let mut notices = Vec::new();
        let image = decode_image(&file, path, ColorUse::Color, &mut budget, &mut notices);
        let image = image.unwrap();
        assert_eq!(image.size, [5, 3], "{resolution}");
        assert!(notices.is_empty());
        let Texels::Float(texels) = image.texels else {
            panic!("not floats");
        };
        for y in 0..rows {
            for x in 0..columns {
                let expected = [f32::from(x + 3), f32::from(y + 3), 77.0, 1.0];
                let found = texels[usize::from(y) * 5 + usize::from(x)];
                assert_eq!(found, expected, "{resolution} at {x}, {y}");
            }
        }
    }
}

#[test]
fn invalid_resolution_strings_are_refused() {
    for resolution in ["+Y 3 +Y 5", "-X 5 +X 3", "3 5", "-Y 3 -X", "+Z 3 +X 5", "+Y -3 +X 5"] {
        let file = scanlines(resolution, &[vec![[1, 2, 3, 136]; 15]]);
        let mut budget = Budget::default();
        let path = Path::new("a.hdr");
        let image = decode_image(&file, path, ColorUse::Color, &mut budget, &mut Vec::new());
        let error = image.unwrap_err().to_string();
        assert!(error.starts_with("a.hdr: "), "{resolution}: {error}");
    }
}

#[test]
fn values_are_divided_by_every_exposure() {
    let mut budget = Budget::default();
    let mut read = |lines: &str| {
        let header = format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n");
        let file = [header.as_bytes(), &[128, 64, 32, 131]].concat();
        let (path, mut notices) = (Path::new("a.hdr"), Vec::new());
        decode_image(&file, path, ColorUse::Color, &mut budget, &mut notices)
    };
    for (lines, factor) in [("", 1.0), ("EXPOSURE=2\n", 0.5), ("EXPOSURE=2\nEXPOSURE= 0.5e1\n", 0.1)] {
        let Texels::Float(texels) = read(lines).unwrap().texels else {
            panic!("not floats");
        };
        let expected = [4.0, 2.0, 1.0].map(|v: f32| v * factor);
        let [r, g, b, a] = texels[0];
        assert!((0..3).all(|i| ([r, g, b][i] - expected[i]).abs() < 1e-6), "{texels:?}");
        assert_eq!(a, 1.0);
    }
    for exposure in ["0", "-1", "nan", "1e-45"] {
        let error = read(&format!("EXPOSURE={exposure}\n")).unwrap_err().to_string();
        assert!(error.contains("EXPOSURE"), "{error}");
    }
}

#[test]
fn unsupported_header_values_are_reported() {
    let notices = |line: &str| {
        let header = format!("#?RADIANCE\n{line}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n");
        let file = [header.as_bytes(), &[128, 64, 32, 131]].concat();
        let (path, mut notices) = (Path::new("a.hdr"), Vec::new());
        let budget = &mut Budget::default();
        decode_image(&file, path, ColorUse::Color, budget, &mut notices).unwrap();
        notices
    };
    for line in ["COLORCORR=1 1 0.5", "PIXASPECT=2", "PRIMARIES=0.7 0.3 0.2 0.7 0.15 0.06 0.3127 0.329"] {
        let [notice] = &notices(line)[..] else {
            panic!("{line}");
        };
        let (key, value) = line.split_once('=').unwrap();
        assert_eq!(notice.code, NoticeCode::IgnoredColorProfile);
        assert!(notice.to_string().contains(key) && notice.to_string().contains(value), "{notice}");
    }
    for line in ["COLORCORR=1 1 1", "PIXASPECT=1", "PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333"] {
        assert_eq!(notices(line), [], "{line}");
    }
}
