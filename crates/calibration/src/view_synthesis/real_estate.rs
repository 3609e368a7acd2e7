//! RealEstate10K: the address of a video, then a line for each image: microseconds, fx fy cx cy in units of the image's
//! width and height, two zeros, and the 12 numbers of camera_from_world. Source: the data set's page, "Data format".

use raycam_scene::PixelCenter;

use crate::document::number_lines::{data_lines, numbers};
use crate::document::{check_rotation, rigid};
use crate::intrinsics::{pinhole_matrix, require_known_size};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let mut lines = data_lines(text).map(|(_, line)| line).skip_while(|line| line.starts_with("http"));
    lines.next().is_some_and(|line| {
        let values: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        values.is_some_and(|values| {
            values.len() == 19
                && values[0].fract() == 0.0
                && values[5..7] == [0.0, 0.0]
                && values[1..5].iter().all(|value| (0.0..20.0).contains(value))
        })
    })
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let size = require_known_size(hints.size, path, "RealEstate10K")?;
    let [width, height] = size.map(f64::from);
    let mut calibration = Calibration::default();
    for (line, row) in data_lines(source.text()?) {
        if row.starts_with("http") {
            continue;
        }
        let values: [f64; 19] = numbers(path, line, row)?;
        let rows = std::array::from_fn(|i| values[7 + i]);
        let (r, t) = rigid(&rows);
        check_rotation(r).map_err(|message| FormatError::line(path, line, message))?;
        let name = row.split_whitespace().next().unwrap_or_default();
        let mut record = CameraRecord::new(name, PixelCenter::Half);
        record.time = Some(values[0] / 1e6);
        record.size = Some(size);
        record.k = Some(pinhole_matrix([values[1] * width, values[2] * height, values[3] * width, values[4] * height]));
        record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
        calibration.records.push(record);
    }
    Ok(calibration)
}
