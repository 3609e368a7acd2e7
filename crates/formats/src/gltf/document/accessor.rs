//! Accessors: typed elements in bytes (glTF 2.0, section 3.6.2), which may be strided, sparse or normalised.

use crate::error::Result;
use crate::gltf::document::Document;
use crate::gltf::document::accessor_view::{AccessorView, Component};
use crate::gltf::json::{Accessor, Sparse};
use crate::io::ByteSource;
use raycam_scene::ErrorCode;

/// Numbers of columns and rows of an element of this type; their product is the number of components.
fn shape(kind: &str) -> Option<(usize, usize)> {
    Some(match kind {
        "SCALAR" => (1, 1),
        "VEC2" => (1, 2),
        "VEC3" => (1, 3),
        "VEC4" => (1, 4),
        "MAT2" => (2, 2),
        "MAT3" => (3, 3),
        "MAT4" => (4, 4),
        _ => return None,
    })
}

/// Validated type of an accessor's elements.
struct Layout {
    component: Component,
    arity: usize,
    size: usize,
}

impl Layout {
    fn new(accessor: &Accessor) -> Result<Self, (ErrorCode, String)> {
        let Some(component) = Component::from_code(accessor.component_type) else {
            let message = format!(
                ".componentType: {}; expected 5120, 5121, 5122, 5123, 5125 or 5126 (VALUE_NOT_IN_LIST)",
                accessor.component_type
            );
            return Err((ErrorCode::InvalidValue, message));
        };
        let Some((columns, rows)) = shape(&accessor.kind) else {
            let message = format!(
                ".type: {:?}; expected SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4 (VALUE_NOT_IN_LIST)",
                accessor.kind
            );
            return Err((ErrorCode::UnknownName, message));
        };
        let column = rows * component.size();
        // Columns of matrices start at multiples of four bytes (3.6.2.4).
        let size = if columns > 1 && column % 4 != 0 {
            let message =
                ": integer matrices whose columns need padding to 4 bytes are not supported; use float components";
            return Err((ErrorCode::UnsupportedFeature, message.into()));
        } else {
            columns * column
        };
        Ok(Self { component, arity: columns * rows, size })
    }
}

impl<'a> Document<'a> {
    /// Elements of an accessor; `from` is the position in the document that refers to the accessor.
    pub(crate) fn elements(&'a self, index: usize, from: &str) -> Result<AccessorView<'a>> {
        let Some(accessor) = self.root.accessors.get(index) else {
            return Err(self.unresolved(from, "accessors", index, self.root.accessors.len()));
        };
        let place = format!("accessors[{index}]");
        let fault = |code, message: String| self.fault(code, format!("{place}{message}"));
        let layout = Layout::new(accessor).map_err(|(code, message)| fault(code, message))?;
        let size = layout.size;
        let count = accessor.count;
        if count == 0 {
            return Err(fault(ErrorCode::OutOfRange, ".count: 0; expected at least 1 (VALUE_NOT_IN_RANGE)".into()));
        }
        let (mut bytes, mut stride): (ByteSource<'_>, usize) = match accessor.buffer_view {
            None => {
                self.charge(&place, count, size as u64)?;
                (ByteSource::Memory(vec![0; count as usize * size].into()), size)
            }
            Some(view) => {
                let (bytes, stride) = self
                    .resources
                    .bytes(view)
                    .map_err(|e| fault(ErrorCode::IndexOutOfRange, format!(".bufferView: {e}")))?;
                let stride = stride.unwrap_or(size);
                let range = element_bytes(bytes, accessor.byte_offset, count, size, stride).map_err(|e| {
                    fault(ErrorCode::TruncatedFile, format!("{e} of bufferViews[{view}] (ACCESSOR_TOO_LONG)"))
                })?;
                (range, stride)
            }
        };
        let count = count as usize;
        if let Some(sparse) = &accessor.sparse {
            self.charge(&place, count as u64, size as u64)?;
            // The elements are copied without gaps, because writing through overlapping strides would change several
            // elements.
            let mut dense = Vec::with_capacity(count * size);
            let copy = |_, bytes: &[u8]| {
                bytes.chunks(stride).for_each(|element| dense.extend_from_slice(&element[..size]));
            };
            bytes.for_each_window(0, count, stride, size, copy).map_err(|error| self.read_error(error))?;
            self.overwrite_sparse(&place, sparse, size, &mut dense)?;
            stride = size;
            bytes = ByteSource::Memory(dense.into());
        }
        Ok(AccessorView {
            document: self,
            place,
            wrong_format: wrong_format(from),
            component: layout.component,
            arity: layout.arity,
            normalized: accessor.normalized,
            count,
            stride,
            bytes,
        })
    }

    /// Writes the elements of a sparse accessor, of `size` bytes each, over the elements of `dense`.
    fn overwrite_sparse(&self, place: &str, sparse: &Sparse, size: usize, dense: &mut [u8]) -> Result<()> {
        let fault = |code, message: String| self.fault(code, format!("{place}.sparse.{message}"));
        let count = dense.len() / size;
        let indices = &sparse.indices;
        let kind = Component::from_code(indices.component_type)
            .filter(|kind| matches!(kind, Component::U8 | Component::U16 | Component::U32));
        let Some(kind) = kind else {
            return Err(fault(
                ErrorCode::InvalidValue,
                format!(
                    "indices.componentType: {}; expected 5121, 5123 or 5125 (VALUE_NOT_IN_LIST)",
                    indices.component_type
                ),
            ));
        };
        if sparse.count > count as u64 {
            return Err(fault(
                ErrorCode::OutOfRange,
                format!(
                    "count: {}; expected at most {count} elements (ACCESSOR_SPARSE_COUNT_OUT_OF_RANGE)",
                    sparse.count
                ),
            ));
        }
        let part = |name: &str, view: usize, offset: u64, size: usize| {
            let (bytes, _) = self
                .resources
                .bytes(view)
                .map_err(|e| fault(ErrorCode::IndexOutOfRange, format!("{name}.bufferView: {e}")))?;
            let range = element_bytes(bytes, offset, sparse.count, size, size).map_err(|e| {
                fault(ErrorCode::TruncatedFile, format!("{name}{e} of bufferViews[{view}] (ACCESSOR_TOO_LONG)"))
            })?;
            range.read().map_err(|error| self.read_error(error))
        };
        let (view, offset) = (indices.buffer_view, indices.byte_offset);
        let targets = part("indices", view, offset, kind.size())?;
        let values = &sparse.values;
        let values = part("values", values.buffer_view, values.byte_offset, size)?;
        for (i, value) in values.chunks_exact(size).enumerate() {
            let target = integer(kind, &targets[i * kind.size()..]) as usize;
            let Some(element) = dense.get_mut(target * size..(target + 1) * size) else {
                return Err(fault(
                    ErrorCode::IndexOutOfRange,
                    format!(
                        "indices: index {i} is {target}, but there are {count} elements (ACCESSOR_SPARSE_INDEX_OOB)"
                    ),
                ));
            };
            element.copy_from_slice(value);
        }
        Ok(())
    }
}

/// glTF-Validator's code for an accessor of the wrong type, by the key that refers to the accessor.
fn wrong_format(from: &str) -> &'static str {
    match from.rsplit('.').next() {
        Some("indices") => "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT",
        Some("input") => "ANIMATION_SAMPLER_INPUT_ACCESSOR_INVALID_FORMAT",
        Some("output") => "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_FORMAT",
        Some("inverseBindMatrices") => "SKIN_IBM_INVALID_FORMAT",
        _ => ATTRIBUTE_FORMAT,
    }
}

/// glTF-Validator's code for an attribute of the wrong format.
pub(crate) const ATTRIBUTE_FORMAT: &str = "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT";

/// Bytes of `count` elements in a view.
fn element_bytes(
    bytes: ByteSource<'_>,
    offset: u64,
    count: u64,
    size: usize,
    stride: usize,
) -> Result<ByteSource<'_>, String> {
    let needed = count
        .saturating_sub(1)
        .checked_mul(stride as u64)
        .and_then(|bytes| bytes.checked_add(size as u64))
        .and_then(|bytes| bytes.checked_add(offset))
        .unwrap_or(u64::MAX);
    if stride < size || needed > bytes.len() as u64 {
        return Err(format!(
            ": {count} elements of {size} bytes with stride {stride} from offset {offset} do not fit into the \
             view's {} bytes",
            bytes.len()
        ));
    }
    Ok(bytes.part(offset as usize..needed as usize))
}

/// Little-endian unsigned integer; 0 if the bytes are too few, which earlier checks exclude.
fn integer(component: Component, bytes: &[u8]) -> u32 {
    match (component, bytes) {
        (Component::U8, [a, ..]) => u32::from(*a),
        (Component::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
        (Component::U32, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]),
        _ => 0,
    }
}
