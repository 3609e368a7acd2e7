//! The camera of one map, and the refusal of lenses and poses that the camera would lose.

use crate::document::Cursor;
use crate::document::lens_keys::plain;
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use crate::opencv::{camera, directed_pose, pose, quaternion_pose, unread_parts};
use crate::{Calibration, ReadHints};
use raycam_formats::Result;
use raycam_scene::counted;

/// Reads the camera of a map.
pub(super) fn read(view: &KeyView<'_>, name: String, hints: &ReadHints) -> Result<Calibration> {
    let directed = match quaternion_pose::read(view, hints)? {
        Some(found) => Some(found),
        None => directed_pose::read(view, hints)?,
    };
    let in_matrix = match directed.is_none() && pose::read_pose(view, hints.poses)?.is_none() {
        true => camera::k(view)?.and_then(|k| pose::in_camera_matrix(view, k)).map(|(key, _)| key),
        false => None,
    };
    let is_pose = |key: &str| {
        in_matrix == Some(key)
            || view.at.get(key).is_some_and(|at| pose::is_pose_key(view, key, &at) || pose::is_center(view, key, &at))
            || directed.as_ref().is_some_and(|found| found.keys.contains(&key))
    };
    let mut notices = view.at.unread_keys(|key| view.knows(key) || is_pose(key) || camera::is_focal_key(view, key))?;
    if let Some(inner) = view.intrinsics() {
        notices.extend(inner.at.unread_keys(|key| inner.knows(key) || camera::is_focal_key(&inner, key))?);
    }
    let mut calibration = Calibration { notices, ..Calibration::default() };
    let name = match view.find_value(&["name", "cameraname"])? {
        Some(at) => at.word()?.to_owned(),
        None => name,
    };
    camera::read(view, name, directed, hints, &mut calibration)?;
    if calibration.records.iter().all(|record| record.pose.is_none()) {
        unread_parts::refuse_pose(view)?;
    }
    if calibration.records.iter().all(|record| matches!(record.lens, raycam_scene::Lens::Pinhole)) {
        refuse_numbers_of_a_lens(view)?;
    }
    Ok(calibration)
}

/// Rejects numbers under an unknown key that may be the missing lens of a camera.
fn refuse_numbers_of_a_lens(view: &KeyView<'_>) -> Result<()> {
    if !view.all(&keys::LENS).is_empty() {
        return Ok(());
    }
    for (key, at) in view.at.entries()? {
        let Ok(numbers) = at.numbers() else { continue };
        let fractions = numbers.iter().any(|value| value.fract() != 0.0);
        if fractions && !view.knows(key) && may_be_coefficients(key, &at, &numbers) {
            return Err(at.fail(format_args!(
                "unknown key with {}, and the camera has no lens coefficients; rename the key to dist_coeffs if \
                 the numbers are lens coefficients, or remove the key",
                counted(numbers.len(), "number")
            )));
        }
    }
    Ok(())
}

/// Words in keys whose numbers are not lens coefficients.
const NO_LENS: [&str; 58] = [
    "trans",
    "position",
    "quat",
    "orient",
    "rot",
    "pose",
    "extrin",
    "range",
    "box",
    "roi",
    "rect",
    "proj",
    "matrix",
    "plane",
    "limit",
    "bound",
    "min",
    "max",
    "fov",
    "angle",
    "color",
    "colour",
    "gravity",
    "time",
    "depth",
    "crop",
    "center",
    "noise",
    "balance",
    "gain",
    "offset",
    "covar",
    "error",
    "rms",
    "std",
    "sigma",
    "weight",
    "gamma",
    "vignet",
    "temperature",
    "scale",
    "exposure",
    "stamp",
    "score",
    "delay",
    "rate",
    "bias",
    "accel",
    "gyro",
    "velocity",
    "residual",
    "uncertain",
    "confiden",
    "workspace",
    "table",
    "floor",
    "frustum",
    "focus",
];

/// True for numbers of one row that may be coefficients, judged by their count, values and key.
fn may_be_coefficients(key: &str, at: &Cursor<'_>, numbers: &[f64]) -> bool {
    let name = plain(key);
    let other = matches!(&name[..], "p" | "t" | "q" | "r" | "ts") || NO_LENS.iter().any(|word| name.contains(word));
    let data = at.get("data").unwrap_or_else(|| at.clone());
    let rows =
        data.list().unwrap_or_default().iter().filter_map(|row| Some(row.list().ok()?.len())).collect::<Vec<_>>();
    let one_row = rows.len() <= 1 || rows.iter().all(|length| *length == 1);
    let shape = at.get("rows").zip(at.get("cols"));
    let flat = shape.is_none_or(|(rows, cols)| [rows, cols].iter().any(|side| side.count().is_ok_and(|n| n == 1)));
    let length = numbers.iter().map(|value| value * value).sum::<f64>().sqrt();
    let quaternion = numbers.len() == 4 && (length - 1.0).abs() < 1e-2;
    // The absolute value of every coefficient is below 100.
    let small = numbers.iter().all(|value| value.abs() < 100.0);
    // p1 and p2 are small, unless the four numbers belong to a fisheye lens, whose coefficients are all small.
    let fisheye = numbers.len() == 4 && numbers.iter().all(|value| value.abs() < 2.0);
    let tangential = numbers.get(2..4).is_some_and(|p| p.iter().all(|value| value.abs() < 0.1));
    (fisheye || tangential)
        && matches!(numbers.len(), 4 | 5 | 8 | 12 | 14)
        && one_row
        && flat
        && small
        && !quaternion
        && !other
}

/// Rejects coefficients of a lens if K is missing next to them.
pub(super) fn refuse_lens_without_k(view: &KeyView<'_>) -> Result<()> {
    let Some(lens) = view.find_value(&keys::LENS)?.filter(|at| at.refuse_lens("d").is_err()) else { return Ok(()) };
    Err(match view.all(&keys::K).first() {
        Some(k) => k.fail("expected a camera matrix of 9 numbers, or fx fy cx cy"),
        None => lens
            .fail("the camera matrix of these lens coefficients is missing; expected K, camera_matrix or fx fy cx cy"),
    })
}
