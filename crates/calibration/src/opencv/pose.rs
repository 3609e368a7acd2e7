//! Pose of a camera in an OpenCV file: R and t, a mount on a body, or a matrix under a user-defined key.

use glam::{DMat3, DVec3};

use crate::document::lens_keys::plain;
use crate::document::{Cursor, check_rigid, check_rotation, rigid};
use crate::files::PoseConvention;
use crate::opencv::key_view::KeyView;
use crate::opencv::keys::{self, CENTER, KeyUnit, POSITION};
use crate::pose_map;
use crate::quaternion_key::unknown_order_error;
use crate::{Calibration, Pose, PoseHints, ReadHints, Rotation};
use raycam_formats::{FormatError, Result};
use raycam_scene::{ErrorCode, NoticeCode, counted};

/// Words in keys that mean camera_from_world, and keys that consist of such a word.
const CAMERA_FROM_WORLD: [&str; 10] = [
    "w2c",
    "world2cam",
    "worldtocam",
    "camfromworld",
    "camerafromworld",
    "tcamworld",
    "tcameraworld",
    "camtworld",
    "cameratworld",
    "viewmat",
];
/// Words in keys that mean world_from_camera.
const WORLD_FROM_CAMERA: [&str; 8] =
    ["c2w", "cam2world", "camera2world", "camtoworld", "cameratoworld", "worldfromcam", "tworldcam", "worldtcam"];
/// Message for a pose whose direction is specified neither by its key nor by the caller.
pub(super) const UNKNOWN_DIRECTION: &str = "a pose of unknown direction; specify it (direction=\"camera_from_world\" or \
                                 \"world_from_camera\", --direction), or rename the key to w2c or c2w";
/// Names of other sensors and bodies in keys of poses.
const BODIES: [&str; 20] = [
    "lidar", "velodyne", "velo", "livox", "laser", "radar", "imu", "body", "base", "robot", "ego", "vehicle",
    "gripper", "hand", "flange", "rig", "marker", "board", "target", "map",
];
/// Keys of [`CENTER`] that cannot mean another point, such as the centre of the scene.
const OWN_CENTER: [&str; 6] = ["c", "cameracenter", "cameracentre", "camcenter", "opticalcenter", "projectioncenter"];
/// Keys of rotations that are neither a matrix nor a rotation vector.
const OTHER_ROTATIONS: [&str; 15] = [
    "rotationquaternion",
    "quaternion",
    "quat",
    "q",
    "qvec",
    "orientation",
    "euler",
    "eulerangles",
    "rpy",
    "rollpitchyaw",
    "ypr",
    "angles",
    "rotationdeg",
    "roll",
    "yaw",
];
/// Beginnings of the keys of angles.
const ANGLES: [&str; 7] = ["rotationeuler", "euler", "rpy", "ypr", "rollpitch", "yawpitch", "anglesxyz"];
/// Words in keys of poses whose direction the key does not specify.
const OPEN_DIRECTION: [&str; 5] = ["extrinsic", "pose", "rtmatrix", "transformation", "transformmatrix"];

/// Reads R and t, camera_from_world: from R and T, or from rvec and tvec.
///
/// # Errors
/// An error if only one of rotation and translation is present, if a vector is longer than 2 pi, or if values
/// contradict each other.
pub(super) fn read_r_t(view: &KeyView<'_>) -> Result<Option<Pose>> {
    read_pose(view, PoseHints::default())
}

/// True for a map with R and T, or with rvec and tvec.
pub(super) fn has_r_t(at: &Cursor<'_>) -> bool {
    let view = KeyView::new(at.clone());
    let has = |names: &[&str]| !view.all(names).is_empty();
    (has(&keys::R) || has(&keys::RVEC))
        && (has(&keys::T) || has(&keys::TVEC))
        && read_r_t(&view).is_ok_and(|pose| pose.is_some())
}

/// True for a key that contains a word for a pose.
pub(super) fn is_pose_word(key: &str) -> bool {
    let name = plain(key);
    [&CAMERA_FROM_WORLD[..], &WORLD_FROM_CAMERA, &OPEN_DIRECTION]
        .iter()
        .any(|words| words.iter().any(|word| name.contains(word)))
        || matches!(&name[..], "rt" | "tcw" | "twc")
        || between(&name).is_some()
}

/// True for a key that belongs to a pose of R and T, or of rvec and tvec.
pub(super) fn is_part(view: &KeyView<'_>, key: &str) -> bool {
    [&keys::R[..], &keys::T, &keys::RVEC, &keys::TVEC].iter().any(|names| view.has_name(key, names))
}

/// True for a map with a part of a pose: R or T, or rvec or tvec.
pub(super) fn has_part(at: &Cursor<'_>) -> bool {
    let view = KeyView::new(at.clone());
    at.entries().unwrap_or_default().iter().any(|(key, _)| is_part(&view, key))
}

/// Values that describe a camera's own pose in forms that [`read_r_t`] does not accept.
struct OtherPose<'a> {
    center: Option<Cursor<'a>>,
    position: Option<Cursor<'a>>,
    rotation: Option<Cursor<'a>>,
}

impl<'a> OtherPose<'a> {
    fn of(view: &KeyView<'a>) -> Result<Self> {
        let three = |at: &Cursor<'_>| at.numbers().is_ok_and(|numbers| numbers.len() == 3);
        let first = |names: &[&str]| Ok::<_, FormatError>(view.find_value(names)?.filter(three));
        // A word (as in `orientation: landscape`), a 4x4 matrix Q and angles that are all 0 are not rotations.
        let turned = |at: &Cursor<'_>| match at.numbers() {
            Ok(numbers) => matches!(numbers.len(), 3 | 4) && numbers.iter().any(|value| *value != 0.0),
            Err(_) => at.number().is_ok_and(|angle| angle != 0.0),
        };
        let rotation = OTHER_ROTATIONS.iter().find_map(|name| view.all(&[name]).into_iter().find(turned));
        // The key may also contain the order of the axes and the unit, as in `euler_xyz_deg`.
        let are_angles = |key: &str| view.base(key).iter().any(|base| ANGLES.iter().any(|word| base.starts_with(word)));
        let angles = || view.at.entries().ok()?.into_iter().find(|(key, at)| are_angles(key) && turned(at));
        let rotation = rotation.or_else(|| angles().map(|(_, at)| at));
        Ok(Self { center: first(&CENTER)?, position: first(&POSITION)?, rotation })
    }
}

/// Same as [`read_r_t`], for a camera; a rotation next to the camera's position is accepted too. `hints` are the direction
/// and the axes specified by the caller.
pub(super) fn read_pose(view: &KeyView<'_>, hints: PoseHints) -> Result<Option<Pose>> {
    let other = OtherPose::of(view)?;
    let (matrix, vector) = (view.find_value(&keys::R)?, view.find_value(&keys::RVEC)?);
    let (t, tvec) = (view.find_value(&keys::T)?, view.find_value(&keys::TVEC)?);
    // A matrix of 12 or 16 numbers under T is a whole transform, which is read elsewhere by its key.
    let t = t.filter(|at| !matches!(at.numbers().map(|numbers| numbers.len()), Ok(12 | 16)));
    let rectified = !view.all(&["p", "projectionmatrix"]).is_empty() || !view.all(&keys::RECTIFIED).is_empty();
    let (r_at, t_at) = match (matrix.as_ref().or(vector.as_ref()), t.or(tvec)) {
        (None, None) => return unread_pose(view, other),
        (Some(r), Some(t)) => (r.clone(), t),
        (Some(r), None) => {
            if let Some(center) = &other.center {
                return pose_at(center, r, hints, Some(false)).map(Some);
            }
            if let Some(position) = &other.position {
                return pose_at(position, r, hints, None).map(Some);
            }
            // R belongs to a rectified camera, with P, or has no effect.
            if rectified || rotation(r).is_ok_and(|r| r == DMat3::IDENTITY) {
                return Ok(None);
            }
            return Err(r.fail("a rotation without a translation; add T (0 0 0 if the camera is at the origin)"));
        }
        (None, Some(_)) if other.rotation.is_some() => return unread_pose(view, other),
        (None, Some(t)) => {
            return Err(t.fail("a translation without a rotation; add R (the identity if the camera is not rotated)"));
        }
    };
    let r = rotation(&r_at)?;
    if let (Some(_), Some(vector)) = (&matrix, &vector)
        && (rotation(vector)? - r).to_cols_array().iter().any(|difference| difference.abs() > 1e-3)
    {
        return Err(vector.fail(format_args!("{} contains a different rotation; remove one of the two keys", r_at.key)));
    }
    let t = DVec3::from_array(t_at.array::<3>()?);
    check_center(view, r, t)?;
    Ok(Some(Pose::camera_from_world(Rotation::Matrix(r), t)))
}

/// Adds a notice if the key of the pose's translation specifies another unit than metres.
pub(super) fn note_units(view: &KeyView<'_>, pose: Option<&Pose>, calibration: &mut Calibration) -> Result<()> {
    for (key, at) in view.at.entries()?.into_iter().filter(|_| pose.is_some()) {
        let is_place = [&keys::T[..], &keys::TVEC, &CENTER, &POSITION].iter().any(|names| view.has_name(key, names));
        let Some(KeyUnit::Length(unit)) = keys::unit_of(key).filter(|_| is_place) else { continue };
        let Some(unit) = unit.other_than_metres() else { continue };
        let message = format!("the key specifies positions in {unit}; they are not converted to metres");
        calibration.note_about(NoticeCode::PlacedCameras, at.key.clone(), message);
    }
    Ok(())
}

/// Checks that a camera's centre next to R and t is -Rᵀt. A key such as `center` is not checked, because it may mean
/// another point.
fn check_center(view: &KeyView<'_>, r: DMat3, t: DVec3) -> Result<()> {
    let Some(at) = view.find_value(&OWN_CENTER)?.filter(|at| at.numbers().is_ok_and(|numbers| numbers.len() == 3))
    else {
        return Ok(());
    };
    let (given, center) = (DVec3::from_array(at.array::<3>()?), -(r.transpose() * t));
    if (given - center).length() > 1e-3 * (1.0 + center.length()) {
        return Err(at.fail(format_args!(
            "differs from -Rᵀt = ({}, {}, {}), the camera's centre according to R and t; correct or remove this key",
            center.x, center.y, center.z
        )));
    }
    Ok(())
}

/// True for the key of a camera's centre or position that is used: next to a rotation without a translation as a part of
/// the pose, or next to R and t by [`check_center`].
pub(super) fn is_center(view: &KeyView<'_>, key: &str, at: &Cursor<'_>) -> bool {
    let has = |names: &[&str]| names.iter().any(|name| !view.all(&[name]).is_empty());
    let (rotation, t) = (has(&keys::R) || has(&keys::RVEC), has(&keys::T) || has(&keys::TVEC));
    let named = view.has_name(key, &OWN_CENTER) || !t && (view.has_name(key, &CENTER) || view.has_name(key, &POSITION));
    rotation && named && at.numbers().is_ok_and(|numbers| numbers.len() == 3)
}

/// Reads the pose of a camera from its position and the rotation `r_at` next to it, whose direction the caller specifies;
/// otherwise, it is `world_from_camera`.
fn pose_at(
    position: &Cursor<'_>,
    r_at: &Cursor<'_>,
    hints: PoseHints,
    world_from_camera: Option<bool>,
) -> Result<Pose> {
    let r = rotation(r_at)?;
    let Some(world_from_camera) = hints.world_from_camera.or(world_from_camera) else {
        return Err(r_at.fail(
            "a rotation of unknown direction next to a position; specify it (direction=\"camera_from_world\" or \
             \"world_from_camera\", --direction), or rename the position to camera_center if R maps from the world to \
             the camera",
        ));
    };
    Ok(hints.directed(world_from_camera).pose_at(r, DVec3::from_array(position.array::<3>()?)))
}

/// True if the map contains a rotation next to a position, whose direction only the caller can specify.
pub(super) fn needs_direction(view: &KeyView<'_>) -> Result<bool> {
    let other = OtherPose::of(view)?;
    Ok(view.find_value(&keys::T)?.or(view.find_value(&keys::TVEC)?).is_none()
        && (other.center.is_some() || other.position.is_some()))
}

/// Reads COLMAP's pose `qvec` and `tvec`, or returns an error for a position or a rotation that would be lost.
fn unread_pose(view: &KeyView<'_>, other: OtherPose<'_>) -> Result<Option<Pose>> {
    let tvec = view.find_value(&keys::TVEC)?;
    if let (Some(q), Some(t)) = (view.find_value(&["qvec"])?, &tvec) {
        let rotation = Rotation::unit_quaternion(q.array::<4>()?).map_err(|message| q.fail(message))?;
        return Ok(Some(Pose::camera_from_world(rotation, DVec3::from_array(t.array::<3>()?))));
    }
    // A quaternion alone may belong to another sensor.
    let placed = other.center.is_some()
        || other.position.is_some()
        || view.find_value(&keys::T)?.or(tvec).is_some_and(|at| at.numbers().is_ok_and(|numbers| numbers.len() == 3));
    let angles = |at: &Cursor<'_>| !at.numbers().is_ok_and(|numbers| numbers.len() == 4);
    if let Some(at) = other.rotation.filter(|at| !keys::is_keyed(at) && (placed || angles(at))) {
        if !angles(&at) {
            return Err(unknown_order_error(at.name(), &at));
        }
        return Err(at.fail(
            "angles whose axes and order are not specified; write R, the 3x3 matrix camera_from_world \
             (scipy.spatial.transform.Rotation.from_euler), and T",
        ));
    }
    // The pose is under another key; the position is reported as ignored.
    if view.at.entries().unwrap_or_default().iter().any(|(key, at)| is_pose_key(view, key, at)) {
        return Ok(None);
    }
    let away = |at: &Cursor<'_>| at.numbers().is_ok_and(|numbers| numbers.iter().any(|value| *value != 0.0));
    match [other.center, other.position].into_iter().flatten().find(away) {
        Some(at) => Err(at.fail("a position without a rotation; add R, the 3x3 matrix camera_from_world")),
        None => Ok(None),
    }
}

/// Reads a rotation: nine numbers of a matrix, or three of a rotation vector, in radians unless the key ends with a unit
/// of degrees.
pub(super) fn rotation(at: &Cursor<'_>) -> Result<DMat3> {
    match at.numbers()?.len() {
        3 => {
            let is_degrees = keys::unit_of(at.name()) == Some(KeyUnit::Degrees);
            let vector = at.array::<3>()?.map(|value| if is_degrees { value.to_radians() } else { value });
            return Ok(Rotation::from_vector(vector).map_err(|message| at.fail(message))?.matrix());
        }
        // A key such as R_wxyz is not recognised, so the remedy is not the key's own name.
        4 => return Err(unknown_order_error("quaternion", at)),
        _ => {}
    }
    let r = at.matrix3()?;
    check_rotation(r).map_err(|message| at.fail(message))?;
    Ok(r)
}

/// Reads the pose of the camera on a body, whose axes then define the world.
pub(super) fn read_mount(view: &KeyView<'_>) -> Result<Option<Pose>> {
    if let Some(at) = view.find_value(&keys::BODY_FROM_CAMERA)? {
        let (r, c) = rigid(&rows_of(&at)?);
        return Ok(Some(Pose::world_from_camera(Rotation::Matrix(r), c)));
    }
    if let Some(at) = view.find_value(&keys::CAMERA_FROM_BODY)? {
        let (r, t) = rigid(&rows_of(&at)?);
        return Ok(Some(Pose::camera_from_world(Rotation::Matrix(r), t)));
    }
    Ok(None)
}

/// True for a key of the camera that contains a word for a pose.
pub(super) fn is_named(view: &KeyView<'_>, key: &str) -> bool {
    let words = [&CAMERA_FROM_WORLD[..], &WORLD_FROM_CAMERA, &OPEN_DIRECTION];
    let named = |name: &String| {
        words.iter().any(|words| words.iter().any(|word| name.contains(word))) || between(name).is_some()
    };
    // `pose_timestamp_0` of OpenCV's multi-camera calibration is a pose of the board.
    let board = |name: &String| name.contains("timestamp");
    view.base(key).iter().any(|name| !board(name) && named(name) || matches!(&name[..], "rt" | "tcw" | "twc"))
}

/// True for a key of the camera that contains a word for a pose and whose value may be a pose.
fn is_named_pose(view: &KeyView<'_>, key: &str, at: &Cursor<'_>) -> bool {
    is_named(view, key)
        && (at.numbers().is_ok_and(|numbers| matches!(numbers.len(), 6 | 7 | 9 | 12 | 16)) || keys::is_keyed(at))
}

/// True for a key that the reader does not recognise and whose value is a pose, judging by its numbers or its name.
pub(super) fn is_pose_key(view: &KeyView<'_>, key: &str, at: &Cursor<'_>) -> bool {
    if view.is_rectified(key) || view.has_name(key, &["p", "projectionmatrix"]) {
        return false;
    }
    let transform = matches!(at.numbers().map(|numbers| numbers.len()), Ok(12 | 16));
    // E, F and H are also the names of essential, fundamental and homography matrices (3x3) and of the height.
    let is_transform = transform && (view.has_name(key, &keys::T) || view.has_name(key, &["e", "f", "h"]));
    if view.knows(key) && !is_transform {
        return false;
    }
    let named = is_pose_word(key);
    let value = transform
        || keys::is_keyed(at)
            && (read_r_t(&KeyView::new(at.clone())).is_ok_and(|pose| pose.is_some())
                || pose_map::is_pose_map(at)
                || inner_transform(at).is_some()
                || named && holds_numbers(at));
    if named {
        return value || at.numbers().is_ok_and(|numbers| matches!(numbers.len(), 6 | 7 | 9));
    }
    transform && rows_of(at).is_ok_and(|rows| check_rotation(rigid(&rows).0).is_ok())
}

/// Reads the pose under a key that OpenCV does not use, if the key or the caller specifies the pose's direction.
/// `known` is the camera's pose if other keys specify it; a transform without a direction, such as `T_color_depth`, is
/// then a different transform. The keys `used` are omitted, because they belong to `known`.
pub(super) fn read_named(
    view: &KeyView<'_>,
    known: Option<&Pose>,
    used: &[&str],
    hints: &ReadHints,
    calibration: &mut Calibration,
) -> Result<Option<Pose>> {
    let mut found: Option<(Cursor<'_>, Pose)> = None;
    for (key, at) in view.at.entries()?.into_iter().filter(|(key, _)| !used.contains(key)) {
        // If the map has keys of several cameras, only keys with this camera's marker and a word for a pose count.
        let own = if view.side.is_empty() { is_pose_key(view, key, &at) } else { is_named_pose(view, key, &at) };
        if !own {
            continue;
        }
        let another = world_from_camera(key).is_none() || between(&plain(key)).is_some();
        if known.is_some() && hints.poses.is_empty() && another && !keys::is_keyed(&at) {
            let subject = format!("{} (line {})", at.key, at.node.line);
            calibration.note_about(
                NoticeCode::IgnoredKey,
                subject,
                "not used; the camera has another pose in the file",
            );
            continue;
        }
        let pose = pose_of_key(key, &at, hints, calibration)?;
        if let Some((other, before)) = &found
            && *before != pose
        {
            return Err(at.fail(format_args!("{} contains a different pose; remove one of the two keys", other.key)));
        }
        found = Some((at, pose));
    }
    Ok(found.map(|(_, pose)| pose))
}

/// True for a key of world_from_camera, false for a key of camera_from_world; `None` if the key specifies no direction.
pub(super) fn world_from_camera(key: &str) -> Option<bool> {
    let name = plain(key);
    let has = |words: &[&str]| words.iter().any(|word| name.contains(word));
    match (has(&CAMERA_FROM_WORLD) || name == "tcw", has(&WORLD_FROM_CAMERA) || name == "twc") {
        (true, false) => Some(false),
        (false, true) => Some(true),
        _ => between(&name).map(|(_, body_from_camera)| body_from_camera),
    }
}

/// Returns the other sensor or body in the name of a camera's transform, and true if the name means body_from_camera.
/// Examples: `lidar_to_camera`, `T_cam_velo` (as in Kalibr, camera from velo), `imu_T_cam`, `cam2base`.
fn between(name: &str) -> Option<(&'static str, bool)> {
    let name = name.trim_end_matches("matrix").trim_end_matches("link");
    let body = *BODIES.iter().find(|body| name.contains(**body))?;
    let at = name.find(body)?;
    let (camera, word) = ["camera", "cam"].into_iter().find_map(|word| Some((name.find(word)?, word)))?;
    let (camera_first, first, start, end) = match camera < at {
        true => (true, camera, camera + word.len(), at),
        false => (false, at, at + body.len(), camera),
    };
    let (before, link) = (&name[..first], name.get(start..end)?);
    let link = link.trim_matches(|c: char| c.is_ascii_digit() && c != '2');
    match link {
        "to" | "2" => Some((body, camera_first)),
        "from" | "t" => Some((body, !camera_first)),
        "" if before == "t" || before == "tf" => Some((body, !camera_first)),
        _ => None,
    }
}

/// True for a map with at least three numbers, in lists or single.
fn holds_numbers(at: &Cursor<'_>) -> bool {
    let count = |at: &Cursor<'_>| match at.numbers() {
        Ok(numbers) => numbers.len(),
        Err(_) => usize::from(at.number().is_ok()),
    };
    at.entries().is_ok_and(|entries| entries.iter().map(|(_, at)| count(at)).sum::<usize>() >= 3)
}

/// Reads the pose in a camera matrix P = K [R | t] next to K, with the key of P. `None` for the matrix of a rectified
/// camera, which has another K or no rotation.
pub(super) fn in_camera_matrix<'a>(view: &KeyView<'a>, k: DMat3) -> Option<(&'a str, Pose)> {
    let (key, at) =
        view.at.entries().ok()?.into_iter().find(|(key, _)| view.has_name(key, &["p", "projectionmatrix"]))?;
    let (k_r, k_t) = rigid(&at.array::<12>().ok()?);
    let (r, t) = (k.inverse() * k_r, k.inverse() * k_t);
    let is_pose = check_rotation(r).is_ok() && !r.abs_diff_eq(DMat3::IDENTITY, 1e-3);
    is_pose.then(|| (key, Pose::camera_from_world(Rotation::Matrix(r), t)))
}

/// Reads the pose [R | t] under a key of K, as in the files of OpenPose, whose K is under another key.
pub(super) fn in_key_of_k(view: &KeyView<'_>) -> Option<(String, Pose)> {
    let entries = view.at.entries().ok()?;
    let (_, at) = entries.into_iter().find(|(key, at)| view.has_name(key, &keys::K) && keys::is_rigid_transform(at))?;
    let (r, t) = rigid(&rows_of(&at).ok()?);
    Some((at.key.clone(), Pose::camera_from_world(Rotation::Matrix(r), t)))
}

/// The only transform in a map of extrinsics, with its key: `extrinsics: {world_to_camera: [...]}`.
fn inner_transform<'a>(at: &Cursor<'a>) -> Option<(&'a str, Cursor<'a>)> {
    if !keys::is_keyed(at) || pose_map::is_pose_map(at) {
        return None;
    }
    let is_transform =
        |at: &Cursor<'_>| matches!(at.numbers().map(|numbers| numbers.len()), Ok(12 | 16)) || pose_map::is_pose_map(at);
    let mut found = at.entries().ok()?.into_iter().filter(|(_, at)| is_transform(at));
    found.next().filter(|_| found.next().is_none())
}

/// Reads the pose under a key. R and T in a map are camera_from_world, unless the key or the caller specifies another
/// direction.
pub(super) fn pose_of_key(
    key: &str,
    at: &Cursor<'_>,
    hints: &ReadHints,
    calibration: &mut Calibration,
) -> Result<Pose> {
    if let Some((inner_key, inner)) = inner_transform(at) {
        return pose_of_key(&format!("{key}_{inner_key}"), &inner, hints, calibration);
    }
    let stated = world_from_camera(key);
    if keys::is_keyed(at) && !pose_map::is_pose_map(at) {
        let pose = pose_of_r_t(&KeyView::new(at.clone()), stated, hints)?;
        if stated.is_some() || !hints.poses.is_empty() {
            note_convention(key, at, stated, hints, calibration);
        }
        return Ok(pose);
    }
    let rows = rows_of(at)?;
    let convention = convention_of_key(at, stated, hints.poses, || UNKNOWN_DIRECTION.into())?;
    note_convention(key, at, stated, hints, calibration);
    Ok(convention.pose(&rows))
}

/// Reads R and T in a map whose key states the direction; without a direction, they are camera_from_world.
fn pose_of_r_t(view: &KeyView<'_>, stated: Option<bool>, hints: &ReadHints) -> Result<Pose> {
    let at = &view.at;
    let convention =
        convention_of_key(at, stated.or(hints.poses.world_from_camera).or(Some(false)), hints.poses, || {
            UNKNOWN_DIRECTION.into()
        })?;
    let directed = PoseHints { world_from_camera: Some(convention.world_from_camera), ..hints.poses };
    let pose = read_pose(view, directed)?.ok_or_else(|| {
        at.fail(
            "a pose in an unknown form; expected a rotation R (3x3 matrix or rotation vector) and a translation T, a \
             quaternion (qw qx qy qz) and a translation, or a 4x4 matrix under w2c or c2w",
        )
    })?;
    if needs_direction(view)? || !convention.world_from_camera && !convention.opengl {
        return Ok(pose);
    }
    let (r, t) = pose.r_t();
    Ok(convention.pose_of(r.matrix(), t))
}

/// Adds a notice about the direction and the axes of a pose whose key states the direction.
fn note_convention(key: &str, at: &Cursor<'_>, stated: Option<bool>, hints: &ReadHints, calibration: &mut Calibration) {
    match stated {
        _ if !hints.poses.is_empty() => calibration.used_convention = true,
        None => {}
        Some(world_from_camera) => {
            let axes = "OpenCV axes (if y points up and z backward, use axes=\"opengl\" or --axes opengl)";
            let message = match (between(&plain(key)), world_from_camera) {
                (Some((body, true)), _) => {
                    format!("read as {body}_from_camera with {axes}; the coordinate frame of {body} is the world frame")
                }
                (Some((body, false)), _) => {
                    format!("read as camera_from_{body} with {axes}; the coordinate frame of {body} is the world frame")
                }
                (None, true) => format!("read as world_from_camera with {axes}"),
                (None, false) => format!("read as camera_from_world with {axes}"),
            };
            calibration.note_about(NoticeCode::AssumedConvention, at.key.clone(), message);
        }
    }
}

/// Returns the convention of a pose whose key states the direction, or whose direction only the caller can specify.
///
/// # Errors
/// An error if the caller contradicts the key, and an error with the text `unknown` if nobody specifies the direction.
pub(super) fn convention_of_key(
    at: &Cursor<'_>,
    stated: Option<bool>,
    hints: PoseHints,
    unknown: impl FnOnce() -> String,
) -> Result<PoseConvention> {
    match (stated, hints.world_from_camera) {
        (Some(stated), Some(given)) if stated != given => Err(at.fail_as(
            ErrorCode::ConflictingValues,
            "the key's name contradicts direction= (--direction); omit this argument or rename the key",
        )),
        (Some(direction), _) | (None, Some(direction)) => Ok(hints.directed(direction)),
        (None, None) => Err(at.fail_as(ErrorCode::MissingArgument, unknown())),
    }
}

/// Reads the first three rows of a pose's matrix.
fn rows_of(at: &Cursor<'_>) -> Result<[f64; 12]> {
    if let Some(rows) = pose_map::read(at)? {
        return Ok(rows);
    }
    let numbers = at.numbers()?;
    let rows: [f64; 12] = match numbers.len() {
        16 => check_rigid(&std::array::from_fn(|i| numbers[i])).map_err(|message| at.fail(message))?,
        12 => std::array::from_fn(|i| numbers[i]),
        count => {
            return Err(at.fail(format_args!("{}; expected a pose of 3x4 or 4x4 numbers", counted(count, "number"))));
        }
    };
    check_rotation(rigid(&rows).0).map_err(|message| at.fail(message))?;
    Ok(rows)
}

/// Reads the poses of a board's views.
pub(super) fn read_views(view: &KeyView<'_>) -> Result<Option<Vec<Pose>>> {
    let pose = |at: &Cursor<'_>, r: &[f64], t: &[f64]| {
        let rotation = Rotation::from_vector([r[0], r[1], r[2]]).map_err(|message| at.fail(message))?;
        Ok::<_, FormatError>(Pose::camera_from_world(rotation, DVec3::new(t[0], t[1], t[2])))
    };
    if let Some(at) = view.find_value(&keys::VIEWS)? {
        let numbers = at.numbers()?;
        if numbers.len() % 6 != 0 || numbers.is_empty() {
            let count = counted(numbers.len(), "number");
            return Err(at.fail(format_args!("{count}; expected six per view, a rotation vector and a translation")));
        }
        return numbers.chunks_exact(6).map(|six| pose(&at, &six[..3], &six[3..])).collect::<Result<_>>().map(Some);
    }
    let (Some(r), Some(t)) = (view.find_value(&keys::RVECS)?, view.find_value(&keys::TVECS)?) else {
        return Ok(None);
    };
    let (rs, ts) = (r.numbers()?, t.numbers()?);
    if rs.len() != ts.len() || rs.len() % 3 != 0 || rs.is_empty() {
        return Err(t.fail(format_args!(
            "{} numbers, but {} has {}; expected three numbers per view in both keys",
            ts.len(),
            r.key,
            rs.len()
        )));
    }
    rs.chunks_exact(3).zip(ts.chunks_exact(3)).map(|(r_, t)| pose(&r, r_, t)).collect::<Result<_>>().map(Some)
}
