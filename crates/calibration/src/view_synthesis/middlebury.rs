//! `calib.txt` of Middlebury 2014 and 2021 and of ETH3D's two-view sets: a rectified pair, the baseline in millimetres.
//! Source: vision.middlebury.edu/stereo, "calib.txt".

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter};

use crate::rig::one_rig;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

const OTHER: [&str; 9] = ["ndisp", "isint", "vmin", "vmax", "dyavg", "dymax", "doffs", "width", "height"];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with("cam0=[") || line.trim_start().starts_with("cam0 = ["))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let mut rows: HashMap<&str, (usize, &str)> = HashMap::new();
    for (i, line) in source.text()?.lines().enumerate() {
        if let Some((key, value)) = line.split_once('=') {
            rows.insert(key.trim(), (i + 1, value.trim()));
        }
    }
    let number = |key: &str| -> Result<Option<f64>> {
        let Some((line, word)) = rows.get(key) else { return Ok(None) };
        let value = word.parse().ok().filter(|value: &f64| value.is_finite());
        value.map(Some).ok_or_else(|| FormatError::line(path, *line, format!("{key}={word}; expected a number")))
    };
    let matrix = |key: &str| -> Result<DMat3> {
        let (line, text) = *rows
            .get(key)
            .ok_or_else(|| FormatError::whole(path, format!("{key}=[f 0 cx; 0 f cy; 0 0 1] is missing")))?;
        let inner = text.trim_start_matches('[').trim_end_matches(']');
        let values: Result<Vec<f64>, _> =
            inner.split([';', ' ', ',', '\t']).filter(|word| !word.is_empty()).map(str::parse).collect();
        let values: Option<[f64; 9]> = values.ok().and_then(|values| values.try_into().ok());
        let values =
            values.ok_or_else(|| FormatError::line(path, line, format!("{key}={text}; expected nine numbers")))?;
        Ok(DMat3::from_cols_array(&values).transpose())
    };
    let (first, second) = (matrix("cam0")?, matrix("cam1")?);
    let line = rows["cam1"].0;
    if first.x_axis != second.x_axis || first.y_axis != second.y_axis {
        return Err(FormatError::line(
            path,
            line,
            format!(
                "the pair is not rectified: fx and fy are {} and {} in cam0, {} and {} in cam1; expected matrices that \
                 differ only in cx",
                first.x_axis.x, first.y_axis.y, second.x_axis.x, second.y_axis.y
            ),
        ));
    }
    let doffs = second.z_axis.x - first.z_axis.x;
    let mut calibration = Calibration::default();
    if let Some(given) = number("doffs")?.filter(|given| (given - doffs).abs() > 0.01) {
        calibration.note(
            NoticeCode::Implausible,
            format!("doffs is {given}, but cx of cam1 minus cx of cam0 is {doffs}, which is used"),
        );
    }
    let base = number("baseline")?.ok_or_else(|| FormatError::whole(path, "baseline is missing"))?;
    let size = match (number("width")?, number("height")?) {
        (Some(width), Some(height)) => Some([width as u32, height as u32]),
        _ => hints.size,
    };
    for (name, k, x) in [("cam0", first, 0.0), ("cam1", second, base / 1000.0)] {
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        (record.k, record.size) = (Some(k), size);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(DMat3::IDENTITY), DVec3::new(x, 0.0, 0.0)));
        calibration.records.push(record);
    }
    one_rig(&mut calibration.records, "rig");
    calibration.note(
        NoticeCode::AssumedConvention,
        format!(
            "the baseline, {base} mm, is converted to metres; cam0 defines \
            the world"
        ),
    );
    for (key, (line, _)) in &rows {
        if !OTHER.contains(key) && !["cam0", "cam1", "baseline"].contains(key) {
            calibration.note_about(NoticeCode::IgnoredKey, format!("{key} (line {line})"), "ignored");
        }
    }
    Ok(calibration)
}
