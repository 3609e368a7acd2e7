//! STL (3D Systems, "StereoLithography Interface Specification", 1989), text and binary.
//!
//! A file is recognised as binary by its length instead of its first bytes, because many binary files also begin with
//! "solid". Corners at exactly the same position become one vertex. Facet normals follow from the corners and are
//! ignored. The two bytes after each binary facet are colours if bit 15 is set (VisCAM, SolidView) or the header
//! contains `COLOR=` (Materialise Magics): five bits per channel, sRGB. If no facet has a colour, the header's colour
//! is the material's base colour.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::atomic::{AtomicU16, Ordering};

use glam::DVec3;
use raycam_scene::color::{Rgb, linear_from_srgb, linear_from_srgb8};
use raycam_scene::{ErrorCode, Material, Mesh, MeshFile, MeshPart, Notice, NoticeCode, counted};

use crate::error::{FormatError, Location, Result};
use crate::geometry::ear_clipping;
use crate::geometry::weld::{self, VertexWelder};
use crate::io::lexer::{self, Lines, Words};
use crate::io::{AssetRoot, ByteSource, Diagnostics, InputFile};

/// Bytes before the facets of a binary file: 80 arbitrary bytes and the number of facets.
const HEADER_BYTES: usize = 84;
/// Bytes of a facet: a normal and three corners of three float32 each, and two further bytes.
const FACET_BYTES: usize = 50;
/// Limit on the work to divide a facet with more than three vertices into triangles.
const MAX_POLYGON_STEPS: u64 = 1 << 24;
/// Number of a word's first bytes that are compared with keywords: one more than the longest keyword, `endsolid`, has.
const KEYWORD_BYTES: usize = 9;
/// Number of facets that are read at a time.
const BLOCK_FACETS: usize = 1 << 14;

/// Reads the model in an STL file: one part for each solid that has facets.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<MeshFile> {
    let InputFile { path, bytes, .. } = source;
    let mut notices = Vec::new();
    let solids = if is_binary(source) {
        let corners = 3 * (source.len().saturating_sub(HEADER_BYTES) / FACET_BYTES);
        assets.budget.take_elements(path, corners as u64)?;
        vec![binary(source, &mut notices)?]
    } else {
        let solids = text(path, bytes, &mut notices)?;
        let triangles = solids.iter().map(|solid| solid.triangles.len());
        let corners = 3 * triangles.sum::<usize>();
        assets.budget.take_elements(path, corners as u64)?;
        solids
    };
    let whole = solids.first().and_then(|solid| solid.color);
    let parts: Vec<MeshPart> = solids
        .into_iter()
        .filter(|solid| !solid.triangles.is_empty())
        .map(|solid| MeshPart {
            name: solid.name,
            mesh: Mesh {
                vertices: solid.vertices,
                triangles: solid.triangles,
                face_colors: solid.colors,
                ..Mesh::default()
            },
            materials: vec![0],
        })
        .collect();
    if parts.is_empty() {
        return Err(FormatError::whole(
            path,
            ErrorCode::NothingVisible.message("no facets; there is nothing to render"),
        ));
    }
    let mut material = Material::for_mesh(&parts[0].mesh);
    material.color = whole.unwrap_or(material.color);
    Ok(MeshFile { parts, materials: vec![material], notices, ..MeshFile::default() })
}

/// Triangles of a solid, with corners at the same position merged.
struct Solid {
    name: String,
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Linear colours of the triangles.
    colors: Option<Vec<Rgb>>,
    /// Linear colour of the whole object, if no triangle has its own.
    color: Option<Rgb>,
}

/// Number of bytes of a file that must be in memory: for a file that is certainly binary, the bytes before the facets.
pub(crate) fn head(mut file: &File, size: u64) -> Option<u64> {
    let mut head = [0; HEADER_BYTES];
    file.read_exact(&mut head).ok()?;
    let facets = declared(&head)? as u64 * FACET_BYTES as u64;
    (size == HEADER_BYTES as u64 + facets).then_some(HEADER_BYTES as u64)
}

fn declared(bytes: &[u8]) -> Option<usize> {
    bytes.get(80..HEADER_BYTES)?.try_into().ok().map(|count| u32::from_le_bytes(count) as usize)
}

/// True if a file has exactly the length of a binary file with the declared number of facets.
pub(crate) fn has_binary_length(bytes: &[u8]) -> bool {
    let facets = declared(bytes).filter(|&facets| facets > 0).and_then(|facets| facets.checked_mul(FACET_BYTES));
    facets.is_some_and(|facets| Some(facets) == bytes.len().checked_sub(HEADER_BYTES))
}

fn is_binary(source: &InputFile) -> bool {
    let bytes = &source.bytes[..];
    if declared(bytes).is_some_and(|count| count.checked_mul(FACET_BYTES) == Some(source.len() - HEADER_BYTES)) {
        return true;
    }
    let text = lexer::plain_text(bytes);
    let first = Lines::new(&text).map(|(_, line)| lexer::trim(line)).find(|line| !line.is_empty() && !is_comment(line));
    let begins = |word: &[u8]| word.eq_ignore_ascii_case(b"solid") || word.eq_ignore_ascii_case(b"facet");
    let solid = first.and_then(|line| line.get(..5)).is_some_and(begins);
    // A zero byte means that the file is binary, because text contains no zero bytes.
    !solid || text.contains(&0)
}

/// True for an additional line that some programs write before or between the statements of a text file.
fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b"#") || line.starts_with(b";") || line.starts_with(b"//")
}

fn binary(source: &InputFile, notices: &mut Vec<Notice>) -> Result<Solid> {
    let InputFile { path, bytes, .. } = source;
    let Some(count) = declared(bytes) else {
        let message = "neither \"solid\" nor the 84 bytes that precede the facets of a binary STL file";
        return Err(FormatError::whole(path, ErrorCode::WrongFormat.message(message)));
    };
    let after = source.len() - HEADER_BYTES;
    let (held, extra) = (after / FACET_BYTES, after % FACET_BYTES);
    // Programs that write sequentially do not know the number of facets and write one of these values.
    let unknown = extra == 0 && (count == 0 || count == u32::MAX as usize);
    if count > held && !unknown {
        let message = format!("the header declares {count} facets, but the file ends after {held}");
        return Err(FormatError::byte(path, source.len(), ErrorCode::TruncatedFile.message(message)));
    }
    let mut used = held;
    if count < held && extra != 0 {
        used = count;
        let left = after - FACET_BYTES * count;
        notices.push(Notice::new(
            NoticeCode::TrailingData,
            format!("{}: {} after the last facet ignored", path.display(), counted(left, "byte")),
        ));
    } else if count != held {
        notices.push(Notice::new(
            NoticeCode::TruncatedData,
            format!("{}: the header declares {count} facets; all {held} facets of the file are used", path.display()),
        ));
    } else if extra != 0 {
        notices.push(Notice::new(
            NoticeCode::TrailingData,
            format!("{}: {} after the last facet ignored", path.display(), counted(extra, "byte")),
        ));
    }

    let facets = source.part(HEADER_BYTES..HEADER_BYTES + FACET_BYTES * used);
    let all_attributes = AtomicU16::new(0);
    let read = |first: usize, corners: &mut dyn FnMut([[f32; 3]; 3])| {
        let mut attributes = 0;
        let window = |_, bytes: &[u8]| {
            for facet in bytes.as_chunks::<FACET_BYTES>().0 {
                let (words, _) = facet.as_chunks::<4>();
                let float = |i: usize| f32::from_le_bytes(words[i]);
                let place = |i: usize| [float(i), float(i + 1), float(i + 2)];
                attributes |= attribute(facet);
                // A triangle with a corner that is not finite is omitted later.
                corners([place(3), place(6), place(9)]);
            }
        };
        let count = BLOCK_FACETS.min(used - first);
        let read = facets.for_each_window(first * FACET_BYTES, count, FACET_BYTES, FACET_BYTES, window);
        read.map_err(|source| FormatError::Io { path: path.clone(), source })?;
        all_attributes.fetch_or(attributes, Ordering::Relaxed);
        Ok::<(), FormatError>(())
    };
    let (vertices, triangles) = weld::weld_triangles(used, BLOCK_FACETS, read)?;
    let any = all_attributes.load(Ordering::Relaxed) != 0;
    let whole = header_color(&bytes[..80]);
    let colors = if any { facet_colors(path, whole, &facets, used, notices)? } else { None };
    let color = whole.filter(|_| colors.is_none()).map(|[r, g, b, _]| linear_from_srgb8([r, g, b]));
    if whole.is_some_and(|[.., alpha]| alpha < 255) {
        notices.push(Notice::new(
            NoticeCode::IgnoredTransparency,
            format!("{}: the transparency of the header's colour is ignored", path.display()),
        ));
    }
    Ok(Solid { name: String::new(), vertices, triangles, colors, color })
}

/// Value of the two bytes after a facet's corners.
fn attribute(facet: &[u8; FACET_BYTES]) -> u16 {
    u16::from_le_bytes([facet[48], facet[49]])
}

/// Linear colour from five bits per channel, beginning with the lowest bits.
fn color_of_bits(bits: u16) -> Rgb {
    [0, 5, 10].map(|shift| linear_from_srgb(f32::from(bits >> shift & 31) / 31.0))
}

/// Red, green, blue and alpha of the whole object from the header. Some programs write no alpha, but a space between
/// the colour and the next word; these colours are opaque.
fn header_color(header: &[u8]) -> Option<[u8; 4]> {
    const COLOR: &[u8] = b"COLOR=";
    let at = header.windows(COLOR.len()).position(|window| window == COLOR)? + COLOR.len();
    let &[r, g, b, alpha] = header.get(at..at + 4)?.first_chunk::<4>()?;
    let is_opaque = header[at + 3..].starts_with(b" MATERIAL=");
    Some([r, g, b, if is_opaque { 255 } else { alpha }])
}

/// Colours of the facets; `None` if the two bytes after each facet are not colours. `whole` is the colour in the
/// header.
fn facet_colors(
    path: &Path,
    whole: Option<[u8; 4]>,
    facets: &ByteSource<'_>,
    count: usize,
    notices: &mut Vec<Notice>,
) -> Result<Option<Vec<Rgb>>> {
    let mut attributes = Vec::with_capacity(count);
    let window = |_, bytes: &[u8]| attributes.extend(bytes.as_chunks::<FACET_BYTES>().0.iter().map(attribute));
    let read = facets.for_each_window(0, count, FACET_BYTES, FACET_BYTES, window);
    read.map_err(|source| FormatError::Io { path: path.into(), source })?;
    const OWN: u16 = 1 << 15;
    if let Some([r, g, b, _]) = whole {
        let whole = linear_from_srgb8([r, g, b]);
        // In Magics files, bit 15 means that the facet has the colour of the whole object.
        let of = |&bits: &u16| if bits & OWN != 0 { whole } else { color_of_bits(bits) };
        return Ok(Some(attributes.iter().map(of).collect()));
    }
    let without = attributes.iter().filter(|&&bits| bits & OWN == 0).count();
    if without == count {
        let odd = attributes.iter().filter(|&&bits| bits != 0).count();
        notices.push(Notice::new(
            NoticeCode::IgnoredKey,
            format!(
                "{}: the attribute bytes of {} are not colours and are ignored",
                path.display(),
                counted(odd, "facet")
            ),
        ));
        return Ok(None);
    }
    if without > 0 {
        notices.push(Notice::new(
            NoticeCode::MissingColors,
            format!("{}: {} shown in grey: no colour", path.display(), counted(without, "facet")),
        ));
    }
    // In VisCAM files, blue is in the lowest bits.
    let of = |&bits: &u16| {
        let [b, g, r] = color_of_bits(bits);
        if bits & OWN == 0 { [0.8; 3] } else { [r, g, b] }
    };
    Ok(Some(attributes.iter().map(of).collect()))
}

/// State of the parser: the statement that it expects next.
#[derive(Clone, Copy, PartialEq)]
enum ParserState {
    Solid,
    Facet,
    Loop,
    Vertex,
    EndLoop,
    EndFacet,
}

impl ParserState {
    /// Statement that this state expects.
    fn statement(self) -> Statement {
        match self {
            Self::Solid => Statement::Solid,
            Self::Facet => Statement::Facet,
            Self::Loop => Statement::Loop,
            Self::Vertex => Statement::Vertex,
            Self::EndLoop => Statement::EndLoop,
            Self::EndFacet => Statement::EndFacet,
        }
    }
}

/// Statement of a text file.
#[derive(Clone, Copy, PartialEq)]
enum Statement {
    Solid,
    Facet,
    Loop,
    Vertex,
    EndLoop,
    EndFacet,
    EndSolid,
    Blank,
    Unknown,
}

impl Statement {
    /// Statement in a line, and the text after its keyword. `end loop` is read as `endloop`, and `endsolidNAME` as
    /// `endsolid NAME`.
    fn parse(line: &[u8]) -> (Self, &[u8]) {
        let (word, rest) = lexer::split_word(line);
        // The rest of a longer word is not used: it belongs to a comment, an unknown word, or a name without a space after
        // `solid` or `endsolid`.
        let mut lower = [0; KEYWORD_BYTES];
        let key = &mut lower[..word.len().min(KEYWORD_BYTES)];
        key.copy_from_slice(&word[..key.len()]);
        key.make_ascii_lowercase();
        let statement = match &*key {
            b"" => Self::Blank,
            key if is_comment(key) => Self::Blank,
            b"solid" => Self::Solid,
            b"facet" => Self::Facet,
            b"outer" => Self::Loop,
            b"vertex" => Self::Vertex,
            b"endloop" => Self::EndLoop,
            b"endfacet" => Self::EndFacet,
            b"end" => {
                let (key, rest) = lexer::split_word(rest);
                return match &key.to_ascii_lowercase()[..] {
                    b"loop" => (Self::EndLoop, rest),
                    b"facet" => (Self::EndFacet, rest),
                    b"solid" => (Self::EndSolid, rest),
                    _ => (Self::Unknown, rest),
                };
            }
            key if key.starts_with(b"endsolid") => Self::EndSolid,
            key if key.starts_with(b"solid") => Self::Solid,
            _ => Self::Unknown,
        };
        (statement, rest)
    }
}

/// State of reading a text file line by line.
struct TextParser<'a> {
    path: &'a Path,
    solids: Vec<(String, VertexWelder<DVec3>, Vec<[u32; 3]>)>,
    expect: ParserState,
    corners: [DVec3; 3],
    count: usize,
    /// Further corners of a facet with more than three vertices.
    further: Vec<DVec3>,
    odd: Diagnostics,
}

impl TextParser<'_> {
    fn begin_solid(&mut self, line: usize, name: String) -> Result<bool> {
        if self.solids.len() == 1 << 16 {
            return Err(FormatError::line(
                self.path,
                line,
                ErrorCode::TooLarge.message("more than 65536 solids in one file; divide the file"),
            ));
        }
        self.solids.push((name, VertexWelder::default(), Vec::new()));
        self.expect = ParserState::Facet;
        Ok(true)
    }

    fn note(&mut self, line: usize, message: &str) {
        self.odd.note(NoticeCode::InvalidFile, Location::Line(line), message);
    }

    fn line(&mut self, line: usize, text: &[u8]) -> Result<()> {
        let (statement, rest) = Statement::parse(text);
        if statement == Statement::Blank {
            return Ok(());
        }
        if statement == Statement::Unknown {
            let (key, _) = lexer::split_word(text);
            let message = format!("lines that begin with {} are ignored", lexer::for_message(key));
            self.odd.note(NoticeCode::IgnoredKey, Location::Line(line), message);
            return Ok(());
        }
        while self.is_missing(statement) {
            self.note(line, &format!("expected {} before this line; it is assumed", name(self.expect)));
            self.statement(line, self.expect.statement(), b"")?;
        }
        if self.is_repeated(statement) {
            self.note(line, "a repeated line is ignored");
            return Ok(());
        }
        if !self.statement(line, statement, rest)? {
            let found = lexer::for_message(lexer::trim(text));
            return Err(FormatError::line(self.path, line, format!("expected {}, found {found}", name(self.expect))));
        }
        Ok(())
    }

    /// True if the file omits a statement without data, such as `outer loop`, before this statement.
    fn is_missing(&self, statement: Statement) -> bool {
        use {ParserState as P, Statement as S};
        matches!(
            (self.expect, statement),
            (P::Loop, S::Vertex)
                | (P::Facet, S::Loop)
                | (P::EndLoop, S::EndFacet | S::Facet | S::EndSolid)
                | (P::EndFacet, S::Facet | S::EndSolid | S::Solid)
        )
    }

    /// True if the statement repeats the previous statement.
    fn is_repeated(&self, statement: Statement) -> bool {
        use {ParserState as P, Statement as S};
        matches!(
            (self.expect, statement),
            (P::EndFacet, S::EndLoop) | (P::Facet, S::EndFacet) | (P::Solid, S::EndSolid)
        ) || (self.expect, statement, self.count) == (P::Vertex, S::Loop, 0)
    }

    /// Adds the triangles of a facet with more than three vertices.
    fn add_polygon(&mut self, line: usize) -> Result<()> {
        let corners = [&self.corners[..], &std::mem::take(&mut self.further)].concat();
        let (mut parts, mut steps) = (Vec::new(), MAX_POLYGON_STEPS);
        ear_clipping::triangulate(&corners, &mut steps, &mut parts).map_err(|_| {
            let message = format!("a facet with {} cannot be divided into triangles", counted(corners.len(), "vertex"));
            FormatError::line(self.path, line, ErrorCode::TooLarge.message(message))
        })?;
        if let Some((_, weld, triangles)) = self.solids.last_mut() {
            triangles.extend(parts.iter().map(|part| part.map(|corner| weld.insert(corners[corner as usize]))));
        }
        Ok(())
    }

    /// Reads the three numbers of a vertex.
    fn corner(&mut self, line: usize, rest: &[u8]) -> Result<DVec3> {
        corner(self.path, line, rest).or_else(|error| {
            let (values, assumed) = lexer::three_numbers_with_commas(rest).ok_or(error)?;
            self.note(line, &format!("the numbers of a vertex are read with {assumed}"));
            Ok(DVec3::from(values))
        })
    }

    /// Applies a statement; returns false if the statement is not allowed after the previous statement.
    fn statement(&mut self, line: usize, statement: Statement, rest: &[u8]) -> Result<bool> {
        use {ParserState as P, Statement as S};
        self.expect = match (self.expect, statement) {
            (P::Solid, S::Solid) => return self.begin_solid(line, lexer::name(rest)),
            (P::Facet, S::Solid) => {
                self.note(line, "the solid before this line has no endsolid; it is assumed to end here");
                match self.solids.last_mut().filter(|(.., triangles)| triangles.is_empty()) {
                    Some((old, ..)) => *old = lexer::name(rest),
                    None => return self.begin_solid(line, lexer::name(rest)),
                }
                P::Facet
            }
            (P::Solid, S::Facet) => {
                self.note(line, "a facet outside a solid is read as part of an unnamed solid");
                self.begin_solid(line, String::new())?;
                P::Loop
            }
            // The facet's normal is ignored, because it is computed from the corners.
            (P::Facet, S::Facet) => P::Loop,
            (P::Facet, S::EndSolid) => P::Solid,
            (P::Loop, S::Loop) => P::Vertex,
            (P::Vertex, S::Vertex) => {
                self.corners[self.count] = self.corner(line, rest)?;
                self.count += 1;
                if self.count == 3 { P::EndLoop } else { P::Vertex }
            }
            (P::EndLoop, S::Vertex) => {
                self.note(line, "a facet with more than three vertices is divided into triangles");
                let corner = self.corner(line, rest)?;
                self.further.push(corner);
                P::EndLoop
            }
            (P::EndLoop, S::EndLoop) => P::EndFacet,
            (P::EndFacet, S::EndFacet) => {
                self.count = 0;
                if !self.further.is_empty() {
                    self.add_polygon(line)?;
                } else if let Some((_, weld, triangles)) = self.solids.last_mut() {
                    triangles.push(self.corners.map(|corner| weld.insert(corner)));
                }
                P::Facet
            }
            _ => return Ok(false),
        };
        Ok(true)
    }
}

/// Solids of a text file. Lines with other keywords and a missing `endsolid` cause a notice.
fn text(path: &Path, bytes: &[u8], notices: &mut Vec<Notice>) -> Result<Vec<Solid>> {
    let mut parser = TextParser {
        path,
        solids: Vec::new(),
        expect: ParserState::Solid,
        corners: [DVec3::ZERO; 3],
        count: 0,
        further: Vec::new(),
        odd: Diagnostics::default(),
    };
    let mut last = 0;
    for (line, text) in Lines::new(&lexer::plain_text(bytes)) {
        last = line;
        parser.line(line, text)?;
    }
    match parser.expect {
        ParserState::Solid => {}
        ParserState::Facet => {
            let message = "the last solid has no endsolid; the file may be truncated";
            parser.odd.note(NoticeCode::TruncatedData, Location::Line(last), message);
        }
        expect => {
            let message = format!("unexpected end of file; expected {}", name(expect));
            return Err(FormatError::line(path, last, ErrorCode::TruncatedFile.message(message)));
        }
    }
    let solid = |(name, weld, triangles): (_, VertexWelder<_>, _)| Solid {
        name,
        vertices: weld.points,
        triangles,
        colors: None,
        color: None,
    };
    let solids = parser.solids.into_iter().map(solid).collect();
    notices.extend(parser.odd.into_notices(path));
    Ok(solids)
}

fn name(expect: ParserState) -> &'static str {
    match expect {
        ParserState::Solid => "solid",
        ParserState::Facet => "facet or endsolid",
        ParserState::Loop => "outer loop",
        ParserState::Vertex => "vertex (a facet has three)",
        ParserState::EndLoop => "endloop or vertex",
        ParserState::EndFacet => "endfacet",
    }
}

fn corner(path: &Path, line: usize, rest: &[u8]) -> Result<DVec3> {
    let mut words = Words(rest);
    let mut values = [0.0; 3];
    for value in &mut values {
        let word = words.next();
        *value = word.and_then(lexer::number).ok_or_else(|| {
            let found = lexer::for_message(lexer::trim(rest));
            let fault = word.map(|word| format!("; {}", lexer::not_a_number(word))).unwrap_or_default();
            let message = format!("vertex {found}; expected three numbers{fault}");
            FormatError::line(path, line, ErrorCode::WrongType.message(message))
        })?;
    }
    if let Some(word) = words.next() {
        let message = format!("vertex: unexpected {} after the three numbers", lexer::for_message(word));
        return Err(FormatError::line(path, line, ErrorCode::WrongShape.message(message)));
    }
    Ok(DVec3::from(values))
}
