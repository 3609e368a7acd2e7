//! Notices of an import, each message once with the first place that it is about.

use std::collections::HashMap;
use std::path::Path;

use crate::io::asset_root::AssetRoot;

/// Different messages that are kept; further ones are only counted.
const MAX_NOTICES: usize = 1000;

/// Notices under collection.
#[derive(Default)]
pub(crate) struct Diagnostics {
    notices: Vec<Notice>,
    /// Index into `notices` by message.
    known: HashMap<String, usize>,
    suppressed: usize,
}

struct Notice {
    place: String,
    message: String,
    more: usize,
}

impl Diagnostics {
    /// Adds a notice about a place in the document.
    pub(crate) fn note(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let message = message.into();
        if let Some(&notice) = self.known.get(&message) {
            self.notices[notice].more += 1;
        } else if self.notices.len() == MAX_NOTICES {
            self.suppressed += 1;
        } else {
            self.known.insert(message.clone(), self.notices.len());
            self.notices.push(Notice { place: place.into(), message, more: 0 });
        }
    }

    /// All notices with the name of the file, after those of the images.
    pub(crate) fn into_notices(self, path: &Path, assets: &mut AssetRoot) -> Vec<String> {
        let mut notices = assets.drain_notices();
        notices.extend(self.notices.into_iter().map(|notice| {
            let Notice { place, message, more } = notice;
            let others = match more {
                0 => String::new(),
                _ => format!(" and {more} more"),
            };
            format!("{}: {place}{others}: {message}", path.display())
        }));
        if self.suppressed > 0 {
            notices.push(format!("{}: {} more notices are not kept", path.display(), self.suppressed));
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
        let mut diagnostics = Diagnostics::default();
        for i in 0..3 * MAX_NOTICES {
            diagnostics.note(format!("nodes[{i}]"), "odd");
            diagnostics.note("extensionsUsed", format!("{i} is unknown"));
        }
        let mut assets = AssetRoot::containing(path, &Budget::default());
        let notices = diagnostics.into_notices(path, &mut assets);
        assert_eq!(notices.len(), MAX_NOTICES + 1);
        assert_eq!(notices[0], "a.gltf: nodes[0] and 2999 more: odd");
        assert_eq!(notices[MAX_NOTICES], "a.gltf: 2001 more notices are not kept");
    }
}
