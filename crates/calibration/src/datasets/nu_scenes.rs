//! Tables of nuScenes: `calibrated_sensor.json` (ego_from_sensor, K) and, if they exist, `sensor.json` (names),
//! `sample_data.json` (images) and `ego_pose.json` (world_from_ego). Source: the schema of nuscenes-devkit.

use std::collections::HashMap;

use glam::DVec3;
use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::{Cursor, DocumentNode, yaml};
use crate::rig::on_a_body;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

const TABLE: &str = "calibrated_sensor.json";

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"sensor_token\"") && text.contains("\"camera_intrinsic\"")
}

pub(crate) fn detect_folder(folder: &Folder, _: &mut AssetRoot) -> bool {
    folder.has(TABLE)
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    read(&folder.read(TABLE, assets)?, assets, hints)
}

/// Reads the table `name` in the folder of another table; `None` if it does not exist.
fn table(from: &InputFile, name: &str, assets: &mut AssetRoot) -> Result<Option<(InputFile, DocumentNode)>> {
    if !assets.is_file(&from.path, name.as_bytes()) {
        return Ok(None);
    }
    let source = assets.read_reference(&from.path, name)?;
    let node = yaml::parse(source.text()?, &source.path)?;
    Ok(Some((source, node)))
}

/// Returns the rows of a table by their token.
fn by_token<'a>(root: &Cursor<'a>) -> Result<HashMap<&'a str, Cursor<'a>>> {
    root.list()?.into_iter().map(|row| Ok((row.require("token")?.word()?, row))).collect()
}

/// Reads the pose in a row: of a sensor on the ego vehicle, or of the ego vehicle in the world.
fn pose(row: &Cursor<'_>) -> Result<Pose> {
    let at = row.require("rotation")?;
    let rotation = Rotation::unit_quaternion(at.array()?).map_err(|message| at.fail(message))?;
    let c = DVec3::from_array(row.require("translation")?.array()?);
    Ok(Pose::world_from_camera(rotation, c))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let sensors = table(source, "sensor.json", assets)?;
    let names = match &sensors {
        Some((file, node)) => by_token(&Cursor::root(node, &file.path))?,
        None => HashMap::new(),
    };
    let (mut cameras, mut order) = (HashMap::new(), Vec::new());
    for row in Cursor::root(&node, &source.path).list()? {
        let (token, k) = (row.require("token")?.word()?, row.require("camera_intrinsic")?);
        if k.numbers()?.is_empty() {
            continue; // The sensor is a lidar or a radar.
        }
        let sensor = row.require("sensor_token")?.word()?;
        let name = names.get(sensor).and_then(|row| row.get("channel")).map_or(Ok(token), |at| at.word())?;
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.k = Some(k.matrix3()?);
        record.pose = Some(pose(&row)?);
        order.push(token);
        cameras.insert(token, record);
    }
    let mut calibration = Calibration::default();
    let (data, poses) = (table(source, "sample_data.json", assets)?, table(source, "ego_pose.json", assets)?);
    if let (Some((data, rows)), Some((file, poses))) = (&data, &poses) {
        let poses = by_token(&Cursor::root(poses, &file.path))?;
        for row in Cursor::root(rows, &data.path).list()? {
            calibration.records.extend(seen(&row, &cameras, &poses)?);
        }
        calibration.note(
            NoticeCode::PlacedCameras,
            "each image of sample_data is a camera; poses are in the global coordinates of ego_pose, and times in \
             seconds",
        );
        return Ok(calibration);
    }
    for token in order {
        let mut record = cameras[token].clone();
        if calibration.records.iter().any(|other: &CameraRecord| other.name == record.name) {
            record.name = format!("{}#{token}", record.name);
        }
        on_a_body(&mut record, "ego");
        calibration.records.push(record);
    }
    calibration.note(
        NoticeCode::PlacedCameras,
        "camera poses are relative to the vehicle (x forward, y left, z up); for world poses, put sample_data.json \
         and ego_pose.json into the same folder",
    );
    Ok(calibration)
}

/// Returns the camera of a row of sample_data; `None` for another sensor.
fn seen(
    row: &Cursor<'_>,
    cameras: &HashMap<&str, CameraRecord>,
    poses: &HashMap<&str, Cursor<'_>>,
) -> Result<Option<CameraRecord>> {
    let Some(camera) = cameras.get(row.require("calibrated_sensor_token")?.word()?) else { return Ok(None) };
    let token = row.require("ego_pose_token")?;
    let name = token.word()?;
    let ego = poses.get(name).ok_or_else(|| token.fail(format_args!("{name:?} not found in ego_pose.json")))?;
    let mut record = camera.clone();
    let file = row.require("filename")?.word()?;
    (record.name, record.image) = (file.to_owned(), Some(file.to_owned()));
    record.size = Some([row.require("width")?.count()?, row.require("height")?.count()?]);
    record.time = row.get("timestamp").map(|at| at.number()).transpose()?.map(|time| time * 1e-6);
    record.pose = record.pose.map(|camera| pose(ego).map(|ego| camera.compose(&ego))).transpose()?;
    Ok(Some(record))
}
