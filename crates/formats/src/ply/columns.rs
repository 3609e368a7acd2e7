//! Rows of a table by the roles of its columns.

use raycam_scene::color::{Rgb, linear_from_srgb8};

use crate::error::Result;
use crate::ply::body::Body;
use crate::ply::color_scale::PlyColors;
use crate::ply::header::{self, Element};
use crate::ply::scalar::ScalarType;

/// Role of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PropertyRole {
    X,
    Y,
    Z,
    NormalX,
    NormalY,
    NormalZ,
    Red,
    Green,
    Blue,
    Alpha,
    U,
    V,
    /// Index of a face's image.
    Image,
    /// List of a face's vertex indices.
    Corners,
    /// List of texture coordinates, two per corner.
    CornerUvs,
    Unused,
}

use PropertyRole::{Alpha, Blue, Green, NormalX, NormalY, NormalZ, Red, U, V, X, Y, Z};

impl PropertyRole {
    fn from_name(name: &str, list: bool) -> Self {
        match (name, list) {
            ("x", false) => X,
            ("y", false) => Y,
            ("z", false) => Z,
            ("nx", false) => NormalX,
            ("ny", false) => NormalY,
            ("nz", false) => NormalZ,
            ("red" | "r" | "diffuse_red", false) => Red,
            ("green" | "g" | "diffuse_green", false) => Green,
            ("blue" | "b" | "diffuse_blue", false) => Blue,
            ("alpha" | "a" | "diffuse_alpha", false) => Alpha,
            ("s" | "u" | "texture_u" | "texcoord_u", false) => U,
            ("t" | "v" | "texture_v" | "texcoord_v", false) => V,
            ("texnumber", false) => Self::Image,
            ("vertex_indices" | "vertex_index", true) => Self::Corners,
            ("texcoord", true) => Self::CornerUvs,
            _ => Self::Unused,
        }
    }
}

/// Row of a table: its numbers by role, and its lists.
#[derive(Default)]
pub(crate) struct Row {
    pub(crate) numbers: [f64; PropertyRole::Unused as usize + 1],
    pub(crate) corners: Vec<f64>,
    pub(crate) uvs: Vec<f64>,
    unused: Vec<f64>,
}

impl Row {
    /// Red, green, blue and alpha as in the file.
    pub(crate) fn color(&self) -> [f64; 4] {
        [Red, Green, Blue, Alpha].map(|role| self.numbers[role as usize])
    }
}

/// Columns of an element.
pub(crate) struct Columns<'a> {
    element: &'a Element,
    roles: Vec<PropertyRole>,
    /// Number type of the element's colours.
    color: ScalarType,
}

impl<'a> Columns<'a> {
    pub(crate) fn new(element: &'a Element) -> Self {
        let role = |p: &header::Property| PropertyRole::from_name(&p.name, p.list.is_some());
        let roles: Vec<_> = element.properties.iter().map(role).collect();
        let red = roles.iter().position(|&m| m == Red);
        Self { element, color: red.map_or(ScalarType::U8, |i| element.properties[i].kind), roles }
    }

    pub(crate) fn have(&self, wanted: &[PropertyRole]) -> bool {
        wanted.iter().all(|role| self.roles.contains(role))
    }

    /// Roles of all columns.
    pub(crate) fn roles(&self) -> impl Iterator<Item = PropertyRole> {
        self.roles.iter().copied()
    }

    pub(crate) fn read(&self, body: &mut Body<'_>, row: &mut Row) -> Result<()> {
        row.corners.clear();
        row.uvs.clear();
        row.unused.clear();
        body.row()?;
        for (property, &role) in self.element.properties.iter().zip(&self.roles) {
            let Some(list) = property.list else {
                row.numbers[role as usize] = body.value(property.kind)?;
                continue;
            };
            let length = body.length(list)?;
            let values = match role {
                PropertyRole::Corners => &mut row.corners,
                PropertyRole::CornerUvs => &mut row.uvs,
                _ => &mut row.unused,
            };
            body.values(property.kind, length, values)?;
        }
        body.end_row();
        Ok(())
    }

    /// Bytes of a row without lists in a binary file.
    pub(crate) fn stride(&self) -> Option<usize> {
        let properties = &self.element.properties;
        let lists = properties.iter().any(|p| p.list.is_some());
        (!lists).then(|| properties.iter().map(|p| p.kind.bytes()).sum())
    }

    /// Type and byte offset of each column with a role, in a row without lists.
    pub(crate) fn column_offsets(&self) -> Vec<(PropertyRole, ScalarType, usize)> {
        let mut at = 0;
        let place = |(property, role): (&header::Property, PropertyRole)| {
            let start = at;
            at += property.kind.bytes();
            (role, property.kind, start)
        };
        let all = self.element.properties.iter().zip(self.roles());
        let used = |place: &(PropertyRole, ScalarType, usize)| place.0 != PropertyRole::Unused;
        all.map(place).filter(used).collect()
    }

    /// Linear colour from red, green and blue, if the values' type determines their range.
    pub(crate) fn linear(&self, given: [f64; 3]) -> Option<Rgb> {
        match self.color {
            ScalarType::F32 | ScalarType::F64 => {
                given.iter().all(|c| (0.0..=1.0).contains(c)).then(|| given.map(|c| c as f32))
            }
            ScalarType::U8 => Some(linear_from_srgb8(given.map(|c| c as u8))),
            _ => None,
        }
    }

    /// Maximum colour value, if the type determines this value.
    pub(crate) fn white(&self) -> f64 {
        if self.color.is_float() { 1.0 } else { 255.0 }
    }

    /// Empty list that collects the colours of this element; `None` if the element has no colours.
    pub(crate) fn colors(&self) -> Option<PlyColors> {
        let alpha = self.have(&[Alpha]);
        self.have(&[Red, Green, Blue]).then(|| PlyColors::new(self.color, alpha))
    }

    /// Names of the ignored columns.
    pub(crate) fn unused(&self) -> Vec<String> {
        let whole = |role: PropertyRole| {
            let groups: [&[PropertyRole]; 4] = [&[X, Y, Z], &[NormalX, NormalY, NormalZ], &[Red, Green, Blue], &[U, V]];
            groups.iter().find(|group| group.contains(&role)).is_none_or(|group| self.have(group))
        };
        let columns = self.element.properties.iter().zip(self.roles());
        let unused = columns.filter(|(_, role)| *role == PropertyRole::Unused || !whole(*role));
        unused
            .map(|(property, _)| match &property.name[..] {
                name @ ("rgb" | "rgba") => format!("{name} (packed colours)"),
                name => name.into(),
            })
            .collect()
    }
}
