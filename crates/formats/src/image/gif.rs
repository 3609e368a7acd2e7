//! Reading of GIF by the decoder of `image`. Only the first frame of an animation is read.
//!
//! Source: CompuServe, "Graphics Interchange Format, Version 89a", 1990.

use std::io::Cursor;

use ::image::ImageDecoder;
use ::image::codecs::gif::GifDecoder;
use raycam_scene::{ErrorCode, Image, NoticeCode};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_checked, decoder_error};

/// Bytes that introduce a frame, the end of the file, and an extension.
const FRAME: u8 = b',';
const END: u8 = b';';
const EXTENSION: u8 = b'!';

pub(super) fn gif(file: &mut Decoder<'_>) -> Result<Image> {
    let decoder = GifDecoder::new(Cursor::new(file.bytes));
    let decoder = decoder.map_err(|error| decoder_error(file, error))?;
    let (frames, first) = count_frames(file.bytes).unzip();
    // The decoder allocates a whole frame, which may be larger than the image.
    let pixels = |[columns, rows]: [u32; 2]| u64::from(columns) * u64::from(rows);
    if let Some(first) = first.filter(|first| pixels(*first) > pixels(decoder.dimensions().into())) {
        file.take_pixels(first, 4)?;
    }
    if frames.is_some_and(|frames| frames > 1) {
        file.notice(NoticeCode::FirstOnly, "animated GIF: only the first frame is used");
    }
    decode_checked(file, decoder, |file| match frames {
        Some(1..) => Ok(()),
        Some(0) => Err(file.fault(ErrorCode::NothingVisible, "the file contains no frame")),
        None => Err(file.truncated("truncated")),
    })
}

/// Number of complete frames, up to two, and the size of the first; `None` if the file ends within the first frame.
fn count_frames(bytes: &[u8]) -> Option<(usize, [u32; 2])> {
    let (mut frames, mut first) = (0, [0; 2]);
    let mut at = 13 + table_bytes(*bytes.get(10)?);
    while frames < 2 {
        let frame = match bytes.get(at) {
            Some(&FRAME) => true,
            Some(&EXTENSION) => false,
            Some(&END) => break,
            // Some programs omit the byte that ends the file.
            _ => return (frames > 0).then_some((frames, first)),
        };
        let Some(after) = end_of_block(bytes, at, frame) else {
            return (frames > 0).then_some((frames, first));
        };
        if let (0, true, &[a, b, c, d]) = (frames, frame, &bytes[at + 5..at + 9]) {
            first = [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])].map(u32::from);
        }
        at = after;
        frames += usize::from(frame);
    }
    Some((frames, first))
}

/// Size of a colour table in bytes.
fn table_bytes(flags: u8) -> usize {
    if flags & 0x80 == 0 { 0 } else { 3 << ((flags & 7) + 1) }
}

/// Position after a frame or an extension, if the file contains all of the frame or extension.
fn end_of_block(bytes: &[u8], start: usize, frame: bool) -> Option<usize> {
    let mut at = match frame {
        true => start + 11 + table_bytes(*bytes.get(start + 9)?),
        false => start + 2,
    };
    // The data consists of blocks, each preceded by its length, up to an empty block.
    loop {
        match *bytes.get(at)? {
            0 => return Some(at + 1),
            length => at += 1 + usize::from(length),
        }
    }
}
