//! `camera_params_0000.json` of NVIDIA Replicator's BasicWriter, a single file or a folder of them: film in
//! millimetres, axes x right, y up, z backward, matrices for row vectors. Files that raycam writes also contain K, pose
//! and lens.

use glam::{DMat3, DVec3};
use raycam_scene::{ErrorCode, Lens, LensModel, Notice, NoticeCode, PixelCenter};

use crate::document::{Cursor, check_rigid, check_rotation, rigid, yaml};
use crate::intrinsics::pinhole_matrix;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

const START: &str = "camera_params_";

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    ["\"cameraViewTransform\"", "\"cameraFocalLength\"", "\"renderProductResolution\""]
        .iter()
        .all(|key| text.contains(key))
}

/// Returns the camera files of a folder, each with the number in its name.
fn files(folder: &Folder) -> impl Iterator<Item = (&str, &String)> {
    folder.names.iter().filter_map(|name| Some((name.strip_prefix(START)?.strip_suffix(".json")?, name)))
}

pub(crate) fn detect_folder(folder: &Folder, _: &mut AssetRoot) -> bool {
    files(folder).next().is_some()
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    for (number, name) in files(folder) {
        let mut record = camera(&folder.read(name, assets)?, &mut calibration.notices)?;
        record.name = number.to_owned();
        record.image = Some(format!("rgb_{number}.png"));
        calibration.records.push(record);
    }
    Ok(calibration)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    calibration.records.push(camera(source, &mut calibration.notices)?);
    Ok(calibration)
}

fn camera(source: &InputFile, notices: &mut Vec<Notice>) -> Result<CameraRecord> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let name = source.stem().unwrap_or_else(|| "camera".into());
    let size = root.require("renderProductResolution")?;
    let [width, height] = size.array::<2>()?;
    if [width, height].iter().any(|side| side.fract() != 0.0 || !(1.0..65537.0).contains(side)) {
        let message = format!("{width} x {height}; expected width and height, whole numbers from 1 to 65536");
        return Err(size.fail(message));
    }
    let mut record = CameraRecord::new(name, PixelCenter::Half);
    record.size = Some([width as u32, height as u32]);
    if let Some(own) = root.get("raycam") {
        written(&own, &mut record)?;
        return Ok(record);
    }
    let model = root.get("cameraModel").map_or(Ok("pinhole"), |at| at.word())?;
    if model != "pinhole" {
        return Err(root.fail_as(
            ErrorCode::UnsupportedFeature,
            format_args!("cameraModel {model:?} is not supported; expected pinhole"),
        ));
    }
    let focal = root.require("cameraFocalLength")?.number()?;
    let [film_x, film_y] = root.require("cameraAperture")?.array()?;
    let offset = root.get("cameraApertureOffset").map(|at| at.array::<2>()).transpose()?.unwrap_or_default();
    let (fx, fy) = (focal * width / film_x, focal * height / film_y);
    if !(fx > 0.0 && fy > 0.0 && fx.is_finite() && fy.is_finite()) {
        return Err(root.fail(format_args!(
            "cameraFocalLength is {focal}, cameraAperture is [{film_x}, {film_y}]; expected numbers greater than 0"
        )));
    }
    let (cx, cy) = (0.5 * width - offset[0] * width / film_x, 0.5 * height + offset[1] * height / film_y);
    record.k = Some(pinhole_matrix([fx, fy, cx, cy]));
    let view = root.require("cameraViewTransform")?;
    let m = view.array::<16>()?;
    let rows = check_rigid(&std::array::from_fn(|i| m[i % 4 * 4 + i / 4])).map_err(|message| view.fail(message))?;
    let (r, t) = rigid(&rows);
    let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    record.pose = Some(Pose::camera_from_world(Rotation::Matrix(flip * r), flip * t));
    if root.number_or("metersPerSceneUnit", 1.0)? != 1.0 {
        notices.push(Notice::new(
            NoticeCode::AssumedConvention,
            "coordinates are in scene units, not in metres (metersPerSceneUnit is not 1)",
        ));
    }
    Ok(record)
}

/// Reads K, pose and lens from raycam's own keys.
fn written(own: &Cursor<'_>, record: &mut CameraRecord) -> Result<()> {
    record.pixel_center = match own.require("pixel_center")?.word()? {
        "half" => PixelCenter::Half,
        _ => PixelCenter::Integer,
    };
    record.k = Some(own.require("K")?.matrix3()?);
    let at = own.require("R")?;
    let r = at.matrix3()?;
    check_rotation(r).map_err(|message| at.fail(message))?;
    record.pose = Some(Pose::from_r_c(r, DVec3::from_array(own.require("C")?.array()?)));
    let (model, terms) = (own.require("model")?.word()?, own.require("distortion")?.numbers()?);
    record.lens = match model {
        "pinhole" if terms.is_empty() => Lens::Pinhole,
        _ => LensModel::from_name(model).and_then(|model| Lens::new(model, &terms)).map_err(|error| own.fail(error))?,
    };
    Ok(())
}
