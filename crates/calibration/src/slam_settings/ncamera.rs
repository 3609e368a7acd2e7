//! Camera systems of SVO Pro and maplab: `cameras:`, each with a `camera` and its mount `T_B_C` (body_from_camera); and
//! the flat `cam_model`, `cam_fx` of SVO and FAST-LIVO2. Sources: rpg_svo_pro_open, vikit; aslam_cv2,
//! ncamera-yaml-serialization.

use raycam_scene::{ErrorCode, Lens, LensModel, Notice, NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, rigid, yaml};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::pose_map;
use crate::rig::on_a_body;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let starts = |word: &str| text.lines().any(|line| line.trim_start_matches([' ', '-', '\t']).starts_with(word));
    starts("T_B_C") && starts("camera:") || starts("cam_model:") && starts("cam_fx:")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    if root.get("cam_model").is_some() {
        calibration.records.push(flat(
            &root,
            source.stem().unwrap_or_else(|| "camera".into()),
            &mut calibration.notices,
        )?);
        return Ok(calibration);
    }
    let nested: Vec<_> = root.entries()?.into_iter().filter(|(_, at)| at.get("cam_model").is_some()).collect();
    if !nested.is_empty() {
        for (name, at) in nested {
            calibration.records.push(flat(&at, name.into(), &mut calibration.notices)?);
        }
        return Ok(calibration);
    }
    // maplab's files contain a list of sensors; one of them contains the cameras.
    let holder = match (root.get("cameras"), root.get("sensors")) {
        (Some(cameras), _) => cameras,
        (None, Some(sensors)) => {
            let inner = sensors.list()?.into_iter().find_map(|sensor| sensor.get("cameras"));
            inner.ok_or_else(|| sensors.fail("no sensor in the list has the key cameras"))?
        }
        (None, None) => return Err(root.fail("cameras is missing")),
    };
    for (i, at) in holder.list()?.into_iter().enumerate() {
        let camera = at.require("camera")?;
        let name = camera.any(&["label", "id"]).map_or(Ok(format!("cam{i}")), |at| at.word().map(str::to_owned))?;
        let name = if name.is_empty() { format!("cam{i}") } else { name };
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.size = Some([camera.require("image_width")?.count()?, camera.require("image_height")?.count()?]);
        set_lens(&camera, &mut record)?;
        let mount = at.require("T_B_C")?;
        let (r, c) = match mount.numbers()?[..] {
            // SVO does not read the last row, so some files contain zeros in it.
            [a, b, c, x, d, e, f, y, g, h, i, z, 0.0, 0.0, 0.0, 0.0] => {
                calibration.note_about(
                    NoticeCode::RepairedRotation,
                    mount.key.clone(),
                    "the last row 0 0 0 0 is read as 0 0 0 1",
                );
                rigid(&[a, b, c, x, d, e, f, y, g, h, i, z])
            }
            _ => mount.matrix4()?,
        };
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        on_a_body(&mut record, "rig");
        calibration.records.push(record);
    }
    calibration.note(NoticeCode::PlacedCameras, "camera poses are relative to the body (T_B_C)");
    Ok(calibration)
}

/// Reads K and the lens of a camera in aslam_cv2's format.
fn set_lens(camera: &Cursor<'_>, record: &mut CameraRecord) -> Result<()> {
    let kind = camera.require("type")?;
    let at = camera.require("intrinsics")?;
    let values = at.numbers()?;
    let distortion = camera.get("distortion");
    let (word, d) = match &distortion {
        Some(map) => {
            let word = map.get("type").map_or(Ok("none"), |at| at.word())?;
            (word, map.get("parameters").map_or(Ok(vec![]), |at| at.numbers())?)
        }
        None => ("none", vec![]),
    };
    let fail = |message: String| distortion.as_ref().unwrap_or(camera).fail(message);
    let (focals, xi) = match (kind.word()?, &values[..]) {
        ("pinhole", [fx, fy, cx, cy]) => ([*fx, *fy, *cx, *cy], None),
        ("omni" | "unified-projection", [xi, fx, fy, cx, cy]) => ([*fx, *fy, *cx, *cy], Some(*xi)),
        ("omni", _) => {
            return Err(kind.fail_as(
                ErrorCode::UnsupportedFeature,
                "raycam does not support the polynomial of OCamCalib (Scaramuzza); calibrate as unified-projection or \
                 equidistant (Kalibr supports both)",
            ));
        }
        (other, _) => {
            return Err(kind.fail(format_args!(
                "{other:?} with {} intrinsics; expected pinhole (4) or unified-projection (5)",
                values.len()
            )));
        }
    };
    record.k = Some(pinhole_matrix(focals));
    record.lens = match (word, xi) {
        ("none" | "null", None) => Ok(Lens::Pinhole),
        ("none" | "null", Some(xi)) => lens_of(LensModel::Omni, &[xi]),
        ("radial-tangential" | "radtan" | "plumb_bob", None) => lens_of(LensModel::OpenCv, &d),
        ("radial-tangential" | "radtan" | "plumb_bob", Some(xi)) => lens_of(LensModel::Omni, &[&[xi][..], &d].concat()),
        ("equidistant", None) => lens_of(LensModel::Fisheye, &d),
        // The fisheye distortion of aslam_cv2 is the FOV model of Devernay and Faugeras.
        ("fisheye", None) if d.len() == 1 => lens_of(LensModel::Fov, &d),
        ("fisheye", None) if d.len() == 4 => lens_of(LensModel::Fisheye, &d),
        _ => Err(format!(
            "distortion {word:?} with {}; expected radial-tangential, equidistant or fisheye",
            counted(d.len(), "parameter")
        )),
    }
    .map_err(fail)?;
    Ok(())
}

/// Reads the camera that the flat keys describe.
fn flat(root: &Cursor<'_>, name: String, notices: &mut Vec<Notice>) -> Result<CameraRecord> {
    let get = |key: &str| root.require(&format!("cam_{key}"))?.number();
    // FAST-LIVO's fisheye cameras have the coefficients k1 to k4.
    let term = |i: usize| match root.get(&format!("cam_d{i}")) {
        Some(at) => at.number(),
        None => root.number_or(&format!("k{}", i + 1), 0.0),
    };
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    let size = [root.require("cam_width")?.count()?, root.require("cam_height")?.count()?];
    let [width, height] = size.map(f64::from);
    let model = root.require("cam_model")?;
    let focals = [get("fx")?, get("fy")?, get("cx")?, get("cy")?];
    let d = [term(0)?, term(1)?, term(2)?, term(3)?];
    let (focals, lens) = match model.word()? {
        "Pinhole" | "pinhole" | "PinholeRadtan" | "PinholeRadialTangential" | "PinholeNoDistortion" => {
            (focals, lens_of(LensModel::OpenCv, &d))
        }
        "EquidistantCamera" | "Equidistant" | "PinholeEquidistant" => (focals, lens_of(LensModel::Fisheye, &d)),
        // ATAN parameters are in units of the image size, from the image's corner.
        "ATAN" | "PinholeAtan" => {
            let [fx, fy, cx, cy] = focals;
            ([fx * width, fy * height, cx * width - 0.5, cy * height - 0.5], lens_of(LensModel::Fov, &d[..1]))
        }
        other => {
            return Err(model.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported cam_model {other:?}; expected Pinhole, \
                 PinholeRadialTangential, ATAN or EquidistantCamera"
                ),
            ));
        }
    };
    record.k = Some(pinhole_matrix(focals));
    record.lens = lens.map_err(|message| model.fail(message))?;
    record.size = Some(size);
    let scale = root.number_or("scale", 1.0)?;
    if scale != 1.0 {
        let message =
            format!("scale is {scale}, by which SVO resizes images; the returned camera has the original size");
        notices.push(Notice::new(NoticeCode::IgnoredKey, message));
    }
    let mount = ["T_cam_body", "T_cam_base", "T_cam_imu"];
    if let Some(at) = root.any(&mount) {
        let rows = match pose_map::read(&at)? {
            Some(rows) => rigid(&rows),
            None => at.matrix4()?,
        };
        record.pose = Some(Pose::camera_from_world(Rotation::Matrix(rows.0), rows.1));
        on_a_body(&mut record, "rig");
        notices.push(Notice::new(
            NoticeCode::PlacedCameras,
            format!("camera poses are relative to the body ({})", at.key),
        ));
    }
    let term = |key: &str| matches!(key, "k1" | "k2" | "k3" | "k4") && root.get("cam_d0").is_none();
    let known = |key: &str| key.starts_with("cam_") || key == "scale" || mount.contains(&key) || term(key);
    notices.extend(root.unread_keys(known)?);
    Ok(record)
}
