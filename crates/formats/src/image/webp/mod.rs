//! Reading of WebP by the decoder of `image`, after a check that the image is complete.
//!
//! Source: RFC 9649, 2.5 to 2.7 (container), and RFC 6386, 9.1 and 9.5 (lengths in a lossy image).

mod lossless;

use std::io::Cursor;

use ::image::codecs::webp::WebPDecoder;
use raycam_scene::{ErrorCode, Image, NoticeCode};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_checked, decoder_error};
use crate::image::webp::lossless::{LosslessValidator, check_stream};

pub(super) fn webp(file: &mut Decoder<'_>) -> Result<Image> {
    // The container (RIFF) declares a length, and the bytes that follow must have at least this length.
    if let Some(length) = file.bytes.get(4..8).and_then(|b| b.first_chunk()) {
        let length = u64::from(u32::from_le_bytes(*length)) + 8;
        if (file.bytes.len() as u64) < length {
            return Err(file.truncated(format!("truncated: {} bytes of {length}", file.bytes.len())));
        }
    }
    let decoder = WebPDecoder::new(Cursor::new(file.bytes));
    let decoder = decoder.map_err(|e| decoder_error(file, e))?;
    if decoder.has_animation() {
        file.notice(NoticeCode::FirstOnly, "animated WebP: only the first frame is used");
    }
    decode_checked(file, decoder, |file| {
        let message = "the image is truncated or damaged";
        check_complete(file.bytes.get(12..).unwrap_or_default())
            .ok_or_else(|| file.fault(ErrorCode::TruncatedFile, message))
    })
}

/// `Some` if the first image in these chunks is complete; for a lossy image, only the length of its first partition is
/// checked. Allocates nothing.
fn check_complete(mut chunks: &[u8]) -> Option<()> {
    let mut alpha = None;
    while let Some((head, rest)) = chunks.split_first_chunk::<8>() {
        let length = u32::from_le_bytes(*head[4..].first_chunk()?) as usize;
        // The last chunk may declare more bytes than the file contains; only the existing bytes matter.
        let (chunk, rest) = rest.split_at(length.min(rest.len()));
        match &head[..4] {
            b"VP8L" => return check_stream(chunk),
            b"VP8 " => {
                let size = lossy_size(chunk)?;
                return alpha.map_or(Some(()), |chunk| check_alpha(chunk, size));
            }
            b"ALPH" => alpha = Some(chunk),
            // A frame of an animation contains the image's chunks.
            b"ANMF" => return check_complete(chunk.get(16..)?),
            _ => {}
        }
        chunks = rest.get(length % 2..).unwrap_or_default();
    }
    None
}

/// Size of a lossy image whose first partition is complete.
fn lossy_size(chunk: &[u8]) -> Option<[usize; 2]> {
    let (head, rest) = chunk.split_first_chunk::<10>()?;
    let two = |at: usize| usize::from(u16::from_le_bytes([head[at], head[at + 1]]));
    let first = (two(0) | usize::from(head[2]) << 16) >> 5;
    (rest.len() >= first).then_some([two(6) & 0x3fff, two(8) & 0x3fff])
}

/// `Some` if an alpha channel of this size is complete.
fn check_alpha(chunk: &[u8], [columns, rows]: [usize; 2]) -> Option<()> {
    let (head, data) = chunk.split_first()?;
    match head & 3 {
        0 => (data.len() >= columns * rows).then_some(()),
        1 => LosslessValidator::new(data).check_picture([columns, rows]),
        _ => None,
    }
}
