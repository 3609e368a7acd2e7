//! Meshes compressed by Draco, bitstream 2.2: glTF's `KHR_draco_mesh_compression`.

use raycam_scene::ErrorCode;
use std::path::Path;

use draco_core::draco_types::DataType;
use draco_core::geometry_attribute::PointAttribute;
use draco_core::geometry_indices::PointIndex;
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::io::catch_panic::catch_decoder_panic;

/// Mesh decoded from a Draco stream.
#[derive(Clone, Debug, PartialEq)]
pub struct DecodedMesh {
    /// Triangles; each corner is an index into the elements of every attribute.
    pub triangles: Vec<[u32; 3]>,
    /// Number of elements in every attribute.
    pub count: usize,
    /// Attributes in the order of the stream.
    pub attributes: Vec<Attribute>,
}

/// Attribute in the form of a glTF accessor.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Id in the `attributes` of the extension.
    pub id: u32,
    /// Type of each component.
    pub component: ComponentType,
    /// Components per element.
    pub components: usize,
    /// Elements without gaps, little-endian.
    pub bytes: Vec<u8>,
}

/// Component type, as in glTF's accessors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComponentType {
    /// `BYTE`
    I8,
    /// `UNSIGNED_BYTE`
    U8,
    /// `SHORT`
    I16,
    /// `UNSIGNED_SHORT`
    U16,
    /// 32-bit signed, for which glTF has no accessor.
    I32,
    /// `UNSIGNED_INT`
    U32,
    /// `FLOAT`
    F32,
}

/// Decodes the mesh in a Draco stream. `path` names the file in errors.
///
/// # Errors
/// An error if the bytes are not a valid Draco mesh of version 2.2, or if an attribute has a type that glTF does not
/// support. An error if the mesh is larger than the remaining budget, or larger than the stream can contain (a byte
/// describes at most eight triangles).
pub fn decode(bytes: &[u8], path: &Path, budget: &mut Budget) -> Result<DecodedMesh> {
    let fault = |message: String| {
        FormatError::whole(path, ErrorCode::DamagedData.message(format!("Draco compression: {message}")))
    };
    match bytes {
        [b'D', b'R', b'A', b'C', b'O', 2, 2, 1, ..] => {}
        [b'D', b'R', b'A', b'C', b'O', 2, 2, ..] => return Err(fault("the stream is not a mesh".into())),
        [b'D', b'R', b'A', b'C', b'O', major, minor, ..] => {
            let message = format!("Draco compression of version {major}.{minor}; expected 2.2");
            return Err(FormatError::unsupported(path, message));
        }
        _ => return Err(fault("the stream does not begin with DRACO".into())),
    }
    let length = bytes.len() as u64;
    let triangles = (8 * length).min(budget.elements / 3);
    let limits = DecodeLimits::permissive()
        .with_max_faces(triangles)
        .with_max_points(3 * triangles)
        .with_max_decoded_bytes((256 * length + (64 << 20)).min(budget.bytes));
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    catch_decoder_panic(path, || {
        MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|error| fault(error.to_string()))
    })?;

    let count = mesh.num_points();
    // The number of points is charged too, because a stream may declare more points than its faces use.
    let corners = 3 * mesh.num_faces() as u64;
    budget.take_elements(path, (count as u64).saturating_add(corners))?;
    let triangles: Vec<_> = mesh.faces().iter().map(|face| face.map(|p| p.0)).collect();
    if triangles.as_flattened().iter().any(|&p| p as usize >= count) {
        return Err(fault(format!("a corner has a point index beyond the {count} points")));
    }
    let mut attributes = Vec::new();
    for id in 0..mesh.num_attributes() {
        let attribute = mesh.attribute(id);
        let size = attribute.data_type().byte_length() * usize::from(attribute.num_components());
        budget.take_bytes(path, (count as u64).saturating_mul(size as u64))?;
        attributes.push(values(attribute, count, size).map_err(fault)?);
    }
    Ok(DecodedMesh { triangles, count, attributes })
}

/// The attribute's values for all points; a value takes `size` bytes.
fn values(attribute: &PointAttribute, count: usize, size: usize) -> Result<Attribute, String> {
    let id = attribute.unique_id();
    let component = match attribute.data_type() {
        DataType::Int8 => ComponentType::I8,
        DataType::Uint8 => ComponentType::U8,
        DataType::Int16 => ComponentType::I16,
        DataType::Uint16 => ComponentType::U16,
        DataType::Int32 => ComponentType::I32,
        DataType::Uint32 => ComponentType::U32,
        DataType::Float32 => ComponentType::F32,
        other => return Err(format!("attribute {id} has type {other:?}, which glTF does not support")),
    };
    let data = attribute.buffer().data();
    let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
    let mut bytes = Vec::with_capacity(count * size);
    for point in 0..count as u32 {
        let value = attribute.mapped_index(PointIndex(point)).0 as usize;
        let start = value.checked_mul(stride);
        let element = start.and_then(|start| data.get(start..)?.get(..size));
        let element = element.filter(|_| value < attribute.size());
        bytes.extend(element.ok_or_else(|| format!("attribute {id} has no value for point {point}"))?);
    }
    Ok(Attribute { id, component, components: attribute.num_components().into(), bytes })
}
