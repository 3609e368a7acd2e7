//! Rows of a PLY file, value by value.

use std::path::Path;

use raycam_scene::{ErrorCode, Message, Notice, NoticeCode, counted};

use crate::error::{FormatError, Result};
use crate::io::ByteSource;
use crate::io::lexer::{self, Lines, Words};
use crate::ply::scalar::ScalarType;

/// Rows after the header.
pub(crate) struct Body<'a> {
    path: &'a Path,
    source: RowSource<'a>,
}

enum RowSource<'a> {
    /// A text file with one row per line.
    Text {
        lines: Lines<'a>,
        words: Words<'a>,
        header: usize,
        line: usize,
        /// Number of rows that continue after their last value, and the line of the first.
        long: Option<(usize, usize)>,
    },
    /// All bytes of a binary file, and the offset of the next byte to be read.
    Binary { bytes: ByteSource<'a>, at: usize, big_endian: bool },
}

/// All bytes of a file; bytes that are not yet in memory are read.
fn in_memory<'b>(path: &Path, bytes: &'b mut ByteSource<'_>) -> Result<&'b [u8]> {
    if let ByteSource::Disk { .. } = bytes {
        let read = bytes.borrowed().read().map_err(|source| FormatError::Io { path: path.into(), source })?;
        *bytes = ByteSource::Memory(read.into_owned().into());
    }
    match bytes {
        ByteSource::Memory(bytes) => Ok(bytes),
        ByteSource::Disk { .. } => Ok(&[]), // not reached: all bytes have been read into memory
    }
}

impl<'a> Body<'a> {
    /// Rows of a text after a header with this number of lines.
    pub(crate) fn text(path: &'a Path, rows: &'a [u8], header: usize) -> Self {
        let source = RowSource::Text { lines: Lines::new(rows), words: Words(&[]), header, line: header, long: None };
        Self { path, source }
    }

    /// Rows that begin at a byte of a file.
    pub(crate) fn binary(path: &'a Path, bytes: ByteSource<'a>, at: usize, big_endian: bool) -> Self {
        let source = RowSource::Binary { bytes, at, big_endian };
        Self { path, source }
    }

    /// Error at the current position.
    pub(crate) fn error(&self, message: impl Into<Message>) -> FormatError {
        match self.source {
            RowSource::Text { line, .. } => FormatError::line(self.path, line, message),
            RowSource::Binary { at, .. } => FormatError::byte(self.path, at, message),
        }
    }

    /// Current position, for a notice.
    pub(crate) fn location(&self) -> String {
        match self.source {
            RowSource::Text { line, .. } => format!("line {line}"),
            RowSource::Binary { at, .. } => format!("the row that ends at byte {at}"),
        }
    }

    fn truncated(&self) -> FormatError {
        self.error(ErrorCode::TruncatedFile.message(
            "the file ends before the rows that its header declares: it is truncated, or the header \
                    declares too many rows",
        ))
    }

    /// Moves to the start of the next row.
    pub(crate) fn row(&mut self) -> Result<()> {
        if let RowSource::Text { lines, words, header, line, .. } = &mut self.source {
            let next = lines.find(|(_, text)| !lexer::trim(text).is_empty());
            let Some((number, text)) = next else { return Err(self.truncated()) };
            *line = *header + number;
            *words = Words(text);
        }
        Ok(())
    }

    /// Ends a row; the rest of a line is ignored.
    pub(crate) fn end_row(&mut self) {
        if let RowSource::Text { words, line, long, .. } = &mut self.source
            && words.next().is_some()
        {
            let (count, first) = long.unwrap_or((0, *line));
            *long = Some((count + 1, first));
        }
    }

    /// Reads the next value of the row. All types fit into a float64.
    pub(crate) fn value(&mut self, kind: ScalarType) -> Result<f64> {
        match &mut self.source {
            RowSource::Text { words, .. } => {
                let Some(word) = words.next() else {
                    return Err(
                        self.error(ErrorCode::WrongShape.message("the row has fewer values than the header declares"))
                    );
                };
                match lexer::number(word) {
                    Some(value) if kind.is_float() || value.fract() == 0.0 => Ok(value),
                    None => Err(self.error(ErrorCode::WrongType.message(lexer::not_a_number(word)))),
                    Some(_) => Err(self.error(
                        ErrorCode::WrongType.message(format!("{} is not a whole number", lexer::for_message(word))),
                    )),
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

    /// Reads the next values of the row.
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

    /// The next `count` bytes of a binary file, if the file has as many, and true for big-endian numbers.
    pub(crate) fn peek(&self, count: usize) -> Option<(ByteSource<'_>, bool)> {
        let RowSource::Binary { bytes, at, big_endian } = &self.source else { return None };
        let end = at.checked_add(count).filter(|&end| end <= bytes.len())?;
        Some((bytes.borrowed().part(*at..end), *big_endian))
    }

    /// Offset of the next byte of a binary file.
    pub(crate) fn offset(&self) -> Option<usize> {
        match self.source {
            RowSource::Binary { at, .. } => Some(at),
            RowSource::Text { .. } => None,
        }
    }

    /// Skips bytes that were examined by [`peek`](Self::peek).
    pub(crate) fn skip(&mut self, count: usize) {
        if let RowSource::Binary { at, .. } = &mut self.source {
            *at += count;
        }
    }

    /// Reads the length of a list.
    pub(crate) fn length(&mut self, kind: ScalarType) -> Result<usize> {
        let length = self.value(kind)?;
        // The items are read one by one, so that a declared length alone takes no memory.
        if length >= 0.0 && length.fract() == 0.0 && length.is_finite() {
            return Ok(length as usize);
        }
        Err(self
            .error(ErrorCode::OutOfRange.message(format!("a list of {length} items; expected a whole number >= 0"))))
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
                            "{path}: values beyond those that the header declares are ignored in {}, the first in \
                             line {first}",
                            counted(*count, "row")
                        ),
                    ));
                }
                if lines.any(|(_, text)| !lexer::trim(text).is_empty()) {
                    notices.push(Notice::new(
                        NoticeCode::TrailingData,
                        format!("{path}: the lines after the last row are ignored"),
                    ));
                }
            }
            RowSource::Binary { bytes, at, .. } => {
                let left = bytes.len() - *at;
                if left > 0 {
                    notices.push(Notice::new(
                        NoticeCode::TrailingData,
                        format!("{path}: {} after the last row ignored", counted(left, "byte")),
                    ));
                }
            }
        }
        notices
    }
}
