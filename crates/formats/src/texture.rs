//! Images in: PNG and JPEG as textures.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, Limits};
use raycam_scene::{Image, Texels, Texture, TextureSampler, Wrap};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::folder::{Folder, Source};

/// The texture in a PNG or JPEG file, told apart by content, repeated in both directions.
///
/// Texels are what the file stores, read as sRGB: grey becomes three equal channels, 16 bits are rounded to 8, palettes
/// are resolved. A gamma that is not sRGB's and an embedded colour profile are not applied, and transparency is dropped,
/// each with a notice.
///
/// # Errors
/// See [`FormatError`]; more pixels than the budget allows are refused before they are decoded, and a file that ends
/// early is an error, even where part of the image could be shown.
pub fn read_texture(path: &Path, budget: &Budget) -> Result<(Texture, Vec<String>), FormatError> {
    let source = Folder::around(path, budget).read(path)?;
    decode_texture(source.bytes, path, budget)
}

/// The texture in the bytes of a PNG or JPEG file, as [`read_texture`]; `path` names it.
///
/// # Errors
/// See [`FormatError`].
pub fn decode_texture(
    bytes: Vec<u8>,
    path: &Path,
    budget: &Budget,
) -> Result<(Texture, Vec<String>), FormatError> {
    let source = Source {
        path: path.into(),
        bytes,
    };
    let mut notices = Vec::new();
    let texture = decode(
        &source,
        [Wrap::Repeat; 2],
        &mut budget.clone(),
        &mut notices,
    )?;
    Ok((texture, notices))
}

/// The texture in a file that has been read.
pub(crate) fn decode(
    source: &Source,
    wrap: [Wrap; 2],
    budget: &mut Budget,
    notices: &mut Vec<String>,
) -> Result<Texture, FormatError> {
    let Source { path, bytes } = source;
    let image = match image::guess_format(bytes) {
        Ok(ImageFormat::Png) => {
            // What its chunks besides the pixels may unpack to.
            let mut limits = Limits::no_limits();
            limits.max_alloc = Some((64 << 20) + 16 * bytes.len() as u64);
            let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits);
            let decoder = decoder.map_err(|e| refused(path, e))?;
            notices.extend(other_gamma(path, bytes));
            pixels(path, decoder, budget, notices)?
        }
        Ok(ImageFormat::Jpeg) => {
            whole_jpeg(path, bytes)?;
            let decoder = JpegDecoder::new(Cursor::new(bytes));
            pixels(
                path,
                decoder.map_err(|e| refused(path, e))?,
                budget,
                notices,
            )?
        }
        _ => return Err(FormatError::unsupported(path, "not a PNG or JPEG image")),
    };
    if image.color().has_alpha() && image.to_luma_alpha8().pixels().any(|p| p[1] != 255) {
        notices.push(format!("{}: its transparency is dropped", path.display()));
    }
    let size = [image.width(), image.height()];
    let texels = image.into_rgba8().into_raw().as_chunks::<4>().0.to_vec();
    let image = Image {
        name: path.display().to_string(),
        size,
        texels: Texels::Srgb8(texels),
    };
    Ok(Texture {
        image: Arc::new(image),
        sampler: TextureSampler {
            wrap,
            ..TextureSampler::default()
        },
    })
}

/// A notice where a PNG says that it has another gamma than sRGB's; `image` does not tell.
fn other_gamma(path: &Path, bytes: &[u8]) -> Option<String> {
    let reader = png::Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    let gamma = reader.info().gamma()?.into_value();
    let message = format!(
        "{}: its gamma of {gamma} is not applied: read as sRGB",
        path.display()
    );
    ((gamma - 1.0 / 2.2).abs() > 0.01).then_some(message)
}

/// The decoded image, if the budget has room for it.
fn pixels(
    path: &Path,
    mut decoder: impl ImageDecoder,
    budget: &mut Budget,
    notices: &mut Vec<String>,
) -> Result<DynamicImage, FormatError> {
    let (columns, rows) = decoder.dimensions();
    if columns == 0 || rows == 0 {
        return Err(FormatError::whole(
            path,
            format!("an image of {columns} x {rows} pixels"),
        ));
    }
    budget.take_pixels(path, u64::from(columns) * u64::from(rows))?;
    if let Ok(Some(profile)) = decoder.icc_profile()
        // "sRGB" in the profile's description, as text or as UTF-16: nothing to apply.
        && !profile.windows(4).any(|w| w == b"sRGB")
        && !profile.windows(7).any(|w| w == b"s\0R\0G\0B")
    {
        notices.push(format!(
            "{}: its colour profile is not applied: read as sRGB",
            path.display()
        ));
    }
    DynamicImage::from_decoder(decoder).map_err(|e| refused(path, e))
}

fn refused(path: &Path, error: ImageError) -> FormatError {
    match error {
        ImageError::Unsupported(e) => FormatError::unsupported(path, e.to_string()),
        ImageError::IoError(e) => FormatError::whole(path, format!("ends early: {e}")),
        e => FormatError::whole(path, e.to_string()),
    }
}

/// The decoder fills up what is missing; here a JPEG without its end (ITU-T T.81, B.1.1.3, marker EOI) is an error.
fn whole_jpeg(path: &Path, bytes: &[u8]) -> Result<(), FormatError> {
    let cut = || FormatError::whole(path, "ends early: no end-of-image marker");
    let mut at = 2;
    // Over the segments before the first scan: a thumbnail in one of them has its own end.
    loop {
        let [0xff, marker, rest @ ..] = bytes.get(at..).unwrap_or(&[]) else {
            return Err(cut());
        };
        at += match (marker, rest) {
            (0xff, _) => 1,
            (0xda, _) => break,
            (0xd0..=0xd9 | 0x01, _) => 2,
            (_, [high, low, ..]) => 2 + usize::from(u16::from_be_bytes([*high, *low])),
            _ => return Err(cut()),
        };
    }
    // In a scan every 0xff of the data is followed by a 0.
    if bytes[at..].windows(2).any(|w| w == [0xff, 0xd9]) {
        Ok(())
    } else {
        Err(cut())
    }
}
