//! Record3D: `metadata` of an export or of an `.r3d` file, with K by columns and poses `qx qy qz qw tx ty tz`,
//! world_from_camera, OpenGL's axes. Source: nerfstudio's record3d_utils.py.

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, yaml, zip_members};
use crate::intrinsics::pinhole_matrix;
use crate::trajectory::convention::flip_columns;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Known keys: keys of the cameras, and keys of depth, colour and the app, which are ignored without a notice.
const OTHER: [&str; 14] = [
    "K",
    "w",
    "h",
    "poses",
    "initPose",
    "perFrameIntrinsicCoeffs",
    "frameTimestamps",
    "dw",
    "dh",
    "fps",
    "cameraType",
    "rangeOfInterest",
    "supportedDepthRange",
    "isUsingTrueDepthCamera",
];

/// True for an `.r3d` file, which is a ZIP file that contains `metadata`.
fn is_r3d(source: &InputFile) -> bool {
    zip_members::is_zip(&source.bytes)
        && zip_members::members(&source.bytes)
            .is_ok_and(|members| members.iter().any(|member| member.name == "metadata"))
}

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    let poses = text.contains("\"poses\"") || text.contains("\"initPose\"");
    poses && text.contains("\"K\"") && (text.contains("\"fps\"") || text.contains("\"dw\"")) || is_r3d(source)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let unpacked;
    let text = if is_r3d(source) {
        let members = zip_members::members(&source.bytes).map_err(|message| FormatError::whole(path, message))?;
        let member = members.iter().find(|member| member.name == "metadata");
        let member =
            member.ok_or_else(|| FormatError::whole(path, "the .r3d file contains no entry named metadata"))?;
        unpacked = member.unpack(&source.bytes, path, &mut assets.budget)?;
        std::str::from_utf8(&unpacked).map_err(|_| FormatError::whole(path, "metadata is not UTF-8 text"))?
    } else {
        source.text()?
    };
    let node = yaml::parse(text, path)?;
    let root = Cursor::root(&node, path);
    let mut calibration = Calibration { notices: root.unknown_keys(&OTHER)?, ..Calibration::default() };
    let k = k_by_columns(&root.require("K")?)?;
    let size = Some([root.require("w")?.count()?, root.require("h")?.count()?]);
    let own = root.get("perFrameIntrinsicCoeffs").map(|at| at.list()).transpose()?.unwrap_or_default();
    let times = root.get("frameTimestamps").map(|at| at.numbers()).transpose()?.unwrap_or_default();
    let poses = match root.get("poses") {
        Some(poses) => poses.list()?,
        None => vec![root.require("initPose")?],
    };
    for (what, count) in [("perFrameIntrinsicCoeffs", own.len()), ("frameTimestamps", times.len())] {
        if count > 0 && count != poses.len() {
            return Err(root.fail(format_args!(
                "{what} has {count} elements for {}; expected equal numbers",
                counted(poses.len(), "pose")
            )));
        }
    }
    for (i, at) in poses.iter().enumerate() {
        let [qx, qy, qz, qw, x, y, z] = at.array()?;
        let rotation = Rotation::unit_quaternion([qw, qx, qy, qz])
            .map_err(|message| at.fail(format_args!("expected qx qy qz qw, then tx ty tz: {message}")))?;
        let mut record = CameraRecord::new(i.to_string(), PixelCenter::Half);
        record.image = Some(format!("rgb/{i}.jpg"));
        record.size = size;
        record.k = Some(match own.get(i) {
            Some(own) => pinhole_matrix(own.array()?),
            None => k,
        });
        record.time = times.get(i).copied();
        let gl = rotation.matrix();
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(flip_columns(gl)), DVec3::new(x, y, z)));
        calibration.records.push(record);
    }
    calibration.note(
        NoticeCode::AssumedConvention,
        "Record3D does not specify the position of pixel centres; the first pixel's centre is assumed at (0.5, 0.5)",
    );
    Ok(calibration)
}

/// Reads K from nine numbers, stored by columns; by rows if the last three numbers are 0 0 1.
fn k_by_columns(at: &Cursor<'_>) -> Result<DMat3> {
    let k = DMat3::from_cols_array(&at.array()?);
    let k = if k.z_axis == DVec3::Z && k.row(2) != DVec3::Z { k.transpose() } else { k };
    match k.row(2) == DVec3::Z {
        true => Ok(k),
        false => Err(at.fail(format_args!("{:?}; expected K by columns: fx 0 0 0 fy 0 cx cy 1", k.to_cols_array()))),
    }
}
