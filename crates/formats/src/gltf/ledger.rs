//! What reading a glTF file has to say, and how much memory it may still take.

use std::path::Path;

use crate::error::FormatError;
use crate::folder::Folder;

/// Bytes that decoded geometry may take on top of 16 times those of the file.
const BASE_ALLOWANCE: u64 = 64 << 20;

/// Notices, each message once with its first place; and the memory left.
pub(super) struct Ledger {
    notices: Vec<Notice>,
    left: u64,
}

struct Notice {
    place: String,
    message: String,
    more: usize,
}

impl Ledger {
    pub(super) fn new() -> Self {
        Self {
            notices: Vec::new(),
            left: BASE_ALLOWANCE,
        }
    }

    /// So many bytes were read: what they hold may take 16 times as many.
    pub(super) fn grant(&mut self, bytes: usize) {
        self.left = self.left.saturating_add(16 * bytes as u64);
    }

    /// Takes memory for something about to be decoded.
    pub(super) fn take(
        &mut self,
        path: &Path,
        place: &str,
        count: u64,
        size: u64,
    ) -> Result<(), FormatError> {
        let bytes = count.saturating_mul(size);
        match self.left.checked_sub(bytes) {
            Some(left) => self.left = left,
            None => {
                let message = format!(
                    "{place}: {bytes} bytes to decode, {} of which are left to so short a file",
                    self.left
                );
                return Err(FormatError::whole(path, message));
            }
        }
        Ok(())
    }

    /// Says something about a place in the document.
    pub(super) fn note(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let message = message.into();
        match self.notices.iter_mut().find(|n| n.message == message) {
            Some(notice) => notice.more += 1,
            None => self.notices.push(Notice {
                place: place.into(),
                message,
                more: 0,
            }),
        }
    }

    /// Everything said, with the file's name.
    pub(super) fn into_notices(self, path: &Path, folder: &mut Folder) -> Vec<String> {
        let mut notices = folder.take_notices();
        notices.extend(self.notices.into_iter().map(|notice| {
            let Notice {
                place,
                message,
                more,
            } = notice;
            let others = match more {
                0 => String::new(),
                _ => format!(" and {more} more"),
            };
            format!("{}: {place}{others}: {message}", path.display())
        }));
        notices
    }
}
