//! mrcal's `.cameramodel`: a Python literal with `lensmodel`, `intrinsics`, `extrinsics` (a rotation vector and t,
//! camera_from_reference) and `imagersize`. Source: mrcal's documentation, "Camera model file formats".

use glam::{DMat3, DQuat, DVec3};
use raycam_scene::{Lens, LensModel, PixelCenter};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("LENSMODEL_") && text.contains("lensmodel")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut record = CameraRecord::new(source.stem().unwrap_or_else(|| "camera".into()), PixelCenter::Integer);
    let model = root.any(&["lensmodel", "lens_model", "distortion_model"]);
    let model = model.ok_or_else(|| root.fail("lensmodel is missing"))?;
    let word = model.word()?;
    let name = word.trim_start_matches("LENSMODEL_");
    let at = root.require("intrinsics")?;
    let values = at.numbers()?;
    let count = name.strip_prefix("OPENCV").and_then(|count| count.parse::<usize>().ok());
    let coefficients = match (name, count) {
        ("PINHOLE", _) => 0,
        (_, Some(count @ (4 | 5 | 8 | 12))) => count,
        _ => {
            return Err(model.fail(format_args!(
                "{word}, which raycam has no lens for: expected LENSMODEL_PINHOLE or OPENCV4, 5, 8, 12 \
                 (mrcal-convert-lensmodel fits one)"
            )));
        }
    };
    if values.len() != 4 + coefficients {
        return Err(at.fail(format_args!("{} numbers, {word} has {}", values.len(), 4 + coefficients)));
    }
    record.k = Some(pinhole_matrix([values[0], values[1], values[2], values[3]]));
    record.lens = match coefficients {
        0 => Lens::Pinhole,
        _ => lens_of(LensModel::OpenCv, &values[4..]).map_err(|message| at.fail(message))?,
    };
    let size = root.any(&["imagersize", "imager_size"]).map(|at| at.list()).transpose()?;
    if let Some([width, height]) = size.as_deref() {
        record.size = Some([width.count()?, height.count()?]);
    }
    if let Some(at) = root.get("extrinsics") {
        let [rx, ry, rz, x, y, z] = at.array()?;
        let r = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(rx, ry, rz)));
        record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), DVec3::new(x, y, z)));
    }
    let known = [
        "lensmodel",
        "lens_model",
        "distortion_model",
        "intrinsics",
        "extrinsics",
        "imagersize",
        "imager_size",
        "valid_intrinsics_region",
        "icam_intrinsics",
        "optimization_inputs",
    ];
    Ok(Calibration { records: vec![record], notices: root.unknown_keys(&known)?, ..Calibration::default() })
}
