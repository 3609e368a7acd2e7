//! Pose of a camera in an OpenCV file whose rotation and translation are two keys with a direction, such as `R_wc` and
//! `t_wc`, or two keys named extrinsics, such as `camera_ext_R` and `camera_ext_t`.

use glam::DVec3;

use crate::document::lens_keys::plain;
use crate::opencv::key_view::KeyView;
use crate::opencv::pose;
use crate::quaternion_key::unknown_order_error;
use crate::{Pose, ReadHints};
use raycam_formats::Result;

/// Words for a translation in the keys of poses, next to a direction: `t_wc`, `position_c2w`.
pub(super) const TRANSLATIONS: [&str; 6] = ["translation", "trans", "position", "pos", "t", "p"];

/// A pose that is the value of two keys.
pub(super) struct DirectedPose<'a> {
    /// Keys of the rotation and the translation.
    pub(super) keys: Vec<&'a str>,
    pub(super) pose: Pose,
    /// True if the pose has a direction or axes that the caller specifies.
    pub(super) uses_hints: bool,
}

/// Finds a rotation and a translation whose keys end with the same direction (`R_wc` and `t_wc`), or begin with the same
/// word for extrinsics (`camera_ext_R` and `camera_ext_t`). The direction of extrinsics must be specified by the caller.
/// Returns `None` if the camera has a pose under other keys.
///
/// # Errors
/// An error for a rotation without a translation, for an unknown direction, and for a quaternion, because the order of
/// its numbers is unknown.
pub(super) fn read<'a>(view: &KeyView<'a>, hints: &ReadHints) -> Result<Option<DirectedPose<'a>>> {
    if pose::read_pose(view, hints.poses)?.is_some() || pose::read_mount(view)?.is_some() {
        return Ok(None);
    }
    let entries = view.at.entries()?;
    let find = |words: &[&str], counts: &[usize], end: Option<&str>| {
        entries.iter().filter(|(key, _)| !view.knows(key)).find_map(|(key, at)| {
            let rest = words.iter().find_map(|word| rest_of_key(key, word))?;
            let is_value = at.numbers().is_ok_and(|numbers| counts.contains(&numbers.len()));
            (is_value && end.is_none_or(|end| end == rest)).then(|| (*key, at.clone(), rest))
        })
    };
    let Some((key, at, end)) = find(&["rotation", "rot", "r"], &[3, 9], None) else {
        return match find(&["quaternion", "quat", "q"], &[4], None) {
            Some((key, at, _)) => Err(unknown_order_error(key, &at)),
            None => Ok(None),
        };
    };
    let Some((t_key, t_at, _)) = find(&TRANSLATIONS, &[3], Some(&end)) else {
        return Err(at.fail(
            "a rotation without a translation; add the translation under a similar key, such as t_wc for R_wc, or \
             camera_ext_t for camera_ext_R",
        ));
    };
    let stated = pose::world_from_camera(&format!("t{end}"));
    let convention = pose::convention_of_key(&at, stated, hints.poses, || pose::UNKNOWN_DIRECTION.into())?;
    let (r, t) = (pose::rotation(&at)?, DVec3::from_array(t_at.array::<3>()?));
    let found = convention.pose_of(r, t);
    Ok(Some(DirectedPose { keys: vec![key, t_key], pose: found, uses_hints: !hints.poses.is_empty() }))
}

/// Words for extrinsics in keys.
const EXTRINSICS: [&str; 5] = ["ext", "extr", "extrin", "extrinsic", "extrinsics"];

/// The rest of a key that consists of `word` and a direction (`R_wc`), or that ends with a word for extrinsics and `word`
/// (`camera_ext_R`).
fn rest_of_key(key: &str, word: &str) -> Option<String> {
    let name = plain(key);
    let directed = name.strip_prefix(word).filter(|end| pose::world_from_camera(&format!("t{end}")).is_some());
    let extrinsic = || name.strip_suffix(word).filter(|start| EXTRINSICS.iter().any(|end| start.ends_with(end)));
    directed.or_else(extrinsic).map(str::to_owned)
}
