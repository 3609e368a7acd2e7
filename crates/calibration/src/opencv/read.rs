//! Calibrations of OpenCV, as YAML, JSON or XML: FileStorage with the keys of OpenCV's own programs, and files with
//! common user-defined keys (`cameraMatrix` and `distCoeffs`, `mtx` and `dist`, `K` and `D`); the sensor files of EuRoC
//! and Kimera (T_BS, intrinsics, distortion_model, resolution).

use crate::document::lens_keys::plain;
use crate::document::number_lines::has_kitti_matrix;
use crate::document::{Cursor, DocumentNode, csv_tree, npy, unread};
use crate::opencv::camera_maps::{has_camera, list_of_cameras};
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use crate::opencv::storage::{parse, parse_tree};
use crate::opencv::{
    by_name, camera, one_camera, partner, pose, projection, quaternion_pose, separate_maps, stacks, stereo,
};
use crate::{Calibration, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};
use raycam_scene::NoticeCode;

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
    let Ok((node, _)) = by_name::split(node) else { return true };
    let Ok(node) = stacks::unstack(node) else { return true };
    let root = Cursor::root(&node, path);
    let cameras = list_of_cameras(&root).unwrap_or_default();
    has_camera(&root)
        || stereo::pair(&root).is_some()
        || !keys::marks(&root).is_empty()
        || source.stem().is_some_and(|stem| stem.contains("extrinsic")) && partner::has_poses(&root)
        || cameras.iter().any(|(_, view)| has_camera(&view.at))
        || projection::is_in(&root)
}

/// Reads the cameras of one map, in which the keys of K, lens and pose contain the name or number of each camera.
fn marked(root: &KeyView<'_>, hints: &ReadHints) -> Result<Calibration> {
    let marks = keys::marks(&root.at);
    let views: Vec<KeyView<'_>> =
        marks.iter().map(|mark| KeyView::marked(root.at.clone(), vec![mark.clone()])).collect();
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

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let fail = |message: String| FormatError::whole(&source.path, message);
    let (node, notices) = by_name::split(parse(source, assets)?).map_err(fail)?;
    let node = stacks::unstack(node).map_err(fail)?;
    let mut calibration = read_tree(&node, source, assets, hints)?;
    calibration.notices.extend(notices);
    Ok(calibration)
}

/// Reads the cameras of a document, in which each camera has its own keys or its own map.
fn read_tree(
    node: &DocumentNode,
    source: &InputFile,
    assets: &mut AssetRoot,
    hints: &ReadHints,
) -> Result<Calibration> {
    let root = Cursor::root(node, &source.path);
    let view = KeyView::new(root.clone());
    if has_camera(&root) {
        let mut calibration = one_camera::read(&view, source.stem().unwrap_or_else(|| "camera".into()), hints)?;
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
    separate_maps::read(&view, source, assets, hints, read)
}
