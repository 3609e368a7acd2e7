//! OpenCV's FileStorage, as YAML, JSON or XML, with the keys of its own programs: `calibration` (camera_matrix,
//! distortion_coefficients, image_width, image_height, fisheye_model, extrinsic_parameters), `stereo_calib` (M1 D1 M2 D2
//! R T), and the sensor files of EuRoC and Kimera (T_BS, intrinsics, distortion_model, resolution).

use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use raycam_scene::{Lens, LensModel, PixelCenter};

use crate::calibration::document::Cursor;
use crate::calibration::document::{xml, yaml};
use crate::calibration::files::{Calibration, ReadHints};
use crate::calibration::pose::{Pose, Rotation};
use crate::calibration::record::CameraRecord;
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

const K: [&str; 7] =
    ["camera_matrix", "Camera_Matrix", "cameraMatrix", "K", "camera_intrinsics", "M", "intrinsic_matrix"];
const D: [&str; 8] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "distortion",
    "D",
    "dist_coef",
    "distortion_coeffs",
];
/// Further keys that are known: they are read elsewhere, or do not change the picture.
const OTHER: [&str; 41] = [
    "image_width",
    "image_height",
    "image_Width",
    "image_Height",
    "width",
    "height",
    "image_size",
    "resolution",
    "name",
    "fisheye_model",
    "distortion_model",
    "camera_model",
    "intrinsics",
    "T_BS",
    "R",
    "T",
    "rvec",
    "tvec",
    "time",
    "extrinsic_parameters",
    "Extrinsic_Parameters",
    "calibration_time",
    "Calibration_Time",
    "nframes",
    "nr_of_frames",
    "nrOfFrames",
    "board_width",
    "board_height",
    "board_Width",
    "board_Height",
    "square_size",
    "square_Size",
    "aspectRatio",
    "flags",
    "avg_reprojection_error",
    "Avg_Reprojection_Error",
    "per_view_reprojection_errors",
    "Per_View_Reprojection_Errors",
    "image_points",
    "Image_points",
    "grid_points",
];

pub(crate) fn detect(_: &Path, text: &str) -> bool {
    let has = |word: &str| text.contains(word);
    has("%YAML:1.0") || has("opencv-matrix") || has("<opencv_storage>") || (has("T_BS") && has("intrinsics"))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration, FormatError> {
    let text = source.text()?;
    let node = match text.trim_start().starts_with('<') {
        true => xml::parse(text, &source.path)?,
        false => yaml::parse(text, &source.path)?,
    };
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    if root.any(&K).is_some() || root.get("intrinsics").is_some() {
        camera(&root, source.stem().unwrap_or_else(|| "camera".into()), &mut calibration)?;
        return Ok(calibration);
    }
    if root.get("M1").is_some() {
        return stereo(&root);
    }
    for (name, inner) in root.entries()? {
        if inner.is_map() && (inner.any(&K).is_some() || inner.get("intrinsics").is_some()) {
            camera(&inner, name.to_owned(), &mut calibration)?;
        } else {
            calibration.notices.push(format!("{name} (line {}) is not read", inner.node.line));
        }
    }
    if calibration.records.is_empty() {
        return Err(root.fail(format_args!("no camera in it: expected one of {}", K.join(", "))));
    }
    Ok(calibration)
}

/// `M1`, `D1`, `M2`, `D2`, and `R`, `T` that bring points from the first camera to the second.
fn stereo(root: &Cursor<'_>) -> Result<Calibration, FormatError> {
    let mut calibration = Calibration::default();
    let sizes = ["image_width", "image_height", "image_size", "R", "T", "M1", "D1", "M2", "D2"];
    calibration.notices = root.unknown_keys(&sizes);
    for i in ["1", "2"] {
        let mut record = CameraRecord::new(format!("camera{i}"), PixelCenter::Integer);
        record.k = Some(root.require(&format!("M{i}"))?.matrix3()?);
        record.size = size(root)?;
        let d = root.require(&format!("D{i}"))?;
        record.lens = d.lens("opencv", &d.numbers()?)?;
        if let (true, Some(r), Some(t)) = (i == "2", root.get("R"), root.get("T")) {
            let t = DVec3::from_array(t.array::<3>()?);
            record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r.matrix3()?), t));
        }
        calibration.records.push(record);
    }
    if root.get("R").is_some() {
        crate::calibration::rig::one_rig(&mut calibration.records, "rig");
    }
    Ok(calibration)
}

fn size(at: &Cursor<'_>) -> Result<Option<[u32; 2]>, FormatError> {
    if let Some(size) = at.any(&["image_size", "resolution"]) {
        let [width, height] = size.array::<2>()?;
        let whole = |v: f64| v.fract() == 0.0 && (1.0..65537.0).contains(&v);
        return match whole(width) && whole(height) {
            true => Ok(Some([width as u32, height as u32])),
            false => Err(size.fail("expected columns and rows")),
        };
    }
    let width = at.any(&["image_width", "image_Width", "width"]);
    let height = at.any(&["image_height", "image_Height", "height"]);
    match (width, height) {
        (Some(width), Some(height)) => Ok(Some([width.count()?, height.count()?])),
        _ => Ok(None),
    }
}

/// The camera of a map; several where it has several poses of the board.
fn camera(at: &Cursor<'_>, name: String, calibration: &mut Calibration) -> Result<(), FormatError> {
    calibration.notices.extend(at.unknown_keys(&[&K[..], &D, &OTHER].concat()));
    let name = at.get("name").map_or(Ok(name), |at| at.word().map(str::to_owned))?;
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    record.size = size(at)?;
    record.time = at.get("time").map(|at| at.number()).transpose()?;
    record.k = Some(match at.any(&K) {
        Some(k) => k.matrix3()?,
        None => {
            let [fx, fy, cx, cy] = at.require("intrinsics")?.array::<4>()?;
            DMat3::from_cols(DVec3::new(fx, 0.0, 0.0), DVec3::new(0.0, fy, 0.0), DVec3::new(cx, cy, 1.0))
        }
    });
    if let Some(model) = at.get("camera_model")
        && model.word()? != "pinhole"
    {
        return Err(model.fail(format_args!("{:?}; expected pinhole", model.word()?)));
    }
    record.lens = lens(at)?;
    let r_t = at.get("R").zip(at.get("T"));
    if let Some((r, t)) = r_t {
        let t = DVec3::from_array(t.array::<3>()?);
        let r = match r.numbers()?.len() {
            3 => from_vector(r.array::<3>()?),
            _ => r.matrix3()?,
        };
        record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
    } else if let Some((r, t)) = at.get("rvec").zip(at.get("tvec")) {
        let t = DVec3::from_array(t.array::<3>()?);
        record.pose = Some(Pose::camera_from_world(Rotation::Matrix(from_vector(r.array::<3>()?)), t));
    } else if let Some(pose) = at.get("T_BS") {
        // The body's axes are the world's; the matrix brings points of the sensor to the body.
        let (r, c) = pose.matrix4()?;
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
    } else if let Some(views) = at.any(&["extrinsic_parameters", "Extrinsic_Parameters"]) {
        let numbers = views.numbers()?;
        if numbers.len() % 6 != 0 || numbers.is_empty() {
            return Err(views.fail("expected a rotation vector and a translation for each view, six numbers"));
        }
        for (i, view) in numbers.chunks_exact(6).enumerate() {
            let mut record = record.clone();
            record.name = format!("view{i}");
            let r = from_vector([view[0], view[1], view[2]]);
            let t = DVec3::new(view[3], view[4], view[5]);
            record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
            calibration.records.push(record);
        }
        return Ok(());
    }
    calibration.records.push(record);
    Ok(())
}

fn from_vector(v: [f64; 3]) -> DMat3 {
    DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from_array(v)))
}

fn lens(at: &Cursor<'_>) -> Result<Lens, FormatError> {
    let coefficients = at.any(&D);
    let d = coefficients.as_ref().map_or(Ok(vec![]), Cursor::numbers)?;
    let fisheye = at.get("fisheye_model").map_or(Ok("0"), |at| at.word())?;
    let shown = coefficients.as_ref().unwrap_or(at);
    match (at.get("distortion_model"), fisheye) {
        (Some(model), _) => {
            let name = model.word()?;
            // The name of a lens that OpenCV's own programs have no file for.
            match LensModel::from_name(name) {
                Ok(model) => Lens::new(model, &d).map_err(|error| shown.fail(error)),
                Err(_) => shown.lens(name, &d),
            }
        }
        (None, "0" | "false" | "False") => shown.lens("opencv", &d),
        (None, "1" | "true" | "True") => shown.lens("fisheye", &d),
        (None, other) => Err(at.fail(format_args!("fisheye_model {other:?}; expected 0 or 1"))),
    }
}
