use std::fs;
use std::path::Path;

use raycam_formats::codec::meshopt::{Filter, Mode, ViewHeader, decode};
use raycam_formats::{Budget, FormatError};

use crate::support::data;

/// A stream of meshoptimizer's encoder, and the result of its decoder.
struct Case {
    name: String,
    shape: ViewHeader,
    stream: Vec<u8>,
    expected: Vec<u8>,
}

fn cases() -> Vec<Case> {
    let file = fs::read(data("meshopt/meshopt.cases")).unwrap();
    let mut rest = &file[..];
    let mut cases = Vec::new();
    while let Some(end) = rest.iter().position(|&b| b == b'\n') {
        let line = std::str::from_utf8(&rest[..end]).unwrap();
        let words: Vec<_> = line.split(' ').collect();
        let [count, stride, length] = [3, 4, 5].map(|i: usize| words[i].parse::<usize>().unwrap());
        let filter = match words[2] {
            "OCTAHEDRAL" => Filter::Octahedral,
            "QUATERNION" => Filter::Quaternion,
            "EXPONENTIAL" => Filter::Exponential,
            "COLOR" => Filter::Color,
            _ => Filter::None,
        };
        let mode = match words[1] {
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            _ => Mode::Attributes(filter),
        };
        let (stream, expected) = rest[end + 1..].split_at(length);
        let (expected, after) = expected.split_at(count * stride);
        cases.push(Case {
            name: words[0].into(),
            shape: ViewHeader { mode, count, stride },
            stream: stream.into(),
            expected: expected.into(),
        });
        rest = after;
    }
    cases
}

fn read(bytes: &[u8], shape: ViewHeader) -> Result<Vec<u8>, FormatError> {
    decode(bytes, shape, Path::new("a.glb"), &mut Budget::default())
}

/// Difference between two filtered views, in units in the last place of their components.
fn apart(shape: ViewHeader, a: &[u8], b: &[u8]) -> i32 {
    let components = |bytes: &[u8]| -> Vec<i32> {
        match (shape.mode, shape.stride) {
            (Mode::Attributes(Filter::Octahedral), 4) => bytes.iter().map(|&b| i32::from(b as i8)).collect(),
            (Mode::Attributes(Filter::Color), 4) => bytes.iter().map(|&b| b.into()).collect(),
            (Mode::Attributes(Filter::Color), _) => {
                (bytes.as_chunks::<2>().0.iter()).map(|&w| u16::from_le_bytes(w).into()).collect()
            }
            _ => (bytes.as_chunks::<2>().0.iter()).map(|&w| i16::from_le_bytes(w).into()).collect(),
        }
    };
    let differences = components(a).into_iter().zip(components(b));
    differences.map(|(a, b)| (a - b).abs()).max().unwrap_or(0)
}

#[test]
fn streams_decode_as_in_meshoptimizer() {
    let cases = cases();
    assert!(cases.len() > 60);
    for case in cases {
        let decoded = read(&case.stream, case.shape).unwrap();
        let exact = matches!(
            case.shape.mode,
            Mode::Attributes(Filter::None | Filter::Exponential) | Mode::Triangles | Mode::Indices
        );
        if exact {
            assert_eq!(decoded, case.expected, "{}", case.name);
        } else {
            // The specification allows a difference of one unit in the last place.
            assert_eq!(decoded.len(), case.expected.len());
            let apart = apart(case.shape, &decoded, &case.expected);
            assert!(apart <= 1, "{}: {apart}", case.name);
        }
    }
}

#[test]
fn example_of_the_specification_is_decoded() {
    // The first byte of the elements has sixteen differences of four bits, followed by two bytes.
    let packed = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
    let differences = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0_i32];
    let mut stream = vec![0xa0, 0b10];
    stream.extend(packed);
    stream.extend([0; 3]);
    stream.extend([0; 28]);
    stream.extend([100, 1, 2, 3]);
    let shape = ViewHeader { mode: Mode::Attributes(Filter::None), count: 16, stride: 4 };
    let decoded = read(&stream, shape).unwrap();
    let mut value = 100_i32;
    for (element, difference) in decoded.as_chunks::<4>().0.iter().zip(differences) {
        value += difference;
        assert_eq!(*element, [value as u8, 1, 2, 3]);
    }
}

#[test]
fn filters_match_the_formulas_of_the_specification() {
    // The stream contains one element as the baseline, and no differences.
    let filtered = |filter, element: &[u8]| {
        let stride = element.len();
        let mut stream = vec![0xa0];
        stream.extend(vec![0; stride]);
        stream.extend(vec![0; 32_usize.saturating_sub(stride)]);
        stream.extend(element);
        let mode = Mode::Attributes(filter);
        read(&stream, ViewHeader { mode, count: 1, stride })
    };
    let words = |v: [i16; 4]| v.map(i16::to_le_bytes).concat();
    // The elements are an axis, and a vector of the lower half: (x, x) is folded to (1 - x, 1 - x, 1 - 2 x).
    let up = filtered(Filter::Octahedral, &[0, 0, 127, 5]).unwrap();
    assert_eq!(up, [0, 0, 127, 5]);
    let down = filtered(Filter::Octahedral, &words([384, 384, 511, -7])).unwrap();
    let x = 384.0 / 511.0;
    let (side, below) = (1.0 - x, 1.0 - 2.0 * x);
    let length = f64::sqrt(2.0 * side * side + below * below);
    let component = |at: usize| f64::from(i16::from_le_bytes([down[at], down[at + 1]]));
    for (at, expected) in [(0, side), (2, side), (4, below)] {
        assert!((component(at) - 32767.0 * expected / length).abs() <= 1.0, "{down:?}");
    }
    assert_eq!(component(6), -7.0);
    // The element is the identity; its missing component is w, component 3.
    let identity = filtered(Filter::Quaternion, &words([0, 0, 0, 2047])).unwrap();
    assert_eq!(identity, words([0, 0, 0, 32767]));
    // The elements are 2^-3 * -5, and a number with the largest possible exponent.
    let float = (-3_i32 << 24 | -5 & 0xff_ffff).to_le_bytes();
    let decoded = filtered(Filter::Exponential, &float).unwrap();
    assert_eq!(decoded, (-0.625_f32).to_le_bytes());
    let float = (127_i32 << 24 | 1).to_le_bytes();
    let decoded = filtered(Filter::Exponential, &float).unwrap();
    assert_eq!(decoded, 2_f32.powi(127).to_le_bytes());
    // The colour is opaque white with 8 bits.
    assert_eq!(filtered(Filter::Color, &[255, 0, 0, 255]).unwrap(), [255; 4]);
    // Cases that the specification leaves undefined are errors.
    for (filter, element) in [
        (Filter::Octahedral, vec![0, 0, 0, 0]),
        (Filter::Octahedral, words([0, 0, -1, 0])),
        (Filter::Quaternion, words([0, 0, 0, 2000])),
        (Filter::Color, vec![9, 0, 0, 0]),
    ] {
        let error = filtered(filter, &element).unwrap_err().to_string();
        let expected = "a.glb: meshopt compression: element 0 is invalid for its filter";
        assert_eq!(error, expected);
    }
}

#[test]
fn shapes_are_validated_before_any_allocation() {
    let error = |mode, count, stride| {
        let shape = ViewHeader { mode, count, stride };
        read(&[0xa0; 40], shape).unwrap_err().to_string()
    };
    let plain = Mode::Attributes(Filter::None);
    let prefix = "a.glb: meshopt compression: ";
    for (mode, count, stride, expected) in [
        (plain, 1, 0, "byteStride 0; expected a multiple of 4 up to 256"),
        (plain, 1, 6, "byteStride 6; expected a multiple of 4 up to 256"),
        (plain, 1, 260, "byteStride 260; expected a multiple of 4 up to 256"),
        (Mode::Attributes(Filter::Color), 1, 12, "byteStride 12; expected 4 or 8 with this filter"),
        (Mode::Attributes(Filter::Quaternion), 1, 4, "byteStride 4; expected 8 with this filter"),
        (Mode::Indices, 1, 8, "byteStride 8; expected 2 or 4 for indices"),
        (Mode::Triangles, 4, 2, "count 4; expected a multiple of three"),
        (plain, usize::MAX, 4, "40 bytes are too few for 18446744073709551615 elements"),
        (Mode::Indices, 1 << 40, 4, "40 bytes are too few for 1099511627776 elements"),
        (Mode::Indices, 9, 4, "header 0xa0; expected 0xd1"),
        (Mode::Triangles, 9, 4, "header 0xa0; expected 0xe1"),
    ] {
        assert_eq!(error(mode, count, stride), format!("{prefix}{expected}"));
    }
    // A stream of zeros may be long, but not longer than the budget.
    let mut stream = vec![0xa1];
    stream.extend([0b1010_1010; 1000]);
    stream.extend([0; 24]);
    let shape = ViewHeader { mode: plain, count: 256_000, stride: 4 };
    assert_eq!(read(&stream, shape).unwrap().len(), 1_024_000);
    let mut budget = Budget { bytes: 1_000_000, ..Budget::default() };
    let error = decode(&stream, shape, Path::new("a.glb"), &mut budget).unwrap_err();
    assert!(matches!(error, FormatError::Budget { amount: 1_024_000, .. }));
}

#[test]
fn damaged_streams_are_decoded_or_refused_without_a_panic() {
    for case in cases() {
        for length in 0..case.stream.len() {
            let cut = read(&case.stream[..length], case.shape);
            assert!(cut.is_err(), "{}: {length} bytes", case.name);
        }
        let longer = [&case.stream[..], &[0]].concat();
        assert!(read(&longer, case.shape).is_err(), "{}", case.name);
        for at in 0..case.stream.len().min(300) {
            let mut damaged = case.stream.clone();
            damaged[at] ^= 1 << (at % 8);
            if let Ok(decoded) = read(&damaged, case.shape) {
                assert_eq!(decoded.len(), case.expected.len());
            }
        }
    }
}
