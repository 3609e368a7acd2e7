//! Order of a quaternion's numbers, as stated in the prose of a trajectory's comments: "quaternion as (w, x, y, z)",
//! "scalar last", "wxyz".

/// Order of the numbers in a row that contains a position and a quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StatedOrder {
    pub(crate) w_first: bool,
    /// True if the prose mentions the quaternion before the position.
    pub(crate) quaternion_first: bool,
}

const ROTATION_WORDS: [&str; 7] =
    ["quaternion", "quaternions", "quat", "orientation", "rotation", "attitude", "hamilton"];
const POSITION_WORDS: [&str; 8] =
    ["position", "positions", "translation", "translations", "location", "xyz", "tx", "px"];
/// Names of the quaternion's real part.
const REAL_WORDS: [&str; 4] = ["scalar", "real", "w", "qw"];

/// Returns the order that the prose states; `None` if it states no order.
///
/// # Errors
/// The reason if the prose states both orders.
pub(crate) fn stated_order(prose: &str) -> Option<Result<StatedOrder, String>> {
    let lower = prose.to_lowercase();
    let words: Vec<&str> = lower.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let place = |known: &[&str]| words.iter().position(|word| known.contains(word));
    let rotation = place(&ROTATION_WORDS);
    let mut orders = (0..words.len()).filter_map(|i| order_at(&words[i..], rotation.is_some_and(|at| at <= i)));
    let w_first = orders.next()?;
    if orders.any(|other| other != w_first) {
        return Some(Err(
            "the comments state both orders of the quaternion, w first and w last; name the columns in a \
             header: # timestamp tx ty tz qx qy qz qw"
                .into(),
        ));
    }
    let quaternion_first = rotation.is_some_and(|at| place(&POSITION_WORDS).is_some_and(|position| at < position));
    Some(Ok(StatedOrder { w_first, quaternion_first }))
}

/// The order that the first of `words` state: true for w first, false for w last, `None` for no order. Single letters
/// count only after a word for the rotation, because they may be the coordinates of a position.
fn order_at(words: &[&str], after_rotation: bool) -> Option<bool> {
    match words {
        ["wxyz" | "qwxyz", ..] | ["qw", "qx", "qy", "qz", ..] => Some(true),
        ["xyzw" | "qxyzw", ..] | ["qx", "qy", "qz", "qw", ..] => Some(false),
        ["w", "x", "y", "z", ..] if after_rotation => Some(true),
        ["x", "y", "z", "w", ..] if after_rotation => Some(false),
        [real, "part" | "component" | "is", end, ..] | [real, end, ..] if REAL_WORDS.contains(real) => match *end {
            "first" => Some(true),
            "last" => Some(false),
            _ => None,
        },
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stated_order_of_prose_is_the_order_of_w() {
        let w_first = |text: &str| stated_order(text).map(|order| order.map(|order| order.w_first));
        assert_eq!(w_first("time, position x y z, quaternion as w x y z"), Some(Ok(true)));
        assert_eq!(w_first("Quaternions are scalar-last"), Some(Ok(false)));
        assert_eq!(w_first("orientation (real part first)"), Some(Ok(true)));
        assert_eq!(w_first("positions x y z and w"), None);
        assert!(w_first("quaternion wxyz, scalar last").is_some_and(|order| order.is_err()));
    }

    #[test]
    fn stated_order_with_the_quaternion_before_the_position_is_quaternion_first() {
        let first = |text: &str| stated_order(text).map(|order| order.map(|order| order.quaternion_first));
        assert_eq!(first("time, quaternion (scalar first), translation"), Some(Ok(true)));
        assert_eq!(first("time, translation, quaternion (scalar first)"), Some(Ok(false)));
    }
}
