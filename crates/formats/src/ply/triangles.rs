//! Fast reading of a binary PLY file's faces, if all faces are triangles in the usual layout.

use std::ops::Range;

use raycam_scene::color::Rgb;

use crate::io::{ByteSource, parallel};
use crate::ply::body::Body;
use crate::ply::columns::PropertyRole::{Alpha, Blue, Green, Red};
use crate::ply::columns::{Columns, PropertyRole};
use crate::ply::header::Element;
use crate::ply::scalar::ScalarType;
use crate::ply::table::{BLOCK_ROWS, FixedTable};

/// Faces of a file whose faces are all triangles.
pub(crate) struct PlyTriangles {
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Linear colours of the triangles.
    pub(crate) colors: Option<Vec<Rgb>>,
    /// True if any colour is translucent.
    pub(crate) translucent: bool,
}

/// Reads an element whose rows are triangles.
///
/// A triangle is a list of three 32-bit vertex indices below `vertices`. Other columns must be unused, or be colours of a
/// type that determines their range. Returns `None`, without reading anything, if the element has another layout or any row
/// is not such a triangle. The caller must then read row by row, which reports a fault if there is one.
pub(crate) fn read(
    element: &Element,
    columns: &Columns<'_>,
    body: &mut Body<'_>,
    vertices: usize,
) -> Option<PlyTriangles> {
    let TriangleLayout { before, length, stride, places } = layout(element, columns)?;
    let (bytes, big_endian) = body.peek(element.count.checked_mul(stride)?)?;
    let skip = bytes.len();
    let table = FixedTable::new(bytes.borrowed(), stride, big_endian, places);
    let rows = TriangleRows { bytes: bytes.borrowed(), stride, three: before..before + length.bytes(), vertices };
    // The number 3, encoded in the number type of the list's length.
    let mut three = [0; 8];
    let three = &mut three[..length.bytes()];
    match length {
        ScalarType::F32 if big_endian => three.copy_from_slice(&3_f32.to_be_bytes()),
        ScalarType::F32 => three.copy_from_slice(&3_f32.to_le_bytes()),
        ScalarType::F64 if big_endian => three.copy_from_slice(&3_f64.to_be_bytes()),
        ScalarType::F64 => three.copy_from_slice(&3_f64.to_le_bytes()),
        _ if big_endian => three[length.bytes() - 1] = 3,
        _ => three[0] = 3,
    }
    let triangles = match (big_endian, &*three) {
        (false, &[three]) => rows.read(u32::from_le_bytes, |length| *length == [three]),
        (false, three) => rows.read(u32::from_le_bytes, |length| length == three),
        (true, three) => rows.read(u32::from_be_bytes, |length| length == three),
    }?;
    let colors = match columns.have(&[Red, Green, Blue]) {
        true => Some(table.read([Red, Green, Blue], |given| columns.linear(given))?),
        false => None,
    };
    let opaque = |[alpha]: [f64; 1]| (alpha >= columns.white()).then_some([0_u8]);
    let translucent = colors.is_some() && columns.have(&[Alpha]) && table.read([Alpha], opaque).is_none();
    body.skip(skip);
    Some(PlyTriangles { triangles, colors, translucent })
}

/// Layout of an element whose rows are triangles, in a binary file.
struct TriangleLayout {
    /// Bytes of a row before the list.
    before: usize,
    /// Type of the list's length.
    length: ScalarType,
    /// Bytes per row of one triangle.
    stride: usize,
    /// Role, type and byte offset of each colour channel.
    places: Vec<(PropertyRole, ScalarType, usize)>,
}

fn layout(element: &Element, columns: &Columns<'_>) -> Option<TriangleLayout> {
    let (mut before, mut list, mut stride, mut places) = (0, None, 0, Vec::new());
    for (property, role) in element.properties.iter().zip(columns.roles()) {
        match (property.list, role) {
            (None, Red | Green | Blue | Alpha) => {
                places.push((role, property.kind, stride));
                stride += property.kind.bytes();
            }
            (None, PropertyRole::Unused) => stride += property.kind.bytes(),
            (Some(length), PropertyRole::Corners) if list.is_none() => {
                if !matches!(property.kind, ScalarType::I32 | ScalarType::U32) {
                    return None;
                }
                (before, list) = (stride, Some(length));
                stride += length.bytes() + 12;
            }
            _ => return None,
        }
    }
    Some(TriangleLayout { before, length: list?, stride, places })
}

/// Bytes per row, as in [`layout`].
pub(crate) fn stride(element: &Element, columns: &Columns<'_>) -> Option<usize> {
    layout(element, columns).map(|layout| layout.stride)
}

struct TriangleRows<'a> {
    bytes: ByteSource<'a>,
    stride: usize,
    /// Byte range of the list's length in a row; the corners follow.
    three: Range<usize>,
    /// Number of vertices.
    vertices: usize,
}

impl TriangleRows<'_> {
    /// The triangles, if all faces are triangles.
    fn read(
        &self,
        word: impl Fn([u8; 4]) -> u32 + Sync,
        is_three: impl Fn(&[u8]) -> bool + Sync,
    ) -> Option<Vec<[u32; 3]>> {
        let mut triangles = vec![[0; 3]; self.bytes.len() / self.stride];
        let block = |first: usize, block: &mut [[u32; 3]]| {
            let (start, count) = (first * self.stride, block.len());
            let (mut whole, mut largest) = (true, 0);
            let window = |number: usize, bytes: &[u8]| {
                let rows = bytes.chunks_exact(self.stride);
                for (to, row) in block[number..].iter_mut().zip(rows) {
                    let &[a, b, c, ..] = row[self.three.end..].as_chunks::<4>().0 else {
                        whole = false;
                        return;
                    };
                    let triangle @ [a, b, c] = [a, b, c].map(&word);
                    // As an unsigned number, a negative index is far above every valid index.
                    largest = largest.max(a).max(b).max(c);
                    whole &= is_three(&row[self.three.clone()]);
                    *to = triangle;
                }
            };
            // A failed read is reported when the rows are read one by one.
            let read = (self.bytes).for_each_window(start, count, self.stride, self.stride, window);
            let all = read.is_ok() && whole && (largest as usize) < self.vertices;
            if all { Ok(()) } else { Err(()) }
        };
        parallel::fill_blocks(&mut triangles, BLOCK_ROWS, block).ok()?;
        Some(triangles)
    }
}
