//! Range of an accessor's vertices that one primitive uses: many primitives may share one long accessor.

use crate::error::Result;
use crate::gltf::document::Document;
use crate::gltf::document::accessor_view::AccessorView;
use crate::gltf::mesh::attributes::AttributeSource;
use raycam_scene::ErrorCode;

/// Vertices of a primitive's accessors that its triangles use.
pub(crate) struct VertexWindow<'a> {
    pub(crate) document: &'a Document<'a>,
    pub(crate) source: &'a AttributeSource<'a>,
    /// Number of elements of each accessor.
    pub(crate) count: usize,
    pub(crate) first: usize,
    pub(crate) length: usize,
}

impl<'a> VertexWindow<'a> {
    pub(crate) fn slice(&self, elements: AccessorView<'a>) -> AccessorView<'a> {
        elements.slice(self.first, self.length)
    }

    /// Used elements of an attribute.
    pub(crate) fn elements(&self, name: &str) -> Result<Option<AccessorView<'a>>> {
        let Some(elements) = self.source.elements(name)? else { return Ok(None) };
        self.checked(elements, &format!("attributes.{name}")).map(Some)
    }

    /// The same elements of a separate accessor, as in morph targets.
    pub(crate) fn accessor(&self, index: usize, name: &str) -> Result<AccessorView<'a>> {
        let place = format!("{}.{name}", self.source.place);
        let elements = self.document.elements(index, &place)?;
        self.checked(elements, name)
    }

    fn checked(&self, elements: AccessorView<'a>, name: &str) -> Result<AccessorView<'a>> {
        if elements.count != self.count {
            return Err(self.document.fault(
                ErrorCode::WrongShape,
                format!(
                    "{}.{name}: {} elements, but there are {} positions \
                 (MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT)",
                    self.source.place, elements.count, self.count
                ),
            ));
        }
        Ok(self.slice(elements))
    }

    pub(crate) fn floats<const N: usize>(&self, name: &str) -> Result<Option<Vec<[f32; N]>>> {
        match self.elements(name)? {
            Some(elements) => elements.floats().map(Some),
            None => Ok(None),
        }
    }
}
