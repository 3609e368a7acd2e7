//! KITTI: calibrations with lines `KEY: numbers` (odometry and object `P0:` to `P3:`, raw `calib_cam_to_cam.txt`), and
//! poses with 12 numbers per line, world from camera (cvlibs.net/datasets/kitti, the development kits' readmes).
//!
//! `P` projects points of rectified camera 0, which defines the world here. `Tr` and similar keys of other sensors
//! cause a notice.

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{Lens, LensModel, Notice, NoticeCode, PixelCenter};

use crate::document::lens_keys::looks_like_lens;
use crate::document::number_format::{joined, matrix_rows34};
use crate::document::number_lines::{data_lines, looks_like, numbers};
use crate::document::rigid;
use crate::rig::{one_rig, poses_on_one_rig};
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let has_number = |values: &str| values.split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok());
    let keys = ["P0:", "P2:", "P_rect_00:", "K_00:"];
    data_lines(text).any(|(_, line)| keys.iter().any(|key| line.strip_prefix(key).is_some_and(has_number)))
}

pub(crate) fn detect_poses(_: &InputFile, text: &str) -> bool {
    looks_like(text, 12)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let mut calibration = Calibration::default();
    let mut rows: Vec<(&str, usize, &str)> = Vec::new();
    let mut places = HashMap::new();
    for (line, row) in data_lines(source.text()?) {
        let Some((key, values)) = row.split_once(':') else {
            return Err(FormatError::line(path, line, format!("{row:?}; expected KEY: numbers")));
        };
        if places.insert(key, rows.len()).is_some() {
            return Err(FormatError::line(path, line, format!("{key} is defined twice")));
        }
        rows.push((key, line, values));
    }
    let find = |key: String| places.get(&key[..]).map(|&place| &rows[place]);
    for &(key, line, values) in &rows {
        let number = key.strip_prefix("K_").or_else(|| key.strip_prefix("P_rect_"));
        if let Some(number) = number.filter(|_| key.starts_with("K_")) {
            let mut record = CameraRecord::new(number, PixelCenter::Integer);
            let k = DMat3::from_cols_array(&numbers::<9>(path, line, values)?).transpose();
            record.k = Some(k);
            if let Some(&(_, line, values)) = find(format!("D_{number}")) {
                let d = numbers::<5>(path, line, values)?;
                record.lens = Lens::new(LensModel::OpenCv, &d)
                    .map_err(|error| FormatError::line(path, line, error.to_string()))?;
            }
            record.size = size(path, find(format!("S_{number}")))?;
            if let (Some(&(_, line, r)), Some(&(_, other, t))) =
                (find(format!("R_{number}")), find(format!("T_{number}")))
            {
                let r = DMat3::from_cols_array(&numbers::<9>(path, line, r)?).transpose();
                let t = DVec3::from_array(numbers::<3>(path, other, t)?);
                record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
            }
            calibration.records.push(record);
        } else if number.is_some() || key.len() == 2 && key.starts_with('P') {
            let m: [f64; 12] = numbers(path, line, values)?;
            // The development kit of the object data set writes zeros as the matrices of missing cameras.
            if m == [0.0; 12] {
                calibration.note_about(
                    NoticeCode::IgnoredElement,
                    format!("{key} (line {line})"),
                    "camera omitted, because its matrix is 0",
                );
                continue;
            }
            let mut record = CameraRecord::new(key, PixelCenter::Integer);
            record.matrix = Some([0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| m[4 * i + j])));
            if let Some(number) = number {
                record.size = size(path, find(format!("S_rect_{number}")))?;
            }
            calibration.records.push(record);
        } else if looks_like_lens(key) && values.split_whitespace().any(|word| word.parse::<f64>() != Ok(0.0)) {
            return Err(FormatError::line(
                path,
                line,
                format!(
                    "{key} looks like lens coefficients, but cameras given by P have no lens model; remove the key if \
                     the images are rectified, or write K and D of the camera as YAML or JSON"
                ),
            ));
        } else if !["S_", "D_", "R_0", "T_0", "R_rect_00"].iter().any(|start| key.starts_with(start)) {
            calibration.note_about(NoticeCode::IgnoredElement, format!("{key} (line {line})"), "not a camera; ignored");
        }
    }
    // The world is rectified camera 0; R and T of the raw cameras are relative to raw camera 0.
    if let Some(&(_, line, values)) = find("R_rect_00".into()) {
        let raw_from_rectified = DMat3::from_cols_array(&numbers::<9>(path, line, values)?);
        let world = Pose::camera_from_world(Rotation::Matrix(raw_from_rectified), DVec3::ZERO);
        for record in calibration.records.iter_mut().filter(|record| record.matrix.is_none()) {
            record.pose = Some(record.pose.take().unwrap_or_else(Pose::identity).compose(&world));
        }
    }
    // The raw calibration contains its cameras twice: raw, and rectified.
    for (rig, rectified) in [("unrectified", false), ("rig", true)] {
        let records = calibration.records.iter_mut();
        one_rig(records.filter(|record| record.matrix.is_some() == rectified), rig);
    }
    Ok(calibration)
}

fn size(path: &Path, row: Option<&(&str, usize, &str)>) -> Result<Option<[u32; 2]>> {
    let Some(&(_, line, values)) = row else { return Ok(None) };
    let size: [f64; 2] = numbers(path, line, values)?;
    if size.iter().any(|v| v.fract() != 0.0 || !(1.0..65537.0).contains(v)) {
        let message = format!("{} x {}; expected width and height, whole numbers from 1 to 65536", size[0], size[1]);
        return Err(FormatError::line(path, line, message));
    }
    Ok(Some(size.map(|v| v as u32)))
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    if records.len() > 10 {
        return Err(FormatError::encode(format!(
            "a KITTI calibration stores the cameras of one rig, P0 to P9; got {}",
            records.len()
        )));
    }
    let mut text = String::new();
    let mut notices = Vec::new();
    let format = "a KITTI calibration";
    let mut poses = vec![];
    if records.iter().all(|record| record.mount.is_some()) {
        poses = poses_on_one_rig(records, format, &mut notices)?;
        let moved = |record: &CameraRecord| record.mount.as_ref().is_some_and(|m| !m.body.is_identity());
        if poses[0].r_c().0 != DMat3::IDENTITY {
            // The rig's axes are the first camera's axes.
            let first = poses[0].inverted();
            poses = poses.iter().map(|pose| pose.compose(&first)).collect();
        } else if !records.iter().any(moved) {
            poses.clear();
        }
    }
    for (i, record) in records.iter().enumerate() {
        record.require_pinhole(format)?;
        let matrix = match record.matrix {
            Some(matrix) if poses.is_empty() && record.pixel_center == PixelCenter::Integer => matrix,
            _ => {
                let k = record.k_with(PixelCenter::Integer, format)?;
                let pose = match poses.get(i) {
                    Some(pose) => pose.clone(),
                    None => record.require_pose()?,
                };
                let (r, t) = pose.r_t();
                matrix_rows34(k * r.matrix(), k * t)
            }
        };
        text += &format!("P{i}: {}\n", joined(matrix.as_flattened(), " "));
        if record.name != format!("P{i}") {
            notices.push(Notice::new(
                NoticeCode::Renamed,
                format!("in a KITTI calibration, camera {:?} is called P{i}", record.name),
            ));
        }
    }
    notices.push(Notice::new(NoticeCode::NotWritten, "a KITTI calibration has no image sizes; they are not written"));
    Ok(OutputFiles { notices, ..OutputFiles::one(text) })
}

pub(crate) fn read_poses(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    for (i, (line, row)) in data_lines(source.text()?).enumerate() {
        let mut record = CameraRecord::new(format!("{i:06}"), PixelCenter::Integer);
        let (r, c) = rigid(&numbers(&source.path, line, row)?);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        calibration.records.push(record);
    }
    Ok(calibration)
}

pub(crate) fn write_poses(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let mut text = String::new();
    for record in records {
        let (r, c) = record.require_pose()?.world_r_c();
        text += &format!("{}\n", joined(matrix_rows34(r.matrix(), c).as_flattened(), " "));
    }
    Ok(OutputFiles {
        notices: vec![Notice::new(
            NoticeCode::NotWritten,
            "a file of KITTI poses stores only poses; names, sizes, K and lens are not written",
        )],
        ..OutputFiles::one(text)
    })
}
