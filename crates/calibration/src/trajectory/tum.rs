//! TUM trajectories: lines of `timestamp tx ty tz qx qy qz qw`, world from camera (cvg.cit.tum.de, "File Formats").

use std::path::Path;

use glam::DVec3;
use raycam_scene::{Notice, NoticeCode, PixelCenter};

use crate::document::number_format::{joined, yaml_float};
use crate::document::number_lines::{data_lines, looks_like, numbers};
use crate::intrinsics::pinhole_matrix;
use crate::picture_size::size_of_picture;
use crate::pose::normalized;
use crate::trajectory::named_columns::{self, columns_of};
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    looks_like(text, 8) || matches!(columns_of(text), Some(Ok(_)))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let text = source.text()?;
    if let Some(columns) = columns_of(text) {
        let columns = columns.map_err(|message| FormatError::whole(&source.path, message))?;
        let mut calibration = named_columns::read(text, &source.path, &columns)?;
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
    if hints.intrinsics.is_none() {
        beside(source, assets, &mut calibration)?;
    }
    Ok(calibration)
}

/// True for `calibration.txt` of a sequence: a single line fx fy cx cy.
pub(crate) fn detect_intrinsics(_: &InputFile, text: &str) -> bool {
    looks_like(text, 4) && data_lines(text).count() == 1
}

/// Camera of `calibration.txt`, which has no size.
pub(crate) fn read_intrinsics(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let Some((line, row)) = data_lines(source.text()?).next() else {
        return Err(FormatError::whole(&source.path, "expected fx fy cx cy"));
    };
    let mut record = CameraRecord::new(source.stem().unwrap_or_else(|| "camera".into()), PixelCenter::Integer);
    record.k = Some(pinhole_matrix(numbers(&source.path, line, row)?));
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
                format!("K is that of calibration.txt, the size is that of the first image, {width} x {height}")
            }
            None => "K is that of calibration.txt".into(),
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
        return Err(FormatError::encode(format!("{format} stores one camera, got {}", records.len())));
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
        // The name is the time in its original digits.
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
