//! STL (3D Systems, "StereoLithography Interface Specification", 1989), text and binary.
//!
//! Whether it is binary is told by its length, not by how it begins: many binary files begin with "solid" too. Corners at
//! exactly the same place become one vertex. Facet normals follow from the corners and are not read; the two bytes after
//! each binary facet, which some programs use for colours, are passed over.

use std::path::Path;

use glam::DVec3;
use raycam_scene::{Material, Mesh, Model, Part};

use crate::error::FormatError;
use crate::folder::{Folder, Source};
use crate::parallel;
use crate::text::{self, Lines, Words};
use crate::weld::Weld;

/// Before the facets of a binary file: 80 bytes of anything and their number.
const HEADER: usize = 84;
/// A normal, three corners of three float32, and two bytes.
const FACET: usize = 50;
/// Facets that are read at a time.
const BLOCK: usize = 1 << 14;

/// The model in an STL file: one part for each solid that has facets.
pub(crate) fn read(source: &Source, folder: &mut Folder) -> Result<Model, FormatError> {
    let Source { path, bytes } = source;
    let mut notices = Vec::new();
    let solids = if is_binary(bytes) {
        vec![binary(path, bytes, &mut notices)?]
    } else {
        text(path, bytes)?
    };
    let parts: Vec<Part> = solids
        .into_iter()
        .filter(|solid| !solid.triangles.is_empty())
        .map(|solid| Part {
            name: solid.name,
            mesh: Mesh {
                vertices: solid.vertices.places,
                triangles: solid.triangles,
                ..Mesh::default()
            },
            materials: vec![0],
        })
        .collect();
    if parts.is_empty() {
        return Err(FormatError::whole(path, "no facets: nothing to see"));
    }
    let corners: usize = parts.iter().map(|part| 3 * part.mesh.triangles.len()).sum();
    folder.budget.take_elements(path, corners as u64)?;
    let materials = vec![Material::plain(&parts[0].mesh)];
    Ok(Model {
        parts,
        materials,
        textures: Vec::new(),
        notices,
    })
}

/// The triangles of a solid, with corners at the same place made one.
#[derive(Default)]
struct Solid {
    name: String,
    vertices: Weld,
    triangles: Vec<[u32; 3]>,
}

impl Solid {
    fn facet(&mut self, corners: [DVec3; 3]) {
        let triangle = corners.map(|corner| self.vertices.index(corner));
        self.triangles.push(triangle);
    }

    /// Adds the facets of another after these.
    fn append(&mut self, other: Self) {
        let places = other.vertices.places.iter();
        let indices: Vec<u32> = places.map(|&place| self.vertices.index(place)).collect();
        let triangles = other.triangles.iter();
        self.triangles
            .extend(triangles.map(|triangle| triangle.map(|i| indices[i as usize])));
    }
}

fn declared(bytes: &[u8]) -> Option<usize> {
    bytes
        .get(80..HEADER)?
        .try_into()
        .ok()
        .map(|count| u32::from_le_bytes(count) as usize)
}

fn is_binary(bytes: &[u8]) -> bool {
    if declared(bytes).is_some_and(|count| count.checked_mul(FACET) == Some(bytes.len() - HEADER)) {
        return true;
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let start = bytes.trim_ascii_start();
    let solid = start
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // No text has a zero byte.
    !solid || bytes.contains(&0)
}

fn binary(path: &Path, bytes: &[u8], notices: &mut Vec<String>) -> Result<Solid, FormatError> {
    let Some(count) = declared(bytes) else {
        let message = "neither \"solid\" nor the 84 bytes before the facets of a binary STL file";
        return Err(FormatError::whole(path, message));
    };
    let (held, extra) = (
        (bytes.len() - HEADER) / FACET,
        (bytes.len() - HEADER) % FACET,
    );
    // Programs that write without going back leave one of these in the place of the number.
    let unknown = extra == 0 && (count == 0 || count == u32::MAX as usize);
    if count > held && !unknown {
        let message = format!("{count} facets declared, but the file ends after {held}");
        return Err(FormatError::byte(path, bytes.len(), message));
    }
    let mut used = held;
    if count < held && extra != 0 {
        used = count;
        let left = bytes.len() - HEADER - FACET * count;
        notices.push(format!(
            "{}: {left} bytes after the last facet are not used",
            path.display()
        ));
    } else if count != held {
        notices.push(format!(
            "{}: {count} facets declared, {held} found and used",
            path.display()
        ));
    } else if extra != 0 {
        notices.push(format!(
            "{}: {extra} bytes after the last facet are not used",
            path.display()
        ));
    }

    let facets = &bytes[HEADER..].as_chunks::<FACET>().0[..used];
    let blocks: Vec<_> = facets.chunks(BLOCK).enumerate().collect();
    let mut solid = Solid::default();
    for part in parallel::map(&blocks, |&(number, facets)| block(number * BLOCK, facets)) {
        // In order, so that vertices are numbered as if the facets had been read one by one.
        solid.append(part.map_err(|number| {
            let message = format!("facet {number} has a corner that is not finite");
            FormatError::byte(path, HEADER + FACET * number, message)
        })?);
    }
    Ok(solid)
}

/// The facets of a part of a file, which begins with the facet `first`; or the number of one that is not finite.
fn block(first: usize, facets: &[[u8; FACET]]) -> Result<Solid, usize> {
    let mut solid = Solid::default();
    solid.triangles.reserve_exact(facets.len());
    for (number, facet) in (first..).zip(facets) {
        let (words, _) = facet.as_chunks::<4>();
        let float = |i: usize| f64::from(f32::from_le_bytes(words[i]));
        let corners = [3, 6, 9].map(|i| DVec3::new(float(i), float(i + 1), float(i + 2)));
        if !corners.iter().all(|corner| corner.is_finite()) {
            return Err(number);
        }
        solid.facet(corners);
    }
    Ok(solid)
}

/// What a text file is about to say.
#[derive(Clone, Copy, PartialEq)]
enum Expect {
    Solid,
    Facet,
    Loop,
    Vertex,
    EndLoop,
    EndFacet,
}

fn text(path: &Path, bytes: &[u8]) -> Result<Vec<Solid>, FormatError> {
    let mut solids: Vec<Solid> = Vec::new();
    let mut expect = Expect::Solid;
    let (mut corners, mut count) = ([DVec3::ZERO; 3], 0);
    let mut last = 0;
    for (line, text) in Lines::new(text::plain(path, bytes)?) {
        last = line;
        let (key, rest) = text::split_word(text);
        let key = key.to_ascii_lowercase();
        expect = match (expect, &key[..]) {
            (same, b"") => same,
            (Expect::Solid, b"solid") => {
                if solids.len() == 1 << 16 {
                    return Err(FormatError::line(
                        path,
                        line,
                        "more than 65536 solids in one file",
                    ));
                }
                solids.push(Solid {
                    name: text::name(rest),
                    ..Solid::default()
                });
                Expect::Facet
            }
            // The normal follows from the corners.
            (Expect::Facet, b"facet") => Expect::Loop,
            (Expect::Facet, b"endsolid" | b"end") => Expect::Solid,
            (Expect::Loop, b"outer") => Expect::Vertex,
            (Expect::Vertex, b"vertex") => {
                corners[count] = corner(path, line, rest)?;
                count += 1;
                if count == 3 {
                    Expect::EndLoop
                } else {
                    Expect::Vertex
                }
            }
            (Expect::EndLoop, b"endloop") => Expect::EndFacet,
            (Expect::EndFacet, b"endfacet") => {
                count = 0;
                if let Some(solid) = solids.last_mut() {
                    solid.facet(corners);
                }
                Expect::Facet
            }
            (expected, _) => {
                let message = format!(
                    "expected {}, found {}",
                    name(expected),
                    text::shown(text::trim(text))
                );
                return Err(FormatError::line(path, line, message));
            }
        };
    }
    if expect == Expect::Solid {
        return Ok(solids);
    }
    Err(FormatError::line(
        path,
        last,
        format!("the file ends where {} is expected", name(expect)),
    ))
}

fn name(expect: Expect) -> &'static str {
    match expect {
        Expect::Solid => "solid",
        Expect::Facet => "facet or endsolid",
        Expect::Loop => "outer loop",
        Expect::Vertex => "vertex (a facet has three)",
        Expect::EndLoop => "endloop (a facet has three vertices)",
        Expect::EndFacet => "endfacet",
    }
}

fn corner(path: &Path, line: usize, rest: &[u8]) -> Result<DVec3, FormatError> {
    let mut words = Words(rest);
    let mut values = [0.0; 3];
    for value in &mut values {
        *value = words
            .next()
            .and_then(text::number)
            .filter(|v| v.is_finite())
            .ok_or_else(|| {
                let found = text::shown(text::trim(rest));
                FormatError::line(
                    path,
                    line,
                    format!("vertex {found}: expected three finite numbers"),
                )
            })?;
    }
    if let Some(word) = words.next() {
        let message = format!("vertex: {} after three numbers", text::shown(word));
        return Err(FormatError::line(path, line, message));
    }
    Ok(DVec3::from(values))
}
