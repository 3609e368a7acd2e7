mod bmp;
mod hdr;
mod jpeg;
mod normals_from_height;
mod texture;
mod tga;
mod tiff;
mod webp;

use std::fs;
use std::path::Path;

use raycam_formats::{Budget, ColorUse, FormatError, decode_image};
use raycam_scene::color::linear_from_srgb;
use raycam_scene::{Image, Notice, NoticeCode, Texels};

use crate::support::data;

/// A small image of every format, and its reference. The reference is: for PNG, the written values; for JPEG, WebP, BMP
/// and TGA, the result of Pillow; for KTX2, of Basis Universal; for EXR, of OpenEXR; for HDR, of OpenCV.
pub struct Case {
    pub name: String,
    pub file: Vec<u8>,
    size: [u32; 2],
    /// Eight or sixteen bits per channel, or floats.
    kind: String,
    expected: Vec<f32>,
}

pub fn cases() -> Vec<Case> {
    let all = fs::read(data("images.cases")).unwrap();
    let mut rest = &all[..];
    let mut cases = Vec::new();
    while let Some(end) = rest.iter().position(|&b| b == b'\n') {
        let line = std::str::from_utf8(&rest[..end]).unwrap();
        let [name, columns, rows, kind, length] = line.split(' ').collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        let size: [u32; 2] = [columns, rows].map(|side| side.parse().unwrap());
        let channels = 4 * (size[0] * size[1]) as usize;
        let (file, after) = rest[end + 1..].split_at(length.parse().unwrap());
        let width = match kind {
            "u8" => 1,
            "u16" => 2,
            _ => 4,
        };
        let (values, after) = after.split_at(width * channels);
        let expected = match kind {
            "u8" => values.iter().map(|&v| v.into()).collect(),
            "u16" => (values.as_chunks().0.iter()).map(|&v| u16::from_le_bytes(v).into()).collect(),
            _ => (values.as_chunks().0.iter()).map(|&v| f32::from_le_bytes(v)).collect(),
        };
        cases.push(Case { name: name.into(), file: file.into(), size, kind: kind.into(), expected });
        rest = after;
    }
    cases
}

pub fn read(name: &str, bytes: &[u8], color_use: ColorUse) -> Result<(Image, Vec<Notice>), FormatError> {
    let mut notices = Vec::new();
    let mut budget = Budget::default();
    let image = decode_image(bytes, Path::new(name), color_use, &mut budget, &mut notices)?;
    Ok((image, notices))
}

/// Tests truncated files of a format, and copies with a flipped bit whose header the decoder accepts. If the decoder
/// accepts a file, the reader must accept it too; otherwise, the reader must reject the file with `message` before the
/// decoder starts to decode pixels.
pub fn damage_is_found_before(
    extension: &str,
    message: &str,
    decoder: impl Fn(&[u8]) -> ::image::ImageResult<Box<dyn ::image::ImageDecoder + '_>>,
) {
    let (mut good, mut bad) = (0, 0);
    for Case { name, file, .. } in cases() {
        if !name.ends_with(extension) {
            continue;
        }
        let beginnings = (0..file.len()).map(|length| file[..length].to_vec());
        let flipped = (0..8 * file.len()).map(|bit| {
            let mut damaged = file.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            damaged
        });
        for damaged in beginnings.chain(flipped) {
            let Ok(decoder) = decoder(&damaged) else {
                continue;
            };
            let (columns, rows) = decoder.dimensions();
            if u64::from(columns) * u64::from(rows) > 1 << 16 {
                continue;
            }
            let expected = ::image::DynamicImage::from_decoder(Decoder(decoder));
            let found = read(&name, &damaged, ColorUse::Color).map_err(|e| e.to_string());
            match (found, expected) {
                (Ok(_), Ok(_)) => good += 1,
                (Err(error), Err(_)) if error.ends_with(message) => bad += 1,
                // The reader may report a fault that it detects before the decoder examines the pixels.
                (Err(error), Err(late)) if !error.contains(&late.to_string()) => {}
                (Err(error), Ok(_)) if !error.ends_with(message) => {}
                (found, _) => panic!("{name}: {:?} {damaged:02x?}", found.map(|_| ())),
            }
        }
    }
    assert!(good > 100 && bad > 100, "{good} {bad}");
}

/// A boxed decoder as a type that implements `ImageDecoder`.
struct Decoder<'a>(Box<dyn ::image::ImageDecoder + 'a>);

impl ::image::ImageDecoder for Decoder<'_> {
    fn dimensions(&self) -> (u32, u32) {
        self.0.dimensions()
    }

    fn color_type(&self) -> ::image::ColorType {
        self.0.color_type()
    }

    fn read_image(self, buffer: &mut [u8]) -> ::image::ImageResult<()> {
        self.0.read_image_boxed(buffer)
    }

    fn read_image_boxed(self: Box<Self>, buffer: &mut [u8]) -> ::image::ImageResult<()> {
        self.0.read_image_boxed(buffer)
    }
}

fn values(texels: &Texels) -> Vec<f32> {
    match texels {
        Texels::Srgb8(t) | Texels::Linear8(t) => t.as_flattened().iter().map(|&v| v.into()).collect(),
        Texels::Linear16(t) => t.as_flattened().iter().map(|&v| v.into()).collect(),
        Texels::Float(t) => t.as_flattened().to_vec(),
        Texels::Paged(_) => panic!("decoders must return texels in memory"),
    }
}

#[test]
fn decoded_images_match_other_readers() {
    let cases = cases();
    assert!(cases.len() > 80, "{}", cases.len());
    for case in cases {
        let (image, notices) = read(&case.name, &case.file, ColorUse::Data).unwrap();
        assert_eq!(image.size, case.size, "{}", case.name);
        assert_eq!(image.name, case.name);
        let kind = match &image.texels {
            Texels::Srgb8(_) | Texels::Linear8(_) => "u8",
            Texels::Linear16(_) => "u16",
            Texels::Float(_) => "f32",
            Texels::Paged(_) => "paged",
        };
        assert_eq!(kind, case.kind, "{}", case.name);
        // The formats JPEG and lossy WebP do not define upsampling and rounding exactly.
        let tolerance = match &case.name[..] {
            "420.jpg" | "422.jpg" | "progressive.jpg" | "restart.jpg" => 6.0,
            name if name.ends_with(".jpg") => 3.0,
            name if name.starts_with("lossy") => 4.0,
            // Five bits are converted to eight: Pillow sometimes rounds up although the nearest value is below.
            "five.tga" | "565.bmp" => 1.0,
            _ => 0.0,
        };
        let found = values(&image.texels);
        let mut expected = case.expected;
        if case.name.ends_with(".exr") {
            // Colours in EXR files are premultiplied by alpha.
            for texel in expected.as_chunks_mut::<4>().0 {
                let alpha = texel[3];
                texel[..3].iter_mut().filter(|_| alpha > 0.0).for_each(|color| *color /= alpha);
            }
        }
        assert_eq!(found.len(), expected.len(), "{}", case.name);
        for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
            let rounding = if kind == "f32" { 1e-6 * b.abs() } else { 0.0 };
            assert!((a - b).abs() <= tolerance + rounding, "{}, value {i}: {a} {b}", case.name);
        }
        let marked = case.name.ends_with(".ktx2") && kind == "u8";
        assert!(notices.is_empty() || marked, "{}: {notices:?}", case.name);
    }
}

#[test]
fn colours_are_read_as_srgb_and_data_as_linear() {
    for case in cases() {
        let (color, _) = read(&case.name, &case.file, ColorUse::Color).unwrap();
        let (data, _) = read(&case.name, &case.file, ColorUse::Data).unwrap();
        match (&color.texels, &data.texels) {
            (Texels::Srgb8(a), Texels::Linear8(b)) => assert_eq!(a, b, "{}", case.name),
            (Texels::Float(a), Texels::Float(b)) => assert_eq!(a, b, "{}", case.name),
            // KTX2 has no 16-bit sRGB format.
            (Texels::Linear16(a), Texels::Linear16(b)) if case.name.ends_with("ktx2") => {
                assert_eq!(a, b, "{}", case.name);
            }
            (Texels::Linear16(a), Texels::Linear16(b)) => {
                for (a, b) in a.iter().zip(b) {
                    let expected = 65535.0 * linear_from_srgb(f32::from(b[0]) / 65535.0);
                    assert!((f32::from(a[0]) - expected).abs() <= 0.5, "{}", case.name);
                    assert_eq!(a[3], b[3], "{}", case.name);
                }
            }
            other => panic!("{}: {other:?}", case.name),
        }
    }
}

#[test]
fn ignored_colour_metadata_is_reported() {
    let notices = |name: &str, change: &dyn Fn(&mut Vec<u8>), color_use| {
        let mut file = cases().into_iter().find(|case| case.name == name).unwrap().file;
        change(&mut file);
        read(name, &file, color_use).unwrap().1
    };
    let linear = notices("uastclinear.ktx2", &|_| {}, ColorUse::Color);
    assert_eq!(linear.iter().map(|notice| notice.code).collect::<Vec<_>>(), [NoticeCode::IgnoredKey]);
    assert!(notices("uastc.ktx2", &|_| {}, ColorUse::Color).is_empty());
    // In the last row, the last value of the next-to-last channel becomes an infinity.
    let infinite = |file: &mut Vec<u8>| {
        let at = file.len() - 2 * 21 - 2;
        file[at..at + 2].copy_from_slice(&0x7c00_u16.to_le_bytes());
    };
    let notice = notices("nonehalf.exr", &infinite, ColorUse::Color);
    assert_eq!(notice.iter().map(|notice| notice.code).collect::<Vec<_>>(), [NoticeCode::ReplacedValue]);
}

#[test]
fn pixel_counts_too_large_for_the_file_are_refused() {
    // A file of a few bytes declares a uniform image of 16384 x 8000 pixels.
    let mut bomb = b"#?RADIANCE\n\n-Y 8000 +X 16384\n".to_vec();
    bomb.extend([2, 2, 64, 0, 255, 255]);
    let error = read("a.hdr", &bomb, ColorUse::Color).unwrap_err().to_string();
    let expected = "a.hdr: 16384 x 8000 pixels in 35 bytes, which is too much for a file of this size";
    assert!(error.starts_with(expected), "{error}");
    for case in cases() {
        let pixels = u64::from(case.size[0]) * u64::from(case.size[1]);
        for (left, fits) in [(pixels, true), (pixels - 1, false)] {
            let mut budget = Budget { pixels: left, ..Budget::default() };
            let read = decode_image(&case.file, Path::new(&case.name), ColorUse::Color, &mut budget, &mut Vec::new());
            assert_eq!(read.is_ok(), fits, "{}", case.name);
        }
    }
}

#[test]
fn uniform_images_may_have_short_files() {
    const SIDE: u32 = 6000;
    // All pixels have the same colour, so no code takes a bit.
    let mut webp =
        b"RIFF\x1e\0\0\0WEBPVP8L\x11\0\0\0\x2f____\x07\x50\xbc\x22\x17\xa5\xff\x81\x88\xe8\x7f\0\0\0".to_vec();
    webp[21..25].copy_from_slice(&((SIDE - 1) | (SIDE - 1) << 14).to_le_bytes());
    let mut png = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut png, SIDE, SIDE);
    encoder.set_depth(::png::BitDepth::One);
    encoder.set_compression(::png::Compression::High);
    encoder.set_filter(::png::Filter::NoFilter);
    let bits = vec![0xff; (SIDE.div_ceil(8) * SIDE) as usize];
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&bits).unwrap();
    writer.finish().unwrap();
    assert!(png.len() < 16000 && webp.len() < 50, "{}", png.len());
    for (name, file, color) in [("a.webp", &webp, [200, 120, 40, 255]), ("a.png", &png, [255; 4])] {
        let Texels::Linear8(texels) = read(name, file, ColorUse::Data).unwrap().0.texels else {
            panic!("{name}");
        };
        assert_eq!(texels.len(), (SIDE * SIDE) as usize);
        assert!(texels.iter().all(|&texel| texel == color), "{name}");
    }
    // A file that ends within its data is an error.
    let error = read("a.png", &png[..png.len() - 40], ColorUse::Data).unwrap_err();
    assert!(error.to_string().starts_with("a.png: "), "{error}");
    // A JPEG image of this size requires a larger file.
    let mut jpeg = b"\xff\xd8\xff\xc0\0\x0b\x08____\x01\x01\x11\0".to_vec();
    jpeg[7..11].copy_from_slice(&(SIDE << 16 | SIDE).to_be_bytes());
    jpeg.extend(b"\xff\xda\0\x08\x01\x01\0\0\x3f\0\xff\xd9");
    let error = read("a.jpg", &jpeg, ColorUse::Data).unwrap_err();
    assert!(error.to_string().contains("too much for a file of this size"), "{error}");
}

#[test]
fn gif_frames_larger_than_the_image_are_charged_to_the_budget() {
    let gif = |side: u16| {
        let frame = [&[0; 4][..], &side.to_le_bytes(), &side.to_le_bytes()].concat();
        [b"GIF89a\x01\0\x01\0\0\0\0,", &frame[..], b"\x80\0\0\0\xff\0\0\x02\x02L\x01\0;"].concat()
    };
    let error = read("a.gif", &gif(u16::MAX), ColorUse::Color).unwrap_err().to_string();
    assert!(error.contains("65535 x 65535 pixels") || error.contains("pixels"), "{error}");
    assert_eq!(read("a.gif", &gif(1), ColorUse::Color).unwrap().0.size, [1, 1]);
}

#[test]
fn error_names_the_unsupported_image_format() {
    let error = read("a.dds", b"DDS |", ColorUse::Color).unwrap_err();
    let expected = "a.dds: unknown image format; supported: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF and TGA; the file is \
         a DDS image: convert it to PNG";
    assert_eq!(error.to_string(), expected);
    let mut cube = cases().into_iter().find(|case| case.name == "uastc.ktx2").unwrap().file;
    cube[36] = 6;
    let error = read("a.ktx2", &cube, ColorUse::Color).unwrap_err().to_string();
    let expected = "a.ktx2: a KTX2 texture of depth 0, 0 layers and 6 faces; expected a single image";
    assert_eq!(error, expected);
}

#[test]
fn truncated_images_return_errors() {
    for case in cases() {
        let whole = read(&case.name, &case.file, ColorUse::Data).unwrap().0;
        for length in 0..case.file.len() {
            if let Ok((image, _)) = read(&case.name, &case.file[..length], ColorUse::Data) {
                assert_eq!(image, whole, "{}: {length} of {}", case.name, case.file.len());
            }
        }
    }
}

#[test]
fn damaged_images_are_decoded_or_refused_without_a_panic() {
    for case in cases() {
        for at in 0..case.file.len() {
            let mut damaged = case.file.clone();
            damaged[at] ^= 1 << (at % 8);
            if let Ok((image, _)) = read(&case.name, &damaged, ColorUse::Color) {
                let pixels = image.size[0] as usize * image.size[1] as usize;
                assert_eq!(image.texels.len(), pixels, "{}: byte {at}", case.name);
            }
        }
    }
}
