//! Meshes compressed by Draco, bitstream 2.2: glTF's `KHR_draco_mesh_compression`.

use std::path::Path;

use draco_core::draco_types::DataType;
use draco_core::geometry_attribute::PointAttribute;
use draco_core::geometry_indices::PointIndex;
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::io::catch_panic::catch_decoder_panic;

/// A decoded mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct DecodedMesh {
    /// Each corner is an element of every attribute.
    pub triangles: Vec<[u32; 3]>,
    /// Elements of every attribute.
    pub count: usize,
    /// In the order of the stream.
    pub attributes: Vec<Attribute>,
}

/// One attribute, as an accessor of glTF would hold it.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Id in the `attributes` of the extension.
    pub id: u32,
    /// Type of one component.
    pub component: ComponentType,
    /// Components of one element.
    pub components: usize,
    /// Elements without gaps, little-endian.
    pub bytes: Vec<u8>,
}

/// The type of one number.
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
    /// 32 bits with a sign, which glTF has no accessors for.
    I32,
    /// `UNSIGNED_INT`
    U32,
    /// `FLOAT`
    F32,
}

/// The mesh in a Draco stream. `path` names the file in errors.
///
/// # Errors
/// When the bytes are not a Draco mesh of version 2.2 or are damaged, an attribute is of a type that glTF cannot have,
/// or the mesh is larger than what is left of the budget or than the stream can honestly say: a byte describes at most
/// eight triangles.
pub fn decode(bytes: &[u8], path: &Path, budget: &mut Budget) -> Result<DecodedMesh> {
    let fault = |message: String| FormatError::whole(path, format!("Draco compression: {message}"));
    match bytes {
        [b'D', b'R', b'A', b'C', b'O', 2, 2, 1, ..] => {}
        [b'D', b'R', b'A', b'C', b'O', 2, 2, ..] => return Err(fault("not a mesh".into())),
        [b'D', b'R', b'A', b'C', b'O', major, minor, ..] => {
            let message = format!("Draco compression of version {major}.{minor}, expected 2.2");
            return Err(FormatError::unsupported(path, message));
        }
        _ => return Err(fault("does not begin with DRACO".into())),
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
    // A stream may say any number of points.
    let corners = 3 * mesh.num_faces() as u64;
    budget.take_elements(path, (count as u64).saturating_add(corners))?;
    let triangles: Vec<_> = mesh.faces().iter().map(|face| face.map(|p| p.0)).collect();
    if triangles.as_flattened().iter().any(|&p| p as usize >= count) {
        return Err(fault(format!("a corner beyond its {count} points")));
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

/// The attribute of every point, of `size` bytes each.
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
        other => return Err(format!("attribute {id} is of {other:?}, which glTF has not")),
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
