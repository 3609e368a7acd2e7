//! Fields of hits: named columns of numbers.

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, Hit, INVALID_ID};

use crate::ground_truth::convert::{signed_id, to_float_hit};
use crate::interaction::ray_cone::Footprint;
use crate::interaction::vector::{unit, unit_normal};
use crate::prepare::geometry::Geometry;

/// Property of a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Distance along the ray, in units of the direction's length; +inf for a miss.
    T,
    /// Index of the object; -1 for a miss.
    Instance,
    /// Index of the triangle in its mesh; -1 for a miss.
    Triangle,
    /// Weights of the triangle's corners: each is at least 0, and their sum is 1; all are 0 for a miss.
    Barycentric,
    /// Unit geometric normal in world coordinates, on the ray's side; 0 for a miss.
    Normal,
    /// Surface point in world coordinates; NaN for a miss.
    Position,
    /// True if the ray enters through the front: corners counter-clockwise, or clockwise in a mirrored instance.
    Front,
    /// Distance from the ray's origin in world units; +inf for a miss.
    Distance,
    /// Unit normal interpolated from the corners, on the ray's side; 0 for a miss.
    ShadingNormal,
    /// Texture coordinates of the mesh's first set, v downwards; NaN for a miss and for a mesh without texture
    /// coordinates.
    Uv,
    /// Index of the material; -1 for a miss.
    Material,
    /// Index of the category; -1 for a miss and for an object without a category.
    Category,
    /// Linear base colour with its texture; 0 for a miss.
    Albedo,
    /// Perceptual roughness with its texture; 0 for a miss.
    Roughness,
    /// Metallic value with its texture: 1 for metals; 0 for a miss.
    Metallic,
    /// Radiance that the surface emits towards the ray's origin; 0 for a miss.
    Emission,
    /// Diffuse reflectance of the material's texture for lidars; NaN without such a texture, and for a miss.
    Reflectance,
}

/// Names of all fields.
pub const FIELDS: [(&str, Field); 17] = [
    ("t", Field::T),
    ("instance", Field::Instance),
    ("triangle", Field::Triangle),
    ("barycentric", Field::Barycentric),
    ("normal", Field::Normal),
    ("position", Field::Position),
    ("front", Field::Front),
    ("distance", Field::Distance),
    ("shading_normal", Field::ShadingNormal),
    ("uv", Field::Uv),
    ("material", Field::Material),
    ("category", Field::Category),
    ("albedo", Field::Albedo),
    ("roughness", Field::Roughness),
    ("metallic", Field::Metallic),
    ("emission", Field::Emission),
    ("reflectance", Field::Reflectance),
];

/// Values of a field for a list of hits: `width` numbers per hit.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// float64.
    Float64(Vec<f64>),
    /// float32.
    Float32(Vec<f32>),
    /// int32.
    Int32(Vec<i32>),
    /// bool.
    Bool(Vec<bool>),
}

impl Column {
    /// Total number of values: the number of hits times the width.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        match self {
            Column::Float64(values) => values.len(),
            Column::Float32(values) => values.len(),
            Column::Int32(values) => values.len(),
            Column::Bool(values) => values.len(),
        }
    }

    /// Moves the `width` values of hit i to position `order[i]`.
    fn scatter(&mut self, order: &[usize], width: usize) {
        match self {
            Column::Float64(values) => scatter(values, order, width),
            Column::Float32(values) => scatter(values, order, width),
            Column::Int32(values) => scatter(values, order, width),
            Column::Bool(values) => scatter(values, order, width),
        }
    }

    /// All values, as one part.
    fn whole(&mut self) -> ColumnPart<'_> {
        match self {
            Column::Float64(values) => ColumnPart::Float64(values),
            Column::Float32(values) => ColumnPart::Float32(values),
            Column::Int32(values) => ColumnPart::Int32(values),
            Column::Bool(values) => ColumnPart::Bool(values),
        }
    }

    /// The values in parts of `length` values each; the last part may be shorter.
    fn parts(&mut self, length: usize) -> Vec<ColumnPart<'_>> {
        match self {
            Column::Float64(values) => values.chunks_mut(length).map(ColumnPart::Float64).collect(),
            Column::Float32(values) => values.chunks_mut(length).map(ColumnPart::Float32).collect(),
            Column::Int32(values) => values.chunks_mut(length).map(ColumnPart::Int32).collect(),
            Column::Bool(values) => values.chunks_mut(length).map(ColumnPart::Bool).collect(),
        }
    }

    /// Appends a column of the same type.
    pub(super) fn append(&mut self, other: Column) {
        match (self, other) {
            (Column::Float64(all), Column::Float64(mut more)) => all.append(&mut more),
            (Column::Float32(all), Column::Float32(mut more)) => all.append(&mut more),
            (Column::Int32(all), Column::Int32(mut more)) => all.append(&mut more),
            (Column::Bool(all), Column::Bool(mut more)) => all.append(&mut more),
            _ => unreachable!("columns of a field have the same type"),
        }
    }
}

/// Consecutive values of a column.
enum ColumnPart<'a> {
    Float64(&'a mut [f64]),
    Float32(&'a mut [f32]),
    Int32(&'a mut [i32]),
    Bool(&'a mut [bool]),
}

/// The values of consecutive hits, in columns of several fields.
pub(super) struct ColumnsPart<'a>(Vec<(Field, ColumnPart<'a>)>);

impl ColumnsPart<'_> {
    /// Writes the fields of hits. The values of hit i are written to position `order[i]` or, without an order, to
    /// position `first + i`.
    pub(super) fn write<'h>(
        &mut self,
        geometry: &Geometry,
        first: usize,
        hits: impl Iterator<Item = RayHit<'h>> + Clone,
        order: Option<&[usize]>,
    ) {
        for (field, part) in &mut self.0 {
            let start = if order.is_some() { 0 } else { first * field.width() };
            match part {
                ColumnPart::Float64(values) => {
                    write_float64(&mut values[start..], geometry, *field, hits.clone(), order)
                }
                ColumnPart::Float32(values) => {
                    write_float32(&mut values[start..], geometry, *field, hits.clone(), order)
                }
                ColumnPart::Int32(values) => write_int32(&mut values[start..], geometry, *field, hits.clone(), order),
                ColumnPart::Bool(values) => {
                    let value = |(_, hit): RayHit| [is_hit(hit) && is_front(geometry, hit)];
                    write_rows(&mut values[start..], hits.clone(), order, value);
                }
            }
        }
    }
}

/// The columns of several fields.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns(pub Vec<(Field, Column)>);

impl Columns {
    /// Columns of `hits` hits, filled with zeros.
    pub(super) fn zeros(fields: &[Field], hits: usize) -> Self {
        Self(fields.iter().map(|&field| (field, field.zeros(hits))).collect())
    }

    /// The values in parts of `hits` hits each; the last part may be shorter.
    pub(super) fn parts(&mut self, hits: usize) -> Vec<ColumnsPart<'_>> {
        let mut parts = vec![];
        for (field, column) in &mut self.0 {
            for (i, part) in column.parts(hits * field.width()).into_iter().enumerate() {
                if i == parts.len() {
                    parts.push(ColumnsPart(vec![]));
                }
                parts[i].0.push((*field, part));
            }
        }
        parts
    }

    /// All values, as one part.
    pub(super) fn whole(&mut self) -> ColumnsPart<'_> {
        ColumnsPart(self.0.iter_mut().map(|(field, column)| (*field, column.whole())).collect())
    }

    pub(super) fn append(&mut self, other: Columns) {
        for ((_, all), (_, more)) in self.0.iter_mut().zip(other.0) {
            all.append(more);
        }
    }

    /// Moves the values of hit i to position `order[i]`.
    pub(super) fn scatter(&mut self, order: &[usize]) {
        for (field, column) in &mut self.0 {
            column.scatter(order, field.width());
        }
    }

    /// Replaces each instance index in the column [`Field::Instance`] by `new` of this index.
    pub(super) fn rename_instances(&mut self, new: impl Fn(i32) -> i32) {
        for (field, column) in &mut self.0 {
            if let (Field::Instance, Column::Int32(values)) = (field, column) {
                values.iter_mut().for_each(|value| *value = new(*value));
            }
        }
    }

    /// Column of a field, if present.
    pub fn get(&self, field: Field) -> Option<&Column> {
        self.0.iter().find(|(name, _)| *name == field).map(|(_, column)| column)
    }
}

impl Field {
    /// Numbers per hit.
    pub fn width(self) -> usize {
        match self {
            Field::Barycentric | Field::Normal | Field::Position | Field::ShadingNormal => 3,
            Field::Albedo | Field::Emission => 3,
            Field::Uv => 2,
            _ => 1,
        }
    }

    /// True if the value depends on the position within the triangle.
    pub(super) fn needs_intersection(self) -> bool {
        !matches!(
            self,
            Field::Instance | Field::Triangle | Field::Normal | Field::Front | Field::Material | Field::Category
        )
    }

    /// True if the value depends on the triangle's normal, or on the side from which the ray hits it.
    pub(super) fn needs_side(self) -> bool {
        self.needs_intersection() || matches!(self, Field::Normal | Field::Front)
    }

    fn zeros(self, hits: usize) -> Column {
        let n = hits * self.width();
        match self {
            Field::Instance | Field::Triangle | Field::Material | Field::Category => Column::Int32(vec![0; n]),
            Field::Front => Column::Bool(vec![false; n]),
            Field::Albedo | Field::Roughness | Field::Metallic | Field::Emission | Field::Reflectance => {
                Column::Float32(vec![0.0; n])
            }
            _ => Column::Float64(vec![0.0; n]),
        }
    }
}

fn scatter<T: Copy>(values: &mut [T], order: &[usize], width: usize) {
    let sorted = values.to_vec();
    for (&place, row) in order.iter().zip(sorted.chunks_exact(width)) {
        values[place * width..][..width].copy_from_slice(row);
    }
}

/// Ray and its hit, with exact t and weights.
pub(super) type RayHit<'a> = (&'a ExactRay, &'a ExactHit);

/// Returns the columns of the requested fields for these hits.
pub(super) fn columns<'a>(
    geometry: &Geometry,
    fields: &[Field],
    hits: impl ExactSizeIterator<Item = RayHit<'a>> + Clone,
) -> Columns {
    let mut found = Columns::zeros(fields, hits.len());
    found.whole().write(geometry, 0, hits, None);
    found
}

fn write_float64<'a>(
    values: &mut [f64],
    geometry: &Geometry,
    field: Field,
    hits: impl Iterator<Item = RayHit<'a>>,
    order: Option<&[usize]>,
) {
    match field {
        Field::T => write_rows(values, hits, order, |(_, hit)| [hit.t]),
        Field::Distance => write_rows(values, hits, order, |(ray, hit)| [distance(ray, hit)]),
        Field::Barycentric => write_rows(values, hits, order, or_miss(0.0, |_, hit| weights(hit))),
        Field::Normal => {
            write_rows(values, hits, order, or_miss(0.0, |_, hit| facing_normal(geometry, hit).to_array()));
        }
        Field::Position => write_rows(values, hits, order, or_miss(f64::NAN, |_, hit| position(geometry, hit))),
        Field::ShadingNormal => {
            write_rows(values, hits, order, or_miss(0.0, |_, hit| shading_normal(geometry, hit).to_array()));
        }
        Field::Uv => {
            let uv = |_: &ExactRay, hit: &ExactHit| {
                let found = geometry.uv(hit.instance, hit.triangle, 0, [hit.u, hit.v]);
                found.map_or([f64::NAN; 2], |uv| uv.map(f64::from))
            };
            write_rows(values, hits, order, or_miss(f64::NAN, uv));
        }
        _ => unreachable!("not a field of float64"),
    }
}

fn write_float32<'a>(
    values: &mut [f32],
    geometry: &Geometry,
    field: Field,
    hits: impl Iterator<Item = RayHit<'a>>,
    order: Option<&[usize]>,
) {
    match field {
        Field::Albedo => {
            let color = |_: &ExactRay, hit: &Hit| geometry.base_color(hit, &Footprint::default()).to_array();
            write_rows(values, hits, order, or_black(color));
        }
        Field::Roughness => write_rows(values, hits, order, or_black(|_, hit| [geometry.roughness(hit)])),
        Field::Metallic => write_rows(values, hits, order, or_black(|_, hit| [geometry.metallic(hit)])),
        Field::Reflectance => write_rows(values, hits, order, |(_, hit)| {
            let value = if is_hit(hit) { geometry.reflectance(&to_float_hit(hit)) } else { None };
            [value.unwrap_or(f32::NAN)]
        }),
        Field::Emission => {
            let radiance = |ray: &ExactRay, hit: &Hit| {
                let direction = DVec3::from(ray.direction).as_vec3();
                geometry.emission(hit, direction, &Footprint::default()).to_array()
            };
            write_rows(values, hits, order, or_black(radiance));
        }
        _ => unreachable!("not a field of float32"),
    }
}

fn write_int32<'a>(
    values: &mut [i32],
    geometry: &Geometry,
    field: Field,
    hits: impl Iterator<Item = RayHit<'a>>,
    order: Option<&[usize]>,
) {
    match field {
        Field::Instance => write_rows(values, hits, order, |(_, hit)| [signed_id(hit.instance)]),
        Field::Triangle => write_rows(values, hits, order, |(_, hit)| [signed_id(hit.triangle)]),
        Field::Material => {
            let number = |hit: &ExactHit| geometry.material_index(hit.instance, hit.triangle) as i32;
            write_rows(values, hits, order, |(_, hit)| [if is_hit(hit) { number(hit) } else { -1 }]);
        }
        Field::Category => {
            let number = |hit: &ExactHit| geometry.instances[hit.instance as usize].category;
            write_rows(values, hits, order, |(_, hit)| [if is_hit(hit) { number(hit) } else { -1 }]);
        }
        _ => unreachable!("not a field of int32"),
    }
}

/// Writes N values per hit: the values of hit i to row `order[i]`, or to row i without an order.
#[inline(always)]
fn write_rows<'a, T: Copy, const N: usize>(
    values: &mut [T],
    hits: impl Iterator<Item = RayHit<'a>>,
    order: Option<&[usize]>,
    value: impl Fn(RayHit<'a>) -> [T; N],
) {
    let rows = values.as_chunks_mut::<N>().0;
    match order {
        None => rows.iter_mut().zip(hits).for_each(|(row, hit)| *row = value(hit)),
        Some(order) => order.iter().zip(hits).for_each(|(&at, hit)| rows[at] = value(hit)),
    }
}

fn is_hit(hit: &ExactHit) -> bool {
    hit.instance != INVALID_ID
}

/// The value of a hit, or `miss` if the ray hits nothing.
#[inline(always)]
fn or_miss<'a, const N: usize>(
    miss: f64,
    value: impl Fn(&ExactRay, &ExactHit) -> [f64; N],
) -> impl Fn(RayHit<'a>) -> [f64; N] {
    move |(ray, hit)| if is_hit(hit) { value(ray, hit) } else { [miss; N] }
}

/// The value of a float32 hit, or 0 if the ray hits nothing.
#[inline(always)]
fn or_black<'a, const N: usize>(value: impl Fn(&ExactRay, &Hit) -> [f32; N]) -> impl Fn(RayHit<'a>) -> [f32; N] {
    move |(ray, hit)| if is_hit(hit) { value(ray, &to_float_hit(hit)) } else { [0.0; N] }
}

/// Weights of the corners, each at least 0.
pub(super) fn weights(hit: &ExactHit) -> [f64; 3] {
    [(1.0 - hit.u - hit.v).max(0.0), hit.u, hit.v]
}

fn position(geometry: &Geometry, hit: &ExactHit) -> [f64; 3] {
    let [a, b, c] = geometry.corners(hit.instance, hit.triangle);
    let [u, v, w] = [1.0 - hit.u - hit.v, hit.u, hit.v];
    (a * u + b * v + c * w).to_array()
}

/// True if the ray enters by the front of the surface.
pub(super) fn is_front(geometry: &Geometry, hit: &ExactHit) -> bool {
    (hit.side < 0) != geometry.instances[hit.instance as usize].flips_orientation
}

fn facing_normal(geometry: &Geometry, hit: &ExactHit) -> DVec3 {
    let corners = || unit_normal(geometry.corners(hit.instance, hit.triangle));
    let normal = unit(hit.normal.into()).unwrap_or_else(corners);
    if hit.side > 0 { -normal } else { normal }
}

fn shading_normal(geometry: &Geometry, hit: &ExactHit) -> DVec3 {
    let facing = facing_normal(geometry, hit);
    let Some([a, b, c]) = geometry.facing_vertex_normals(hit.instance, hit.triangle, facing) else {
        return facing;
    };
    let [u, v, w] = weights(hit);
    (a * u + b * v + c * w).normalize_or(facing)
}

fn distance(ray: &ExactRay, hit: &ExactHit) -> f64 {
    if is_hit(hit) { hit.t * DVec3::from(ray.direction).length() } else { f64::INFINITY }
}
