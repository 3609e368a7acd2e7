//! Poses as maps with a quaternion and a translation, such as the transforms of ROS.

use glam::DVec3;
use raycam_scene::counted;

use crate::Rotation;
use crate::document::Cursor;
use raycam_formats::Result;

const ROTATION: [&str; 6] = ["rotation", "orientation", "quaternion", "quat", "q", "r"];
const TRANSLATION: [&str; 6] = ["translation", "position", "trans", "t", "location", "xyz"];

/// Returns the values of a map under the first set of keys that is complete.
fn named<'a, const N: usize>(at: &Cursor<'a>, sets: &[[&str; N]]) -> Option<[Cursor<'a>; N]> {
    sets.iter().find_map(|set| {
        let found: Vec<Cursor<'a>> = set.iter().filter_map(|key| at.get(key)).collect();
        found.try_into().ok()
    })
}

/// Finds the components of the quaternion and of the translation in a map by their keys.
fn parts<'a>(at: &Cursor<'a>) -> Option<([Cursor<'a>; 4], Vec<Cursor<'a>>)> {
    let flat = [["qw", "qx", "qy", "qz"], ["q_w", "q_x", "q_y", "q_z"], ["rw", "rx", "ry", "rz"]];
    let names = [["w", "x", "y", "z"], flat[0]];
    let rotation = at.any(&ROTATION).and_then(|at| named(&at, &names)).or_else(|| named(at, &flat))?;
    let flat = [["tx", "ty", "tz"], ["px", "py", "pz"], ["x", "y", "z"], ["t_x", "t_y", "t_z"]];
    let translation = match at.any(&TRANSLATION) {
        Some(at) if at.is_map() => named(&at, &flat)?.to_vec(),
        Some(at) => at.list().ok()?,
        None => named(at, &flat)?.to_vec(),
    };
    Some((rotation, translation))
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
