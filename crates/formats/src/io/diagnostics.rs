//! Notices of a reader: each message once, with the first place that it is about and the number of further places.

use std::collections::HashMap;
use std::path::Path;

use crate::error::Location;

/// Different messages that are kept; further ones are only counted.
const MAX_NOTICES: usize = 1000;

/// Notices under collection.
#[derive(Debug, Default)]
pub(crate) struct Diagnostics {
    notices: Vec<Notice>,
    /// Index into `notices` by kind.
    known: HashMap<String, usize>,
    suppressed: usize,
}

#[derive(Debug)]
struct Notice {
    place: Place,
    message: String,
    more: usize,
}

/// The place of a notice in its file.
#[derive(Debug)]
pub(crate) enum Place {
    /// A line, a byte, or the file as a whole.
    Location(Location),
    /// A part by its name, as `materials[0].alphaMode`.
    Named(String),
}

impl From<Location> for Place {
    fn from(location: Location) -> Self {
        Self::Location(location)
    }
}

impl From<String> for Place {
    fn from(name: String) -> Self {
        Self::Named(name)
    }
}

impl From<&String> for Place {
    fn from(name: &String) -> Self {
        Self::Named(name.clone())
    }
}

impl From<&str> for Place {
    fn from(name: &str) -> Self {
        Self::Named(name.into())
    }
}

impl Diagnostics {
    /// Adds a notice about a place in the file.
    pub(crate) fn note(&mut self, place: impl Into<Place>, message: impl Into<String>) {
        let message = message.into();
        self.add(message.clone(), Notice { place: place.into(), message, more: 0 });
    }

    /// Adds a notice of a kind, of which the first is said and the others are counted.
    pub(crate) fn note_kind(&mut self, kind: &str, place: impl Into<Place>, message: impl Into<String>) {
        self.add(kind.into(), Notice { place: place.into(), message: message.into(), more: 0 });
    }

    /// Adds the notices of a later part of the file.
    pub(crate) fn append(&mut self, later: Self) {
        let mut kinds: Vec<_> = later.known.into_iter().collect();
        kinds.sort_unstable_by_key(|(_, notice)| *notice);
        for ((kind, _), notice) in kinds.into_iter().zip(later.notices) {
            self.add(kind, notice);
        }
        self.suppressed += later.suppressed;
    }

    fn add(&mut self, kind: String, notice: Notice) {
        if let Some(&known) = self.known.get(&kind) {
            self.notices[known].more += 1 + notice.more;
        } else if self.notices.len() == MAX_NOTICES {
            self.suppressed += 1 + notice.more;
        } else {
            self.known.insert(kind, self.notices.len());
            self.notices.push(notice);
        }
    }

    /// All notices, each with the name of the file in front.
    pub(crate) fn into_notices(self, path: &Path) -> Vec<String> {
        let path = path.display();
        let text = |Notice { place, message, more }| {
            let others = match more {
                0 => String::new(),
                _ => format!(" and {more} more"),
            };
            match place {
                Place::Location(location) => format!("{path}{location}{others}: {message}"),
                Place::Named(name) => format!("{path}: {name}{others}: {message}"),
            }
        };
        let mut notices: Vec<String> = self.notices.into_iter().map(text).collect();
        if self.suppressed > 0 {
            notices.push(format!("{path}: {} more notices are not kept", self.suppressed));
        }
        notices
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_said_once_and_not_without_end() {
        let path = Path::new("a.gltf");
        let mut diagnostics = Diagnostics::default();
        for i in 0..3 * MAX_NOTICES {
            diagnostics.note(format!("nodes[{i}]"), "odd");
            diagnostics.note("extensionsUsed", format!("{i} is unknown"));
        }
        let notices = diagnostics.into_notices(path);
        assert_eq!(notices.len(), MAX_NOTICES + 1);
        assert_eq!(notices[0], "a.gltf: nodes[0] and 2999 more: odd");
        assert_eq!(notices[MAX_NOTICES], "a.gltf: 2001 more notices are not kept");
    }

    #[test]
    fn parts_of_a_file_count_together() {
        let mut first = Diagnostics::default();
        first.note(Location::Line(3), "odd");
        first.note(Location::Line(4), "odd");
        let mut later = Diagnostics::default();
        later.note(Location::Line(7), "odd");
        later.note_kind("odd", Location::Line(8), "odder");
        later.note(Location::Whole, "even");
        first.append(later);
        assert_eq!(first.into_notices(Path::new("a.obj")), ["a.obj:3 and 3 more: odd", "a.obj: even"]);
    }
}
