//! Layout of a TIFF image's samples: its tags, validated before anything is decoded.

use raycam_scene::{ErrorCode, NoticeCode};

use crate::error::Result;
use crate::image::decoder::Decoder;
use crate::image::tiff::directory::Directory;

/// Type of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleFormat {
    Unsigned,
    Signed,
    Float,
}

/// Meaning of the colour samples, from the tag `PhotometricInterpretation`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Photometric {
    WhiteIsZero,
    BlackIsZero,
    Rgb,
    Palette,
    Cmyk,
    YCbCr,
}

impl Photometric {
    /// Number of samples without alpha and spare channels.
    pub(super) fn colors(self) -> usize {
        match self {
            Self::WhiteIsZero | Self::BlackIsZero | Self::Palette => 1,
            Self::Rgb | Self::YCbCr => 3,
            Self::Cmyk => 4,
        }
    }
}

/// Meaning of a channel after the colours, from the tag `ExtraSamples`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extra {
    Spare,
    Premultiplied,
    Straight,
}

pub(super) const UNCOMPRESSED: u64 = 1;
pub(super) const JPEG: u64 = 7;
pub(super) const ZSTD: u64 = 50000;

/// Layout of an image.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) size: [u32; 2],
    pub(super) bits: usize,
    pub(super) format: SampleFormat,
    pub(super) samples: usize,
    pub(super) photometric: Photometric,
    pub(super) extras: Vec<Extra>,
    pub(super) compression: u64,
    pub(super) predictor: u64,
    /// True if the lowest bit of each byte comes first.
    pub(super) reversed_bits: bool,
    /// True if each channel has separate strips or tiles.
    pub(super) planar: bool,
    /// Columns and rows of a tile, or the image's columns and the rows of a strip.
    pub(super) chunk: [u32; 2],
    pub(super) tiled: bool,
    pub(super) chroma: [u32; 2],
}

impl Layout {
    /// Reads and validates the tags.
    pub(super) fn read(file: &mut Decoder<'_>, tags: &Directory<'_>) -> Result<Self> {
        let side = |tag| tags.first(tag).and_then(|side| u32::try_from(side).ok());
        let (Some(columns), Some(rows)) = (side(256), side(257)) else {
            return Err(file.fault(ErrorCode::MissingValue, "ImageWidth and ImageLength are missing"));
        };
        let samples = tags.first(277).unwrap_or(1) as usize;
        let bits = tags.numbers(258).unwrap_or_else(|| vec![1]);
        let (Some(&first), true) = (bits.first(), bits.windows(2).all(|pair| pair[0] == pair[1])) else {
            return Err(file.unsupported(format!("channels of {bits:?} bits; expected equal sizes")));
        };
        let tiled = tags.first(324).is_some();
        let chunk = if tiled {
            [side(322).unwrap_or(0), side(323).unwrap_or(0)]
        } else {
            [columns, side(278).unwrap_or(rows).min(rows)]
        };
        let compression = tags.first(259).unwrap_or(UNCOMPRESSED);
        check_compression(file, compression)?;
        let photometric = photometric(file, tags, samples)?;
        let colors = photometric.colors();
        if !(colors..=64).contains(&samples) || chunk.contains(&0) {
            let message = format!(
                "{samples} samples per pixel in tiles or strips of {} x {} pixels; expected {colors} to 64 \
                 samples, and at least 1 x 1 pixels",
                chunk[0], chunk[1]
            );
            return Err(file.fault(ErrorCode::OutOfRange, message));
        }
        let predicts = matches!(compression, 5 | 8 | 32946 | ZSTD);
        let layout = Self {
            size: [columns, rows],
            bits: first as usize,
            format: sample_format(file, tags)?,
            samples,
            photometric,
            extras: extras(tags, samples - colors),
            compression,
            // As in libtiff, a predictor is supported only for these compressions.
            predictor: tags.first(317).filter(|_| predicts).unwrap_or(1),
            reversed_bits: tags.first(266) == Some(2),
            planar: samples > 1 && tags.first(284) == Some(2),
            chunk,
            tiled,
            chroma: chroma(tags, photometric, compression),
        };
        layout.check(file)?;
        Ok(layout)
    }

    fn check(&self, file: &Decoder<'_>) -> Result<()> {
        let Self { bits, format, predictor, .. } = *self;
        let known = match format {
            SampleFormat::Unsigned => (1..=16).contains(&bits) || bits == 32 || bits == 64,
            SampleFormat::Signed => matches!(bits, 8 | 16 | 32 | 64),
            SampleFormat::Float => matches!(bits, 16 | 32 | 64),
        };
        if !known {
            return Err(file.unsupported(format!(
                "{format:?} samples of {bits} bits; supported: unsigned of 1 to 16, 32 and 64 bits, signed of 8, 16, 32 \
                 and 64 bits, float of 16, 32 and 64 bits"
            )));
        }
        let whole = matches!(bits, 8 | 16 | 32 | 64);
        let fits = match predictor {
            1 => true,
            2 => whole,
            3 => format == SampleFormat::Float,
            _ => false,
        };
        if !fits {
            return Err(file.unsupported(format!(
                "predictor {predictor} of {format:?} samples of {bits} bits is not supported; expected predictor 1, 2 \
                 (8, 16, 32 or 64 bits) or 3 (float)"
            )));
        }
        if self.photometric == Photometric::Palette && (format != SampleFormat::Unsigned || bits > 16) {
            return Err(file.fault(
                ErrorCode::UnsupportedFeature,
                format!("a palette with {format:?} indices of {bits} bits; expected unsigned indices of 1 to 16 bits"),
            ));
        }
        if self.compression == JPEG && bits != 8 {
            return Err(file.unsupported(format!("JPEG compression of {bits} bits; expected 8")));
        }
        if self.compression == JPEG && ![1, 3, 4].contains(&self.interleaved()) {
            let message = format!("JPEG compression of {} channels; expected 1, 3 or 4", self.interleaved());
            return Err(file.unsupported(message));
        }
        if self.photometric == Photometric::YCbCr && (bits != 8 || format != SampleFormat::Unsigned) {
            return Err(file.unsupported(format!("YCbCr of {bits} bits; expected 8 (or convert the image to RGB)")));
        }
        let [across, down] = self.chroma;
        if self.chroma != [1, 1]
            && (self.planar
                || self.samples != 3
                || ![1, 2, 4].contains(&across)
                || ![1, 2, 4].contains(&down)
                || (self.tiled && !self.chunk[0].is_multiple_of(across))
                || (self.chunk[1] < self.size[1] && !self.chunk[1].is_multiple_of(down)))
        {
            return Err(file.unsupported(format!(
                "YCbCr with chroma subsampled by {across} x {down} is not supported; \
                convert the image to RGB"
            )));
        }
        let area = u64::from(self.chunk[0]) * u64::from(self.chunk[1]);
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        if area > (4 * pixels).max(1 << 16) {
            let message = format!(
                "tiles of {} x {} pixels are more than four times as large as the image of {pixels} pixels; save the image \
                 with smaller tiles",
                self.chunk[0], self.chunk[1]
            );
            return Err(file.fault(ErrorCode::OutOfRange, message));
        }
        Ok(())
    }

    /// Number of samples of a pixel that are adjacent in a row.
    pub(super) fn interleaved(&self) -> usize {
        if self.planar { 1 } else { self.samples }
    }
}

fn photometric(file: &mut Decoder<'_>, tags: &Directory<'_>, samples: usize) -> Result<Photometric> {
    Ok(match tags.first(262) {
        Some(0) => Photometric::WhiteIsZero,
        Some(1 | 4) => Photometric::BlackIsZero,
        Some(2) => Photometric::Rgb,
        Some(3) => Photometric::Palette,
        Some(5) => Photometric::Cmyk,
        Some(6) => Photometric::YCbCr,
        None => {
            file.notice(
                NoticeCode::AssumedConvention,
                "the tag PhotometricInterpretation is missing; the image is read as grey or RGB, depending on the \
                 number of channels",
            );
            if samples < 3 { Photometric::BlackIsZero } else { Photometric::Rgb }
        }
        Some(other) => {
            let name = match other {
                8..=10 => "CIE Lab",
                32803 | 34892 => "camera raw",
                32844 | 32845 => "LogLuv",
                _ => "an unknown colour space",
            };
            return Err(file.unsupported(format!(
                "{name} (PhotometricInterpretation {other}) is not supported; convert \
                the image to RGB"
            )));
        }
    })
}

fn sample_format(file: &Decoder<'_>, tags: &Directory<'_>) -> Result<SampleFormat> {
    let formats = tags.numbers(339).unwrap_or_else(|| vec![1]);
    match (formats.first(), formats.windows(2).all(|pair| pair[0] == pair[1])) {
        (Some(1 | 4), true) => Ok(SampleFormat::Unsigned),
        (Some(2), true) => Ok(SampleFormat::Signed),
        (Some(3), true) => Ok(SampleFormat::Float),
        _ => Err(file.unsupported(format!("SampleFormat {formats:?}; expected one of 1, 2, 3 and 4 for all channels"))),
    }
}

/// Meaning of each channel after the colours; without a tag, the first is alpha, as in Pillow.
fn extras(tags: &Directory<'_>, count: usize) -> Vec<Extra> {
    let meanings = tags.numbers(338);
    let of = |i: usize| match &meanings {
        None if i == 0 => Extra::Straight,
        None => Extra::Spare,
        Some(meanings) => match meanings.get(i) {
            Some(1) => Extra::Premultiplied,
            Some(2) => Extra::Straight,
            _ => Extra::Spare,
        },
    };
    (0..count).map(of).collect()
}

/// Columns and rows that share a chroma sample in the decoded data. JPEG decoders return full resolution.
fn chroma(tags: &Directory<'_>, photometric: Photometric, compression: u64) -> [u32; 2] {
    if photometric != Photometric::YCbCr || compression == JPEG {
        return [1, 1];
    }
    match tags.numbers(530).as_deref() {
        Some(&[across, down]) => [across, down].map(|n| u32::try_from(n).unwrap_or(0)),
        _ => [2, 2],
    }
}

fn check_compression(file: &Decoder<'_>, compression: u64) -> Result<()> {
    let name = match compression {
        UNCOMPRESSED | 4 | 5 | JPEG | 8 | 32773 | 32946 | ZSTD | 50001 => return Ok(()),
        2 | 3 => "CCITT group 3",
        6 => "old-style JPEG",
        34676 | 34677 => "SGI Log",
        34712 => "JPEG 2000",
        34887 => "LERC",
        34925 => "LZMA",
        52546 | 50002 => "JPEG XL",
        _ => "unknown",
    };
    Err(file.unsupported(format!(
        "{name} compression ({compression}) is not supported; save the image uncompressed, or with LZW, Deflate, PackBits, JPEG, \
         CCITT group 4, Zstandard or WebP"
    )))
}
