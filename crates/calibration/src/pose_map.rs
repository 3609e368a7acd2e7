//! Poses as maps with a quaternion and a translation, such as the transforms of ROS.

use glam::DVec3;
use raycam_scene::counted;

use crate::Rotation;
use crate::document::Cursor;
use crate::quaternion_key::QuaternionKey;
use raycam_formats::Result;

const ROTATION: [&str; 7] = ["rotation", "orientation", "quaternion", "quat", "q", "r", "heading"];
/// Names of a quaternion's numbers w, x, y and z, in a map of other numbers.
pub(crate) const FLAT_QUATERNIONS: [[&str; 4]; 3] =
    [["qw", "qx", "qy", "qz"], ["q_w", "q_x", "q_y", "q_z"], ["rw", "rx", "ry", "rz"]];
/// Names of a quaternion's numbers w, x, y and z, in a map of its own.
pub(crate) const QUATERNION_MAPS: [[&str; 4]; 4] =
    [["w", "x", "y", "z"], ["qw", "qx", "qy", "qz"], ["W", "X", "Y", "Z"], ["real", "i", "j", "k"]];
/// Names of a translation's numbers.
pub(crate) const FLAT_TRANSLATIONS: [[&str; 3]; 5] =
    [["tx", "ty", "tz"], ["px", "py", "pz"], ["x", "y", "z"], ["t_x", "t_y", "t_z"], ["X", "Y", "Z"]];
const TRANSLATION: [&str; 6] = ["translation", "position", "trans", "t", "location", "xyz"];

/// Returns the values of a map under the first set of keys that is complete.
pub(crate) fn named<'a, const N: usize>(at: &Cursor<'a>, sets: &[[&str; N]]) -> Option<[Cursor<'a>; N]> {
    sets.iter().find_map(|set| {
        let found: Vec<Cursor<'a>> = set.iter().filter_map(|key| at.get(key)).collect();
        found.try_into().ok()
    })
}

/// Finds the components of the quaternion and of the translation in a map by their keys.
fn parts<'a>(at: &Cursor<'a>) -> Option<([Cursor<'a>; 4], Vec<Cursor<'a>>)> {
    let rotation = at.any(&ROTATION).and_then(|at| named(&at, &QUATERNION_MAPS));
    let rotation = rotation.or_else(|| named(at, &FLAT_QUATERNIONS)).or_else(|| in_stated_order(at))?;
    let translation = match at.any(&TRANSLATION) {
        Some(at) if at.is_map() => named(&at, &FLAT_TRANSLATIONS)?.to_vec(),
        Some(at) => at.list().ok()?,
        None => named(at, &FLAT_TRANSLATIONS)?.to_vec(),
    };
    Some((rotation, translation))
}

/// The numbers w, x, y and z of a quaternion whose key states their order.
fn in_stated_order<'a>(at: &Cursor<'a>) -> Option<[Cursor<'a>; 4]> {
    at.entries().ok()?.into_iter().find_map(|(key, at)| {
        let name = QuaternionKey::of(key).filter(|name| name.rest.is_empty())?;
        Some(name.arrange(at.list().ok()?.try_into().ok()?))
    })
}

/// True for a key that belongs to a pose map.
pub(crate) fn is_part(key: &str) -> bool {
    let flat = FLAT_QUATERNIONS.iter().flatten().chain(FLAT_TRANSLATIONS.iter().flatten());
    ["transform", "pose"].iter().chain(&ROTATION).chain(&TRANSLATION).chain(flat).any(|known| *known == key)
        || QuaternionKey::of(key).is_some_and(|name| name.rest.is_empty())
}

/// True for a pose map whose translation is named as a position: the camera's centre, in either direction.
pub(crate) fn has_center(at: &Cursor<'_>) -> bool {
    match at.any(&["transform", "pose"]).filter(|_| parts(at).is_none()) {
        Some(inner) => has_center(&inner),
        None => at.any(&TRANSLATION).is_some_and(|found| {
            ["position", "location"].iter().any(|name| at.get(name).is_some_and(|at| at.key == found.key))
        }),
    }
}

/// True for a map with a quaternion and a translation, such as the transforms of ROS.
pub(crate) fn is_pose_map(at: &Cursor<'_>) -> bool {
    at.is_map() && (parts(at).is_some() || at.any(&["transform", "pose"]).is_some_and(|at| is_pose_map(&at)))
}

/// Reads the transform of a pose map (see [`is_pose_map`]) as the first three rows of its matrix; `None` for
/// other values.
pub(crate) fn read(at: &Cursor<'_>) -> Result<Option<[f64; 12]>> {
    if !at.is_map() {
        return Ok(None);
    }
    let Some((rotation, translation)) = parts(at) else {
        return at.any(&["transform", "pose"]).map_or(Ok(None), |at| read(&at));
    };
    let mut quaternion = [0.0; 4];
    for (value, number) in quaternion.iter_mut().zip(&rotation) {
        *value = number.number()?;
    }
    let r = Rotation::unit_quaternion(quaternion).map_err(|message| at.fail(message))?.matrix().transpose();
    let [x, y, z] = &translation[..] else {
        return Err(at.fail(format_args!("a translation of {}; expected 3", counted(translation.len(), "number"))));
    };
    let t = DVec3::new(x.number()?, y.number()?, z.number()?);
    let row = |i: usize| {
        let axis = r.col(i);
        [axis.x, axis.y, axis.z, t[i]]
    };
    let rows = [row(0), row(1), row(2)].concat();
    Ok(Some(std::array::from_fn(|i| rows[i])))
}
