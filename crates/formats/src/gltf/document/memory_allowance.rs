//! Memory that decoding may take, in proportion to the bytes that were read.

use std::path::Path;

use crate::error::{FormatError, Result};

/// Bytes that decoded geometry may take on top of [`BYTES_PER_INPUT_BYTE`] for each byte of the file; with the bytes that
/// it is decoded from, they are 64 MiB.
const BASE_ALLOWANCE: u64 = 48 << 20;
const BYTES_PER_INPUT_BYTE: u64 = 16;

/// Bytes that may still be allocated for decoded data.
pub(crate) struct MemoryAllowance(u64);

impl Default for MemoryAllowance {
    fn default() -> Self {
        Self(BASE_ALLOWANCE)
    }
}

impl MemoryAllowance {
    /// Raises the allowance for `bytes` of input.
    pub(crate) fn grant(&mut self, bytes: usize) {
        self.0 = self.0.saturating_add(BYTES_PER_INPUT_BYTE * bytes as u64);
    }

    /// Charges `count` elements of `size` bytes, before they are allocated. `place` names them in the error.
    pub(crate) fn charge(&mut self, path: &Path, place: &str, count: u64, size: u64) -> Result<()> {
        let bytes = count.saturating_mul(size);
        match self.0.checked_sub(bytes) {
            Some(left) => self.0 = left,
            None => {
                let message =
                    format!("{place}: {bytes} bytes to decode, {} of which are left to so short a file", self.0);
                return Err(FormatError::whole(path, message));
            }
        }
        Ok(())
    }
}
