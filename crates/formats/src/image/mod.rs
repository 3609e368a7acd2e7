//! Images in: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP and TGA, told apart by content.

mod bmp;
mod exr;
mod hdr;
mod jpeg;
mod jpeg_scan;
mod ktx2;
pub(crate) mod merge_alpha;
pub(crate) mod normals_from_height;
pub(crate) mod png;
pub(crate) mod texture;
mod tga;
mod webp;
mod webp_lossless;

use std::path::Path;
use std::sync::LazyLock;

use raycam_scene::color::linear_from_srgb;
use raycam_scene::{Image, Texels};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::io::asset_root::Folder;
use crate::io::catch_panic::guarded;

/// What an image is for, which decides how integers are read; images of floats are linear for any use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorUse {
    /// Colours, stored in sRGB.
    Color,
    /// Anything else (normals, roughness, occlusion), stored as it is.
    Data,
}

/// What an image may unpack to however short its file is: a flat picture of 4096 x 4096, of 8192 x 8192.
const USUAL: u64 = 64 << 20;
const LARGE: u64 = 256 << 20;

/// A kind of image.
struct Kind {
    /// How its files begin.
    magic: fn(&[u8]) -> bool,
    trusted: u64,
    decode: fn(&mut Decoder<'_>) -> Result<Image, FormatError>,
}

/// Every kind.
const KINDS: &[Kind] = &[
    Kind {
        magic: |b| b.starts_with(b"\x89PNG\r\n\x1a\n"),
        trusted: LARGE,
        decode: png::png,
    },
    Kind {
        magic: |b| b.starts_with(&[0xff, 0xd8, 0xff]),
        trusted: USUAL,
        decode: jpeg::jpeg,
    },
    Kind {
        magic: |b| b.starts_with(b"RIFF") && b.get(8..12) == Some(b"WEBP"),
        trusted: LARGE,
        decode: webp::webp,
    },
    Kind {
        magic: |b| b.starts_with(&ktx2::MAGIC),
        trusted: USUAL,
        decode: ktx2::decode,
    },
    Kind {
        magic: |b| b.starts_with(&[0x76, 0x2f, 0x31, 0x01]),
        trusted: USUAL,
        decode: exr::decode,
    },
    Kind {
        magic: |b| b.starts_with(b"#?RADIANCE") || b.starts_with(b"#?RGBE"),
        trusted: USUAL,
        decode: hdr::hdr,
    },
    Kind {
        magic: |b| b.starts_with(b"BM"),
        trusted: USUAL,
        decode: bmp::bmp,
    },
    Kind {
        // Says the least, so it is the last.
        magic: tga::is_tga,
        trusted: USUAL,
        decode: tga::tga,
    },
];

/// One image on its way in.
struct Decoder<'a> {
    bytes: &'a [u8],
    path: &'a Path,
    color_use: ColorUse,
    trusted: u64,
    budget: &'a mut Budget,
    notices: &'a mut Vec<String>,
}

/// The image in a file of any kind that is known: see [`decode_image`]; with what there is to be said about it.
///
/// # Errors
/// See [`FormatError`].
pub fn read_image(
    path: &Path,
    color_use: ColorUse,
    budget: &Budget,
) -> Result<(Image, Vec<String>), FormatError> {
    let source = Folder::around(path, budget).read(path)?;
    let mut notices = Vec::new();
    let mut budget = *budget;
    let image = decode_image(&source.bytes, path, color_use, &mut budget, &mut notices)?;
    Ok((image, notices))
}

/// The image in the bytes of a PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP or TGA file; `path` names it.
///
/// Rows go from the top down, whatever the file's order. Grey becomes three equal channels, palettes are resolved,
/// what has no alpha gets 1. Eight bits a channel stay eight bits; sixteen stay sixteen, made linear where they are
/// colours. EXR and HDR give floats, in which infinities become the largest float16 and NaN becomes 0, with a
/// notice. Of a KTX2 file, only the largest level is read.
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
    notices: &mut Vec<String>,
) -> Result<Image, FormatError> {
    let Some(kind) = KINDS.iter().find(|kind| (kind.magic)(bytes)) else {
        let message =
            "not an image that is known: PNG, JPEG, WebP, KTX2, OpenEXR, Radiance HDR, BMP or TGA";
        return Err(FormatError::unsupported(path, message));
    };
    guarded(path, || {
        (kind.decode)(&mut Decoder {
            bytes,
            path,
            color_use,
            trusted: kind.trusted,
            budget,
            notices,
        })
    })
}

impl Decoder<'_> {
    fn fault(&self, message: impl Into<String>) -> FormatError {
        FormatError::whole(self.path, message)
    }

    fn unsupported(&self, message: impl Into<String>) -> FormatError {
        FormatError::unsupported(self.path, message)
    }

    fn notice(&mut self, message: impl std::fmt::Display) {
        self.notices
            .push(format!("{}: {message}", self.path.display()));
    }

    /// Takes the pixels of an image from the budget before they are decoded, and refuses what unpacks to more than its
    /// kind is trusted with and 4096 times its file. Whether it unpacks to more than 32 MiB and 16 times its file: then it
    /// is to be read to its end once, where that needs no memory, before anything is kept.
    fn take_pixels(&mut self, [columns, rows]: [u32; 2], texel: u64) -> Result<bool, FormatError> {
        let pixels = u64::from(columns) * u64::from(rows);
        if pixels == 0 {
            return Err(self.fault(format!("an image of {columns} x {rows} pixels")));
        }
        self.budget.take_pixels(self.path, pixels)?;
        let (unpacked, length) = (pixels * texel, self.bytes.len() as u64);
        if unpacked > self.trusted + 4096 * length {
            let message = format!(
                "{columns} x {rows} pixels in {} bytes: more than so short a file is trusted with; store the image \
                 smaller, or with less compression",
                self.bytes.len()
            );
            return Err(self.fault(message));
        }
        Ok(unpacked > USUAL / 2 + 16 * length)
    }

    fn image(&self, size: [u32; 2], texels: Texels) -> Image {
        Image {
            name: self.path.display().to_string(),
            size,
            texels,
        }
    }

    /// Eight bits a channel, for the image's use.
    fn texels8(&self, texels: Vec<[u8; 4]>) -> Texels {
        match self.color_use {
            ColorUse::Color => Texels::Srgb8(texels),
            ColorUse::Data => Texels::Linear8(texels),
        }
    }

    /// Sixteen bits a channel, for the image's use.
    fn texels16(&self, mut texels: Vec<[u16; 4]>) -> Texels {
        if self.color_use == ColorUse::Color {
            static TABLE: LazyLock<Vec<u16>> = LazyLock::new(|| {
                let linear = |v: u16| (65535.0 * linear_from_srgb(f32::from(v) / 65535.0)).round();
                (0..=u16::MAX).map(|v| linear(v) as u16).collect()
            });
            let table = &*TABLE;
            for color in texels.iter_mut().flat_map(|texel| &mut texel[..3]) {
                *color = table[usize::from(*color)];
            }
        }
        Texels::Linear16(texels)
    }

    /// Floats, none of them infinite or NaN.
    fn floats(&mut self, mut texels: Vec<[f32; 4]>) -> Texels {
        const LARGEST: f32 = 65504.0;
        let mut replaced = 0;
        for value in texels.as_flattened_mut() {
            if !value.is_finite() {
                *value = if value.is_nan() {
                    0.0
                } else {
                    LARGEST.copysign(*value)
                };
                replaced += 1;
            }
        }
        if replaced > 0 {
            self.notice(format!(
                "{replaced} values are infinite or not numbers: read as {LARGEST} and 0"
            ));
        }
        Texels::Float(texels)
    }
}
