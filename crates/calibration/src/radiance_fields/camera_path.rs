//! `camera_path.json`, a camera path of nerfstudio's viewer: world_from_camera by rows with OpenGL's axes, a vertical
//! field of view in degrees. Source: nerfstudio's camera_paths.py.

use raycam_scene::{LensModel, NoticeCode, PixelCenter};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{lens_of, middle_of, pinhole_matrix, set_panorama};
use crate::trajectory::convention::flip_columns;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"camera_path\"") && text.contains("\"render_width\"")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    for (key, at) in root.entries()? {
        at.refuse_lens(key)?;
    }
    let mut calibration = Calibration::default();
    let size = [root.require("render_width")?.count()?, root.require("render_height")?.count()?];
    let kind = root.get("camera_type");
    let word = kind.as_ref().map_or(Ok("perspective"), Cursor::word)?;
    let fps = root.get("fps").map(|at| at.number()).transpose()?.filter(|fps| *fps > 0.0);
    let fail = |message: String| kind.as_ref().unwrap_or(&root).fail(message);
    for (i, at) in root.require("camera_path")?.list()?.into_iter().enumerate() {
        let mut record = CameraRecord::new(format!("{i:06}"), PixelCenter::Half);
        record.size = Some(size);
        record.time = fps.map(|fps| i as f64 / fps);
        let (gl, c) = at.require("camera_to_world")?.matrix4()?;
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(flip_columns(gl)), c));
        let fov = at.require("fov")?;
        let degrees = fov.number()?;
        if word != "equirectangular" && !(degrees > 0.0 && degrees < 180.0) {
            return Err(
                fov.fail(format_args!("{degrees}; expected a vertical field of view between 0 and 180 degrees"))
            );
        }
        let focal = 0.5 * f64::from(size[1]) / (0.5 * degrees.to_radians()).tan();
        let [cx, cy] = middle_of(size, PixelCenter::Half);
        record.k = Some(pinhole_matrix([focal, focal, cx, cy]));
        match word {
            "perspective" => {}
            "fisheye" => record.lens = lens_of(LensModel::Fisheye, &[0.0; 4]).map_err(fail)?,
            "equirectangular" => set_panorama(&mut record).map_err(fail)?,
            _ => {
                return Err(fail(format!(
                    "unsupported camera_type {word:?}; expected perspective, fisheye or equirectangular"
                )));
            }
        }
        calibration.records.push(record);
    }
    calibration.note(
        NoticeCode::PlacedCameras,
        "the cameras are in the coordinates of the trained scene; dataparser_transforms.json in the run's folder \
         specifies how the original data was rotated and scaled",
    );
    if word == "fisheye" {
        calibration.note(
            NoticeCode::AssumedConvention,
            "the fisheye camera has no lens coefficients; an equidistant fisheye is used, with a focal length \
             computed from fov",
        );
    }
    Ok(calibration)
}
