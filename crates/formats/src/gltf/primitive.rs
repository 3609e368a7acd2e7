//! Primitives: triangles with what their vertices carry.

use glam::{DVec3, Vec3};
use raycam_scene::Mesh;

use super::attributes::AttributeSource;
use super::json::Primitive;
use super::tangent;
use super::{Document, material};
use crate::error::FormatError;
use crate::gltf::accessor_view::{Component, Elements};
use crate::gltf::diagnostics::Ledger;
use crate::gltf::skin_morph::Deformation;
use crate::io::asset_root::Folder;
use crate::io::parallel;

/// A primitive of triangles.
pub(super) struct Part {
    pub(super) mesh: Mesh,
    pub(super) material: Option<usize>,
    pub(super) deformation: Deformation,
}

impl Document<'_> {
    /// The triangles of a primitive; `None` where it has none.
    pub(super) fn part(
        &self,
        place: &str,
        primitive: &Primitive,
        folder: &mut Folder,
        ledger: &mut Ledger,
    ) -> Result<Option<Part>, FormatError> {
        match primitive.mode {
            0 => {
                ledger.note(place, "points are not shown: only triangles have a surface");
                return Ok(None);
            }
            1..=3 => {
                ledger.note(place, "lines are not shown: only triangles have a surface");
                return Ok(None);
            }
            4..=6 => {}
            mode => {
                return Err(self.fault(format!(
                    "{place}.mode: {mode}, expected 0..=6 (VALUE_NOT_IN_RANGE)"
                )));
            }
        }
        let source = AttributeSource::new(self, place, primitive, folder, ledger)?;
        let Some(positions) = source.elements("POSITION", ledger)? else {
            ledger.note(
                place,
                "no POSITION: nothing to see (MESH_PRIMITIVE_NO_POSITION)",
            );
            return Ok(None);
        };
        let count = positions.count;
        let (mut triangles, over) = match primitive.mode {
            4 => source.corners::<3>(count, ledger)?,
            mode => {
                let (corners, _) = source.corners::<1>(count, ledger)?;
                let corners = corners.into_flattened();
                let over = if corners.len() < 3 { corners.len() } else { 0 };
                (chained(mode, &corners), over)
            }
        };
        if triangles.is_empty() {
            ledger.note(place, format!("{over} corners make no triangle"));
            return Ok(None);
        }
        if over > 0 {
            let message =
                "corners that make no triangle are left over (MESH_PRIMITIVE_INCOMPATIBLE_MODE)";
            ledger.note(place, message);
        }
        // Many primitives may share one long accessor: each gets the part that it uses.
        let (first, last) = parallel::extremes(triangles.as_flattened());
        if first > 0 {
            for corner in triangles.as_flattened_mut() {
                *corner -= first;
            }
        }
        let window = Window {
            document: self,
            source: &source,
            count,
            first: first as usize,
            length: (last - first) as usize + 1,
        };
        let amount = window.length + 3 * triangles.len();
        folder.budget.take_elements(self.path, amount as u64)?;

        let mut mesh = Mesh {
            vertices: self.positions(window.of(positions), ledger)?,
            triangles,
            ..Mesh::default()
        };
        if let Some(normals) = window.elements("NORMAL", ledger)? {
            let unit = |normal| Vec3::from_array(normal).normalize_or_zero().to_array();
            mesh.normals = Some(normals.made_of_floats(self, ledger, unit)?);
        }
        mesh.uvs = window.floats("TEXCOORD_0", ledger)?;
        while let Some(uvs) =
            window.floats(&format!("TEXCOORD_{}", mesh.more_uvs.len() + 1), ledger)?
        {
            mesh.more_uvs.push(uvs);
        }
        if mesh.uvs.is_none() && !mesh.more_uvs.is_empty() {
            mesh.uvs = Some(vec![[0.0; 2]; window.length]);
        }
        // Tangents without normals have no meaning (3.7.2.1).
        if mesh.normals.is_some() {
            mesh.tangents = window
                .floats("TANGENT", ledger)?
                .map(|tangents: Vec<[f32; 4]>| {
                    let unit = |[x, y, z, w]: [f32; 4]| {
                        let [x, y, z] = Vec3::new(x, y, z).normalize_or_zero().to_array();
                        [x, y, z, if w < 0.0 { -1.0 } else { 1.0 }]
                    };
                    tangents.into_iter().map(unit).collect()
                });
        }
        self.colors(place, &window, &mut mesh, ledger)?;
        let mut part = Part {
            deformation: window.deformation(place, primitive, ledger)?,
            material: primitive.material,
            mesh,
        };
        let uses = material::Uses::of(self, place, primitive)?;
        uses.check_uvs(place, &part.mesh, ledger);
        if part.mesh.tangents.is_none()
            && let Some(set) = uses.tangent_uvs
        {
            let sources = tangent::generate(&mut part.mesh, set);
            part.deformation.resample(&sources);
        }
        Ok(Some(part))
    }

    /// Positions, in full precision.
    fn positions(
        &self,
        elements: Elements<'_>,
        ledger: &mut Ledger,
    ) -> Result<Vec<DVec3>, FormatError> {
        let place = elements.place.clone();
        ledger.take(self.path, &place, elements.count as u64, 12)?;
        let positions = elements.made_of_floats(self, ledger, |v: [f32; 3]| v.map(f64::from))?;
        // Takes no time: the same numbers at the same places.
        Ok(positions.into_iter().map(DVec3::from_array).collect())
    }

    fn colors(
        &self,
        place: &str,
        window: &Window<'_>,
        mesh: &mut Mesh,
        ledger: &mut Ledger,
    ) -> Result<(), FormatError> {
        if window.source.has("COLOR_1") {
            ledger.note(place, "only the first set of vertex colours is used");
        }
        let Some(elements) = window.elements("COLOR_0", ledger)? else {
            return Ok(());
        };
        let mut clamped = false;
        let mut share = |v: f32| {
            clamped |= !(0.0..=1.0).contains(&v);
            v.clamp(0.0, 1.0)
        };
        if elements.component != Component::F32 && !elements.normalized {
            return Err(self.fault(format!(
                "{place}.attributes.COLOR_0: integers that are not normalised \
                 (MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT)"
            )));
        }
        if elements.arity == 4 {
            let colors = elements.floats::<4>(self, ledger)?;
            mesh.vertex_colors = Some(
                colors
                    .iter()
                    .map(|&[r, g, b, _]| [r, g, b].map(&mut share))
                    .collect(),
            );
            if colors.iter().any(|color| color[3] != 1.0) {
                mesh.vertex_opacities = Some(colors.iter().map(|color| share(color[3])).collect());
            }
        } else {
            let colors = elements.floats::<3>(self, ledger)?;
            mesh.vertex_colors = Some(colors.iter().map(|color| color.map(&mut share)).collect());
        }
        if clamped {
            let message = "colours outside 0..=1 are clamped (ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND)";
            ledger.note(format!("{place}.attributes.COLOR_0"), message);
        }
        Ok(())
    }
}

/// The vertices of a primitive's accessors that its triangles use.
pub(super) struct Window<'a> {
    pub(super) document: &'a Document<'a>,
    source: &'a AttributeSource<'a>,
    /// Elements of its accessors.
    count: usize,
    first: usize,
    pub(super) length: usize,
}

impl<'a> Window<'a> {
    fn of(&self, elements: Elements<'a>) -> Elements<'a> {
        elements.window(self.first, self.length)
    }

    /// The elements of an attribute that are used.
    pub(super) fn elements(
        &self,
        name: &str,
        ledger: &mut Ledger,
    ) -> Result<Option<Elements<'a>>, FormatError> {
        let Some(elements) = self.source.elements(name, ledger)? else {
            return Ok(None);
        };
        self.checked(elements, &format!("attributes.{name}"))
            .map(Some)
    }

    /// The same elements of an accessor of its own, as morph targets have it.
    pub(super) fn accessor(
        &self,
        index: usize,
        name: &str,
        ledger: &mut Ledger,
    ) -> Result<Elements<'a>, FormatError> {
        let place = format!("{}.{name}", self.source.place);
        let elements = self.document.elements(index, &place, ledger)?;
        self.checked(elements, name)
    }

    fn checked(&self, elements: Elements<'a>, name: &str) -> Result<Elements<'a>, FormatError> {
        if elements.count != self.count {
            return Err(self.document.fault(format!(
                "{}.{name}: {} elements, but there are {} positions \
                 (MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT)",
                self.source.place, elements.count, self.count
            )));
        }
        Ok(self.of(elements))
    }

    fn floats<const N: usize>(
        &self,
        name: &str,
        ledger: &mut Ledger,
    ) -> Result<Option<Vec<[f32; N]>>, FormatError> {
        match self.elements(name, ledger)? {
            Some(elements) => elements.floats(self.document, ledger).map(Some),
            None => Ok(None),
        }
    }
}

/// The triangles of a strip (mode 5) or fan (3.7.2.1), all of which turn the way of the first.
fn chained(mode: u32, corners: &[u32]) -> Vec<[u32; 3]> {
    if mode == 6 {
        return match corners.split_first() {
            Some((&hub, rim)) => rim.windows(2).map(|w| [w[0], w[1], hub]).collect(),
            None => Vec::new(),
        };
    }
    let triangle = |(i, w): (usize, &[u32])| match i % 2 {
        0 => [w[0], w[1], w[2]],
        _ => [w[0], w[2], w[1]],
    };
    corners.windows(3).enumerate().map(triangle).collect()
}
