//! Images in: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF and TGA, told apart by content.

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

/// A kind of image.
struct ImageFormat {
    /// How its files begin.
    magic: fn(&[u8]) -> bool,
    trusted: u64,
    decode: fn(&mut Decoder<'_>) -> Result<Image>,
}

/// Every kind.
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
        // Says the least, so it is the last.
        magic: tga::is_tga,
        trusted: MAX_UNBACKED_BYTES,
        decode: tga::tga,
    },
];

/// The image in a file of any kind that is known: see [`decode_image`]; with what there is to be said about it.
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

/// The colours in a file of any kind that is known, as [`read_image`] returns them, and the EXIF orientation (1 to 8; 1 for
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

/// The image and its EXIF orientation.
fn decode_oriented(
    bytes: &[u8],
    path: &Path,
    color_use: ColorUse,
    budget: &mut Budget,
    notices: &mut Vec<Notice>,
) -> Result<(Image, Orientation)> {
    stand_in::check(path, bytes)?;
    let Some(format) = IMAGE_FORMATS.iter().find(|format| (format.magic)(bytes)) else {
        let known = "not an image that is known: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF or TGA";
        let message = file_kind::described(bytes).map_or(known.into(), |found| format!("{known}; it is {found}"));
        return Err(FormatError::unsupported(path, message));
    };
    let (trusted, orientation) = (format.trusted, Orientation::NoTransforms);
    catch_decoder_panic(path, || {
        let mut decoder = Decoder { bytes, path, color_use, trusted, budget, notices, orientation };
        Ok(((format.decode)(&mut decoder)?, decoder.orientation))
    })
}

/// The image in the bytes of a PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP, TIFF, GIF or TGA file; `path` names it.
///
/// Rows go from the top down, whatever the file's order. Grey becomes three equal channels, palettes are resolved,
/// what has no alpha gets 1. Eight bits a channel stay eight bits; sixteen stay sixteen, made linear where they are
/// colours. EXR and HDR give floats, in which infinities become the largest float16 and NaN becomes 0, with a
/// notice. Of a KTX2 file, only the largest level is read; of a TIFF or GIF file, the first picture. Colours that are multiplied by alpha (EXR, TIFF) are divided by it.
///
/// As glTF demands, an embedded gamma, colour profile or orientation is not applied; each gets a notice.
///
/// # Errors
/// More pixels than the budget allows, or than so short a file can honestly describe, are refused before they are
/// decoded. A file that ends early is an error, even where part of the image could be shown.
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
