//! Sources of a primitive's attributes and indices: accessors, or a Draco stream.

use raycam_scene::{ErrorCode, NoticeCode};

use crate::codec::draco;
use crate::error::Result;
use crate::gltf::document::Document;
use crate::gltf::document::accessor::ATTRIBUTE_FORMAT;
use crate::gltf::document::accessor_view::{AccessorView, Component};
use crate::gltf::json::{Draco, Primitive};
use crate::io::{AssetRoot, ByteSource, Diagnostics, parallel};

/// Attributes of a primitive by name.
pub(crate) struct AttributeSource<'a> {
    document: &'a Document<'a>,
    /// Name of the primitive in errors.
    pub(crate) place: String,
    primitive: &'a Primitive,
    decoded: Option<(&'a Draco, draco::DecodedMesh)>,
}

impl<'a> AttributeSource<'a> {
    pub(crate) fn new(
        document: &'a Document<'a>,
        place: &str,
        primitive: &'a Primitive,
        assets: &mut AssetRoot,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self> {
        for name in primitive.attributes.keys() {
            let message = match name.rsplit_once('_') {
                _ if matches!(&name[..], "POSITION" | "NORMAL" | "TANGENT" | "COLOR_0") => continue,
                // Names that begin with an underscore are application-specific attributes.
                _ if name.starts_with('_') => continue,
                Some(("COLOR", set)) if set.parse::<u32>().is_ok() => "ignored: only COLOR_0 is used",
                Some(("TEXCOORD" | "JOINTS" | "WEIGHTS", set)) if set.parse::<u32>().is_ok() => continue,
                _ => "ignored: unknown glTF attribute (MESH_PRIMITIVE_INVALID_ATTRIBUTE)",
            };
            diagnostics.note(NoticeCode::IgnoredFeature, format!("{place}.attributes.{name}"), message);
        }
        let mut decoded = None;
        if let Some(draco) = &primitive.extensions.draco {
            let place = format!("{place}.extensions.KHR_draco_mesh_compression");
            let (bytes, _) = document
                .resources
                .bytes(draco.buffer_view)
                .map_err(|e| document.fault(ErrorCode::IndexOutOfRange, format!("{place}.bufferView: {e}")))?;
            let bytes = bytes.read().map_err(|error| document.read_error(error))?;
            let mesh = draco::decode(&bytes, document.path, &mut assets.budget)?;
            let bytes = mesh.attributes.iter().map(|a| a.bytes.len());
            document.allowance.grant(bytes.sum::<usize>() + 12 * mesh.triangles.len());
            decoded = Some((draco, mesh));
        }
        Ok(Self { document, place: place.into(), primitive, decoded })
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.primitive.attributes.contains_key(name)
    }

    /// Elements of an attribute, if the primitive has it.
    pub(crate) fn elements(&'a self, name: &str) -> Result<Option<AccessorView<'a>>> {
        let Some(&index) = self.primitive.attributes.get(name) else { return Ok(None) };
        let place = format!("{}.attributes.{name}", self.place);
        let accessor = self.document.root.accessors.get(index);
        let Some((draco, mesh)) = &self.decoded else {
            return self.document.elements(index, &place).map(Some);
        };
        let Some(&id) = draco.attributes.get(name) else {
            return self.document.elements(index, &place).map(Some);
        };
        let found = mesh.attributes.iter().find(|a| a.id as usize == id);
        let Some(attribute) = found else {
            return Err(self.document.fault(
                ErrorCode::IndexOutOfRange,
                format!(
                    "{}.extensions.KHR_draco_mesh_compression.attributes.{name}: the stream has no attribute {id}",
                    self.place
                ),
            ));
        };
        let Some(component) = Component::from_draco(attribute.component) else {
            return Err(self.document.fault(
                ErrorCode::WrongType,
                format!("{place}: 32-bit signed integers in the Draco stream, which glTF does not support"),
            ));
        };
        Ok(Some(AccessorView {
            document: self.document,
            place,
            wrong_format: ATTRIBUTE_FORMAT,
            component,
            arity: attribute.components,
            normalized: accessor.is_some_and(|accessor| accessor.normalized),
            count: mesh.count,
            stride: attribute.bytes.len() / mesh.count.max(1),
            bytes: ByteSource::Memory(attribute.bytes[..].into()),
        }))
    }

    /// Vertex indices of the primitive's corners in groups of `N`, in order, and the number of corners after the last
    /// complete group. `count` is the number of vertices.
    pub(crate) fn corners<const N: usize>(&'a self, count: usize) -> Result<(Vec<[u32; N]>, usize)> {
        let document = self.document;
        if let Some((_, mesh)) = &self.decoded {
            let (groups, over) = mesh.triangles.as_flattened().as_chunks();
            return Ok((groups.to_vec(), over.len()));
        }
        let Some(index) = self.primitive.indices else {
            let place = format!("{}.attributes", self.place);
            document.charge(&place, count as u64, 4)?;
            let count = u32::try_from(count).map_err(|_| {
                document.fault(ErrorCode::TooLarge, format!("{place}: {count} vertices, which exceeds 32-bit indices"))
            })?;
            let each = N as u32;
            let group = |i: u32| std::array::from_fn(|j| i * each + j as u32);
            let groups = (0..count / each).map(group).collect();
            return Ok((groups, (count % each) as usize));
        };
        let place = format!("{}.indices", self.place);
        let elements = document.elements(index, &place)?;
        let restart = match elements.component {
            Component::U8 => 0xff,
            Component::U16 => 0xffff,
            _ => u32::MAX,
        };
        let place = elements.place.clone();
        let (groups, over) = elements.chunks::<N>()?;
        let indices = groups.as_flattened();
        let (_, largest) = parallel::min_max(indices);
        if largest as usize >= count
            && let Some(i) = indices.iter().position(|&index| index as usize >= count)
        {
            let found = indices[i];
            let code = if found == restart { "ACCESSOR_INDEX_PRIMITIVE_RESTART" } else { "ACCESSOR_INDEX_OOB" };
            return Err(document.fault(
                ErrorCode::IndexOutOfRange,
                format!("{place}: index {i} is {found}, but there are {count} vertices ({code})"),
            ));
        }
        Ok((groups, over))
    }
}
