//! Polycam's raw export: a JSON file for each image with K and `t_00` to `t_23`, the rows of world_from_camera with
//! OpenGL's axes, y up. Source: nerfstudio's polycam_utils.py. Polycam does not specify the position of pixel centres;
//! the convention of the NeRF family is assumed.

use raycam_scene::{Notice, NoticeCode, PixelCenter};

use crate::document::{Cursor, check_rigid, rigid, yaml};
use crate::intrinsics::pinhole_matrix;
use crate::trajectory::convention::flip_columns;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Folders of the JSON files in an export, the optimised poses first.
const FOLDERS: [&str; 6] =
    ["keyframes/corrected_cameras", "keyframes/cameras", "corrected_cameras", "cameras", "", "../corrected_cameras"];
const PIXEL_RULE: &str = "Polycam does not specify the position of pixel centres; the first pixel's centre is assumed \
    at (0.5, 0.5)";

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"t_00\"") && text.contains("\"t_23\"")
}

fn find_cameras(folder: &Folder, assets: &mut AssetRoot) -> Option<Folder> {
    for name in &FOLDERS[..5] {
        let place = if name.is_empty() { Folder::open(&folder.path, assets) } else { folder.inner(name, assets) };
        let first = place.ending(".json").next().cloned();
        let Some(source) = first.and_then(|first| place.read(&first, assets).ok()) else { continue };
        if detect(&source, source.text().unwrap_or_default()) {
            return Some(place);
        }
    }
    None
}

pub(crate) fn detect_folder(folder: &Folder, assets: &mut AssetRoot) -> bool {
    find_cameras(folder, assets).is_some()
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let place = find_cameras(folder, assets);
    let place = place.ok_or_else(|| {
        FormatError::unsupported(&folder.path, "expected a folder of Polycam that contains keyframes/")
    })?;
    let mut calibration =
        Calibration { notices: vec![Notice::new(NoticeCode::AssumedConvention, PIXEL_RULE)], ..Calibration::default() };
    for name in place.ending(".json") {
        calibration.records.push(camera(&place.read(name, assets)?)?);
    }
    Ok(calibration)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    Ok(Calibration {
        records: vec![camera(source)?],
        notices: vec![Notice::new(NoticeCode::AssumedConvention, PIXEL_RULE)],
        ..Calibration::default()
    })
}

fn camera(source: &InputFile) -> Result<CameraRecord> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    for (key, at) in root.entries()? {
        at.refuse_lens(key)?;
    }
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    let mut record = CameraRecord::new(stem.clone(), PixelCenter::Half);
    record.image = Some(format!("{stem}.jpg"));
    let get = |key: &str| root.require(key)?.number();
    record.k = Some(pinhole_matrix([get("fx")?, get("fy")?, get("cx")?, get("cy")?]));
    record.size = Some([root.require("width")?.count()?, root.require("height")?.count()?]);
    let mut m = [0.0; 16];
    m[15] = 1.0;
    for (i, value) in m[..12].iter_mut().enumerate() {
        *value = get(&format!("t_{}{}", i / 4, i % 4))?;
    }
    let rows = check_rigid(&m).map_err(|message| root.fail(format_args!("t_00 to t_23: {message}")))?;
    let (gl, c) = rigid(&rows);
    record.pose = Some(Pose::world_from_camera(Rotation::Matrix(flip_columns(gl)), c));
    Ok(record)
}
