//! Keys of quaternions that state the order of their four numbers: `quaternion_wxyz`, `q_xyzw`, `orientation (w, x, y,
//! z)`, `rotation_scalar_last`.

use crate::document::Cursor;
use raycam_formats::FormatError;

/// Words for the order, in keys without punctuation; true for w first. Longer words precede their parts.
const ORDERS: [(&str, bool); 14] = [
    ("qwqxqyqz", true),
    ("qxqyqzqw", false),
    ("scalarfirst", true),
    ("scalarlast", false),
    ("realfirst", true),
    ("reallast", false),
    ("wfirst", true),
    ("wlast", false),
    ("qrijk", true),
    ("qijkr", false),
    ("wijk", true),
    ("ijkw", false),
    ("wxyz", true),
    ("xyzw", false),
];
/// Words for a rotation. Longer words precede their parts.
const ROTATIONS: [&str; 14] = [
    "quaternionrotation",
    "rotationquaternion",
    "orientationquaternion",
    "quaternions",
    "quaternion",
    "rotationquat",
    "orientationquat",
    "orientation",
    "rotation",
    "attitude",
    "qvec",
    "quat",
    "rot",
    "q",
];

/// Meaning of a quaternion's key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct QuaternionKey {
    pub(crate) w_first: bool,
    /// The key without the order and without the word for a rotation, for example a direction such as `c2w`.
    pub(crate) rest: String,
}

impl QuaternionKey {
    /// Returns the meaning of a key; `None` if the key states no order or contains no word for a rotation.
    pub(crate) fn of(key: &str) -> Option<Self> {
        let name: String = key.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
        let (word, w_first) = ORDERS.iter().find(|(word, _)| name.contains(word))?;
        let name = name.replacen(word, "", 1);
        let strip = |word: &&str| name.strip_prefix(word).or_else(|| name.strip_suffix(word));
        let rest = ROTATIONS.iter().find_map(strip).or_else(|| name.is_empty().then_some(""))?;
        Some(Self { w_first: *w_first, rest: rest.to_owned() })
    }

    /// Returns four values in the stated order as w, x, y, z.
    pub(crate) fn arrange<T>(&self, [a, b, c, d]: [T; 4]) -> [T; 4] {
        if self.w_first { [a, b, c, d] } else { [d, a, b, c] }
    }
}

/// Returns the error about a quaternion whose order is unknown, with the two names that would state the order.
pub(crate) fn unknown_order_error(key: &str, at: &Cursor<'_>) -> FormatError {
    at.fail(format_args!(
        "a quaternion whose order is not specified; rename the key to {key}_wxyz if the first number is the real part, or \
         to {key}_xyzw if the last number is the real part"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_in_a_key_determines_the_position_of_w() {
        let order = |key: &str| QuaternionKey::of(key).map(|found| (found.w_first, found.rest));
        for key in ["quaternion_wxyz", "qWXYZ", "wxyz", "orientation (w, x, y, z)", "qw_qx_qy_qz", "rot_scalar_first"] {
            assert_eq!(order(key), Some((true, String::new())), "{key}");
        }
        for key in ["quat-xyzw", "rotationQuaternionXyzw", "attitude_real_last", "qvec_w_last"] {
            assert_eq!(order(key), Some((false, String::new())), "{key}");
        }
        assert_eq!(order("c2w_quat_xyzw"), Some((false, "c2w".into())));
        assert_eq!(order("quaternion_wxyz_w2c"), Some((true, "w2c".into())));
        for key in ["quaternion", "position_xyzw", "color_wxyz"] {
            assert_eq!(order(key), None, "{key}");
        }
    }

    #[test]
    fn arranged_quaternion_begins_with_w() {
        let arrange = |key: &str| QuaternionKey::of(key).unwrap().arrange([1.0, 2.0, 3.0, 4.0]);
        assert_eq!(arrange("q_wxyz"), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(arrange("q_xyzw"), [4.0, 1.0, 2.0, 3.0]);
    }
}
