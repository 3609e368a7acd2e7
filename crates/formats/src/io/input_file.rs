//! File for a reader: its path for errors, and its bytes.

use raycam_scene::ErrorCode;
use std::fs::File;
use std::ops::Range;
use std::path::PathBuf;

use crate::error::{FormatError, Result};
use crate::io::ByteSource;

/// A file in memory, or only the beginning of a file.
#[derive(Debug)]
pub struct InputFile {
    /// Path as shown in errors; names in the file start from its folder.
    pub path: PathBuf,
    /// The bytes, or the first bytes of a large file.
    pub bytes: Vec<u8>,
    /// The file and its size, if `bytes` contains only its beginning.
    pub(crate) rest: Option<(File, usize)>,
}

impl InputFile {
    /// A file whose bytes are all in memory.
    pub fn new(path: impl Into<PathBuf>, bytes: Vec<u8>) -> Self {
        Self { path: path.into(), bytes, rest: None }
    }

    /// Length of the file in bytes, whether its bytes are in memory or on disk.
    pub(crate) fn len(&self) -> usize {
        self.rest.as_ref().map_or(self.bytes.len(), |(_, size)| *size)
    }

    /// A range of the file's bytes, which is either completely in memory or completely on disk.
    pub(crate) fn part(&self, range: Range<usize>) -> ByteSource<'_> {
        match &self.rest {
            Some((file, _)) if range.end > self.bytes.len() => {
                ByteSource::Disk { file, start: range.start as u64, length: range.len() }
            }
            _ => ByteSource::Memory(self.bytes[range].into()),
        }
    }

    /// Text of the file.
    ///
    /// # Errors
    /// [`FormatError::Syntax`] with the position of the first byte that is not UTF-8.
    pub fn text(&self) -> Result<&str> {
        std::str::from_utf8(&self.bytes).map_err(|error| {
            FormatError::byte(&self.path, error.valid_up_to(), ErrorCode::NotText.message("not UTF-8 text"))
        })
    }

    /// Name of the file without its last extension.
    pub fn stem(&self) -> Option<String> {
        Some(self.path.file_stem()?.to_string_lossy().into_owned())
    }
}
