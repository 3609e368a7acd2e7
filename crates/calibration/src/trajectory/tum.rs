//! TUM trajectories: lines of `timestamp tx ty tz qx qy qz qw`, world from camera (cvg.cit.tum.de, "File Formats").

use std::path::Path;

use glam::DVec3;
use raycam_scene::{LensModel, Notice, NoticeCode, PixelCenter};

use crate::document::number_format::{joined, yaml_float};
use crate::document::number_lines::{data_lines, looks_like, numbers};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::picture_size::size_of_picture;
use crate::pose::normalized;
use crate::trajectory::named_columns::{self, columns_of};
use crate::trajectory::times::notice_of_odd_times;
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    looks_like(text, 8) && line_of_intrinsics(text).is_none() || columns_of(text).is_some()
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let text = source.text()?;
    if let Some(columns) = columns_of(text) {
        let columns = columns.map_err(|message| FormatError::whole(&source.path, message))?;
        let mut calibration = named_columns::read(text, &source.path, &columns)?;
        calibration.notices.extend(notice_of_odd_times(&calibration.records));
        if hints.intrinsics.is_none() {
            beside(source, assets, &mut calibration)?;
        }
        return Ok(calibration);
    }
    let mut calibration = Calibration::default();
    for (line, row) in data_lines(text) {
        let [time, x, y, z, qx, qy, qz, qw] = numbers(&source.path, line, row)?;
        let rotation = Rotation::unit_quaternion([qw, qx, qy, qz]).map_err(|message| {
            FormatError::line(
                &source.path,
                line,
                format!(
                    "{message}; expected TUM's columns time tx ty tz qx qy qz \
                qw"
                ),
            )
        })?;
        let name = row.split_whitespace().next().unwrap_or_default();
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.time = Some(time);
        record.pose = Some(Pose::world_from_camera(rotation, DVec3::new(x, y, z)));
        calibration.records.push(record);
    }
    calibration.notices.extend(notice_of_odd_times(&calibration.records));
    if hints.intrinsics.is_none() {
        beside(source, assets, &mut calibration)?;
    }
    Ok(calibration)
}

/// Reads the numbers of a text that consists of one line: fx fy cx cy, optionally followed by k1 k2 p1 p2 (k3).
fn line_of_intrinsics(text: &str) -> Option<Vec<f64>> {
    let mut lines = data_lines(text);
    let (Some((_, line)), None) = (lines.next(), lines.next()) else { return None };
    let values: Vec<f64> = line.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    // Eight numbers may also be a time and a pose, which ends with a unit quaternion.
    let quaternion = values.iter().rev().take(4).fold(0.0, |sum, value| sum + value * value);
    let plausible = matches!(values.len(), 4 | 8 | 9)
        && values[..4].iter().all(|value| (1.0..1e6).contains(value))
        && values[4..].iter().all(|value| value.abs() < 100.0);
    (values.len() == 4 || plausible && (values.len() == 9 || (quaternion - 1.0).abs() > 0.1)).then_some(values)
}

/// True for `calibration.txt` of a sequence: a single line of intrinsics (see [`line_of_intrinsics`]).
pub(crate) fn detect_intrinsics(_: &InputFile, text: &str) -> bool {
    line_of_intrinsics(text).is_some()
}

/// Reads the camera of `calibration.txt`; the file contains no image size.
pub(crate) fn read_intrinsics(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let fail = |message: &str| FormatError::whole(&source.path, message);
    let Some(values) = line_of_intrinsics(source.text()?) else {
        return Err(fail("expected one line of fx fy cx cy, or of fx fy cx cy k1 k2 p1 p2 (k3)"));
    };
    let mut record = CameraRecord::new(source.stem().unwrap_or_else(|| "camera".into()), PixelCenter::Integer);
    record.k = Some(pinhole_matrix([values[0], values[1], values[2], values[3]]));
    record.lens = lens_of(LensModel::OpenCv, &values[4..]).map_err(|message| fail(&message))?;
    Ok(Calibration { records: vec![record], ..Calibration::default() })
}

/// K of `calibration.txt` and the size of the first image of `rgb.txt`, both next to a trajectory.
fn beside(source: &InputFile, assets: &mut AssetRoot, calibration: &mut Calibration) -> Result<()> {
    let Ok(file) = assets.read_reference(&source.path, "calibration.txt") else { return Ok(()) };
    if !detect_intrinsics(&file, file.text().unwrap_or_default()) {
        return Ok(());
    }
    let k = read_intrinsics(&file, assets, &ReadHints::default())?.records.pop().and_then(|record| record.k);
    let list = assets.read_reference(&source.path, "rgb.txt").ok();
    let pictures = list.as_ref().and_then(|list| list.text().ok()).unwrap_or_default();
    let first = data_lines(pictures).find_map(|(_, line)| line.split_whitespace().nth(1));
    let size = size_of_picture(assets, &source.path, first);
    calibration.note(
        NoticeCode::UsedOtherFile,
        match size {
            Some([width, height]) => {
                format!("K was read from calibration.txt, and the size, {width} x {height}, from the first image")
            }
            None => "K was read from calibration.txt".into(),
        },
    );
    for record in &mut calibration.records {
        (record.k, record.size) = (k, size);
    }
    Ok(())
}

pub(crate) fn write_intrinsics(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let format = "calibration.txt of TUM";
    let [record] = records else {
        return Err(FormatError::encode(format!(
            "{format} stores one camera, got {}; write each camera to a separate file",
            records.len()
        )));
    };
    record.require_pinhole(format)?;
    let focals = record.focals_with(PixelCenter::Integer, format)?;
    Ok(OutputFiles {
        notices: vec![Notice::new(
            NoticeCode::NotWritten,
            format!("{format} stores fx fy cx cy; size and pose are not written"),
        )],
        ..OutputFiles::one(format!("# fx fy cx cy\n{}\n", joined(&focals, " ")))
    })
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let mut text = String::from("# timestamp tx ty tz qx qy qz qw\n");
    for record in records {
        let time = match record.time {
            Some(time) => time,
            None => record.name.parse().ok().filter(|time: &f64| time.is_finite()).ok_or_else(|| {
                FormatError::encode(format!(
                    "camera {:?} has no time, which a TUM trajectory requires; set its time, or use a number of \
                     seconds as its name",
                    record.name
                ))
            })?,
        };
        let (rotation, c) = record.require_pose()?.world_r_c();
        let [w, x, y, z] = normalized(rotation.quaternion());
        // If the camera's name is its time, the name is written, because it contains the original digits.
        let time = if record.name.parse() == Ok(time) { record.name.clone() } else { yaml_float(time) };
        text += &format!("{time} {}\n", joined(&[c.x, c.y, c.z, x, y, z, w], " "));
    }
    Ok(OutputFiles {
        notices: vec![Notice::new(
            NoticeCode::NotWritten,
            "a TUM trajectory stores times and poses; size, K and lens are not written",
        )],
        ..OutputFiles::one(text)
    })
}
