//! TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, world from camera (cvg.cit.tum.de, "File Formats").

use std::path::Path;

use glam::DVec3;
use raycam_scene::PixelCenter;

use super::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation, text};
use crate::calibration::document::number_format::{joined, yaml_float};
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

/// The lines of a text that say something, with their numbers.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()));
    numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// So many finite numbers of a line.
pub(super) fn numbers<const N: usize>(
    path: &Path,
    line: usize,
    text: &str,
) -> Result<[f64; N], FormatError> {
    let mut values = Vec::with_capacity(N);
    for word in text.split_whitespace() {
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() && values.len() <= N => values.push(value),
            Ok(_) if values.len() > N => break,
            _ => {
                let message = format!("{word:?}: expected a finite number");
                return Err(FormatError::line(path, line, message));
            }
        }
    }
    let count = values.len();
    values
        .try_into()
        .map_err(|_| FormatError::line(path, line, format!("{count} numbers, expected {N}")))
}

/// Whether the first lines are of so many numbers.
pub(super) fn looks_like(text: &str, count: usize) -> bool {
    let mut first = lines(text).take(3).peekable();
    first.peek().is_some()
        && first.all(|(_, line)| {
            let mut words = line.split_whitespace();
            words.clone().count() == count && words.all(|word| word.parse::<f64>().is_ok())
        })
}

pub(super) fn detect(_: &Path, text: &str) -> bool {
    looks_like(text, 8)
}

pub(super) fn read(
    source: &InputFile,
    _: &mut AssetRoot,
    _: &ReadHints,
) -> Result<Calibration, FormatError> {
    let mut calibration = Calibration::default();
    for (line, row) in lines(text(source)?) {
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
        let time = if record.name.parse() == Ok(time) {
            record.name.clone()
        } else {
            yaml_float(time)
        };
        text += &format!("{time} {}\n", joined(&[c.x, c.y, c.z, x, y, z, w], " "));
    }
    Ok(OutputFiles {
        notices: vec![
            "a TUM trajectory holds times and poses; size, K and lens are not written".into(),
        ],
        ..OutputFiles::one(text)
    })
}
