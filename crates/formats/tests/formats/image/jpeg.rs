use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use raycam_formats::ColorUse;
use raycam_scene::Texels;

use crate::image::{Case, cases, read};

fn jpegs() -> impl Iterator<Item = Case> {
    cases().into_iter().filter(|case| case.name.ends_with(".jpg"))
}

/// Offsets at which scans begin, after their headers.
fn scans(file: &[u8]) -> Vec<usize> {
    let starts = (0..file.len() - 3).filter(|&at| file[at..at + 3] == [0xff, 0xda, 0]);
    starts.map(|at| at + 2 + usize::from(file[at + 3])).collect()
}

#[test]
fn bytes_missing_in_the_middle_are_detected() {
    for case in jpegs() {
        let start = scans(&case.file)[0];
        // The data of the scan is cut after `left` bytes, and the end-of-image marker follows.
        for left in 0..case.file.len() - start - 40 {
            let mut cut = case.file[..start + left].to_vec();
            cut.extend([0xff, 0xd9]);
            match read(&case.name, &cut, ColorUse::Color) {
                // A progressive image without its later scans is shown with less detail.
                Ok((_, notices)) => {
                    assert!(case.name.starts_with("progressive"), "{}", case.name);
                    let notice =
                        format!("{}: the last JPEG scans are missing, so the image has less detail", case.name);
                    assert_eq!(crate::support::texts(&notices), [notice]);
                }
                Err(error) => {
                    let error = error.to_string();
                    let start = format!("{}: truncated", case.name);
                    assert!(error.starts_with(&start), "{left}: {error}");
                }
            }
        }
        // All bytes in the first half of the data, except the first four, are removed.
        let middle = start + 4..(start + case.file.len()) / 2;
        let cut = [&case.file[..middle.start], &case.file[middle.end..]].concat();
        let error = read(&case.name, &cut, ColorUse::Color).unwrap_err();
        let start = format!("{}: truncated or damaged: ", case.name);
        assert!(error.to_string().starts_with(&start), "{error}");
    }
}

/// Offset of the first segment with a marker.
fn segment(file: &[u8], marker: u8) -> Option<usize> {
    file.windows(2).position(|w| w == [0xff, marker])
}

/// Error of a file that is refused.
fn error_of(file: &[u8]) -> String {
    let found = read("a.jpg", file, ColorUse::Color);
    found.unwrap_err().to_string()
}

/// Asserts that a file is read without a notice and gives the same image as another file.
fn assert_shows_the_same(name: &str, file: &[u8], other: &[u8]) {
    let (image, notices) = read(name, file, ColorUse::Color).unwrap();
    let (expected, _) = read(name, other, ColorUse::Color).unwrap();
    assert_eq!(image, expected, "{name}");
    assert!(notices.is_empty(), "{notices:?}");
}

#[test]
fn truncated_scans_report_their_position() {
    let case = jpegs().find(|case| case.name == "grey.jpg").unwrap();
    let start = scans(&case.file)[0];
    let mut cut = case.file[..start + 20].to_vec();
    cut.extend([0xff, 0xd9]);
    let error = error_of(&cut);
    let expected = "a.jpg: truncated or damaged: scan 1 stops at row 0 of 14";
    assert_eq!(error, expected);
}

#[test]
fn missing_padding_bits_are_accepted() {
    let noise: Vec<u8> = (0..64 * 64_u32).map(|i| (i.wrapping_mul(2654435761) >> 24) as u8).collect();
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, 90).encode(&noise, 64, 64, ExtendedColorType::L8).unwrap();
    let (whole, notices) = read("a.jpg", &file, ColorUse::Color).unwrap();
    assert!(notices.is_empty(), "{notices:?}");
    let without = |bytes: usize| [&file[..file.len() - 2 - bytes], &[0xff, 0xd9]].concat();
    let (cut, notices) = read("a.jpg", &without(4), ColorUse::Color).unwrap();
    let expected = "a.jpg: JPEG scan 1 is truncated; the missing blocks are extrapolated";
    assert_eq!(crate::support::texts(&notices), [expected]);
    let (Texels::Srgb8(cut), Texels::Srgb8(whole)) = (cut.texels, whole.texels) else {
        panic!("expected 8-bit sRGB texels");
    };
    assert_eq!(cut[..56 * 64], whole[..56 * 64]);
    // A block of noise takes at least 60 bytes.
    let error = error_of(&without(200));
    let expected = "a.jpg: truncated or damaged: scan 1 stops at row 56 of 64";
    assert_eq!(error, expected);
}

#[test]
fn too_many_scans_are_refused() {
    let case = jpegs().find(|case| case.name == "grey.jpg").unwrap();
    let at = segment(&case.file, 0xda).unwrap();
    let end = case.file.len() - 2;
    let scan = &case.file[at..end];
    let mut file = case.file[..end].to_vec();
    file.extend(scan);
    file.extend([0xff, 0xd9]);
    let error = error_of(&file);
    let expected = "a.jpg: truncated or damaged: scan 2 contains coefficient bits in the wrong order";
    assert_eq!(error, expected);
}

#[test]
fn bytes_between_segments_are_skipped() {
    for case in jpegs() {
        let scan = segment(&case.file, 0xda).unwrap();
        let mut file = case.file.clone();
        file.splice(scan..scan, [0xff, 0xff]);
        assert_shows_the_same(&case.name, &file, &case.file);
    }
}

#[test]
fn jpeg_frames_without_huffman_tables_use_the_standard_tables() {
    // These files have the standard tables, which are removed.
    for name in ["grey.jpg", "444.jpg", "420.jpg"] {
        let case = jpegs().find(|case| case.name == name).unwrap();
        let mut file = case.file.clone();
        while let Some(at) = segment(&file, 0xc4) {
            let length = u16::from_be_bytes([file[at + 2], file[at + 3]]);
            file.drain(at..at + 2 + usize::from(length));
        }
        assert!(file.len() + 100 < case.file.len(), "{name}");
        // A header as written before the frames of AVI files.
        file.splice(2..2, *b"\xff\xe0\0\x10AVI1\0\0\0\0\0\0\0\0\0\0");
        assert_shows_the_same(name, &file, &case.file);
    }
}
