//! Reading of JPEG by the decoder of `image`, after a check that the image is complete. That decoder silently fills
//! missing parts with grey.
//!
//! Source: ITU-T T.81, annexes B (segments), F (sequential) and G (progressive).

mod scan;

use std::io::Cursor;

use ::image::codecs::jpeg::JpegDecoder;
use raycam_scene::{ErrorCode, Image, NoticeCode};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_checked, decoder_error};
use crate::image::jpeg::scan::{FrameComponent, HuffmanTable, Scan, ScanKind};

/// Maximum number of scans in an image, as in the decoder: each scan may visit the whole image with only a few bytes.
const MAX_SCANS: usize = 100;

pub(super) fn jpeg(file: &mut Decoder<'_>) -> Result<Image> {
    let decoder = JpegDecoder::new(Cursor::new(file.bytes));
    let decoder = decoder.map_err(|e| decoder_error(file, e))?;
    let mut missing = MissingData::default();
    let image = decode_checked(file, decoder, |file| {
        missing = check_complete(file.bytes).map_err(|message| file.fault(ErrorCode::DamagedData, message))?;
        Ok(())
    })?;
    if missing.scans {
        file.notice(NoticeCode::TruncatedData, "the last JPEG scans are missing, so the image has less detail");
    }
    if let Some(number) = missing.end_of {
        file.notice(
            NoticeCode::TruncatedData,
            format!("JPEG scan {number} is truncated; the missing blocks are extrapolated"),
        );
    }
    Ok(image)
}

/// Missing data without which an image can still be shown.
#[derive(Clone, Copy, Debug, Default)]
struct MissingData {
    /// True if scans are missing that would add detail.
    scans: bool,
    /// Number of the scan whose last blocks are missing, if any.
    end_of: Option<usize>,
}

/// State after the segments that have been read.
#[derive(Default)]
struct SegmentState {
    /// Coding process of the image, 0, 1 or 2 (progressive), if known.
    frame: Option<u8>,
    size: [usize; 2],
    components: Vec<FrameComponent>,
    /// Huffman tables of DC coefficients, then of AC coefficients.
    tables: [[Option<HuffmanTable>; 4]; 2],
    interval: usize,
    scans: usize,
    missing: MissingData,
}

/// Checks that the file contains every scan of its image; allocates no pixels.
fn check_complete(bytes: &[u8]) -> Result<MissingData, String> {
    let cut = || "truncated: the end-of-image marker is missing".to_owned();
    let mut found = SegmentState::default();
    let mut at = 2;
    loop {
        // Bytes before a marker are skipped, as in common decoders.
        at += (bytes[at..].windows(2))
            .position(|pair| pair[0] == 0xff && !matches!(pair[1], 0 | 0xff))
            .ok_or_else(cut)?;
        let marker = bytes[at + 1];
        at += 2;
        match marker {
            0xd9 => return found.finished(),
            0xd0..=0xd8 | 0x01 => continue,
            _ => {}
        }
        let length: &[u8; 2] = bytes[at..].first_chunk().ok_or_else(cut)?;
        let length = usize::from(u16::from_be_bytes(*length));
        let segment = bytes.get(at + 2..at + length).ok_or_else(cut)?;
        at += length;
        let short = || format!("truncated or damaged: invalid segment {marker:#04x}");
        match marker {
            0xc4 => found.huffman(segment).ok_or_else(short)?,
            // A second image in the file is ignored.
            0xc0..=0xcf if !matches!(marker, 0xc8 | 0xcc) && found.components.is_empty() => {
                found.frame(marker - 0xc0, segment).ok_or_else(short)?;
            }
            0xdd => {
                let interval = segment.first_chunk().ok_or_else(short)?;
                found.interval = u16::from_be_bytes(*interval).into();
            }
            0xda => {
                found.scans += 1;
                if found.scans > MAX_SCANS {
                    return Err(format!("more than {MAX_SCANS} scans"));
                }
                at += found.scan(segment, &bytes[at..])?;
            }
            _ => {}
        }
    }
}

impl SegmentState {
    /// Reads a frame header. Images with a coding process other than 0, 1 and 2 are not checked here.
    fn frame(&mut self, kind: u8, segment: &[u8]) -> Option<()> {
        let (head, rest) = segment.split_first_chunk::<6>()?;
        let [_, high, low, wide, narrow, _] = *head;
        self.size = [[wide, narrow], [high, low]].map(|side| u16::from_be_bytes(side).into());
        self.frame = (kind <= 2 && !self.size.contains(&0)).then_some(kind);
        for &[id, factors, _] in rest.as_chunks().0 {
            let factors = [factors >> 4, factors & 15].map(usize::from);
            if factors.contains(&0) {
                return None;
            }
            self.components.push(FrameComponent::new(id, factors));
        }
        (self.components.len() == usize::from(head[5])).then_some(())
    }

    /// Reads the Huffman tables of a segment.
    fn huffman(&mut self, mut segment: &[u8]) -> Option<()> {
        while let Some((head, rest)) = segment.split_first_chunk::<17>() {
            let count = head[1..].iter().map(|&count| usize::from(count)).sum();
            let (values, rest) = rest.split_at_checked(count)?;
            let [class, id] = [head[0] >> 4, head[0] & 15].map(usize::from);
            let table = self.tables.get_mut(class)?.get_mut(id)?;
            let lengths = head[1..].first_chunk()?;
            *table = Some(HuffmanTable::new(lengths, values)?);
            segment = rest;
        }
        Some(())
    }

    /// Reads the header of a scan; returns the number of bytes of `data` that the scan takes.
    fn scan(&mut self, segment: &[u8], data: &[u8]) -> Result<usize, String> {
        let number = self.scans;
        // Frames of Motion JPEG may omit the standard tables, which the decoder contains.
        if self.tables.as_flattened().iter().all(Option::is_none) {
            self.frame = None;
        }
        let Some(frame) = self.frame else { return Ok(0) };
        let odd = || format!("truncated or damaged: invalid header of scan {number}");
        let (&count, rest) = segment.split_first().ok_or_else(odd)?;
        let (selectors, rest) = rest.split_at_checked(2 * usize::from(count)).ok_or_else(odd)?;
        let [first, last, bits] = *rest.first_chunk().ok_or_else(odd)?;
        let kind = match frame {
            2 => ScanKind::progressive([first, last], [bits >> 4, bits & 15]).ok_or_else(odd)?,
            _ => ScanKind::Sequential,
        };
        let mut chosen = Vec::new();
        for &[id, tables] in selectors.as_chunks().0 {
            let place = self.components.iter().position(|c| c.id == id);
            let place = place.filter(|place| !chosen.contains(place)).ok_or_else(odd)?;
            chosen.push(place);
            self.components[place].tables = [tables >> 4, tables & 15].map(|id| usize::from(id & 3));
        }
        if chosen.is_empty() || (chosen.len() > 1 && kind.is_single_component()) {
            return Err(odd());
        }
        let scan = Scan { size: self.size, kind, interval: self.interval, tables: &self.tables };
        let (length, complete) = (scan.read(&mut self.components, &chosen, data))
            .map_err(|place| format!("truncated or damaged: scan {number} {place}"))?;
        if !complete {
            self.missing.end_of.get_or_insert(number);
        }
        Ok(length)
    }

    /// Determines the data that is missing at the end of the file.
    fn finished(&self) -> Result<MissingData, String> {
        if self.frame.is_none() {
            return match self.scans {
                0 => Err("the file ends before the image data".to_owned()),
                _ => Ok(MissingData::default()),
            };
        }
        if let Some(missing) = self.components.iter().find(|c| c.bits[0].is_none()) {
            return Err(format!("truncated: no data of component {}", missing.id));
        }
        let mut bits = self.components.iter().flat_map(|c| &c.bits);
        Ok(MissingData { scans: bits.any(|&bit| bit != Some(0)), ..self.missing })
    }
}
