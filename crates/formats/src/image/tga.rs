//! Reading of TGA by the decoder of `image`, after a check that the image is complete.
//!
//! Source: Truevision TGA File Format Specification 2.0, "TGA file header" and "Image data".

use std::io::Cursor;

use ::image::codecs::tga::TgaDecoder;
use raycam_scene::{ErrorCode, Image};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_checked, decoder_error};

/// True if the bytes can be the header of a TGA file; the format has no magic number, and its footer is optional.
pub(super) fn is_tga(bytes: &[u8]) -> bool {
    let Some(head) = bytes.first_chunk::<18>() else { return false };
    let [map, kind, depth, descriptor] = [head[1], head[2], head[16], head[17]];
    let [columns, rows] = [&head[12..14], &head[14..16]].map(|side| side != [0, 0]);
    let kind_fits = match kind {
        1 | 9 => map == 1 && matches!(depth, 8 | 16),
        2 | 10 => map <= 1 && matches!(depth, 15 | 16 | 24 | 32),
        3 | 11 => map <= 1 && matches!(depth, 8 | 16),
        _ => false,
    };
    kind_fits && columns && rows && descriptor & 0xc0 == 0
}

pub(super) fn tga(file: &mut Decoder<'_>) -> Result<Image> {
    let decoder = TgaDecoder::new(Cursor::new(file.bytes));
    let decoder = decoder.map_err(|e| decoder_error(file, e))?;
    decode_checked(file, decoder, |file| {
        let message = "truncated, or contains an index outside its colour map";
        check_complete(file.bytes).ok_or_else(|| file.fault(ErrorCode::TruncatedFile, message))
    })
}

/// `Some` if the file contains every pixel, and a colour for every index; allocates nothing.
fn check_complete(bytes: &[u8]) -> Option<()> {
    let (head, bytes) = bytes.split_first_chunk::<18>()?;
    let two = |at: usize| usize::from(u16::from_le_bytes([head[at], head[at + 1]]));
    let (first, colors, entry) = (two(3), two(5), usize::from(head[7]).div_ceil(8));
    let map = if head[1] == 1 { colors * entry } else { 0 };
    let bytes = bytes.get(usize::from(head[0]) + map..)?;
    let (mut left, size) = (two(12) * two(14), usize::from(head[16]).div_ceil(8));
    // True if every pixel's index has a colour in the map.
    let known = |pixels: &[u8]| {
        let in_map = |index: usize| (first..first + colors).contains(&index);
        match (head[2] & 7, size) {
            (1, 1) => pixels.iter().all(|&low| in_map(low.into())),
            (1, _) => (pixels.as_chunks().0.iter()).all(|&two| in_map(u16::from_le_bytes(two).into())),
            _ => true,
        }
    };
    if head[2] & 8 == 0 {
        let pixels = bytes.get(..left.checked_mul(size)?)?;
        return known(pixels).then_some(());
    }
    let mut bytes = bytes.iter();
    while left > 0 {
        let packet = *bytes.next()?;
        let count = usize::from(packet & 0x7f) + 1;
        // The last run may extend beyond the image.
        let count = count.min(left);
        left -= count;
        let length = size * if packet & 0x80 == 0 { count } else { 1 };
        let pixels = &bytes.as_slice().get(..length)?;
        bytes.nth(length - 1);
        known(pixels).then_some(())?;
    }
    Some(())
}
