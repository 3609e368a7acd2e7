//! Writing of PNG (W3C PNG, third edition), always marked as sRGB.

use crate::error::{FormatError, Result};

/// Samples of an image, row by row from the top left; the channels of a pixel are adjacent.
#[derive(Clone, Copy, Debug)]
pub enum Samples<'a> {
    /// 8 bits per channel.
    U8(&'a [u8]),
    /// 16 bits per channel.
    U16(&'a [u16]),
}

/// Returns a PNG file of `size` (columns, rows) with 1 (grey), 2 (grey and alpha), 3 (RGB) or 4 (RGBA) channels.
///
/// The samples are stored unchanged. Colour is expected in sRGB, and the file is marked accordingly. Ids and depths can
/// be stored as 16-bit grey.
///
/// # Errors
/// An error if the number of samples is not columns x rows x channels, if a side is 0, or if `channels` is out of
/// range.
pub fn encode(size: [u32; 2], channels: usize, samples: Samples<'_>) -> Result<Vec<u8>> {
    compress(size, channels, samples, png::Compression::Balanced)
}

/// Returns a PNG file as [`encode`] does, but larger and in less time, for files that are read only once.
///
/// # Errors
/// Errors of [`encode`].
pub fn encode_fast(size: [u32; 2], channels: usize, samples: Samples<'_>) -> Result<Vec<u8>> {
    compress(size, channels, samples, png::Compression::Fast)
}

fn compress(size: [u32; 2], channels: usize, samples: Samples<'_>, compression: png::Compression) -> Result<Vec<u8>> {
    let color = match channels {
        1 => png::ColorType::Grayscale,
        2 => png::ColorType::GrayscaleAlpha,
        3 => png::ColorType::Rgb,
        4 => png::ColorType::Rgba,
        _ => return Err(FormatError::encode(format!("PNG: {channels} channels; expected 1, 2, 3 or 4"))),
    };
    let (count, depth, bytes);
    let big_endian: Vec<u8>;
    match samples {
        Samples::U8(data) => (count, depth, bytes) = (data.len(), png::BitDepth::Eight, data),
        Samples::U16(data) => {
            big_endian = data.iter().flat_map(|v| v.to_be_bytes()).collect();
            (count, depth, bytes) = (data.len(), png::BitDepth::Sixteen, &big_endian[..]);
        }
    }
    let [columns, rows] = size;
    let pixels = u64::from(columns) * u64::from(rows);
    if pixels == 0 || pixels.checked_mul(channels as u64) != Some(count as u64) {
        return Err(FormatError::encode(format!(
            "PNG: {count} samples; expected {columns} x {rows} x {channels} and more than 0"
        )));
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, columns, rows);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(compression);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let failed = |e: png::EncodingError| FormatError::encode(format!("PNG: {e}"));
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(bytes).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file)
}
