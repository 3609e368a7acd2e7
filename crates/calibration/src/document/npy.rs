//! Reading of NumPy arrays: `.npy` files, and `.npz` files, which are ZIP archives of `.npy` files. Source:
//! numpy.lib.format, "Format Version 1.0". Arrays of Python objects are pickles, which can run code when they are
//! loaded, so they are never loaded.

use std::path::Path;

use crate::document::zip_members::{self, ZipMember};
use crate::document::{DocumentNode, Value};
use raycam_formats::Budget;
use raycam_formats::{FormatError, Result};

/// First bytes of a `.npy` file.
const MAGIC: &[u8] = b"\x93NUMPY";
/// Maximum number of elements of an array that becomes part of a document; pixel maps are larger.
const MAX_ELEMENTS: usize = 1 << 16;
/// Maximum number of elements of an array; larger arrays are not read.
const MAX_ARRAY: usize = 1 << 24;
/// Maximum number of bytes up to the end of an array's header.
const MAX_HEADER: usize = 4096;

/// Elements of an array, row by row.
pub(crate) enum Elements {
    Numbers(Vec<f64>),
    Words(Vec<String>),
    /// Reason why the elements are not read.
    Unread(String),
}

/// A NumPy array of any shape.
pub(crate) struct NumpyArray {
    pub(crate) shape: Vec<usize>,
    pub(crate) elements: Elements,
}

/// True for the bytes of a `.npy` file.
pub(crate) fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Names of the arrays in a `.npz` file; empty for another file.
pub(crate) fn names(bytes: &[u8]) -> Vec<String> {
    let members = if zip_members::is_zip(bytes) { zip_members::members(bytes).unwrap_or_default() } else { vec![] };
    members.iter().filter_map(|member| Some(member.name.strip_suffix(".npy")?.to_owned())).collect()
}

/// Shape of the array in a `.npy` file; `None` for another file.
pub(crate) fn shape(bytes: &[u8]) -> Option<Vec<usize>> {
    Some(NpyHeader::parse(bytes).ok()?.shape)
}

/// Shapes of the arrays in a `.npz` file, from their headers; `None` for another file.
pub(crate) fn shapes(bytes: &[u8]) -> Option<Vec<Vec<usize>>> {
    let members = zip_members::members(bytes).ok()?;
    let arrays = members.iter().filter(|member| member.name.ends_with(".npy"));
    let shapes: Vec<_> = arrays.map(|member| shape(&member.start(bytes, MAX_HEADER)?)).collect::<Option<_>>()?;
    (!shapes.is_empty()).then_some(shapes)
}

/// Reads the arrays of a `.npz` file with their names, in file order.
pub(crate) fn arrays(bytes: &[u8], path: &Path, budget: &mut Budget) -> Result<Vec<(String, NumpyArray)>> {
    let fail = |message: String| FormatError::whole(path, message);
    let members = zip_members::members(bytes).map_err(fail)?;
    let named = |member: &ZipMember| member.name.strip_suffix(".npy").map(str::to_owned);
    let mut found = Vec::new();
    for (name, member) in members.iter().filter_map(|member| Some((named(member)?, member))) {
        let unpacked = member.unpack(bytes, path, budget)?;
        let array = array(&unpacked).map_err(|message| fail(format!("{name}: {message}")))?;
        found.push((name, array));
    }
    Ok(found)
}

/// Reads the array of a `.npy` file.
pub(crate) fn array(bytes: &[u8]) -> Result<NumpyArray, String> {
    let header = NpyHeader::parse(bytes)?;
    let count = header.shape.iter().try_fold(1usize, |count, side| count.checked_mul(*side));
    let count = count
        .filter(|count| *count <= MAX_ARRAY)
        .ok_or_else(|| format!("too many elements; an array of a calibration has at most {MAX_ARRAY}"))?;
    let data = &bytes[header.data..];
    let mut elements = header.elements(data, count)?;
    if header.fortran {
        match &mut elements {
            Elements::Numbers(values) => *values = by_rows(values, &header.shape),
            Elements::Words(words) => *words = by_rows(words, &header.shape),
            Elements::Unread(_) => {}
        }
    }
    Ok(NumpyArray { shape: header.shape, elements })
}

/// Reorders elements from column order (first index fastest) to row order.
fn by_rows<T: Clone>(values: &[T], shape: &[usize]) -> Vec<T> {
    let strides: Vec<usize> = shape.iter().scan(1, |next, side| Some(std::mem::replace(next, *next * side))).collect();
    let place = |mut at: usize| {
        let mut place = 0;
        for (side, stride) in shape.iter().zip(&strides).rev() {
            place += at % side * stride;
            at /= side;
        }
        place
    };
    (0..values.len()).map(|at| values[place(at)].clone()).collect()
}

struct NpyHeader {
    kind: String,
    fortran: bool,
    shape: Vec<usize>,
    /// Offset in bytes of the first element.
    data: usize,
}

impl NpyHeader {
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let broken = || "invalid .npy header".to_owned();
        let version = *bytes.get(6).filter(|_| is_npy(bytes)).ok_or_else(broken)?;
        let wide = version >= 2;
        let field = bytes.get(8..if wide { 12 } else { 10 }).ok_or_else(broken)?;
        let length = field.iter().rev().fold(0usize, |length, byte| length << 8 | usize::from(*byte));
        let start = 8 + field.len();
        let end = start.checked_add(length).ok_or_else(broken)?;
        let text = std::str::from_utf8(bytes.get(start..end).ok_or_else(broken)?).map_err(|_| broken())?;
        let value = |key: &str| {
            let (_, rest) = text.split_once(&format!("'{key}'"))?;
            Some(rest.split_once(':')?.1.trim_start())
        };
        let descr = value("descr").ok_or_else(broken)?;
        let kind = match descr.strip_prefix('\'') {
            Some(rest) => rest.split('\'').next().unwrap_or_default().to_owned(),
            None => "structured".into(),
        };
        let fortran = value("fortran_order").ok_or_else(broken)?.starts_with("True");
        let shape = value("shape").and_then(|rest| rest.strip_prefix('(')?.split_once(')')).ok_or_else(broken)?.0;
        let sides = shape.split(',').map(str::trim).filter(|side| !side.is_empty());
        let shape = sides.map(|side| side.trim_end_matches('L').parse()).collect::<Result<_, _>>();
        Ok(Self { kind, fortran, shape: shape.map_err(|_| broken())?, data: end })
    }

    fn elements(&self, data: &[u8], count: usize) -> Result<Elements, String> {
        if self.kind.contains('O') {
            return Ok(Elements::Unread(
                "pickled objects are not loaded, because they may run code; save numbers with np.savez".into(),
            ));
        }
        let (order, rest) = self.kind.split_at(usize::from(self.kind.starts_with(['<', '>', '|', '='])));
        let big = order == ">";
        let (letter, size) = rest.split_at(rest.len().min(1));
        let Ok(size) = size.parse::<usize>() else {
            return Ok(Elements::Unread(format!(
                "an array of {}, which is not supported; save numbers with np.savez",
                self.kind
            )));
        };
        let width = if letter == "U" { 4 * size } else { size };
        let needed = width.checked_mul(count).ok_or("the array has more bytes than a calibration can have")?;
        if data.len() < needed {
            return Err(format!("{} bytes of elements; expected {needed} (the file is truncated)", data.len()));
        }
        if letter == "U" {
            return Ok(Elements::Words((0..count).map(|i| word(&data[i * width..][..width], big)).collect()));
        }
        let Some(number) = reader(letter, size) else {
            return Ok(Elements::Unread(format!(
                "an array of {}, which is not supported; save numbers with np.savez",
                self.kind
            )));
        };
        let value = |i: usize| {
            let mut bytes = [0; 8];
            bytes[..width].copy_from_slice(&data[i * width..][..width]);
            if big {
                bytes[..width].reverse();
            }
            number(bytes)
        };
        Ok(Elements::Numbers((0..count).map(value).collect()))
    }
}

/// Returns the function that converts little-endian bytes of a number type to a number.
fn reader(letter: &str, size: usize) -> Option<fn([u8; 8]) -> f64> {
    Some(match (letter, size) {
        ("f", 8) => f64::from_le_bytes,
        ("f", 4) => |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        ("f", 2) => |b| half::f16::from_le_bytes([b[0], b[1]]).to_f64(),
        ("i", 8) => |b| i64::from_le_bytes(b) as f64,
        ("i", 4) => |b| f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        ("i", 2) => |b| f64::from(i16::from_le_bytes([b[0], b[1]])),
        ("i", 1) => |b| f64::from(b[0] as i8),
        ("u", 1 | 2 | 4 | 8) | ("b", 1) => |b| u64::from_le_bytes(b) as f64,
        _ => return None,
    })
}

/// Decodes a string of UTF-32 code points, without trailing zeros.
fn word(bytes: &[u8], big: bool) -> String {
    let code = |b: &[u8]| {
        let four = [b[0], b[1], b[2], b[3]];
        if big { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) }
    };
    let found: String = bytes.chunks_exact(4).map(|b| char::from_u32(code(b)).unwrap_or('\u{fffd}')).collect();
    found.trim_end_matches('\0').into()
}

impl NumpyArray {
    /// The array's numbers; `None` for an array of another type.
    pub(crate) fn numbers(&self) -> Option<&[f64]> {
        match &self.elements {
            Elements::Numbers(values) => Some(values),
            _ => None,
        }
    }

    /// Reason why the array contains no numbers that can be read.
    pub(crate) fn reason(&self) -> &str {
        match &self.elements {
            Elements::Unread(reason) => reason,
            _ => "words",
        }
    }

    /// Converts the array to lists of lists, for readers of documents; a large array becomes a text with its shape.
    pub(crate) fn node(&self) -> DocumentNode {
        let words: Vec<String> = match &self.elements {
            Elements::Numbers(values) if values.len() <= MAX_ELEMENTS => values.iter().map(f64::to_string).collect(),
            Elements::Words(words) if words.len() <= MAX_ELEMENTS => words.clone(),
            Elements::Unread(reason) => return scalar(reason.clone()),
            _ => return scalar(format!("an array of the shape {:?}", self.shape)),
        };
        let mut level: Vec<DocumentNode> = words.into_iter().map(scalar).collect();
        for side in self.shape.iter().rev() {
            let lists = level.chunks((*side).max(1)).map(<[DocumentNode]>::to_vec);
            level = lists.map(|items| DocumentNode { value: Value::List(items), line: 1 }).collect();
        }
        level.into_iter().next().unwrap_or_else(|| DocumentNode { value: Value::List(vec![]), line: 1 })
    }
}

fn scalar(word: String) -> DocumentNode {
    DocumentNode { value: Value::Scalar(word), line: 1 }
}

/// Creates a document with several named arrays.
pub(crate) fn document(arrays: &[(String, NumpyArray)]) -> DocumentNode {
    let entries = arrays.iter().map(|(name, array)| (name.clone(), array.node()));
    DocumentNode { value: Value::Map(entries.collect()), line: 1 }
}
