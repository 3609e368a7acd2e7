//! One camera of an OpenCV file: its size, K and pose.

use std::ops::Range;

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, Value};
use crate::opencv::directed_pose::DirectedPose;
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use crate::opencv::{lens, pose};
use crate::rig::on_a_body;
use crate::{Calibration, CameraRecord, ReadHints, pose_map};
use raycam_formats::{FormatError, Result};

/// Reads K; `None` if the camera has no K.
pub(super) fn k(view: &KeyView<'_>) -> Result<Option<DMat3>> {
    let skew = view.inherited(&keys::SKEW)?.map(|at| Ok::<_, FormatError>((at.number()?, at))).transpose()?;
    let [fx, fy, cx, cy] = keys::FOCALS.map(|names| view.find_value(names));
    let [fx, fy, cx, cy] = [fx?, fy?, cx?, cy?];
    if let Some(at) = view.find_value(&keys::K)? {
        let k = matrix(&at)?;
        let entries = [fx, fy, cx, cy].into_iter().zip([k.x_axis.x, k.y_axis.y, k.z_axis.x, k.z_axis.y]);
        for (other, value) in entries.filter_map(|(other, value)| Some((other?, value))) {
            check_equal(&other, &[value], &at)?;
        }
        refuse_other_pixels(view, &k, &at)?;
        return match skew {
            Some((skew, at)) if skew != 0.0 && skew != k.y_axis.x => {
                Err(at.fail(format_args!("{skew}, but K[0, 1] is {}; expected equal values", k.y_axis.x)))
            }
            _ => Ok(Some(k)),
        };
    }
    let [fx, fy] = match (fx, fy) {
        (Some(fx), Some(fy)) => [fx.number()?, fy.number()?],
        _ => match view.find_value(&keys::FOCAL_PAIR)? {
            Some(at) => focal_pair(&at)?,
            None => return Ok(None),
        },
    };
    let [cx, cy] = match (cx, cy) {
        (Some(cx), Some(cy)) => {
            let own = [cx.number()?, cy.number()?];
            if let Some(pair) = view.find_value(&keys::PRINCIPAL_POINT)?.filter(|at| at.array::<2>().is_ok()) {
                check_equal(&pair, &own, &cx)?;
            }
            own
        }
        _ => match view.find_value(&keys::PRINCIPAL_POINT)? {
            Some(at) => pair_of_map(&at).map_or_else(|| at.array(), Ok)?,
            None => return Ok(None),
        },
    };
    let mut k = upper([fx, fy, cx, cy]);
    if let Some(at) = view.find_value(&keys::FOCAL_PAIR)?.filter(|_| MAX_FOCALS_PER_CENTER * fx < cx.max(cy)) {
        return Err(at.fail(format_args!(
            "{fx} is much smaller than the principal point ({cx}, {cy}) and may be in millimetres; expected pixels: \
             millimetres / (sensor width in millimetres) * (image width in pixels)"
        )));
    }
    k.y_axis.x = skew.map_or(0.0, |(skew, _)| skew);
    Ok(Some(k))
}

/// Keys of two numbers that K also contains, with these numbers in K.
fn pairs_of_k(k: &DMat3) -> [(&'static [&'static str], [f64; 2]); 2] {
    [(&keys::FOCAL_PAIR, [k.x_axis.x, k.y_axis.y]), (&keys::PRINCIPAL_POINT, [k.z_axis.x, k.z_axis.y])]
}

/// Rejects a focal length or a principal point next to K that differs from K. Other units than pixels are allowed, such
/// as millimetres and offsets from the image's centre; values in such a unit are not used.
fn refuse_other_pixels(view: &KeyView<'_>, k: &DMat3, at: &Cursor<'_>) -> Result<()> {
    for (names, values) in pairs_of_k(k) {
        for other in view.all(names) {
            let Ok(pair) = focal_pair(&other) else { continue };
            let may_be_pixels = |(a, b): (&f64, &f64)| RATIOS_OF_PIXELS.contains(&(a / b));
            if pair.iter().zip(&values).all(may_be_pixels) {
                check_close(&other, &pair, &values, at)?;
            }
        }
    }
    Ok(())
}

/// Range of the ratio of a value to the same value in K, if both may be in pixels.
const RATIOS_OF_PIXELS: Range<f64> = 0.2..5.0;

/// Returns an error if the numbers of `at` differ from `values`, the same quantity in the key `first`. Numbers
/// that differ by at most 0.01 % (below 1: by 1e-4) count as equal, because they may be rounded.
fn check_equal(at: &Cursor<'_>, values: &[f64], first: &Cursor<'_>) -> Result<()> {
    let numbers = at.numbers().or_else(|_| at.number().map(|number| vec![number]))?;
    check_close(at, &numbers, values, first)
}

/// Same as [`check_equal`], for the given numbers of `at`.
fn check_close(at: &Cursor<'_>, numbers: &[f64], values: &[f64], first: &Cursor<'_>) -> Result<()> {
    if are_close(numbers, values) {
        return Ok(());
    }
    let listed = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    Err(keys::contradiction(at, first, &format!(", {} instead of {}", listed(values), listed(numbers))))
}

fn are_close(numbers: &[f64], values: &[f64]) -> bool {
    let is_equal = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-4 * b.abs().max(1.0);
    numbers.len() == values.len() && numbers.iter().zip(values).all(is_equal)
}

/// If the principal point's coordinates are more focal lengths than this, a value under `focal_length` is refused.
const MAX_FOCALS_PER_CENTER: f64 = 4.0;

/// True if a map contains a focal length and a principal point under keys of [`keys::FOCAL_PAIR`] or
/// [`keys::PRINCIPAL_POINT`].
pub(super) fn has_focal_pair(view: &KeyView<'_>) -> bool {
    let [fx, fy, cx, cy] = keys::FOCALS.map(|names| !view.all(names).is_empty());
    let numbers = |names: &[&str]| {
        let few = |at: &Cursor<'_>| at.numbers().is_ok_and(|numbers| matches!(numbers.len(), 1 | 2));
        view.all(names).iter().any(|at| at.number().is_ok() || few(at) || pair_of_map(at).is_some())
    };
    (fx && fy || numbers(&keys::FOCAL_PAIR)) && (cx && cy || numbers(&keys::PRINCIPAL_POINT))
}

/// True for a key from which K is read because the map contains neither a camera matrix nor fx and fy (or cx and cy),
/// and for a key whose value K contains too.
pub(super) fn is_focal_key(view: &KeyView<'_>, key: &str) -> bool {
    let has = |names: &[&str]| !view.all(names).is_empty();
    let repeats = |k: &DMat3| {
        pairs_of_k(k).iter().any(|(names, values)| {
            let value = || focal_pair(&view.at.get(key)?).ok();
            view.has_name(key, names) && value().is_some_and(|pair| are_close(&pair, values))
        })
    };
    let [fx, fy, cx, cy] = keys::FOCALS;
    // The key's name is checked first, because `has` inspects all keys.
    let is_pair = |pair: &[&str], parts: [&[&str]; 2]| view.has_name(key, pair) && !parts.into_iter().all(has);
    let names_pair = view.has_name(key, &keys::FOCAL_PAIR) || view.has_name(key, &keys::PRINCIPAL_POINT);
    match names_pair && has(&keys::K) {
        true => k(view).is_ok_and(|k| k.is_some_and(|k| repeats(&k))),
        false => is_pair(&keys::FOCAL_PAIR, [fx, fy]) || is_pair(&keys::PRINCIPAL_POINT, [cx, cy]),
    }
}

/// Two numbers in a map, such as `focal_length: {fx: 500, fy: 500}` and `principal_point: {x: 320, y: 240}`.
fn pair_of_map(at: &Cursor<'_>) -> Option<[f64; 2]> {
    let names = [["fx", "fy"], ["cx", "cy"], ["x", "y"], ["u", "v"]];
    let [x, y] = pose_map::named(at, &names)?.map(|at| at.number().ok());
    Some([x?, y?])
}

/// Reads fx and fy from two numbers, or from one number for both.
fn focal_pair(at: &Cursor<'_>) -> Result<[f64; 2]> {
    if let Some(pair) = pair_of_map(at) {
        return Ok(pair);
    }
    match at.node.value {
        Value::Scalar(_) if at.numbers().is_err() => at.number().map(|focal| [focal; 2]),
        _ if at.numbers()?.len() == 1 => at.array::<1>().map(|[focal]| [focal; 2]),
        _ => at.array(),
    }
}

fn upper([fx, fy, cx, cy]: [f64; 4]) -> DMat3 {
    DMat3::from_cols(DVec3::new(fx, 0.0, 0.0), DVec3::new(0.0, fy, 0.0), DVec3::new(cx, cy, 1.0))
}

fn matrix(at: &Cursor<'_>) -> Result<DMat3> {
    if let Ok(four) = at.array::<4>() {
        return Ok(upper(four));
    }
    let k = match at.numbers()?[..] {
        // K is in the upper left corner of a 3x4 or 4x4 matrix.
        [a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0] | [a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0, 0.0, 0.0, 0.0, 1.0] => {
            DMat3::from_cols_array(&[a, b, c, d, e, f, g, h, i]).transpose()
        }
        _ => at.matrix3()?,
    };
    if k.z_axis.truncate() == glam::DVec2::ZERO && k.row(2).truncate() != glam::DVec2::ZERO && k.z_axis.z == 1.0 {
        return Err(at.fail(
            "cx and cy are in the last row, so the matrix is transposed (stored by columns, as in MATLAB and Open3D); \
             write K by rows",
        ));
    }
    if k.z_axis.z == 1.0 && k.x_axis.x.abs() < 10.0 && k.z_axis.x.abs() < 2.0 && k.z_axis.y.abs() < 2.0 {
        return Err(at.fail(
            "K is in units of the image size; expected pixels, so multiply the first row by the width and the second \
             by the height",
        ));
    }
    Ok(k)
}

/// Reads the image size (columns, rows) from a map with keys for both.
fn sides(at: &Cursor<'_>) -> Result<Vec<f64>> {
    let view = KeyView::new(at.clone());
    match (view.find_value(&keys::WIDTH)?, view.find_value(&keys::HEIGHT)?) {
        (Some(width), Some(height)) => Ok(vec![width.number()?, height.number()?]),
        _ => Err(at.fail("expected the keys width and height")),
    }
}

/// Reads the image size (columns, rows); `None` if the map contains no size.
pub(super) fn size(view: &KeyView<'_>) -> Result<Option<[u32; 2]>> {
    let (pair, shape) = (view.find_value(&keys::SIZE)?, view.find_value(&keys::SHAPE)?);
    // The size may be in a map of the image's properties: `image: {width: 640, height: 480}`.
    let of_image = || view.all(&["image"]).into_iter().find(|at| keys::is_keyed(at) && sides(at).is_ok());
    let pair = pair.or_else(of_image);
    let sides_of_map = match (view.find_value(&keys::WIDTH)?, view.find_value(&keys::HEIGHT)?) {
        (Some(width), Some(height)) => Some((width, height)),
        _ => None,
    };
    if let Some(at) = pair.as_ref().or(shape.as_ref()) {
        let mut numbers = match keys::is_keyed(at) {
            true => sides(at)?,
            false => match at.word() {
                // The size is one word, such as 640x480.
                Ok(word) => {
                    let parts =
                        word.split(['x', 'X', '*', ',', ' ', '\u{d7}', '(', ')']).filter(|part| !part.is_empty());
                    let numbers: Option<Vec<f64>> = parts.map(|part| part.parse().ok()).collect();
                    numbers
                        .ok_or_else(|| at.fail(format_args!("{word:?}; expected width and height, as in 640x480")))?
                }
                Err(_) => at.numbers()?,
            },
        };
        if pair.is_none() && !keys::is_keyed(at) {
            // The third number of a shape is the number of colour channels.
            numbers.truncate(2);
            numbers.reverse();
        }
        let whole = |v: &f64| v.fract() == 0.0 && (1.0..65537.0).contains(v);
        let [width, height] = numbers[..] else {
            return Err(
                at.fail(format_args!("{}; the image size must be two numbers", counted(numbers.len(), "number")))
            );
        };
        if !(whole(&width) && whole(&height)) {
            return Err(
                at.fail(format_args!("{width} x {height}; the image size must be two whole numbers from 1 to 65536"))
            );
        }
        if let Ok(Some(k)) = k(view) {
            let middle = |width: f64, height: f64| {
                let near = |c: f64, side: f64| (c / side - 0.5).abs() < 0.15;
                near(k.z_axis.x, width) && near(k.z_axis.y, height)
            };
            // Distance of the principal point from the image centre in x or y, whichever is larger, as a fraction of
            // the side.
            let off = |width: f64, height: f64| (k.z_axis.x / width - 0.5).abs().max((k.z_axis.y / height - 0.5).abs());
            let far = off(width, height) > 0.25 && off(height, width) < 0.2;
            if far || !middle(width, height) && middle(height, width) {
                return Err(at.fail(format_args!(
                    "{width} x {height} with the principal point ({}, {}) may be rows and columns; expected width, \
                     then height",
                    k.z_axis.x, k.z_axis.y
                )));
            }
        }
        for (own, side) in sides_of_map.iter().flat_map(|(w, h)| [(w, width), (h, height)]) {
            if own.key != at.key && own.number().is_ok() {
                check_equal(own, &[side], at)?;
            }
        }
        return Ok(Some([width as u32, height as u32]));
    }
    sides_of_map.map(|(width, height)| Ok([width.count()?, height.count()?])).transpose()
}

/// Reads the camera of a map; several cameras if the map contains several poses of the board. `directed` is the camera's
/// pose if it is a quaternion next to a position, or if two keys with a direction specify it.
pub(super) fn read(
    view: &KeyView<'_>,
    name: String,
    directed: Option<DirectedPose<'_>>,
    hints: &ReadHints,
    calibration: &mut Calibration,
) -> Result<()> {
    let at = &view.at;
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    record.k = Some(k(view)?.ok_or_else(|| at.fail("no camera matrix found; expected K or camera_matrix"))?);
    record.size = size(view)?;
    for above in &view.above {
        if record.size.is_none() {
            record.size = size(above)?;
        }
    }
    record.time = view.find_value(&["time"])?.map(|at| at.number()).transpose()?;
    record.lens = lens::read(view, hints)?;
    let mut used: &[&str] = &[];
    if let Some(found) = &directed {
        calibration.used_convention |= found.uses_hints;
        record.pose = Some(found.pose.clone());
        used = &found.keys;
    } else {
        record.pose = pose::read_pose(view, hints.poses)?;
        calibration.used_convention |= !hints.poses.is_empty() && record.pose.is_some() && pose::needs_direction(view)?;
    }
    if record.pose.is_none()
        && let Some((key, found)) = pose::in_key_of_k(view)
    {
        calibration.note_about(NoticeCode::AssumedConvention, key, "read as the pose [R | t], camera_from_world");
        record.pose = Some(found);
    }
    pose::note_units(view, record.pose.as_ref(), calibration)?;
    if record.pose.is_none() {
        record.pose = pose::read_mount(view)?;
        if record.pose.is_some() {
            on_a_body(&mut record, "rig");
        }
    }
    if let Some(named) = pose::read_named(view, record.pose.as_ref(), used, hints, calibration)? {
        if record.pose.as_ref().is_some_and(|pose| *pose != named) {
            return Err(at.fail("the camera has two different poses; expected one pose"));
        }
        record.pose = Some(named);
    }
    if record.pose.is_none()
        && let Some((key, found)) = record.k.and_then(|k| pose::in_camera_matrix(view, k))
    {
        calibration.note(NoticeCode::AssumedConvention, format!("the pose was read from {key} = K [R | t]"));
        record.pose = Some(found);
    }
    if record.pose.is_none()
        && let Some(poses) = pose::read_views(view)?
    {
        for (i, pose) in poses.into_iter().enumerate() {
            let name = format!("view{i}");
            calibration.records.push(CameraRecord { name, pose: Some(pose), ..record.clone() });
        }
        return Ok(());
    }
    calibration.records.push(record);
    Ok(())
}
