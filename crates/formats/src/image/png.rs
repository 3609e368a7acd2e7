//! PNG, and what all decoders of `image` share.

use std::io::Cursor;

use ::image::codecs::png::PngDecoder;
use ::image::error::DecodingError;
use ::image::metadata::Orientation;
use ::image::{ColorType, DynamicImage, ImageDecoder, ImageError, ImageFormat, Limits};
use bytemuck::Pod;
use raycam_scene::Image;

use crate::error::FormatError;
use crate::image::Decoder;

pub(crate) fn png(file: &mut Decoder<'_>) -> Result<Image, FormatError> {
    // What its chunks besides the pixels may unpack to.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some((64 << 20) + 16 * file.bytes.len() as u64);
    let decoder = PngDecoder::with_limits(Cursor::new(file.bytes), limits);
    let decoder = decoder.map_err(|e| refused(file, e))?;
    let (gamma, primaries) = other_colors(file.bytes);
    if let Some(gamma) = gamma {
        file.notice(format_args!("its gamma of {gamma} is not applied"));
    }
    if primaries {
        file.notice("its primaries, which are not those of sRGB, are not applied");
    }
    let texel = texel(&decoder);
    if file.take_pixels(decoder.dimensions().into(), texel)? {
        read_rows(file)?;
    }
    decoded(file, decoder, texel)
}

/// Reads a PNG's rows and keeps none.
fn read_rows(file: &Decoder<'_>) -> Result<(), FormatError> {
    let fault = |error: ::png::DecodingError| {
        let error = DecodingError::new(ImageFormat::Png.into(), error);
        refused(file, ImageError::Decoding(error))
    };
    let mut rows = ::png::Decoder::new(Cursor::new(file.bytes))
        .read_info()
        .map_err(fault)?;
    while rows.next_row().map_err(fault)?.is_some() {}
    Ok(())
}

/// The decoded image, if the budget has room for it and `whole` finds nothing missing: before anything is kept.
pub(crate) fn pixels(
    file: &mut Decoder<'_>,
    decoder: impl ImageDecoder,
    whole: impl FnOnce(&Decoder<'_>) -> Result<(), FormatError>,
) -> Result<Image, FormatError> {
    let texel = texel(&decoder);
    file.take_pixels(decoder.dimensions().into(), texel)?;
    whole(file)?;
    decoded(file, decoder, texel)
}

/// How many bytes a texel of its image takes.
fn texel(decoder: &impl ImageDecoder) -> u64 {
    match decoder.color_type() {
        ColorType::Rgb32F | ColorType::Rgba32F => 16,
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => 8,
        _ => 4,
    }
}

/// The decoded image, whose pixels have been taken from the budget.
fn decoded(
    file: &mut Decoder<'_>,
    mut decoder: impl ImageDecoder,
    texel: u64,
) -> Result<Image, FormatError> {
    let size = decoder.dimensions().into();
    if let Ok(Some(profile)) = decoder.icc_profile()
        // "sRGB" in the profile's description, as text or as UTF-16: nothing to apply.
        && !profile.windows(4).any(|w| w == b"sRGB")
        && !profile.windows(7).any(|w| w == b"s\0R\0G\0B")
    {
        file.notice("its colour profile is not applied");
    }
    if let Ok(orientation) = decoder.orientation()
        && orientation != Orientation::NoTransforms
    {
        file.notice("its EXIF orientation is not applied");
    }
    let image = DynamicImage::from_decoder(decoder).map_err(|e| refused(file, e))?;
    let texels = match texel {
        4 => file.texels8(grouped(image.into_rgba8().into_raw())),
        8 => file.texels16(grouped(image.into_rgba16().into_raw())),
        _ => file.floats(grouped(image.into_rgba32f().into_raw())),
    };
    Ok(file.image(size, texels))
}

/// The channels of each texel together, in the same memory where it ends with a texel.
pub(crate) fn grouped<T: Pod>(channels: Vec<T>) -> Vec<[T; 4]> {
    let texels = bytemuck::allocation::try_cast_vec(channels);
    texels.unwrap_or_else(|(_, channels)| channels.as_chunks::<4>().0.to_vec())
}

pub(crate) fn refused(file: &Decoder<'_>, error: ImageError) -> FormatError {
    match error {
        ImageError::Unsupported(e) => file.unsupported(e.to_string()),
        ImageError::IoError(e) => file.fault(format!("ends early: {e}")),
        e => file.fault(e.to_string()),
    }
}

/// The gamma of a PNG where it is not sRGB's, and whether its primaries are others; `image` does not tell.
fn other_colors(bytes: &[u8]) -> (Option<f32>, bool) {
    let Ok(reader) = ::png::Decoder::new(Cursor::new(bytes)).read_info() else {
        return (None, false);
    };
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
