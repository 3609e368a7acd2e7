//! BOP: `scene_camera.json` (cam_K, cam_R_w2c, cam_t_w2c in millimetres for each image) and `camera.json` (fx fy cx cy
//! width height for all images). Source: bop_toolkit, docs/bop_datasets_format.md. The world is in metres.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{Notice, NoticeCode, PixelCenter, counted};

use crate::devices::aria::camera_model;
use crate::document::Cursor;
use crate::document::number_format::{joined, matrix_rows3, quoted, yaml_float};
use crate::document::yaml;
use crate::picture_size::size_of_picture;
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    // Other programs store a map with a matrix under cam_K.
    let list = |rest: &str| rest.trim_start().trim_start_matches(':').trim_start().starts_with('[');
    // BOP's files contain a map for each image.
    let is_in_image = |before: &str| before.matches('{').count() > before.matches('}').count() + 1;
    text.split_once("\"cam_K\"").is_some_and(|(before, rest)| is_in_image(before) && list(rest))
        || text.contains("\"cam_model\"")
        || text.contains("\"depth_scale\"") && text.contains("\"fx\"")
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let scale = |at: &Cursor<'_>| at.get("depth_scale").map(|at| at.number()).transpose();
    if root.get("fx").is_some() {
        calibration.notices = root.unknown_keys(&["fx", "fy", "cx", "cy", "width", "height", "depth_scale"])?;
        let get = |key: &str| root.require(key)?.number();
        let mut record = CameraRecord::new("camera", PixelCenter::Integer);
        record.k = Some(DMat3::from_cols(
            DVec3::new(get("fx")?, 0.0, 0.0),
            DVec3::new(0.0, get("fy")?, 0.0),
            DVec3::new(get("cx")?, get("cy")?, 1.0),
        ));
        record.size = Some([root.require("width")?.count()?, root.require("height")?.count()?]);
        record.depth_scale = scale(&root)?;
        calibration.records.push(record);
        return Ok(calibration);
    }
    let mut unread = std::collections::BTreeMap::<String, usize>::new();
    let mut measured = 0;
    for (name, image) in root.entries()? {
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        match (image.get("cam_K"), image.get("cam_model")) {
            (Some(k), None) => record.k = Some(k.matrix3()?),
            (None, Some(model)) => camera_model(&model, &mut record)?,
            (Some(_), Some(model)) => {
                return Err(model.fail("the image also has cam_K; expected only one of cam_K and cam_model"));
            }
            (None, None) => return Err(image.fail("cam_K or cam_model is required; both are missing")),
        }
        if record.size.is_none()
            && let Ok(number) = name.parse::<u32>()
        {
            let files = ["rgb", "gray"].map(|folder| ["png", "jpg"].map(|end| format!("{folder}/{number:06}.{end}")));
            record.size = size_of_picture(assets, &source.path, files.into_iter().flatten());
            measured += usize::from(record.size.is_some());
        }
        record.depth_scale = scale(&image)?;
        if let Some(r) = image.get("cam_R_w2c") {
            let t = DVec3::from_array(image.require("cam_t_w2c")?.array::<3>()?);
            record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r.matrix3()?), t / 1000.0));
        }
        for (key, at) in image.entries()? {
            if !["cam_K", "cam_model", "cam_R_w2c", "cam_t_w2c", "depth_scale"].contains(&key) {
                at.refuse_lens(key)?;
                *unread.entry(key.to_owned()).or_default() += 1;
            }
        }
        calibration.records.push(record);
    }
    calibration.notices = unread
        .iter()
        .map(|(key, count)| {
            Notice::about(NoticeCode::IgnoredKey, format!("{key} of {}", counted(*count, "image")), "not used")
        })
        .collect();
    if measured > 0 {
        calibration.note(
            NoticeCode::UsedOtherFile,
            format!("the file has no image sizes; they are read from the images ({})", counted(measured, "camera")),
        );
    }
    Ok(calibration)
}

/// Converts metres to millimetres such that reading the result back gives the same number of metres, or the nearest
/// possible number.
fn millimetres(metres: f64) -> f64 {
    let near = metres * 1000.0;
    let exact = |v: &f64| *v / 1000.0 == metres;
    [near, near.next_up(), near.next_down()].into_iter().find(exact).unwrap_or(near)
}

pub(crate) fn write(records: &[CameraRecord], path: &Path) -> Result<OutputFiles> {
    let format = "BOP's scene_camera.json";
    let single = path.file_name().is_some_and(|name| name == "camera.json");
    if single {
        return write_camera(records);
    }
    let mut text = String::from("{");
    let mut notices = Vec::new();
    for (i, record) in records.iter().enumerate() {
        record.require_pinhole(format)?;
        let id = match record.name.parse::<u32>() {
            Ok(id) if id.to_string() == record.name => id.to_string(),
            _ => {
                notices.push(Notice::new(
                    NoticeCode::Renamed,
                    format!("camera {:?} is stored as image {i} in {format}", record.name),
                ));
                i.to_string()
            }
        };
        let between = if i == 0 { "" } else { "," };
        let k = record.k_with(PixelCenter::Integer, format)?;
        let _ = write!(text, "{between}\n  {}: {{\"cam_K\": [{}]", quoted(&id), joined(&matrix_rows3(k), ", "));
        if record.pose.is_some() || record.matrix.is_some() {
            let (r, t) = record.require_pose()?.r_t();
            let t = t.to_array().map(millimetres);
            let _ = write!(text, ", \"cam_R_w2c\": [{}]", joined(&matrix_rows3(r.matrix()), ", "));
            let _ = write!(text, ", \"cam_t_w2c\": [{}]", joined(&t, ", "));
        }
        let _ = write!(text, ", \"depth_scale\": {}}}", yaml_float(record.depth_scale.unwrap_or(1.0)));
    }
    text += "\n}\n";
    notices.push(Notice::new(NoticeCode::NotWritten, format!("{format} has no image sizes; they are not written")));
    Ok(OutputFiles { notices, ..OutputFiles::one(text) })
}

fn write_camera(records: &[CameraRecord]) -> Result<OutputFiles> {
    let format = "BOP's camera.json";
    let [record] = records else {
        return Err(FormatError::encode(format!(
            "{format} stores one camera, got {}; write each camera to a separate file",
            records.len()
        )));
    };
    record.require_pinhole(format)?;
    let focals = record.focals_with(PixelCenter::Integer, format)?;
    let [width, height] = record.require_size(format)?;
    let [fx, fy, cx, cy] = focals.map(yaml_float);
    let scale = yaml_float(record.depth_scale.unwrap_or(1.0));
    Ok(OutputFiles::one(format!(
        "{{\n  \"cx\": {cx},\n  \"cy\": {cy},\n  \"depth_scale\": {scale},\n  \"fx\": {fx},\n  \"fy\": {fy},\n  \
         \"height\": {height},\n  \"width\": {width}\n}}\n"
    )))
}
