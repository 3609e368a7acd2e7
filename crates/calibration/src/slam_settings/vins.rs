//! Configurations of VINS-Mono and VINS-Fusion: files of cameras, or one camera's keys in the same file, and their
//! mounts, body_from_camera. Source: VINS-Fusion, parameters.cpp; the comments of VINS-Mono's configurations.

use crate::calibration_tools::camodocal;
use crate::document::{Cursor, check_rotation, yaml};
use crate::rig::on_a_body;
use crate::{Calibration, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_scene::NoticeCode;

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    // `body_T_cam` alone may also be the mount of a camera in another format.
    let has = |key: &str| text.contains(key);
    has("cam0_calib") || has("extrinsicRotation") || has("body_T_cam") && (has("num_of_cam") || has("model_type"))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let mut used = 0;
    for (key, at) in root.entries()? {
        let own = key.starts_with("cam") || key.starts_with("body_T_cam") || camodocal::KEYS.contains(&key);
        if own {
            used += 1;
        } else if key != camodocal::MASK_FLAG {
            at.refuse_lens(key)?;
        }
    }
    let mut mounted = true;
    if root.get("model_type").is_some() {
        let stem = source.stem().unwrap_or_else(|| "camera".into());
        let mut record = camodocal::camera(&root, stem)?;
        // The file contains the keys of a single camera; the index of its mount is unknown, so the first `body_T_cam`
        // that exists is used.
        record.pose = (0..8).find_map(|i| mount(&root, i).transpose()).transpose()?;
        calibration.records.push(record);
    } else {
        let count = root.get("num_of_cam").map_or(Ok(1), |at| at.count())?;
        for i in 0..count.min(64) {
            let file = root.require(&format!("cam{i}_calib"))?;
            let name = file.word()?;
            let inner = assets.read_reference(&source.path, name).map_err(|error| {
                file.fail(format_args!("cannot read {name:?}, the camera file next to this file: {error}"))
            })?;
            let inner_node = yaml::parse(inner.text()?, &inner.path)?;
            let mut record = camodocal::camera(&Cursor::root(&inner_node, &inner.path), format!("cam{i}"))?;
            record.name = format!("cam{i}");
            record.pose = mount(&root, i)?;
            calibration.records.push(record);
        }
    }
    for record in &mut calibration.records {
        mounted &= record.pose.is_some();
        on_a_body(record, "rig");
    }
    if !mounted {
        calibration
            .note(NoticeCode::MissingValue, "cameras without body_T_cam (or extrinsicRotation) are at the origin");
    }
    let others = root.entries()?.len() - used;
    if others > 0 {
        calibration.note(
            NoticeCode::IgnoredKey,
            format!("other keys, which are settings of VINS, are ignored (number of keys: {others})"),
        );
    }
    Ok(calibration)
}

/// Reads the pose of a camera in the axes of the body.
fn mount(root: &Cursor<'_>, i: u32) -> Result<Option<Pose>> {
    if let Some(at) = root.get(&format!("body_T_cam{i}")) {
        let (r, c) = at.matrix4()?;
        return Ok(Some(Pose::world_from_camera(Rotation::Matrix(r), c)));
    }
    let (Some(r), Some(t), 0) = (root.get("extrinsicRotation"), root.get("extrinsicTranslation"), i) else {
        return Ok(None);
    };
    let rotation = r.matrix3()?;
    check_rotation(rotation).map_err(|message| r.fail(message))?;
    let c = glam::DVec3::from_array(t.array()?);
    Ok(Some(Pose::world_from_camera(Rotation::Matrix(rotation), c)))
}
