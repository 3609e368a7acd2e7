//! PNG in: the decoder of `image`.

use std::io::Cursor;

use ::image::codecs::png::PngDecoder;
use ::image::error::DecodingError;
use ::image::{ImageDecoder, ImageError, ImageFormat, Limits};
use raycam_scene::{Image, NoticeCode};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_pixels, decoder_error, texel_bytes};

pub(crate) fn png(file: &mut Decoder<'_>) -> Result<Image> {
    // Bytes that chunks other than the pixels may unpack to.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some((64 << 20) + 16 * file.bytes.len() as u64);
    let decoder = PngDecoder::with_limits(Cursor::new(file.bytes), limits);
    let decoder = decoder.map_err(|e| decoder_error(file, e))?;
    let (gamma, primaries) = unapplied_colors(file.bytes);
    if let Some(gamma) = gamma {
        file.notice(NoticeCode::IgnoredColorProfile, format_args!("its gamma of {gamma} is not applied"));
    }
    if primaries {
        file.notice(NoticeCode::IgnoredColorProfile, "its primaries, which are not those of sRGB, are not applied");
    }
    let texel = texel_bytes(&decoder);
    if file.take_pixels(decoder.dimensions().into(), texel)? {
        read_rows(file)?;
    }
    decode_pixels(file, decoder, texel)
}

/// Reads a PNG's rows and keeps none.
fn read_rows(file: &Decoder<'_>) -> Result<()> {
    let fault = |error: ::png::DecodingError| {
        let error = DecodingError::new(ImageFormat::Png.into(), error);
        decoder_error(file, ImageError::Decoding(error))
    };
    let mut rows = ::png::Decoder::new(Cursor::new(file.bytes)).read_info().map_err(fault)?;
    while rows.next_row().map_err(fault)?.is_some() {}
    Ok(())
}

/// The gamma of a PNG where it is not sRGB's, and whether its primaries are others; `image` does not tell.
fn unapplied_colors(bytes: &[u8]) -> (Option<f32>, bool) {
    let Ok(reader) = ::png::Decoder::new(Cursor::new(bytes)).read_info() else { return (None, false) };
    let gamma = reader.info().gamma().map(|gamma| gamma.into_value());
    let gamma = gamma.filter(|gamma| (gamma - 1.0 / 2.2).abs() > 0.01);
    let primaries = reader.info().chromaticities().is_some_and(|found| {
        let pairs = [found.white, found.red, found.green, found.blue];
        let srgb = [(0.3127, 0.329), (0.64, 0.33), (0.3, 0.6), (0.15, 0.06)];
        let far = |a: f32, b: f32| (a - b).abs() > 0.005;
        let differs = |((x, y), (u, v)): (_, (f32, f32))| far(x, u) || far(y, v);
        let pairs = pairs.map(|(x, y)| (x.into_value(), y.into_value()));
        pairs.into_iter().zip(srgb).any(differs)
    });
    (gamma, primaries)
}
