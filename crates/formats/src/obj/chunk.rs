//! The statements of a piece of an OBJ file, read without the text before it.

use std::ops::Range;

use glam::DVec3;
use raycam_scene::color::{Rgb, linear_from_srgb};

use crate::geometry::polygons::{DegenerateFaces, Polygons};
use crate::geometry::vertex_dedup::{Corner, NO_INDEX};
use crate::io::lexer::{self, Lines, Words};
use crate::obj::ignored::IgnoredStatements;

/// Whole lines of a file.
pub(crate) struct TextChunk<'a> {
    pub(crate) text: &'a [u8],
    /// Number of lines before the text.
    pub(crate) lines_before: usize,
}

/// An error with its line.
pub(crate) type LineError = (usize, String);

/// The statements of a piece of text. Lines are numbered as in the file; all indices begin at 0 with the piece.
pub(crate) struct Chunk {
    pub(crate) positions: Vec<DVec3>,
    /// Linear, as long as `positions` once one has a colour; white where it has none.
    pub(crate) colors: Vec<Rgb>,
    pub(crate) uvs: Vec<[f32; 2]>,
    /// Unit length, or zero where the file's has no direction.
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) polygons: Polygons,
    /// Indices that count backwards; their entries in `polygons` are filled in later.
    pub(crate) relative: Vec<RelativeIndex>,
    pub(crate) runs: Vec<StateRun>,
    /// By `usemtl`, `o` and `g`, each with its line; a name may come again.
    pub(crate) materials: Vec<(usize, String)>,
    pub(crate) parts: Vec<(usize, String)>,
    pub(crate) groups: Vec<(usize, String)>,
    /// By `mtllib`, each with its line.
    pub(crate) libraries: Vec<(usize, Vec<u8>)>,
    /// Number of positions with a colour.
    pub(crate) colored: usize,
    /// The line of the first colour that is none.
    pub(crate) invalid_color_line: Option<usize>,
    /// The largest index of a position, texture coordinates and a normal, with its line: they may come after the faces.
    pub(crate) max_index: [(i64, usize); 3],
    pub(crate) degenerate: DegenerateFaces,
    pub(crate) ignored: IgnoredStatements,
    /// The last line, where it has no line end.
    pub(crate) unterminated_line: Option<usize>,
    /// The error at which reading stopped.
    pub(crate) error: Option<LineError>,
}

/// Corner of a face that is skipped: its indices are checked all the same.
const SKIPPED_CORNER: usize = usize::MAX;

/// An index that counts backwards from what came before.
pub(crate) struct RelativeIndex {
    /// Which of all corners, or [`SKIPPED_CORNER`].
    pub(crate) corner: usize,
    /// 0 position, 1 texture coordinate, 2 normal.
    pub(crate) kind: usize,
    pub(crate) line: usize,
    /// Below 0.
    pub(crate) value: i64,
    /// Number of elements of its kind before it in the piece.
    pub(crate) before: usize,
}

/// State from a polygon on; `None` is the state before the piece.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct StateRun {
    /// Its first polygon.
    pub(crate) start: usize,
    /// Index into `parts`.
    pub(crate) part: Option<usize>,
    /// Index into `groups`.
    pub(crate) group: Option<usize>,
    /// Index into `materials`.
    pub(crate) material: Option<usize>,
    /// The smoothing group; 0 is off.
    pub(crate) smoothing: Option<u32>,
}

/// Indices of what a error in one is called.
/// Polygons with the same state; at least one.
pub(crate) struct RunRange {
    pub(crate) run: StateRun,
    pub(crate) polygons: Range<usize>,
}

pub(crate) const INDEX_NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl Chunk {
    /// Reads a piece up to its end or its first error.
    pub(crate) fn read(stretch: &TextChunk<'_>) -> Self {
        let mut chunk = Self {
            positions: Vec::new(),
            colors: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            polygons: Polygons::default(),
            relative: Vec::new(),
            runs: vec![StateRun::default()],
            materials: Vec::new(),
            parts: Vec::new(),
            groups: Vec::new(),
            libraries: Vec::new(),
            colored: 0,
            invalid_color_line: None,
            max_index: [(0, 0); 3],
            degenerate: DegenerateFaces::default(),
            ignored: IgnoredStatements::default(),
            unterminated_line: None,
            error: None,
        };
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
        self.unterminated_line = (!lines.ended_with_newline()).then_some(last);
        Ok(())
    }

    fn statement(&mut self, line: usize, text: &[u8]) -> Result<(), LineError> {
        let (key, rest) = lexer::split_word(text);
        match key {
            b"v" => self.vertex(line, rest),
            b"vt" => {
                let [u, v, _] = numbers(line, rest, "vt", 1)?;
                self.uvs.push([u as f32, (1.0 - v) as f32]);
                Ok(())
            }
            b"vn" => {
                let normal = DVec3::from(numbers(line, rest, "vn", 3)?);
                let normal = normal.normalize_or_zero().as_vec3();
                self.normals.push(normal.to_array());
                Ok(())
            }
            b"f" | b"fo" => self.face(line, rest),
            b"o" => {
                let part = Some(self.parts.len());
                self.parts.push((line, lexer::name(rest)));
                self.change_state(|run| run.part = part);
                Ok(())
            }
            b"g" => {
                let group = Some(self.groups.len());
                self.groups.push((line, lexer::name(rest)));
                self.change_state(|run| run.group = group);
                Ok(())
            }
            b"usemtl" => {
                let material = Some(self.materials.len());
                self.materials.push((line, lexer::name(rest)));
                self.change_state(|run| run.material = material);
                Ok(())
            }
            b"s" => {
                let group = match lexer::trim(rest) {
                    b"off" | b"" => 0,
                    b"on" => 1,
                    word => lexer::integer(word).and_then(|group| u32::try_from(group).ok()).ok_or_else(|| {
                        let word = lexer::for_message(word);
                        (line, format!("s {word}: expected a smoothing group or off"))
                    })?,
                };
                self.change_state(|run| run.smoothing = Some(group));
                Ok(())
            }
            b"mtllib" => {
                self.libraries.push((line, lexer::trim(rest).into()));
                Ok(())
            }
            b"" => Ok(()),
            _ if key[0] == b'#' => Ok(()),
            _ => self.ignored.add(line, key).map_err(|message| (line, message)),
        }
    }

    /// `v x y z`, `v x y z w`, `v x y z r g b` or `v x y z r g b a`.
    fn vertex(&mut self, line: usize, rest: &[u8]) -> Result<(), LineError> {
        let mut values = [0.0; 7];
        let mut count = 0;
        for word in Words(rest) {
            let value = lexer::number(word).filter(|v| v.is_finite() || count >= 3).ok_or_else(|| {
                let word = lexer::for_message(word);
                (line, format!("v: coordinate {word} is not a finite number"))
            })?;
            match values.get_mut(count) {
                Some(slot) => *slot = value,
                None => return Err((line, "v has more than 7 numbers".into())),
            }
            count += 1;
        }
        let [x, y, z, r, g, b, _] = values;
        match count {
            3 | 4 => {}
            6 | 7 => {
                let rgb = [r, g, b];
                if rgb.iter().all(|c| (0.0..=1.0).contains(c)) {
                    self.colors.resize(self.positions.len(), [1.0; 3]);
                    self.colors.push(rgb.map(|c| linear_from_srgb(c as f32)));
                    self.colored += 1;
                } else {
                    self.invalid_color_line.get_or_insert(line);
                }
            }
            _ => {
                let message = format!("v has {count} numbers, expected 3, or 6 with a colour");
                return Err((line, message));
            }
        }
        self.positions.push(DVec3::new(x, y, z));
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &[u8]) -> Result<(), LineError> {
        for word in Words(rest) {
            let mut indices = [NO_INDEX; 3];
            for (kind, index) in word.split(|&b| b == b'/').enumerate() {
                if kind == 3 {
                    let word = lexer::for_message(word);
                    return Err((line, format!("f: corner {word} has more than 3 indices")));
                }
                if !index.is_empty() {
                    indices[kind] = self.index(line, kind, index)?;
                }
            }
            let [position, uv, normal] = indices;
            if position == NO_INDEX {
                let word = lexer::for_message(word);
                return Err((line, format!("f: corner {word} has no vertex")));
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

    /// An index from 0; in the file they count from 1, or from -1 backwards.
    fn index(&mut self, line: usize, kind: usize, word: &[u8]) -> Result<u32, LineError> {
        let value =
            lexer::integer(word).ok_or_else(|| (line, format!("f: {} is not an index", lexer::for_message(word))))?;
        if value > 0 {
            if value > self.max_index[kind].0 {
                self.max_index[kind] = (value, line);
            }
            // Larger ones are found out at the end.
            return Ok(u32::try_from(value - 1).unwrap_or(NO_INDEX - 1).min(NO_INDEX - 1));
        }
        if value == 0 {
            let name = INDEX_NAMES[kind];
            return Err((line, format!("f: {name} 0, but indices start at 1")));
        }
        let before = [self.positions.len(), self.uvs.len(), self.normals.len()][kind];
        self.relative.push(RelativeIndex { corner: self.polygons.corner_count(), kind, line, value, before });
        Ok(0)
    }

    /// Changes the state from the next polygon on.
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

/// One to three numbers, of which at least `least`.
fn numbers(line: usize, rest: &[u8], key: &str, least: usize) -> Result<[f64; 3], LineError> {
    let mut values = [0.0; 3];
    let mut count = 0;
    for word in Words(rest) {
        let value = lexer::number(word).filter(|v| v.is_finite()).ok_or_else(|| {
            let word = lexer::for_message(word);
            (line, format!("{key}: {word} is not a finite number"))
        })?;
        match values.get_mut(count) {
            Some(slot) => *slot = value,
            None => return Err((line, format!("{key} has more than 3 numbers"))),
        }
        count += 1;
    }
    if count < least {
        return Err((line, format!("{key} has {count} numbers, expected {least}")));
    }
    Ok(values)
}

/// Cuts a text into pieces of whole statements, of about `size` bytes each.
pub(crate) fn split_chunks(text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut stretches = Vec::new();
    let mut rest = text;
    while rest.len() > size {
        // After a line end whose line does not go on: not in the middle of one of two bytes.
        let is_end = |at: &usize| {
            let at = *at;
            let end = rest[at] == b'\n' || rest[at] == b'\r' && rest.get(at + 1) != Some(&b'\n');
            let before = if rest[at] == b'\n' && rest[at - 1] == b'\r' { 2 } else { 1 };
            end && rest[at - before] != b'\\'
        };
        let Some(end) = (size..rest.len()).find(is_end) else {
            break;
        };
        let (stretch, after) = rest.split_at(end + 1);
        stretches.push(stretch);
        rest = after;
    }
    stretches.push(rest);
    stretches
}
