//! Units of length in keys, in the names of columns, and under keys such as `units`.

use raycam_scene::{Notice, NoticeCode};

use crate::document::Cursor;
use crate::document::lens_keys::plain;

/// Unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LengthUnit {
    Metre,
    Centimetre,
    Millimetre,
    Micrometre,
    Kilometre,
    Inch,
    Foot,
}

/// Names of the units, in lower case.
const NAMES: [(LengthUnit, &[&str]); 7] = [
    (LengthUnit::Metre, &["m", "meter", "meters", "metre", "metres"]),
    (LengthUnit::Centimetre, &["cm", "centimeter", "centimeters", "centimetre", "centimetres"]),
    (LengthUnit::Millimetre, &["mm", "millimeter", "millimeters", "millimetre", "millimetres"]),
    (LengthUnit::Micrometre, &["um", "\u{b5}m", "micron", "microns", "micrometer", "micrometers", "micrometres"]),
    (LengthUnit::Kilometre, &["km", "kilometer", "kilometers", "kilometre", "kilometres"]),
    (LengthUnit::Inch, &["inch", "inches"]),
    (LengthUnit::Foot, &["ft", "foot", "feet"]),
];

impl LengthUnit {
    /// The unit with this name, in lower case.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        NAMES.iter().find(|(_, names)| names.contains(&name)).map(|(unit, _)| *unit)
    }

    /// The unit's symbol or name for messages; `None` for metres.
    pub(crate) fn other_than_metres(self) -> Option<&'static str> {
        match self {
            Self::Metre => None,
            Self::Centimetre => Some("cm"),
            Self::Millimetre => Some("mm"),
            Self::Micrometre => Some("\u{b5}m"),
            Self::Kilometre => Some("km"),
            Self::Inch => Some("inches"),
            Self::Foot => Some("feet"),
        }
    }
}

/// Returns the unit of length that a key such as `units` or `length_unit` specifies for other values; `None` for other
/// keys and values.
pub(crate) fn stated_by(key: &str, at: &Cursor<'_>) -> Option<LengthUnit> {
    let key = plain(key);
    if !(key.ends_with("unit") || key.ends_with("units")) {
        return None;
    }
    LengthUnit::from_name(&plain(at.word().ok()?))
}

/// Returns the notice about a key that is not read, which `subject` names; `None` if the key specifies metres, which are
/// raycam's unit.
pub(crate) fn notice_of_unread_key(key: &str, at: &Cursor<'_>, subject: String) -> Option<Notice> {
    let Some(unit) = stated_by(key, at) else { return Some(Notice::about(NoticeCode::IgnoredKey, subject, "ignored")) };
    let message =
        format!("the key specifies lengths in {}; they are not converted to metres", unit.other_than_metres()?);
    Some(Notice::about(NoticeCode::PlacedCameras, subject, message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{DocumentNode, Value};
    use std::path::Path;

    #[test]
    fn every_name_belongs_to_one_unit() {
        let names: Vec<&str> = NAMES.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        for name in &names {
            assert_eq!(names.iter().filter(|other| *other == name).count(), 1, "{name}");
        }
        assert_eq!(LengthUnit::from_name("mm"), Some(LengthUnit::Millimetre));
        assert_eq!(LengthUnit::from_name("px"), None);
    }

    #[test]
    fn unit_counts_only_under_a_key_of_units() {
        let node = DocumentNode { value: Value::Scalar("Millimeters".into()), line: 1 };
        let at = Cursor::root(&node, Path::new("a"));
        assert_eq!(stated_by("length_unit", &at), Some(LengthUnit::Millimetre));
        assert_eq!(stated_by("T.units", &at), Some(LengthUnit::Millimetre));
        assert_eq!(stated_by("name", &at), None);
    }
}
