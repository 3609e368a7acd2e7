//! Writing of JPEG (ITU-T T.81, baseline, no subsampling), for images that are only viewed.

use ::image::ExtendedColorType;
use ::image::codecs::jpeg::JpegEncoder;

use crate::error::{FormatError, Result};

/// Maximum side length of the format.
const MAX_SIDE: u32 = u16::MAX as u32;

/// Returns a JPEG file of `size` (columns, rows) from 8-bit sRGB, row by row from the top left; `quality` is 1 to 100.
///
/// # Errors
/// An error if the number of samples is not columns x rows x 3, if a side is 0 or above 65,535, or if `quality` is out
/// of range.
pub fn encode([columns, rows]: [u32; 2], rgb: &[u8], quality: u8) -> Result<Vec<u8>> {
    let fail = |message: String| Err(FormatError::encode(format!("JPEG: {message}")));
    if !(1..=100).contains(&quality) {
        return fail(format!("quality is {quality}; expected 1 to 100"));
    }
    if ![columns, rows].iter().all(|side| (1..=MAX_SIDE).contains(side)) {
        return fail(format!("{columns} x {rows} pixels; expected sides of 1 to {MAX_SIDE}"));
    }
    if rgb.len() as u64 != 3 * u64::from(columns) * u64::from(rows) {
        return fail(format!("{} samples; expected {columns} x {rows} x 3", rgb.len()));
    }
    let mut file = Vec::new();
    let encoded = JpegEncoder::new_with_quality(&mut file, quality).encode(rgb, columns, rows, ExtendedColorType::Rgb8);
    match encoded {
        Ok(()) => Ok(file),
        Err(error) => fail(error.to_string()),
    }
}
