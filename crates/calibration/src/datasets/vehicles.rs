//! Calibrations of cameras on a vehicle: Argoverse 2's tables as CSV or JSON (`intrinsics`, with
//! `egovehicle_SE3_sensor` in the same folder), and Waymo's camera_calibrations as JSON. Sources: av2's API; Waymo's
//! dataset.proto.

use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, DocumentNode, Value, yaml};
use crate::intrinsics::{brown_lens, pinhole_matrix};
use crate::rig::one_rig;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

const ON_THE_VEHICLE: &str = "camera poses are relative to the vehicle (x forward, y left, z up)";
const CALIBRATIONS: [&str; 2] = ["camera_calibrations", "cameraCalibrations"];

pub(crate) fn detect_argoverse(_: &InputFile, text: &str) -> bool {
    ["sensor_name", "fx_px", "cy_px"].iter().all(|word| text.contains(word))
}

pub(crate) fn detect_waymo(_: &InputFile, text: &str) -> bool {
    CALIBRATIONS.iter().any(|key| text.contains(&format!("\"{key}\""))) && text.contains("\"intrinsic\"")
}

/// Reads a table (CSV with a header, or JSON with a map per row) as one document.
fn table(source: &InputFile) -> Result<DocumentNode> {
    let text = source.text()?;
    if text.trim_start().starts_with(['[', '{']) {
        return yaml::parse(text, &source.path);
    }
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let words = |line: &'_ str| line.split(',').map(|word| word.trim().to_owned()).collect::<Vec<_>>();
    let header = lines.next().map(|(_, line)| words(line)).unwrap_or_default();
    let mut rows = Vec::new();
    for (i, line) in lines {
        let cells = words(line);
        if cells.len() != header.len() {
            let message = format!("the row has {}; the header has {}", counted(cells.len(), "column"), header.len());
            return Err(FormatError::line(&source.path, i + 1, message));
        }
        let scalar = |word| DocumentNode { value: Value::Scalar(word), line: i + 1 };
        let entries = header.iter().cloned().zip(cells.into_iter().map(scalar)).collect();
        rows.push(DocumentNode { value: Value::Map(entries), line: i + 1 });
    }
    Ok(DocumentNode { value: Value::List(rows), line: 1 })
}

pub(crate) fn read_argoverse(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = table(source)?;
    let mut calibration = Calibration::default();
    let ending = source.path.extension().and_then(|ending| ending.to_str()).unwrap_or("csv");
    let partner = format!("egovehicle_SE3_sensor.{ending}");
    let mounts = match assets.is_file(&source.path, partner.as_bytes()) {
        true => Some(assets.read_reference(&source.path, &partner)?),
        false => None,
    };
    let placed = mounts.as_ref().map(table).transpose()?;
    for row in Cursor::root(&node, &source.path).list()? {
        let number = |key: &str| row.require(key)?.number();
        let name = row.require("sensor_name")?.word()?;
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.size = Some([row.require("width_px")?.count()?, row.require("height_px")?.count()?]);
        record.k = Some(pinhole_matrix([number("fx_px")?, number("fy_px")?, number("cx_px")?, number("cy_px")?]));
        let [k1, k2, k3] = [row.number_or("k1", 0.0)?, row.number_or("k2", 0.0)?, row.number_or("k3", 0.0)?];
        record.lens = brown_lens(k1, k2, 0.0, 0.0, k3).map_err(|message| row.fail(message))?;
        if let (Some(node), Some(file)) = (&placed, &mounts) {
            record.pose = Some(argoverse_mount(&Cursor::root(node, &file.path), name, &file.path)?);
        }
        calibration.records.push(record);
    }
    match placed {
        Some(_) => calibration.note(NoticeCode::PlacedCameras, ON_THE_VEHICLE),
        None => calibration
            .note(NoticeCode::MissingFile, format!("no {partner} in the same folder; the cameras are at the origin")),
    }
    one_rig(&mut calibration.records, "egovehicle");
    Ok(calibration)
}

/// Reads the pose of a sensor on the vehicle.
fn argoverse_mount(root: &Cursor<'_>, name: &str, path: &Path) -> Result<Pose> {
    for row in root.list()? {
        if row.require("sensor_name")?.word()? == name {
            let number = |key: &str| row.require(key)?.number();
            let q = [number("qw")?, number("qx")?, number("qy")?, number("qz")?];
            let rotation = Rotation::unit_quaternion(q).map_err(|message| row.fail(message))?;
            let c = DVec3::new(number("tx_m")?, number("ty_m")?, number("tz_m")?);
            return Ok(Pose::world_from_camera(rotation, c));
        }
    }
    Err(FormatError::whole(path, format!("no row for the sensor {name:?}")))
}

pub(crate) fn read_waymo(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    // In Waymo's frames, the calibrations are in the map `context`.
    let places = [root.clone(), root.get("context").unwrap_or_else(|| root.clone())];
    let list = places.iter().find_map(|at| at.any(&CALIBRATIONS));
    let list = list.ok_or_else(|| root.fail("camera_calibrations is missing, at the top level and in context"))?;
    let mut calibration = Calibration::default();
    let mut rolling = 0;
    for row in list.list()? {
        let mut record = CameraRecord::new(row.require("name")?.word()?, PixelCenter::Integer);
        record.size = Some([row.require("width")?.count()?, row.require("height")?.count()?]);
        let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = row.require("intrinsic")?.array()?;
        record.k = Some(pinhole_matrix([fx, fy, cx, cy]));
        record.lens = brown_lens(k1, k2, p1, p2, k3).map_err(|message| row.fail(message))?;
        let at = row.require("extrinsic")?;
        let (r, c) = at.get("transform").unwrap_or(at).matrix4()?;
        // Waymo's cameras have x forward, y left and z up. The columns are the directions of OpenCV's x, y and z in
        // these axes.
        let axes = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r * axes), c));
        rolling += usize::from(row.any(&["rolling_shutter_direction", "rollingShutterDirection"]).is_some());
        calibration.records.push(record);
    }
    calibration.note(NoticeCode::PlacedCameras, ON_THE_VEHICLE);
    if rolling > 0 {
        calibration.note(
            NoticeCode::IgnoredFeature,
            format!("the rolling shutter of {} is ignored", counted(rolling, "camera")),
        );
    }
    one_rig(&mut calibration.records, "vehicle");
    Ok(calibration)
}
