use std::fs;
use std::path::Path;

use raycam_formats::codec::draco::{Attribute, ComponentType, DecodedMesh, decode};
use raycam_formats::{Budget, FormatError};

use crate::support::data;

/// Streams of Google's encoder, compared with the results of Google's decoder.
fn cases() -> Vec<(String, Vec<u8>, DecodedMesh)> {
    let file = fs::read(data("draco/draco.cases")).unwrap();
    let mut rest = &file[..];
    let mut lump = |length: usize| {
        let (lump, after) = rest.split_at(length);
        rest = after;
        lump.to_vec()
    };
    let mut cases = Vec::new();
    let mut at = 0;
    while let Some(end) = file[at..].iter().position(|&b| b == b'\n') {
        let line = String::from_utf8(lump(end + 1)).unwrap();
        let words: Vec<_> = line.split_whitespace().collect();
        let [length, triangles, count] = [1, 2, 3].map(|i: usize| words[i].parse().unwrap());
        let stream = lump(length);
        let indices = lump(12 * triangles);
        let indices = indices.as_chunks::<4>().0.as_chunks::<3>().0;
        let triangles = indices.iter().map(|t| t.map(u32::from_le_bytes)).collect();
        at += end + 1 + length + 12 * indices.len();
        let attributes = words[4..].iter().map(|word| {
            let [id, kind, components] = word.split(',').collect::<Vec<_>>()[..] else {
                panic!("{word}");
            };
            let (component, size) = match kind {
                "F32" => (ComponentType::F32, 4),
                "U16" => (ComponentType::U16, 2),
                "I8" => (ComponentType::I8, 1),
                _ => (ComponentType::U8, 1),
            };
            let components: usize = components.parse().unwrap();
            let bytes = lump(count * components * size);
            at += bytes.len();
            Attribute { id: id.parse().unwrap(), component, components, bytes }
        });
        let attributes = attributes.collect();
        let decoded = DecodedMesh { triangles, count, attributes };
        cases.push((words[0].to_owned(), stream, decoded));
    }
    cases
}

fn read(bytes: &[u8]) -> Result<DecodedMesh, FormatError> {
    decode(bytes, Path::new("a.glb"), &mut Budget::default())
}

#[test]
fn streams_decode_as_in_googles_library() {
    let cases = cases();
    assert_eq!(cases.len(), 9);
    for (name, stream, expected) in cases {
        let decoded = read(&stream).unwrap();
        assert_eq!(decoded.triangles, expected.triangles, "{name}");
        assert_eq!(decoded.count, expected.count, "{name}");
        for (a, b) in decoded.attributes.iter().zip(&expected.attributes) {
            if a.bytes == b.bytes {
                continue;
            }
            // A small difference is allowed: quantised values are computed in float32, and C++ compilers may use fused
            // operations.
            let numbers = |attribute: &Attribute| -> Vec<f32> {
                let words = attribute.bytes.as_chunks::<4>().0;
                words.iter().map(|&w| f32::from_le_bytes(w)).collect()
            };
            assert_eq!((a.id, a.component), (b.id, b.component), "{name}");
            assert_eq!(a.component, ComponentType::F32, "{name}");
            for (x, y) in numbers(a).into_iter().zip(numbers(b)) {
                assert!((x - y).abs() <= 1e-6 * y.abs().max(1.0), "{name} {x} {y}");
            }
        }
        assert_eq!(decoded.attributes.len(), expected.attributes.len());
    }
}

#[test]
fn invalid_draco_streams_are_reported() {
    for (bytes, expected) in [
        (&b"DRAC"[..], "a.glb: Draco compression: the stream does not begin with DRACO"),
        (b"DRACO\x02\x02\x00\x01", "a.glb: Draco compression: the stream is not a mesh"),
        (b"DRACO\x01\x03\x01", "a.glb: Draco compression of version 1.3; expected 2.2"),
    ] {
        assert_eq!(read(bytes).unwrap_err().to_string(), expected);
    }
}

#[test]
fn meshes_larger_than_the_budget_are_refused() {
    let (_, stream, decoded) = cases().pop().unwrap();
    let size: usize = decoded.attributes.iter().map(|a| a.bytes.len()).sum();
    let elements = decoded.count + 3 * decoded.triangles.len();
    let tight = Budget { bytes: size as u64, elements: elements as u64, ..Budget::default() };
    let read = |mut budget: Budget| decode(&stream, Path::new("a.glb"), &mut budget);
    assert!(read(tight).is_ok());
    let fewer = [
        Budget { bytes: tight.bytes - 1, ..tight },
        Budget { elements: tight.elements - 1, ..tight },
        Budget { elements: 300, ..tight },
    ];
    for budget in fewer {
        assert!(read(budget).is_err(), "{budget:?}");
    }
}

/// A file found by fuzzing: the sum of its declared number of points and its number of face corners exceeds 64 bits.
#[test]
fn overflowing_point_counts_are_refused() {
    let error = read(include_bytes!("../../data/draco/points_overflow.drc")).unwrap_err();
    let error = error.to_string();
    assert!(error.contains("vertices and face corners"), "{error}");
}

#[test]
fn damaged_streams_are_decoded_or_refused_without_a_panic() {
    for (name, stream, _) in cases().into_iter().filter(|(name, ..)| name != "large") {
        for length in 0..stream.len() {
            assert!(read(&stream[..length]).is_err(), "{name}: {length} bytes");
        }
        for at in 0..stream.len() {
            let mut damaged = stream.clone();
            damaged[at] ^= 1 << (at % 8);
            if let Ok(decoded) = read(&damaged) {
                let corners = decoded.triangles.as_flattened();
                assert!(corners.iter().all(|&c| (c as usize) < decoded.count));
            }
        }
    }
}
