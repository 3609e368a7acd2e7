//! `cameras.json` of 3D Gaussian Splatting, next to a trained model: `rotation` and `position` are world_from_camera
//! with OpenCV's axes. Source: gaussian-splatting, camera_utils.py. The file contains no principal point.

use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::number_format::{joined, matrix_rows3, quoted, yaml_float};
use crate::document::{Cursor, check_rotation, yaml};
use crate::intrinsics::{middle_of, pinhole_matrix};
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    ["\"img_name\"", "\"rotation\"", "\"position\"", "\"fx\""].iter().all(|key| text.contains(key))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let mut names = std::collections::HashSet::new();
    for at in root.list()? {
        let known = ["id", "img_name", "width", "height", "position", "rotation", "fx", "fy"];
        calibration.notices.extend(at.unknown_keys(&known)?);
        let image = at.require("img_name")?.word()?;
        let mut name = image.to_owned();
        if !names.insert(name.clone()) {
            name = format!("{image}#{}", at.require("id")?.word()?);
        }
        let mut record = CameraRecord::new(name, PixelCenter::Half);
        record.image = Some(image.to_owned());
        let size = [at.require("width")?.count()?, at.require("height")?.count()?];
        let [cx, cy] = middle_of(size, PixelCenter::Half);
        record.k = Some(pinhole_matrix([at.require("fx")?.number()?, at.require("fy")?.number()?, cx, cy]));
        record.size = Some(size);
        let rotation = at.require("rotation")?;
        let r = rotation.matrix3()?;
        check_rotation(r).map_err(|message| rotation.fail(message))?;
        let c = DVec3::from_array(at.require("position")?.array()?);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        calibration.records.push(record);
    }
    calibration.note(NoticeCode::MissingValue, "the file has no principal point; the image centre is used");
    Ok(calibration)
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let format = "cameras.json of Gaussian splats";
    let mut text = String::from("[");
    for (i, record) in records.iter().enumerate() {
        record.require_pinhole(format)?;
        let size = record.require_size(format)?;
        let [fx, fy, cx, cy] = record.focals_with(PixelCenter::Half, format)?;
        let middle = middle_of(size, PixelCenter::Half);
        if (cx - middle[0]).abs() > 1e-9 * cx.abs() || (cy - middle[1]).abs() > 1e-9 * cy.abs() {
            let what = format!("the principal point ({cx}, {cy}), which is not at the image centre");
            return Err(record.unsupported_error(format, &what));
        }
        let (rotation, c) = record.require_pose()?.world_r_c();
        let r = matrix_rows3(rotation.matrix());
        let rows: Vec<String> = r.chunks_exact(3).map(|row| format!("[{}]", joined(row, ", "))).collect();
        let _ = write!(
            text,
            "{}\n  {{\"id\": {i}, \"img_name\": {}, \"width\": {}, \"height\": {}, \"position\": [{}], \"rotation\": \
             [{}], \"fy\": {}, \"fx\": {}}}",
            if i == 0 { "" } else { "," },
            quoted(record.image.as_deref().unwrap_or(&record.name)),
            size[0],
            size[1],
            joined(&c.to_array(), ", "),
            rows.join(", "),
            yaml_float(fy),
            yaml_float(fx)
        );
    }
    Ok(OutputFiles::one(text + "\n]\n"))
}
