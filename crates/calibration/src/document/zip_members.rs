//! ZIP files, stored or deflated, and gzip. Source: PKWARE's APPNOTE 6.3, sections 4.3 and 4.4; RFC 1952.

use std::io::Read;
use std::path::Path;

use flate2::read::{DeflateDecoder, MultiGzDecoder};

use raycam_formats::Budget;
use raycam_formats::io::{InputFile, without_utf16};
use raycam_formats::{FormatError, Result};

/// File in a ZIP file.
pub(crate) struct ZipMember {
    pub(crate) name: String,
    deflated: bool,
    /// Offset of the file's local header.
    header: usize,
    packed: usize,
    size: usize,
}

/// True for the bytes of a ZIP file.
pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// Decompresses a gzip file; converts UTF-16 to UTF-8, and removes the byte order mark of UTF-8.
pub(crate) fn unpacked(mut source: InputFile, budget: &mut Budget) -> Result<InputFile> {
    if source.bytes.starts_with(b"\x1f\x8b") {
        let bytes = unpack(MultiGzDecoder::new(&source.bytes[..]), &source.path, budget)?;
        source = InputFile::new(source.path, bytes);
    }
    source.bytes = without_utf16(source.bytes);
    if source.bytes.starts_with(BYTE_ORDER_MARK) {
        source.bytes.drain(..BYTE_ORDER_MARK.len());
    }
    Ok(source)
}

/// Byte order mark of UTF-8, which Windows programs write at the beginning of text files.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads all bytes of a decompressing reader, within the budget.
fn unpack(packed: impl Read, path: &Path, budget: &mut Budget) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = packed.take(budget.bytes.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|error| FormatError::whole(path, format!("the compressed data is damaged or truncated: {error}")))?;
    budget.take_bytes(path, bytes.len() as u64)?;
    Ok(bytes)
}

fn number(bytes: &[u8], at: usize, count: usize) -> Option<usize> {
    let field = bytes.get(at..at.checked_add(count)?)?;
    Some(field.iter().rev().fold(0, |value, byte| value << 8 | usize::from(*byte)))
}

/// Files of a ZIP file, from its central directory.
pub(crate) fn members(bytes: &[u8]) -> Result<Vec<ZipMember>, String> {
    let broken = || "the ZIP file is damaged or truncated".to_owned();
    let tail = bytes.len().saturating_sub(22 + 65_535);
    let end = bytes[tail..].windows(4).rposition(|four| four == b"PK\x05\x06").ok_or_else(broken)? + tail;
    let count = number(bytes, end + 10, 2).ok_or_else(broken)?;
    let mut at = number(bytes, end + 16, 4).ok_or_else(broken)?;
    let mut found = Vec::new();
    for _ in 0..count {
        let field = |offset: usize, count: usize| number(bytes, at.checked_add(offset)?, count);
        let member = || {
            (bytes.get(at..at + 4)? == b"PK\x01\x02").then_some(())?;
            let (method, length) = (field(10, 2)?, field(28, 2)?);
            let name = bytes.get(at + 46..at + 46 + length)?;
            let member = ZipMember {
                name: String::from_utf8_lossy(name).into_owned(),
                deflated: method == 8,
                header: field(42, 4)?,
                packed: field(20, 4)?,
                size: field(24, 4)?,
            };
            let next = at + 46 + length + field(30, 2)? + field(32, 2)?;
            (method == 0 || method == 8).then_some((member, next))
        };
        let (member, next) = member().ok_or_else(broken)?;
        found.push(member);
        at = next;
    }
    Ok(found)
}

impl ZipMember {
    /// The file's compressed bytes.
    fn packed<'a>(&self, bytes: &'a [u8]) -> Option<&'a [u8]> {
        let (name, extra) = (number(bytes, self.header + 26, 2)?, number(bytes, self.header + 28, 2)?);
        let start = self.header + 30 + name + extra;
        bytes.get(start..start.checked_add(self.packed)?)
    }

    /// Decompresses at most the first `count` bytes of the file; `None` if the file is damaged.
    pub(crate) fn start(&self, bytes: &[u8], count: usize) -> Option<Vec<u8>> {
        let packed = self.packed(bytes)?;
        let mut start = Vec::new();
        let read = match self.deflated {
            true => DeflateDecoder::new(packed).take(count as u64).read_to_end(&mut start),
            false => packed.take(count as u64).read_to_end(&mut start),
        };
        read.ok().map(|_| start)
    }

    /// Decompresses the file within the budget.
    pub(crate) fn unpack(&self, bytes: &[u8], path: &Path, budget: &mut Budget) -> Result<Vec<u8>> {
        let fail = || FormatError::whole(path, format!("the ZIP entry {} is truncated", self.name));
        let packed = self.packed(bytes).ok_or_else(fail)?;
        let unpacked = if self.deflated { unpack(DeflateDecoder::new(packed), path, budget)? } else { packed.to_vec() };
        if unpacked.len() == self.size { Ok(unpacked) } else { Err(fail()) }
    }
}
