//! Reading of images: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF and TGA, recognised by content.

mod bmp;
mod cube_map;
pub(crate) mod decoder;
mod exr;
mod gif;
mod hdr;
mod jpeg;
mod ktx2;
pub(crate) mod merge_alpha;
pub(crate) mod normals_from_height;
pub(crate) mod png;
pub(crate) mod texture;
mod tga;
mod tiff;
pub(crate) mod udim;
mod webp;
use std::path::Path;
use std::sync::Arc;

use ::image::metadata::Orientation;
use raycam_scene::{ByteString, EncodedImage, Image, Notice};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::image::decoder::{Decoder, MAX_UNBACKED_BYTES, MAX_UNBACKED_BYTES_STREAMED};
use crate::io::catch_panic::catch_decoder_panic;
use crate::io::{AssetRoot, file_kind, stand_in};

pub use crate::image::exr::{ExrChannel, read_exr};
pub use raycam_scene::ColorUse;

/// Image format: its signature and its decoder.
struct ImageFormat {
    /// True if a file's first bytes belong to this format.
    magic: fn(&[u8]) -> bool,
    trusted: u64,
    decode: fn(&mut Decoder<'_>) -> Result<Image>,
}

/// All formats, in the order in which their signatures are checked.
const IMAGE_FORMATS: &[ImageFormat] = &[
    ImageFormat {
        magic: |b| b.starts_with(b"\x89PNG\r\n\x1a\n"),
        trusted: MAX_UNBACKED_BYTES_STREAMED,
        decode: png::png,
    },
    ImageFormat { magic: |b| b.starts_with(&[0xff, 0xd8, 0xff]), trusted: MAX_UNBACKED_BYTES, decode: jpeg::jpeg },
    ImageFormat {
        magic: |b| b.starts_with(b"RIFF") && b.get(8..12) == Some(b"WEBP"),
        trusted: MAX_UNBACKED_BYTES_STREAMED,
        decode: webp::webp,
    },
    ImageFormat { magic: |b| b.starts_with(&ktx2::MAGIC), trusted: MAX_UNBACKED_BYTES, decode: ktx2::decode },
    ImageFormat {
        magic: |b| b.starts_with(&[0x76, 0x2f, 0x31, 0x01]),
        trusted: MAX_UNBACKED_BYTES,
        decode: exr::decode,
    },
    ImageFormat {
        magic: |b| b.starts_with(b"#?RADIANCE") || b.starts_with(b"#?RGBE"),
        trusted: MAX_UNBACKED_BYTES,
        decode: hdr::hdr,
    },
    ImageFormat { magic: tiff::is_tiff, trusted: MAX_UNBACKED_BYTES, decode: tiff::tiff },
    ImageFormat { magic: |b| b.starts_with(b"GIF8"), trusted: MAX_UNBACKED_BYTES, decode: gif::gif },
    ImageFormat { magic: |b| b.starts_with(b"BM"), trusted: MAX_UNBACKED_BYTES, decode: bmp::bmp },
    ImageFormat {
        // TGA has the weakest signature, so it is checked last.
        magic: tga::is_tga,
        trusted: MAX_UNBACKED_BYTES,
        decode: tga::tga,
    },
];

/// Reads the image in a file of any supported format (see [`decode_image`]), with notices.
///
/// # Errors
/// See [`FormatError`].
pub fn read_image(path: &Path, color_use: ColorUse, budget: &Budget) -> Result<(Image, Vec<Notice>)> {
    let source = AssetRoot::containing(path, budget).read(path)?;
    let mut notices = Vec::new();
    let mut budget = *budget;
    let image = decode_image(&source.bytes, path, color_use, &mut budget, &mut notices)?;
    Ok((image, notices))
}

/// Reads the colours in a file of any supported format, like [`read_image`], and the EXIF orientation (1 to 8; 1 for
/// files without one), which is not applied.
///
/// # Errors
/// See [`FormatError`].
pub fn read_photo(path: &Path, budget: &Budget) -> Result<(Image, u8, Vec<Notice>)> {
    let source = AssetRoot::containing(path, budget).read(path)?;
    let mut notices = Vec::new();
    let decoded = decode_oriented(&source.bytes, path, ColorUse::Color, &mut { *budget }, &mut notices);
    let (image, orientation) = decoded?;
    Ok((image, orientation.to_exif(), notices))
}

/// Image and its EXIF orientation.
fn decode_oriented(
    bytes: &[u8],
    path: &Path,
    color_use: ColorUse,
    budget: &mut Budget,
    notices: &mut Vec<Notice>,
) -> Result<(Image, Orientation)> {
    stand_in::check(path, bytes)?;
    let Some(format) = IMAGE_FORMATS.iter().find(|format| (format.magic)(bytes)) else {
        let known = "unknown image format; supported: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF \
            and TGA";
        let message = file_kind::described(bytes).map_or(known.into(), |found| format!("{known}; the file is {found}"));
        return Err(FormatError::unsupported(path, message));
    };
    let (trusted, orientation) = (format.trusted, Orientation::NoTransforms);
    catch_decoder_panic(path, || {
        let mut decoder = Decoder { bytes, path, color_use, trusted, budget, notices, orientation };
        Ok(((format.decode)(&mut decoder)?, decoder.orientation))
    })
}

/// Decodes the bytes of a PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF or TGA file; `path` is its name.
///
/// Rows are returned from the top down, for any order in the file. Grey becomes three equal channels, palettes are
/// resolved, and missing alpha becomes 1. Eight bits per channel stay eight bits; sixteen stay sixteen, converted to
/// linear for colours. EXR and HDR give floats; infinities become the largest float16 and NaN becomes 0, with a notice.
/// Only the largest level of a KTX2 file and the first image of a TIFF or GIF file are read. Premultiplied colours
/// (EXR, TIFF) are divided by alpha.
///
/// As glTF requires, an embedded gamma, colour profile or orientation is not applied; each causes a notice.
///
/// # Errors
/// Images with more pixels than the budget allows, or than a file of this size can describe, are rejected before they
/// are decoded. A truncated file is an error, even if part of the image could be shown.
pub fn decode_image(
    bytes: &[u8],
    path: &Path,
    color_use: ColorUse,
    budget: &mut Budget,
    notices: &mut Vec<Notice>,
) -> Result<Image> {
    let (mut image, _) = decode_oriented(bytes, path, color_use, budget, notices)?;
    if bytes.len() < image.texels.bytes() {
        let encoded = EncodedImage { bytes: ByteString(bytes.to_vec()), is_data: color_use == ColorUse::Data };
        image.encoded = Some(Arc::new(encoded));
    }
    Ok(image)
}
