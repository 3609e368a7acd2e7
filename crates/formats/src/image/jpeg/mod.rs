//! JPEG in: the decoder of `image`, after a look at whether all of the picture is there. That decoder fills up what is
//! missing with grey and says nothing.
//!
//! Source: ITU-T T.81, annexes B (segments), F (sequential) and G (progressive).

mod scan;

use std::io::Cursor;

use ::image::codecs::jpeg::JpegDecoder;
use raycam_scene::{Image, NoticeCode};

use crate::error::Result;
use crate::image::decoder::{Decoder, decode_checked, decoder_error};
use crate::image::jpeg::scan::{FrameComponent, HuffmanTable, Scan, ScanKind};

/// The most scans of one picture, as many as the decoder takes: each may visit all of it with a few bytes.
const MAX_SCANS: usize = 100;

pub(super) fn jpeg(file: &mut Decoder<'_>) -> Result<Image> {
    let decoder = JpegDecoder::new(Cursor::new(file.bytes));
    let decoder = decoder.map_err(|e| decoder_error(file, e))?;
    let mut missing = MissingData::default();
    let image = decode_checked(file, decoder, |file| {
        missing = check_complete(file.bytes).map_err(|message| file.fault(message))?;
        Ok(())
    })?;
    if missing.scans {
        file.notice(NoticeCode::TruncatedData, "its last scans are missing: coarser than it was made");
    }
    if let Some(number) = missing.end_of {
        file.notice(
            NoticeCode::TruncatedData,
            format!("scan {number} ends within its last blocks; what is missing there is made up"),
        );
    }
    Ok(image)
}

/// Missing data that a picture can be shown without.
#[derive(Clone, Copy, Debug, Default)]
struct MissingData {
    /// The scans that would make it finer.
    scans: bool,
    /// The end of the last blocks of this scan.
    end_of: Option<usize>,
}

/// State after the segments that were read.
#[derive(Default)]
struct SegmentState {
    /// How the picture is coded, 0, 1 or 2 (progressive), where this is known.
    frame: Option<u8>,
    size: [usize; 2],
    components: Vec<FrameComponent>,
    /// Tables of DC, then of AC.
    tables: [[Option<HuffmanTable>; 4]; 2],
    interval: usize,
    scans: usize,
    missing: MissingData,
}

/// Checks that the file has every scan of its picture; allocates no pixels.
fn check_complete(bytes: &[u8]) -> Result<MissingData, String> {
    let cut = || "ends early: no end-of-image marker".to_owned();
    let mut found = SegmentState::default();
    let mut at = 2;
    loop {
        // Bytes before a marker are skipped, as decoders do.
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
        let short = || format!("ends early or is damaged: its segment {marker:#04x} is not as expected");
        match marker {
            0xc4 => found.huffman(segment).ok_or_else(short)?,
            // A second picture in one file is another's.
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
    /// A frame header. Other ways to code a picture are left to the decoder.
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

    /// Huffman tables.
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

    /// A scan's header, then how many bytes of `data` it takes.
    fn scan(&mut self, segment: &[u8], data: &[u8]) -> Result<usize, String> {
        let number = self.scans;
        // Frames of a film may leave out the tables that all of them have, which the decoder knows.
        if self.tables.as_flattened().iter().all(Option::is_none) {
            self.frame = None;
        }
        let Some(frame) = self.frame else { return Ok(0) };
        let odd = || format!("ends early or is damaged: scan {number} is not as expected");
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
            .map_err(|place| format!("ends early or is damaged: scan {number} {place}"))?;
        if !complete {
            self.missing.end_of.get_or_insert(number);
        }
        Ok(length)
    }

    /// The missing data, at the end of the file.
    fn finished(&self) -> Result<MissingData, String> {
        if self.frame.is_none() {
            return match self.scans {
                0 => Err("ends before its picture".to_owned()),
                _ => Ok(MissingData::default()),
            };
        }
        if let Some(missing) = self.components.iter().find(|c| c.bits[0].is_none()) {
            return Err(format!("ends early: nothing of its component {}", missing.id));
        }
        let mut bits = self.components.iter().flat_map(|c| &c.bits);
        Ok(MissingData { scans: bits.any(|&bit| bit != Some(0)), ..self.missing })
    }
}
