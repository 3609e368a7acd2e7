//! Buffer views compressed by meshoptimizer: `EXT_meshopt_compression` and `KHR_meshopt_compression`.
//!
//! The bitstreams and filters follow the extensions' specifications, appendices A and B (Khronos Group, glTF
//! repository).

mod attributes;
mod filter;
mod indices;
mod stream;
use raycam_scene::ErrorCode;
use std::path::Path;

use crate::budget::Budget;
use crate::error::{FormatError, Result};

pub use filter::Filter;

/// Contents of a view: glTF's `mode`, with the `filter` that only attributes can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// `ATTRIBUTES`: elements of any kind.
    Attributes(Filter),
    /// `TRIANGLES`: the indices of a list of triangles.
    Triangles,
    /// `INDICES`: indices in any order.
    Indices,
}

/// Properties of a compressed view in glTF's JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewHeader {
    /// `mode` and `filter`.
    pub mode: Mode,
    /// `count`: number of elements, or of indices.
    pub count: usize,
    /// `byteStride`: bytes per element.
    pub stride: usize,
}

/// Decodes a compressed view to `count * stride` bytes. `path` names the file in errors.
///
/// Both versions of the attribute stream are supported under either extension.
///
/// # Errors
/// An error if the extension does not allow the header's mode, filter, count or stride, or if the bytes are not a
/// complete stream with this header. An error if an element is invalid for its filter, or if the remaining budget is
/// too small.
pub fn decode(bytes: &[u8], shape: ViewHeader, path: &Path, budget: &mut Budget) -> Result<Vec<u8>> {
    let fault = |code: ErrorCode, message: String| {
        FormatError::whole(path, code.message(format!("meshopt compression: {message}")))
    };
    shape.check().map_err(|message| fault(ErrorCode::InvalidValue, message))?;
    let ViewHeader { mode, count, stride } = shape;
    // Before any allocation, the length is compared with the minimum length of a stream with this number of elements.
    let least = match mode {
        Mode::Attributes(_) => count.div_ceil(attributes::block_elements(stride)) * (stride / 4),
        Mode::Triangles => count / 3,
        Mode::Indices => count,
    };
    if least > bytes.len() {
        return Err(fault(
            ErrorCode::ImplausibleSize,
            format!("{} bytes are too few for {count} elements", bytes.len()),
        ));
    }
    budget.take_bytes(path, (count as u64).saturating_mul(stride as u64))?;
    let decoded = match mode {
        Mode::Attributes(filter) => attributes::decode(bytes, count, stride).and_then(|mut out| {
            filter::apply(filter, &mut out, stride)?;
            Ok(out)
        }),
        Mode::Triangles => indices::triangles(bytes, count / 3, stride),
        Mode::Indices => indices::sequence(bytes, count, stride),
    };
    decoded.map_err(|message| fault(ErrorCode::DamagedData, message))
}

impl ViewHeader {
    /// Checks the header against the rules of the glTF extension.
    fn check(self) -> Result<(), String> {
        let (stride, count) = (self.stride, self.count);
        let (strides, fits) = match self.mode {
            Mode::Attributes(Filter::None | Filter::Exponential) => {
                ("a multiple of 4 up to 256", stride % 4 == 0 && (4..=256).contains(&stride))
            }
            Mode::Attributes(Filter::Octahedral | Filter::Color) => {
                ("4 or 8 with this filter", stride == 4 || stride == 8)
            }
            Mode::Attributes(Filter::Quaternion) => ("8 with this filter", stride == 8),
            Mode::Triangles | Mode::Indices => ("2 or 4 for indices", stride == 2 || stride == 4),
        };
        if !fits {
            return Err(format!("byteStride {stride}; expected {strides}"));
        }
        if self.mode == Mode::Triangles && count % 3 != 0 {
            return Err(format!("count {count}; expected a multiple of three"));
        }
        Ok(())
    }
}
