//! Tags of a TIFF file's first image (Aldus, "TIFF Revision 6.0", 1992, section 2; BigTIFF, 2007).

use crate::error::Result;
use crate::image::decoder::Decoder;
use raycam_scene::ErrorCode;

/// Maximum number of tags in a directory; real files have some dozens.
const MAX_ENTRIES: u64 = 4096;

/// Tags of an image. Values are read from the file on demand.
pub(super) struct Directory<'a> {
    bytes: &'a [u8],
    pub(super) big_endian: bool,
    entries: Vec<Entry>,
}

struct Entry {
    tag: u16,
    kind: u16,
    count: usize,
    /// Offset of the value in the file.
    at: usize,
}

/// Bytes per element of a value, by the tag's type; 0 for unknown types.
fn element_bytes(kind: u16) -> usize {
    match kind {
        1 | 2 | 6 | 7 => 1,
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16..=18 => 8,
        _ => 0,
    }
}

impl<'a> Directory<'a> {
    pub(super) fn read(file: &Decoder<'a>) -> Result<Self> {
        let bytes = file.bytes;
        let mut directory = Self { bytes, big_endian: bytes.starts_with(b"MM"), entries: Vec::new() };
        let cut = || file.truncated("the file ends within its tags");
        let big = bytes.get(2..4).is_some_and(|version| version.contains(&43));
        let number = |at: usize, size: usize| directory.number(at, size).ok_or_else(cut);
        let (start, width) = if big { (number(8, 8)?, 8) } else { (number(4, 4)?, 4) };
        let start = usize::try_from(start).map_err(|_| cut())?;
        let count_bytes = if big { 8 } else { 2 };
        let count = number(start, count_bytes)?;
        if count > MAX_ENTRIES {
            return Err(file.fault(ErrorCode::TooLarge, format!("{count} tags; the maximum is {MAX_ENTRIES}")));
        }
        let mut entries = Vec::new();
        for i in 0..count as usize {
            let at = start + count_bytes + i * (4 + 2 * width);
            let (tag, kind) = (number(at, 2)? as u16, number(at + 2, 2)? as u16);
            let count = number(at + 4, width)?;
            let length = count.checked_mul(element_bytes(kind) as u64);
            let value = if length.is_some_and(|length| length <= width as u64) {
                (at + 4 + width) as u64
            } else {
                number(at + 4 + width, width)?
            };
            let end = length.and_then(|length| value.checked_add(length));
            // Only values of used tags must be inside the file.
            if end.is_some_and(|end| end <= bytes.len() as u64) {
                entries.push(Entry { tag, kind, count: count as usize, at: value as usize });
            } else if (256..=532).contains(&tag) && element_bytes(kind) > 0 {
                return Err(file.truncated(format!("truncated: the value of tag {tag} is missing")));
            }
        }
        directory.entries = entries;
        Ok(directory)
    }

    fn number(&self, at: usize, size: usize) -> Option<u64> {
        let bytes = self.bytes.get(at..at.checked_add(size)?)?;
        let join = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        Some(if self.big_endian { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) })
    }

    fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }

    /// Bytes of a tag's value.
    pub(super) fn bytes(&self, tag: u16) -> Option<&'a [u8]> {
        let entry = self.entry(tag)?;
        self.bytes.get(entry.at..entry.at + entry.count * element_bytes(entry.kind))
    }

    /// Value of a tag that contains unsigned whole numbers.
    pub(super) fn numbers(&self, tag: u16) -> Option<Vec<u64>> {
        let entry = self.entry(tag).filter(|entry| matches!(entry.kind, 1 | 3 | 4 | 16 | 18))?;
        let size = element_bytes(entry.kind);
        (0..entry.count).map(|i| self.number(entry.at + i * size, size)).collect()
    }

    /// First number of a tag's value.
    pub(super) fn first(&self, tag: u16) -> Option<u64> {
        self.numbers(tag)?.first().copied()
    }

    /// Value of a tag that contains fractions.
    pub(super) fn fractions(&self, tag: u16) -> Option<Vec<f32>> {
        let entry = self.entry(tag).filter(|entry| entry.kind == 5)?;
        let part = |at| self.number(at, 4);
        let at = |i| entry.at + 8 * i;
        (0..entry.count).map(|i| Some((part(at(i))? as f64 / part(at(i) + 4)? as f64) as f32)).collect()
    }
}
