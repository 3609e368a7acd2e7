//! Calibrations of OpenCV, as YAML, JSON or XML: FileStorage with the keys of OpenCV's own programs, and files with
//! common user-defined keys (`cameraMatrix` and `distCoeffs`, `mtx` and `dist`, `K` and `D`); the sensor files of EuRoC
//! and Kimera (T_BS, intrinsics, distortion_model, resolution).

use crate::document::lens_keys::plain;
use crate::document::number_lines::has_kitti_matrix;
use crate::document::{Cursor, Value, csv_tree, npy, unread};
use crate::opencv::keys::{self, KeyView};
use crate::opencv::storage::{parse, parse_tree};
use crate::opencv::{
    by_name, camera, directed_pose, partner, pose, projection, quaternion_pose, separate_maps, stacks, stereo,
    unread_parts,
};
use crate::{Calibration, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};
use raycam_scene::{NoticeCode, counted};

/// Keys of a map with the parameters of one camera; the camera's name is the key of the enclosing map.
const PARAMETERS: [&str; 5] = ["param", "params", "parameters", "calibration", "values"];

/// Maximum length of a text that is parsed to determine its format.
const MAX_DETECTED_BYTES: usize = 4 << 20;

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    let named = |name: &String| keys::is_camera_matrix(name) || projection::is_key(name.trim_end_matches(".npy"));
    let names = npy::names(&source.bytes);
    let has_any = |keys: &[&str]| names.iter().any(|name| keys.contains(&&plain(name)[..]));
    if names.iter().any(named)
        || keys::FOCALS.iter().all(|keys| has_any(keys))
        || npy::is_npy(&source.bytes) && source.stem().is_some_and(|stem| keys::is_known(&stem))
    {
        return true;
    }
    let path = &source.path;
    let has = |word: &str| text.contains(word);
    if unread::name_of(&[], text).is_some() && !has("opencv_storage") || has_kitti_matrix(text) {
        return false;
    }
    let own = has("%YAML:1.0") || has("!!opencv-matrix") || has("\"opencv-matrix\"") || has("<opencv_storage>");
    if own || has("T_BS") && has("intrinsics") {
        return true;
    }
    if text.len() > MAX_DETECTED_BYTES
        || ![":", "=", "<"].iter().any(|mark| has(mark)) && csv_tree::parse(text, keys::is_focal_length).is_none()
    {
        return false;
    }
    let Ok(node) = parse_tree(text, path) else { return false };
    let Ok(node) = stacks::unstack(by_name::split(node)) else { return true };
    let root = Cursor::root(&node, path);
    let cameras = list_of_cameras(&root).unwrap_or_default();
    has_camera(&root)
        || stereo::pair(&root).is_some()
        || !keys::marks(&root).is_empty()
        || source.stem().is_some_and(|stem| stem.contains("extrinsic")) && partner::has_poses(&root)
        || cameras.iter().any(|(_, view)| has_camera(&view.at))
        || projection::is_in(&root)
}

/// True if a map contains K.
pub(super) fn has_camera(at: &Cursor<'_>) -> bool {
    let view = KeyView::new(at.clone());
    at.is_map()
        && (view.all(&keys::K).iter().any(keys::is_matrix)
            || keys::FOCALS.iter().all(|names| !view.all(names).is_empty())
            || camera::has_focal_pair(&view))
}

/// Reads the cameras of one map, in which the keys of K, lens and pose contain the name or number of each camera.
fn marked(root: &KeyView<'_>, hints: &ReadHints) -> Result<Calibration> {
    let marks = keys::marks(&root.at);
    let views: Vec<KeyView<'_>> =
        marks.iter().map(|mark| KeyView { at: root.at.clone(), side: vec![mark.clone()], above: vec![] }).collect();
    let quaternions = views.iter().map(|view| quaternion_pose::read(view, hints)).collect::<Result<Vec<_>>>()?;
    let known = |key: &str| {
        root.knows(key)
            || views.iter().any(|view| view.knows(key) || pose::is_named(view, key) || view.is_rectified(key))
            || quaternions.iter().flatten().any(|found| found.keys.contains(&key))
    };
    let mut calibration = Calibration { notices: root.at.unread_keys(known)?, ..Calibration::default() };
    for ((mark, view), quaternion) in marks.iter().zip(&views).zip(quaternions) {
        let number = mark.bytes().all(|c| c.is_ascii_digit());
        camera::read(
            view,
            if number { format!("camera{mark}") } else { mark.clone() },
            quaternion,
            hints,
            &mut calibration,
        )?;
    }
    let size = camera::size(root)?;
    for record in &mut calibration.records {
        record.size = record.size.or(size);
    }
    let pair_pose = pose::read_r_t(root)?;
    match (&mut calibration.records[..], &pair_pose) {
        (_, None) => {}
        ([only], Some(_)) => {
            only.pose = pair_pose;
            return Ok(calibration);
        }
        ([first, second], Some(_)) => {
            let (first, second) = (&first.name, &second.name);
            let message =
                format!("R and T are interpreted as mapping points from {first} to {second}, in the order of the file");
            calibration.note(NoticeCode::AssumedConvention, message);
        }
        _ => {
            return Err(root
                .at
                .fail("R and T next to several cameras are ambiguous; write R_NAME and T_NAME for each camera"));
        }
    }
    stereo::place_second(pair_pose, &mut calibration).map_err(|error| root.at.fail(error))?;
    Ok(calibration)
}

/// Maximum nesting level of the maps of cameras below the root.
const MAX_CAMERA_DEPTH: usize = 5;

/// True if a map contains cameras at most `depth` levels below it.
fn contains_cameras(at: &Cursor<'_>, depth: usize) -> bool {
    let below = |at: &Cursor<'_>| has_camera(at) || depth > 0 && at.is_map() && contains_cameras(at, depth - 1);
    let in_list = |at: &Cursor<'_>| at.list().is_ok_and(|items| items.iter().any(below));
    at.entries().is_ok_and(|entries| entries.iter().any(|(_, at)| below(at) || in_list(at)))
}

/// The camera of a list's item, with its name if the item contains only the name and the camera, as in `[{"front":
/// {...}}, {"back": {...}}]`.
fn item_of_list(at: Cursor<'_>) -> (Option<String>, Cursor<'_>) {
    match &at.entries().unwrap_or_default()[..] {
        [(name, inner)] if !has_camera(&at) && has_camera(inner) => (Some((*name).to_owned()), inner.clone()),
        _ => (None, at),
    }
}

/// The maps directly below the root, named by their key or by their index in a list.
pub(super) fn list_of_cameras<'a>(root: &Cursor<'a>) -> Result<Vec<(String, KeyView<'a>)>> {
    let mut found = Vec::new();
    if let Ok(items) = root.list() {
        let named = |(i, at): (usize, Cursor<'a>)| {
            let (name, at) = item_of_list(at);
            (name.unwrap_or_else(|| format!("camera{i}")), KeyView::new(at))
        };
        return Ok(items.into_iter().enumerate().map(named).collect());
    }
    append_cameras(root, "", &[], &mut found)?;
    Ok(found)
}

/// Appends the cameras of one map, whose key is `parent`.
fn append_cameras<'a>(
    at: &Cursor<'a>,
    parent: &str,
    above: &[Cursor<'a>],
    found: &mut Vec<(String, KeyView<'a>)>,
) -> Result<()> {
    let own: Vec<Cursor<'a>> = [at.clone()].into_iter().chain(above.iter().cloned()).collect();
    let below = |at: Cursor<'a>| KeyView { at, side: vec![], above: own.clone() };
    for (name, inner) in at.entries()? {
        match inner.node.value {
            Value::List(_) => {
                let before = found.len();
                for (i, item) in inner.list()?.into_iter().enumerate().filter(|(_, item)| item.is_map()) {
                    let (own, item) = item_of_list(item);
                    found.push((own.unwrap_or_else(|| format!("{name}{i}")), below(item)));
                }
                if found.len() == before {
                    found.push((name.to_owned(), below(inner)));
                }
            }
            Value::Map(_) if above.len() < MAX_CAMERA_DEPTH && !has_camera(&inner) && contains_cameras(&inner, 3) => {
                append_cameras(&inner, name, &own, found)?;
            }
            _ => {
                let holder = has_camera(&inner) && !parent.is_empty() && PARAMETERS.contains(&&plain(name)[..]);
                found.push((if holder { parent } else { name }.to_owned(), below(inner)));
            }
        }
    }
    Ok(())
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let node = stacks::unstack(by_name::split(parse(source, assets)?));
    let node = node.map_err(|message| FormatError::whole(&source.path, message))?;
    let root = Cursor::root(&node, &source.path);
    let view = KeyView::new(root.clone());
    if has_camera(&root) {
        let mut calibration = one(&view, source.stem().unwrap_or_else(|| "camera".into()), hints)?;
        if npy::is_npy(&source.bytes) && view.all(&keys::LENS).is_empty() {
            calibration.note(
                NoticeCode::MissingValue,
                "no lens coefficients (dist_coeffs.npy) found next to K; the camera is a pinhole",
            );
        }
        return Ok(calibration);
    }
    if let Some(pair) = stereo::pair(&root) {
        return stereo::read(&root, pair, assets, hints);
    }
    if !keys::marks(&root).is_empty() {
        return marked(&view, hints);
    }
    let has_k = list_of_cameras(&root)?.iter().any(|(_, view)| has_camera(&view.at));
    if !has_k && projection::is_in(&root) {
        return projection::read(&root, source.stem());
    }
    separate_maps::read(&view, source, assets, hints)
}

/// Reads the camera of a map.
pub(super) fn one(view: &KeyView<'_>, name: String, hints: &ReadHints) -> Result<Calibration> {
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
