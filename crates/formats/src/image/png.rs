//! Reading of PNG by the decoder of `image`.

use std::io::Cursor;

use ::image::codecs::png::PngDecoder;
use ::image::error::DecodingError;
use ::image::{ImageDecoder, ImageError, ImageFormat, Limits};
use ::png::CodingIndependentCodePoints;
use raycam_scene::{Image, NoticeCode};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_pixels, decoder_error, texel_bytes};

pub(crate) fn png(file: &mut Decoder<'_>) -> Result<Image> {
    // This limits the bytes to which chunks without pixels may decompress.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some((64 << 20) + 16 * file.bytes.len() as u64);
    let decoder = PngDecoder::with_limits(Cursor::new(file.bytes), limits);
    let decoder = decoder.map_err(|e| decoder_error(file, e))?;
    let (gamma, primaries, code_points) = unapplied_colors(file.bytes);
    if let Some(points) = code_points {
        let primaries = primaries_name(points.color_primaries);
        let transfer = transfer_name(points.transfer_function);
        let range = if points.is_video_full_range_image { "" } else { ", limited range" };
        let message = format!(
            "the image's colour space (cICP: {primaries} primaries, {transfer} transfer function{range}) is ignored; convert \
             the image to sRGB"
        );
        file.notice(NoticeCode::IgnoredColorProfile, message);
    }
    if let Some(gamma) = gamma {
        file.notice(NoticeCode::IgnoredColorProfile, format_args!("the PNG gamma chunk ({gamma}) is ignored"));
    }
    if primaries {
        file.notice(NoticeCode::IgnoredColorProfile, "the image's primaries, which differ from sRGB, are ignored");
    }
    let texel = texel_bytes(&decoder);
    if file.take_pixels(decoder.dimensions().into(), texel)? {
        read_rows(file)?;
    }
    decode_pixels(file, decoder, texel)
}

/// Reads the rows of a PNG without storing them.
fn read_rows(file: &Decoder<'_>) -> Result<()> {
    let fault = |error: ::png::DecodingError| {
        let error = DecodingError::new(ImageFormat::Png.into(), error);
        decoder_error(file, ImageError::Decoding(error))
    };
    let mut rows = ::png::Decoder::new(Cursor::new(file.bytes)).read_info().map_err(fault)?;
    while rows.next_row().map_err(fault)?.is_some() {}
    Ok(())
}

/// Colour information of a PNG that `image` does not return: the gamma if it differs from sRGB's; true if the primaries
/// differ; and the code points of the colour space if they differ from sRGB's.
fn unapplied_colors(bytes: &[u8]) -> (Option<f32>, bool, Option<CodingIndependentCodePoints>) {
    let Ok(reader) = ::png::Decoder::new(Cursor::new(bytes)).read_info() else { return (None, false, None) };
    let is_srgb = |points: &CodingIndependentCodePoints| {
        (points.color_primaries, points.transfer_function, points.is_video_full_range_image) == (1, 13, true)
    };
    let points = reader.info().coding_independent_code_points.filter(|points| !is_srgb(points));
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
    (gamma, primaries, points)
}

/// Name of a code point for colour primaries (ITU-T H.273, table 2).
fn primaries_name(code: u8) -> String {
    match code {
        1 => "sRGB".into(),
        9 => "Rec. 2020".into(),
        11 => "DCI-P3".into(),
        12 => "Display P3".into(),
        code => format!("code {code}"),
    }
}

/// Name of a code point for a transfer function (ITU-T H.273, table 3).
fn transfer_name(code: u8) -> String {
    match code {
        1 => "Rec. 709".into(),
        8 => "linear".into(),
        13 => "sRGB".into(),
        16 => "PQ".into(),
        18 => "HLG".into(),
        code => format!("code {code}"),
    }
}
