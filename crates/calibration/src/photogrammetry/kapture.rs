//! kapture: `sensors/sensors.txt`, `rigs.txt`, `trajectories.txt` (device_from_world) and `records_camera.txt`,
//! comma-separated values. The camera models and the pixel centres are COLMAP's. Source: kapture's format
//! specification.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use raycam_scene::camera::lens_from_colmap;
use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::number_lines::data_lines;
use crate::pose::SCALED_QUATERNION;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

type Row<'a> = (usize, Vec<&'a str>);

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    let stem = source.stem().unwrap_or_default();
    let header = text.lines().take(3).any(|line| line.starts_with('#') && line.contains("device_id"));
    text.trim_start().starts_with("# kapture format")
        || header
        || stem == "sensors" && rows_of(text).next().is_some_and(|(_, row)| row.len() > 4 && row[2] == "camera")
}

pub(crate) fn detect_folder(folder: &Folder, assets: &mut AssetRoot) -> bool {
    folder.inner("sensors", assets).has("sensors.txt")
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    read_beside(&folder.path.join("sensors/sensors.txt"), assets)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let sensors = source.path.with_file_name("sensors.txt");
    let stem = source.stem().unwrap_or_default();
    if !matches!(&*stem, "sensors" | "rigs" | "trajectories") && !stem.starts_with("records") {
        return Err(FormatError::whole(
            &source.path,
            "this file of a kapture data set contains no cameras; open the folder that contains sensors/sensors.txt",
        ));
    }
    if stem == "sensors" {
        let files = Files { sensors: source, rigs: None, trajectories: None, records: None };
        let beside = |assets: &mut AssetRoot, name: &str| assets.read_reference(&source.path, name).ok();
        let (rigs, trajectories, records) =
            (beside(assets, "rigs.txt"), beside(assets, "trajectories.txt"), beside(assets, "records_camera.txt"));
        return Files { rigs: rigs.as_ref(), trajectories: trajectories.as_ref(), records: records.as_ref(), ..files }
            .read();
    }
    read_beside(&sensors, assets)
}

fn read_beside(sensors: &Path, assets: &mut AssetRoot) -> Result<Calibration> {
    let mut open = |name: &str| assets.read_reference(sensors, name);
    let source = open("sensors.txt")?;
    let (rigs, trajectories, records) =
        (open("rigs.txt").ok(), open("trajectories.txt").ok(), open("records_camera.txt").ok());
    Files { sensors: &source, rigs: rigs.as_ref(), trajectories: trajectories.as_ref(), records: records.as_ref() }
        .read()
}

fn rows_of(text: &str) -> impl Iterator<Item = Row<'_>> {
    data_lines(text).map(|(line, row)| (line, row.split(',').map(str::trim).collect()))
}

/// Reads a pose from seven columns: w, x, y, z and the translation; `None` for an unknown pose, whose columns are
/// empty. kapture accepts quaternions of any length.
fn pose_of(words: &[&str], subject: &str, calibration: &mut Calibration) -> Result<Option<Pose>, String> {
    if words.iter().all(|word| word.is_empty()) {
        return Ok(None);
    }
    let values: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
    let [w, x, y, z, tx, ty, tz] = values
        .and_then(|values| <[f64; 7]>::try_from(values).ok())
        .ok_or_else(|| format!("{}; expected qw, qx, qy, qz, tx, ty, tz", words.join(", ")))?;
    let (rotation, is_scaled) = Rotation::scaled_quaternion([w, x, y, z])?;
    if is_scaled {
        calibration.note_about(NoticeCode::Implausible, subject, SCALED_QUATERNION);
    }
    Ok(Some(Pose::camera_from_world(rotation, DVec3::new(tx, ty, tz))))
}

struct Files<'a> {
    sensors: &'a InputFile,
    rigs: Option<&'a InputFile>,
    trajectories: Option<&'a InputFile>,
    records: Option<&'a InputFile>,
}

impl Files<'_> {
    /// Reads the sensors that are cameras.
    fn cameras(&self, calibration: &mut Calibration) -> Result<Vec<CameraRecord>> {
        let mut cameras = Vec::new();
        for (line, row) in rows_of(self.sensors.text()?) {
            let fail = |message: String| FormatError::line(&self.sensors.path, line, message);
            if row.get(2) != Some(&"camera") {
                calibration.note_about(
                    NoticeCode::IgnoredElement,
                    format!("sensor {}", row[0]),
                    "not a camera; ignored",
                );
                continue;
            }
            let numbers: Option<Vec<f64>> = row.iter().skip(4).map(|word| word.parse().ok()).collect();
            let numbers = numbers.filter(|numbers| numbers.len() >= 2);
            let numbers = numbers.ok_or_else(|| {
                fail(format!("{}; expected a camera model, width, height and parameters", row[3..].join(", ")))
            })?;
            let side = |value: f64| (value.fract() == 0.0 && (1.0..65537.0).contains(&value)).then_some(value as u32);
            let (Some(width), Some(height)) = (side(numbers[0]), side(numbers[1])) else {
                return Err(fail(format!(
                    "{} x {}; expected width and height, whole numbers from 1 to 65536",
                    numbers[0], numbers[1]
                )));
            };
            let mut record = CameraRecord::new(row[0], PixelCenter::Half);
            record.size = Some([width, height]);
            if row[3] == "UNKNOWN_CAMERA" {
                let subject = format!("camera {}", row[0]);
                calibration.note_about(NoticeCode::MissingValue, subject, "no intrinsics (UNKNOWN_CAMERA)");
            } else {
                let (k, lens) = lens_from_colmap(row[3], &numbers[2..]).map_err(|error| fail(error.to_string()))?;
                (record.k, record.lens) = (Some(k), lens);
            }
            cameras.push(record);
        }
        Ok(cameras)
    }

    fn read(&self) -> Result<Calibration> {
        let mut calibration = Calibration::default();
        let cameras = self.cameras(&mut calibration)?;
        let mut mounts: HashMap<&str, (&str, Pose)> = HashMap::new();
        if let Some(file) = self.rigs {
            for (line, row) in rows_of(file.text()?) {
                let fail = |message: String| FormatError::line(&file.path, line, message);
                let numbers = row.get(2..9).ok_or_else(|| {
                    fail(format!("{}; expected rig, sensor and seven numbers", counted(row.len(), "value")))
                })?;
                let subject = format!("rig {}, sensor {}", row[0], row[1]);
                if let Some(pose) = pose_of(numbers, &subject, &mut calibration).map_err(fail)? {
                    mounts.insert(row[1], (row[0], pose));
                }
            }
        }
        let mut poses: HashMap<(&str, &str), Pose> = HashMap::new();
        if let Some(file) = self.trajectories {
            for (line, row) in rows_of(file.text()?) {
                let fail = |message: String| FormatError::line(&file.path, line, message);
                let numbers = row.get(2..9).ok_or_else(|| {
                    fail(format!("{}; expected time, device and seven numbers", counted(row.len(), "value")))
                })?;
                let subject = format!("device {} at time {}", row[1], row[0]);
                if let Some(pose) = pose_of(numbers, &subject, &mut calibration).map_err(fail)? {
                    poses.insert((row[0], row[1]), pose);
                }
            }
        }
        let place = |time: &str, sensor: &str| {
            let of_rig = || {
                let (rig, mount) = mounts.get(sensor)?;
                Some(mount.compose(poses.get(&(time, *rig))?))
            };
            poses.get(&(time, sensor)).cloned().or_else(of_rig)
        };
        // In a data set without images, the list of images is missing or empty.
        let records = self.records.map(|file| file.text().map(|text| (file, text))).transpose()?;
        let Some((file, text)) = records.filter(|(_, text)| rows_of(text).next().is_some()) else {
            for mut record in cameras {
                record.pose = mounts.get(record.name.as_str()).map(|(_, mount)| mount.clone());
                calibration.records.push(record);
            }
            calibration.note(
                NoticeCode::MissingFile,
                "records_camera.txt is missing or empty; one camera per sensor is returned",
            );
            return Ok(calibration);
        };
        let mut unplaced = 0;
        for (line, row) in rows_of(text) {
            let [time, sensor, image] = row[..] else {
                let message = format!("{}; expected time, sensor and image", counted(row.len(), "value"));
                return Err(FormatError::line(&file.path, line, message));
            };
            let camera = cameras.iter().find(|camera| camera.name == sensor);
            let camera = camera.ok_or_else(|| {
                FormatError::line(&file.path, line, format!("sensors.txt does not contain the camera {sensor:?}"))
            })?;
            let mut record = CameraRecord { name: image.into(), ..camera.clone() };
            record.image = Some(image.into());
            record.pose = place(time, sensor);
            unplaced += usize::from(record.pose.is_none());
            calibration.records.push(record);
        }
        if unplaced > 0 {
            calibration.note(
                NoticeCode::MissingValue,
                format!("{} placed at the origin: no pose in trajectories.txt", counted(unplaced, "image")),
            );
        }
        Ok(calibration)
    }
}
