//! What reading a glTF file has to say, and how much memory it may still take.

use std::collections::HashMap;
use std::path::Path;

use crate::error::FormatError;
use crate::io::asset_root::Folder;

/// Bytes that decoded geometry may take on top of 16 times those of the file; with those that it is decoded from, they
/// are 64 MiB.
const BASE_ALLOWANCE: u64 = 48 << 20;
/// More different messages are counted, and not kept.
const MOST_NOTICES: usize = 1000;

/// Notices, each message once with its first place; and the memory left.
pub(crate) struct Ledger {
    notices: Vec<Notice>,
    /// Where in `notices` each message is.
    known: HashMap<String, usize>,
    unsaid: usize,
    left: u64,
}

struct Notice {
    place: String,
    message: String,
    more: usize,
}

impl Ledger {
    pub(crate) fn new() -> Self {
        Self {
            notices: Vec::new(),
            known: HashMap::new(),
            unsaid: 0,
            left: BASE_ALLOWANCE,
        }
    }

    /// So many bytes were read: what they hold may take 16 times as many.
    pub(crate) fn grant(&mut self, bytes: usize) {
        self.left = self.left.saturating_add(16 * bytes as u64);
    }

    /// Takes memory for something about to be decoded.
    pub(crate) fn take(
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
    pub(crate) fn note(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let message = message.into();
        if let Some(&notice) = self.known.get(&message) {
            self.notices[notice].more += 1;
        } else if self.notices.len() == MOST_NOTICES {
            self.unsaid += 1;
        } else {
            self.known.insert(message.clone(), self.notices.len());
            self.notices.push(Notice {
                place: place.into(),
                message,
                more: 0,
            });
        }
    }

    /// Everything said, with the file's name.
    pub(crate) fn into_notices(self, path: &Path, folder: &mut Folder) -> Vec<String> {
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
        if self.unsaid > 0 {
            notices.push(format!(
                "{}: {} more notices are not kept",
                path.display(),
                self.unsaid
            ));
        }
        notices
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;

    #[test]
    fn messages_are_said_once_and_not_without_end() {
        let path = Path::new("a.gltf");
        let mut ledger = Ledger::new();
        for i in 0..3 * MOST_NOTICES {
            ledger.note(format!("nodes[{i}]"), "odd");
            ledger.note("extensionsUsed", format!("{i} is unknown"));
        }
        let mut folder = Folder::around(path, &Budget::default());
        let notices = ledger.into_notices(path, &mut folder);
        assert_eq!(notices.len(), MOST_NOTICES + 1);
        assert_eq!(notices[0], "a.gltf: nodes[0] and 2999 more: odd");
        assert_eq!(
            notices[MOST_NOTICES],
            "a.gltf: 2001 more notices are not kept"
        );
    }
}
