//! Primitives of triangles as meshes.

use glam::{DVec3, Vec3};
use raycam_scene::{ErrorCode, Mesh, NoticeCode, counted};

use crate::error::Result;
use crate::geometry::finite;
use crate::gltf::document::Document;
use crate::gltf::document::accessor_view::{AccessorView, Component};
use crate::gltf::json::Primitive;
use crate::gltf::mesh::attributes::AttributeSource;
use crate::gltf::mesh::material_requirements::MaterialRequirements;
use crate::gltf::mesh::skin_morph::SkinMorph;
use crate::gltf::mesh::tangent;
use crate::gltf::mesh::vertex_window::VertexWindow;
use crate::io::{AssetRoot, Diagnostics, parallel};

/// Mesh of a primitive that consists of triangles.
pub(crate) struct PrimitiveMesh {
    pub(crate) mesh: Mesh,
    pub(crate) material: Option<usize>,
    pub(crate) skin_morph: SkinMorph,
}

/// Reader of a primitive, which becomes a mesh.
pub(crate) struct PrimitiveReader<'a> {
    pub(crate) document: &'a Document<'a>,
    /// Name of the primitive in errors.
    pub(crate) place: &'a str,
    pub(crate) primitive: &'a Primitive,
    pub(crate) assets: &'a mut AssetRoot,
    pub(crate) diagnostics: &'a mut Diagnostics,
}

impl PrimitiveReader<'_> {
    /// Mesh of the primitive; `None` if the primitive has no triangles.
    pub(crate) fn read(&mut self) -> Result<Option<PrimitiveMesh>> {
        if !self.has_triangle_mode() {
            return Ok(None);
        }
        let source = AttributeSource::new(self.document, self.place, self.primitive, self.assets, self.diagnostics)?;
        self.note_missing_bounds();
        let Some(positions) = source.elements("POSITION")? else {
            self.diagnostics.note(
                NoticeCode::IgnoredElement,
                self.place,
                "no POSITION; there is nothing to render (MESH_PRIMITIVE_NO_POSITION)",
            );
            return Ok(None);
        };
        let count = positions.count;
        let Some(mut triangles) = self.triangles(&source, count)? else { return Ok(None) };
        let (first, last) = parallel::min_max(triangles.as_flattened());
        if first > 0 {
            for corner in triangles.as_flattened_mut() {
                *corner -= first;
            }
        }
        let window = VertexWindow {
            document: self.document,
            source: &source,
            count,
            first: first as usize,
            length: (last - first) as usize + 1,
        };
        let amount = window.length + 3 * triangles.len();
        let budget = &mut self.assets.budget;
        budget.take_elements(self.document.path, amount as u64)?;
        let (vertices, finite) = self.positions(window.slice(positions))?;
        let mut mesh = Mesh { vertices, triangles, ..Mesh::default() };
        if !finite && let Some(message) = finite::drop_non_finite(&mut mesh).message() {
            self.diagnostics.note(
                NoticeCode::DroppedGeometry,
                self.place,
                format!("{message} (ACCESSOR_INVALID_FLOAT)"),
            );
            if mesh.triangles.is_empty() {
                return Ok(None);
            }
        }
        self.shading_attributes(&window, &mut mesh)?;
        self.colors(&window, &mut mesh)?;
        let mut skin_morph = window.skin_morph(self.place, self.primitive, self.diagnostics)?;
        let needed = MaterialRequirements::of_primitive(self.document, self.primitive);
        needed.check_uvs(self.place, &mesh, self.diagnostics);
        if mesh.tangents.is_none()
            && let Some(set) = needed.tangent_uvs
        {
            let sources = tangent::generate(&mut mesh, set);
            skin_morph.resample(&sources);
        }
        Ok(Some(PrimitiveMesh { mesh, material: self.primitive.material, skin_morph }))
    }

    /// True for lists, strips and fans of triangles; points, lines and unknown modes cause a notice.
    fn has_triangle_mode(&mut self) -> bool {
        let message = match self.primitive.mode {
            0 => "points are not supported: only triangles have a surface".into(),
            1..=3 => "lines are not supported: only triangles have a surface".into(),
            4..=6 => return true,
            mode => format!("omitted: its mode is {mode}; expected 0 to 6 (VALUE_NOT_IN_RANGE)"),
        };
        self.diagnostics.note(NoticeCode::IgnoredElement, self.place, message);
        false
    }

    /// Adds a notice about positions without `min` and `max`. Reading continues, because bounds are computed from the
    /// vertices.
    fn note_missing_bounds(&mut self) {
        let index = self.primitive.attributes.get("POSITION");
        let accessor = index.and_then(|&index| {
            let accessor = self.document.root.accessors.get(index)?;
            Some((index, accessor))
        });
        if let Some((index, accessor)) = accessor
            && (accessor.min.is_none() || accessor.max.is_none())
        {
            let message = format!(
                "accessors[{index}] has no min and max \
                 (MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS)"
            );
            let place = format!("{}.attributes.POSITION", self.place);
            self.diagnostics.note(NoticeCode::InvalidFile, place, message);
        }
    }

    /// Triangles of the primitive, whose attributes have `count` elements; `None` if the primitive has no triangles.
    fn triangles(&mut self, source: &AttributeSource<'_>, count: usize) -> Result<Option<Vec<[u32; 3]>>> {
        let (triangles, over) = match self.primitive.mode {
            4 => source.corners::<3>(count)?,
            mode => {
                let (corners, _) = source.corners::<1>(count)?;
                let corners = corners.into_flattened();
                let over = if corners.len() < 3 { corners.len() } else { 0 };
                (strip_or_fan_triangles(mode, &corners), over)
            }
        };
        if triangles.is_empty() {
            self.diagnostics.note(
                NoticeCode::DroppedGeometry,
                self.place,
                format!("{} cannot form a triangle", counted(over, "corner")),
            );
            return Ok(None);
        }
        if over > 0 {
            let message = "the corners after the last triangle are omitted (MESH_PRIMITIVE_INCOMPATIBLE_MODE)";
            self.diagnostics.note(NoticeCode::DroppedGeometry, self.place, message);
        }
        Ok(Some(triangles))
    }

    /// Positions as float64, and true if all are finite.
    fn positions(&mut self, elements: AccessorView<'_>) -> Result<(Vec<DVec3>, bool)> {
        self.document.charge(&elements.place, elements.count as u64, 12)?;
        let widen = |v: [f32; 3]| v.map(f64::from);
        let (positions, finite) = elements.map_any_floats(widen)?;
        // This conversion takes no time, because both types have the same memory layout.
        Ok((positions.into_iter().map(DVec3::from_array).collect(), finite))
    }

    /// Reads normals, texture coordinates and tangents.
    fn shading_attributes(&mut self, window: &VertexWindow<'_>, mesh: &mut Mesh) -> Result<()> {
        if let Some(normals) = window.elements("NORMAL")? {
            let unit = |normal| Vec3::from_array(normal).normalize_or_zero().to_array();
            mesh.normals = Some(normals.map_floats(unit)?);
        }
        mesh.uvs = window.floats("TEXCOORD_0")?;
        while let Some(uvs) = window.floats(&format!("TEXCOORD_{}", mesh.more_uvs.len() + 1))? {
            mesh.more_uvs.push(uvs);
        }
        if mesh.uvs.is_none() && !mesh.more_uvs.is_empty() {
            mesh.uvs = Some(vec![[0.0; 2]; window.length]);
        }
        // Tangents without normals have no meaning (3.7.2.1).
        if mesh.normals.is_some() {
            let unit = |[x, y, z, w]: [f32; 4]| {
                let [x, y, z] = Vec3::new(x, y, z).normalize_or_zero().to_array();
                [x, y, z, if w < 0.0 { -1.0 } else { 1.0 }]
            };
            let tangents: Option<Vec<[f32; 4]>> = window.floats("TANGENT")?;
            mesh.tangents = tangents.map(|all| all.into_iter().map(unit).collect());
        }
        Ok(())
    }

    /// Reads vertex colours and opacities.
    fn colors(&mut self, window: &VertexWindow<'_>, mesh: &mut Mesh) -> Result<()> {
        let (document, place) = (self.document, self.place);
        if window.source.has("COLOR_1") {
            self.diagnostics.note(NoticeCode::FirstOnly, place, "only the first set of vertex colours is used");
        }
        let Some(elements) = window.elements("COLOR_0")? else { return Ok(()) };
        let mut clamped = false;
        let mut unit_interval = |v: f32| {
            clamped |= !(0.0..=1.0).contains(&v);
            v.clamp(0.0, 1.0)
        };
        if elements.component != Component::F32 && !elements.normalized {
            return Err(document.fault(
                ErrorCode::WrongType,
                format!(
                    "{place}.attributes.COLOR_0: integers must be normalised \
                 (MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT)"
                ),
            ));
        }
        if elements.arity == 4 {
            let colors = elements.floats::<4>()?;
            mesh.vertex_colors = Some(colors.iter().map(|&[r, g, b, _]| [r, g, b].map(&mut unit_interval)).collect());
            if colors.iter().any(|color| color[3] != 1.0) {
                let alphas = colors.iter().map(|color| unit_interval(color[3]));
                mesh.vertex_opacities = Some(alphas.collect());
            }
        } else {
            let colors = elements.floats::<3>()?;
            let colors = colors.iter().map(|color| color.map(&mut unit_interval));
            mesh.vertex_colors = Some(colors.collect());
        }
        if clamped {
            let message = "colours outside 0 to 1 are clamped (ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND)";
            let place = format!("{place}.attributes.COLOR_0");
            self.diagnostics.note(NoticeCode::ClampedValue, place, message);
        }
        Ok(())
    }
}

/// Triangles of a strip (mode 5) or fan (3.7.2.1), with the winding order of the first triangle.
fn strip_or_fan_triangles(mode: u32, corners: &[u32]) -> Vec<[u32; 3]> {
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
