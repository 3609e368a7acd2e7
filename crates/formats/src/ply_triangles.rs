//! The faces of a binary PLY file, where all of them are triangles of the usual kind: read at once.

use crate::ply_header::{Body, Element};
use crate::ply_kind::Kind;
use crate::ply_rows::{Columns, Meaning};

/// The triangles of an element with one list, of 32-bit vertex indices below `vertices`, and nothing else that is used.
///
/// `None`, and nothing is read, where the element is another or any row is not such a triangle: reading row by row says
/// what is wrong, if anything is.
pub(crate) fn read(
    element: &Element,
    columns: &Columns<'_>,
    body: &mut Body<'_>,
    vertices: usize,
) -> Option<Vec<[u32; 3]>> {
    let (mut before, mut list, mut stride) = (0, None, 0);
    for (property, meaning) in element.properties.iter().zip(columns.meanings()) {
        match (property.list, meaning) {
            (None, Meaning::Nothing) => stride += property.kind.bytes(),
            (Some(length), Meaning::Corners) if list.is_none() => {
                if !matches!(property.kind, Kind::I32 | Kind::U32) {
                    return None;
                }
                (before, list) = (stride, Some(length));
                stride += length.bytes() + 12;
            }
            _ => return None,
        }
    }
    let length = list?;
    let (bytes, big_endian) = body.ahead(element.count.checked_mul(stride)?)?;
    let word: fn([u8; 4]) -> u32 = if big_endian {
        u32::from_be_bytes
    } else {
        u32::from_le_bytes
    };
    let first = before + length.bytes();
    let mut triangles = Vec::with_capacity(element.count);
    let mut whole = true;
    for row in bytes.chunks_exact(stride) {
        let (corners, _) = row[first..].as_chunks::<4>();
        let &[a, b, c, ..] = corners else {
            return None;
        };
        let triangle = [a, b, c].map(word);
        // An index below zero is far above every vertex here.
        whole &= triangle.iter().all(|&index| (index as usize) < vertices);
        whole &= length.number(&row[before..], big_endian) == 3.0;
        triangles.push(triangle);
    }
    if !whole {
        return None;
    }
    body.skip(bytes.len());
    Some(triangles)
}
