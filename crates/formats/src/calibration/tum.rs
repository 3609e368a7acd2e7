//! TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, world from camera (cvg.cit.tum.de, "File Formats").

use std::path::Path;

use glam::DVec3;
use raycam_scene::PixelCenter;

use crate::calibration::document::number_format::{joined, yaml_float};
use crate::calibration::document::number_lines::{data_lines, looks_like, numbers};
use crate::calibration::files::{Calibration, OutputFiles, ReadHints};
use crate::calibration::pose::{Pose, Rotation};
use crate::calibration::record::CameraRecord;
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

pub(super) fn detect(_: &Path, text: &str) -> bool {
    looks_like(text, 8)
}

pub(super) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration, FormatError> {
    let mut calibration = Calibration::default();
    for (line, row) in data_lines(source.text()?) {
        let [time, x, y, z, qx, qy, qz, qw] = numbers(&source.path, line, row)?;
        if qx.hypot(qy).hypot(qz).hypot(qw) < 1e-6 {
            return Err(FormatError::line(
                &source.path,
                line,
                "a quaternion of length 0; expected qx qy qz qw of length 1, of which 0 0 0 1 turns nothing",
            ));
        }
        let name = row.split_whitespace().next().unwrap_or_default();
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.time = Some(time);
        let rotation = Rotation::Quaternion([qw, qx, qy, qz]);
        record.pose = Some(Pose::world_from_camera(rotation, DVec3::new(x, y, z)));
        calibration.records.push(record);
    }
    Ok(calibration)
}

pub(super) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles, FormatError> {
    let mut text = String::from("# timestamp tx ty tz qx qy qz qw\n");
    for record in records {
        let time = match record.time {
            Some(time) => time,
            None => record.name.parse().ok().filter(|time: &f64| time.is_finite()).ok_or_else(|| {
                FormatError::Encode(format!(
                    "camera {:?} has no time, which a TUM trajectory needs: give it one, or a name that is a number of \
                     seconds",
                    record.name
                ))
            })?,
        };
        let (rotation, c) = record.require_pose()?.world_r_c();
        let [w, x, y, z] = rotation.quaternion();
        // The name is the time as it was written.
        let time = if record.name.parse() == Ok(time) { record.name.clone() } else { yaml_float(time) };
        text += &format!("{time} {}\n", joined(&[c.x, c.y, c.z, x, y, z, w], " "));
    }
    Ok(OutputFiles {
        notices: vec!["a TUM trajectory holds times and poses; size, K and lens are not written".into()],
        ..OutputFiles::one(text)
    })
}
