//! State and helpers of all image decoders: budget, notices, and the conversions to texels.

use std::path::Path;

use ::image::metadata::Orientation;
use ::image::{ColorType, DynamicImage, ImageDecoder, ImageError};
use bytemuck::Pod;
use raycam_scene::{ColorUse, ErrorCode, Image, Message, Notice, NoticeCode, Texels, counted};

use crate::budget::Budget;
use crate::error::{FormatError, Result};

/// Number of bytes to which an image of any file size may decompress: enough for a uniform image of 4096 x 4096 or, if
/// the decoder streams, of 8192 x 8192.
pub(crate) const MAX_UNBACKED_BYTES: u64 = 64 << 20;
pub(crate) const MAX_UNBACKED_BYTES_STREAMED: u64 = 256 << 20;

/// State of decoding one image.
pub(crate) struct Decoder<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) path: &'a Path,
    pub(crate) color_use: ColorUse,
    pub(crate) trusted: u64,
    pub(crate) budget: &'a mut Budget,
    pub(crate) notices: &'a mut Vec<Notice>,
    /// EXIF orientation, which no decoder applies.
    pub(crate) orientation: Orientation,
}

impl Decoder<'_> {
    pub(crate) fn fault(&self, code: ErrorCode, message: impl Into<String>) -> FormatError {
        FormatError::whole(self.path, code.message(message))
    }

    /// Error of a file that ends before its declared content.
    pub(crate) fn truncated(&self, message: impl Into<String>) -> FormatError {
        self.fault(ErrorCode::TruncatedFile, message)
    }

    pub(crate) fn unsupported(&self, message: impl Into<Message>) -> FormatError {
        FormatError::unsupported(self.path, message)
    }

    pub(crate) fn notice(&mut self, code: NoticeCode, message: impl std::fmt::Display) {
        self.notices.push(Notice::new(code, format!("{}: {message}", self.path.display())));
    }

    /// Charges the pixels of an image before they are decoded. Rejects an image that decompresses to more than the
    /// limit of its format plus 4096 times its file size. Returns true if the image decompresses to more than 32 MiB
    /// plus 16 times its file size. If the format allows a check without decoding, such a file is checked to its end
    /// before memory is allocated.
    pub(crate) fn take_pixels(&mut self, [columns, rows]: [u32; 2], texel: u64) -> Result<bool> {
        let pixels = u64::from(columns) * u64::from(rows);
        if pixels == 0 {
            return Err(self.fault(
                ErrorCode::OutOfRange,
                format!("the image has {columns} x {rows} pixels; width and height must be at least 1"),
            ));
        }
        self.budget.take_pixels(self.path, pixels)?;
        let (unpacked, length) = (pixels * texel, self.bytes.len() as u64);
        if unpacked > self.trusted + 4096 * length {
            let message = format!(
                "{columns} x {rows} pixels in {} bytes, which is too much for a file of this size; store the image \
                 smaller, or with less compression",
                self.bytes.len()
            );
            return Err(self.fault(ErrorCode::ImplausibleSize, message));
        }
        Ok(unpacked > MAX_UNBACKED_BYTES / 2 + 16 * length)
    }

    /// Adds the notice about a colour profile other than sRGB.
    pub(crate) fn profile_notice(&mut self, profile: &[u8]) {
        // A profile whose description contains "sRGB", as text or as UTF-16, requires no conversion.
        let srgb = profile.windows(4).any(|w| w == b"sRGB") || profile.windows(7).any(|w| w == b"s\0R\0G\0B");
        if !srgb {
            self.notice(
                NoticeCode::IgnoredColorProfile,
                "the image's colour profile is ignored; convert the image to sRGB",
            );
        }
    }

    /// Stores the image's orientation; adds a notice if the orientation rotates or mirrors the image.
    pub(crate) fn orientation_notice(&mut self, orientation: Option<Orientation>) {
        self.orientation = orientation.unwrap_or(Orientation::NoTransforms);
        if self.orientation != Orientation::NoTransforms {
            self.notice(NoticeCode::IgnoredOrientation, "the image's EXIF orientation is ignored");
        }
    }

    pub(crate) fn image(&self, size: [u32; 2], texels: Texels) -> Image {
        Image::new(self.path.display().to_string(), size, texels)
    }

    /// Texels of eight bits per channel: sRGB for colours, linear for data.
    pub(crate) fn texels8(&self, texels: Vec<[u8; 4]>) -> Texels {
        match self.color_use {
            ColorUse::Color => Texels::Srgb8(texels),
            ColorUse::Data => Texels::Linear8(texels),
        }
    }

    /// Texels of sixteen bits per channel: converted from sRGB to linear for colours, unchanged for data.
    pub(crate) fn texels16(&self, texels: Vec<[u16; 4]>) -> Texels {
        match self.color_use {
            ColorUse::Color => Texels::from_srgb16(texels),
            ColorUse::Data => Texels::Linear16(texels),
        }
    }

    /// Texels of floats. Infinities become the largest float16 and NaN becomes 0, with a notice.
    pub(crate) fn float_texels(&mut self, mut texels: Vec<[f32; 4]>) -> Texels {
        const LARGEST: f32 = 65504.0;
        let mut replaced = 0;
        for value in texels.as_flattened_mut() {
            if !value.is_finite() {
                *value = if value.is_nan() { 0.0 } else { LARGEST.copysign(*value) };
                replaced += 1;
            }
        }
        if replaced > 0 {
            self.notice(
                NoticeCode::ReplacedValue,
                format!("infinite values and NaN are read as {LARGEST} and 0 ({})", counted(replaced, "value")),
            );
        }
        Texels::Float(texels)
    }
}

/// Decodes an image if the budget is sufficient and `check_complete` succeeds; both are checked before anything is
/// stored.
pub(crate) fn decode_checked(
    file: &mut Decoder<'_>,
    decoder: impl ImageDecoder,
    check_complete: impl FnOnce(&Decoder<'_>) -> Result<()>,
) -> Result<Image> {
    let texel = texel_bytes(&decoder);
    file.take_pixels(decoder.dimensions().into(), texel)?;
    check_complete(file)?;
    decode_pixels(file, decoder, texel)
}

/// Bytes per texel of the image that results from this decoder.
pub(crate) fn texel_bytes(decoder: &impl ImageDecoder) -> u64 {
    match decoder.color_type() {
        ColorType::Rgb32F | ColorType::Rgba32F => 16,
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => 8,
        _ => 4,
    }
}

/// Decoded image, whose pixels have been charged to the budget.
pub(crate) fn decode_pixels(file: &mut Decoder<'_>, mut decoder: impl ImageDecoder, texel: u64) -> Result<Image> {
    let size = decoder.dimensions().into();
    if let Ok(Some(profile)) = decoder.icc_profile() {
        file.profile_notice(&profile);
    }
    file.orientation_notice(decoder.orientation().ok());
    let image = DynamicImage::from_decoder(decoder).map_err(|e| decoder_error(file, e))?;
    let texels = match texel {
        4 => file.texels8(grouped(image.into_rgba8().into_raw())),
        8 => file.texels16(grouped(image.into_rgba16().into_raw())),
        _ => file.float_texels(grouped(image.into_rgba32f().into_raw())),
    };
    Ok(file.image(size, texels))
}

/// Groups the channels of each texel, in the same memory if its size is a multiple of a texel.
pub(crate) fn grouped<T: Pod>(channels: Vec<T>) -> Vec<[T; 4]> {
    let texels = bytemuck::allocation::try_cast_vec(channels);
    texels.unwrap_or_else(|(_, channels)| channels.as_chunks::<4>().0.to_vec())
}

pub(crate) fn decoder_error(file: &Decoder<'_>, error: ImageError) -> FormatError {
    match error {
        ImageError::Unsupported(e) => file.unsupported(e.to_string()),
        ImageError::IoError(e) => file.truncated(format!("truncated: {e}")),
        e => file.fault(ErrorCode::DamagedData, e.to_string()),
    }
}
