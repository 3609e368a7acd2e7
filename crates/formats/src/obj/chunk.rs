//! Statements of a piece of an OBJ file, read without the preceding text.

use std::ops::Range;

use glam::DVec3;
use raycam_scene::color::{Rgb, linear_from_srgb};
use raycam_scene::{ErrorCode, Message, NoticeCode, counted};

use crate::error::Location;
use crate::geometry::polygons::{DegenerateFaces, Polygons};
use crate::geometry::vertex_dedup::{Corner, NO_INDEX};
use crate::io::Diagnostics;
use crate::io::lexer::{self, Lines, Words};
use crate::obj::ignored::IgnoredStatements;

/// Piece of a file that consists of whole lines.
pub(crate) struct TextChunk<'a> {
    pub(crate) text: &'a [u8],
    /// Number of lines before the text.
    pub(crate) lines_before: usize,
}

/// Line number, and the error in this line.
pub(crate) type LineError = (usize, Message);

/// Statements of a piece of text. Lines are numbered as in the file; all indices start at 0 at the beginning of the
/// piece.
#[derive(Default)]
pub(crate) struct Chunk {
    pub(crate) positions: Vec<DVec3>,
    /// Linear colours: empty, or one per position if any position has a colour; white for positions without a colour.
    /// Values outside 0..=1 are stored as in the file.
    pub(crate) colors: Vec<Rgb>,
    /// Colours that ZBrush writes in comments, sRGB, one per vertex.
    pub(crate) polypaint: Vec<[u8; 3]>,
    pub(crate) uvs: Vec<[f32; 2]>,
    /// Normals of unit length, or zero if the file's normal has no direction.
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) polygons: Polygons,
    /// Indices that count backwards; their entries in `polygons` are filled in later.
    pub(crate) relative: Vec<RelativeIndex>,
    pub(crate) runs: Vec<StateRun>,
    /// Names in `usemtl`, `o` and `g` statements, each with its line; a name may be repeated.
    pub(crate) materials: Vec<(usize, Vec<u8>)>,
    pub(crate) parts: Vec<(usize, Vec<u8>)>,
    pub(crate) groups: Vec<(usize, Vec<u8>)>,
    /// File names in `mtllib` statements, each with its line.
    pub(crate) libraries: Vec<(usize, Vec<u8>)>,
    /// Number of positions with a colour.
    pub(crate) colored: usize,
    /// Line of the first colour outside 0..=1, and the range of all values.
    pub(crate) odd_color_line: Option<usize>,
    pub(crate) color_bounds: ColorBounds,
    /// Largest index of a position, of texture coordinates and of a normal, with its line. The elements themselves may
    /// follow the faces.
    pub(crate) max_index: [(i64, usize); 3],
    pub(crate) degenerate: DegenerateFaces,
    pub(crate) ignored: IgnoredStatements,
    /// Notices about invalid values, which are ignored.
    pub(crate) odd: Diagnostics,
    /// Last line, if it has no line end and fewer words than the previous line.
    pub(crate) cut_line: Option<usize>,
    /// Error at which reading stopped.
    pub(crate) error: Option<LineError>,
}

/// Corner of a skipped face: its indices are still checked.
const SKIPPED_CORNER: usize = usize::MAX;

/// Index that counts backwards from the preceding elements.
pub(crate) struct RelativeIndex {
    /// Index over all corners, or [`SKIPPED_CORNER`].
    pub(crate) corner: usize,
    /// 0 for a position, 1 for texture coordinates, 2 for a normal.
    pub(crate) kind: usize,
    pub(crate) line: usize,
    /// The index as written in the file; always negative.
    pub(crate) value: i64,
    /// Number of positions, texture coordinates or normals that precede the index in the piece.
    pub(crate) before: usize,
}

/// Part, group, material and smoothing group of consecutive polygons. A value of `None` means that no statement in the
/// piece has set it yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct StateRun {
    /// Index of the first of these polygons.
    pub(crate) start: usize,
    /// Index into `parts`.
    pub(crate) part: Option<usize>,
    /// Index into `groups`.
    pub(crate) group: Option<usize>,
    /// Index into `materials`.
    pub(crate) material: Option<usize>,
    /// Smoothing group; 0 is off.
    pub(crate) smoothing: Option<u32>,
}

/// Minimum and maximum of colours; NaN if a value is not a number.
#[derive(Clone, Copy)]
pub(crate) struct ColorBounds([f64; 2]);

impl Default for ColorBounds {
    fn default() -> Self {
        Self([0.0, 1.0])
    }
}

impl ColorBounds {
    fn add(&mut self, value: f64) {
        let Self([low, high]) = *self;
        self.0 = if value.is_nan() || low.is_nan() { [f64::NAN; 2] } else { [low.min(value), high.max(value)] };
    }

    /// Includes the bounds of another piece of the file.
    pub(crate) fn merge(&mut self, Self([low, high]): Self) {
        self.add(low);
        self.add(high);
    }

    /// True if all values are in 0..=1 except for rounding.
    pub(crate) fn is_nearly_unit(&self) -> bool {
        let Self([low, high]) = *self;
        low >= -0.01 && high <= 1.01
    }

    /// True if all values are in 0..=255, so that they may be 8-bit colours.
    pub(crate) fn is_bytes(&self) -> bool {
        let Self([low, high]) = *self;
        low >= 0.0 && high <= 255.0
    }
}

/// One or more polygons with the same part, group, material and smoothing group.
pub(crate) struct RunRange {
    pub(crate) run: StateRun,
    pub(crate) polygons: Range<usize>,
}

/// Names of the kinds of indices, for messages.
pub(crate) const INDEX_NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl Chunk {
    /// Reads a piece of a file; stops at the first error.
    pub(crate) fn read(stretch: &TextChunk<'_>) -> Self {
        let mut chunk = Self { runs: vec![StateRun::default()], ..Self::default() };
        chunk.error = chunk.lines(stretch).err();
        chunk
    }

    fn lines(&mut self, stretch: &TextChunk<'_>) -> Result<(), LineError> {
        let mut lines = Lines::new(stretch.text);
        let mut last = 0;
        while let Some((line, text)) = lines.next() {
            let line = stretch.lines_before + line;
            if text.ends_with(b"\\") && !lexer::trim(text).starts_with(b"#") {
                let mut joined = Vec::new();
                let mut piece = text;
                while let Some(start) = piece.strip_suffix(b"\\") {
                    joined.extend_from_slice(start);
                    joined.push(b' ');
                    piece = lines.next().map_or(&[], |(_, next)| next);
                }
                joined.extend_from_slice(piece);
                self.statement(line, &joined)?;
            } else {
                self.statement(line, text)?;
            }
            last = line;
        }
        self.cut_line = (!lines.ended_with_newline() && is_cut(stretch.text)).then_some(last);
        Ok(())
    }

    fn statement(&mut self, line: usize, text: &[u8]) -> Result<(), LineError> {
        let (key, rest) = lexer::split_word(text);
        match key {
            b"v" => self.vertex(line, rest),
            b"vt" => {
                let [u, v, _] = numbers(line, rest, "vt", 1)?;
                let mut uv = [u as f32, (1.0 - v) as f32];
                if !(uv[0].is_finite() && uv[1].is_finite()) {
                    let message = format!("vt {u} {v} is not finite; treated as 0 0");
                    self.odd.note_kind(NoticeCode::ReplacedValue, "vt", Location::Line(line), message);
                    uv = [0.0, 1.0];
                }
                self.uvs.push(uv);
                Ok(())
            }
            b"vn" => {
                let given = DVec3::from(numbers(line, rest, "vn", 3)?);
                if !given.is_finite() {
                    let message = "vn contains numbers that are not finite; the face's normal is used";
                    self.odd.note(NoticeCode::ReplacedValue, Location::Line(line), message);
                }
                let normal = given.normalize_or_zero().as_vec3();
                self.normals.push(normal.to_array());
                Ok(())
            }
            b"f" | b"fo" => self.face(line, rest),
            b"o" => {
                let part = Some(self.parts.len());
                self.parts.push((line, lexer::name_bytes(rest)));
                self.change_state(|run| run.part = part);
                Ok(())
            }
            b"g" => {
                let group = Some(self.groups.len());
                self.groups.push((line, lexer::name_bytes(rest)));
                self.change_state(|run| run.group = group);
                Ok(())
            }
            b"usemtl" => {
                let material = Some(self.materials.len());
                self.materials.push((line, lexer::name_bytes(rest)));
                self.change_state(|run| run.material = material);
                Ok(())
            }
            b"s" => {
                let group = self.smoothing_group(line, rest);
                self.change_state(|run| run.smoothing = Some(group));
                Ok(())
            }
            b"mtllib" => {
                self.libraries.push((line, lexer::trim(rest).into()));
                Ok(())
            }
            b"" => Ok(()),
            b"#MRGB" => {
                self.polypaint(line, rest);
                Ok(())
            }
            _ if key[0] == b'#' => Ok(()),
            _ => self.ignored.add(line, key).map_err(|message| (line, message)),
        }
    }

    /// Reads the number of a smoothing group; 0 means no smoothing group.
    fn smoothing_group(&mut self, line: usize, rest: &[u8]) -> u32 {
        let word = Words(rest).next().unwrap_or_default();
        match word {
            b"off" | b"" => 0,
            b"on" => 1,
            word => match lexer::number(word) {
                Some(group) if group.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&group) => group as u32,
                _ => {
                    let word = lexer::for_message(word);
                    let message = format!("s {word} is treated as off; expected a smoothing group or off");
                    self.odd.note_kind(NoticeCode::ReplacedValue, "s", Location::Line(line), message);
                    0
                }
            },
        }
    }

    /// Reads `#MRGB`: hexadecimal mask, red, green and blue of up to 64 vertices, as written by ZBrush.
    fn polypaint(&mut self, line: usize, rest: &[u8]) {
        let digits = lexer::trim(rest);
        let digit = |byte: u8| (byte as char).to_digit(16);
        let byte = |pair: &[u8]| Some((16 * digit(pair[0])? + digit(pair[1])?) as u8);
        let (all, over) = digits.as_chunks::<8>();
        let color = |eight: &[u8; 8]| Some([byte(&eight[2..4])?, byte(&eight[4..6])?, byte(&eight[6..8])?]);
        let colors: Option<Vec<[u8; 3]>> = all.iter().map(color).collect();
        match colors.filter(|_| over.is_empty()) {
            Some(colors) => self.polypaint.extend(colors),
            None => self.odd.note(
                NoticeCode::ReplacedValue,
                Location::Line(line),
                "#MRGB does not have 8 hexadecimal digits per vertex; ignored",
            ),
        }
    }

    /// Reads a vertex: `v x y z`, `v x y z w`, `v x y z r g b` or `v x y z r g b a`.
    fn vertex(&mut self, line: usize, rest: &[u8]) -> Result<(), LineError> {
        let mut values = [0.0; 7];
        let mut count = 0;
        for word in Words(rest) {
            let value = lexer::number(word)
                .ok_or_else(|| (line, ErrorCode::WrongType.message(format!("v: {}", lexer::not_a_number(word)))))?;
            match values.get_mut(count) {
                Some(slot) => *slot = value,
                None => {
                    return Err((
                        line,
                        ErrorCode::WrongShape.message("v has more than 7 numbers; expected 3, or 6 with a colour"),
                    ));
                }
            }
            count += 1;
        }
        let [x, y, z, r, g, b, _] = values;
        match count {
            3 | 4 => {}
            6 | 7 => {
                let rgb = [r, g, b];
                self.colors.resize(self.positions.len(), [1.0; 3]);
                if rgb.iter().all(|c| (0.0..=1.0).contains(c)) {
                    self.colors.push(rgb.map(|c| linear_from_srgb(c as f32)));
                } else {
                    self.odd_color_line.get_or_insert(line);
                    rgb.iter().for_each(|&c| self.color_bounds.add(c));
                    let kept = |c| if (0.0..=1.0).contains(&c) { linear_from_srgb(c as f32) } else { c as f32 };
                    self.colors.push(rgb.map(kept));
                }
                self.colored += 1;
            }
            _ => {
                let message = format!("v has {}; expected 3, or 6 with a colour", counted(count, "number"));
                return Err((line, ErrorCode::WrongShape.message(message)));
            }
        }
        // Faces that use a vertex which is not finite are omitted.
        self.positions.push(DVec3::new(x, y, z));
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &[u8]) -> Result<(), LineError> {
        for word in Words(rest) {
            let mut indices = [NO_INDEX; 3];
            for (kind, index) in word.split(|&b| b == b'/').enumerate() {
                if kind == 3 {
                    let word = lexer::for_message(word);
                    let message = format!("f: corner {word} has more than 3 indices");
                    return Err((line, ErrorCode::WrongShape.message(message)));
                }
                if !index.is_empty() {
                    indices[kind] = self.index(line, kind, index)?;
                }
            }
            let [position, uv, normal] = indices;
            if position == NO_INDEX {
                let word = lexer::for_message(word);
                return Err((line, ErrorCode::MissingValue.message(format!("f: corner {word} has no vertex"))));
            }
            self.polygons.push_corner(Corner { position, uv, normal });
        }
        if !self.polygons.end_face() {
            let corners = self.polygons.corner_count();
            let under_way = |r: &&mut RelativeIndex| r.corner >= corners && r.corner != SKIPPED_CORNER;
            for relative in self.relative.iter_mut().rev().take_while(under_way) {
                relative.corner = SKIPPED_CORNER;
            }
            self.degenerate.add(|| format!("line {line}"));
        }
        Ok(())
    }

    /// Reads an index and converts it to count from 0; in the file, indices count from 1, or backwards from -1.
    fn index(&mut self, line: usize, kind: usize, word: &[u8]) -> Result<u32, LineError> {
        let value = lexer::integer(word).ok_or_else(|| {
            let message = format!("f: {} is not an index", lexer::for_message(word));
            (line, ErrorCode::WrongType.message(message))
        })?;
        if value > 0 {
            if value > self.max_index[kind].0 {
                self.max_index[kind] = (value, line);
            }
            // Indices beyond the end of the lists are detected after all statements have been read.
            return Ok(u32::try_from(value - 1).unwrap_or(NO_INDEX - 1).min(NO_INDEX - 1));
        }
        if value == 0 {
            let name = INDEX_NAMES[kind];
            let message = format!("f: {name} index 0; expected indices from 1");
            return Err((line, ErrorCode::IndexOutOfRange.message(message)));
        }
        let before = [self.positions.len(), self.uvs.len(), self.normals.len()][kind];
        self.relative.push(RelativeIndex { corner: self.polygons.corner_count(), kind, line, value, before });
        Ok(0)
    }

    /// Changes the state of all following polygons.
    fn change_state(&mut self, change: impl FnOnce(&mut StateRun)) {
        let start = self.polygons.len();
        let mut run = self.runs[self.runs.len() - 1];
        if run.start == start {
            self.runs.pop();
        }
        run.start = start;
        change(&mut run);
        self.runs.push(run);
    }
}

/// Reads one to three numbers; fewer than `least` are an error.
fn numbers(line: usize, rest: &[u8], key: &str, least: usize) -> Result<[f64; 3], LineError> {
    let mut values = [0.0; 3];
    let mut count = 0;
    for word in Words(rest) {
        let value = lexer::number(word)
            .ok_or_else(|| (line, ErrorCode::WrongType.message(format!("{key}: {}", lexer::not_a_number(word)))))?;
        match values.get_mut(count) {
            Some(slot) => *slot = value,
            None => return Err((line, ErrorCode::WrongShape.message(format!("{key} has more than 3 numbers")))),
        }
        count += 1;
    }
    if count < least {
        return Err((
            line,
            ErrorCode::WrongShape.message(format!("{key} has {}; expected {least}", counted(count, "number"))),
        ));
    }
    Ok(values)
}

/// True if the last line of a text has no line end and fewer words than the previous line of the same kind.
fn is_cut(text: &[u8]) -> bool {
    let mut lines = text.rsplit(|&byte| byte == b'\n' || byte == b'\r').filter(|line| !lexer::trim(line).is_empty());
    let (Some(last), Some(before)) = (lines.next(), lines.next()) else { return false };
    let same = lexer::split_word(last).0 == lexer::split_word(before).0;
    same && Words(last).count() < Words(before).count()
}

/// Divides a text into pieces of complete statements, of about `size` bytes each.
pub(crate) fn split_chunks(text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut stretches = Vec::new();
    let mut rest = text;
    while rest.len() > size {
        // The text is cut after a line end that is not continued, and not between the two bytes of a line end.
        let is_end = |at: &usize| {
            let at = *at;
            let end = rest[at] == b'\n' || rest[at] == b'\r' && rest.get(at + 1) != Some(&b'\n');
            let before = if rest[at] == b'\n' && rest[at - 1] == b'\r' { 2 } else { 1 };
            end && rest[at - before] != b'\\'
        };
        let Some(end) = (size..rest.len()).find(is_end) else { break };
        let (stretch, after) = rest.split_at(end + 1);
        stretches.push(stretch);
        rest = after;
    }
    stretches.push(rest);
    stretches
}
