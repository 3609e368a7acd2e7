//! Bundler's `.out`, version 0.3: `f k1 k2`, R and t of each camera; camera_from_world with OpenGL's axes, pixels from
//! the image centre. Source: Bundler's README, "Output format and scene representation".

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::check_rotation;
use crate::document::number_lines::{data_lines, numbers};
use crate::intrinsics::{brown_lens, pinhole_matrix, require_known_size};
use crate::picture_size::PictureSizes;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.starts_with("# Bundle file")
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let (path, text) = (&source.path, source.text()?);
    let mut calibration = Calibration::default();
    let list = assets.read_reference(path, "list.txt").ok();
    let pictures: Vec<&str> = list
        .as_ref()
        .and_then(|list| list.text().ok())
        .map(|text| data_lines(text).map(|(_, line)| picture_name(line)).collect())
        .unwrap_or_default();
    let mut sizes = PictureSizes::new(assets, path, &pictures, hints.size);
    let mut lines = data_lines(text);
    let mut next = |what: &str| {
        lines.next().ok_or_else(|| {
            FormatError::whole(
                path,
                format!(
                    "the file ends before \
        {what}"
                ),
            )
        })
    };
    let (line, row) = next("the number of cameras")?;
    let [count, _] = numbers::<2>(path, line, row)?;
    let (mut lost, mut tiny) = (0, 0);
    let mut i = 0;
    while f64::from(i) < count {
        let (line, row) = next("f k1 k2 of a camera")?;
        let fail = |message: String| FormatError::line(path, line, message);
        let [focal, k1, k2] = numbers(path, line, row)?;
        let mut rows = [DVec3::ZERO; 4];
        for row in &mut rows {
            let (line, text) = next("R and t of a camera")?;
            *row = DVec3::from_array(numbers(path, line, text)?);
        }
        let picture = pictures.get(i as usize);
        i += 1;
        if focal == 0.0 {
            lost += 1;
            continue;
        }
        let name = picture.map_or_else(|| (i - 1).to_string(), |name| (*name).to_owned());
        let mut record = CameraRecord::new(name, PixelCenter::Half);
        record.image = picture.map(|name| (*name).to_owned());
        let size = require_known_size(sizes.size(assets, path, picture), path, "Bundler's file")?;
        record.size = Some(size);
        let [w, h] = size.map(f64::from);
        record.k = Some(pinhole_matrix([focal, focal, 0.5 * w, 0.5 * h]));
        record.lens = brown_lens(k1, k2, 0.0, 0.0, 0.0).map_err(fail)?;
        tiny += usize::from(k1 != 0.0 && k1.abs() < 1e-6);
        let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let r = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        check_rotation(r).map_err(fail)?;
        record.pose = Some(Pose::camera_from_world(Rotation::Matrix(flip * r), flip * rows[3]));
        calibration.records.push(record);
    }
    let mut notice = |code, text: String| calibration.note(code, text);
    if lost > 0 {
        notice(
            NoticeCode::IgnoredElement,
            format!("{} omitted (focal length 0)", counted(lost, "unregistered camera")),
        );
    }
    if tiny > 0 {
        notice(
            NoticeCode::AssumedConvention,
            format!(
                "k1 of {} is below 1e-6; it is read for normalized image coordinates, as Bundler specifies, but \
                 some programs write it for pixel coordinates",
                counted(tiny, "camera")
            ),
        );
    }
    calibration.notices.extend(sizes.notices());
    Ok(calibration)
}

/// Image name in a line of list.txt. The name may contain spaces, and may be followed by 0 and a focal length.
fn picture_name(line: &str) -> &str {
    let mut words = line.rsplitn(3, char::is_whitespace);
    match (words.next(), words.next(), words.next()) {
        (Some(focal), Some("0"), Some(name)) if focal.parse::<f64>().is_ok() => name.trim(),
        _ => line.trim(),
    }
}
