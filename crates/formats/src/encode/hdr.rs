//! Radiance HDR out: pictures of light in four bytes a pixel.

use ::image::Rgb;
use ::image::codecs::hdr::HdrEncoder;

use crate::error::{FormatError, Result};

/// A Radiance HDR file of `size` (columns, rows) of linear RGB, row-major from the top left: a shared exponent and eight
/// bits a channel (Ward, "Real Pixels", Graphics Gems II, 1991), so within one part in 128 of the largest channel.
///
/// # Errors
/// When the number of values is not columns x rows x 3, a side is 0, or a value is negative, infinite or NaN: the format
/// has none of these.
pub fn encode(size: [u32; 2], rgb: &[f32]) -> Result<Vec<u8>> {
    let [columns, rows] = size.map(|side| side as usize);
    let count = rgb.len();
    if count == 0 || columns.checked_mul(rows).and_then(|n| n.checked_mul(3)) != Some(count) {
        return Err(FormatError::encode(format!(
            "HDR: {count} values, expected {columns} x {rows} x 3 and more than 0"
        )));
    }
    if let Some(value) = rgb.iter().find(|v| !(0.0..f32::INFINITY).contains(*v)) {
        return Err(FormatError::encode(format!("HDR: a value of {value}, expected 0 or more and finite")));
    }
    let pixels: Vec<_> = rgb.as_chunks().0.iter().map(|&color| Rgb(color)).collect();
    let mut file = Vec::new();
    let encoded = HdrEncoder::new(&mut file).encode(&pixels, columns, rows);
    encoded.map_err(|e| FormatError::encode(format!("HDR: {e}")))?;
    Ok(file)
}
