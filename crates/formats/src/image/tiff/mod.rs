//! Reading of TIFF: grey, palettes, RGB, CMYK and YCbCr, with alpha and spare channels. Only the first image of a file
//! is read.
//!
//! Source: Aldus, "TIFF Revision 6.0", 1992.
//!
//! ```text
//! directory ← layout ← samples ← tiff
//! ```

mod directory;
mod layout;
mod samples;

use ::image::metadata::Orientation;
use raycam_scene::{ErrorCode, Image, NoticeCode, counted};

use crate::error::Result;
use crate::image::decoder::{Decoder, grouped};
use crate::image::tiff::directory::Directory;
use crate::image::tiff::layout::{Extra, JPEG, Layout, Photometric, SampleFormat};

/// True if the bytes begin like a TIFF or BigTIFF file, in either byte order.
pub(super) fn is_tiff(bytes: &[u8]) -> bool {
    [&b"II*\0"[..], b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| bytes.starts_with(magic))
}

pub(super) fn tiff(file: &mut Decoder<'_>) -> Result<Image> {
    let tags = Directory::read(file)?;
    let layout = Layout::read(file, &tags)?;
    let texel = match (layout.format, layout.bits) {
        (SampleFormat::Float, _) => 16,
        (SampleFormat::Unsigned, 1..=8) => 4,
        _ => 8,
    };
    let packed = (layout.samples * layout.bits).div_ceil(8) as u64;
    file.take_pixels(layout.size, packed.max(texel))?;
    if let Some(profile) = tags.bytes(34675) {
        file.profile_notice(profile);
    }
    let orientation = tags.first(274).and_then(|value| Orientation::from_exif(u8::try_from(value).ok()?));
    file.orientation_notice(orientation);
    let colors = Colors::new(file, &tags, &layout)?;
    let mut samples = samples::read(file, &tags, &layout)?;
    if layout.format == SampleFormat::Signed {
        let negative = samples.iter().filter(|&&sample| sample < 0.0).count();
        if negative > 0 {
            file.notice(
                NoticeCode::ClampedValue,
                format!("negative values are read as 0 ({})", counted(negative, "value")),
            );
            samples.iter_mut().for_each(|sample| *sample = sample.max(0.0));
        }
    }
    let pixels = samples.chunks_exact(layout.samples);
    let texels = match texel {
        4 => {
            let eight = pixels.map(|pixel| colors.rgba(pixel).map(|v| (255.0 * v).round() as u8));
            let texels = grouped(eight.flatten().collect());
            file.texels8(texels)
        }
        8 => {
            let sixteen = pixels.map(|pixel| colors.rgba(pixel).map(|v| (65535.0 * v).round() as u16));
            let texels = grouped(sixteen.flatten().collect());
            file.texels16(texels)
        }
        _ => {
            let texels = pixels.map(|pixel| colors.rgba(pixel)).collect();
            file.float_texels(texels)
        }
    };
    Ok(file.image(layout.size, texels))
}

/// Conversion of a pixel's samples to red, green, blue and alpha.
struct Colors {
    photometric: Photometric,
    /// Index of alpha, and true if the colours are premultiplied by it.
    alpha: Option<(usize, bool)>,
    palette: Vec<[f32; 3]>,
    /// Luma coefficients of red, green and blue.
    luma: [f32; 3],
    /// Black and white levels of luma and both chroma channels, in 0..=255.
    reference: [f32; 6],
}

impl Colors {
    fn new(file: &mut Decoder<'_>, tags: &Directory<'_>, layout: &Layout) -> Result<Self> {
        let first = layout.photometric.colors();
        let alpha = layout.extras.iter().position(|extra| *extra != Extra::Spare);
        let spare = layout.extras.len() - usize::from(alpha.is_some());
        if spare > 0 {
            file.notice(
                NoticeCode::IgnoredFeature,
                format!("{} ignored: neither colour nor alpha", counted(spare, "extra channel")),
            );
        }
        let mut palette = Vec::new();
        if layout.photometric == Photometric::Palette {
            let map = tags.numbers(320).unwrap_or_default();
            let count = 1 << layout.bits;
            if map.len() != 3 * count {
                return Err(file
                    .fault(ErrorCode::WrongShape, format!("a palette of {} values; expected 3 x {count}", map.len())));
            }
            // Colour maps have 16 bits per value, but some programs write values of 8 bits.
            let eight = map.iter().all(|&value| value < 256);
            let color = |i: usize| [0, 1, 2].map(|c| (map[c * count + i] >> if eight { 0 } else { 8 }) as f32 / 255.0);
            palette = (0..count).map(color).collect();
        }
        if layout.photometric == Photometric::Cmyk {
            file.notice(
                NoticeCode::ApproximatedValue,
                "the image's inks (CMYK) are converted to RGB without a colour profile",
            );
        }
        let three = |values: Vec<f32>| <[f32; 3]>::try_from(values).ok().filter(|v| v.iter().all(|v| v.is_normal()));
        let six = |values: Vec<f32>| <[f32; 6]>::try_from(values).ok().filter(|v| v.iter().all(|v| v.is_finite()));
        let full = [0.0, 255.0, 128.0, 255.0, 128.0, 255.0];
        Ok(Self {
            photometric: layout.photometric,
            alpha: alpha.map(|i| (first + i, layout.extras[i] == Extra::Premultiplied)),
            palette,
            // The default is Rec. 601.
            luma: tags.fractions(529).and_then(three).unwrap_or([0.299, 0.587, 0.114]),
            reference: tags.fractions(532).filter(|_| layout.compression != JPEG).and_then(six).unwrap_or(full),
        })
    }

    /// Red, green, blue and alpha of a pixel.
    fn rgba(&self, samples: &[f32]) -> [f32; 4] {
        let [r, g, b] = match self.photometric {
            Photometric::BlackIsZero => [samples[0]; 3],
            Photometric::WhiteIsZero => [1.0 - samples[0]; 3],
            Photometric::Rgb => [samples[0], samples[1], samples[2]],
            Photometric::Palette => {
                let index = (samples[0] * (self.palette.len() - 1) as f32).round() as usize;
                self.palette[index.min(self.palette.len() - 1)]
            }
            Photometric::Cmyk => [0, 1, 2].map(|i| (1.0 - samples[i]) * (1.0 - samples[3])),
            Photometric::YCbCr => self.rgb_of_ycbcr([samples[0], samples[1], samples[2]]),
        };
        let Some((at, premultiplied)) = self.alpha else { return [r, g, b, 1.0] };
        let alpha = samples[at];
        if premultiplied && alpha > 0.0 {
            return [r / alpha, g / alpha, b / alpha, alpha];
        }
        [r, g, b, alpha]
    }

    /// Converts YCbCr to RGB (TIFF 6.0, section 21).
    fn rgb_of_ycbcr(&self, samples: [f32; 3]) -> [f32; 3] {
        let [black, white, zero_b, most_b, zero_r, most_r] = self.reference;
        let [y, cb, cr] = samples.map(|v| 255.0 * v);
        let y = (y - black) * 255.0 / (white - black);
        let cb = (cb - zero_b) * 127.0 / (most_b - zero_b);
        let cr = (cr - zero_r) * 127.0 / (most_r - zero_r);
        let [of_r, of_g, of_b] = self.luma;
        let r = cr * (2.0 - 2.0 * of_r) + y;
        let b = cb * (2.0 - 2.0 * of_b) + y;
        let g = (y - of_b * b - of_r * r) / of_g;
        [r, g, b].map(|v| (v / 255.0).clamp(0.0, 1.0))
    }
}
