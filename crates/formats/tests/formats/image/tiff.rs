use std::fs;

use raycam_formats::ColorUse;

use super::read;
use crate::support::data;

/// Files of 7 x 5 pixels in several layouts, which `tests/formats/test_tiff.py` compares with tifffile and Pillow.
fn files() -> Vec<(String, Vec<u8>)> {
    let mut paths: Vec<_> = fs::read_dir(data("tiff")).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 15);
    let name = |path: &std::path::Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    paths.iter().map(|path| (name(path), fs::read(path).unwrap())).collect()
}

#[test]
fn truncated_tiff_files_return_an_error_or_the_complete_image() {
    for (name, file) in files() {
        let whole = read(&name, &file, ColorUse::Data).unwrap_or_else(|error| panic!("{error}")).0;
        for length in 0..file.len() {
            if let Ok((image, _)) = read(&name, &file[..length], ColorUse::Data) {
                assert_eq!(image, whole, "{name}: {length} of {}", file.len());
            }
        }
    }
}

#[test]
fn damaged_tiff_files_return_an_error_or_an_image() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below
    };
    for (name, file) in files() {
        for round in 0..3 * file.len() {
            let mut damaged = file.clone();
            damaged[round % file.len()] = random(256) as u8;
            for _ in 0..random(3) {
                let at = random(damaged.len());
                damaged[at] = [0, 1, 2, 3, 4, 8, 16, 0x7f, 0xff][random(9)];
            }
            if let Ok((image, _)) = read(&name, &damaged, ColorUse::Color) {
                assert_eq!(image.texels.len(), image.size[0] as usize * image.size[1] as usize, "{name}: {round}");
            }
        }
    }
}
