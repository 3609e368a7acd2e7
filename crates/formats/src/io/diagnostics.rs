//! A reader's notices in groups: each kind of notice occurs once, with its first three positions in the file and the
//! number of further positions.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use raycam_scene::{Notice, NoticeCode, counted};

use crate::error::Location;

/// Maximum number of different messages that are kept; further messages are only counted.
const MAX_NOTICES: usize = 1000;

/// Maximum number of positions that a notice lists.
const MAX_PLACES: usize = 3;

/// Notices being collected.
#[derive(Debug, Default)]
pub(crate) struct Diagnostics {
    groups: Vec<NoticeGroup>,
    /// Index into `groups` by kind.
    known: HashMap<(NoticeCode, String), usize>,
    suppressed: usize,
}

/// Notices of one kind, with the first notice's message.
#[derive(Debug)]
struct NoticeGroup {
    code: NoticeCode,
    message: String,
    /// The first [`MAX_PLACES`] positions.
    places: Vec<Place>,
    count: usize,
}

/// Position of a notice in its file.
#[derive(Debug)]
pub(crate) enum Place {
    /// A line, a byte, or the file as a whole.
    Location(Location),
    /// An element by its name, such as `materials[0].alphaMode`.
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

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Location(Location::Line(line)) => write!(f, "{line}"),
            Self::Location(Location::Byte(byte)) => write!(f, "byte {byte}"),
            Self::Location(Location::Whole) => f.write_str("file"),
            Self::Named(name) => f.write_str(name),
        }
    }
}

impl NoticeGroup {
    /// Creates a notice about these positions; the file's name precedes the first position.
    fn notice(self, path: &impl fmt::Display) -> Notice {
        let Self { code, message, places, count } = self;
        let joint = match &places[..] {
            [Place::Location(Location::Whole)] => return Notice::about(code, path.to_string(), message),
            [Place::Location(Location::Line(_)), ..] => ":",
            _ => ": ",
        };
        let mut subjects: Vec<String> = places.iter().map(Place::to_string).collect();
        if let Some(first) = subjects.first_mut() {
            *first = format!("{path}{joint}{first}");
        }
        Notice { code, message, subjects, count }
    }
}

impl Diagnostics {
    /// Adds a notice about a position in the file; notices with the same code and message are grouped.
    pub(crate) fn note(&mut self, code: NoticeCode, place: impl Into<Place>, message: impl Into<String>) {
        let message = message.into();
        self.note_kind(code, &message.clone(), place, message);
    }

    /// Adds a notice; notices with the same code and kind are grouped under the first message.
    pub(crate) fn note_kind(
        &mut self,
        code: NoticeCode,
        kind: &str,
        place: impl Into<Place>,
        message: impl Into<String>,
    ) {
        let group = NoticeGroup { code, message: message.into(), places: vec![place.into()], count: 1 };
        self.add((code, kind.into()), group);
    }

    /// Adds the notices of a later part of the file.
    pub(crate) fn append(&mut self, later: Self) {
        let mut kinds: Vec<_> = later.known.into_iter().collect();
        kinds.sort_unstable_by_key(|(_, group)| *group);
        for ((kind, _), group) in kinds.into_iter().zip(later.groups) {
            self.add(kind, group);
        }
        self.suppressed += later.suppressed;
    }

    fn add(&mut self, kind: (NoticeCode, String), group: NoticeGroup) {
        if let Some(&known) = self.known.get(&kind) {
            let known = &mut self.groups[known];
            let left = MAX_PLACES - known.places.len();
            known.places.extend(group.places.into_iter().take(left));
            known.count += group.count;
        } else if self.groups.len() == MAX_NOTICES {
            self.suppressed += group.count;
        } else {
            self.known.insert(kind, self.groups.len());
            self.groups.push(group);
        }
    }

    /// All notices, each with the file's name in front.
    pub(crate) fn into_notices(self, path: &Path) -> Vec<Notice> {
        let path = path.display();
        let mut notices: Vec<Notice> = self.groups.into_iter().map(|group| group.notice(&path)).collect();
        if self.suppressed > 0 {
            let message = format!("{path}: {} not listed", counted(self.suppressed, "further notice"));
            notices.push(Notice::new(NoticeCode::MoreNotices, message));
        }
        notices
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(diagnostics: Diagnostics, path: &str) -> Vec<String> {
        diagnostics.into_notices(Path::new(path)).into_iter().map(|notice| notice.to_string()).collect()
    }

    #[test]
    fn equal_notices_are_grouped_up_to_a_limit() {
        let mut diagnostics = Diagnostics::default();
        for i in 0..3 * MAX_NOTICES {
            diagnostics.note(NoticeCode::InvalidFile, format!("nodes[{i}]"), "odd");
            diagnostics.note(NoticeCode::IgnoredFeature, "extensionsUsed", format!("{i} is unknown"));
        }
        let notices = messages(diagnostics, "a.gltf");
        assert_eq!(notices.len(), MAX_NOTICES + 1);
        assert_eq!(notices[0], "a.gltf: nodes[0], nodes[1], nodes[2] and 2997 more: odd");
        assert_eq!(notices[MAX_NOTICES], "a.gltf: 2001 further notices not listed");
    }

    #[test]
    fn notices_of_the_parts_of_a_file_are_grouped_together() {
        let code = NoticeCode::InvalidFile;
        let mut first = Diagnostics::default();
        first.note(code, Location::Line(3), "odd");
        first.note(code, Location::Line(4), "odd");
        let mut later = Diagnostics::default();
        later.note(code, Location::Line(7), "odd");
        later.note_kind(code, "odd", Location::Line(8), "odder");
        later.note(code, Location::Whole, "even");
        later.note(NoticeCode::IgnoredKey, Location::Line(9), "odd");
        first.append(later);
        assert_eq!(messages(first, "a.obj"), ["a.obj:3, 4, 7 and 1 more: odd", "a.obj: even", "a.obj:9: odd"]);
    }
}
