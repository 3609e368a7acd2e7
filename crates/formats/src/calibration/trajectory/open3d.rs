//! Open3D's JSON: a trajectory, one set of parameters (a saved view) or K alone. Matrices are by columns, `extrinsic` is
//! camera_from_world. Source: Open3D, IJsonConvertible.cpp and PinholeCameraParameters.cpp.

use glam::{DMat3, DVec3};
use raycam_scene::PixelCenter;

use crate::calibration::document::{Cursor, check_rigid, rigid, yaml};
use crate::calibration::files::{Calibration, ReadHints};
use crate::calibration::pose::{Pose, Rotation};
use crate::calibration::record::CameraRecord;
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    if text.contains("\"PinholeCamera") && text.contains("class_name") {
        return true;
    }
    // The intrinsics of the reconstruction system: columns and rows, and nine numbers in a row.
    let own = ["\"width\"", "\"height\"", "\"intrinsic_matrix\""];
    own.iter().all(|key| text.contains(key)) && text.matches(':').count() == 3 && text.matches('[').count() == 1
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration, FormatError> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    if let Some(all) = root.get("parameters") {
        calibration.notices.extend(root.unknown_keys(&[
            "class_name",
            "parameters",
            "version_major",
            "version_minor",
        ])?);
        for (i, at) in all.list()?.into_iter().enumerate() {
            calibration.records.push(parameters(&at, format!("{i:06}"))?);
        }
    } else if root.get("intrinsic").is_some() {
        calibration.records.push(parameters(&root, stem)?);
    } else {
        let mut record = CameraRecord::new(stem, PixelCenter::Integer);
        intrinsics(&root, &mut record)?;
        calibration.records.push(record);
    }
    Ok(calibration)
}

fn parameters(at: &Cursor<'_>, name: String) -> Result<CameraRecord, FormatError> {
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    at.unknown_keys(&["class_name", "intrinsic", "extrinsic", "version_major", "version_minor"])?;
    intrinsics(&at.require("intrinsic")?, &mut record)?;
    let extrinsic = at.require("extrinsic")?;
    let columns = extrinsic.array::<16>()?;
    let rows = std::array::from_fn(|i| columns[4 * (i % 4) + i / 4]);
    let rows = check_rigid(&rows).map_err(|message| {
        extrinsic.fail(format_args!("by columns, as Open3D writes matrices, it is no camera_from_world: {message}"))
    })?;
    let (r, t) = rigid(&rows);
    record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
    Ok(record)
}

fn intrinsics(at: &Cursor<'_>, record: &mut CameraRecord) -> Result<(), FormatError> {
    at.unknown_keys(&["class_name", "width", "height", "intrinsic_matrix", "version_major", "version_minor"])?;
    let matrix = at.require("intrinsic_matrix")?;
    let k = DMat3::from_cols_array(&matrix.array::<9>()?);
    if k.row(2) != DVec3::Z {
        return Err(matrix.fail("expected K by columns, fx 0 0 skew fy 0 cx cy 1, as Open3D writes it"));
    }
    record.k = Some(k);
    record.size = Some([at.require("width")?.count()?, at.require("height")?.count()?]);
    Ok(())
}
