//! Writing of Radiance HDR: four bytes per pixel.

use ::image::Rgb;
use ::image::codecs::hdr::HdrEncoder;

use crate::error::{FormatError, Result};

/// Returns a Radiance HDR file of `size` (columns, rows) from linear RGB, row by row from the top left. A pixel has a
/// shared exponent and eight bits per channel (Ward, "Real Pixels", Graphics Gems II, 1991), which is accurate to one
/// part in 128 of the largest channel.
///
/// # Errors
/// An error if the number of values is not columns x rows x 3, or if a side is 0. An error if a value is negative,
/// infinite or NaN, which the format does not support.
pub fn encode(size: [u32; 2], rgb: &[f32]) -> Result<Vec<u8>> {
    let [columns, rows] = size.map(|side| side as usize);
    let count = rgb.len();
    if count == 0 || columns.checked_mul(rows).and_then(|n| n.checked_mul(3)) != Some(count) {
        return Err(FormatError::encode(format!(
            "HDR: {count} values; expected {columns} x {rows} x 3 and more than 0"
        )));
    }
    if let Some(value) = rgb.iter().find(|v| !(0.0..f32::INFINITY).contains(*v)) {
        return Err(FormatError::encode(format!("HDR: a value of {value}; expected a finite number >= 0")));
    }
    let pixels: Vec<_> = rgb.as_chunks().0.iter().map(|&color| Rgb(color)).collect();
    let mut file = Vec::new();
    let encoded = HdrEncoder::new(&mut file).encode(&pixels, columns, rows);
    encoded.map_err(|e| FormatError::encode(format!("HDR: {e}")))?;
    Ok(file)
}
