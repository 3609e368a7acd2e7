//! Memory that decoding may use, in proportion to the bytes read.

use raycam_scene::ErrorCode;
use std::cell::Cell;
use std::path::Path;

use crate::error::{FormatError, Result};

/// Bytes that decoded geometry may use for a file of any size; each byte of the file adds [`BYTES_PER_INPUT_BYTE`].
const BASE_ALLOWANCE: u64 = 48 << 20;
const BYTES_PER_INPUT_BYTE: u64 = 16;

/// Bytes that may still be allocated for decoded data.
pub(crate) struct MemoryAllowance(Cell<u64>);

impl Default for MemoryAllowance {
    fn default() -> Self {
        Self(Cell::new(BASE_ALLOWANCE))
    }
}

impl MemoryAllowance {
    /// Raises the allowance for `bytes` of input.
    pub(crate) fn grant(&self, bytes: usize) {
        self.0.set(self.0.get().saturating_add(BYTES_PER_INPUT_BYTE * bytes as u64));
    }

    /// Charges `count` elements of `size` bytes, before they are allocated. `place` is the position in the document for
    /// the error.
    pub(crate) fn charge(&self, path: &Path, place: &str, count: u64, size: u64) -> Result<()> {
        let (bytes, left) = (count.saturating_mul(size), self.0.get());
        let Some(rest) = left.checked_sub(bytes) else {
            let message = format!(
                "{place}: decoding requires {bytes} bytes, but a file of this size may use only \
                {left} more"
            );
            return Err(FormatError::whole(path, ErrorCode::ImplausibleSize.message(message)));
        };
        self.0.set(rest);
        Ok(())
    }
}
