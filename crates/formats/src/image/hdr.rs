//! Reading of Radiance HDR by the decoder of `image`, and the orientations that it does not support.

use std::io::Read;

use ::image::codecs::hdr::HdrDecoder;
use raycam_scene::{ErrorCode, Image, NoticeCode, Texels};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_checked, decoder_error};

pub(super) fn hdr(file: &mut Decoder<'_>) -> Result<Image> {
    // Both signatures have the same meaning.
    let rest = file.bytes.strip_prefix(b"#?RGBE");
    let rest = rest.or_else(|| file.bytes.strip_prefix(b"#?RADIANCE"));
    let rest = rest.unwrap_or_default();
    let found = Orientation::parse(rest);
    // The decoder receives the file with an orientation that it supports, and the texels are rearranged afterwards.
    let (line, after) = match &found {
        Some((orientation, line)) => (orientation.standard_header(), line.end),
        None => (String::new(), 0),
    };
    let header = &rest[..found.as_ref().map_or(0, |(_, line)| line.start)];
    let bytes = b"#?RADIANCE".chain(header).chain(line.as_bytes());
    let decoder = HdrDecoder::new(bytes.chain(&rest[after..])).map_err(|e| decoder_error(file, e))?;
    let metadata = decoder.metadata();
    for (key, value) in &metadata.custom_attributes {
        if key == "FORMAT" && value != "32-bit_rle_rgbe" {
            return Err(file.unsupported(format!("an HDR image of FORMAT {value}; expected 32-bit_rle_rgbe")));
        }
    }
    for (key, value) in &metadata.custom_attributes {
        if changes_colors(key, value) {
            file.notice(NoticeCode::IgnoredColorProfile, format_args!("the image's {key} of {value} is ignored"));
        }
    }
    // All values of the file are divided by this factor.
    let exposure = metadata.exposure.unwrap_or(1.0);
    let fault = |file: &Decoder<'_>| {
        file.fault(ErrorCode::OutOfRange, format!("EXPOSURE is {exposure}; expected a finite number greater than 0"))
    };
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(fault(file));
    }
    let size = [metadata.width, metadata.height].map(|side| side as usize);
    let mut image = decode_checked(file, decoder, |file| {
        let lines = after_resolution(rest).unwrap_or_default();
        check_complete(lines, size)
            .ok_or_else(|| file.fault(ErrorCode::TruncatedFile, "truncated, or its runs are longer than a line"))
    })?;
    if exposure != 1.0
        && let Texels::Float(texels) = &mut image.texels
    {
        for texel in texels.iter_mut() {
            let [r, g, b, a] = *texel;
            *texel = [r / exposure, g / exposure, b / exposure, a];
        }
        let mut values = texels.as_flattened().iter();
        if !values.all(|v| v.is_finite() && *v >= 0.0) {
            return Err(fault(file));
        }
    }
    Ok(match found {
        Some((orientation, _)) => orientation.reorient(image),
        None => image,
    })
}

/// Bytes after the header and the resolution string.
fn after_resolution(bytes: &[u8]) -> Option<&[u8]> {
    let start = bytes.windows(2).position(|pair| pair == b"\n\n")? + 2;
    let length = bytes[start..].iter().position(|&b| b == b'\n')?;
    Some(&bytes[start + length + 1..])
}

/// `Some` if these bytes are all scanlines of an image; allocates nothing.
///
/// Source: Ward, "Radiance File Formats", "Picture File Format". A line that begins with 2, 2 and a number below 128
/// has its four channels one after the other, in runs of one value (more than 128) and of several values. In any other
/// line, a pixel of 1, 1, 1 repeats the previous pixel, 256 times as often after another such pixel.
fn check_complete(bytes: &[u8], [columns, rows]: [usize; 2]) -> Option<()> {
    let mut bytes = bytes.iter();
    let mut take = |count: usize| match count {
        0 => Some(&[][..]),
        _ => {
            let all = bytes.as_slice();
            bytes.nth(count - 1)?;
            Some(&all[..count])
        }
    };
    for _ in 0..rows {
        let first = take(4)?;
        if matches!(first, [2, 2, ..128, _]) {
            for _ in 0..4 {
                let mut at = 0;
                while at < columns {
                    let length = usize::from(take(1)?[0]);
                    let (values, texels) = match length {
                        129.. => (1, length - 128),
                        _ => (length, length),
                    };
                    take(values)?;
                    at += texels;
                }
                (at == columns).then_some(())?;
            }
            continue;
        }
        (first[..3] != [1; 3]).then_some(())?;
        let (mut at, mut times) = (1_usize, 1_usize);
        while at < columns {
            let texel = take(4)?;
            if texel[..3] == [1; 3] {
                at = at.checked_add(times.checked_mul(texel[3].into())?)?;
                times = times.saturating_mul(256);
            } else {
                times = 1;
                at += 1;
            }
        }
        (at == columns).then_some(())?;
    }
    Some(())
}

/// True if a header line specifies other primaries, a colour correction, or pixels that are not square.
fn changes_colors(key: &str, value: &str) -> bool {
    let expected: &[f32] = match key {
        "COLORCORR" => &[1.0; 3],
        "PIXASPECT" => &[1.0],
        // These are the primaries of Rec. 709; the green primary of Radiance differs by 0.01.
        "PRIMARIES" => &[0.64, 0.33, 0.3, 0.6, 0.15, 0.06],
        _ => return false,
    };
    let mut numbers = value.split_whitespace().map(str::parse::<f32>);
    let near = |number: f32, &expected: &f32| (number - expected).abs() < 0.011;
    !expected.iter().all(|expected| matches!(numbers.next(), Some(Ok(number)) if near(number, expected)))
}

/// Arrangement of a file's scanlines, if it differs from the usual arrangement (from top to bottom, each from left to
/// right).
///
/// Source: Ward, "Radiance File Formats", "Picture File Format". The resolution string names the axis and direction of
/// consecutive scanlines, then of the pixels in a scanline; +Y is upwards, +X to the right.
#[derive(Debug, PartialEq)]
struct Orientation {
    /// Number of scanlines, and of pixels in each, as written.
    counts: [String; 2],
    /// True if scanlines are columns.
    columns: bool,
    /// True if scanlines, and pixels in each, begin at the bottom or the right.
    reversed: [bool; 2],
}

impl Orientation {
    /// Orientation given by the resolution string (the line after the first empty line), and the string's byte range;
    /// `None` for the standard orientation, and if there is no such string.
    fn parse(bytes: &[u8]) -> Option<(Self, std::ops::Range<usize>)> {
        let start = bytes.windows(2).position(|pair| pair == b"\n\n")? + 2;
        let length = bytes[start..].iter().position(|&b| b == b'\n')?;
        let line = std::str::from_utf8(&bytes[start..start + length]).ok()?;
        let [first, scanlines, second, pixels] = line.split_whitespace().collect::<Vec<_>>()[..].try_into().ok()?;
        let axis = |word| match word {
            "-Y" => Some((false, false)),
            "+Y" => Some((false, true)),
            "+X" => Some((true, false)),
            "-X" => Some((true, true)),
            _ => None,
        };
        let ((columns, last_first), (across, backwards)) = (axis(first)?, axis(second)?);
        let usual = !columns && !last_first && !backwards;
        (columns != across && !usual).then(|| {
            let found =
                Self { counts: [scanlines, pixels].map(str::to_owned), columns, reversed: [last_first, backwards] };
            (found, start..start + length + 1)
        })
    }

    /// Resolution string of a file with the same scanlines in the usual orientation.
    fn standard_header(&self) -> String {
        let [scanlines, pixels] = &self.counts;
        format!("-Y {scanlines} +X {pixels}\n")
    }

    /// The image whose scanlines are the rows of `image`.
    fn reorient(&self, image: Image) -> Image {
        let Texels::Float(from) = &image.texels else { return image };
        let [pixels, scanlines] = image.size;
        let (columns, rows) = match self.columns {
            true => (scanlines, pixels),
            false => (pixels, scanlines),
        };
        let turned = |at: u32, count: u32, reversed| if reversed { count - 1 - at } else { at };
        let mut texels = Vec::with_capacity(from.len());
        for y in 0..rows {
            for x in 0..columns {
                let [line, place] = if self.columns { [x, y] } else { [y, x] };
                let line = turned(line, scanlines, self.reversed[0]) as usize;
                let place = turned(place, pixels, self.reversed[1]) as usize;
                texels.push(from[line * pixels as usize + place]);
            }
        }
        Image { size: [columns, rows], texels: Texels::Float(texels), ..image }
    }
}
