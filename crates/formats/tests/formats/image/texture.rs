use std::fs;
use std::path::Path;
use std::process::Command;

use raycam_formats::encode::png::{Samples, encode};
use raycam_formats::{Budget, FormatError, decode_texture, read_texture};
use raycam_scene::{Notice, NoticeCode, Texels, Texture};

use crate::support::{data, file, folder, message, rgb};

fn read(name: &str, bytes: impl AsRef<[u8]>) -> (Texture, Vec<Notice>) {
    read_texture(&file(name, bytes), &Budget::default()).unwrap()
}

#[test]
fn texels_have_the_values_stored_in_the_file() {
    let pixels: Vec<u8> = (0..3 * 2 * 3).map(|i| (i * 13) as u8).collect();
    let (texture, notices) = read("a.png", encode([3, 2], 3, Samples::U8(&pixels)).unwrap());
    assert_eq!((texture.image.size, rgb(&texture).as_flattened()), ([3, 2], &pixels[..]));
    assert!(notices.is_empty(), "{notices:?}");
    // The format is recognised by the content, for any extension.
    assert_eq!(rgb(&read("a.jpg", encode([3, 2], 3, Samples::U8(&pixels)).unwrap()).0), rgb(&texture));
}

#[test]
fn grey_is_expanded_and_16_bits_are_kept() {
    let (texture, _) = read("a.png", encode([2, 1], 1, Samples::U8(&[7, 200])).unwrap());
    assert_eq!(rgb(&texture), [[7; 3], [200; 3]]);
    let deep = [0, 32896, 65535];
    let (texture, _) = read("a.png", encode([1, 1], 3, Samples::U16(&deep)).unwrap());
    // The expected value: 65535 ((32896 / 65535 + 0.055) / 1.055)^2.4 = 14146.4 (IEC 61966-2-1).
    let expected = Texels::Linear16(vec![[0, 14146, 65535, 65535]]);
    assert_eq!(texture.image.texels, expected);
}

#[test]
fn ignored_image_properties_cause_notices() {
    let (texture, notices) = read("a.png", encode([1, 1], 4, Samples::U8(&[9, 8, 7, 6])).unwrap());
    assert_eq!(rgb(&texture), [[9, 8, 7]]);
    assert_eq!(notices[0].code, NoticeCode::UnusedAlpha);
    assert!(notices[0].to_string().contains("a.png"), "{notices:?}");
    let (_, notices) = read("a.png", encode([1, 1], 2, Samples::U8(&[9, 255])).unwrap());
    assert!(notices.is_empty(), "{notices:?}");
    // A gAMA chunk with the value 1.0 replaces the sRGB chunk.
    let png = encode([1, 1], 1, Samples::U8(&[9])).unwrap();
    let with = |chunk: &[u8]| {
        let mut file = png[..33].to_vec();
        file.extend((chunk.len() as u32 - 4).to_be_bytes());
        file.extend(chunk);
        file.extend(crc32(chunk).to_be_bytes());
        let data = png.windows(4).position(|w| w == b"IDAT").unwrap() - 4;
        file.extend(&png[data..]);
        file
    };
    let linear = with(b"gAMA\0\x01\x86\xa0");
    let (texture, notices) = read("a.png", linear);
    assert_eq!(rgb(&texture), [[9; 3]]);
    assert!(notices[0].to_string().contains("PNG gamma chunk (1) is ignored"), "{notices:?}");
    // White point and primaries of Adobe RGB, and of sRGB.
    for (green, count) in [([21000_u32, 71000], 1), ([30000, 60000], 0)] {
        let points = [[31270, 32900], [64000, 33000], green, [15000, 6000]];
        let numbers = points.into_iter().flatten().flat_map(u32::to_be_bytes);
        let chunk: Vec<u8> = b"cHRM".iter().copied().chain(numbers).collect();
        let (_, notices) = read("a.png", with(&chunk));
        assert_eq!(notices.len(), count, "{notices:?}");
        assert!(notices.iter().all(|n| n.to_string().contains("'s primaries")));
    }
}

#[test]
fn too_many_pixels_are_refused_before_decoding() {
    // A file of a few bytes declares 65535 x 65535 pixels.
    let png = encode([1, 1], 1, Samples::U8(&[0])).unwrap();
    let mut bomb = png.clone();
    bomb[16..24].copy_from_slice(&[0, 0, 255, 255, 0, 0, 255, 255]);
    let crc = crc32(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    let path = file("a.png", bomb);
    let error = read_texture(&path, &Budget::default()).unwrap_err();
    assert!(matches!(error, FormatError::Budget { amount: 4_294_836_225, .. }), "{error}");
    let path = file("a.png", encode([4, 4], 1, Samples::U8(&[0; 16])).unwrap());
    let error = read_texture(&path, &Budget { pixels: 15, ..Budget::default() }).unwrap_err();
    assert_eq!(
        message(error, &path),
        "a.png: 16 pixels exceed the remaining budget of 15; use smaller files, or set texture_memory if textures are \
         large"
    );
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

#[test]
fn damaged_images_return_errors() {
    for kind in ["png", "jpeg"] {
        for entry in fs::read_dir(data(kind)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let read = read_texture(&path, &Budget::default());
            let fine = read.as_ref().is_ok_and(|(texture, _)| texture.validate().is_ok());
            let told = read.as_ref().is_err_and(|error| error.to_string().contains(&name));
            assert!(fine || told, "{name}: {read:?}");
            assert!(told || !name.starts_with("xc") && !name.starts_with("xd"), "{name} is corrupt");
        }
    }
    let path = file("a.png", "DDS |");
    assert_eq!(
        message(read_texture(&path, &Budget::default()).unwrap_err(), &path),
        "a.png: unknown image format; supported: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF and TGA; the file is \
         a DDS image: convert it to PNG"
    );
}

#[test]
fn truncated_png_files_return_errors() {
    let pixels: Vec<u8> = (0..3 * 64).map(|i| (i * 37) as u8).collect();
    let png = encode([8, 8], 3, Samples::U8(&pixels)).unwrap();
    let decode = |bytes: &[u8]| decode_texture(bytes.to_vec(), Path::new("a.img"), &Budget::default());
    let whole = decode(&png).unwrap().0;
    for length in 0..png.len() {
        let read = decode(&png[..length]);
        assert!(read.is_err() || read.unwrap().0 == whole, "{length}");
    }
    let mut jpeg = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 90);
    image::ImageEncoder::write_image(encoder, &pixels, 8, 8, image::ExtendedColorType::Rgb8).unwrap();
    assert_eq!(decode(&jpeg).unwrap().0.image.size, [8, 8]);
    for length in 0..jpeg.len() {
        assert!(decode(&jpeg[..length]).is_err(), "{length}");
    }
    for at in 0..jpeg.len().min(700) {
        let mut damaged = jpeg.clone();
        damaged[at] ^= 0x55;
        let _ = decode(&damaged);
    }
}

#[test]
fn devices_and_pipes_are_not_read() {
    let pipe = folder().join("a.png");
    if Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()) {
        let error = read_texture(&pipe, &Budget::default()).unwrap_err();
        assert!(error.to_string().ends_with("a device, pipe or socket; expected a regular file"), "{error}");
    }
}
