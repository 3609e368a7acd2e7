//! A file that a reader gets: its path for errors, and its bytes.

use std::fs::File;
use std::ops::Range;
use std::path::PathBuf;

use crate::error::{FormatError, Result};
use crate::io::ByteSource;

/// A file in memory, or the beginning of one.
#[derive(Debug)]
pub struct InputFile {
    /// As shown in errors; its folder is where the names in it start from.
    pub path: PathBuf,
    /// The bytes, or the first ones of a large file.
    pub bytes: Vec<u8>,
    /// The file and its size, where `bytes` are only the beginning of it.
    pub(crate) rest: Option<(File, usize)>,
}

impl InputFile {
    /// A whole file.
    pub fn new(path: impl Into<PathBuf>, bytes: Vec<u8>) -> Self {
        Self { path: path.into(), bytes, rest: None }
    }

    /// The bytes of the file, in memory or not.
    pub(crate) fn len(&self) -> usize {
        self.rest.as_ref().map_or(self.bytes.len(), |(_, size)| *size)
    }

    /// Some bytes of the file, all of them in memory or none.
    pub(crate) fn part(&self, range: Range<usize>) -> ByteSource<'_> {
        match &self.rest {
            Some((file, _)) if range.end > self.bytes.len() => {
                ByteSource::Disk { file, start: range.start as u64, length: range.len() }
            }
            _ => ByteSource::Memory(self.bytes[range].into()),
        }
    }

    /// The text of the file.
    ///
    /// # Errors
    /// [`FormatError::Syntax`] with the first byte that is not UTF-8.
    pub fn text(&self) -> Result<&str> {
        std::str::from_utf8(&self.bytes)
            .map_err(|error| FormatError::byte(&self.path, error.valid_up_to(), "not UTF-8 text"))
    }

    /// The name of the file without its last extension.
    pub fn stem(&self) -> Option<String> {
        Some(self.path.file_stem()?.to_string_lossy().into_owned())
    }
}
