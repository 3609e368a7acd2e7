//! Names of the units of length in keys, in columns, and under keys such as `units`.

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
    (
        LengthUnit::Micrometre,
        &["um", "\u{b5}m", "\u{3bc}m", "micron", "microns", "micrometer", "micrometers", "micrometre", "micrometres"],
    ),
    (LengthUnit::Kilometre, &["km", "kilometer", "kilometers", "kilometre", "kilometres"]),
    (LengthUnit::Inch, &["inch", "inches"]),
    (LengthUnit::Foot, &["ft", "foot", "feet"]),
];

/// True for the micro sign and for the Greek letter mu, which look alike.
pub(crate) fn is_micro_sign(c: char) -> bool {
    matches!(c, '\u{b5}' | '\u{3bc}')
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_belongs_to_one_unit() {
        let names: Vec<&str> = NAMES.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        for name in &names {
            assert_eq!(names.iter().filter(|other| *other == name).count(), 1, "{name}");
        }
        assert_eq!(LengthUnit::from_name("mm"), Some(LengthUnit::Millimetre));
        assert_eq!(LengthUnit::from_name("px"), None);
    }
}
