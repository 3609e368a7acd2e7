//! Wavefront OBJ (Alias Wavefront, 1995, appendix "Object Files"), polygons only.
//!
//! Parts are made by `o`. Vertex colours after the coordinates are read as sRGB, as Blender and MeshLab write them.
//! Texture coordinates have their origin at the bottom left in the file and at the top left here.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use raycam_scene::Model;
use raycam_scene::color::{Rgb, linear_from_srgb};

use crate::corners::{Corner, NONE};
use crate::error::FormatError;
use crate::folder::{Folder, Source};
use crate::obj_model;
use crate::obj_skipped::Skipped;
use crate::polygons::Polygons;
use crate::text::{self, Lines, Words};

/// More names of parts, materials or material files than this are refused.
const MOST_NAMES: usize = 1 << 16;

/// The statements of an OBJ file.
pub(crate) struct Obj {
    pub(crate) positions: Vec<DVec3>,
    /// Linear, as long as `positions` once one has a colour; white where it has none.
    pub(crate) colors: Vec<Rgb>,
    pub(crate) uvs: Vec<[f32; 2]>,
    /// Unit length, or zero where the file's has no direction.
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) polygons: Polygons<Corner>,
    /// What holds from which polygon on, in order.
    pub(crate) runs: Vec<Run>,
    /// By `usemtl`.
    pub(crate) materials: Vec<String>,
    /// By `o`.
    pub(crate) parts: Vec<String>,
    /// By `mtllib`.
    pub(crate) libraries: Vec<String>,
    pub(crate) notices: Vec<String>,
}

/// Polygons of one part and one material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// Its first polygon.
    pub(crate) start: usize,
    /// Index into `parts`; `None` before the first `o`.
    pub(crate) part: Option<usize>,
    /// Index into `materials`; `None` before the first `usemtl`.
    pub(crate) material: Option<usize>,
}

/// The model in an OBJ file, with the materials and textures it names.
pub(crate) fn read(source: &Source, folder: &mut Folder) -> Result<Model, FormatError> {
    let obj = Parser::new(&source.path).parse(&source.bytes)?;
    obj_model::build(obj, &source.path, folder)
}

struct Parser<'a> {
    path: &'a Path,
    obj: Obj,
    material_numbers: HashMap<Vec<u8>, usize>,
    /// The first colour that is none, with its line.
    bad_color: Option<usize>,
    /// Whether some vertices have a colour and some have not.
    colored: usize,
    /// The largest index of a position, texture coordinates and a normal, with its line: they may come after the faces.
    highest: [(i64, usize); 3],
    skipped: Skipped,
}

impl<'a> Parser<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            obj: Obj {
                positions: Vec::new(),
                colors: Vec::new(),
                uvs: Vec::new(),
                normals: Vec::new(),
                polygons: Polygons::new(),
                runs: vec![Run {
                    start: 0,
                    part: None,
                    material: None,
                }],
                materials: Vec::new(),
                parts: Vec::new(),
                libraries: Vec::new(),
                notices: Vec::new(),
            },
            material_numbers: HashMap::new(),
            bad_color: None,
            colored: 0,
            highest: [(0, 0); 3],
            skipped: Skipped::default(),
        }
    }

    fn parse(mut self, bytes: &[u8]) -> Result<Obj, FormatError> {
        let mut lines = Lines::new(text::plain(self.path, bytes)?);
        let mut last = 0;
        while let Some((line, text)) = lines.next() {
            if text.ends_with(b"\\") && !text::trim(text).starts_with(b"#") {
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
        if !lines.ended() {
            self.obj.notices.push(format!(
                "{}:{last}: the last line has no line end; the file may be cut off",
                self.path.display()
            ));
        }
        self.finish()
    }

    fn statement(&mut self, line: usize, text: &[u8]) -> Result<(), FormatError> {
        let (key, rest) = text::split_word(text);
        match key {
            b"v" => self.vertex(line, rest),
            b"vt" => {
                let [u, v, _] = self.numbers(line, rest, "vt", 1)?;
                self.obj.uvs.push([u as f32, (1.0 - v) as f32]);
                Ok(())
            }
            b"vn" => {
                let normal = DVec3::from(self.numbers(line, rest, "vn", 3)?);
                self.obj
                    .normals
                    .push(normal.normalize_or_zero().as_vec3().to_array());
                Ok(())
            }
            b"f" | b"fo" => self.face(line, rest),
            b"o" => {
                let part = Some(self.obj.parts.len());
                self.obj.parts.push(text::name(rest));
                self.limit(line, self.obj.parts.len(), "objects")?;
                self.run(|run| run.part = part);
                Ok(())
            }
            b"usemtl" => self.use_material(line, text::trim(rest)),
            b"mtllib" => self.libraries(line, text::trim(rest)),
            b"" | b"g" => Ok(()),
            _ if key[0] == b'#' => Ok(()),
            b"s" if matches!(text::trim(rest), b"off" | b"0" | b"") => Ok(()),
            _ => self
                .skipped
                .add(line, key)
                .map_err(|message| self.error(line, message)),
        }
    }

    fn error(&self, line: usize, message: impl Into<String>) -> FormatError {
        FormatError::line(self.path, line, message)
    }

    fn limit(&self, line: usize, count: usize, what: &str) -> Result<(), FormatError> {
        if count <= MOST_NAMES {
            return Ok(());
        }
        Err(self.error(line, format!("more than {MOST_NAMES} {what} in one file")))
    }

    /// One to three numbers, of which at least `least`.
    fn numbers(
        &self,
        line: usize,
        rest: &[u8],
        key: &str,
        least: usize,
    ) -> Result<[f64; 3], FormatError> {
        let mut values = [0.0; 3];
        let mut count = 0;
        for word in Words(rest) {
            let value = text::number(word)
                .filter(|v| v.is_finite())
                .ok_or_else(|| {
                    self.error(
                        line,
                        format!("{key}: {} is not a finite number", text::shown(word)),
                    )
                })?;
            match values.get_mut(count) {
                Some(slot) => *slot = value,
                None => return Err(self.error(line, format!("{key} has more than 3 numbers"))),
            }
            count += 1;
        }
        if count < least {
            return Err(self.error(line, format!("{key} has {count} numbers, expected {least}")));
        }
        Ok(values)
    }

    /// `v x y z`, `v x y z w`, `v x y z r g b` or `v x y z r g b a`.
    fn vertex(&mut self, line: usize, rest: &[u8]) -> Result<(), FormatError> {
        let mut values = [0.0; 7];
        let mut count = 0;
        for word in Words(rest) {
            let value = text::number(word)
                .filter(|v| v.is_finite() || count >= 3)
                .ok_or_else(|| {
                    self.error(
                        line,
                        format!("v: coordinate {} is not a finite number", text::shown(word)),
                    )
                })?;
            match values.get_mut(count) {
                Some(slot) => *slot = value,
                None => return Err(self.error(line, "v has more than 7 numbers")),
            }
            count += 1;
        }
        let [x, y, z, r, g, b, _] = values;
        match count {
            3 | 4 => {}
            6 | 7 => {
                let rgb = [r, g, b];
                if rgb.iter().all(|c| (0.0..=1.0).contains(c)) {
                    self.obj.colors.resize(self.obj.positions.len(), [1.0; 3]);
                    self.obj
                        .colors
                        .push(rgb.map(|c| linear_from_srgb(c as f32)));
                    self.colored += 1;
                } else {
                    self.bad_color.get_or_insert(line);
                }
            }
            _ => {
                let message = format!("v has {count} numbers, expected 3, or 6 with a colour");
                return Err(self.error(line, message));
            }
        }
        self.obj.positions.push(DVec3::new(x, y, z));
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &[u8]) -> Result<(), FormatError> {
        for word in Words(rest) {
            let mut indices = [NONE; 3];
            for (kind, index) in word.split(|&b| b == b'/').enumerate() {
                if kind == 3 {
                    let message =
                        format!("f: corner {} has more than 3 indices", text::shown(word));
                    return Err(self.error(line, message));
                }
                if !index.is_empty() {
                    indices[kind] = self.index(line, kind, index)?;
                }
            }
            let [position, uv, normal] = indices;
            if position == NONE {
                let message = format!("f: corner {} has no vertex", text::shown(word));
                return Err(self.error(line, message));
            }
            self.obj.polygons.corner(Corner {
                position,
                uv,
                normal,
            });
        }
        match self.obj.polygons.end() {
            0..3 => Err(self.error(line, "f: a face needs at least 3 corners")),
            _ => Ok(()),
        }
    }

    /// An index from 0; in the file they count from 1, or from -1 backwards.
    fn index(&mut self, line: usize, kind: usize, word: &[u8]) -> Result<u32, FormatError> {
        let obj = &self.obj;
        let (count, name) = match kind {
            0 => (obj.positions.len(), "vertex"),
            1 => (obj.uvs.len(), "texture coordinate"),
            _ => (obj.normals.len(), "normal"),
        };
        let value = text::integer(word)
            .ok_or_else(|| self.error(line, format!("f: {} is not an index", text::shown(word))))?;
        let index = match value {
            0 => return Err(self.error(line, format!("f: {name} 0, but indices start at 1"))),
            1.. => value - 1,
            _ => count as i64 + value,
        };
        if index < 0 {
            let message = format!("f: {name} {value}, but only {count} came before");
            return Err(self.error(line, message));
        }
        if index >= count as i64 && value > self.highest[kind].0 {
            self.highest[kind] = (value, line);
        }
        // Larger ones are found out at the end.
        Ok(u32::try_from(index).unwrap_or(NONE - 1))
    }

    /// Changes what holds from the next polygon on.
    fn run(&mut self, change: impl FnOnce(&mut Run)) {
        let start = self.obj.polygons.len();
        let mut run = self.obj.runs[self.obj.runs.len() - 1];
        if run.start == start {
            self.obj.runs.pop();
        }
        run.start = start;
        change(&mut run);
        self.obj.runs.push(run);
    }

    fn use_material(&mut self, line: usize, name: &[u8]) -> Result<(), FormatError> {
        let material = match self.material_numbers.get(name) {
            Some(&number) => number,
            None => {
                let number = self.obj.materials.len();
                self.material_numbers.insert(name.into(), number);
                self.obj.materials.push(text::name(name));
                number
            }
        };
        self.limit(line, self.obj.materials.len(), "materials")?;
        self.run(|run| run.material = Some(material));
        Ok(())
    }

    /// Several names, which end in `.mtl` and may have spaces, or one of any kind.
    fn libraries(&mut self, line: usize, names: &[u8]) -> Result<(), FormatError> {
        let (mut start, mut ends) = (0, Vec::new());
        for (at, window) in names.windows(5).enumerate() {
            if window[..4].eq_ignore_ascii_case(b".mtl") && window[4].is_ascii_whitespace() {
                ends.push(at + 4);
            }
        }
        ends.push(names.len());
        for end in ends {
            let name = text::name(&names[start..end]);
            if !name.is_empty() && !self.obj.libraries.contains(&name) {
                self.obj.libraries.push(name);
            }
            start = end;
        }
        if self.obj.libraries.len() > 256 {
            return Err(self.error(line, "more than 256 material files"));
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Obj, FormatError> {
        let path = self.path.display();
        let obj = &mut self.obj;
        let counts = [obj.positions.len(), obj.uvs.len(), obj.normals.len()];
        let names = [
            ("vertex", "vertices"),
            ("texture coordinate", "texture coordinates"),
            ("normal", "normals"),
        ];
        for (((value, line), count), (one, many)) in self.highest.into_iter().zip(counts).zip(names)
        {
            if value > count as i64 {
                let message = format!("f: {one} {value}, but the file has {count} {many}");
                return Err(FormatError::line(self.path, line, message));
            }
        }
        if obj.polygons.len() == 0 {
            let vertices = obj.positions.len();
            let message = format!("no faces (f), only {vertices} vertices: nothing to see");
            return Err(FormatError::whole(self.path, message));
        }
        if let Some(line) = self.bad_color {
            obj.notices.push(format!(
                "{path}:{line}: a vertex colour outside 0..=1; all vertex colours of the file are ignored"
            ));
            obj.colors.clear();
        } else if self.colored > 0 {
            let without = obj.positions.len() - self.colored;
            if without > 0 {
                obj.notices.push(format!(
                    "{path}: {without} vertices without a colour are white"
                ));
            }
            obj.colors.resize(obj.positions.len(), [1.0; 3]);
        }
        if let Some(skipped) = self.skipped.described(!obj.normals.is_empty()) {
            obj.notices.push(format!("{path}: not used: {skipped}"));
        }
        Ok(self.obj)
    }
}
