//! Calibrations of OpenCV, as YAML, JSON or XML: FileStorage with the keys of OpenCV's own programs, and files in users'
//! own words (`cameraMatrix` and `distCoeffs`, `mtx` and `dist`, `K` and `D`); the sensor files of EuRoC and Kimera
//! (T_BS, intrinsics, distortion_model, resolution).

use std::path::Path;

use crate::document::{Cursor, Value, npy, unread, yaml};
use crate::opencv::keys::{self, KeyView};
use crate::opencv::storage::parse;
use crate::opencv::{camera, stereo};
use crate::{Calibration, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_scene::NoticeCode;

/// Longest text that is parsed to find out what it is.
const MAX_DETECTED_BYTES: usize = 4 << 20;

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    let named = |name: &String| keys::is_camera_matrix(name);
    if npy::names(&source.bytes).iter().any(named)
        || npy::is_npy(&source.bytes) && source.stem().is_some_and(|stem| keys::is_known(&stem))
    {
        return true;
    }
    let path = &source.path;
    let has = |word: &str| text.contains(word);
    if unread::name_of(&[], text).is_some() && !has("opencv_storage") {
        return false;
    }
    let own = has("%YAML:1.0") || has("opencv-matrix") || has("<opencv_storage>");
    if own || has("T_BS") && has("intrinsics") {
        return true;
    }
    if text.len() > MAX_DETECTED_BYTES || !has(":") {
        return false;
    }
    let Ok(node) = yaml::parse(text, path) else { return false };
    let root = Cursor::root(&node, path);
    let cameras = list_of_cameras(&root).unwrap_or_default();
    has_camera(&root) || stereo::pair(&root).is_some() || cameras.iter().any(|(_, at)| has_camera(at))
}

/// True if a map has K.
fn has_camera(at: &Cursor<'_>) -> bool {
    let view = KeyView { at: at.clone(), side: &[] };
    at.is_map()
        && (view.all(&keys::K).iter().any(keys::is_matrix)
            || keys::FOCALS.iter().all(|key| !view.all(&[key]).is_empty()))
}

/// The maps below the root, by their keys; those of a list by their numbers.
fn list_of_cameras<'a>(root: &Cursor<'a>) -> Result<Vec<(String, Cursor<'a>)>> {
    let mut found = Vec::new();
    if let Ok(items) = root.list() {
        let named = |(i, at): (usize, Cursor<'a>)| (format!("camera{i}"), at);
        return Ok(items.into_iter().enumerate().map(named).collect());
    }
    for (name, inner) in root.entries()? {
        match inner.node.value {
            Value::List(_) => {
                let before = found.len();
                for (i, item) in inner.list()?.into_iter().enumerate().filter(|(_, item)| item.is_map()) {
                    found.push((format!("{name}{i}"), item));
                }
                if found.len() == before {
                    found.push((name.to_owned(), inner));
                }
            }
            Value::Map(_) if !has_camera(&inner) => {
                let entries = inner.entries()?;
                if entries.iter().any(|(_, at)| has_camera(at)) {
                    found.extend(entries.into_iter().map(|(name, at)| (name.to_owned(), at)));
                } else {
                    found.push((name.to_owned(), inner));
                }
            }
            _ => found.push((name.to_owned(), inner)),
        }
    }
    Ok(found)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let node = parse(source, assets)?;
    let root = Cursor::root(&node, &source.path);
    let view = KeyView { at: root.clone(), side: &[] };
    if has_camera(&root) {
        let mut calibration = one(&view, source.stem().unwrap_or_else(|| "camera".into()), hints)?;
        if npy::is_npy(&source.bytes) && view.all(&keys::LENS).is_empty() {
            calibration.note(NoticeCode::MissingValue, "no array of a lens lies beside K (dist_coeffs.npy): a pinhole");
        }
        return Ok(calibration);
    }
    if let Some(pair) = stereo::pair(&root) {
        return stereo::read(&root, pair, assets, hints);
    }
    several(&view, source, assets, hints)
}

/// The camera of a map.
fn one(view: &KeyView<'_>, name: String, hints: &ReadHints) -> Result<Calibration> {
    let mut notices = view.at.unread_keys(|key| view.knows(key))?;
    if let Some(inner) = view.intrinsics() {
        notices.extend(inner.at.unread_keys(|key| inner.knows(key))?);
    }
    let mut calibration = Calibration { notices, ..Calibration::default() };
    let name = match view.find_value(&["name", "cameraname"])? {
        Some(at) => at.word()?.to_owned(),
        None => name,
    };
    camera::read(view, name, hints, &mut calibration)?;
    if calibration.records.iter().all(|record| matches!(record.lens, raycam_scene::Lens::Pinhole)) {
        refuse_numbers_of_a_lens(view)?;
    }
    Ok(calibration)
}

/// Refuses numbers under an unknown key that may be the lens of a camera that has none.
fn refuse_numbers_of_a_lens(view: &KeyView<'_>) -> Result<()> {
    for (key, at) in view.at.entries()? {
        let Ok(numbers) = at.numbers() else { continue };
        let count = matches!(numbers.len(), 4 | 5 | 8 | 12 | 14) && numbers.iter().any(|v| v.fract() != 0.0);
        let is_quaternion = numbers.len() == 4 && (numbers.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-4;
        if count && !is_quaternion && !view.knows(key) && view.all(&keys::LENS).is_empty() {
            return Err(at.fail(format_args!(
                "{} numbers that may be a lens, and the camera has none: name them dist_coeffs, or remove them",
                numbers.len()
            )));
        }
    }
    Ok(())
}

/// Cameras in maps of their own; two of them with R and T are a pair.
fn several(view: &KeyView<'_>, source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let root = &view.at;
    let mut calibration = Calibration::default();
    let mut pose = camera::pose(view)?;
    for (name, inner) in list_of_cameras(root)? {
        if has_camera(&inner) {
            let camera = one(&KeyView { at: inner, side: &[] }, name, hints)?;
            calibration.records.extend(camera.records);
            calibration.notices.extend(camera.notices);
        } else {
            inner.refuse_lens(&name)?;
            let is_pose = pose.is_none() && keys::is_keyed(&inner);
            if is_pose {
                pose = camera::pose(&KeyView { at: inner.clone(), side: &[] })?;
            }
            if !(view.knows(&name) || view.is_rectified(&name) || is_pose && pose.is_some()) {
                calibration.note(NoticeCode::IgnoredKey, format!("{name} (line {}) is not read", inner.node.line));
            }
        }
    }
    if calibration.records.is_empty() {
        if pose.is_some()
            && let Some(partner) = stereo::partner(&source.path, "extrinsic", "intrinsic")
            && let Ok(intrinsics) = assets.read_reference(Path::new(""), &partner)
        {
            return read(&intrinsics, assets, hints);
        }
        return Err(root.fail("no camera in it: expected a camera matrix, as K, camera_matrix, cameraMatrix or mtx"));
    }
    if let (2, Some(pose)) = (calibration.records.len(), pose) {
        stereo::place_second(Some(pose), &mut calibration);
    }
    let size = if root.is_map() { camera::size(view)? } else { None };
    for record in calibration.records.iter_mut().filter(|record| record.size.is_none()) {
        record.size = size;
    }
    Ok(calibration)
}
