//! Reading of BMP by the decoder of `image`, after a check that the image is complete.
//!
//! Source: Microsoft, "Bitmap Storage", BITMAPFILEHEADER, BITMAPCOREHEADER, BITMAPINFOHEADER and "Bitmap Compression".

use std::io::Cursor;

use ::image::codecs::bmp::BmpDecoder;
use raycam_scene::{ErrorCode, Image};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_checked, decoder_error};

pub(super) fn bmp(file: &mut Decoder<'_>) -> Result<Image> {
    let decoder = BmpDecoder::new(Cursor::new(file.bytes));
    let decoder = decoder.map_err(|e| decoder_error(file, e))?;
    decode_checked(file, decoder, |file| {
        let found = BmpHeader::parse(file.bytes).map(|header| header.check_complete(file.bytes));
        found
            .flatten()
            .ok_or_else(|| file.fault(ErrorCode::TruncatedFile, "truncated, or its runs extend beyond the image"))
    })
}

/// Layout of the pixels, as declared by the header.
struct BmpHeader {
    start: usize,
    columns: usize,
    rows: usize,
    /// Bits per pixel.
    bits: usize,
    /// True for run-length encoding, in which runs do not continue in the next row.
    runs: bool,
}

impl BmpHeader {
    fn parse(bytes: &[u8]) -> Option<Self> {
        let two = |at: usize| Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
        let four = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
        let start = four(10)? as usize;
        Some(if four(14)? == 12 {
            Self { start, columns: two(18)?.into(), rows: two(20)?.into(), bits: two(24)?.into(), runs: false }
        } else {
            Self {
                start,
                columns: four(18)? as usize,
                // The height is negative if rows are stored from the top down.
                rows: four(22)?.cast_signed().unsigned_abs() as usize,
                bits: two(28)?.into(),
                runs: matches!(four(30)?, 1 | 2),
            }
        })
    }

    /// `Some` if the file contains every row; allocates nothing.
    fn check_complete(&self, bytes: &[u8]) -> Option<()> {
        let bytes = bytes.get(self.start..)?;
        if self.runs {
            return self.runs_fit(bytes);
        }
        let row = self.columns.checked_mul(self.bits)?.div_ceil(32) * 4;
        (bytes.len() >= row.checked_mul(self.rows)?).then_some(())
    }

    /// `Some` if the runs end within the image. A run of one colour that is longer than its row ends with the row,
    /// because some writers create such runs.
    fn runs_fit(&self, bytes: &[u8]) -> Option<()> {
        let mut bytes = bytes.iter();
        let mut next = || bytes.next().map(|&byte| usize::from(byte));
        // `column` is the sum of the run lengths in the row so far, `at` the number of pixels.
        let (mut row, mut at, mut column) = (0, 0, 0);
        while row < self.rows {
            match (next()?, next()?) {
                (0, 0) => (row, at, column) = (row + 1, 0, 0),
                (0, 1) => return Some(()),
                (0, 2) => {
                    let [right, up] = [next()?, next()?];
                    if up > 0 {
                        row += up;
                        at = column;
                    }
                    at += right;
                    column += right;
                    (row < self.rows).then_some(())?;
                }
                (0, count) => {
                    let length = (count * self.bits).div_ceil(8);
                    for _ in 0..length.next_multiple_of(2) {
                        next()?;
                    }
                    at += count;
                    column += count;
                }
                (count, _) => {
                    at += count;
                    column += count;
                    if self.bits == 8 {
                        at = at.min(self.columns);
                    }
                }
            }
            (at <= self.columns).then_some(())?;
        }
        Some(())
    }
}
