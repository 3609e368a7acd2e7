//! Small files in the actual format of each project, created for these tests: read, truncated, and with flipped bits.

use std::fs;
use std::path::{Path, PathBuf};

use raycam_calibration::{Calibration, CameraRecord, ReadHints, decode};
use raycam_formats::{Budget, FormatError};

use crate::support::data;

/// Format and path of each sample, from the path FORMAT/FILE.
fn samples() -> Vec<(String, PathBuf)> {
    let mut found = Vec::new();
    for folder in fs::read_dir(data("samples")).unwrap() {
        let folder = folder.unwrap();
        let format = folder.file_name().into_string().unwrap();
        for file in fs::read_dir(folder.path()).unwrap() {
            found.push((format.clone(), file.unwrap().path()));
        }
    }
    found.sort();
    assert!(found.len() >= 14);
    found
}

/// Reads cameras from bytes; no other file is opened.
fn read(bytes: Vec<u8>, name: &Path, format: Option<&str>) -> Result<Calibration, FormatError> {
    let hints = ReadHints { size: Some([640, 480]), ..ReadHints::default() };
    let name = Path::new("/nonexistent").join(name.file_name().unwrap());
    decode(bytes, &name, format, &hints, &Budget::default())
}

#[test]
fn samples_are_recognised_as_their_format() {
    for (format, path) in samples() {
        let bytes = fs::read(&path).unwrap();
        let named = read(bytes.clone(), &path, Some(&format)).unwrap_or_else(|error| panic!("{format}: {error}"));
        let detected = read(bytes, &path, None).unwrap_or_else(|error| panic!("{format}: {error}"));
        assert_eq!(named.records, detected.records, "{format}");
        assert!(named.records.iter().all(|record: &CameraRecord| record.pose.is_some() || record.k.is_some()));
    }
}

#[test]
fn damaged_samples_are_read_or_refused_without_a_panic() {
    for (format, path) in samples() {
        let bytes = fs::read(&path).unwrap();
        for length in 0..bytes.len() {
            let _ = read(bytes[..length].to_vec(), &path, Some(&format));
            let _ = read(bytes[..length].to_vec(), &path, None);
        }
        for at in 0..bytes.len() {
            for bit in [0, 3, 6] {
                let mut damaged = bytes.clone();
                damaged[at] ^= 1 << bit;
                let _ = read(damaged, &path, Some(&format));
            }
        }
    }
}
