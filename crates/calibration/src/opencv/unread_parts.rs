//! Parts of a pose under keys that no reader recognises, which would otherwise be lost.

use crate::document::lens_keys::plain;
use crate::opencv::key_view::KeyView;
use raycam_formats::Result;

/// Words in the keys of rotations and of positions.
const ROTATIONS: [&str; 4] = ["quat", "orient", "rotation", "attitude"];
const POSITIONS: [&str; 4] = ["position", "translation", "location", "center"];

/// Rejects a rotation next to a position under keys that are not recognised, such as `quaternion_world` and
/// `position_world_m`. A rotation or a position alone may belong to something else.
///
/// # Errors
/// An error that names both keys.
pub(super) fn refuse_pose(view: &KeyView<'_>) -> Result<()> {
    let entries = view.at.entries().unwrap_or_default();
    let find = |words: &[&str], counts: &[usize]| {
        entries.iter().find(|(key, at)| {
            let name = plain(key);
            let fits =
                at.numbers().is_ok_and(|numbers| counts.contains(&numbers.len()) && numbers.iter().any(|v| *v != 0.0));
            !view.knows(key) && words.iter().any(|word| name.contains(word)) && fits
        })
    };
    let (Some((_, rotation)), Some((place, _))) = (find(&ROTATIONS, &[4, 9]), find(&POSITIONS, &[3])) else {
        return Ok(());
    };
    Err(rotation.fail(format_args!(
        "a rotation next to {place}, in unknown keys; write the pose as a 4x4 matrix under w2c or c2w, or as \
         c2w_quaternion_wxyz (or c2w_quaternion_xyzw) and position"
    )))
}
