//! Statements of a whole OBJ file, from chunks that are read in parallel.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use raycam_scene::color::{Rgb, linear_from_srgb, linear_from_srgb8, srgb_from_linear};
use raycam_scene::{ErrorCode, Notice, NoticeCode, counted};

use crate::error::{FormatError, Result};
use crate::geometry::polygons::{DegenerateFaces, Polygons};
use crate::io::{Diagnostics, lexer, parallel};
use crate::obj::chunk::{Chunk, ColorBounds, INDEX_NAMES, LineError, StateRun, TextChunk, split_chunks};
use crate::obj::ignored::IgnoredStatements;

/// Maximum number of names of parts, materials or groups.
const MAX_NAMES: usize = 1 << 16;

/// Statements of an OBJ file.
#[derive(Default)]
pub(crate) struct Obj {
    pub(crate) positions: Vec<DVec3>,
    /// Linear colours; as soon as one position has a colour, the list has the length of `positions`, with white for
    /// positions without a colour.
    pub(crate) colors: Vec<Rgb>,
    pub(crate) uvs: Vec<[f32; 2]>,
    /// Normals of unit length, or zero if the file's normal has no direction.
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) polygons: Polygons,
    /// Runs of polygons with the same part, group, material and smoothing group, in order.
    pub(crate) runs: Vec<StateRun>,
    /// Names in `usemtl` statements, each once.
    pub(crate) materials: Vec<Vec<u8>>,
    /// Names in `o` statements.
    pub(crate) parts: Vec<Vec<u8>>,
    /// Names in `g` statements, each once.
    pub(crate) groups: Vec<Vec<u8>>,
    /// File names in `mtllib` statements.
    pub(crate) libraries: Vec<Vec<u8>>,
    pub(crate) notices: Vec<Notice>,
}

/// Reads a file in pieces of about `size` bytes, in parallel.
pub(crate) fn parse(path: &Path, bytes: &[u8], size: usize) -> Result<Obj> {
    let text = lexer::plain_text(bytes);
    let texts = split_chunks(&text, size);
    let counts = parallel::par_map(&texts, |text| lexer::line_ends(text));
    let mut lines_before = 0;
    let mut pieces = Vec::with_capacity(texts.len());
    for (text, count) in texts.into_iter().zip(counts) {
        pieces.push(TextChunk { text, lines_before });
        lines_before += count;
    }
    let mut builder = ObjBuilder::default();
    let chunks = parallel::par_map(&pieces, Chunk::read);
    builder.reserve(&chunks);
    for chunk in chunks {
        builder.append_chunk(chunk).map_err(|(line, message)| FormatError::line(path, line, message))?;
    }
    builder.finish(path)
}

/// Statements of the pieces that have been appended.
#[derive(Default)]
struct ObjBuilder {
    obj: Obj,
    material_numbers: HashMap<Vec<u8>, usize>,
    group_numbers: HashMap<Vec<u8>, usize>,
    colored: usize,
    polypaint: Vec<[u8; 3]>,
    odd_color_line: Option<usize>,
    color_bounds: ColorBounds,
    max_index: [(i64, usize); 3],
    degenerate: DegenerateFaces,
    ignored: IgnoredStatements,
    odd: Diagnostics,
    cut_line: Option<usize>,
}

impl ObjBuilder {
    /// Reserves memory for these pieces, so that nothing is moved while they are appended.
    fn reserve(&mut self, chunks: &[Chunk]) {
        let sum = |count: fn(&Chunk) -> usize| chunks.iter().map(count).sum();
        self.obj.positions.reserve_exact(sum(|c| c.positions.len()));
        self.obj.uvs.reserve_exact(sum(|c| c.uvs.len()));
        self.obj.normals.reserve_exact(sum(|c| c.normals.len()));
        self.obj.polygons.reserve(chunks.iter().map(|c| &c.polygons));
    }

    /// Appends the next piece, or returns its first error.
    fn append_chunk(&mut self, mut chunk: Chunk) -> Result<(), LineError> {
        let mut errors: Vec<LineError> = chunk.error.take().into_iter().collect();
        errors.extend(self.resolve(&mut chunk).err());
        errors.extend(self.ignored.append(std::mem::take(&mut chunk.ignored)).err());
        let names = self.names(&mut chunk);
        errors.extend(names.err());
        if let Some(first) = errors.into_iter().min_by_key(|&(line, _)| line) {
            return Err(first);
        }
        for (mine, theirs) in self.max_index.iter_mut().zip(chunk.max_index) {
            if theirs.0 > mine.0 {
                *mine = theirs;
            }
        }
        self.odd_color_line = self.odd_color_line.or(chunk.odd_color_line);
        self.color_bounds.merge(chunk.color_bounds);
        self.odd.append(chunk.odd);
        self.cut_line = chunk.cut_line;
        self.polypaint.append(&mut chunk.polypaint);
        self.degenerate.append(chunk.degenerate);
        self.colored += chunk.colored;
        let obj = &mut self.obj;
        if self.colored > 0 {
            obj.colors.resize(obj.positions.len(), [1.0; 3]);
            chunk.colors.resize(chunk.positions.len(), [1.0; 3]);
            obj.colors.append(&mut chunk.colors);
        }
        let start = obj.polygons.len();
        let before = obj.runs.last().copied().unwrap_or_default();
        for run in chunk.runs {
            obj.runs.push(StateRun {
                start: start + run.start,
                part: run.part.or(before.part),
                group: run.group.or(before.group),
                material: run.material.or(before.material),
                smoothing: run.smoothing.or(before.smoothing),
            });
        }
        obj.positions.append(&mut chunk.positions);
        obj.uvs.append(&mut chunk.uvs);
        obj.normals.append(&mut chunk.normals);
        obj.polygons.append(chunk.polygons);
        Ok(())
    }

    /// Fills in the indices that count backwards.
    fn resolve(&self, chunk: &mut Chunk) -> Result<(), LineError> {
        let obj = &self.obj;
        let bases = [obj.positions.len(), obj.uvs.len(), obj.normals.len()];
        for relative in &chunk.relative {
            let kind = relative.kind;
            let count = bases[kind] + relative.before;
            let Ok(index) = u32::try_from(count as i64 + relative.value) else {
                let (name, value) = (INDEX_NAMES[kind], relative.value);
                let message =
                    format!("f: {name} {value}, but the number of {name} statements before this line is {count}");
                return Err((relative.line, ErrorCode::IndexOutOfRange.message(message)));
            };
            chunk.polygons.edit_corner(relative.corner, |corner| match kind {
                0 => corner.position = index,
                1 => corner.uv = index,
                _ => corner.normal = index,
            });
        }
        Ok(())
    }

    /// Replaces the indices of names in the piece by the indices of the same names in the file.
    fn names(&mut self, chunk: &mut Chunk) -> Result<(), LineError> {
        let obj = &mut self.obj;
        let unique =
            |names: &mut Vec<Vec<u8>>, numbers: &mut HashMap<Vec<u8>, usize>, added: &[(usize, Vec<u8>)], what| {
                let number = |(line, name): &(usize, Vec<u8>)| {
                    let number = *numbers.entry(name.clone()).or_insert_with(|| {
                        names.push(name.clone());
                        names.len() - 1
                    });
                    limit(*line, names.len(), what).map(|()| number)
                };
                added.iter().map(number).collect::<Result<Vec<_>, LineError>>()
            };
        let materials = unique(&mut obj.materials, &mut self.material_numbers, &chunk.materials, "materials")?;
        let groups = unique(&mut obj.groups, &mut self.group_numbers, &chunk.groups, "groups")?;
        let parts_before = obj.parts.len();
        for (line, name) in chunk.parts.drain(..) {
            obj.parts.push(name);
            limit(line, obj.parts.len(), "objects")?;
        }
        for run in &mut chunk.runs {
            run.part = run.part.map(|part| parts_before + part);
            run.group = run.group.map(|group| groups[group]);
            run.material = run.material.map(|material| materials[material]);
        }
        for (line, names) in &chunk.libraries {
            libraries(names, &mut obj.libraries);
            if obj.libraries.len() > 256 {
                return Err((*line, "more than 256 material files (mtllib); combine them into fewer files".into()));
            }
        }
        Ok(())
    }

    fn finish(self, path: &Path) -> Result<Obj> {
        let mut obj = self.obj;
        let shown = path.display();
        let counts = [obj.positions.len(), obj.uvs.len(), obj.normals.len()];
        let many = ["vertices", "texture coordinates", "normals"];
        for (kind, ((value, line), count)) in self.max_index.into_iter().zip(counts).enumerate() {
            if value > 0 && count == 0 && kind > 0 {
                // Some programs remove texture coordinates and normals from the file or never write them; the shape is
                // complete without them.
                let (one, many) = (INDEX_NAMES[kind], many[kind]);
                obj.polygons.drop_attribute(kind);
                obj.notices.push(Notice::new(
                    NoticeCode::ReplacedValue,
                    format!(
                        "{shown}:{line}: f: {one} {value}, but the file has no {many}; the model is shown without \
                        them"
                    ),
                ));
            } else if value > count as i64 {
                let one = INDEX_NAMES[kind];
                let message = format!("f: {one} {value}, but the file has {}", counted(count, one));
                return Err(FormatError::line(path, line, ErrorCode::IndexOutOfRange.message(message)));
            }
        }
        if obj.polygons.len() == 0 {
            let vertices = obj.positions.len();
            let message = format!("no faces (f), only {}; there is nothing to render", counted(vertices, "vertex"));
            return Err(FormatError::whole(path, ErrorCode::NothingVisible.message(message)));
        }
        if let Some(last) = self.cut_line {
            obj.notices.push(Notice::new(NoticeCode::TruncatedData, format!(
                "{shown}:{last}: the last line has no line end and fewer words than the previous one; the file may be \
                 truncated"
            )));
        }
        if self.colored > 0 {
            let without = obj.positions.len() - self.colored;
            if without > 0 {
                obj.notices.push(Notice::new(
                    NoticeCode::MissingColors,
                    format!("{shown}: {} shown in white: no colour", counted(without, "vertex")),
                ));
            }
            obj.colors.resize(obj.positions.len(), [1.0; 3]);
        }
        if let Some(line) = self.odd_color_line {
            let (code, what) = settle_colors(&mut obj.colors, self.color_bounds);
            obj.notices.push(Notice::new(code, format!("{shown}:{line}: a vertex colour is outside 0 to 1; {what}")));
        }
        if !self.polypaint.is_empty() {
            obj.notices.extend(polypaint(&mut obj.colors, &self.polypaint, obj.positions.len(), path));
        }
        obj.notices.extend(self.degenerate.notice(path));
        if let Some(ignored) = self.ignored.message() {
            obj.notices.push(Notice::new(
                NoticeCode::IgnoredKey,
                format!("{shown}: unsupported statements ignored: {ignored}"),
            ));
        }
        obj.notices.extend(self.odd.into_notices(path));
        Ok(obj)
    }
}

/// Treats the colours of a file with values outside 0..=1: values that are outside only by rounding are clamped, 8-bit
/// values are converted to linear, and all other colours are removed. Returns the code of a notice and a description of
/// the change.
fn settle_colors(colors: &mut Vec<Rgb>, bounds: ColorBounds) -> (NoticeCode, &'static str) {
    if bounds.is_nearly_unit() {
        colors.as_flattened_mut().iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0));
        return (NoticeCode::ClampedValue, "all vertex colours of the file are clamped to this range");
    }
    if bounds.is_bytes() {
        // Values up to 1 have already been converted to linear.
        let in_file = |value: f32| if value <= 1.0 { srgb_from_linear(value) } else { value };
        for value in colors.as_flattened_mut() {
            *value = linear_from_srgb(in_file(*value) / 255.0);
        }
        return (NoticeCode::AssumedConvention, "all vertex colours of the file are treated as 0 to 255");
    }
    colors.clear();
    (NoticeCode::IgnoredColors, "all vertex colours of the file are ignored")
}

/// Uses the colours that ZBrush wrote in comments, if there is exactly one per vertex and no other colour; otherwise
/// returns a notice.
fn polypaint(colors: &mut Vec<Rgb>, paint: &[[u8; 3]], vertices: usize, path: &Path) -> Option<Notice> {
    if colors.is_empty() && paint.len() == vertices {
        colors.extend(paint.iter().map(|&color| linear_from_srgb8(color)));
        return None;
    }
    let count = counted(paint.len(), "colour");
    let message = format!(
        "{}: colours in #MRGB comments are ignored: {count} for {vertices} vertices; expected one per vertex",
        path.display()
    );
    Some(Notice::new(NoticeCode::IgnoredColors, message))
}

fn limit(line: usize, count: usize, what: &str) -> Result<(), LineError> {
    if count <= MAX_NAMES {
        return Ok(());
    }
    Err((line, ErrorCode::TooLarge.message(format!("more than {MAX_NAMES} {what} in one file; divide the file"))))
}

/// Splits the text of an `mtllib` statement into several names, if each ends in `.mtl`, or returns it as a single name.
/// Names may contain spaces.
fn libraries(names: &[u8], known: &mut Vec<Vec<u8>>) {
    let (mut start, mut ends) = (0, Vec::new());
    for (at, window) in names.windows(5).enumerate() {
        if window[..4].eq_ignore_ascii_case(b".mtl") && window[4].is_ascii_whitespace() {
            ends.push(at + 4);
        }
    }
    ends.push(names.len());
    for end in ends {
        let name = lexer::name_bytes(&names[start..end]);
        let comment = name.first() == Some(&b'#');
        if !name.is_empty() && !comment && !known.contains(&name) {
            known.push(name);
        }
        start = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything that is read from a text, as one string; must not depend on the size of the pieces.
    fn said(text: &str, size: usize) -> String {
        match parse(Path::new("a.obj"), text.as_bytes(), size) {
            Err(error) => error.to_string(),
            Ok(obj) => {
                let polygons: Vec<_> =
                    (0..obj.polygons.len()).map(|p| obj.polygons.get(p).collect::<Vec<_>>()).collect();
                let mut runs = obj.runs;
                runs.dedup_by(|b, a| StateRun { start: a.start, ..*b } == *a);
                runs.retain(|run| run.start < polygons.len());
                runs.reverse();
                runs.dedup_by_key(|run| run.start);
                format!(
                    "{:?} {:?} {:?} {:?} {polygons:?} {runs:?} {:?} {:?} {:?} {:?} {:?}",
                    obj.positions,
                    obj.colors,
                    obj.uvs,
                    obj.normals,
                    obj.materials,
                    obj.parts,
                    obj.groups,
                    obj.libraries,
                    obj.notices
                )
            }
        }
    }

    #[test]
    fn result_does_not_depend_on_the_division_into_pieces() {
        let good = "mtllib a.mtl b.mtl\r\nv 0 0 0\nv 1 0 0\rv 1 1 0 1 0 0\nvt 0 1\nvn 0 0 2\n\no one\ng x y\n\
            s 3\nf -3 -2 -1\nusemtl red\nf 1/1/1 2/1/1 \\\n 3//-1\n# \\\nusemtl blue\nv 0 1 0\nf 1 2 3 4\ns off\n\
            o two\nusemtl red\nl 1 2\nf -1 -2 -3\ng x y\nf 4 3 2 1";
        let bad = [
            "v 0 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 2 -4\nf 0 1 2\n",
            "v 0 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 2 9\nf 1 2 10\nf 1 10 2\n",
            "v 0 0 0\nv 0 0 1\r\nv 0 1 0\n\rf 1 2 3\nv 1 2\n",
        ];
        for text in [good].into_iter().chain(bad) {
            let whole = said(text, 1 << 20);
            for size in 2..text.len() {
                assert_eq!(said(text, size), whole, "{size}");
            }
        }
        assert!(
            said(bad[0], 8)
                .starts_with("a.obj:5: f: vertex -4, but the number of vertex statements before this line is 3")
        );
        assert!(said(bad[1], 8).starts_with("a.obj:6: f: vertex 10, but the file has 3"));
        assert!(said(bad[2], 8).starts_with("a.obj:6: v has 2 numbers"));
    }
}
