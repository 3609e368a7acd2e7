//! Pose of a camera in an OpenCV file whose rotation is a quaternion, under a key that states the order of the numbers
//! (see [`QuaternionKey`]) or with named numbers, next to a position or a translation.

use glam::DVec3;

use crate::document::Cursor;
use crate::document::lens_keys::plain;
use crate::opencv::directed_pose::{DirectedPose, TRANSLATIONS};
use crate::opencv::key_view::KeyView;
use crate::opencv::keys::{self, CENTER, POSITION};
use crate::opencv::pose;
use crate::quaternion_key::QuaternionKey;
use crate::{ReadHints, Rotation, pose_map};
use raycam_formats::Result;

/// Keys of maps with the named numbers of a quaternion.
const MAPS: [&str; 9] = ["rotation", "rot", "r", "orientation", "quaternion", "quat", "q", "attitude", "heading"];

/// A quaternion, as found in a map.
struct FoundQuaternion<'a> {
    keys: Vec<&'a str>,
    at: Cursor<'a>,
    wxyz: [f64; 4],
    /// Words for the direction in the key; empty if the key contains none.
    direction: String,
}

/// A position or a translation, as found in a map.
struct FoundPlace<'a> {
    keys: Vec<&'a str>,
    xyz: [f64; 3],
    /// True for the camera's centre in the world, false for the translation of a transform.
    is_center: bool,
    /// True for OpenCV's `tvec`, which belongs to a transform camera_from_world.
    is_tvec: bool,
}

/// Finds a quaternion next to a position or a translation; `None` if one of them is missing, and for a rotation in
/// another form.
///
/// # Errors
/// An error for a quaternion whose direction is neither stated by its key nor specified by the caller.
pub(super) fn read<'a>(view: &KeyView<'a>, hints: &ReadHints) -> Result<Option<DirectedPose<'a>>> {
    let other = |names: &[&str]| view.all(names).iter().any(|at| matches!(at.numbers().map(|n| n.len()), Ok(3 | 9)));
    if other(&keys::R) || other(&keys::RVEC) {
        return Ok(None);
    }
    let Some(quaternion) = find_quaternion(view)? else { return Ok(None) };
    let Some(place) = find_place(view, &quaternion)? else { return Ok(None) };
    let stated = pose::world_from_camera(&format!("t{}", quaternion.direction)).or(place.is_tvec.then_some(false));
    let at = &quaternion.at;
    let convention = pose::convention_of_key(at, stated, hints.poses, || unknown_direction(&quaternion, &place))?;
    let rotation = Rotation::unit_quaternion(quaternion.wxyz).map_err(|message| at.fail(message))?;
    let (r, xyz) = (rotation.matrix(), DVec3::from_array(place.xyz));
    let found = if place.is_center { convention.pose_at(r, xyz) } else { convention.pose_of(r, xyz) };
    let keys = [quaternion.keys, place.keys].concat();
    Ok(Some(DirectedPose { keys, pose: found, uses_hints: !hints.poses.is_empty() }))
}

/// Text of the error about an unknown direction.
fn unknown_direction(quaternion: &FoundQuaternion<'_>, place: &FoundPlace<'_>) -> String {
    let remedy = match &quaternion.keys[..] {
        [key] if !keys::is_keyed(&quaternion.at) => format!(", or rename the key to c2w_{key} or w2c_{key}"),
        _ => String::new(),
    };
    format!(
        "a quaternion of unknown direction next to {}; specify it (direction=\"world_from_camera\" or \
         \"camera_from_world\", --direction){remedy}",
        place.keys.join(" ")
    )
}

/// Finds the quaternion of a camera; several quaternions must be the same rotation.
fn find_quaternion<'a>(view: &KeyView<'a>) -> Result<Option<FoundQuaternion<'a>>> {
    let mut found: Option<FoundQuaternion<'a>> = None;
    for (key, at) in view.at.entries()?.into_iter().filter(|(_, at)| !at.is_null()) {
        let Some(other) = view.base(key).iter().find_map(|base| quaternion_of(key, base, &at)) else { continue };
        if let Some(first) = &mut found {
            let dot = |a: [f64; 4], b: [f64; 4]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (a, b) = (first.wxyz, other.wxyz);
            if dot(a, b).powi(2) < (1.0 - 1e-6) * dot(a, a) * dot(b, b) {
                return Err(
                    at.fail(format_args!("{} contains a different rotation; remove one of the two keys", first.at.key))
                );
            }
            first.keys.extend(other.keys);
            continue;
        }
        found = Some(other);
    }
    if found.is_none()
        && view.side.is_empty()
        && let Some(four) = pose_map::named(&view.at, &pose_map::FLAT_QUATERNIONS)
    {
        let [w, x, y, z] = [0, 1, 2, 3].map(|i| four[i].number());
        let keys = view.at.entries()?.into_iter().filter(|(_, at)| four.iter().any(|own| own.key == at.key));
        let keys = keys.map(|(key, _)| key).collect();
        found = Some(FoundQuaternion { keys, at: view.at.clone(), wxyz: [w?, x?, y?, z?], direction: String::new() });
    }
    Ok(found)
}

/// The quaternion of an entry, whose key without the camera's marker is `base`.
fn quaternion_of<'a>(key: &'a str, base: &str, at: &Cursor<'a>) -> Option<FoundQuaternion<'a>> {
    let (wxyz, direction) = if keys::is_keyed(at) {
        if !MAPS.contains(&base) {
            return None;
        }
        let four = pose_map::named(at, &pose_map::QUATERNION_MAPS)?;
        let [w, x, y, z] = [0, 1, 2, 3].map(|i| four[i].number().ok());
        ([w?, x?, y?, z?], String::new())
    } else {
        let name = QuaternionKey::of(base)?;
        (name.arrange(at.array::<4>().ok()?), name.rest)
    };
    let is_own = direction.is_empty() || pose::world_from_camera(&format!("t{direction}")).is_some();
    is_own.then(|| FoundQuaternion { keys: vec![key], at: at.clone(), wxyz, direction })
}

/// Finds the position or the translation next to a quaternion.
fn find_place<'a>(view: &KeyView<'a>, quaternion: &FoundQuaternion<'a>) -> Result<Option<FoundPlace<'a>>> {
    let direction = &quaternion.direction;
    let mut found: Option<FoundPlace<'a>> = None;
    for (key, at) in view.at.entries()?.into_iter().filter(|(_, at)| !at.is_null()) {
        let is_center = view.has_name(key, &CENTER) || view.has_name(key, &POSITION);
        let is_tvec = view.has_name(key, &keys::TVEC);
        let name = plain(key);
        let directed = !direction.is_empty() && TRANSLATIONS.iter().any(|word| name == format!("{word}{direction}"));
        if !(is_center || is_tvec || directed || view.has_name(key, &keys::T)) {
            continue;
        }
        let Some(xyz) = three_numbers(&at) else { continue };
        if let Some(first) = &found {
            return Err(at.fail(format_args!(
                "{} also contains the camera's position; remove one of the two keys",
                first.keys[0]
            )));
        }
        found = Some(FoundPlace { keys: vec![key], xyz, is_center, is_tvec });
    }
    if found.is_none()
        && view.side.is_empty()
        && let Some(three) = pose_map::named(&view.at, &pose_map::FLAT_TRANSLATIONS)
    {
        let [x, y, z] = [0, 1, 2].map(|i| three[i].number());
        let keys: Vec<&str> = view
            .at
            .entries()?
            .into_iter()
            .filter(|(_, at)| three.iter().any(|own| own.key == at.key))
            .map(|(key, _)| key)
            .collect();
        let is_center = !plain(keys[0]).starts_with('t');
        found = Some(FoundPlace { keys, xyz: [x?, y?, z?], is_center, is_tvec: false });
    }
    Ok(found)
}

/// Three numbers in a list, or in a map with the names x, y and z.
fn three_numbers(at: &Cursor<'_>) -> Option<[f64; 3]> {
    if !keys::is_keyed(at) {
        return at.array::<3>().ok();
    }
    let [x, y, z] = pose_map::named(at, &pose_map::FLAT_TRANSLATIONS)?.map(|at| at.number().ok());
    Some([x?, y?, z?])
}
