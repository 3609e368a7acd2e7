//! The glTF document: container, JSON and bytes, and the accessors that read the bytes. Independent of worlds.
//!
//! Errors and notices contain the position in the document and, if Khronos' glTF-Validator has a code for the problem,
//! this code.

pub(crate) mod accessor;
pub(crate) mod accessor_view;
pub(crate) mod buffers;
pub(crate) mod container;
pub(crate) mod extensions;
pub(crate) mod memory_allowance;
use std::io;
use std::path::Path;

use raycam_scene::{ErrorCode, SceneError};

use crate::error::{FormatError, Result};
use crate::gltf::document::buffers::Resources;
use crate::gltf::document::memory_allowance::MemoryAllowance;
use crate::gltf::json::Root;
use crate::gltf::json::lenient::Lenient;
use crate::io::InputFile;

/// Document and the bytes to which it refers.
pub(crate) struct Document<'a> {
    pub(crate) path: &'a Path,
    pub(crate) source: &'a InputFile,
    pub(crate) root: Root,
    pub(crate) resources: Resources<'a>,
    pub(crate) allowance: MemoryAllowance,
}

/// Text of an error about an index that does not exist in the list `part`.
pub(crate) fn describe_missing(part: &str, index: usize, count: usize) -> String {
    format!("{part}[{index}] does not exist; the length of {part} is {count} (UNRESOLVED_REFERENCE)")
}

impl Document<'_> {
    /// Error of this file; the message begins with the position in the document.
    pub(crate) fn fault(&self, code: ErrorCode, message: impl Into<String>) -> FormatError {
        FormatError::whole(self.path, code.message(message))
    }

    /// Charges `count` elements of `size` bytes at `place` to the allowance, before they are allocated.
    pub(crate) fn charge(&self, place: &str, count: u64, size: u64) -> Result<()> {
        self.allowance.charge(self.path, place, count, size)
    }

    /// Error for bytes that can no longer be read.
    pub(crate) fn read_error(&self, error: io::Error) -> FormatError {
        buffers::read_error(self.path, error)
    }

    /// Error about an index at the position `place` that does not exist in the list `part`.
    pub(crate) fn unresolved(&self, place: &str, part: &str, index: usize, count: usize) -> FormatError {
        let message = format!("{place}: {}", describe_missing(part, index, count));
        self.fault(ErrorCode::IndexOutOfRange, message)
    }

    /// Item of the list `part`; `place` is the position in the document at which its index is written.
    pub(crate) fn get<'b, T>(&self, all: &'b [T], index: usize, place: &str, part: &str) -> Result<&'b T> {
        all.get(index).ok_or_else(|| self.unresolved(place, part, index, all.len()))
    }

    /// Valid element of the list `part`; `place` is the position in the document at which its index is written.
    pub(crate) fn get_valid<'b, T>(
        &self,
        all: &'b [Lenient<T>],
        index: usize,
        place: &str,
        part: &str,
    ) -> Result<&'b T> {
        match self.get(all, index, place, part)? {
            Lenient::Valid(element) => Ok(element),
            Lenient::Faulty(fault) => {
                let message = format!("{part}[{index}]: {fault} (TYPE_MISMATCH)");
                Err(self.fault(ErrorCode::WrongType, message))
            }
        }
    }

    pub(crate) fn scene(&self, place: &str, source: SceneError) -> FormatError {
        self.fault(source.code(), format!("{place}: {source}"))
    }
}
