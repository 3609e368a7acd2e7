//! Kalibr's camchain: `cam0`, `cam1`, ..., each with intrinsics, distortion and pose.
//!
//! If every camera has `T_cam_imu` (camera from body), or `T_imu_cam` as written by OpenVINS, this is the camera's
//! pose. Otherwise, `T_cn_cnm1` (camera from the previous camera) forms a chain that begins at cam0. Source: Kalibr's
//! wiki, "Yaml formats" and "Supported models".

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{ErrorCode, Lens, LensModel, Notice, NoticeCode, PixelCenter, counted};

use crate::document::Cursor;
use crate::document::number_format::{joined, matrix_rows34, quoted};
use crate::document::yaml;
use crate::files::notice_of_repairs;
use crate::rig::{on_a_body, one_rig, poses_on_one_rig};
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

const KEYS: [&str; 10] = [
    "camera_model",
    "intrinsics",
    "distortion_model",
    "distortion_coeffs",
    "resolution",
    "T_cam_imu",
    "T_imu_cam",
    "T_cn_cnm1",
    "cam_overlaps",
    "rostopic",
];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("cam0:") && text.contains("camera_model")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    // Other top-level keys (such as T_cam1_cam0 in 4Seasons) are not cameras.
    let (cameras, others): (Vec<_>, Vec<_>) =
        root.entries()?.into_iter().partition(|(name, at)| is_camera(name) || at.get("camera_model").is_some());
    for (name, at) in others {
        at.refuse_lens(name)?;
        calibration.note_about(NoticeCode::IgnoredKey, format!("{name} (line {})", at.node.line), "ignored");
    }
    let all_have = |key: &str| cameras.iter().all(|(_, camera)| camera.get(key).is_some());
    let (camera_from_body, body_from_camera) = (all_have("T_cam_imu"), all_have("T_imu_cam"));
    let mut before = Pose::camera_from_world(Rotation::Matrix(DMat3::IDENTITY), DVec3::ZERO);
    let mut steps = Vec::new();
    for (i, (name, camera)) in cameras.into_iter().enumerate() {
        if name != format!("cam{i}") {
            return Err(camera.fail(format_args!("expected cam{i}; cameras must be numbered in order, from cam0")));
        }
        calibration.notices.extend(camera.unknown_keys(&KEYS)?);
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        let [width, height] = camera.require("resolution")?.array::<2>()?;
        let whole = |v: f64| v.fract() == 0.0 && (1.0..65537.0).contains(&v);
        if !(whole(width) && whole(height)) {
            let message = format!("{width} x {height}; expected width and height, whole numbers from 1 to 65536");
            return Err(camera.require("resolution")?.fail(message));
        }
        record.size = Some([width as u32, height as u32]);
        (record.k, record.lens) = intrinsics(&camera)?;
        let matrix = |key: &str| {
            let (r, t) = camera.require(key)?.matrix4()?;
            Ok::<_, FormatError>((Rotation::Matrix(r), t))
        };
        let pose = |key: &str| matrix(key).map(|(r, t)| Pose::camera_from_world(r, t));
        let mut here = if camera_from_body {
            pose("T_cam_imu")?
        } else if body_from_camera {
            let (r, c) = matrix("T_imu_cam")?;
            Pose::world_from_camera(r, c)
        } else if i == 0 {
            before.clone()
        } else {
            let mut step = pose("T_cn_cnm1")?;
            steps.extend(step.orthonormalize().map(|off| (name.to_owned(), off)));
            step.compose(&before)
        };
        record.pose = Some(here.clone());
        here.orthonormalize();
        before = here;
        calibration.records.push(record);
    }
    calibration.notices.extend(notice_of_repairs(&steps));
    match &mut calibration.records[..] {
        // A single camera that is mounted on a body also forms a rig.
        [record] if camera_from_body || body_from_camera => on_a_body(record, "rig"),
        records => one_rig(records, "rig"),
    }
    Ok(calibration)
}

/// True for the names cam0, cam1, and so on.
fn is_camera(name: &str) -> bool {
    name.strip_prefix("cam").is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}

/// Reads K and the lens of a camera.
fn intrinsics(camera: &Cursor<'_>) -> Result<(Option<DMat3>, Lens)> {
    let model = camera.require("camera_model")?;
    let values = camera.require("intrinsics")?;
    let distortion = camera.get("distortion_model").map_or(Ok("none"), |at| at.word())?;
    let coefficients = match camera.get("distortion_coeffs") {
        Some(at) => at.numbers()?,
        None => vec![],
    };
    let name = model.word()?;
    let front = match name {
        "pinhole" => 0,
        "omni" => 1,
        "eucm" | "ds" => 2,
        _ => {
            return Err(model.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported camera_model {name:?}; expected pinhole, omni, eucm or \
            ds"
                ),
            ));
        }
    };
    let all = values.numbers()?;
    if all.len() != front + 4 {
        return Err(values.fail(format_args!(
            "{}; the {name} model requires {}",
            counted(all.len(), "number"),
            front + 4
        )));
    }
    let (shape, focals) = all.split_at(front);
    let k = DMat3::from_cols(
        DVec3::new(focals[0], 0.0, 0.0),
        DVec3::new(0.0, focals[1], 0.0),
        DVec3::new(focals[2], focals[3], 1.0),
    );
    let new = |model, coefficients: &[f64]| Lens::new(model, coefficients).map_err(|error| values.fail(error));
    let zero = coefficients.iter().all(|v| *v == 0.0);
    let lens = match (name, distortion) {
        ("pinhole", _) => camera.lens(distortion, &coefficients)?,
        ("omni", "radtan") => new(LensModel::Omni, &[shape, &coefficients].concat())?,
        ("omni", "none") => new(LensModel::Omni, shape)?,
        ("eucm", _) if distortion == "none" || zero => new(LensModel::Eucm, shape)?,
        ("ds", _) if distortion == "none" || zero => new(LensModel::DoubleSphere, shape)?,
        _ => {
            return Err(model.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!("camera_model {name} with {distortion} distortion {coefficients:?} is not supported"),
            ));
        }
    };
    Ok((Some(k), lens))
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let format = "Kalibr's camchain";
    let mut text = String::new();
    let mut notices = Vec::new();
    let mut before: Option<Pose> = None;
    let poses = poses_on_one_rig(records, format, &mut notices)?;
    for (i, (record, pose)) in records.iter().zip(poses).enumerate() {
        let focals = record.focals_with(PixelCenter::Integer, format)?;
        let (model, shape, distortion, coefficients): (_, &[f64], _, &[f64]) = match record.lens.coefficients() {
            None => ("pinhole", &[], "none", &[]),
            Some((LensModel::OpenCv, d)) if d.len() == 4 => ("pinhole", &[], "radtan", d),
            Some((LensModel::OpenCv, d)) if d[4..].iter().all(|v| *v == 0.0) => ("pinhole", &[], "radtan", &d[..4]),
            Some((LensModel::Fisheye, d)) => ("pinhole", &[], "equidistant", d),
            Some((LensModel::Fov, d)) => ("pinhole", &[], "fov", d),
            Some((LensModel::Omni, d)) if d.len() == 1 => ("omni", d, "none", &[]),
            Some((LensModel::Omni, d)) => ("omni", &d[..1], "radtan", &d[1..]),
            Some((LensModel::Eucm, d)) => ("eucm", d, "none", &[]),
            Some((LensModel::DoubleSphere, d)) => ("ds", d, "none", &[]),
            Some((model, d)) => {
                return Err(
                    record.unsupported_error(format, &format!("the lens model {} with distortion {d:?}", model.name()))
                );
            }
        };
        let [width, height] = record.require_size(format)?;
        let matrix = |name: &str, pose: &Pose| {
            let (r, t) = pose.r_t();
            let mut block = format!("  {name}:\n");
            for row in matrix_rows34(r.matrix(), t) {
                let _ = writeln!(block, "  - [{}]", joined(&row, ", "));
            }
            block + "  - [0.0, 0.0, 0.0, 1.0]\n"
        };
        let mut block = format!("cam{i}:\n");
        block += &matrix("T_cam_imu", &pose);
        if let Some(before) = &before {
            let (r, t) = before.world_r_c();
            block += &matrix("T_cn_cnm1", &pose.compose(&Pose::camera_from_world(r, t)));
        }
        let _ = writeln!(block, "  camera_model: {model}");
        let _ = writeln!(block, "  intrinsics: [{}]", joined(&[shape, &focals].concat(), ", "));
        let _ = writeln!(block, "  distortion_model: {distortion}");
        let _ = writeln!(block, "  distortion_coeffs: [{}]", joined(coefficients, ", "));
        let _ = writeln!(block, "  resolution: [{width}, {height}]");
        let _ = writeln!(block, "  rostopic: {}", quoted(&format!("/{}/image_raw", record.name)));
        text += &block;
        if record.name != format!("cam{i}") {
            notices.push(Notice::new(
                NoticeCode::Renamed,
                format!("in Kalibr's camchain, camera {:?} is called cam{i}", record.name),
            ));
        }
        before = Some(pose);
    }
    Ok(OutputFiles { notices, ..OutputFiles::one(text) })
}
