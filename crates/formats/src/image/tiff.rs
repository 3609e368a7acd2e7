//! TIFF in: the decoder of `image`. Of a file of several pictures, the first is read.
//!
//! Source: Aldus, "TIFF Revision 6.0", 1992, section 2.

use std::io::Cursor;

use ::image::codecs::tiff::TiffDecoder;
use ::image::{ImageDecoder, Limits};
use raycam_scene::Image;

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_pixels, decoder_error, texel_bytes};

/// True for both byte orders, and for the 64-bit form of the format.
pub(super) fn is_tiff(bytes: &[u8]) -> bool {
    [&b"II*\0"[..], b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| bytes.starts_with(magic))
}

pub(super) fn tiff(file: &mut Decoder<'_>) -> Result<Image> {
    let decoder = TiffDecoder::new(Cursor::new(file.bytes));
    let mut decoder = decoder.map_err(|error| decoder_error(file, error))?;
    let texel = texel_bytes(&decoder);
    let [columns, rows]: [u32; 2] = decoder.dimensions().into();
    file.take_pixels([columns, rows], texel)?;
    // A strip may be all of the picture.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some((64 << 20) + 2 * texel * u64::from(columns) * u64::from(rows));
    decoder.set_limits(limits).map_err(|error| decoder_error(file, error))?;
    decode_pixels(file, decoder, texel)
}
