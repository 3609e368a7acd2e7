//! Cityscapes' `camera` files: K, the position and the angles of the left camera on the vehicle (x forward, y left, z
//! up), and the baseline of the rectified pair. Source: cityscapesScripts, docs/csCalibration.pdf.

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::{Cursor, yaml};
use crate::intrinsics::pinhole_matrix;
use crate::rig::one_rig;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    ["\"extrinsic\"", "\"intrinsic\"", "\"u0\"", "\"v0\"", "\"yaw\""].iter().all(|key| text.contains(key))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let (inner, outer) = (root.require("intrinsic")?, root.require("extrinsic")?);
    let get = |at: &Cursor<'_>, key: &str| at.require(key)?.number();
    let k = pinhole_matrix([get(&inner, "fx")?, get(&inner, "fy")?, get(&inner, "u0")?, get(&inner, "v0")?]);
    let turn = DMat3::from_rotation_z(get(&outer, "yaw")?)
        * DMat3::from_rotation_y(get(&outer, "pitch")?)
        * DMat3::from_rotation_x(get(&outer, "roll")?);
    // The columns are the directions of OpenCV's x, y and z in the camera's own axes (x forward, y left, z up).
    let r = turn * DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);
    let left = DVec3::new(get(&outer, "x")?, get(&outer, "y")?, get(&outer, "z")?);
    let right = outer.get("baseline").map(|at| at.number()).transpose()?.map(|baseline| left + r.x_axis * baseline);
    let mut calibration = Calibration::default();
    for (name, center) in [("left", Some(left)), ("right", right)] {
        let Some(center) = center else { continue };
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.k = Some(k);
        record.size = Some([2048, 1024]);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), center));
        calibration.records.push(record);
    }
    one_rig(&mut calibration.records, "vehicle");
    calibration.note(
        NoticeCode::PlacedCameras,
        "camera poses are relative to the vehicle (x forward, y left, z up); the image size is 2048 x 1024, as in \
         Cityscapes",
    );
    Ok(calibration)
}
