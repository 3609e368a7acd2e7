//! STL (3D Systems, "StereoLithography Interface Specification", 1989), text and binary.
//!
//! A file is recognised as binary by its length, not by its first bytes: many binary files begin with "solid" too.
//! Corners at exactly the same place become one vertex. Facet normals follow from the corners and are not read; the two
//! bytes after each binary facet, which some programs use for colours, are skipped.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{Material, Mesh, MeshFile, MeshPart};

use crate::error::FormatError;
use crate::geometry::weld::{self, VertexWelder};
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;
use crate::io::lexer::{self, Lines, Words};

/// Before the facets of a binary file: 80 bytes of anything and their number.
const HEADER_BYTES: usize = 84;
/// A normal, three corners of three float32, and two bytes.
const FACET_BYTES: usize = 50;
/// Facets that are read at a time.
const BLOCK_FACETS: usize = 1 << 14;

/// The model in an STL file: one part for each solid that has facets.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<MeshFile, FormatError> {
    let InputFile { path, bytes, .. } = source;
    let mut notices = Vec::new();
    let solids = if is_binary(source) {
        let corners = 3 * (source.len().saturating_sub(HEADER_BYTES) / FACET_BYTES);
        assets.budget.take_elements(path, corners as u64)?;
        vec![binary(source, &mut notices)?]
    } else {
        let solids = text(path, bytes)?;
        let triangles = solids.iter().map(|solid| solid.triangles.len());
        let corners = 3 * triangles.sum::<usize>();
        assets.budget.take_elements(path, corners as u64)?;
        solids
    };
    let parts: Vec<MeshPart> = solids
        .into_iter()
        .filter(|solid| !solid.triangles.is_empty())
        .map(|solid| MeshPart {
            name: solid.name,
            mesh: Mesh { vertices: solid.vertices, triangles: solid.triangles, ..Mesh::default() },
            materials: vec![0],
        })
        .collect();
    if parts.is_empty() {
        return Err(FormatError::whole(path, "no facets: nothing to see"));
    }
    let materials = vec![Material::for_mesh(&parts[0].mesh)];
    Ok(MeshFile { parts, materials, notices, ..MeshFile::default() })
}

/// The triangles of a solid, with corners at the same place made one.
struct Solid {
    name: String,
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

/// How much of a file has to be in memory: of one that is binary beyond doubt, what is before the facets.
pub(crate) fn head(mut file: &File, size: u64) -> Option<u64> {
    let mut head = [0; HEADER_BYTES];
    file.read_exact(&mut head).ok()?;
    let facets = declared(&head)? as u64 * FACET_BYTES as u64;
    (size == HEADER_BYTES as u64 + facets).then_some(HEADER_BYTES as u64)
}

fn declared(bytes: &[u8]) -> Option<usize> {
    bytes.get(80..HEADER_BYTES)?.try_into().ok().map(|count| u32::from_le_bytes(count) as usize)
}

fn is_binary(source: &InputFile) -> bool {
    let bytes = &source.bytes[..];
    if declared(bytes).is_some_and(|count| count.checked_mul(FACET_BYTES) == Some(source.len() - HEADER_BYTES)) {
        return true;
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let start = bytes.trim_ascii_start();
    let solid = start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // No text has a zero byte.
    !solid || bytes.contains(&0)
}

fn binary(source: &InputFile, notices: &mut Vec<String>) -> Result<Solid, FormatError> {
    let InputFile { path, bytes, .. } = source;
    let Some(count) = declared(bytes) else {
        let message = "neither \"solid\" nor the 84 bytes before the facets of a binary STL file";
        return Err(FormatError::whole(path, message));
    };
    let after = source.len() - HEADER_BYTES;
    let (held, extra) = (after / FACET_BYTES, after % FACET_BYTES);
    // Programs that write without going back leave one of these in the place of the number.
    let unknown = extra == 0 && (count == 0 || count == u32::MAX as usize);
    if count > held && !unknown {
        let message = format!("{count} facets declared, but the file ends after {held}");
        return Err(FormatError::byte(path, source.len(), message));
    }
    let mut used = held;
    if count < held && extra != 0 {
        used = count;
        let left = after - FACET_BYTES * count;
        notices.push(format!("{}: {left} bytes after the last facet are not used", path.display()));
    } else if count != held {
        notices.push(format!("{}: {count} facets declared, {held} found and used", path.display()));
    } else if extra != 0 {
        notices.push(format!("{}: {extra} bytes after the last facet are not used", path.display()));
    }

    let facets = source.part(HEADER_BYTES..HEADER_BYTES + FACET_BYTES * used);
    let read = |first: usize, corners: &mut dyn FnMut([[f32; 3]; 3])| {
        let mut infinite = None;
        let window = |number: usize, bytes: &[u8]| {
            for (number, facet) in (first + number..).zip(bytes.as_chunks::<FACET_BYTES>().0) {
                let (words, _) = facet.as_chunks::<4>();
                let float = |i: usize| f32::from_le_bytes(words[i]);
                let place = |i: usize| [float(i), float(i + 1), float(i + 2)];
                let places = [place(3), place(6), place(9)];
                if !places.as_flattened().iter().all(|v| v.is_finite()) {
                    infinite = infinite.or(Some(number));
                }
                corners(places);
            }
        };
        let count = BLOCK_FACETS.min(used - first);
        let read = facets.for_each_window(first * FACET_BYTES, count, FACET_BYTES, FACET_BYTES, window);
        read.map_err(|source| FormatError::Io { path: path.clone(), source })?;
        infinite.map_or(Ok(()), |number| {
            let message = format!("facet {number} has a corner that is not finite");
            Err(FormatError::byte(path, HEADER_BYTES + FACET_BYTES * number, message))
        })
    };
    let (vertices, triangles) = weld::weld_triangles(used, BLOCK_FACETS, read)?;
    Ok(Solid { name: String::new(), vertices, triangles })
}

/// Statement that a text file has next.
#[derive(Clone, Copy, PartialEq)]
enum ParserState {
    Solid,
    Facet,
    Loop,
    Vertex,
    EndLoop,
    EndFacet,
}

/// The solids of a text file.
fn text(path: &Path, bytes: &[u8]) -> Result<Vec<Solid>, FormatError> {
    let mut solids: Vec<(String, VertexWelder<DVec3>, Vec<[u32; 3]>)> = Vec::new();
    let mut expect = ParserState::Solid;
    let (mut corners, mut count) = ([DVec3::ZERO; 3], 0);
    let mut last = 0;
    for (line, text) in Lines::new(lexer::checked_text(path, bytes)?) {
        last = line;
        let (key, rest) = lexer::split_word(text);
        let key = key.to_ascii_lowercase();
        expect = match (expect, &key[..]) {
            (same, b"") => same,
            (ParserState::Solid, b"solid") => {
                if solids.len() == 1 << 16 {
                    return Err(FormatError::line(path, line, "more than 65536 solids in one file"));
                }
                solids.push((lexer::name(rest), VertexWelder::default(), Vec::new()));
                ParserState::Facet
            }
            // The normal follows from the corners.
            (ParserState::Facet, b"facet") => ParserState::Loop,
            (ParserState::Facet, b"endsolid" | b"end") => ParserState::Solid,
            (ParserState::Loop, b"outer") => ParserState::Vertex,
            (ParserState::Vertex, b"vertex") => {
                corners[count] = corner(path, line, rest)?;
                count += 1;
                if count == 3 { ParserState::EndLoop } else { ParserState::Vertex }
            }
            (ParserState::EndLoop, b"endloop") => ParserState::EndFacet,
            (ParserState::EndFacet, b"endfacet") => {
                count = 0;
                if let Some((_, weld, triangles)) = solids.last_mut() {
                    triangles.push(corners.map(|corner| weld.insert(corner)));
                }
                ParserState::Facet
            }
            (expected, _) => {
                let message = format!("expected {}, found {}", name(expected), lexer::for_message(lexer::trim(text)));
                return Err(FormatError::line(path, line, message));
            }
        };
    }
    if expect == ParserState::Solid {
        let solid = |(name, weld, triangles): (_, VertexWelder<_>, _)| Solid { name, vertices: weld.points, triangles };
        return Ok(solids.into_iter().map(solid).collect());
    }
    Err(FormatError::line(path, last, format!("the file ends where {} is expected", name(expect))))
}

fn name(expect: ParserState) -> &'static str {
    match expect {
        ParserState::Solid => "solid",
        ParserState::Facet => "facet or endsolid",
        ParserState::Loop => "outer loop",
        ParserState::Vertex => "vertex (a facet has three)",
        ParserState::EndLoop => "endloop (a facet has three vertices)",
        ParserState::EndFacet => "endfacet",
    }
}

fn corner(path: &Path, line: usize, rest: &[u8]) -> Result<DVec3, FormatError> {
    let mut words = Words(rest);
    let mut values = [0.0; 3];
    for value in &mut values {
        *value = words.next().and_then(lexer::number).filter(|v| v.is_finite()).ok_or_else(|| {
            let found = lexer::for_message(lexer::trim(rest));
            FormatError::line(path, line, format!("vertex {found}: expected three finite numbers"))
        })?;
    }
    if let Some(word) = words.next() {
        let message = format!("vertex: {} after three numbers", lexer::for_message(word));
        return Err(FormatError::line(path, line, message));
    }
    Ok(DVec3::from(values))
}
