//! Basalt's calibration: `value0` with `T_imu_cam` (imu_from_camera), `intrinsics` and `resolution`. Source: basalt,
//! doc/Calibration.md and its data files.

use glam::DVec3;
use raycam_scene::{ErrorCode, Lens, LensModel, NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::rig::on_a_body;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"value0\"") && text.contains("\"T_imu_cam\"")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path).require("value0")?;
    let mut calibration = Calibration::default();
    let (poses, cameras) = (root.require("T_imu_cam")?.list()?, root.require("intrinsics")?.list()?);
    let sizes = root.require("resolution")?.list()?;
    if poses.len() != cameras.len() || sizes.len() != cameras.len() {
        return Err(root.fail(format_args!(
            "T_imu_cam has {}, intrinsics has {} and resolution has {}; expected equal numbers",
            counted(poses.len(), "entry"),
            cameras.len(),
            sizes.len()
        )));
    }
    for (i, ((pose, camera), size)) in poses.iter().zip(&cameras).zip(&sizes).enumerate() {
        let mut record = CameraRecord::new(format!("cam{i}"), PixelCenter::Integer);
        let sides = size.list()?;
        let [width, height] = &sides[..] else {
            return Err(size.fail(format_args!("{}; expected width and height", counted(sides.len(), "number"))));
        };
        record.size = Some([width.count()?, height.count()?]);
        let get = |key: &str| pose.require(key)?.number();
        let rotation = Rotation::unit_quaternion([get("qw")?, get("qx")?, get("qy")?, get("qz")?])
            .map_err(|message| pose.fail(message))?;
        record.pose = Some(Pose::world_from_camera(rotation, DVec3::new(get("px")?, get("py")?, get("pz")?)));
        let kind = camera.require("camera_type")?;
        let numbers = camera.require("intrinsics")?;
        let term = |key: &str| numbers.require(key)?.number();
        record.k = Some(pinhole_matrix([term("fx")?, term("fy")?, term("cx")?, term("cy")?]));
        let (model, keys): (_, &[&str]) = match kind.word()? {
            "pinhole" => (None, &[]),
            "ds" => (Some(LensModel::DoubleSphere), &["xi", "alpha"]),
            "eucm" => (Some(LensModel::Eucm), &["alpha", "beta"]),
            "kb4" => (Some(LensModel::Fisheye), &["k1", "k2", "k3", "k4"]),
            "pinhole-radtan8" => (Some(LensModel::OpenCv), &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]),
            other => {
                return Err(kind.fail_as(
                    ErrorCode::UnsupportedFeature,
                    format_args!(
                        "unsupported camera_type {other:?}; expected ds, eucm, kb4, pinhole or pinhole-radtan8"
                    ),
                ));
            }
        };
        let known = [&["fx", "fy", "cx", "cy", "rpmax"], keys].concat();
        numbers.unknown_keys(&known)?;
        let coefficients: Result<Vec<f64>, _> = keys.iter().map(|key| term(key)).collect();
        record.lens = match model {
            None => Lens::Pinhole,
            Some(model) => {
                lens_of(model, &coefficients?).map_err(|message| kind.fail_as(ErrorCode::InvalidLens, message))?
            }
        };
        on_a_body(&mut record, "rig");
        calibration.records.push(record);
    }
    calibration.note(NoticeCode::PlacedCameras, "camera poses are relative to the IMU (T_imu_cam)");
    Ok(calibration)
}
