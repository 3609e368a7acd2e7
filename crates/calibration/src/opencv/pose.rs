//! Pose of a camera in an OpenCV file: R and t, a mount on a body, or a matrix under a user-defined key.

use glam::{DMat3, DVec3};

use crate::document::lens_keys::plain;
use crate::document::{Cursor, check_rigid, check_rotation, rigid};
use crate::opencv::keys::{self, KeyView};
use crate::pose_map;
use crate::{Calibration, Pose, ReadHints, Rotation};
use raycam_formats::{FormatError, Result};
use raycam_scene::{ErrorCode, NoticeCode};

/// Words in keys that mean camera_from_world, and keys that consist of such a word.
const CAMERA_FROM_WORLD: [&str; 8] =
    ["w2c", "world2cam", "worldtocam", "camfromworld", "camerafromworld", "tcamworld", "tcameraworld", "viewmatrix"];
/// Words in keys that mean world_from_camera.
const WORLD_FROM_CAMERA: [&str; 7] =
    ["c2w", "cam2world", "camera2world", "camtoworld", "cameratoworld", "worldfromcam", "tworldcam"];
/// Words in keys of poses whose direction the key does not specify.
const OPEN_DIRECTION: [&str; 5] = ["extrinsic", "pose", "rtmatrix", "transformation", "transformmatrix"];

/// R and t, camera_from_world: under R and T, or under rvec and tvec.
///
/// # Errors
/// Only one of the two, a vector longer than 2 pi, and contradictory values.
pub(super) fn read_r_t(view: &KeyView<'_>) -> Result<Option<Pose>> {
    let (matrix, vector) = (view.find_value(&keys::R)?, view.find_value(&keys::RVEC)?);
    let (t, tvec) = (view.find_value(&keys::T)?, view.find_value(&keys::TVEC)?);
    // A transform of 4x4 numbers under T is read by its key.
    let t = t.filter(|at| !matches!(at.numbers().map(|numbers| numbers.len()), Ok(12 | 16)));
    let rectified = !view.all(&["p", "projectionmatrix"]).is_empty() || !view.all(&keys::RECTIFIED).is_empty();
    let (r_at, t_at) = match (matrix.as_ref().or(vector.as_ref()), t.or(tvec)) {
        (None, None) => return Ok(None),
        (Some(r), Some(t)) => (r.clone(), t),
        // R and P of a rectified camera.
        (Some(_), None) if rectified => return Ok(None),
        (Some(r), None) => {
            return Err(r.fail("a rotation without a translation; add T (0 0 0 if the camera is at the origin)"));
        }
        (None, Some(t)) => {
            return Err(t.fail("a translation without a rotation; add R (the identity if the camera is not rotated)"));
        }
    };
    let r = rotation(&r_at)?;
    if let (Some(_), Some(vector)) = (&matrix, &vector)
        && (rotation(vector)? - r).to_cols_array().iter().any(|difference| difference.abs() > 1e-3)
    {
        return Err(vector.fail(format_args!("{} is a different rotation; expected only one of them", r_at.key)));
    }
    let t = DVec3::from_array(t_at.array::<3>()?);
    Ok(Some(Pose::camera_from_world(Rotation::Matrix(r), t)))
}

/// Rotation of nine numbers, or of three: a rotation vector.
fn rotation(at: &Cursor<'_>) -> Result<DMat3> {
    if at.numbers()?.len() == 3 {
        let vector = Rotation::from_vector(at.array::<3>()?).map_err(|message| at.fail(message))?;
        return Ok(vector.matrix());
    }
    let r = at.matrix3()?;
    check_rotation(r).map_err(|message| at.fail(message))?;
    Ok(r)
}

/// Pose of the camera on a body, whose axes then define the world.
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

/// True for a key of the camera's side with a word of a pose.
pub(super) fn is_named(view: &KeyView<'_>, key: &str) -> bool {
    let words = [&CAMERA_FROM_WORLD[..], &WORLD_FROM_CAMERA, &OPEN_DIRECTION];
    let named = |name: &String| words.iter().any(|words| words.iter().any(|word| name.contains(word)));
    // `pose_timestamp_0` of OpenCV's multi-camera calibration is a pose of the board.
    let board = |name: &String| name.contains("timestamp");
    view.base(key).iter().any(|name| !board(name) && named(name) || matches!(&name[..], "rt" | "tcw" | "twc"))
}

/// True for a key of the camera's side with a word of a pose, and a value that may be one.
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
    let is_t = view.has_name(key, &keys::T) && transform;
    if view.knows(key) && !is_t {
        return false;
    }
    let name = plain(key);
    let named = [&CAMERA_FROM_WORLD[..], &WORLD_FROM_CAMERA, &OPEN_DIRECTION]
        .iter()
        .any(|words| words.iter().any(|word| name.contains(word)))
        || matches!(&name[..], "rt" | "tcw" | "twc");
    let value = transform
        || keys::is_keyed(at)
            && (read_r_t(&KeyView::new(at.clone())).is_ok_and(|pose| pose.is_some()) || pose_map::is_pose_map(at));
    if named {
        return value || at.numbers().is_ok_and(|numbers| matches!(numbers.len(), 6 | 7 | 9));
    }
    transform && rows_of(at).is_ok_and(|rows| check_rotation(rigid(&rows).0).is_ok())
}

/// The pose under a key that is not one of OpenCV's: read if the key or the caller specifies its direction. `known` is the
/// camera's pose by OpenCV's keys or by its mount: a transform without a direction next to it, as `T_color_depth`, is
/// then another one.
pub(super) fn read_named(
    view: &KeyView<'_>,
    known: Option<&Pose>,
    hints: &ReadHints,
    calibration: &mut Calibration,
) -> Result<Option<Pose>> {
    let mut found: Option<(Cursor<'_>, Pose)> = None;
    for (key, at) in view.at.entries()? {
        // Of the keys of several cameras, those with the mark of this one and a word of a pose.
        let own = if view.side.is_empty() { is_pose_key(view, key, &at) } else { is_named_pose(view, key, &at) };
        if !own {
            continue;
        }
        if known.is_some() && hints.poses.is_none() && world_from_camera(key).is_none() && !keys::is_keyed(&at) {
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
            return Err(at.fail(format_args!("{} is a different pose; expected only one of them", other.key)));
        }
        found = Some((at, pose));
    }
    Ok(found.map(|(_, pose)| pose))
}

/// True for a key of world_from_camera, false for one of camera_from_world; None if it specifies no direction.
fn world_from_camera(key: &str) -> Option<bool> {
    let name = plain(key);
    let has = |words: &[&str]| words.iter().any(|word| name.contains(word));
    match (has(&CAMERA_FROM_WORLD) || name == "tcw", has(&WORLD_FROM_CAMERA) || name == "twc") {
        (true, false) => Some(false),
        (false, true) => Some(true),
        _ => None,
    }
}

fn pose_of_key(key: &str, at: &Cursor<'_>, hints: &ReadHints, calibration: &mut Calibration) -> Result<Pose> {
    if keys::is_keyed(at) && !pose_map::is_pose_map(at) {
        let pose = read_r_t(&KeyView::new(at.clone()))?;
        return pose.ok_or_else(|| at.fail("expected R and T"));
    }
    let rows = rows_of(at)?;
    let convention = match (world_from_camera(key), hints.poses) {
        (Some(world_from_camera), Some(given)) if given.world_from_camera != world_from_camera => {
            return Err(at.fail_as(
                ErrorCode::ConflictingValues,
                "direction= contradicts the key's name; expected only one of them",
            ));
        }
        (_, Some(given)) => {
            calibration.used_convention = true;
            given
        }
        (Some(world_from_camera), None) => {
            calibration.note(
                NoticeCode::AssumedConvention,
                format!(
                    "{}: read as {} with OpenCV axes (use axes=\"opengl\" if y points up and z backward)",
                    at.key,
                    if world_from_camera { "world_from_camera" } else { "camera_from_world" }
                ),
            );
            crate::PoseConvention { world_from_camera, opengl: false }
        }
        (None, None) => {
            return Err(at.fail_as(
                ErrorCode::MissingArgument,
                "a pose of unknown direction; specify it (direction=\"camera_from_world\" or \"world_from_camera\", \
                 --direction), or rename the key to w2c or c2w",
            ));
        }
    };
    Ok(convention.pose(&rows))
}

/// First three rows of a pose.
fn rows_of(at: &Cursor<'_>) -> Result<[f64; 12]> {
    if let Some(rows) = pose_map::read(at)? {
        return Ok(rows);
    }
    let numbers = at.numbers()?;
    let rows: [f64; 12] = match numbers.len() {
        16 => check_rigid(&std::array::from_fn(|i| numbers[i])).map_err(|message| at.fail(message))?,
        12 => std::array::from_fn(|i| numbers[i]),
        count => return Err(at.fail(format_args!("{count} numbers; expected a pose of 3x4 or 4x4 numbers"))),
    };
    check_rotation(rigid(&rows).0).map_err(|message| at.fail(message))?;
    Ok(rows)
}

/// Poses of the views of a board.
pub(super) fn read_views(view: &KeyView<'_>) -> Result<Option<Vec<Pose>>> {
    let pose = |at: &Cursor<'_>, r: &[f64], t: &[f64]| {
        let rotation = Rotation::from_vector([r[0], r[1], r[2]]).map_err(|message| at.fail(message))?;
        Ok::<_, FormatError>(Pose::camera_from_world(rotation, DVec3::new(t[0], t[1], t[2])))
    };
    if let Some(at) = view.find_value(&keys::VIEWS)? {
        let numbers = at.numbers()?;
        if numbers.len() % 6 != 0 || numbers.is_empty() {
            return Err(at.fail("expected a rotation vector and a translation per view, six numbers"));
        }
        return numbers.chunks_exact(6).map(|six| pose(&at, &six[..3], &six[3..])).collect::<Result<_>>().map(Some);
    }
    let (Some(r), Some(t)) = (view.find_value(&keys::RVECS)?, view.find_value(&keys::TVECS)?) else {
        return Ok(None);
    };
    let (rs, ts) = (r.numbers()?, t.numbers()?);
    if rs.len() != ts.len() || rs.len() % 3 != 0 || rs.is_empty() {
        return Err(t.fail(format_args!(
            "{} numbers, but {} has {}; expected three of each per view",
            ts.len(),
            r.key,
            rs.len()
        )));
    }
    rs.chunks_exact(3).zip(ts.chunks_exact(3)).map(|(r_, t)| pose(&r, r_, t)).collect::<Result<_>>().map(Some)
}
