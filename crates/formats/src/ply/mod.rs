//! PLY (Turk, "The PLY Polygon File Format", 1994): text and binary of both byte orders.
//!
//! The elements `vertex` (x y z, nx ny nz, red green blue, s t or u v), `face` (vertex_indices, colours, texcoord as
//! written by MeshLab) and `tristrips` are supported. Other elements and properties cause a notice. Texture coordinates
//! have their origin at the bottom left in the file and at the top left here. An image has priority over colours,
//! because the format defines no product of the two.

pub(crate) mod body;
pub(crate) mod color_scale;
pub(crate) mod columns;
pub(crate) mod header;
pub(crate) mod scalar;
pub(crate) mod table;
pub(crate) mod textures;
pub(crate) mod triangles;
pub(crate) mod vertices;
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use raycam_scene::color::Rgb;
use raycam_scene::{ErrorCode, Mesh, MeshFile, Notice, NoticeCode, counted};

use crate::error::{FormatError, Result};
use crate::geometry::colors;
use crate::geometry::directionless;
use crate::geometry::polygons::{DegenerateFaces, Polygons};
use crate::geometry::vertex_dedup::{Corner, NO_INDEX, VertexDeduper};
use crate::io::{AssetRoot, ByteSource, Diagnostics, InputFile};
use crate::ply::body::Body;
use crate::ply::columns::PropertyRole;
use crate::ply::columns::{Columns, Row};
use crate::ply::header::Element;

/// Reads the model in a PLY file: one part.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<MeshFile> {
    let path = &source.path;
    let file = source.part(0..source.len());
    let (header, mut body) = header::parse(path, &source.bytes, file)?;
    let declared = |name| header.elements.iter().filter(|e| e.name == name).map(|e| e.count).sum();
    let vertices: usize = declared("vertex");
    assets.budget.take_elements(path, vertices as u64)?;

    let mut ply = Ply::new(path, vertices);
    for element in &header.elements {
        match &element.name[..] {
            "vertex" => ply.vertices(element, &mut body)?,
            "face" => ply.faces(element, &mut body)?,
            "tristrips" => ply.strips(element, &mut body)?,
            _ => ply.skip_element(element, &mut body)?,
        }
    }
    ply.notices.extend(ply.degenerate.notice(path));
    ply.notices.extend(body.notices());
    ply.notices.extend(header.odd.into_notices(path));
    ply.model(&header.textures, assets)
}

/// Number of bytes that must be in memory: the header of a binary file, if the file's length matches rows of vertices
/// and triangles. If a row turns out to have another length, the rest of the file is also read.
pub(crate) fn head(file: &File, size: u64) -> Option<u64> {
    /// Number of bytes in which the header must end.
    const HEADER: u64 = 1 << 14;
    /// Maximum length of a row in bytes.
    const ROW: usize = 256;
    let mut head = Vec::new();
    file.take(HEADER).read_to_end(&mut head).ok()?;
    let (start, length) = (0, usize::try_from(size).ok()?);
    let all = ByteSource::Disk { file, start, length };
    let (header, body) = header::parse(Path::new(""), &head, all).ok()?;
    let at = body.offset()?;
    let mut end = at;
    for element in &header.elements {
        let columns = Columns::new(element);
        let row = match &element.name[..] {
            "vertex" => columns.stride(),
            "face" => triangles::stride(element, &columns),
            _ => None,
        };
        end = end.checked_add(element.count.checked_mul(row.filter(|&row| row <= ROW)?)?)?;
    }
    (end == length).then_some(at as u64)
}

struct Ply<'a> {
    path: &'a Path,
    /// Number of vertices that the header declares.
    declared: usize,
    mesh: Mesh,
    polygons: Polygons,
    /// Used instead of `polygons` if all faces are plain triangles.
    triangles: Vec<[u32; 3]>,
    face_colors: Option<Vec<Rgb>>,
    corner_uvs: Vec<[f32; 2]>,
    /// Index in `corner_uvs` of each pair of texture coordinates, by the bits of the coordinates.
    known_uvs: HashMap<[u32; 2], u32>,
    translucent: bool,
    /// For each polygon: the number of its image, if faces have images.
    images: Option<Vec<i64>>,
    odd: Diagnostics,
    /// Ignored columns and elements.
    unused: Vec<String>,
    degenerate: DegenerateFaces,
    notices: Vec<Notice>,
}

impl<'a> Ply<'a> {
    fn new(path: &'a Path, declared: usize) -> Self {
        Self {
            path,
            declared,
            mesh: Mesh::default(),
            polygons: Polygons::default(),
            triangles: Vec::new(),
            face_colors: None,
            corner_uvs: Vec::new(),
            known_uvs: HashMap::new(),
            translucent: false,
            images: None,
            odd: Diagnostics::default(),
            unused: Vec::new(),
            degenerate: DegenerateFaces::default(),
            notices: Vec::new(),
        }
    }

    fn vertices(&mut self, element: &Element, body: &mut Body<'_>) -> Result<()> {
        if !self.mesh.vertices.is_empty() {
            return Err(FormatError::whole(
                self.path,
                ErrorCode::DuplicateName.message("a second element vertex; expected one"),
            ));
        }
        let vertices = vertices::read(self.path, element, body, &mut self.odd)?;
        self.note_unused(element);
        self.translucent |= vertices.translucent;
        self.mesh.vertices = vertices.positions;
        self.mesh.normals = vertices.normals;
        self.mesh.vertex_colors = vertices.colors;
        self.mesh.uvs = vertices.uvs;
        Ok(())
    }

    /// Records the ignored columns of an element.
    fn note_unused(&mut self, element: &Element) {
        let names = Columns::new(element).unused();
        self.unused.extend(names.into_iter().map(|name| format!("{} {name}", element.name)));
    }

    fn has_faces(&self) -> bool {
        self.polygons.len() + self.triangles.len() > 0
    }

    fn position(&self, body: &Body<'_>, face: usize, index: f64) -> Result<u32> {
        if index >= 0.0 && index < self.declared as f64 {
            return Ok(index as u32);
        }
        let count = self.declared;
        let message = format!("face {face}: vertex {index}, but the file has {count} vertices (numbered from 0)");
        Err(body.error(ErrorCode::IndexOutOfRange.message(message)))
    }

    fn faces(&mut self, element: &Element, body: &mut Body<'_>) -> Result<()> {
        let columns = Columns::new(element);
        if !columns.have(&[PropertyRole::Corners]) {
            return Err(FormatError::whole(
                self.path,
                ErrorCode::MissingValue.message("element face has no list vertex_indices"),
            ));
        }
        if self.has_faces() {
            return Err(FormatError::whole(
                self.path,
                ErrorCode::DuplicateName.message("a second element with faces; expected one"),
            ));
        }
        self.note_unused(element);
        if let Some(found) = triangles::read(element, &columns, body, self.declared) {
            self.triangles = found.triangles;
            self.face_colors = found.colors;
            self.translucent |= found.translucent;
            return Ok(());
        }
        let mut colors = columns.colors();
        let mut images = columns.have(&[PropertyRole::Image]).then(Vec::new);
        let mut row = Row::default();
        for number in 0..element.count {
            columns.read(body, &mut row)?;
            let own_uvs = !row.uvs.is_empty();
            if own_uvs && row.uvs.len() != 2 * row.corners.len() {
                let (uvs, corners) = (row.uvs.len(), row.corners.len());
                let message = format!(
                    "face {number}: {uvs} numbers of texture coordinates for {corners} corners; expected {}",
                    2 * corners
                );
                return Err(body.error(ErrorCode::WrongShape.message(message)));
            }
            for (i, &index) in row.corners.iter().enumerate() {
                let mut uv = NO_INDEX;
                if own_uvs {
                    let value = vertices::uv(body, row.uvs[2 * i], row.uvs[2 * i + 1], &mut self.odd);
                    uv = *self.known_uvs.entry(value.map(f32::to_bits)).or_insert_with(|| {
                        self.corner_uvs.push(value);
                        (self.corner_uvs.len() - 1) as u32
                    });
                }
                let position = self.position(body, number, index)?;
                self.polygons.push_corner(Corner { position, uv, normal: NO_INDEX });
            }
            if !self.polygons.end_face() {
                self.degenerate.add(|| body.location());
                continue;
            }
            if let Some(colors) = &mut colors {
                colors.push(row.color());
            }
            if let Some(images) = &mut images {
                images.push(row.numbers[PropertyRole::Image as usize] as i64);
            }
        }
        let odd = &mut self.odd;
        let settled = colors.map(|colors| colors.settle(|code, message| odd.note(code, "faces", message)));
        let (colors, translucent) = settled.unwrap_or_default();
        self.translucent |= translucent;
        self.images = images;
        self.face_colors = colors;
        Ok(())
    }

    /// Reads triangle strips; -1 starts another strip.
    fn strips(&mut self, element: &Element, body: &mut Body<'_>) -> Result<()> {
        let columns = Columns::new(element);
        if self.has_faces() {
            return Err(FormatError::whole(
                self.path,
                ErrorCode::DuplicateName.message("a second element with faces; expected one"),
            ));
        }
        let mut row = Row::default();
        for number in 0..element.count {
            columns.read(body, &mut row)?;
            for strip in row.corners.split(|&index| index == -1.0) {
                let strip: Result<Vec<u32>, _> =
                    strip.iter().map(|&index| self.position(body, number, index)).collect();
                for (i, triangle) in strip?.windows(3).enumerate() {
                    let &[mut a, mut b, c] = triangle else { continue };
                    // A triangle with repeated corners only continues the strip and is omitted.
                    if a == b || b == c || c == a {
                        continue;
                    }
                    if i % 2 == 1 {
                        std::mem::swap(&mut a, &mut b);
                    }
                    for position in [a, b, c] {
                        self.polygons.push_corner(Corner { position, uv: NO_INDEX, normal: NO_INDEX });
                    }
                    self.polygons.end_face();
                }
            }
        }
        Ok(())
    }

    /// Skips an unused element.
    fn skip_element(&mut self, element: &Element, body: &mut Body<'_>) -> Result<()> {
        if element.count > 0 {
            self.unused.push(format!("element {} ({})", element.name, counted(element.count, "row")));
        }
        let columns = Columns::new(element);
        let mut row = Row::default();
        (0..element.count).try_for_each(|_| columns.read(body, &mut row))
    }

    fn model(mut self, images_named: &[Vec<u8>], assets: &mut AssetRoot) -> Result<MeshFile> {
        let path = self.path;
        if !self.has_faces() {
            let message = format!("no faces, only {}; there is nothing to render", counted(self.declared, "vertex"));
            return Err(FormatError::whole(path, ErrorCode::NothingVisible.message(message)));
        }
        if self.mesh.vertices.len() != self.declared {
            return Err(FormatError::whole(
                path,
                ErrorCode::DuplicateName.message("more than one element vertex; expected one"),
            ));
        }
        if self.translucent {
            self.notices.push(Notice::new(
                NoticeCode::IgnoredTransparency,
                format!("{}: the transparency of its colours is ignored", path.display()),
            ));
        }
        let images = self.cut_polygons(assets)?;
        let mut notes: Vec<Notice> = colors::choose(&mut self.mesh).into_iter().collect();
        let filled = directionless::fill_normals(&mut self.mesh);
        if filled > 0 {
            notes.push(Notice::new(
                NoticeCode::ReplacedValue,
                format!("{} replaced by the faces' normals: no direction", counted(filled, "normal")),
            ));
        }
        self.notices.extend(notes.into_iter().map(|note| note.in_context(path.display())));
        let textured = self.mesh.uvs.is_some();
        let mut model = MeshFile::from_mesh(self.mesh, self.notices);
        if textured {
            textures::add(path, images_named, images, assets, &mut model)?;
        } else if !images_named.is_empty() {
            let message = "images are ignored, because the mesh has no texture coordinates";
            model.notices.push(Notice::new(NoticeCode::IgnoredElement, format!("{}: {message}", path.display())));
        }
        model.notices.extend(self.odd.into_notices(path));
        if !self.unused.is_empty() {
            self.unused.truncate(32);
            model.notices.push(Notice::new(
                NoticeCode::IgnoredKey,
                format!("{}: unused elements and properties ignored: {}", path.display(), self.unused.join(", ")),
            ));
        }
        Ok(model)
    }

    /// Cuts the polygons, and splits vertices whose corners differ; returns the number of each triangle's image, if
    /// faces have one.
    fn cut_polygons(&mut self, assets: &mut AssetRoot) -> Result<Option<Vec<i64>>> {
        let path = self.path;
        let Self { mesh, polygons, triangles, face_colors, corner_uvs, images, .. } = self;
        // Without texture coordinates per corner, the mesh's vertices are the file's vertices.
        let seams = !corner_uvs.is_empty();
        let mut vertices = VertexDeduper::new(if seams { mesh.vertices.len() } else { 0 });
        if seams {
            vertices.reserve(0..mesh.vertices.len() as u32);
        }
        assets.budget.take_elements(path, 3 * triangles.len() as u64)?;
        triangles.reserve_exact(polygons.len());
        // Without polygons, all faces were read as triangles, and each triangle has the colour of its face.
        let mut colors =
            if polygons.len() == 0 { face_colors.take() } else { face_colors.as_ref().map(|_| Vec::new()) };
        let mut numbers = images.is_some().then(Vec::new);
        let position = |c: Corner| mesh.vertices[c.position as usize];
        let all = 0..polygons.len();
        polygons.triangles(all, path, &mut assets.budget, position, |polygon, corners| {
            triangles.push(if seams {
                corners.map(|corner| vertices.vertex_of(corner))
            } else {
                corners.map(|corner| corner.position)
            });
            if let (Some(colors), Some(face_colors)) = (&mut colors, &*face_colors) {
                colors.push(face_colors[polygon]);
            }
            if let (Some(numbers), Some(images)) = (&mut numbers, &*images) {
                numbers.push(images[polygon]);
            }
        })?;
        mesh.triangles = std::mem::take(triangles);
        mesh.face_colors = colors;
        if seams {
            let of = |c: &Corner| corner_uvs.get(c.uv as usize).copied().unwrap_or([0.0; 2]);
            let origin = |c: &Corner| c.position as usize;
            let corner_of = &vertices.corner_of;
            mesh.uvs = Some(corner_of.iter().map(of).collect());
            mesh.vertices = corner_of.iter().map(|c| mesh.vertices[origin(c)]).collect();
            let normals = mesh.normals.take();
            mesh.normals = normals.map(|n| corner_of.iter().map(|c| n[origin(c)]).collect());
            let colors = mesh.vertex_colors.take();
            mesh.vertex_colors = colors.map(|n| corner_of.iter().map(|c| n[origin(c)]).collect());
        }
        Ok(numbers)
    }
}
