//! JPEG out (ITU-T T.81, baseline, no subsampling), for pictures that are looked at.

use ::image::ExtendedColorType;
use ::image::codecs::jpeg::JpegEncoder;

use crate::error::{FormatError, Result};

/// Largest side that the format can state.
const MAX_SIDE: u32 = u16::MAX as u32;

/// A JPEG file of `size` (columns, rows) of 8-bit sRGB, row-major from the top left; `quality` is 1 to 100.
///
/// # Errors
/// When the number of samples is not columns x rows x 3, a side is 0 or above 65,535, or `quality` is none of these.
pub fn encode([columns, rows]: [u32; 2], rgb: &[u8], quality: u8) -> Result<Vec<u8>> {
    let fail = |message: String| Err(FormatError::encode(format!("JPEG: {message}")));
    if !(1..=100).contains(&quality) {
        return fail(format!("quality is {quality}, expected 1 to 100"));
    }
    if ![columns, rows].iter().all(|side| (1..=MAX_SIDE).contains(side)) {
        return fail(format!("{columns} x {rows} pixels, expected sides of 1 to {MAX_SIDE}"));
    }
    if rgb.len() as u64 != 3 * u64::from(columns) * u64::from(rows) {
        return fail(format!("{} samples, expected {columns} x {rows} x 3", rgb.len()));
    }
    let mut file = Vec::new();
    let encoded = JpegEncoder::new_with_quality(&mut file, quality).encode(rgb, columns, rows, ExtendedColorType::Rgb8);
    match encoded {
        Ok(()) => Ok(file),
        Err(error) => fail(error.to_string()),
    }
}
