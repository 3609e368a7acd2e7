//! Vertices of a PLY file: read at once if their rows have the same length; otherwise, or to report a fault, row by
//! row.

use std::path::Path;

use glam::DVec3;
use raycam_scene::color::Rgb;
use raycam_scene::{ErrorCode, NoticeCode};

use crate::error::{FormatError, Result};
use crate::io::Diagnostics;
use crate::ply::body::Body;
use crate::ply::columns::PropertyRole::{self, Alpha, Blue, Green, NormalX, NormalY, NormalZ, Red, U, V, X, Y, Z};
use crate::ply::columns::{Columns, Row};
use crate::ply::header::Element;
use crate::ply::table::FixedTable;

/// Vertex data in the form of a mesh.
pub(crate) struct PlyVertices {
    pub(crate) positions: Vec<DVec3>,
    /// Normals of unit length, or zero if the file's normal has no direction.
    pub(crate) normals: Option<Vec<[f32; 3]>>,
    pub(crate) colors: Option<Vec<Rgb>>,
    pub(crate) uvs: Option<Vec<[f32; 2]>>,
    /// True if any colour is translucent.
    pub(crate) translucent: bool,
}

/// Reads the rows of the element `vertex`.
pub(crate) fn read(path: &Path, element: &Element, body: &mut Body<'_>, odd: &mut Diagnostics) -> Result<PlyVertices> {
    let columns = Columns::new(element);
    if !columns.have(&[X, Y, Z]) {
        return Err(FormatError::whole(path, ErrorCode::MissingValue.message("element vertex has no x, y and z")));
    }
    if let Some(table) = FixedTable::peek(&columns, element.count, body)
        && let Some(vertices) = at_once(&columns, &table)
    {
        let length = table.length();
        body.skip(length);
        return Ok(vertices);
    }
    row_by_row(element.count, &columns, body, odd)
}

/// Reads each column of the table at once; `None` if a column or value is missing or invalid.
fn at_once(columns: &Columns<'_>, table: &FixedTable<'_>) -> Option<PlyVertices> {
    let finite = |position: [f64; 3]| position.iter().all(|c| c.is_finite()).then_some(position);
    let positions = table.read([X, Y, Z], finite)?;
    let (mut normals, mut colors, mut uvs, mut translucent) = (None, None, None, false);
    if columns.have(&[NormalX, NormalY, NormalZ]) {
        let normal = |given| Some(normalized(DVec3::from_array(given)));
        normals = Some(table.read([NormalX, NormalY, NormalZ], normal)?);
    }
    if columns.have(&[Red, Green, Blue]) {
        colors = Some(table.read([Red, Green, Blue], |given| columns.linear(given))?);
        let opaque = |[alpha]: [f64; 1]| (alpha >= columns.white()).then_some([0_u8]);
        translucent = columns.have(&[Alpha]) && table.read([Alpha], opaque).is_none();
    }
    if columns.have(&[U, V]) {
        uvs = Some(table.read([U, V], |[u, v]| flipped_uv(u, v))?);
    }
    Some(PlyVertices {
        // This conversion takes no time, because both types have the same memory layout.
        positions: positions.into_iter().map(DVec3::from_array).collect(),
        normals,
        colors,
        uvs,
        translucent,
    })
}

fn row_by_row(count: usize, columns: &Columns<'_>, body: &mut Body<'_>, odd: &mut Diagnostics) -> Result<PlyVertices> {
    let mut positions = Vec::with_capacity(count);
    let mut normals = columns.have(&[NormalX, NormalY, NormalZ]).then(Vec::new);
    let mut colors = columns.colors();
    let mut uvs = columns.have(&[U, V]).then(Vec::new);
    let mut row = Row::default();
    for _ in 0..count {
        columns.read(body, &mut row)?;
        let vector = |names: [PropertyRole; 3]| DVec3::from(names.map(|m| row.numbers[m as usize]));
        // Faces that use a vertex which is not finite are omitted.
        positions.push(vector([X, Y, Z]));
        if let Some(normals) = &mut normals {
            normals.push(normalized(vector([NormalX, NormalY, NormalZ])));
        }
        if let Some(colors) = &mut colors {
            colors.push(row.color());
        }
        if let Some(uvs) = &mut uvs {
            uvs.push(uv(body, row.numbers[U as usize], row.numbers[V as usize], odd));
        }
    }
    let settled = colors.map(|colors| colors.settle(|code, message| odd.note(code, "vertices", message)));
    let (colors, translucent) = settled.unwrap_or_default();
    Ok(PlyVertices { positions, normals, colors, uvs, translucent })
}

/// Unit direction, or zero for a vector without a direction.
fn normalized(normal: DVec3) -> [f32; 3] {
    normal.normalize_or_zero().as_vec3().to_array()
}

/// Texture coordinates with their origin at the top left; `None` if they are not finite.
fn flipped_uv(u: f64, v: f64) -> Option<[f32; 2]> {
    (u.is_finite() && v.is_finite()).then_some([u as f32, (1.0 - v) as f32])
}

/// Texture coordinates with their origin at the top left; if they are not finite, (0, 0) of the file, with a notice.
pub(crate) fn uv(body: &Body<'_>, u: f64, v: f64, odd: &mut Diagnostics) -> [f32; 2] {
    flipped_uv(u, v).unwrap_or_else(|| {
        let message = format!("texture coordinate ({u}, {v}) is not finite; treated as (0, 0)");
        odd.note_kind(NoticeCode::ReplacedValue, "uv", body.location(), message);
        [0.0, 1.0]
    })
}
