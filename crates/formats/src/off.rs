//! OFF (Geomview, "OFF Files"): text, with the prefixes ST, C and N for texture coordinates, colours and normals.
//!
//! If all colour values of a file are whole numbers, they are sRGB in 0..=255; otherwise, or if no value exceeds 1,
//! they are linear in 0..=1. Texture coordinates have their origin at the bottom left in the file and at the top left
//! here.

use std::path::Path;

use glam::DVec3;
use raycam_scene::color::{Rgb, linear_from_srgb};
use raycam_scene::{ErrorCode, Mesh, MeshFile, Message, Notice, NoticeCode, counted};

use crate::error::{FormatError, Location, Result};
use crate::geometry::colors;
use crate::geometry::directionless;
use crate::geometry::polygons::{DegenerateFaces, Polygons};
use crate::geometry::vertex_dedup::Corner;
use crate::io::lexer::{self, Lines, Words};
use crate::io::{AssetRoot, Diagnostics, InputFile};

/// Attributes that follow each vertex's position, in this order; the first word of the file specifies which exist.
#[derive(Clone, Copy, Debug, Default)]
struct OffHeader {
    normals: bool,
    colors: bool,
    uvs: bool,
}

/// Reads the model in an OFF file: one part.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<MeshFile> {
    let path = &source.path;
    let text = lexer::plain_text(&source.bytes);
    let mut rows = LineReader { path, lines: Lines::new(&text), line: 0, odd: Diagnostics::default() };
    let (header, [count, face_count]) = rows.header()?;
    // A vertex row has at least three digits, each followed by a space or line end.
    let left = rows.lines.remaining() + 1;
    if count.checked_mul(6).is_none_or(|n| n > left) || face_count.checked_mul(4).is_none_or(|n| n > left) {
        let message = format!("{count} vertices and {face_count} faces declared, but only {left} bytes follow");
        return Err(rows.error(ErrorCode::ImplausibleSize.message(message)));
    }
    assets.budget.take_elements(path, count as u64)?;

    let vertices = read_vertices(&mut rows, header, count)?;
    let faces = read_faces(&mut rows, count, face_count)?;
    let mut notices: Vec<Notice> = faces.degenerate.notice(path).into_iter().collect();
    if rows.lines.any(|(_, text)| Words(text).next().is_some()) {
        notices.push(Notice::new(
            NoticeCode::TrailingData,
            format!("{}: the lines after the last face are ignored", path.display()),
        ));
    }
    if faces.polygons.len() == 0 {
        return Err(FormatError::whole(
            path,
            ErrorCode::NothingVisible
                .message(format!("no faces, only {}; there is nothing to render", counted(count, "vertex"))),
        ));
    }
    let face_colors = faces.colors.linear("face", path, &mut notices);
    let (mut triangles, mut colors) = (Vec::new(), Vec::new());
    let positions = vertices.positions;
    let position = |c: Corner| positions[c.position as usize];
    faces.polygons.triangles(0..faces.polygons.len(), path, &mut assets.budget, position, |polygon, triangle| {
        triangles.push(triangle.map(|corner| corner.position));
        colors.extend(face_colors.as_ref().map(|colors| colors[polygon]));
    })?;
    let mut mesh = Mesh {
        triangles,
        face_colors: face_colors.map(|_| colors),
        vertex_colors: vertices.colors.linear("vertex", path, &mut notices),
        normals: (!vertices.normals.is_empty()).then_some(vertices.normals),
        uvs: header.uvs.then_some(vertices.uvs),
        vertices: positions,
        ..Mesh::default()
    };
    let chosen = colors::choose(&mut mesh);
    let filled = directionless::fill_normals(&mut mesh);
    let filled = (filled > 0).then(|| {
        let message = format!("{} replaced by the faces' normals: no direction", counted(filled, "normal"));
        Notice::new(NoticeCode::ReplacedValue, message)
    });
    notices.extend([chosen, filled].into_iter().flatten().map(|note| note.in_context(path.display())));
    notices.extend(rows.odd.into_notices(path));
    Ok(MeshFile::from_mesh(mesh, notices))
}

/// Vertices of a file.
#[derive(Default)]
struct OffVertices {
    positions: Vec<DVec3>,
    /// Normals of unit length, or zero if the file's normal has no direction.
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    colors: OffColors,
}

fn read_vertices(rows: &mut LineReader<'_>, header: OffHeader, vertices: usize) -> Result<OffVertices> {
    let mut all = OffVertices::default();
    for number in 0..vertices {
        let mut words = rows.next("vertices", number, vertices)?;
        all.positions.push(DVec3::from(rows.numbers(&mut words, "vertex", number)?));
        if header.normals {
            let normal = DVec3::from(rows.numbers(&mut words, "normal", number)?);
            all.normals.push(normal.normalize_or_zero().as_vec3().to_array());
        }
        let rest: Vec<&[u8]> = words.collect();
        let (color, uv) = rest.split_at(rest.len() - if header.uvs { rest.len().min(2) } else { 0 });
        // Many files contain colours without the prefix.
        if header.colors || !color.is_empty() {
            all.colors.add(rows, number, color)?;
        }
        if header.uvs {
            let [u, v] = uv[..] else {
                return Err(
                    rows.error(ErrorCode::MissingValue.message(format!("vertex {number} has no texture coordinates")))
                );
            };
            let mut uv = [rows.number(u, "vertex", number)?, rows.number(v, "vertex", number)?];
            if !uv.iter().all(|value| value.is_finite()) {
                rows.odd.note(
                    NoticeCode::ReplacedValue,
                    Location::Line(rows.line),
                    "a texture coordinate is not finite; treated as 0 0",
                );
                uv = [0.0; 2];
            }
            all.uvs.push([uv[0] as f32, (1.0 - uv[1]) as f32]);
        }
    }
    Ok(all)
}

/// Faces of a file.
#[derive(Default)]
struct OffFaces {
    polygons: Polygons,
    degenerate: DegenerateFaces,
    colors: OffColors,
}

fn read_faces(rows: &mut LineReader<'_>, vertices: usize, faces: usize) -> Result<OffFaces> {
    let mut all = OffFaces::default();
    for number in 0..faces {
        let mut words = rows.next("faces", number, faces)?;
        let size = words.next().and_then(lexer::integer).unwrap_or(-1);
        if size < 0 {
            return Err(rows.error(
                ErrorCode::WrongType
                    .message(format!("face {number}: expected the number of corners, a whole number >= 0")),
            ));
        }
        for corner in 0..size {
            let Some(word) = rows.word(&mut words) else {
                return Err(rows.error(
                    ErrorCode::TruncatedFile.message(format!("face {number} ends after {corner} of {size} corners")),
                ));
            };
            match lexer::integer(word).and_then(|i| usize::try_from(i).ok()) {
                Some(index) if index < vertices => all.polygons.push_corner(Corner::plain(index as u32)),
                _ => {
                    let message = format!(
                        "face {number}: vertex {}, but the file has {vertices} vertices (numbered from 0)",
                        lexer::for_message(word)
                    );
                    return Err(rows.error(ErrorCode::IndexOutOfRange.message(message)));
                }
            }
        }
        if all.polygons.end_face() {
            let color: Vec<&[u8]> = words.collect();
            all.colors.add(rows, number, &color)?;
        } else {
            all.degenerate.add(|| format!("line {}", rows.line));
        }
    }
    Ok(all)
}

/// Reads the lines that are neither empty nor comments, one by one.
struct LineReader<'a> {
    path: &'a Path,
    lines: Lines<'a>,
    line: usize,
    odd: Diagnostics,
}

impl<'a> LineReader<'a> {
    fn error(&self, message: impl Into<Message>) -> FormatError {
        FormatError::line(self.path, self.line, message)
    }

    fn words(&mut self) -> Option<Words<'a>> {
        let (line, text) = self.lines.find(|(_, text)| Words(text).next().is_some())?;
        self.line = line;
        Some(Words(text))
    }

    /// Next word of a face, which may continue in the next line.
    fn word(&mut self, words: &mut Words<'a>) -> Option<&'a [u8]> {
        if let Some(word) = words.next() {
            return Some(word);
        }
        *words = self.words()?;
        words.next()
    }

    fn next(&mut self, what: &str, number: usize, declared: usize) -> Result<Words<'a>> {
        let end = format!("the file ends after {number} of {declared} {what}");
        self.words().ok_or_else(|| self.error(ErrorCode::TruncatedFile.message(end)))
    }

    /// Reads the header: the vertex attributes, and the numbers of vertices and faces; the number of edges is optional
    /// and ignored.
    fn header(&mut self) -> Result<(OffHeader, [usize; 2])> {
        let mut words = self
            .words()
            .ok_or_else(|| self.error(ErrorCode::EmptyFile.message("the file is empty; expected an OFF file")))?;
        let mut kind = OffHeader::default();
        let first = words.clone().next().unwrap_or_default();
        // The word OFF may be missing, or the numbers may follow it without a space, as in ModelNet.
        if lexer::integer(first).is_none() {
            let end = first.windows(3).position(|window| window == b"OFF");
            let parts = end.map(|at| (&first[..at], &first[at + 3..]));
            let Some((mut prefix, glued)) = parts.filter(|(_, glued)| glued.iter().all(u8::is_ascii_digit)) else {
                return Err(self
                    .error(ErrorCode::WrongFormat.message(format!("{}: not an OFF file", lexer::for_message(first)))));
            };
            let line = words.0;
            words.next();
            words = Words(&line[line.len() - words.0.len() - glued.len()..]);
            for (letters, has) in [(&b"ST"[..], &mut kind.uvs), (b"C", &mut kind.colors), (b"N", &mut kind.normals)] {
                if let Some(rest) = prefix.strip_prefix(letters) {
                    *has = true;
                    prefix = rest;
                }
            }
            if !prefix.is_empty() {
                let message = format!(
                    "{}: unsupported kind of OFF file; expected three dimensions (OFF, COFF, NOFF, STOFF or a \
                     combination)",
                    lexer::for_message(first)
                );
                return Err(FormatError::unsupported(self.path, message));
            }
            match words.clone().next() {
                Some(b"BINARY") => {
                    return Err(FormatError::unsupported(
                        self.path,
                        "binary OFF is not supported; save the file as \
                        text",
                    ));
                }
                Some(_) => {}
                None => {
                    words = self.words().ok_or_else(|| {
                        self.error(ErrorCode::MissingValue.message("the numbers of vertices and faces are missing"))
                    })?
                }
            }
        }
        let mut count = || words.next().and_then(lexer::integer).and_then(|n| usize::try_from(n).ok());
        match (count(), count()) {
            (Some(vertices), Some(faces)) => Ok((kind, [vertices, faces])),
            _ => Err(self.error("expected the numbers of vertices, faces and edges")),
        }
    }

    fn number(&self, word: &[u8], what: &str, number: usize) -> Result<f64> {
        lexer::number(word).ok_or_else(|| {
            self.error(ErrorCode::WrongType.message(format!("{what} {number}: {}", lexer::not_a_number(word))))
        })
    }

    fn numbers(&self, words: &mut Words<'_>, what: &str, number: usize) -> Result<[f64; 3]> {
        let mut values = [0.0; 3];
        for value in &mut values {
            let word = words.next().ok_or_else(|| {
                self.error(ErrorCode::WrongShape.message(format!("{what} {number}: expected 3 numbers")))
            })?;
            *value = self.number(word, what, number)?;
        }
        Ok(values)
    }
}

/// Colours whose range is known only after all colours have been read.
#[derive(Default)]
struct OffColors {
    /// Colour values as in the file; NaN for a missing colour.
    values: Vec<[f64; 3]>,
    missing: usize,
    /// Number of colours that are given as indices into a colour map.
    mapped: usize,
    fractions: bool,
    translucent: usize,
    largest: f64,
    /// Number of values that are negative or not numbers.
    odd: usize,
}

impl OffColors {
    fn add(&mut self, rows: &LineReader<'_>, number: usize, words: &[&[u8]]) -> Result<()> {
        match words.len() {
            3 | 4 => {}
            count @ (0 | 1) => {
                self.missing += 1;
                self.mapped += count;
                self.values.push([f64::NAN; 3]);
                return Ok(());
            }
            count => {
                return Err({
                    let message = format!("colour {number} has {}; expected 3 or 4", counted(count, "number"));
                    rows.error(ErrorCode::WrongShape.message(message))
                });
            }
        }
        let mut rgba = [0.0, 0.0, 0.0, f64::NAN];
        for (value, word) in rgba.iter_mut().zip(words) {
            *value = rows.number(word, "colour", number)?;
            self.fractions |= lexer::integer(word).is_none();
            if !value.is_finite() || *value < 0.0 {
                self.odd += 1;
                *value = 0.0;
            }
            self.largest = self.largest.max(*value);
        }
        let [r, g, b, a] = rgba;
        self.translucent += usize::from(a < 1.0 || !self.fractions && a < 255.0);
        self.values.push([r, g, b]);
        Ok(())
    }

    /// Linear colours, with white for missing colours; `None` if there are no colours at all.
    fn linear(self, what: &str, path: &Path, notices: &mut Vec<Notice>) -> Option<Vec<Rgb>> {
        let shown = path.display();
        if self.mapped > 0 {
            notices.push(Notice::new(
                NoticeCode::MissingColors,
                format!("{shown}: {} shown in white: colour map indices are not supported", counted(self.mapped, what)),
            ));
        }
        if self.missing == self.values.len() {
            return None;
        }
        if self.missing > self.mapped {
            let missing = self.missing - self.mapped;
            notices.push(Notice::new(
                NoticeCode::MissingColors,
                format!("{shown}: {} shown in white: no colour", counted(missing, what)),
            ));
        }
        if self.translucent > 0 {
            notices.push(Notice::new(
                NoticeCode::IgnoredTransparency,
                format!("{shown}: the transparency of {} is ignored", counted(self.translucent, what)),
            ));
        }
        let largest = self.largest;
        if largest > 255.0 {
            notices.push(Notice::new(
                NoticeCode::ReplacedValue,
                format!(
                    "{shown}: all {what} colours are ignored, because the largest value is {largest}; expected 0 to 255"
                ),
            ));
            return None;
        }
        if self.odd > 0 {
            let odd = self.odd;
            notices.push(Notice::new(
                NoticeCode::ReplacedValue,
                format!(
                    "{shown}: {what} colours that are negative or not finite are treated as 0 ({})",
                    counted(odd, "value")
                ),
            ));
        }
        let bytes = largest > if self.fractions { 1.01 } else { 1.0 };
        if bytes && self.fractions {
            notices.push(Notice::new(
                NoticeCode::AssumedConvention,
                format!("{shown}: the {what} colours contain fractions up to {largest} and are read as 0 to 255"),
            ));
        } else if largest > 1.0 && !bytes {
            notices.push(Notice::new(
                NoticeCode::ClampedValue,
                format!("{shown}: the {what} colours contain values up to {largest}, which are clamped to 1"),
            ));
        }
        let linear = |c: f64| match (c.is_nan(), bytes) {
            (true, _) => 1.0,
            (false, true) => linear_from_srgb((c / 255.0) as f32),
            (false, false) => c.min(1.0) as f32,
        };
        Some(self.values.into_iter().map(|rgb| rgb.map(linear)).collect())
    }
}
