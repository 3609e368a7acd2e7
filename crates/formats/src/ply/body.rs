//! The rows of a PLY file, value by value.

use std::path::Path;

use raycam_scene::{ErrorCode, Message, Notice, NoticeCode};

use crate::error::{FormatError, Result};
use crate::io::ByteSource;
use crate::io::lexer::{self, Lines, Words};
use crate::ply::scalar::ScalarType;

/// The rows after the header.
pub(crate) struct Body<'a> {
    path: &'a Path,
    source: RowSource<'a>,
}

enum RowSource<'a> {
    /// One row a line.
    Text {
        lines: Lines<'a>,
        words: Words<'a>,
        header: usize,
        line: usize,
        /// Number of rows that go on after their last value, and the line of the first.
        long: Option<(usize, usize)>,
    },
    /// The whole file.
    Binary { bytes: ByteSource<'a>, at: usize, big_endian: bool },
}

/// All bytes of a file, which are read where they are not in memory yet.
fn in_memory<'b>(path: &Path, bytes: &'b mut ByteSource<'_>) -> Result<&'b [u8]> {
    if let ByteSource::Disk { .. } = bytes {
        let read = bytes.borrowed().read().map_err(|source| FormatError::Io { path: path.into(), source })?;
        *bytes = ByteSource::Memory(read.into_owned().into());
    }
    match bytes {
        ByteSource::Memory(bytes) => Ok(bytes),
        ByteSource::Disk { .. } => Ok(&[]), // was just read
    }
}

impl<'a> Body<'a> {
    /// The rows of a text after a header of so many lines.
    pub(crate) fn text(path: &'a Path, rows: &'a [u8], header: usize) -> Self {
        let source = RowSource::Text { lines: Lines::new(rows), words: Words(&[]), header, line: header, long: None };
        Self { path, source }
    }

    /// The rows that begin at a byte of a file.
    pub(crate) fn binary(path: &'a Path, bytes: ByteSource<'a>, at: usize, big_endian: bool) -> Self {
        let source = RowSource::Binary { bytes, at, big_endian };
        Self { path, source }
    }

    /// An error at the current position.
    pub(crate) fn error(&self, message: impl Into<Message>) -> FormatError {
        match self.source {
            RowSource::Text { line, .. } => FormatError::line(self.path, line, message),
            RowSource::Binary { at, .. } => FormatError::byte(self.path, at, message),
        }
    }

    /// The current position, for a notice.
    pub(crate) fn location(&self) -> String {
        match self.source {
            RowSource::Text { line, .. } => format!("line {line}"),
            RowSource::Binary { at, .. } => format!("the row that ends at byte {at}"),
        }
    }

    fn truncated(&self) -> FormatError {
        self.error(
            ErrorCode::TruncatedFile
                .message("ends before the rows that its header declares: it is cut off, or the header counts too many"),
        )
    }

    /// Begins a row.
    pub(crate) fn row(&mut self) -> Result<()> {
        if let RowSource::Text { lines, words, header, line, .. } = &mut self.source {
            let next = lines.find(|(_, text)| !lexer::trim(text).is_empty());
            let Some((number, text)) = next else { return Err(self.truncated()) };
            *line = *header + number;
            *words = Words(text);
        }
        Ok(())
    }

    /// Ends a row: what is left of a line is not used.
    pub(crate) fn end_row(&mut self) {
        if let RowSource::Text { words, line, long, .. } = &mut self.source
            && words.next().is_some()
        {
            let (count, first) = long.unwrap_or((0, *line));
            *long = Some((count + 1, first));
        }
    }

    /// The next value of the row. All kinds fit a float64.
    pub(crate) fn value(&mut self, kind: ScalarType) -> Result<f64> {
        match &mut self.source {
            RowSource::Text { words, .. } => {
                let Some(word) = words.next() else {
                    return Err(self.error("fewer values than the header declares"));
                };
                match lexer::number(word) {
                    Some(value) if kind.is_float() || value.fract() == 0.0 => Ok(value),
                    None => Err(self.error(lexer::not_a_number(word))),
                    Some(_) => Err(self.error(format!("{} is not a whole number", lexer::for_message(word)))),
                }
            }
            RowSource::Binary { bytes, at, big_endian } => {
                let size = kind.bytes();
                let Some(found) = in_memory(self.path, bytes)?.get(*at..*at + size) else {
                    return Err(self.truncated());
                };
                *at += size;
                Ok(kind.number(found, *big_endian))
            }
        }
    }

    /// The next values of the row.
    pub(crate) fn values(&mut self, kind: ScalarType, count: usize, values: &mut Vec<f64>) -> Result<()> {
        if let RowSource::Binary { bytes, at, big_endian } = &mut self.source {
            let size = kind.bytes();
            let end = count.checked_mul(size).and_then(|n| at.checked_add(n));
            let bytes = in_memory(self.path, bytes)?;
            let Some(found) = end.and_then(|end| bytes.get(*at..end)) else { return Err(self.truncated()) };
            *at += found.len();
            let numbers = found.chunks_exact(size);
            values.extend(numbers.map(|number| kind.number(number, *big_endian)));
            return Ok(());
        }
        for _ in 0..count {
            values.push(self.value(kind)?);
        }
        Ok(())
    }

    /// The next bytes of a binary file, if there are `count`, and true for big-endian numbers.
    pub(crate) fn peek(&self, count: usize) -> Option<(ByteSource<'_>, bool)> {
        let RowSource::Binary { bytes, at, big_endian } = &self.source else { return None };
        let end = at.checked_add(count).filter(|&end| end <= bytes.len())?;
        Some((bytes.borrowed().part(*at..end), *big_endian))
    }

    /// The offset of the next byte of a binary file.
    pub(crate) fn offset(&self) -> Option<usize> {
        match self.source {
            RowSource::Binary { at, .. } => Some(at),
            RowSource::Text { .. } => None,
        }
    }

    /// Passes over bytes that were looked at [`ahead`](Self::ahead).
    pub(crate) fn skip(&mut self, count: usize) {
        if let RowSource::Binary { at, .. } = &mut self.source {
            *at += count;
        }
    }

    /// The length of a list.
    pub(crate) fn length(&mut self, kind: ScalarType) -> Result<usize> {
        let length = self.value(kind)?;
        // The items are read one by one, so that a length alone takes no memory.
        if length >= 0.0 && length.fract() == 0.0 && length.is_finite() {
            return Ok(length as usize);
        }
        Err(self.error(format!("a list of {length} items")))
    }

    /// Notices after the last row: rows longer than declared, and bytes after the end.
    pub(crate) fn notices(mut self) -> Vec<Notice> {
        let path = self.path.display();
        let mut notices = Vec::new();
        match &mut self.source {
            RowSource::Text { lines, long, .. } => {
                if let Some((count, first)) = long {
                    notices.push(Notice::new(
                        NoticeCode::TrailingData,
                        format!(
                            "{path}: rows go on after the values that the header declares; the rest is not used: \
                         {count}, the first in line {first}"
                        ),
                    ));
                }
                if lines.any(|(_, text)| !lexer::trim(text).is_empty()) {
                    notices.push(Notice::new(
                        NoticeCode::TrailingData,
                        format!("{path}: the lines after the last row are not used"),
                    ));
                }
            }
            RowSource::Binary { bytes, at, .. } => {
                let left = bytes.len() - *at;
                if left > 0 {
                    notices.push(Notice::new(
                        NoticeCode::TrailingData,
                        format!("{path}: {left} bytes after the last row are not used"),
                    ));
                }
            }
        }
        notices
    }
}
